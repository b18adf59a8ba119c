"""Files for CARLA's ScenarioRunner: who is where when as here, said as it reads them."""

import re
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from tests.approval import refuses
from tests.covering import covering

import bridgegen as bg
from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.export import export
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario.language.reader import load

pytestmark = pytest.mark.thorough

MM = 1e-3
REFUSED = ("animal-on-road", "behind-the-corner", "door-opens")
"""CARLA has no animals, and nobody comes late there."""
NAMED = (
    "crossroads-s1",
    "crossroads-s3",
    "crossroads-s4",
    "cut-in",
    "red-light-runner",
    "road-works",
)
TAKEN = [name for name in covering() if name not in REFUSED]


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory) -> dict[str, tuple[Path, Path]]:
    """Every scenario of the catalogue once at random, and as it is exported."""
    folder = tmp_path_factory.mktemp("catalogue")
    paths = {}
    for name in {*TAKEN, *NAMED}:
        scenario = load(name)
        space = scenario.space()
        row = space.decode(np.random.default_rng(1).random((1, space.n_var)))[0]
        write_scenario(Pipeline(scenario, space), row, folder, name)
        source = folder / f"{name}.xosc"
        paths[name] = source, export(source, "carla")[0]
    return paths


every = pytest.mark.parametrize("name", TAKEN)


def find(element, kind):
    return [one for one in walk(element) if isinstance(one, kind)]


def middles(result):
    """Where the middle of each entity's box is at each instant, by the ontology's own sizes."""
    rollout = result.rollout
    n, ahead = rollout.n_steps[0], rollout.box[:, 2:]
    x, y, h = (one[0, :, :n] for one in (rollout.x, rollout.y, rollout.h))
    return x + ahead * np.cos(h), y + ahead * np.sin(h), h


@every
def test_positions_read_back_are_the_rollout_s(catalogue, name):
    source, path = catalogue[name]
    result = bg.simulate_file(source)
    x, y, h = middles(result)
    scenario = read(path)
    starts = {one.entity_ref: find(one, osc.TeleportAction) for one in find(scenario, osc.Private)}
    for e, entity in enumerate(("hero", *result.rollout.names[1:])):
        place = starts[entity][0].position.position
        assert np.hypot(place.x - x[e, 0], place.y - y[e, 0]) < MM
        assert abs(place.h - h[e, 0]) < 1e-6
    moved = 0
    for group in find(scenario, osc.ManeuverGroup):
        for follow in find(group, osc.FollowTrajectoryAction):
            e = result.rollout.names.index(group.actors.entity_refs[0].entity_ref)
            vertices = follow.trajectory_ref.trajectory.shape.shape.vertices
            time = np.array([one.time for one in vertices])
            k = np.rint(time / result.rollout.time_step).astype(int)
            assert np.abs(k * result.rollout.time_step - time).max() < 1e-9
            assert k[0] == 0
            assert k[-1] == x.shape[1] - 1
            if np.ptp(x[e]) or np.ptp(y[e]):
                assert len(k) == x.shape[1]
                moved += 1
            else:
                assert len(k) == 2
            there = np.array([[p.x, p.y] for p in (one.position.position for one in vertices)])
            assert np.abs(there - np.stack([x[e, k], y[e, k]], axis=1)).max() < MM
    assert moved > 0


@every
def test_the_ego_is_the_hero_and_is_left_to_its_driver(catalogue, name):
    source, path = catalogue[name]
    scenario, before = read(path), read(source)
    (hero,) = (one for one in scenario.entities.scenario_objects if one.name == "hero")
    assert hero.entity_object.properties.get("type") == "ego_vehicle"
    assert hero.entity_object.name.startswith("vehicle.")
    (start,) = (one for one in find(scenario, osc.Private) if one.entity_ref == "hero")
    (speed,) = find(start, osc.AbsoluteTargetSpeed)
    assert speed.value == bg.simulate_file(source).rollout.v[0, 0, 0]
    (control,) = find(start, osc.ControllerAction)
    assert control.override_controller_value_action is not None
    assert control.assign_controller_action.controller.properties.get("module") == (
        "bridgegen_control.py"
    )
    assert not find(start, osc.RoutingAction)
    for group in find(scenario, osc.ManeuverGroup):
        if group.actors.entity_refs[0].entity_ref == "hero":
            assert not find(group, osc.PrivateAction)
    assert len(scenario.entities.scenario_objects) == len(before.entities.scenario_objects)


