"""SUMO's models drive as they do in SUMO alone, on a mirrored road, through our vehicle."""

import math
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from tests.approval import refuses
from tests.ego.planners.roads import CENTRE, DT, LENGTH, World, drive, road_map, scene

from bridgegen.adapters.planners import sumo
from bridgegen.adapters.planners._corridor import Corridor
from bridgegen.adapters.planners._sumo_road import Eyes, StraightRoad, network_text
from bridgegen.adapters.planners._sumo_simulation import MIN_GAP, types_text
from bridgegen.base.errors import InputError

FRONT = 0.5 * LENGTH  # from the body's centre


def installed() -> bool:
    try:
        sumo.KraussDriver()
    except InputError:
        return False
    return True


DRIVERS = {
    "Krauss": sumo.KraussDriver,
    "EIDM": sumo.EIDMDriver,
    "ACC": sumo.ACCDriver,
    "CACC": sumo.CACCDriver,
}


def test_types_say_only_what_differs_from_sumo():
    plain = types_text(LENGTH, 1.9, {})
    assert types_text(LENGTH, 1.9, {k: v[0] for k, v in sumo.EIDMDriver.tunable.items()}) == plain
    assert ' jerkmax="5.0"' in types_text(LENGTH, 1.9, {"jerkmax": 5.0})


# --- Ours: without the planner --------------------------------------------------------------------


def test_the_network_has_the_lanes_and_the_ways_between_them():
    road = StraightRoad(Corridor(road_map((2, 3), limit=27.0, marking="solid")))
    net = ET.fromstring(network_text([road]))
    edges = {edge.get("id"): edge for edge in net.iter("edge")}
    assert [len(edges[f"r0e{k}"]) for k in range(3)] == [2, 3, 3]  # the last is the tail
    lane = edges["r0e1"][0]
    assert float(lane.get("length")) == pytest.approx(600.0)
    assert (float(lane.get("speed")), float(lane.get("width"))) == (27.0, pytest.approx(3.5))
    assert lane.get("changeLeft") == "authority"
    # The left lane of two (1 in SUMO) leads to the left one of three (2 in SUMO).
    ways = {
        (one.get("from"), int(one.get("fromLane"))): (one.get("to"), int(one.get("toLane")))
        for one in net.iter("connection")
    }
    assert ways[("r0e0", 1)] == ("r0e1", 2)
    assert ways[("r0e0", 0)] == ("r0e1", 1)
    assert len(ways) == 5
    for junction in net.iter("junction"):
        assert len(list(junction)) == sum(
            f"{way[0]}_{way[1]}" in junction.get("incLanes").split() for way in ways
        )


def test_places_are_those_of_the_fronts():
    lanes = road_map((2, 2), length=300.0)
    world = World([[100, 0, 0, 20]], [[[310, -3.5, 0, 15], [150, -40.0, 0, 3]]], [30.0])
    seen = Eyes(StraightRoad(Corridor(lanes)), scene(lanes, n_others=2)).see(world.observe(), 0)
    assert seen.ego == pytest.approx([0, 100 + FRONT, 20, 0, 30, 0])
    assert seen.others[0] == pytest.approx([1, 1, 10 + FRONT, 1, 15, 0, LENGTH])
    assert seen.others[1, 0] == 0  # not on the road
    assert seen.place == pytest.approx([100 - CENTRE, 0])


def test_the_vehicle_ahead_counts_on_each_lane_that_the_body_is_on():
    lanes = road_map((2,))
    eyes = Eyes(StraightRoad(Corridor(lanes)), scene(lanes, n_others=2))
    others = [[[150, 0, 0, 5], [130, -3.5, 0, 9]]]
    between = eyes.see(World([[100, -1.75, 0, 20]], others, [30.0]).observe(), 0)
    gaps = [[50 - LENGTH, 5, 0], [30 - LENGTH, 9, 1]]
    np.testing.assert_allclose(between.ahead[:, :3], gaps, rtol=0, atol=1e-9)
    within = eyes.see(World([[100, 0, 0, 20]], others, [30.0]).observe(), 0)
    assert within.ahead[0, :3] == pytest.approx(gaps[0])
    assert (within.ahead[1, 0], within.ahead[0, 3]) == (np.inf, np.inf)


