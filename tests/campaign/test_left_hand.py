"""Traffic on the left: mirrored scenario, mirrored result, to the last bit.

The law is asked of the whole catalogue: with ``traffic: left`` a scenario has the values, the
verdict and the responsibility that it has without, and its motion with y as −y; its files, read
back, give the same again.
"""

import csv

import numpy as np
import pytest
from tests.approval import approve, refuses
from tests.covering import covering

from bridgegen.assess.conflict.analysis import Responsible, Rule, analyse
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.summary import summarise
from bridgegen.base.errors import FileFormatError, InputError, ScenarioError
from bridgegen.drivers.right_of_way import NOBODY
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.places import places_of
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.validate import validate_file
from bridgegen.openx.convert import convert_file
from bridgegen.openx.file_scenario import load_file_scenario
from bridgegen.openx.opendrive.read import read as read_roads
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.opendrive.validate import problems
from bridgegen.pages.playbacks import nominal_playback
from bridgegen.pages.scenario_page import story_lines
from bridgegen.scenario.countries import COUNTRIES, in_the_mirror
from bridgegen.scenario.language.reader import load, shipped_text
from bridgegen.simulation.trace import write_trace

pytestmark = pytest.mark.thorough

MOTION = ("x", "y", "h", "v", "a", "offset", "began", "n_steps", "detections", "lights", "friction")


@pytest.fixture
def keyed(tmp_path):
    """Make a scenario of the catalogue with more keys."""

    def make(name, *keys):
        path = tmp_path / f"{name}.yaml"
        lines = "".join(f"\n{key}\n" for key in keys)
        path.write_text(shipped_text(name).decode() + lines, encoding="utf-8")
        return load(path)

    return make


def rows(scenario, n, seed=1, **options):
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(**options))
    draws = np.random.default_rng(seed).random((n, pipeline.space.n_var))
    return pipeline, pipeline.space.decode(draws)


def assert_same(got, expected, names_=MOTION):
    for name in names_:
        np.testing.assert_array_equal(getattr(got, name), getattr(expected, name), err_msg=name)


@pytest.mark.parametrize("name", covering())
def test_a_mirrored_scenario_has_the_mirrored_result(keyed, tmp_path, name):
    here, X = rows(load(name), 3)
    there, other = rows(keyed(name, "traffic: left"), 3)
    np.testing.assert_array_equal(X, other)
    right, left = here.rollout(X), there.rollout(X)
    assert_same(left, right)
    world = left.as_driven()
    np.testing.assert_array_equal(world.x, right.x)
    np.testing.assert_array_equal(world.y, -right.y)
    np.testing.assert_array_equal(world.h, -right.h)
    np.testing.assert_array_equal(there.measure(left), here.measure(right))
    a, b = analyse(right), analyse(left)
    assert_same(b, a, ("kind", "type", "responsible", "rule", "severity", "preventable", "instant"))
    files = write_scenario(there, X[0], tmp_path, "mine")
    again = simulate_file(next(path for path in files if path.suffix == ".xosc")).rollout
    assert again.left_hand
    n = int(left.n_steps[0])
    for quantity in ("x", "y", "h", "v"):
        got, expected = (getattr(one, quantity)[0, :, :n] for one in (again, left))
        np.testing.assert_array_equal(got, expected, err_msg=quantity)
    roads = read_roads(tmp_path / "mine.xodr")
    assert {road.rule for road in roads.roads} == {"LHT"}
    assert problems(roads) == []
    assert validate_file(tmp_path / "mine.xosc") == validate_file(tmp_path / "mine.owl") == []


def test_all_files_are_the_same_scenario(keyed, tmp_path):
    """The ontology converts to the same files; and the file can be searched."""
    there, X = rows(keyed("cyclist-swings-out", "traffic: left"), 1)
    write_scenario(there, X[0], tmp_path, "mine")
    (made, _), _ = convert_file(tmp_path / "mine.owl", tmp_path / "again")
    assert made.read_bytes() == (tmp_path / "mine.xodr").read_bytes()
    converted = simulate_file(tmp_path / "again" / "mine.xosc").rollout
    assert_same(converted, simulate_file(tmp_path / "mine.xosc").rollout, ("x", "y", "h", "v"))
    scenario = load_file_scenario(tmp_path / "mine.xosc")
    pipeline = Pipeline(scenario, scenario.space())
    found = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert_same(found, converted, ("x", "y", "h", "v"))
    write_scenario(pipeline, pipeline.space.row({}), tmp_path, "third")
    assert_same(simulate_file(tmp_path / "third.xosc").rollout, found, ("x", "y", "h", "v"))


