"""Other people's files: what the ontology can say comes in, all else is named, nothing crashes."""

import math
import re
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree

from bridgegen.cli import main
from bridgegen.errors import BridgeGenError, FileFormatError, InputError, UnsupportedError
from bridgegen.ontology.check import check
from bridgegen.ontology.files import load as load_owl
from bridgegen.openx.convert import convert_file, import_file
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.write import to_xml as roads_to_xml
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.from_owl.weather import time_of_day
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.renaming import rename_entity
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.simulate import simulate_file

CAR = """
      <Vehicle name="car" vehicleCategory="car"><ParameterDeclarations/>
        <BoundingBox><Center x="1.4" y="0.0" z="0.75"/>
          <Dimensions width="1.9" length="4.6" height="1.5"/></BoundingBox>
        <Performance maxSpeed="60" maxAcceleration="5" maxDeceleration="9"/>
        <Axles>
          <FrontAxle maxSteering="0.6" wheelDiameter="0.65" trackWidth="1.6" positionX="2.8"
            positionZ="0.325"/>
          <RearAxle maxSteering="0" wheelDiameter="0.65" trackWidth="1.6" positionX="0"
            positionZ="0.325"/>
        </Axles><Properties/>
      </Vehicle>"""


def starts(name: str, road: int, s: str, speed: str) -> str:
    return f"""
      <Private entityRef="{name}">
        <PrivateAction><LongitudinalAction><SpeedAction>
          <SpeedActionDynamics dynamicsShape="step" dynamicsDimension="time" value="0"/>
          <SpeedActionTarget><AbsoluteTargetSpeed value="{speed}"/></SpeedActionTarget>
        </SpeedAction></LongitudinalAction></PrivateAction>
        <PrivateAction><TeleportAction><Position>
          <LanePosition roadId="{road}" laneId="1" s="{s}" offset="0"/>
        </Position></TeleportAction></PrivateAction>
      </Private>"""


def over_time(seconds: str) -> str:
    return f"""<ConditionGroup><Condition name="over" delay="0" conditionEdge="none">
      <ByValueCondition><SimulationTimeCondition value="{seconds}" rule="greaterOrEqual"/>
      </ByValueCondition></Condition></ConditionGroup>"""


FILE = f"""<?xml version="1.0"?>
<OpenSCENARIO>
  <FileHeader revMajor="1" revMinor="0" date="2020-02-29T10:00:00" description="a stranger's"
    author="somebody"/>
  <ParameterDeclarations>
    <ParameterDeclaration name="Speed" parameterType="double" value="8"/>
    <ParameterDeclaration name="Unused" parameterType="double" value="1.5"/>
  </ParameterDeclarations>
  <CatalogLocations/>
  <RoadNetwork><LogicFile filepath="map.xodr"/></RoadNetwork>
  <Entities>
    <ScenarioObject name="Hero">{CAR}</ScenarioObject>
    <ScenarioObject name="the other one">{CAR}</ScenarioObject>
  </Entities>
  <Storyboard>
    <Init><Actions>
      <GlobalAction><EnvironmentAction><Environment name="Sky">
        <TimeOfDay animation="false" dateTime="2025-03-20T10:00:00"/>
        <Weather cloudState="free">
          <Sun intensity="0.8" azimuth="1.5" elevation="0.5"/>
          <Fog visualRange="1000"/>
          <Precipitation precipitationType="dry" intensity="0"/>
        </Weather>
        <RoadCondition frictionScaleFactor="0.8"/>
      </Environment></EnvironmentAction></GlobalAction>
      {starts("Hero", 1, "30", "$Speed")}
      {starts("the other one", 2, "12.25", "4")}
    </Actions></Init>
    <Story name="S"><ParameterDeclarations/>
      <Act name="A">
        <ManeuverGroup name="G" maximumExecutionCount="1">
          <Actors selectTriggeringEntities="false"><EntityRef entityRef="the other one"/></Actors>
          <Maneuver name="M">
            <Event name="sets off!" priority="overwrite" maximumExecutionCount="1">
              <Action name="a1"><PrivateAction><LongitudinalAction><SpeedAction>
                <SpeedActionDynamics dynamicsShape="linear" dynamicsDimension="rate" value="2"/>
                <SpeedActionTarget><AbsoluteTargetSpeed value="$Speed"/></SpeedActionTarget>
              </SpeedAction></LongitudinalAction></PrivateAction></Action>
              <StartTrigger><ConditionGroup>
                <Condition name="near" delay="0" conditionEdge="none"><ByEntityCondition>
                  <TriggeringEntities triggeringEntitiesRule="any">
                    <EntityRef entityRef="Hero"/></TriggeringEntities>
                  <EntityCondition><RelativeDistanceCondition entityRef="the other one"
                    relativeDistanceType="cartesianDistance" value="20" freespace="false"
                    rule="lessThan"/></EntityCondition>
                </ByEntityCondition></Condition>
              </ConditionGroup></StartTrigger>
            </Event>
          </Maneuver>
        </ManeuverGroup>
        <StartTrigger>{over_time("0")}</StartTrigger>
      </Act>
    </Story>
    <StopTrigger>{over_time("12")}</StopTrigger>
  </Storyboard>
</OpenSCENARIO>
"""

