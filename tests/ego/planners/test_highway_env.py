"""highway-env's IDMVehicle drives as it does by itself, and through our vehicle."""

import math
import subprocess
import sys

import numpy as np
import pytest
from tests.approval import refuses
from tests.ego.planners.roads import CENTRE, DT, World, drive, road_map, scene

from bridgegen.adapters.planners import highway_env
from bridgegen.adapters.planners._corridor import Corridor
from bridgegen.adapters.planners.highway_env import ARC, POINTS, STRAIGHT
from bridgegen.base.errors import InputError


def installed() -> bool:
    try:
        highway_env.HighwayEnvDriver()
    except InputError:
        return False
    return True


def behind_a_slow_car(**road):
    """One row: the ego on the middle lane of three, 60 m behind a car of 12 m/s."""
    lanes = road_map((3,), route=1, **road)
    world = World([[100, 0, 0, 25]], [[[160, 0, 0, 12], [60, 3.5, 0, 25]]], [30.0])
    return world, scene(_down(lanes), n_others=2)


def _down(lanes):
    """Return the road moved to the left, so that its middle lane is the x axis."""
    from dataclasses import replace

    up = np.array([0.0, 3.5])
    moved = [
        replace(
            one,
            centre=one.centre + np.array([0.0, 3.5, 0.0]),
            left=one.left + up,
            right=one.right + up,
        )
        for one in lanes.lanes
    ]
    return replace(lanes, lanes=tuple(moved))


# --- Ours: without the planner --------------------------------------------------------------------


@pytest.mark.parametrize(("curvature", "kind"), [(0.0, STRAIGHT), (1 / 500, ARC), (-1 / 300, ARC)])
def test_straight_lanes_and_arcs_are_recognised(curvature, kind):
    arrays = highway_env.road_arrays(Corridor(road_map((2,), curvature=curvature)))
    assert arrays["lane_kind"].tolist() == [kind, kind]
    assert arrays["lane_width"] == pytest.approx([3.5, 3.5])
    if kind == ARC:
        radius, grows = arrays["lane_arc"][0][[2, 5]]
        assert radius == pytest.approx(abs(1 / curvature))
        assert bool(grows) == (curvature > 0)


def test_a_lane_that_is_no_arc_is_given_by_its_points():
    lane = road_map((1,), length=100.0).lanes[0]
    bent = lane.centre.copy()
    bent[:, 1] = 1e-5 * bent[:, 0] ** 3
    from dataclasses import replace

    road = replace(road_map((1,), length=100.0), lanes=(replace(lane, centre=bent),))
    arrays = highway_env.road_arrays(Corridor(road))
    assert arrays["lane_kind"].tolist() == [POINTS]
    assert arrays["points"] == pytest.approx(bent[:, :2])


def test_where_a_lane_ends_before_the_road_an_obstacle_stands():
    assert highway_env.road_arrays(Corridor(road_map((3, 2))))["lane_ends"].tolist() == [
        False, False, True, False, False,
    ]  # fmt: skip


@pytest.mark.parametrize("steering", [0.0, 0.02, -0.3, 0.9])
def test_with_the_axles_of_highway_env_the_rear_axle_has_the_bicycles_curvature(steering):
    # Its wheelbase is 5 m, its reference in the middle: the textbook's tan(δ)/L at the rear axle.
    found = highway_env.rear_curvature(np.array([steering]), 2.5)
    assert found[0] == pytest.approx(math.tan(steering) / 5.0, rel=1e-12)


def test_the_centre_of_our_body_follows_the_curvature_that_highway_envs_centre_would():
    steering, dt, v = 0.4, 1e-4, 10.0
    beta = math.atan(0.5 * math.tan(steering))
    theirs = math.sin(beta) / 2.5  # yaw rate over the centre's speed
    bend = float(highway_env.rear_curvature(np.array([steering]), CENTRE)[0])
    h = np.arange(3) * bend * v * dt
    rear = np.cumsum([[v * dt * math.cos(a), v * dt * math.sin(a)] for a in h], axis=0)
    centre = rear + CENTRE * np.stack([np.cos(h), np.sin(h)], axis=1)
    way = np.hypot(*(centre[2] - centre[1]))
    assert (h[2] - h[1]) / way == pytest.approx(theirs, rel=1e-3)


def test_a_marking_that_forbids_a_change_forbids_the_lane():
    for marking, expected in [("solid", [True, False, True]), ("broken", [False, False, False])]:
        lanes = road_map((3,), route=1, marking=marking)
        inputs = highway_env._Inputs(scene(lanes), Corridor(lanes))
        world = World([[100, -3.5, 0, 25]], np.zeros((1, 1, 4)), [30.0])
        assert inputs.of(world.observe(), 0)[1].tolist() == expected


def test_without_the_planner_the_error_says_how_to_get_it(monkeypatch):
    from dataclasses import replace

    wanting = replace(highway_env.PLANNER, requires=("no-such-planner==0.0.1",))
    monkeypatch.setattr(highway_env, "PLANNER", wanting)
    with refuses(InputError, "no-such-planner"):
        highway_env.HighwayEnvDriver()


# --- Its own: with the planner --------------------------------------------------------------------


def idm(v, target, gap, dv, a=3.0, b=5.0, jam=10.0, headway=1.5):
    """Return the IDM's acceleration by its publication, with highway-env's parameters."""
    wanted = jam + v * headway + v * dv / (2.0 * math.sqrt(a * b))
    return a * (1.0 - (v / target) ** 4 - (wanted / gap) ** 2)