def test_a_body_that_reaches_into_the_lane_is_ahead_on_it():
    lanes = road_map((1,))
    # 1.9 m wide: its side is 0.4 m (0.2 m) inside the lane of 3.5 m, its centre off the road.
    for y, gap in [(-2.3, 50 - LENGTH), (-2.5, np.inf)]:
        world = World([[100, 0, 0, 20]], [[[150, y, 0, 5]]], [30.0])
        seen = Eyes(StraightRoad(Corridor(lanes)), scene(lanes)).see(world.observe(), 0)
        assert seen.others[0, 0] == 0
        assert seen.ahead[0, [0, 3]] == pytest.approx([gap, gap])


def test_an_oncoming_vehicle_stands_and_a_crossing_one_has_its_speed_along_the_road():
    lanes = road_map((1,))
    world = World([[100, 0, 0, 20]], [[[150, 0, math.pi, 9], [180, 0, math.pi / 3, 8]]], [30.0])
    seen = Eyes(StraightRoad(Corridor(lanes)), scene(lanes, n_others=2)).see(world.observe(), 0)
    assert seen.others[0, 4] == 0.0
    assert seen.others[1, 4] == pytest.approx(4.0)


def test_the_goal_follows_its_lane_over_the_edges_and_is_the_nearest_where_that_ends():
    lanes = road_map((3, 2), length=100.0)
    road = StraightRoad(Corridor(lanes))
    row = sumo.Row(road)
    eyes = Eyes(road, scene(lanes))
    for x, y, goal in [(50, -3.5, 1), (110, -3.5, 1)]:
        row.find_goal(eyes.see(World([[x, y, 0, 20]], np.zeros((1, 1, 4)), [30.0]).observe(), 0))
        assert row.goal == goal
    row = sumo.Row(road)
    for x, y, goal in [(50, -7.0, 2), (110, -6.0, 1)]:
        row.find_goal(eyes.see(World([[x, y, 0, 20]], np.zeros((1, 1, 4)), [30.0]).observe(), 0))
        assert row.goal == goal


@pytest.mark.parametrize("curvature", [0.0, 1 / 300])
def test_our_course_leads_to_the_goals_lane_in_comfort(curvature):
    lanes = road_map((2,), curvature=curvature)
    road = StraightRoad(Corridor(lanes))
    eyes, row = Eyes(road, scene(lanes)), sumo.Row(road)
    world = World([[CENTRE, 0, 0, 20]], np.zeros((1, 1, 4)), [20.0])
    bends = []
    for _ in range(160):
        o = world.observe()
        seen = eyes.see(o, 0)
        row.find_goal(seen)
        bends.append(row.steer(seen, 1, o, 0))
        world.move(sumo.Control(np.zeros(1), np.array(bends[-1:])))
    assert seen.place[1] == pytest.approx(-3.5, abs=0.1)
    assert 400 * np.abs(np.array(bends) - curvature).max() < 1.5  # m/s² of lateral acceleration


def test_without_the_planner_the_error_says_how_to_get_it(monkeypatch):
    wanting = tuple(replace(one, requires=("libsumo==0.0.1",)) for one in sumo.PLANNERS)
    monkeypatch.setattr(sumo, "PLANNERS", wanting)
    with refuses(InputError):
        sumo.EIDMDriver()


# --- Its own: with the planner --------------------------------------------------------------------

needs_planner = pytest.mark.skipif(not installed(), reason="needs libsumo")


def krauss(v, gap, leader, dt=DT, decel=4.5, tau=1.0, accel=2.6, most=30.0):
    """Return the next speed by Krauss, as SUMO's documentation and its Euler steps have it.

    The greatest speed after which one can still stop behind the leader's stopping place, both
    braking by `decel` from step to step, after the reaction time `tau`.
    """
    step = decel * dt
    n = int(leader / step)
    place = gap + dt * (n * leader - step * n * (n + 1) / 2)

    def way(speed):  # driven until standstill: tau at the speed, then steps that brake
        k = int(speed / step)
        return speed * tau + dt * (k * speed - step * k * (k + 1) / 2)

    low, high = 0.0, 200.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if way(middle) <= place - 0.001 else (low, middle)
    return min(low, v + accel * dt, most)