@every
def test_it_is_what_scenario_runner_takes(catalogue, name):
    _, path = catalogue[name]
    scenario, text = read(path), path.read_text("utf-8")
    header = scenario.file_header
    assert (header.rev_major, header.rev_minor) == (1, 0)
    assert re.fullmatch(r"[\w.-]+", header.description)  # a file's name, and not CARLA: …
    assert scenario.road_network.logic_file.filepath == f"{name}.xodr"
    assert (path.parent / f"{name}.xodr").is_file()
    assert not find(scenario, osc.AssignRouteAction | osc.AcquirePositionAction)
    assert "$" not in text
    moments = find(scenario, osc.TimeOfDay)
    assert len(moments) == 1 or name in ("fog-thickens", "rain-sets-in")  # once more at each step
    for moment in moments:
        assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d", moment.date_time)
        assert moment.animation is False
    names_of = [one.name for one in find(scenario, osc.Event | osc.Action | osc.ManeuverGroup)]
    assert len(set(names_of)) == len(names_of)  # ScenarioRunner keeps its state by them
    root = etree.fromstring(text.encode())
    for node in root.iter("FollowTrajectoryAction"):  # as 1.0 has it
        assert [one.tag for one in node][-1] == "Trajectory"
    for private in root.iter("Private"):  # ScenarioRunner takes the last Position of all
        assert len(list(private.iter("Position"))) == 1
    for vertex in root.iter("Vertex"):
        assert "time" in vertex.attrib
    assert to_xml(scenario) == path.read_bytes()


@every
def test_what_the_ego_is_judged_by(catalogue, name):
    _, path = catalogue[name]
    scenario = read(path)
    judged = {one.name for one in find(scenario.storyboard.stop_trigger, osc.Condition)}
    expected = {"criteria_CollisionTest", "criteria_OffRoadTest", "duration"}
    roads = etree.parse(path.with_suffix(".xodr"))
    if roads.findall(".//signal[@dynamic='yes']"):
        expected.add("criteria_RunningRedLightTest")
    if roads.findall(".//signal[@type='206']"):
        expected.add("criteria_RunningStopTest")
    assert judged == expected
    for one in find(scenario, osc.ParameterCondition):
        assert (one.parameter_ref, one.value) == ("", "")  # the criterion's own arguments


def test_lights_stand_where_carla_puts_them_and_show_what_they_did(catalogue):
    carla = pytest.importorskip("carla")
    source, path = catalogue["red-light-runner"]
    theirs = carla.Map("map", path.with_suffix(".xodr").read_text())
    spots = [
        (one.transform.location.x, one.transform.location.y)
        for one in theirs.get_all_landmarks_of_type("1000001")
    ]
    rollout = bg.simulate_file(source).rollout
    assert len(rollout.light_names) == 4
    seen: dict[str, list[tuple[float, str]]] = {}
    for event in find(read(path), osc.Event):
        (clock,) = find(event.start_trigger, osc.SimulationTimeCondition)
        for one in find(event, osc.TrafficSignalStateAction):
            seen.setdefault(one.name, []).append((clock.value, clock.rule, one.state))
    assert len(seen) == 4
    for name, turns in seen.items():
        x, y = (float(one) for one in name.removeprefix("pos=").split(","))
        assert min(np.hypot(x - a, y - b) for a, b in spots) < 0.3  # CARLA clears the lanes
        assert sum(np.hypot(x - a, y - b) < 2.0 for a, b in spots) == 1  # ScenarioRunner's reach
        assert turns[0][:2] == (rollout.time_step, osc.Rule.LESS_THAN)  # at once
        assert {state for *_, state in turns} <= {"red", "yellow", "green", "off"}
    lamps = {0: "off", 1: "red", 2: "red", 3: "yellow", 4: "green"}
    first = sorted(turns[0][2] for turns in seen.values())
    assert first == sorted(lamps[int(state)] for state in rollout.lights[0, :, 0])
    (control,) = (one for one in find(read(path), osc.Controller) if one.name == "hero_control")
    assert control.properties.get("traffic_lights") == "stand"


