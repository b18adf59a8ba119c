import importlib.util
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from tests.approval import refuses
from tests.ego.planners.observed import (
    BODY_LENGTH,
    CENTRE,
    DT,
    LEFT,
    RIGHT,
    WIDTH,
    drive,
    lane,
    light,
    observation,
    road_map,
    scene,
    together,
    track,
)

from bridgegen.adapters.planners import fiss
from bridgegen.base.errors import InputError
from bridgegen.drivers import kinds

needs_planner = pytest.mark.skipif(
    importlib.util.find_spec("fiss_planner") is None, reason="fiss-planner is not installed"
)
FIRST = np.full(1, np.nan)


def test_the_map_is_told_with_what_markings_allow_and_without_shoulders():
    tables = fiss.map_tables(road_map())
    limit, left, to_left, right, to_right, n = tables["lanes"].T
    assert limit.tolist() == [36.0, 36.0]
    assert left.tolist() == [1, -1]
    assert right.tolist() == [-1, 0]
    assert to_left.tolist() == [1, 0]
    assert to_right.tolist() == [0, 1]
    assert n.sum() == len(tables["centre"]) == len(tables["left"]) == len(tables["right"])
    assert tables["route"].tolist() == [0]
    assert fiss.map_tables(road_map(may_change=False))["lanes"][0].tolist()[1:3] == [1, 0]


def test_a_lane_of_the_other_way_is_no_neighbour():
    found = road_map()
    against = tuple(replace(one, left_is_same_way=False) for one in found.lanes)
    lanes = fiss.map_tables(replace(found, lanes=against))["lanes"]
    assert lanes[0].tolist()[1:3] == [-1, 0]


def test_lanes_follow_each_other_where_both_are_told():
    found = road_map()
    lanes = (lane("a", 0.0, next=("b", "walk")), lane("b", 0.0), lane("walk", 0.0, "sidewalk"))
    assert fiss.map_tables(replace(found, lanes=lanes))["next"].tolist() == [[0, 1]]


def test_a_stop_line_is_where_its_light_says_and_active_at_red():
    tables = fiss.map_tables(road_map(lights=[light(100.0)]))
    assert tables["stop_lines"].tolist() == [[0.0, 100.0, 0.0], [1.0, 100.0, 0.0]]
    for state, stops in enumerate([False, True, True, True, False]):
        seen = observation([track()], state=state)
        assert fiss.stop_lines_active(seen, 0, tables).tolist() == [stops, stops]


def test_the_ego_is_told_by_the_centre_of_its_body():
    told = fiss.inputs(observation([], x=3.0, y=1.0, h=math.pi / 6, v=7.0, a=0.5), scene(), FIRST)
    x, y = 3.0 + CENTRE * math.sqrt(0.75), 1.0 + CENTRE * 0.5
    assert told["ego"][0] == pytest.approx([x, y, math.pi / 6, 7.0, 0.5, 0.0])


def test_the_curvature_is_that_of_the_path_driven():
    radius, v = 50.0, 10.0
    seen = observation([], h=-math.pi + v * DT / radius / 2, v=v)
    told = fiss.inputs(seen, scene(), np.array([math.pi - v * DT / radius / 2]))
    assert told["ego"][0, 5] == pytest.approx(1.0 / radius)
    slow = fiss.inputs(replace(seen, v=np.array([0.5])), scene(), np.zeros(1))
    assert slow["ego"][0, 5] == 0.0


def test_obstacles_are_what_is_tracked_near_with_the_heading_of_their_motion():
    tracks = [
        track(x=50.0, vx=3.0, vy=4.0),
        track(x=50.0, state=1),
        track(x=200.0),
        track(x=50.0, vx=0.1, vy=0.1, h=1.0, kind=kinds.PEDESTRIAN, state=3),
    ]
    told = fiss.inputs(observation(tracks), scene(m=4), FIRST)["obstacles"][0]
    assert told[:, 0].tolist() == [1, 0, 0, 1]
    assert told[:, 1].tolist() == [1, 1, 1, 0]
    assert told[0, 2:] == pytest.approx([50.0, 0.0, math.atan2(4.0, 3.0), 5.0, 4.8, 2.1])
    assert told[3, 4] == 1.0