@pytest.mark.planners
@needs_planner
def test_krauss_is_the_published_formula():
    for v, gap, leader in [(20.0, 40.0, 19.0), (20.0, 36.0, 20.0), (8.0, 60.0, 9.0), (25, 29, 25)]:
        world = World([[100, 0, 0, v]], [[[100 + gap + LENGTH, 0, 0, leader]]], [30.0])
        driver = sumo.KraussDriver()
        driver.reset(1, scene(road_map((1,))))
        expected = (krauss(v, gap - MIN_GAP, leader) - v) / DT
        assert expected > -4.5  # harder braking is SUMO's own rule
        found = driver.act(world.observe())
        assert float(found.acceleration[0]) == pytest.approx(expected, abs=1e-9)
        driver.settings = {"tau": 1.4, "minGap": 4.0, "decel": 4.5}
        driver.reset(1, scene(road_map((1,))))
        expected = (krauss(v, gap - 4.0, leader, tau=1.4) - v) / DT
        found = float(driver.act(world.observe()).acceleration[0])
        assert found == pytest.approx(expected, abs=1e-9) or expected < -4.5


@pytest.mark.planners
@needs_planner
@pytest.mark.parametrize("model", list(DRIVERS))
def test_its_commands_are_those_of_the_planner_alone(model, tmp_path):
    lanes = road_map((3, 2), length=300.0, curvature=0.001, route=0)
    world = World([[90, 4, 0.09, 25]], [[[150, 11, 0.15, 12], [-40, -3.5, 0, 10]]], [30.0])
    of = scene(lanes, n_others=2)
    world.light[:], world.stop[:] = 1, 260.0
    seen, commands = drive(DRIVERS[model](), world, of, 12.0)
    np.savez(tmp_path / "row.npz", **sumo.export(seen, of))
    (tmp_path / "alone.py").write_text(sumo.reproduction(str(tmp_path / "row.npz")))
    assert "bridgegen" not in (tmp_path / "alone.py").read_text()
    text = subprocess.run(
        [sys.executable, tmp_path / "alone.py", model], capture_output=True, text=True, check=True
    ).stdout
    alone = np.array([line.split() for line in text.splitlines()], dtype=np.float64)
    np.testing.assert_allclose(commands[:, 0, 0], alone[:, 0], rtol=0, atol=1e-9)
    assert len(set(alone[:, 1])) > 1  # it has changed its lane


FREE = """
import sys, libsumo
net, types, model, speed = *sys.argv[1:4], float(sys.argv[4])
libsumo.start(["sumo", "-n", net, "-a", types, "--step-length", "0.05", "--no-internal-links",
    "--no-step-log", "--no-warnings", "--collision.action", "none", "--time-to-teleport", "-1"])
libsumo.route.add("r", ["r0e0", "r0e1"])
for name, kind, lane, at in (("ego", model, 0, 102.3), ("other", "other", 0, 162.3)):
    libsumo.vehicle.add(name, "r", typeID=kind)
    libsumo.vehicle.moveTo(name, f"r0e0_{lane}", at)
libsumo.vehicle.setLength("other", 4.6)
libsumo.vehicle.setSpeedMode("other", 0)
libsumo.vehicle.setLaneChangeMode("other", 0)
libsumo.vehicle.setMaxSpeed("ego", 30.0)
libsumo.vehicle.setPreviousSpeed("ego", 25.0, 0.0)
libsumo.vehicle.setPreviousSpeed("other", speed, 0.0)
libsumo.vehicle.setSpeed("other", speed)
for _ in range(100):
    libsumo.simulationStep()
    print(repr(libsumo.vehicle.getSpeed("ego")))
"""


