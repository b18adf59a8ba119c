"""Handed-over scenarios in other flavours: they say it otherwise, and mean the same."""

import re
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from tests.approval import refuses
from tests.covering import covering

import bridgegen as bg
from bridgegen.base.errors import FileFormatError, InputError, StorageError, UnsupportedError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import FileResult
from bridgegen.jobs.search.export import FLAVOURS, export
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.validate import validate_file
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import references, walk
from bridgegen.openx.openscenario.read import read
from bridgegen.scenario.language.reader import load

pytestmark = pytest.mark.thorough

SCHEMAS = {
    "1.2": "1.2.0",
    "1.3": "1.3.0",
    "resolved": "1.2.0",
    "recorded": "1.2.0",
    "carla": "1.0.0",
}


class Written(dict[str, Path]):
    """Scenarios of the catalogue, NAME at its defaults and NAME-random, written when asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __missing__(self, label: str) -> Path:
        scenario = load(label.removesuffix("-random"))
        space = scenario.space()
        u = np.random.default_rng(0).random((1, space.n_var))
        row = space.decode(u)[0] if label.endswith("-random") else space.row({})
        write_scenario(Pipeline(scenario, space), row, self.folder, label)
        self[label] = self.folder / f"{label}.xosc"
        return self[label]


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory) -> Written:
    return Written(tmp_path_factory.mktemp("catalogue"))


@cache
def simulated(path: Path) -> FileResult:
    """The simulation of a file of the catalogue, which every flavour is compared with."""
    return bg.simulate_file(path)


@cache
def recorded(path: Path) -> Path:
    """The recording of a file of the catalogue."""
    return export(path, "recorded", out=path.parent / "recorded")[0]


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> bg.Run:
    return bg.run_search(
        "crossroads-s3",
        budget=100,
        keep=3,
        triage="none",
        out=tmp_path_factory.mktemp("runs") / "s3",
    )


EVERY = [f"{one}-random" for one in covering()]
every = pytest.mark.parametrize("name", EVERY)


INDICATES = tuple(
    f"{name}{kind}"
    for name in (
        *("bus-pulls-out", "crosses-to-exit", "lead-breaks-down", "merge-reactions"),
        "passes-parked-van",
    )
    for kind in ("", "-random")
)


LAID = "animal-on-road"
"""A scenario with a trajectory that depends on parameters."""


@pytest.mark.parametrize("name", INDICATES)
def test_lights_are_said_from_1_3_on(catalogue, tmp_path, name):
    with refuses(UnsupportedError, "AppearanceAction", "1.2"):
        export(catalogue[name], "1.2", out=tmp_path)
    path, _ = export(catalogue[name], "resolved", out=tmp_path)
    assert read(path).file_header.rev_minor == 3


@pytest.mark.parametrize(
    ("name", "flavour"),
    [
        (name, flavour)
        for name in EVERY
        for flavour in ("1.2", "1.3", "resolved")
        if name not in INDICATES or flavour != "1.2"
    ],
)
def test_the_same_motion_bit_for_bit(catalogue, tmp_path, name, flavour):
    path, _ = export(catalogue[name], flavour, out=tmp_path)
    assert validate_file(path) == []
    before, after = simulated(catalogue[name]), bg.simulate_file(path)
    assert before.driver == after.driver
    fields = ("x", "y", "h", "v", "a", "offset", "n_steps", "lights")
    pairs = [(getattr(before.rollout, field), getattr(after.rollout, field)) for field in fields]
    if flavour == "resolved" and name.removesuffix("-random") == LAID:
        # Of numbers, a trajectory is cut into samples beforehand; of expressions, when it begins.
        # They are some 1e-15 m beside, so that the ego may brake at another instant.
        assert all(np.allclose(one[:, 1:], other[:, 1:], 0.0, 1e-12) for one, other in pairs[:4])
        assert after.metrics["d_min"] == pytest.approx(before.metrics["d_min"], abs=0.1)
        return
    assert before.metrics == after.metrics
    assert all(np.array_equal(one, other) for one, other in pairs)


@every
def test_recorded_files_play_what_was_recorded(catalogue, name):
    path = recorded(catalogue[name])
    assert validate_file(path) == []
    before, after = simulated(catalogue[name]), bg.simulate_file(path)
    n = before.rollout.n_steps[0]
    assert after.rollout.n_steps[0] == n
    there = before.rollout.present[0, :, :n] if before.rollout.present.size else np.True_
    if after.rollout.present.size:  # who leaves, leaves
        assert np.array_equal(after.rollout.present[0, :, :n], there)
    for field in ("x", "y", "h"):  # at the recorded instants exactly
        a, b = (getattr(one.rollout, field)[0, :, :n] for one in (before, after))
        assert np.array_equal(np.where(there, a, 0.0), np.where(there, b, 0.0))
    ego = [one.rollout.v[0, 0, :n] for one in (before, after)]
    assert np.abs(ego[0] - ego[1]).max() < 1e-6
    assert np.array_equal(before.rollout.lights, after.rollout.lights)
    for metric in ("n_collision", "d_min"):
        assert before.metrics[metric] == after.metrics[metric]
    assert after.metrics["v_d"] == pytest.approx(before.metrics["v_d"], abs=1e-6)
    assert after.metrics["n_brake"] == before.metrics["n_brake"]
    assert after.metrics["a_change"] == pytest.approx(before.metrics["a_change"], abs=1e-6)


@every
def test_recorded_files_say_nothing_but_when_who_is_where(catalogue, name):
    path = recorded(catalogue[name])
    scenario, source = read(path), read(catalogue[name])
    assert scenario.parameter_declarations is None
    assert not any(one.object_controllers for one in scenario.entities.scenario_objects)
    start = scenario.storyboard.init.actions
    assert len(start.privates) == len(source.entities.scenario_objects)
    follows = [one for one in walk(start) if isinstance(one, osc.FollowTrajectoryAction)]
    late = [one for one in walk(source) if isinstance(one, osc.AddEntityAction)]
    assert len(follows) == len(start.privates) - len(late)  # who comes later is followed from then
    for follow in follows:
        timing = follow.time_reference.reference
        assert timing == osc.Timing(osc.ReferenceContext.ABSOLUTE, 1.0, 0.0)
        times = [one.time for one in follow.trajectory_ref.trajectory.shape.shape.vertices]
        assert times[0] == 0.0
        assert (np.diff(times) > 0.0).all()
    assert not any(isinstance(one, osc.AssignRouteAction) for one in walk(scenario))
    assert len(start.global_actions) == len(source.storyboard.init.actions.global_actions)


def test_recording_a_recording_changes_nothing(catalogue, tmp_path):
    first = recorded(catalogue["crossroads-s3"])
    second, _ = export(first, "recorded", out=tmp_path / "b")
    a, b = bg.simulate_file(first), bg.simulate_file(second)
    assert np.array_equal(a.rollout.x, b.rollout.x)
    assert np.abs(a.rollout.v[:, 0] - b.rollout.v[:, 0]).max() < 1e-6


def test_who_comes_and_goes_does_so_in_a_recording(catalogue, tmp_path):
    """The other car of S3 goes after 1 s, and comes back 35 m before the junction after 2 s."""
    text = catalogue["crossroads-s3"].read_text("utf-8")

    def event(name: str, seconds: float, action: str) -> str:
        return f"""<Event name="{name}" priority="parallel" maximumExecutionCount="1">