def test_what_people_see_drives_on_the_left(keyed, tmp_path):
    here, X = rows(load("cut-in"), 1)
    there, _ = rows(keyed("cut-in", "traffic: left"), 1)
    rollout = there.rollout(X)
    write_trace(tmp_path / "trace.csv", rollout)
    with (tmp_path / "trace.csv").open() as file:
        ego = [row for row in csv.DictReader(file) if row["entity"] == "ego"]
    assert float(ego[0]["y"]) == -here.rollout(X).y[0, 0, 0] > 0.0
    seen, usual = (nominal_playback(pipeline, "one", X[0]) for pipeline in (there, here))
    np.testing.assert_array_equal(seen.y, -usual.y)
    for mine, its in zip(seen.lanes, usual.lanes, strict=True):
        assert mine.kind == its.kind
    low = min(points.points[:, 1].min() for points in usual.lanes)
    assert max(points.points[:, 1].max() for points in seen.lanes) == pytest.approx(-low)
    approve("\n".join(story_lines(there.scenario)), "left")


@pytest.mark.parametrize("wants", [(), ("lanes", "map", "conflicts", "history")])
def test_drivers_in_python_see_the_world(keyed, tmp_path, wants):
    """One that steers by the point of its route ahead, and by what lies to its left, answers so."""
    path = tmp_path / "steers.py"
    path.write_text(
        f"""
import numpy as np

class Steers:
    wants = {wants!r}

    def reset(self, n, scene):
        self.maps = scene.maps

    def act(self, o):
        dx, dy = o.route[:, 5, 0] - o.x, o.route[:, 5, 1] - o.y
        aside = dy * np.cos(o.h) - dx * np.sin(o.h)
        curvature = 2.0 * aside / (dx**2 + dy**2) - 1e-3 * o.offset
        curvature += 1e-4 * o.tracks[:, :, 5].sum(1)
        if o.lanes is not None:
            left, right = o.lanes.beside[:, 0, 0], o.lanes.beside[:, 0, 1]
            curvature += 1e-5 * (left[:, 0] * left[:, 1] + right[:, 0] * right[:, 1])
            lane = self.maps[0].lanes[o.map.lane[0]]
            curvature += 1e-6 * (lane.centre[0, 1] + lane.left[0, 1] + lane.right[0, 1])
            assert int(lane.id.rpartition(":")[2]) * (lane.left[0, 1] - lane.centre[0, 1]) != 0.0
            curvature += 1e-6 * o.history[:, :, 3, 5].sum(1)
        return 0.2 * (o.target_speed - o.v), curvature
"""
    )
    options = {"ego": f"{path}:Steers"}
    here, X = rows(load("cut-in"), 4, **options)
    there, _ = rows(keyed("cut-in", "traffic: left"), 4, **options)
    right, left = here.rollout(X), there.rollout(X)
    assert right.status.tolist() == [0] * 4, right.messages
    assert np.ptp(right.offset[:, 0]) > 1e-3  # it steers
    assert_same(left, right, ("x", "y", "h", "v", "a"))


def test_the_law_of_a_country_says_who_goes_first(keyed, tmp_path):
    """Japan's is the mirror image of Germany's; in the United Kingdom nobody goes first."""
    found, driven = {}, {}
    for key in ("DE", "US", "JP", "UK"):
        pipeline, X = rows(keyed("crossroads-s3", f"rules: {key}"), 60, seed=3)
        rollout = driven[key] = pipeline.rollout(X)
        assert rollout.left_hand == (COUNTRIES[key].traffic == "left")
        assert rollout.country == COUNTRIES[key].code
        found[key] = analyse(rollout)
    usual = analyse(rows(load("crossroads-s3"), 60, seed=3)[0].rollout(X))
    for key in ("DE", "US", "JP"):
        assert_same(found[key], usual, ("kind", "responsible", "rule", "severity"))
    assert (driven["UK"].claims[:, 0, 0] == NOBODY).all()
    by_side = usual.rule == Rule.RIGHT_BEFORE_LEFT
    assert by_side.any()
    assert (found["UK"].rule[by_side] == Rule.NO_PRIORITY).any()
    shared = found["UK"].rule == Rule.NO_PRIORITY
    assert (found["UK"].responsible[shared] == Responsible.SHARED).all()
    row = int(np.flatnonzero(by_side.any(axis=1))[0])
    labels = Findings.of(found["JP"], [""] * 60).rule
    assert labels[row] == "left before right"
    approve([summarise(found[key], row).sentence for key in ("US", "JP", "UK")], "left")
    every = [summarise(found[key], i) for key in ("US", "UK") for i in range(60)]
    cited = {each.rule_source for each in every if each} - {""}
    assert len(cited) > 2
    assert not [text for text in cited if "StVO" in text and not text.startswith("German law")]
    write_scenario(pipeline, X[row], tmp_path, "british")
    again = simulate_file(tmp_path / "british.xosc")
    assert again.rollout.country == "GB"
    assert again.conflicts.rule[0].tolist() == found["UK"].rule[row].tolist()