# what the ontology has no words for in it: the sun's share, and half a class of clouds
KNOWN = ('cloudState="free" of Weather', 'intensity="0.8" of Sun', "dateTime=")


def line_of(text: str) -> int:
    return FILE[: FILE.index(text)].count("\n") + 1


@pytest.fixture
def folder(individuals, tmp_path) -> Path:
    (tmp_path / "map.xodr").write_bytes(roads_to_xml(opendrive_from_owl(individuals())))
    (tmp_path / "their.xosc").write_text(FILE)
    return tmp_path


def changed(folder: Path, *edits: tuple[str, str]) -> Path:
    text = FILE
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "their.xosc").write_text(text)
    return folder / "their.xosc"


@pytest.fixture
def plain(folder) -> Path:
    """The same without what the ontology has no words for."""
    return changed(
        folder, ('cloudState="free"', 'fractionalCloudCover="twoOktas"'),
        (' intensity="0.8"', ""), ("2025-03-20T10:00:00", time_of_day(math.degrees(0.5))),
    )  # fmt: skip


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
        assert "cannot be said in the ontology" in problem
        place = line_of(words.partition(" of")[0])
        assert problem.endswith(f"(line {place})")
    assert not (folder / "their.owl").exists()


def test_in_part_the_rest_comes_in(folder):
    owl, left_out = import_file(folder / "their.xosc", partial=True, ego="Hero", strict=True)
    assert [any(words in one for one in left_out) for words in KNOWN] == [True] * 3
    assert check(load_owl(owl)) == []
    assert convert_file(owl, folder / "again")


def test_somebody_must_be_the_ego(plain):
    for partial in (False, True):
        with pytest.raises(UnsupportedError, match="must have the name ego, got Hero, the other"):
            import_file(plain, partial=partial)
    with pytest.raises(InputError, match="no entity has the name 'Nobody'; there are Hero"):
        import_file(plain, ego="Nobody")
    scenario = read(plain)
    with pytest.raises(InputError, match="another entity has that name"):
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
    assert any("a Vehicle of the category train" in one for one in left_out)
    assert any("the other one, an entity that is not stated" in one for one in left_out)
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
    assert any("the Event third, which waits for second" in one for one in left_out)
    assert any("the Event second, which waits for sets off!" in one for one in left_out)
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
    assert "details on which nothing depends that happens" in note
    assert text in note
    assert check(load_owl(owl)) == []
    moves_as(plain, owl, folder)