<Action name="{name}"><GlobalAction><EntityAction entityRef="bv">{action}</EntityAction>
</GlobalAction></Action><StartTrigger><ConditionGroup><Condition name="c" delay="0"
conditionEdge="none"><ByValueCondition><SimulationTimeCondition value="{seconds}"
rule="greaterOrEqual"/></ByValueCondition></Condition></ConditionGroup></StartTrigger></Event>"""

    place = '<Position><LanePosition roadId="4" laneId="1" s="35"/></Position>'
    events = event("goes", 1.0, "<DeleteEntityAction/>")
    events += event("comes", 2.0, f"<AddEntityAction>{place}</AddEntityAction>")
    story = f"""<Story name="visits"><Act name="visits"><ManeuverGroup name="visits"
maximumExecutionCount="1"><Actors selectTriggeringEntities="false"/><Maneuver name="visits">{events}
</Maneuver></ManeuverGroup><StartTrigger><ConditionGroup><Condition name="c" delay="0"
conditionEdge="none"><ByValueCondition><SimulationTimeCondition value="0" rule="greaterOrEqual"/>
</ByValueCondition></Condition></ConditionGroup></StartTrigger></Act></Story>"""
    before, stop, after = text.rpartition("<StopTrigger>")
    source = tmp_path / "visits.xosc"
    source.write_text(before + story + stop + after, "utf-8")
    shutil.copy(catalogue["crossroads-s3"].with_suffix(".xodr"), tmp_path)
    path, _ = export(source, "recorded", out=tmp_path / "out")
    assert validate_file(path) == []
    a, b = bg.simulate_file(source).rollout, bg.simulate_file(path).rollout
    n = a.n_steps[0]
    present = a.present[0, :, :n]
    assert not present[1, 20:40].any()
    assert present[1, 40:].all()
    assert np.array_equal(b.present[0, :, :n], present)
    for field in ("x", "y", "h"):
        assert np.array_equal(
            getattr(a, field)[0, :, :n][present], getattr(b, field)[0, :, :n][present]
        )


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_the_same_bytes_again(catalogue, tmp_path, flavour):
    one = export(catalogue["cut-in"], flavour, out=tmp_path / "a")
    two = export(catalogue["cut-in"], flavour, out=tmp_path / "b")
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]
    again = export(catalogue["cut-in"], flavour, out=tmp_path / "a")
    assert [path.read_bytes() for path in again] == [path.read_bytes() for path in two]


def test_what_is_written_today_is_1_2_or_1_3_where_lights_are_switched(catalogue, tmp_path):
    for name in EVERY:
        path, version = catalogue[name], "1.3" if name in INDICATES else "1.2"
        assert export(path, version, out=tmp_path)[0].read_bytes() == path.read_bytes(), name


def test_only_the_version_s_number_is_another(catalogue, tmp_path):
    old = catalogue["cut-in"].read_text()
    new = export(catalogue["cut-in"], "1.3", out=tmp_path)[0].read_text()
    assert new == old.replace('revMinor="2"', 'revMinor="3"')


@every
def test_resolved_files_hold_no_parameters(catalogue, tmp_path, name):
    path, _ = export(catalogue[name], "resolved", out=tmp_path)
    scenario = read(path)
    assert scenario.parameter_declarations is None
    assert not references(scenario)
    assert "$" not in path.read_text()


def test_what_happens_to_all_happens_at_its_time(catalogue, tmp_path):
    """A light that changes and a road that gets slippery when somebody comes near."""
    text = catalogue["red-light-runner"].read_text()
    (event,) = re.findall(r"<Event name=\"runner_decides\".*?</Event>", text, re.DOTALL)
    name = re.search(r'TrafficSignalStateAction name="([^"]*)"', text)[1]
    light = f"""<Action name="turns"><GlobalAction><InfrastructureAction><TrafficSignalAction>