def test_a_map_with_traffic_on_the_left_is_found_and_driven(keyed, tmp_path):
    """The scenario takes place on it as on the same map with traffic on the right."""
    for name in ("crossroads-s4", "motorway-merge"):
        here, X = rows(load(name), 2)
        there, _ = rows(keyed(name, "traffic: left"), 2)
        paths = {}
        for side, pipeline in (("right", here), ("left", there)):
            paths[side] = tmp_path / f"{name}-{side}.xodr"
            paths[side].write_bytes(pipeline.runner.concrete(X[0]).road_data)
            fits, model, _ = places_of(paths[side], load(name))
            assert [fit.lacks for fit in fits] == [""]
            assert model.roads[0].rule == ("LHT" if side == "left" else "RHT")
        ran = {}
        for side, scenario in (("right", load(name)), ("left", there.scenario)):
            road_map = load_map(paths[side], "best", scenario)
            pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(), road_map=road_map)
            x = pipeline.space.row({})[np.newaxis]
            ran[side] = pipeline.rollout(x)
        assert ran["left"].left_hand
        assert_same(ran["left"], ran["right"], ("x", "y", "h", "v"))
        if name == "motorway-merge":  # a map's merge cannot be exported, on either side
            continue
        files = write_scenario(pipeline, x[0], tmp_path, "mine")
        assert (tmp_path / "mine.xodr").read_bytes() == paths["left"].read_bytes()
        again = simulate_file(next(path for path in files if path.suffix == ".xosc")).rollout
        assert_same(again, ran["left"], ("x", "y", "h", "v"))


def test_bad_input_is_refused(keyed, tmp_path):
    with refuses(ScenarioError, "traffic", "middle"):
        keyed("cut-in", "traffic: middle")
    with refuses(ScenarioError, "traffic must be left", "UK", "right"):
        keyed("cut-in", "traffic: right", "rules: UK")
    with refuses(ScenarioError, "rules", "FR"):
        keyed("cut-in", "rules: FR")
    there = keyed("cut-in", "traffic: left")
    here, X = rows(load("cut-in"), 1)
    write_scenario(here, X[0], tmp_path, "mine")
    with refuses(InputError, "left", "mine.xodr", "RHT"):
        road_map = load_map(tmp_path / "mine.xodr", "best", there)
        Pipeline(there, there.space(), PipelineOptions(), road_map=road_map)
    german = keyed("cut-in", "rules: DE")
    with refuses(InputError, "DE", "mine.xodr", "none"):
        road_map = load_map(tmp_path / "mine.xodr", "best", german)
        Pipeline(german, german.space(), PipelineOptions(), road_map=road_map)
    here, X = rows(load("crossroads-s4"), 1)
    write_scenario(here, X[0], tmp_path, "mixed")
    text = (tmp_path / "mixed.xodr").read_text()
    (tmp_path / "mixed.xodr").write_text(text.replace('rule="RHT"', 'rule="LHT"', 1))
    with refuses(FileFormatError, "mixed.xodr", "LHT", "RHT"):
        simulate_file(tmp_path / "mixed.xosc")


def test_sides_turn_in_words_and_nothing_else():
    for text, other in (
        ("did not give way to traffic from the right", "did not give way to traffic from the left"),
        ("Left turn across the right-hand lane", "Right turn across the left-hand lane"),
        ("The ego left its lane, to the left", "The ego left its lane, to the right"),
        ("from the south, turns left, to the west", "from the north, turns right, to the west"),
        ("right of way, at a right angle", "right of way, at a right angle"),
        ("a collision course with 2.2 s left, which", "a collision course with 2.2 s left, which"),
        ("a cut-in that left enough time", "a cut-in that left enough time"),
        ("who has left the bus", "who has left the bus"),
    ):
        assert in_the_mirror(text) == other
        assert in_the_mirror(other) == text