def moves_as(file: Path, owl: Path, folder: Path) -> None:
    """The individuals, written again, move as the file does: nobody drives, in either."""
    (_, again), _ = convert_file(owl, folder / "again")
    one, other = simulate_file(file).rollout, simulate_file(again).rollout
    count = min(int(one.n_steps[0]), int(other.n_steps[0]))
    for name in one.names:
        a, b = one.names.index(name), other.names.index("ego" if name == "Hero" else name)
        for ours, theirs in ((one.x, other.x), (one.y, other.y), (one.v, other.v)):
            np.testing.assert_allclose(ours[0, a, :count], theirs[0, b, :count], atol=1e-6)


BESIDE = '<LanePosition roadId="2" laneId="1" s="12.25" offset="0"/>'
FIRST = '<LanePosition roadId="1" laneId="1" s="30" offset="0"/>'
SPEED = '<AbsoluteTargetSpeed value="4"/>'
TELEPORT = f"""<PrivateAction><TeleportAction><Position>
          {BESIDE}
        </Position></TeleportAction></PrivateAction>"""
NEAR = FILE[FILE.index("<RelativeDistanceCondition") : FILE.index("</EntityCondition>")]


def follows(*places: str) -> str:
    vertices = "".join(f'<Vertex time="0"><Position>{one}</Position></Vertex>' for one in places)
    return f"""<PrivateAction><RoutingAction><FollowTrajectoryAction><Trajectory name="t"
      closed="false"><ParameterDeclarations/><Shape><Polyline>{vertices}</Polyline></Shape>
      </Trajectory><TimeReference><None/></TimeReference><TrajectoryFollowingMode
      followingMode="position"/></FollowTrajectoryAction></RoutingAction></PrivateAction>"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (BESIDE, '<RelativeLanePosition entityRef="Hero" dLane="-1" ds="9" offset="0.25"/>'),
        (BESIDE, '<RelativeLanePosition entityRef="Hero" dLane="0" ds="-9"/>'),
        (BESIDE, '<RelativeRoadPosition entityRef="Hero" ds="12" dt="0.5"/>'),
        (BESIDE, '<RoadPosition roadId="2" s="12.25" t="2"/>'),
        (BESIDE, '<RelativeObjectPosition entityRef="Hero" dx="12" dy="0.2"/>'),
        (BESIDE, '<RelativeWorldPosition entityRef="Hero" dx="0.1" dy="-12"/>'),
        (BESIDE, '<RoutePosition><RouteRef><Route name="r" closed="false">'
         f'<Waypoint routeStrategy="shortest"><Position>{FIRST}</Position></Waypoint>'
         '<Waypoint routeStrategy="shortest"><Position>'
         '<LanePosition roadId="3" laneId="-1" s="20"/>'
         "</Position></Waypoint></Route></RouteRef><InRoutePosition>"
         '<FromRoadCoordinates pathS="20" t="2"/></InRoutePosition></RoutePosition>'),
        (BESIDE, BESIDE.replace("/>", '><Orientation type="absolute" h="0"/></LanePosition>')),
        (SPEED, '<RelativeTargetSpeed entityRef="Hero" value="-3" continuous="false" '
         'speedTargetValueType="delta"/>'),
        (SPEED, '<RelativeTargetSpeed entityRef="Hero" value="0.5" continuous="false" '
         'speedTargetValueType="factor"/>'),
        ("<StartTrigger>" + over_time("0"), "<StartTrigger>" + over_time("3")),
        ('"near" delay="0" conditionEdge="none"', '"near" delay="1.5" conditionEdge="none"'),
        ('"near" delay="0" conditionEdge="none"', '"near" delay="0" conditionEdge="rising"'),
        (TELEPORT, follows(BESIDE, '<LanePosition roadId="2" laneId="1" s="2"/>')),
        (TELEPORT, follows('<RoadPosition roadId="2" s="12.25" t="-11"/>',
                           '<RoadPosition roadId="2" s="30" t="-12"/>')),
        (NEAR, '<ReachPositionCondition tolerance="2"><Position><RoadPosition roadId="1" s="20" '
         't="1.75"/></Position></ReachPositionCondition>'),
    ],
)  # fmt: skip
def test_what_is_said_otherwise_is_the_same(plain, folder, old, new):
    """Relative to an entity, on a road, in an act that starts later: the same happens."""
    whole = plain.read_text()
    head, _, tail = whole.rpartition(old)
    assert head
    plain.write_text(head + new + tail)
    owl, _ = import_file(plain, ego="Hero")
    assert check(load_owl(owl)) == []
    moves_as(plain, owl, folder)


def pressing(active: str) -> str:
    return f"""<PrivateAction><ControllerAction><OverrideControllerValueAction>
      <Throttle active="{active}" value="0.5"/></OverrideControllerValueAction>
      </ControllerAction></PrivateAction><PrivateAction><LongitudinalAction>"""


def test_a_pedal_that_is_held_matters_and_one_that_is_let_go_of_does_not(plain, folder):
    whole, before = plain.read_text(), "<PrivateAction><LongitudinalAction>"
    plain.write_text(whole.replace(before, pressing("true"), 1))
    with pytest.raises(UnsupportedError, match=r"ControllerAction .*in the ontology"):
        import_file(plain, ego="Hero", strict=True)
    owl, _ = import_file(plain, ego="Hero")
    moves_as(plain, owl, folder)
    owl.unlink()
    plain.write_text(whole.replace(before, pressing("false"), 1))
    owl, (note,) = import_file(plain, ego="Hero")
    assert "ControllerAction" in note
    moves_as(plain, owl, folder)


def test_an_initial_action_of_another_kind_is_one_here(plain, folder):
    text = plain.read_text()
    offset = """<PrivateAction><LateralAction><LaneOffsetAction continuous="false">
      <LaneOffsetActionDynamics dynamicsShape="sinusoidal" maxLateralAcc="0.5"/>
      <LaneOffsetTarget><AbsoluteTargetLaneOffset value="0.5"/></LaneOffsetTarget>
      </LaneOffsetAction></LateralAction></PrivateAction>
      <PrivateAction><LongitudinalAction>"""
    head, _, tail = text.partition("<PrivateAction><LongitudinalAction>")
    plain.write_text(head + offset + tail)
    owl, _ = import_file(plain, ego="Hero")
    assert len(load_owl(owl).of_class("LaneOffsetAction")) == 1
    moves_as(plain, owl, folder)


def test_a_lane_that_is_named_counts_from_the_actor_s(plain, folder):
    text = plain.read_text()
    start = text.index("<LongitudinalAction>", text.index('<Event name="sets off!"'))
    end = text.index("</LongitudinalAction>", start) + len("</LongitudinalAction>")
    change = """<LateralAction><LaneChangeAction><LaneChangeActionDynamics
      dynamicsShape="sinusoidal" dynamicsDimension="time" value="3"/><LaneChangeTarget>{}
      </LaneChangeTarget></LaneChangeAction></LateralAction>"""
    counts = []
    for number, target in enumerate(
        ('<AbsoluteTargetLane value="2"/>', '<RelativeTargetLane entityRef="Hero" value="-1"/>')
    ):
        plain.write_text(text[:start] + change.format(target) + text[end:])
        if "Relative" in target:
            plain.write_text(
                plain.read_text().replace('roadId="1" laneId="1"', 'roadId="2" laneId="1"')
            )
        owl, _ = import_file(plain, folder / f"{number}.owl", ego="Hero")
        found = load_owl(owl)
        counts.append(found.integer(found.one("LaneChangeAction"), "has_lane_count"))
        moves_as(plain, owl, folder / f"made{number}")
    assert counts[0] == counts[1] != 0


# -- lies and nonsense -----------------------------------------------------------------------------


def edited(data: bytes, name: str, *values: str) -> bytes:
    """A file of ours with other values of one property of the header."""
    root = etree.fromstring(data)
    properties = root.find("FileHeader/Properties")
    for one in properties.findall("Property"):
        if one.get("name") == name:
            properties.remove(one)
    for value in values:
        etree.SubElement(properties, "Property", name=name, value=value)
    return etree.tostring(root)


@pytest.mark.parametrize(
    ("scenario", "name", "value", "text"),
    [
        ("crossroads-s4", "parameter.ego_speed.axis", "static", "the axis 'static'"),
        ("crossroads-s4", "parameter.nobody.unit", "m", "Property parameter.nobody.unit"),
        ("crossroads-s4", "parameter.nobody.value", "far", "must be a number, 'far'"),
        ("crossroads-s4", "parameter.nobody.value", "INF", "the number inf in Property"),
        ("crossroads-s4", "parameter..unit", "m", "Property parameter..unit"),
        ("crossroads-s4", "colour", "red", "Property colour"),
        ("crossroads-s4", "time_step", "soon", "must be a number, 'soon'"),
        ("jam-tail-in-fog", "event.jam.class", "Party", "of the class 'Party'"),
        ("jam-tail-in-fog", "event.jam.who.1", "nobody", "an entity that is not stated"),
        ("jam-tail-in-fog", "event.jam.on_lane.1", "1 -9 0.0", "the lane '1 -9 0.0'"),
        ("jam-tail-in-fog", "event.jam.on_lane.1", "here", "the lane 'here'"),
        ("jam-tail-in-fog", "event.jam.time", "late", "must be a number, 'late'"),
        ("jam-tail-in-fog", "event.truck_brakes.class", "TrafficJam", "a second event"),
        ("road-works", "event.works.on_road.1", "99", "the road 99"),
        ("road-works", "event.works.element.1", "truck", "Vehicle truck at road works"),
        ("red-light-runner", "signals.signals.offset", "1e9", "an offset of 1000000000.0 s"),
        ("red-light-runner", "signals.other.offset", "1", "Property signals.other.offset"),
    ],
)  # fmt: skip
def test_a_header_that_lies_is_not_believed(individuals, scenario, name, value, text):
    source = individuals(scenario)
    roads = opendrive_from_owl(source)
    data = edited(to_xml(openscenario_from_owl(source, "map.xodr")), name, value)
    with pytest.raises(UnsupportedError) as caught:
        individuals_from_openscenario(read(data), roads, "map.xodr", "lie.xosc")
    assert any(text in one for one in caught.value.problems), caught.value


def test_a_weather_that_contradicts_itself_is_noticed(individuals, s4):
    """Our own properties say one thing, the standard's elements another."""
    roads = opendrive_from_owl(individuals())
    data = re.sub(rb'visualRange="[^"]*"', b'visualRange="77"', s4)
    with pytest.raises(UnsupportedError, match=r'visualRange="77.0" of Fog \(it would become'):
        individuals_from_openscenario(read(data), roads, "map.xodr")


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('roadId="2" laneId="1" s="12.25"', 'roadId="99" laneId="1" s="1"', "road '99' is not in"),
        ('roadId="2" laneId="1" s="12.25"', 'roadId="2" laneId="9" s="1"', "off the map"),
        ('roadId="2" laneId="1" s="12.25"', 'roadId="2" laneId="1" s="1e9"', "off the map"),
        ('roadId="2" laneId="1"', 'roadId="2" laneId="left"', 'laneId="left"'),
        ('s="12.25"', 's="INF"', "the number inf in LanePosition"),
        ('s="12.25"', 's="${$Speed*2}"', "the expression ${$Speed*2} in LanePosition"),
        ('maxSpeed="60"', 'maxSpeed="INF"', "the number inf in Performance"),
        ('name="the other one">', 'name="Hero">', "a second entity of the name Hero"),
        ('<Private entityRef="the other one">', '<Private entityRef="nobody">', "is no entity"),
    ],
)  # fmt: skip
def test_what_is_nowhere_is_named(plain, old, new, text):
    plain.write_text(plain.read_text().replace(old, new, 1))
    with pytest.raises(UnsupportedError) as caught:
        import_file(plain, strict=True)
    assert any(text in one for one in caught.value.problems), caught.value