<TrafficSignalStateAction name="{name}" state="off;on;off"/></TrafficSignalAction>
</InfrastructureAction></GlobalAction></Action>"""
    ice = """<Action name="ice"><GlobalAction><EnvironmentAction><Environment name="ice">
<RoadCondition frictionScaleFactor="0.5"/></Environment></EnvironmentAction></GlobalAction>
</Action>"""
    source = catalogue["red-light-runner"].with_name("changed.xosc")
    source.write_text(
        text.replace(event, event.replace("<StartTrigger>", light + ice + "<StartTrigger>", 1))
    )
    path, _ = export(source, "recorded", out=tmp_path)
    before, after = bg.simulate_file(source).rollout, bg.simulate_file(path).rollout
    (k,) = before.began[0]
    assert 0 < k < before.n_steps[0]
    assert before.event_names == ("runner_decides",)
    assert after.event_names == ("runner_decides", "runner_goes_1")  # it leaves at the road's end
    assert after.began[:, :1].tolist() == before.began.tolist()
    assert np.array_equal(before.lights, after.lights)
    changed = [states for states in before.lights[0] if (states != states[0]).any()]
    assert len(changed) == 1
    assert changed[0][k - 1] != 3
    assert changed[0][k] == 3
    actions = [one.name for one in walk(read(path)) if isinstance(one, osc.Action)]
    assert actions[:2] == ["turns", "ice"]


def test_a_run_s_scenarios_and_their_maps(run, tmp_path):
    paths = export(run.folder, "1.3")
    folder = run.folder / "export" / "1.3"
    kept = [path.name for path in run.scenarios]
    assert [path for path in paths if path.suffix == ".xosc"] == [folder / name for name in kept]
    assert all(path.is_file() for path in paths)
    assert len(paths) == 2 * len(kept)
    chosen = export(run.folder, "resolved", scenarios=["0002"], out=tmp_path)
    assert chosen == [tmp_path / "0002.xosc", tmp_path / "0002.xodr"]


def test_a_map_elsewhere_comes_along(catalogue, tmp_path):
    source, far = catalogue["cut-in"], tmp_path / "maps" / "road.xodr"
    far.parent.mkdir()
    far.write_bytes(source.with_suffix(".xodr").read_bytes())
    moved = tmp_path / "here" / "mine.xosc"
    moved.parent.mkdir()
    text = source.read_text().replace("cut-in.xodr", "../maps/road.xodr")
    moved.write_text(
        text.replace("</RoadNetwork>", '<SceneGraphFile filepath="a.osgb"/></RoadNetwork>')
    )
    paths = export(moved, "1.3")
    folder = moved.parent / "export" / "1.3"
    assert paths == [folder / "mine.xosc", folder / "road.xodr"]
    assert validate_file(paths[0]) == []
    assert 'SceneGraphFile filepath="../../a.osgb"' in paths[0].read_text()


def test_refusals(run, catalogue, tmp_path):
    source = catalogue["cut-in"]

    def refuse(error, text, *arguments, **options):
        with pytest.raises(error, match=text):
            export(*arguments, **options)

    refuse(InputError, "unknown flavour 'recrded'; did you mean 'recorded'", source, "recrded")
    refuse(StorageError, "there is no such folder", tmp_path / "nothing", "1.3")
    refuse(StorageError, "contains no run", tmp_path, "1.3")
    refuse(FileFormatError, "cannot be read", tmp_path / "no.xosc", "1.3")
    refuse(InputError, "0009", run.folder, "1.3", scenarios=["0009"])
    refuse(InputError, "chosen of a run", source, "1.3", scenarios=["0001"])
    refuse(StorageError, "not overwritten", source, "1.3", out=source.parent)
    refuse(StorageError, "not overwritten", run.folder, "1.3", out=run.folder / "critical")
    blocked = tmp_path / "file"
    blocked.write_text("")
    refuse(StorageError, "cannot be written", source, "1.3", out=blocked)
    odd = source.with_name("odd.xosc")
    odd.write_text(
        source.read_text().replace(
            "<CatalogLocations/>", "<CatalogLocations><X/></CatalogLocations>"
        )
    )
    refuse(UnsupportedError, "X in CatalogLocations", odd, "1.3")
    odd.write_text(source.read_text().replace('entityRef="bv"', 'entityRef="nobody"'))
    refuse(FileFormatError, "nobody", odd, "1.3")


def test_a_run_that_kept_nothing(tmp_path):
    run = bg.run_search("crossroads-s4", budget=5, keep=0, triage="none", out=tmp_path / "run")
    with refuses(InputError):
        export(run.folder, "recorded")


@pytest.mark.checkers
@pytest.mark.parametrize("flavour", FLAVOURS)
def test_strangers_accept_every_flavour(checkers, catalogue, tmp_path, flavour):
    without = ("animal-on-", "behind-the-corner", "door-opens")  # no blueprint, or no late entity
    cannot = {"1.2": INDICATES, "carla": [name for name in EVERY if name.startswith(without)]}
    can = [name for name in EVERY if name not in cannot.get(flavour, ())]
    paths = [export(catalogue[name], flavour, out=tmp_path)[0] for name in can]
    for path in paths:
        version = SCHEMAS[flavour]
        if flavour == "resolved" and path.stem in INDICATES:
            version = "1.3.0"
        schema = checkers.schema("qc_openscenario", f"{version}/OpenSCENARIO.xsd")
        assert schema.validate(etree.parse(path)), (path.name, schema.error_log)
    for path, report in zip(paths, checkers.qc_openscenario(*paths), strict=True):
        assert report.clean, (path.name, report)
        assert not report.warnings, (path.name, report)


def test_a_scenario_without_a_map_is_exported_alone(tmp_path):
    text = """<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" date="2025-01-01T00:00:00"
