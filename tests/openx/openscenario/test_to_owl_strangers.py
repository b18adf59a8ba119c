"""Other people's files: what the ontology can say comes in, all else is named, nothing crashes."""

import re

import pytest
from tests.approval import approve, refuses
from tests.openx.openscenario.strangers import KNOWN, line_of, moves_as, over_time

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.openx.convert import convert_file, import_file
from bridgegen.openx.openscenario.parameters import rename_entity
from bridgegen.openx.openscenario.read import read
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import load as load_owl

# -- what comes in ---------------------------------------------------------------------------------


def test_a_file_of_others_comes_in_whole(plain):
    owl, left_out = import_file(plain, ego="Hero", strict=True)
    assert left_out == []
    found = load_owl(owl)
    scenario = found.one("Scenario")
    assert found.text(scenario, "has_name") == "a stranger's"
    assert found.number(scenario, "has_duration") == 12.0
    event = found.one("StoryboardEvent")
    assert found.text(event, "has_name") == "sets off!"
    assert found.text(found.link(event, "has_who"), "has_name") == "the other one"
    action = found.link(event, "has_what")
    assert (found.number(action, "has_target_speed"), found.number(action, "has_rate")) == (8.0, 2)
    assert found.parameter(action, "has_target_speed") == "Speed"
    condition = found.one("RelativeDistanceCondition")
    assert found.text(found.link(condition, "has_subject"), "has_name") == "ego"
    assert found.text(condition, "has_rule") == "lessThan"
    # 10⁴·200^(−f/100) m = 1 km; altitude and azimuth in degrees; two eighths of the sky
    assert found.number(found.one("Fog"), "has_fog_density") == pytest.approx(43.458, abs=1e-3)
    assert found.number(found.one("Sun"), "has_sun_altitude_angle") == pytest.approx(28.6479, 1e-5)
    assert found.number(found.one("Cloud"), "has_cloudiness") == 25.0
    assert found.number(found.one("RoadState"), "has_friction") == 0.8
    assert found.of_class("Rain") == []
    units = {found.text(p, "has_name"): (found.text(p, "has_unit"), found.text(p, "has_axis"))
             for p in found.of_class("Parameter")}  # fmt: skip
    assert units == {"Speed": ("m/s", "participants"), "Unused": ("1", "participants")}
    assert check(found) == []


def test_an_expression_that_is_only_a_name_is_a_parameter(plain):
    plain.write_text(plain.read_text().replace('s="12.25"', 's="${ ($Speed) }"'))
    owl, left_out = import_file(plain, ego="Hero", strict=True)
    assert left_out == []
    found = load_owl(owl)
    places = {found.parameter(one, "has_distance") for one in found.of_class("LanePosition")}
    assert places == {None, "Speed"}


def test_it_is_the_same_scenario_when_it_is_written_again(plain, folder):
    owl, _ = import_file(plain, ego="Hero", strict=True)
    (_, again), _ = convert_file(owl, folder / "again")
    twice, left_out = import_file(again, folder / "twice.owl")
    assert left_out == []
    (_, third), _ = convert_file(twice, folder / "third")
    ours = again.read_bytes()
    assert third.read_bytes().replace(b"twice.xodr", b"their.xodr") == ours
    assert b'"$Speed"' in ours
    assert read(ours).file_header.description == "a stranger's"


def test_what_has_no_words_is_named_all_at_once(folder):
    with pytest.raises(UnsupportedError) as caught:
        import_file(folder / "their.xosc", ego="Hero", strict=True)
    for words in KNOWN:
        (problem,) = [one for one in caught.value.problems if words in one]
        assert problem.startswith(str(folder / "their.xosc"))
        approve(problem, "ontology")
        place = line_of(words.partition(" of")[0])
        assert problem.endswith(f"(line {place})")
    assert not (folder / "their.owl").exists()


def test_in_part_the_rest_comes_in(folder):
    owl, left_out = import_file(folder / "their.xosc", partial=True, ego="Hero", strict=True)
    assert [any(words in one for one in left_out) for words in KNOWN] == [True] * 3
    assert check(load_owl(owl)) == []
    assert convert_file(owl, folder / "again")


def test_the_first_entity_is_the_ego_where_none_is_called_so(plain, tmp_path):
    owl, notes = import_file(plain, tmp_path / "first.owl")
    approve(notes, plain, "--ego")
    named, _ = import_file(plain, tmp_path / "named.owl", ego="Hero")
    assert named.read_text("utf-8") == owl.read_text("utf-8")


def test_the_ego_is_an_entity_of_the_file(plain):
    with refuses(InputError, "Nobody"):
        import_file(plain, ego="Nobody")
    scenario = read(plain)
    with refuses(InputError):
        rename_entity(scenario, "Hero", "the other one")
    assert rename_entity(rename_entity(scenario, "Hero", "x"), "x", "Hero") == scenario


# -- what does not ---------------------------------------------------------------------------------