def test_hostile_files_are_refused_like_any_other(folder):
    bomb = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'
    (folder / "bomb.xosc").write_text(FILE.replace("<OpenSCENARIO>", bomb + "<OpenSCENARIO>"))
    with pytest.raises(FileFormatError):
        import_file(folder / "bomb.xosc", partial=True)
    (folder / "map.xodr").unlink()
    with pytest.raises(FileFormatError, match=r"map\.xodr: cannot be read"):
        import_file(folder / "their.xosc", ego="Hero", strict=True)
    changed(folder, ('<LogicFile filepath="map.xodr"/>', ""))
    with pytest.raises(FileFormatError, match="needs a LogicFile"):
        import_file(folder / "their.xosc", ego="Hero", strict=True)


@settings(max_examples=80)
@given(data=st.data())
def test_whatever_stands_in_an_attribute_nothing_crashes(individuals, s4, data):
    roads = opendrive_from_owl(individuals())
    found = list(re.finditer(rb'="([^"]*)"', s4))
    spoilt = s4
    for k in sorted(data.draw(st.sets(st.integers(0, len(found) - 1), max_size=3)), reverse=True):
        new = data.draw(st.sampled_from(_NASTY) | st.sampled_from(_values(found)))
        spoilt = spoilt[: found[k].start(1)] + new + spoilt[found[k].end(1) :]
    try:
        scenario = read(spoilt)
    except BridgeGenError:
        return
    with suppress(UnsupportedError):
        individuals_from_openscenario(scenario, roads, "map.xodr")
    try:
        again, lost = individuals_from_openscenario(scenario, roads, "map.xodr", partial=True)
    except UnsupportedError:
        return
    assert again.one("Scenario")
    assert all(isinstance(one, str) for one in lost)