description="" author=""/><CatalogLocations/><RoadNetwork/><Entities><ScenarioObject name="ego">
<Pedestrian name="p" pedestrianCategory="pedestrian" mass="80"><BoundingBox><Center x="0" y="0"
z="1"/><Dimensions width="1" length="1" height="2"/></BoundingBox></Pedestrian></ScenarioObject>
</Entities><Storyboard><Init><Actions><Private entityRef="ego"><PrivateAction><TeleportAction>
<Position><WorldPosition x="1" y="2"/></Position></TeleportAction></PrivateAction></Private>
</Actions></Init><StopTrigger><ConditionGroup><Condition name="c" delay="0" conditionEdge="none">
<ByValueCondition><SimulationTimeCondition value="1" rule="greaterThan"/></ByValueCondition>
</Condition></ConditionGroup></StopTrigger></Storyboard></OpenSCENARIO>"""
    source = tmp_path / "plain.xosc"
    source.write_text(text)
    with refuses(UnsupportedError):
        export(source, "carla")
    for flavour in FLAVOURS.keys() - {"carla"}:
        (only,) = export(source, flavour, out=tmp_path / flavour)
        (there,) = (one for one in walk(read(only)) if isinstance(one, osc.TeleportAction))
        assert (there.position.position.x, there.position.position.y) == (1.0, 2.0)