RATE = 'dynamicsDimension="rate" value="2"'
TARGET = '<SpeedActionTarget><AbsoluteTargetSpeed value="$Speed"/></SpeedActionTarget>\n  '
RELATIVE = (
    '<SpeedActionTarget><RelativeTargetSpeed entityRef="Hero" value="1" continuous="false" '
    'speedTargetValueType="delta"/></SpeedActionTarget>\n  '
)


@pytest.mark.parametrize(
    ("old", "new", "text", "gone"),
    [
        # an event that cannot be said is not said at all
        (TARGET, RELATIVE, "RelativeTargetSpeed", True),
        ('freespace="false"', 'freespace="true"', 'freespace="true" of RelativeDistance', True),
        ("cartesianDistance", "lateral", 'relativeDistanceType="lateral"', True),
        ("<EntityRef entityRef=\"Hero\"/></Trig", "<EntityRef entityRef=\"Hero\"/>"
         '<EntityRef entityRef="the other one"/></Trig', "on 2 TriggeringEntities", True),
        ('"false"><EntityRef', '"true"><EntityRef', "selectTriggeringEntities", True),
        ("sets off!\" priority=\"overwrite\"", "sets off!\" priority=\"skip\"",
         'priority="skip" of Event', False),
        (RATE, 'dynamicsDimension="rate" value="-2"', "a rate [m/s²] of -2.0", True),
        (RATE, 'dynamicsDimension="rate" value="${$Speed/4}"', "the expression ${$Speed/4}", True),
        ("<StartTrigger>" + over_time("0"), "<StartTrigger>" + over_time("3"),
         "the Act A, which starts later,", True),
        # a detail is
        ('maximumExecutionCount="1">\n              <Action', 'maximumExecutionCount="3">\n'
         "              <Action", 'maximumExecutionCount="3" of Event', False),
        ('"G" maximumExecutionCount="1"', '"G" maximumExecutionCount="2"',
         'maximumExecutionCount="2" of ManeuverGroup', False),
        ('maxSteering="0.6"', 'maxSteering="0.5"', 'maxSteering="0.5" of Axle', False),
        ("<Properties/>", '<Properties><Property name="colour" value="red"/></Properties>',
         "Property colour", False),
        ('parameterType="double" value="1.5"', 'parameterType="string" value="x"',
         "ParameterDeclaration Unused", False),
        ('parameterType="double" value="1.5"', 'parameterType="integer" value="1"',
         'parameterType="integer" of ParameterDeclaration', False),
        ('value="1.5"/>', 'value="1.5"><ConstraintGroup><ValueConstraint rule="lessThan" '
         'value="2"/></ConstraintGroup></ParameterDeclaration>', "ValueConstraint", False),
        ('visualRange="1000"', 'visualRange="20"', 'visualRange="20.0" of Fog', False),
        ('visualRange="1000"', 'visualRange="$Unused"', 'visualRange="$Unused" of Fog', False),
        ("<Fog ", '<Wind direction="1" speed="5"/><Fog ', 'direction="1.0" of Wind', False),
        ('elevation="0.5"', 'elevation="0.5" illuminance="7"', 'illuminance="7.0" of Sun', False),
        (over_time("12"), over_time("12") + over_time("1").replace("greaterOrEqual", "lessThan"),
         "ConditionGroup", False),
        (over_time("12"), over_time("12").replace("greaterOrEqual", "greaterThan"),
         'rule="greaterThan" of SimulationTimeCondition', False),
        ("<LogicFile", '<SceneGraphFile filepath="x.osgb"/><LogicFile', "SceneGraphFile", False),
        ('offset="0"/>', 'offset="0"><Orientation type="relative" p="1"/></LanePosition>',
         'p="1.0" of Orientation', False),
        ('author="somebody"/>', 'author="somebody"><License name="CC0"/></FileHeader>',
         "License", False),
        # what the reader does not know goes with the event, the action or the trigger around it
        (TARGET, TARGET + "<Wheels/>", "Wheels in SpeedAction is not supported", True),
        ('rule="lessThan"', 'rule="lessThan" colour="red"', "attribute colour", False),
        ("<TeleportAction>", "<HoverAction/><TeleportAction>", "HoverAction", True),
    ],
)  # fmt: skip
def test_each_thing_is_named_and_in_part_left_out(plain, folder, old, new, text, gone):
    whole = plain.read_text()
    assert old in whole
    head, _, tail = whole.rpartition(old)
    plain.write_text(head + new + tail)
    with pytest.raises(UnsupportedError) as caught:
        import_file(plain, ego="Hero", strict=True)
    assert any(text in one for one in caught.value.problems), caught.value
    owl, left_out = import_file(plain, partial=True, ego="Hero", strict=True)
    assert any(text in one for one in left_out), left_out
    assert all(re.search(r"\(line \d+\)$", one) for one in left_out)
    found = load_owl(owl)
    assert (found.of_class("StoryboardEvent") == []) == gone
    assert check(found) == []
    (_, again), _ = convert_file(owl, folder / "again")
    assert import_file(again, folder / "again.owl")[1] == []