_NASTY = [
    b"", b"0", b"-1", b"1e308", b"INF", b"$ego_speed", b"${$ego_speed*2}", b"ego", b"bv",
    b"a b#c/d%", b"\xc3\xa4:x", b"event", b"true", b"step", b"parameter.x.y", b"1;2",
]  # fmt: skip


def _values(found) -> list[bytes]:
    return sorted({one[1] for one in found})


# -- the command -----------------------------------------------------------------------------------


def run(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    monkeypatch.setattr("sys.argv", ["bridgegen", *map(str, words)])
    with pytest.raises(SystemExit) as end:
        main()
    return int(end.value.code or 0)


def test_the_command(folder, monkeypatch, capsys):
    file = folder / "their.xosc"
    assert run(monkeypatch, "import", file, "--ego", "Hero", "--strict") == 2
    err = capsys.readouterr().err
    assert err.count("cannot be said in the ontology") == len(KNOWN)
    assert run(monkeypatch, "import", file, "--ego", "Hero", "--strict", "--partial") == 0
    out = capsys.readouterr()
    assert out.out.strip() == str(folder / "their.owl")
    assert out.err.count("bridgegen: note: left out: ") == len(KNOWN)
    assert run(monkeypatch, "validate", folder / "their.owl") == 0
    assert run(monkeypatch, "import", file, "--ego", "Hero", "--partial") == 2
    assert "exists already" in capsys.readouterr().err
    assert run(monkeypatch, "import", folder / "map.xodr", "--partial") == 2
    assert "only a scenario" in capsys.readouterr().err


def test_lines_are_those_of_the_file(plain):
    text = plain.read_text().replace(
        '"G" maximumExecutionCount="1"', '"G" maximumExecutionCount="2"'
    )
    plain.write_text(text)
    with pytest.raises(UnsupportedError) as caught:
        import_file(plain, ego="Hero", strict=True)
    line = text[: text.index('"G" maximumExecutionCount="2"')].count("\n") + 1
    assert caught.value.problems == (
        f'{plain}: maximumExecutionCount="2" of ManeuverGroup cannot be said in the ontology '
        f"(line {line})",
    )
