"""Other people's files: what comes in moves, written again, as the file does."""

import re
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lxml import etree
from tests.approval import approve, refuses
from tests.openx.openscenario.strangers import FILE, KNOWN, changed, moves_as, over_time

from bridgegen.base.errors import BridgeGenError, FileFormatError, UnsupportedError
from bridgegen.cli import main
from bridgegen.engine.simulate import simulate_file
from bridgegen.openx.convert import convert_file, import_file
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import load as load_owl

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
    with refuses(UnsupportedError, "ControllerAction"):
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
    with refuses(UnsupportedError, "77.0"):
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
        ('name="the other one">', 'name="Hero">', "a second entity of the name"),
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
    with refuses(FileFormatError, "map.xodr"):
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
    assert run(monkeypatch, "ontology", "import", file, "--entity", "Hero", "--strict") == 2
    err = capsys.readouterr().err
    assert err.count("cannot be said in the ontology") == len(KNOWN)
    assert (
        run(monkeypatch, "ontology", "import", file, "--entity", "Hero", "--strict", "--partial")
        == 0
    )
    out = capsys.readouterr()
    assert out.out.strip() == str(folder / "their.owl")
    assert out.err.count("bridgegen: note: left out: ") == len(KNOWN)
    assert run(monkeypatch, "validate", folder / "their.owl") == 0
    assert run(monkeypatch, "ontology", "import", file, "--entity", "Hero", "--partial") == 2
    assert "exists already" in capsys.readouterr().err
    assert run(monkeypatch, "ontology", "import", folder / "map.xodr", "--partial") == 2
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


# -- in OpenSCENARIO's own words -------------------------------------------------------------------

SETS_OFF = FILE[FILE.index("<LongitudinalAction>", FILE.index("<Event ")) :]
SETS_OFF = SETS_OFF[: SETS_OFF.index("</LongitudinalAction>") + len("</LongitudinalAction>")]
RELATIVE = SETS_OFF.replace(
    '<AbsoluteTargetSpeed value="$Speed"/>',
    '<RelativeTargetSpeed entityRef="Hero" value="${$Speed-2}" speedTargetValueType="delta" '
    'continuous="false"/>',
)
BOXES = NEAR.replace('freespace="false"', 'freespace="true" coordinateSystem="lane"').replace(
    "cartesianDistance", "lateral"
)


@pytest.mark.parametrize(
    ("old", "new", "cls"),
    [
        (SETS_OFF, RELATIVE, "OpenScenarioAction"),
        (NEAR, BOXES.replace('value="20"', 'value="1e3"'), "OpenScenarioCondition"),
        (NEAR, '<RelativeSpeedCondition entityRef="the other one" value="-1" rule="greaterThan"/>',
         "OpenScenarioCondition"),
        (SETS_OFF, '<TeleportAction><Position><RelativeObjectPosition entityRef="Hero" dx="40" '
         'dy="3"/></Position></TeleportAction>', "OpenScenarioPosition"),
        (SETS_OFF, '<LongitudinalAction><LongitudinalDistanceAction entityRef="Hero" distance="-9" '
         'freespace="true" continuous="true" coordinateSystem="lane" displacement='
         '"trailingReferencedEntity"/></LongitudinalAction>', "OpenScenarioAction"),
    ],
)  # fmt: skip
def test_what_has_no_words_is_kept_in_those_of_openscenario(plain, folder, old, new, cls):
    text = plain.read_text()
    assert old in text
    plain.write_text(text.replace(old, new))
    owl, _ = import_file(plain, ego="Hero")
    found = load_owl(owl)
    (quoted,) = found.of_class(cls)
    assert "$" not in found.text(quoted, "has_openscenario")
    assert not [one for one in check(found) if "requires" in str(one)]
    moves_as(plain, owl, folder)
    twice, _ = import_file(folder / "again" / "their.xosc", folder / "twice.owl")
    assert [load_owl(twice).text(one, "has_openscenario") for one in load_owl(twice).of_class(cls)]


ACT = '<StartTrigger><ConditionGroup><Condition name="over" delay="0" conditionEdge="none">'


def test_an_act_that_starts_by_what_does_not_last_is_an_act(plain, folder):
    """The event's own condition holds from the start; it may happen once the act has begun."""
    text = plain.read_text()
    start = text.rindex("<StartTrigger>", 0, text.index("</Act>"))
    end = text.index("</StartTrigger>", start) + len("</StartTrigger>")
    near = text[text.index("<StartTrigger>", text.index("<Event ")) : start]
    near = near[: near.index("</StartTrigger>") + len("</StartTrigger>")]
    plain.write_text(text[:start] + near.replace('value="20"', 'value="12"') + text[end:])
    owl, _ = import_file(plain, ego="Hero")
    found = load_owl(owl)
    (act,) = found.of_class("Act")
    assert found.link(found.one("StoryboardEvent"), "in_act") == act
    moves_as(plain, owl, folder)