@pytest.mark.planners
@needs_planner
@pytest.mark.parametrize("model", list(DRIVERS))
def test_a_vehicle_that_is_placed_drives_as_one_that_sumo_moves(model, tmp_path):
    lanes = road_map((1,))
    of = scene(lanes)
    (tmp_path / "free.py").write_text(FREE)
    (tmp_path / "road.net.xml").write_text(network_text([StraightRoad(Corridor(lanes))]))
    (tmp_path / "types.add.xml").write_text(types_text(of.length, of.width, {}))
    text = subprocess.run(
        [sys.executable, "free.py", "road.net.xml", "types.add.xml", model, "15.0"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    free = np.array(text.split(), dtype=np.float64)
    world = World([[100, 0, 0, 25]], [[[160, 0, 0, 15]]], [30.0])
    driver = DRIVERS[model]()
    driver.reset(1, of)
    speeds = []
    for _ in range(100):
        control = driver.act(world.observe())
        world.move(control)
        # SUMO's Euler step goes on at the new speed, our vehicle at the mean of both.
        world.ego[0, 0] += 0.5 * world.a[0] * DT * DT
        speeds.append(world.ego[0, 3])
    np.testing.assert_allclose(speeds, free, rtol=0, atol=1e-9)
    assert free.min() < 20.0


@pytest.mark.planners
@needs_planner
@pytest.mark.parametrize("model", list(DRIVERS))
def test_our_vehicle_drives_the_lane_change_that_lc2013_wants(model):
    world = World([[100, -3.5, 0, 25]], [[[160, -3.5, 0, 12]]], [30.0])
    seen, _ = drive(DRIVERS[model](), world, scene(road_map((2,), route=1)), 12.0)
    y = np.array([one.y[0] for one in seen])
    assert y[0] == pytest.approx(-3.5)
    assert y.max() == pytest.approx(0.0, abs=0.1)
    assert np.hypot(np.diff(y, 2), 0.0).max() / DT**2 < 1.5


@pytest.mark.planners
@needs_planner
def test_a_solid_marking_keeps_it_on_its_lane():
    world = World([[100, -3.5, 0, 25]], [[[160, -3.5, 0, 12]]], [30.0])
    lanes = road_map((2,), route=1, marking="solid")
    seen, _ = drive(sumo.KraussDriver(), world, scene(lanes), 10.0)
    assert max(abs(one.y[0] + 3.5) for one in seen) < 0.05
    assert seen[-1].v[0] < 15.0


@pytest.mark.planners
@needs_planner
def test_it_brakes_for_a_body_beside_the_road_that_reaches_into_its_lane():
    for y, brakes in [(-2.3, True), (-4.0, False)]:
        driver = sumo.KraussDriver()
        driver.reset(1, scene(road_map((1,))))
        world = World([[100, 0, 0, 20]], [[[130, y, 0, 2]]], [20.0])
        assert (float(driver.act(world.observe()).acceleration[0]) < -2.0) == brakes


@pytest.mark.planners
@needs_planner
@pytest.mark.parametrize("model", ["ACC", "CACC"])
def test_it_follows_a_body_that_reaches_into_its_lane_as_one_on_it(model):
    demanded = []
    for y in (0.0, -2.3):
        driver = DRIVERS[model]()
        driver.reset(1, scene(road_map((1,))))
        world = World([[100, 0, 0, 20]], [[[124 + LENGTH, y, 0, 18]]], [30.0])
        demanded.append(float(driver.act(world.observe()).acceleration[0]))
    assert demanded[0] < -0.5
    assert demanded[1] == pytest.approx(demanded[0], abs=1e-9)


@pytest.mark.planners
@needs_planner
def test_it_stops_at_a_red_light():
    world = World([[100, 0, 0, 14]], [[[0, 300, 0, 0]]], [14.0])
    world.light[:], world.stop[:] = 1, 60.0
    seen, _ = drive(sumo.KraussDriver(), world, scene(road_map((1,))), 12.0)
    assert seen[-1].v[0] < 0.1
    assert 0.0 < seen[-1].stop_distance[0] < 2.0


@pytest.mark.planners
@needs_planner
def test_a_row_does_not_depend_on_its_batch():
    lanes = [road_map((2,)), road_map((3,), curvature=0.002)]
    egos = [[100, 0, 0, 25], [50, 2, 0, 20], [80, 0, 0, 15]]
    others = [[[150, 0, 0, 10]], [[110, 0, 0, 12]], [[120, -3.5, 0, 20]]]
    driver = sumo.EIDMDriver()
    rows = [0, 1, 0]
    together = drive(driver, World(egos, others, [30.0] * 3), scene(*lanes, rows=rows), 3.0)[1]
    for i, k in enumerate(rows):
        alone = World(egos[i : i + 1], others[i : i + 1], [30.0])
        found = drive(driver, alone, scene(lanes[k]), 3.0)[1]
        np.testing.assert_array_equal(together[:, i], found[:, 0])


@pytest.mark.planners
@needs_planner
def test_a_time_step_that_sumo_has_not_is_refused():
    with pytest.raises(InputError, match=r"whole number of milliseconds, got 0\.0333"):
        sumo.ACCDriver().reset(1, replace(scene(road_map((1,))), time_step=1 / 30))


@pytest.mark.planners
@needs_planner
def test_the_planner_is_imported_before_the_first_call():
    code = (
        "import sys; from bridgegen.adapters.planners import sumo as adapter; "
        "adapter.KraussDriver(); print('libsumo' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True"]