def test_without_the_planner_one_sentence_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "fiss_planner", None)
    with refuses(InputError, "fiss-planner>=1.0,<2"):
        fiss.Fiss()


@needs_planner
@pytest.mark.planners
def test_another_time_step_is_refused():
    with refuses(InputError, "0.05", "0.1"):
        fiss.Fiss().reset(1, replace(scene(), time_step=0.1))


def slow_lead(time):
    return [track(x=60.0 + 15.0 * time, vx=15.0)]


@needs_planner
@pytest.mark.planners
@pytest.mark.parametrize("may_change", [True, False])
def test_it_passes_a_slow_lead_where_the_marking_allows_and_follows_elsewhere(may_change):
    seen, _ = drive(fiss.Fiss(), slow_lead, 200, road=road_map(may_change))
    y = np.array([one.y[0] for one in seen])
    gap = np.array([one.tracks[0, 0, 1] - one.x[0] - CENTRE - BODY_LENGTH for one in seen])
    if may_change:
        assert y.max() == pytest.approx(WIDTH, abs=0.3)
        assert gap[-1] < 0.0
    else:
        assert np.abs(y).max() < 0.1
        assert gap.min() > 5.0


@needs_planner
@pytest.mark.planners
def test_on_an_empty_road_at_its_speed_it_demands_next_to_nothing():
    _, commands = drive(fiss.Fiss(), lambda _: [], 100, v=21.5, target=21.5)
    assert np.abs(commands[50:]).max() < 0.01


@needs_planner
@pytest.mark.planners
@pytest.mark.parametrize(("state", "stops"), [(1, True), (4, False)])
def test_it_stops_before_a_red_light(state, stops):
    road = road_map(lights=[light(100.0)])
    seen, _ = drive(
        fiss.Fiss(), lambda _: [], 300, v=14.0, target=14.0, road=road, state=lambda _: state
    )
    front = seen[-1].x[0] + CENTRE + BODY_LENGTH / 2
    assert (front < 100.0) == stops
    assert (seen[-1].v[0] < 0.1) == stops


@needs_planner
@pytest.mark.planners
def test_its_commands_are_the_planners_own_called_alone(tmp_path):
    road = road_map(lights=[light(280.0)])

    def others(time):
        walker = track(x=150.0, y=-6.0 + time, vx=0.0, vy=1.0, kind=kinds.PEDESTRIAN)
        return [*slow_lead(time), walker]

    seen, commands = drive(
        fiss.Fiss(), others, 160, road=road, state=lambda time: 4 if time < 5.0 else 1
    )
    np.savez(tmp_path / "told.npz", **fiss.export(seen, scene(m=2, road=road)))
    script = fiss.reproduction(str(tmp_path / "told.npz"))
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    alone = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)
    assert np.abs(commands).max() > 0.5
    np.testing.assert_allclose(alone, commands, rtol=0.0, atol=1e-9)


@needs_planner
@pytest.mark.planners
def test_a_row_depends_on_itself_alone():
    lanes = {RIGHT: 0.0, LEFT: WIDTH}
    rows = [observation([track(x=x, y=y, vx=10.0)]) for x in (20.0, 35.0) for y in lanes.values()]
    road = road_map(lights=[light(80.0)])
    states = (1, 4, 4, 1)
    rows = [replace(one, map=replace(one.map, lights=np.full((1, 1), state, np.int8)))
            for one, state in zip(rows, states, strict=True)]  # fmt: skip
    driver = fiss.Fiss()
    driver.reset(4, scene(4, road=road))
    batch = [driver.act(together(rows)) for _ in range(3)]
    for i, row in enumerate(rows):
        driver.reset(1, scene(1, road=road))
        for found in batch:
            alone = driver.act(row)
            assert alone.acceleration[0] == found.acceleration[i]
            assert alone.curvature[0] == found.curvature[i]