def test_a_light_that_turns_on_the_way_turns_at_its_time(catalogue, tmp_path):
    source, _ = catalogue["red-light-runner"]
    text = source.read_text()
    light = re.search(r'TrafficSignalStateAction name="([^"]*)"', text)[1]
    (event,) = re.findall(r"<Event name=\"runner_decides\".*?</Event>", text, re.DOTALL)
    turn = f"""<Action name="turns"><GlobalAction><InfrastructureAction><TrafficSignalAction>
<TrafficSignalStateAction name="{light}" state="off;on;off"/></TrafficSignalAction>
</InfrastructureAction></GlobalAction></Action><Action name="fog"><GlobalAction><EnvironmentAction>
<Environment name="fog"><Weather><Fog visualRange="50"/></Weather></Environment></EnvironmentAction>
</GlobalAction></Action>"""
    changed = source.with_name("changed.xosc")
    changed.write_text(
        text.replace(event, event.replace("<StartTrigger>", turn + "<StartTrigger>", 1))
    )
    rollout = bg.simulate_file(changed).rollout
    (k,) = rollout.began[0]
    assert k > 0
    scenario = read(export(changed, "carla", out=tmp_path)[0])
    assert find(scenario, osc.TrafficSignalStateAction)[-1].state == "yellow"
    later = {
        one.name: find(one.start_trigger, osc.SimulationTimeCondition)[0]
        for one in find(scenario, osc.Event)
    }
    for name in (f"lights_{k}", "weather_1"):  # the first tick whose time is not before
        assert later[name].rule is osc.Rule.GREATER_THAN
        assert later[name].value == pytest.approx((k - 0.5) * rollout.time_step)
    start, fog = find(scenario, osc.Weather)
    assert fog.fog.visual_range == 50.0
    assert (fog.sun, fog.precipitation) == (start.sun, start.precipitation)


def test_the_exported_file_plays_here_too(catalogue):
    """Participants go through the same again in the embedded simulator, whoever the ego is."""
    source, path = catalogue["cut-in"]
    before = bg.simulate_file(source)
    after = bg.simulate_file(path).rollout
    x, y, _ = middles(before)
    n = min(x.shape[1], after.n_steps[0])
    assert n > 50
    assert np.abs(after.x[0, 1, :n] - x[1, :n]).max() < MM
    assert np.abs(after.y[0, 1, :n] - y[1, :n]).max() < MM


def test_where_the_ego_arrives_ends_the_act(catalogue):
    source, path = catalogue["crossroads-s1"]
    (place,) = find(read(path).storyboard.stories[0].acts[0].stop_trigger, osc.WorldPosition)
    rollout = bg.simulate_file(source).rollout
    end = rollout.n_steps[0] - 1
    assert rollout.n_steps[0] < 401  # it did arrive
    off = np.hypot(rollout.x[0, 0, end] - place.x, rollout.y[0, 0, end] - place.y)
    assert off < 2.0 + 0.5  # the tolerance, and a step


def test_on_a_hill_everybody_starts_on_the_ground(catalogue, tmp_path):
    source, _ = catalogue["cut-in"]
    hill = tmp_path / "hill.xosc"
    hill.write_bytes(source.read_bytes())
    flat = source.with_suffix(".xodr").read_text()
    level = r'<elevation s="0[.0]*" a="0[.0]*" b="0[.0]*"'
    assert re.search(level, flat)
    rises = re.sub(level, '<elevation s="0" a="7" b="0.02"', flat)
    (tmp_path / f"{source.stem}.xodr").write_text(rises)
    scenario, before = read(export(hill, "carla", out=tmp_path / "out")[0]), read(source)
    numbers = {one.name: one.value for one in before.parameter_declarations.parameters}
    for old, new in zip(find(before, osc.Private), find(scenario, osc.Private), strict=True):
        s = find(old, osc.TeleportAction)[0].position.position.s
        s = float(numbers[s.name]) if isinstance(s, osc.ParameterRef) else s
        (place,) = find(new, osc.WorldPosition)
        assert place.z == pytest.approx(7.0 + 0.02 * s)