def test_who_cannot_be_said_takes_along_what_is_about_them(plain):
    text = plain.read_text()
    second = text.rindex('vehicleCategory="car"')
    plain.write_text(text[:second] + 'vehicleCategory="train"' + text[second + 21 :])
    owl, left_out = import_file(plain, partial=True, ego="Hero", strict=True)
    approve(left_out, "category")
    approve(left_out, "entity")
    found = load_owl(owl)
    assert len(found.of_class("TrafficParticipant")) == 1
    assert found.of_class("Event") == []


def test_events_that_end_each_other_are_not_like_events_that_stand_alone(plain):
    text = plain.read_text()
    start, end = text.index("            <Event "), text.index("</Event>") + len("</Event>")
    second = text[start:end].replace("sets off!", "second")
    for priority, count in (("parallel", 0), ("overwrite", 2)):
        both = (text[start:end] + second).replace('"overwrite"', f'"{priority}"')
        plain.write_text(text[:start] + both + text[end:])
        owl, left_out = import_file(plain, partial=True, ego="Hero", strict=True)
        owl.unlink()
        assert len(left_out) == count
        assert all('priority="overwrite" of Event' in one for one in left_out)


def test_names_that_would_be_others_of_ours_are_changed(plain):
    """Of an entity that is called like a parameter's individual, the scenario, a start."""
    for name in ("p_Speed", "scenario", "ego_start", "road_network", "road:1", "a b#c"):
        plain.write_text(plain.read_text().replace("the other one", name))
        owl, left_out = import_file(plain, ego="Hero", strict=True)
        assert left_out == []
        found = load_owl(owl)
        assert check(found) == []
        assert name in {found.text(one, "has_name") for one in found.of_class("Car")}
        plain.write_text(plain.read_text().replace(f'"{name}"', '"the other one"'))
        owl.unlink()


def test_who_waits_for_what_cannot_be_said_goes_too(plain):
    text = plain.read_text()
    start = text.index("            <Event ")
    end = text.index("</Event>") + len("</Event>")
    event = text[start:end]
    after = """<StartTrigger><ConditionGroup><Condition name="c" delay="1" conditionEdge="none">
      <ByValueCondition><StoryboardElementStateCondition storyboardElementType="event"
      storyboardElementRef="{}" state="completeState"/></ByValueCondition></Condition>
      </ConditionGroup></StartTrigger></Event>"""
    more = [
        event[: event.index("<StartTrigger>")].replace("sets off!", name) + after.format(other)
        for name, other in (("third", "second"), ("second", "sets off!"), ("fine", "fourth"))
    ]
    more.append(event.replace("sets off!", "fourth"))
    lateral = event.replace("cartesianDistance", "lateral")
    plain.write_text(text[:start] + "\n".join([lateral, *more]) + text[end:])
    owl, left_out = import_file(plain, partial=True, ego="Hero", strict=True)
    approve(left_out, "second")
    approve(left_out, "second")
    found = load_owl(owl)
    names = {found.text(one, "has_name") for one in found.of_class("Event")}
    assert names == {"fine", "fourth"}


# -- in substance ----------------------------------------------------------------------------------


DETAILS = [
    ('maxSteering="0.6"', 'maxSteering="0.5"', 'maxSteering="0.5" of Axle'),
    ("<Properties/>", '<Properties><Property name="colour" value="red"/></Properties>',
     "Property colour"),
    ('parameterType="double" value="1.5"', 'parameterType="string" value="x"',
     "ParameterDeclaration Unused"),
    ('name="car" vehicleCategory', 'name="car_red" vehicleCategory', 'name="car_red" of Vehicle'),
    ("<LogicFile", '<SceneGraphFile filepath="x.osgb"/><LogicFile', "SceneGraphFile"),
    ('author="somebody"/>', 'author="somebody"><License name="CC0"/></FileHeader>', "License"),
    ('visualRange="1000"', 'visualRange="50000"', 'visualRange="50000.0" of Fog'),
    (RATE, 'dynamicsDimension="rate" value="-2"', 'value="-2.0" of TransitionDynamics'),
    (RATE, 'dynamicsDimension="rate" value="${$Speed/4}"', 'value="${$Speed/4}"'),
    ('s="12.25"', 's="${$Speed+4.25}"', 's="${$Speed+4.25}" of LanePosition'),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "text"), DETAILS)
def test_a_detail_does_not_keep_a_file_out(plain, folder, old, new, text):
    whole = plain.read_text()
    head, _, tail = whole.rpartition(old)
    plain.write_text(head + new + tail)
    with pytest.raises(UnsupportedError):
        import_file(plain, ego="Hero", strict=True)
    owl, (note,) = import_file(plain, ego="Hero")
    approve(note, "details")
    assert text in note
    assert check(load_owl(owl)) == []
    moves_as(plain, owl, folder)