@pytest.mark.planners
@pytest.mark.skipif(not installed(), reason="needs highway-env")
def test_it_follows_by_the_published_formula():
    lanes = _down(road_map((1,), route=0))
    for v, gap, other in [(20.0, 60.0, 18.0), (10.0, 35.0, 12.0), (25.0, 120.0, 25.0)]:
        world = World([[100, 3.5, 0, v]], [[[100 + gap, 3.5, 0, other]]], [30.0])
        driver = highway_env.HighwayEnvDriver()
        driver.reset(1, scene(lanes))
        found = driver.act(world.observe())
        assert float(found.acceleration[0]) == pytest.approx(
            max(-6.0, idm(v, 30.0, gap, v - other)), abs=1e-9
        )


@pytest.mark.planners
@pytest.mark.skipif(not installed(), reason="needs highway-env")
def test_the_speed_limit_is_obeyed_and_no_limit_is_none():
    for limit, expected in [(np.inf, idm(25.0, 30.0, 1e9, 0.0)), (20.0, idm(25.0, 20.0, 1e9, 0.0))]:
        world = World([[100, 0, 0, 25]], [[[0, 500, 0, 0]]], [30.0])
        driver = highway_env.HighwayEnvDriver()
        driver.reset(1, scene(road_map((1,), limit=limit)))
        assert float(driver.act(world.observe()).acceleration[0]) == pytest.approx(expected)


@pytest.mark.planners
@pytest.mark.skipif(not installed(), reason="needs highway-env")
def test_our_vehicle_drives_the_lane_change_that_mobil_decides():
    world, seen_scene = behind_a_slow_car()
    seen, _ = drive(highway_env.HighwayEnvDriver(), world, seen_scene, 8.0)
    y, h = np.array([[one.y[0], one.h[0]] for one in seen]).T
    assert y[0] == pytest.approx(0.0)
    assert abs(y[-1]) == pytest.approx(3.5, abs=0.05)
    assert abs(h[-1]) < 0.01
    assert seen[-1].v[0] > 25.0


@pytest.mark.planners
@pytest.mark.skipif(not installed(), reason="needs highway-env")
def test_a_solid_marking_keeps_it_on_its_lane():
    world, seen_scene = behind_a_slow_car(marking="solid")
    seen, _ = drive(highway_env.HighwayEnvDriver(), world, seen_scene, 8.0)
    assert max(abs(one.y[0]) for one in seen) < 0.01
    assert seen[-1].v[0] < 15.0


@pytest.mark.planners
@pytest.mark.skipif(not installed(), reason="needs highway-env")
@pytest.mark.parametrize("curvature", [0.0, 0.002])
def test_its_commands_are_those_of_the_planner_alone(curvature, tmp_path):
    lanes = road_map((3, 3), length=300.0, curvature=curvature, route=0)
    egos = [[50, 0, 0.02, 25]]
    others = [[[110, 0, 0, 12], [20, -3.5, 0, 25]]]
    world, of = World(egos, others, [30.0]), scene(lanes, n_others=2)
    seen, commands = drive(highway_env.HighwayEnvDriver(), world, of, 5.0)
    np.savez(tmp_path / "row.npz", **highway_env.export(seen, of))
    (tmp_path / "alone.py").write_text(highway_env.reproduction(str(tmp_path / "row.npz")))
    text = subprocess.run(
        [sys.executable, tmp_path / "alone.py"], capture_output=True, text=True, check=True
    ).stdout
    assert "bridgegen" not in (tmp_path / "alone.py").read_text()
    alone = np.array([line.split() for line in text.splitlines()], dtype=np.float64)
    assert alone.shape == (round(5.0 / DT), 2)
    np.testing.assert_allclose(commands[:, 0, 0], alone[:, 0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        commands[:, 0, 1], highway_env.rear_curvature(alone[:, 1], CENTRE), rtol=0, atol=1e-9
    )


@pytest.mark.planners
@pytest.mark.skipif(not installed(), reason="needs highway-env")
def test_a_lane_by_points_is_read_as_highway_env_reads_it():
    from highway_env.road.lane import PolyLaneFixedWidth

    s = np.linspace(0.0, 60.0, 31)
    lane = PolyLaneFixedWidth(np.column_stack([s, 0.001 * s**2]), 3.5)
    mine = highway_env._frenet(lane.curve)
    for point in np.random.default_rng(0).uniform([-20, -20], [90, 30], (200, 2)):
        np.testing.assert_allclose(
            mine(point), lane.curve.cartesian_to_frenet(point), rtol=0, atol=1e-9
        )


@pytest.mark.planners
@pytest.mark.skipif(not installed(), reason="needs highway-env")
def test_a_row_does_not_depend_on_its_batch():
    lanes = [road_map((2,)), road_map((3,), curvature=0.002)]
    egos = [[100, 0, 0, 25], [50, 2, 0, 20], [80, 0, 0, 15]]
    others = [[[150, 0, 0, 10]], [[110, 0, 0, 12]], [[120, -3.5, 0, 20]]]
    together = drive(
        highway_env.HighwayEnvDriver(),
        World(egos, others, [30.0] * 3),
        scene(*lanes, rows=[0, 1, 0]),
        3.0,
    )[1]
    for i, k in enumerate([0, 1, 0]):
        alone = drive(
            highway_env.HighwayEnvDriver(),
            World(egos[i : i + 1], others[i : i + 1], [30.0]),
            scene(lanes[k]),
            3.0,
        )[1]
        np.testing.assert_array_equal(together[:, i], alone[:, 0])


@pytest.mark.planners
@pytest.mark.skipif(not installed(), reason="needs highway-env")
def test_the_planner_is_imported_before_the_first_call():
    code = (
        "import sys; from bridgegen.adapters.planners import highway_env as adapter; "
        "adapter.HighwayEnvDriver(); print('highway_env.vehicle.behavior' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True"]