def test_a_run_on_a_town_names_the_town(catalogue, tmp_path):
    town = tmp_path / "Town05.xodr"  # what it is called is what counts
    town.write_bytes(catalogue["crossroads-s4"][1].with_suffix(".xodr").read_bytes())
    run = bg.run_search(
        "crossroads-s4",
        algorithm="random",
        budget=400,
        keep=1,
        road_map=town,
        triage="none",
        out=tmp_path / "run",
    )
    paths = export(run.folder, "carla")
    assert [one.name for one in paths] == ["0001.xosc", "bridgegen_control.py"]
    assert read(paths[0]).road_network.logic_file.filepath == "Town05"
    alone = export(run.scenarios[0], "carla", out=tmp_path)  # a file, that says of no town
    assert alone[1] == tmp_path / "0001.xodr"


def test_signs_stand_fast_and_cones_do_not(catalogue):
    _, path = catalogue["road-works"]
    fast = {
        one.name: one.entity_object.properties.get("physics") == "off"
        for one in read(path).entities.scenario_objects
        if isinstance(one.entity_object, osc.MiscObject)
    }
    assert {name for name, is_fast in fast.items() if is_fast} == {"works_sign"}
    assert len(fast) > 3


def test_an_ego_alone_has_its_time(catalogue, tmp_path):
    """ScenarioRunner ends with its stories: the weather, stated again, is the last thing done."""
    source, _ = catalogue["cut-in"]
    root = etree.parse(source).getroot()
    for tag in ("ScenarioObject[@name='bv']", "Private[@entityRef='bv']", "Story"):
        for one in root.findall(f".//{tag}"):
            one.getparent().remove(one)
    alone = source.with_name("alone.xosc")
    alone.write_bytes(etree.tostring(root))
    path = export(alone, "carla", out=tmp_path)[0]
    scenario = read(path)
    (event,) = find(scenario, osc.Event)
    start, again = find(scenario, osc.Environment)
    assert again == start
    (clock,) = find(event.start_trigger, osc.SimulationTimeCondition)
    rollout = bg.simulate_file(alone).rollout
    end = (rollout.n_steps[0] - 1) * rollout.time_step
    assert clock.value == pytest.approx(end - rollout.time_step / 2)


def test_refusals(catalogue, tmp_path):
    source, _ = catalogue["crossroads-s3"]
    text = source.read_text()

    def refuse(error, message, changed, **options):
        odd = source.with_name("odd.xosc")
        odd.write_text(changed)
        with pytest.raises(error, match=message):
            export(odd, "carla", out=tmp_path, **options)

    gone = """<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"/><Maneuver name="m"><Event name="e" priority="parallel">
<Action name="goes"><GlobalAction><EntityAction entityRef="bv"><DeleteEntityAction/></EntityAction>
</GlobalAction></Action><StartTrigger><ConditionGroup><Condition name="c" delay="0"
conditionEdge="none"><ByValueCondition><SimulationTimeCondition value="1" rule="greaterThan"/>
</ByValueCondition></Condition></ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup>
<StartTrigger><ConditionGroup><Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<SimulationTimeCondition value="0" rule="greaterOrEqual"/></ByValueCondition></Condition>
</ConditionGroup></StartTrigger></Act></Story>"""
    before, stop, after = text.rpartition("<StopTrigger>")
    refuse(
        UnsupportedError,
        r"odd.xosc: the entity bv must be there from",
        before + gone + stop + after,
    )
    refuse(UnsupportedError, "another name", text.replace('"bv"', '"hero"'))
    tram = text.replace('vehicleCategory="car"', 'vehicleCategory="tram"')
    refuse(UnsupportedError, "that CARLA has, got vehicleCategory tram", tram)
    snow = re.sub(r'precipitationType="[^"]*"', 'precipitationType="snow"', text)
    assert snow != text
    refuse(UnsupportedError, "CARLA has no snow", snow)
    with refuses(InputError):
        export(source, "carla", town="../Town05", out=tmp_path)