def test_events_that_end_one_another_share_their_maneuver(plain, folder):
    """A lane offset that a change of speed ends, as only within one maneuver."""
    text = plain.read_text()
    first, last = text.index("<Event "), text.index("</Event>") + len("</Event>")
    event = text[first:last]
    aside = """<LateralAction><LaneOffsetAction continuous="true"><LaneOffsetActionDynamics
      dynamicsShape="sinusoidal" maxLateralAcc="0.02"/><LaneOffsetTarget>
      <AbsoluteTargetLaneOffset value="1"/></LaneOffsetTarget></LaneOffsetAction></LateralAction>"""
    other = event.replace("sets off!", "aside").replace(SETS_OFF, aside)
    begins = other.index("<StartTrigger>")
    other = other[:begins] + f"<StartTrigger>{over_time('0.5')}</StartTrigger></Event>"
    plain.write_text(text[:first] + other + event + text[last:])
    owl, _ = import_file(plain, ego="Hero")
    found = load_owl(owl)
    said = {found.text(one, "in_maneuver") for one in found.of_class("StoryboardEvent")}
    assert len(said) == 1
    moves_as(plain, owl, folder)


def test_what_never_begins_is_left_out_and_named(plain, folder):
    text = plain.read_text()
    end = text.index("</Act>")
    start = text.rindex("<StartTrigger>", 0, end)
    plain.write_text(text[:start] + "<StartTrigger/>" + text[end:])
    owl, (note,) = import_file(plain, ego="Hero")
    approve(note, "StartTrigger")
    assert load_owl(owl).of_class("StoryboardEvent") == []
    moves_as(plain, owl, folder)
    now, _ = import_file(plain, folder / "now.owl", ego="Hero", empty_trigger="now")
    assert len(load_owl(now).of_class("StoryboardEvent")) == 1


@pytest.mark.parametrize(("value", "count"), [("8", 1), ("9", 0)])
def test_a_condition_on_a_parameter_is_decided(plain, folder, value, count):
    text = plain.read_text()
    end = text.index("</ConditionGroup>", text.index("<Event "))
    condition = f"""<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
      <ParameterCondition parameterRef="Speed" value="{value}" rule="equalTo"/>
      </ByValueCondition></Condition>"""
    plain.write_text(text[:end] + condition + text[end:])
    owl, notes = import_file(plain, ego="Hero")
    assert len(load_owl(owl).of_class("StoryboardEvent")) == count
    assert any("ParameterCondition" in one for one in notes) == (count == 0)
    moves_as(plain, owl, folder)


def test_the_end_and_its_variables_come_in(plain, folder):
    """It ends 3 s after the other one has set off: a variable says so, and is kept."""
    text = plain.read_text()
    event = text.index("</Action>", text.index("<Event "))
    sets = """</Action><Action name="counts"><GlobalAction><VariableAction variableRef="off">
      <SetAction value="${$Speed/2}"/></VariableAction></GlobalAction>"""
    text = text[:event] + sets + text[event:]
    declared = """</ParameterDeclarations><VariableDeclarations>
      <VariableDeclaration name="off" variableType="double" value="0"/></VariableDeclarations>"""
    text = text.replace('revMinor="0"', 'revMinor="2"')
    text = text.replace("</ParameterDeclarations>\n  <Catalog", declared + "\n  <Catalog")
    if declared not in text:
        at = text.index("</ParameterDeclarations>")
        text = text[:at] + declared + text[at + len("</ParameterDeclarations>") :]
    stop = """<ConditionGroup><Condition name="s" delay="3" conditionEdge="none"><ByValueCondition>
      <VariableCondition variableRef="off" value="4" rule="equalTo"/></ByValueCondition>
      </Condition></ConditionGroup></StopTrigger>
  </Storyboard>"""
    at = text.rindex("</StopTrigger>")
    plain.write_text(text[:at] + stop + "\n</OpenSCENARIO>\n")
    owl, _ = import_file(plain, ego="Hero")
    assert len(load_owl(owl).of_class("Variable")) == 1
    moves_as(plain, owl, folder)
    steps = [int(simulate_file(one).rollout.n_steps[0])
             for one in (plain, folder / "again" / "their.xosc")]  # fmt: skip
    assert steps[0] == steps[1] < 12.0 / 0.05


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<PrivateAction>", "has_openscenario"),
        ("<Position/>", "PrivateAction"),
        ("<PrivateAction/>", "PrivateAction"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><PrivateAction>&b;</PrivateAction>', "entit"),
    ],
)
def test_what_is_quoted_is_not_trusted(plain, folder, text, problem):
    plain.write_text(plain.read_text().replace(SETS_OFF, RELATIVE))
    owl, _ = import_file(plain, ego="Hero")
    whole = owl.read_text("utf-8")
    start = whole.index("<bg:has_openscenario")
    first, last = whole.index(">", start) + 1, whole.index("</bg:has_openscenario>")
    hostile = text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    owl.write_text(whole[:first] + hostile + whole[last:], "utf-8")
    with refuses(BridgeGenError, problem):
        convert_file(owl, folder / "again")
