"""CommonRoad's reactive planner is given our road, and does with us what it does alone."""

import subprocess
import sys
from dataclasses import replace
from importlib import metadata

import numpy as np
import pytest

from bridgegen.adapters.planners import commonroad_reactive as adapter
from bridgegen.adapters.planners._along_lanes import AlongLanes
from bridgegen.adapters.planners.commonroad_reactive import CommonroadReactive
from bridgegen.base.errors import InputError

from .two_lane_road import LENGTH, WIDTH, along, observation, road_map, scene, track


def has_planner() -> bool:
    try:
        return metadata.version("commonroad-reactive-planner") == "2025.1"
    except metadata.PackageNotFoundError:
        return False


def test_the_road_is_its_lanes_with_their_neighbours():
    road = adapter.road_of(road_map(), observation((0.0, 0.0, 1.0)).route[0])
    assert (road["lane_points"] == [210] * 3).all()
    assert road["lane_left"].shape == road["lane_right"].shape == road["lane_centre"].shape
    # The right lane has the left one on its left; that one has the oncoming lane there.
    assert (road["lane_beside"][:2] == [[1, -1, 1, 1], [2, 0, 0, 1]]).all()
    first = slice(0, 210)
    assert road["lane_left"][first, 1] == pytest.approx(np.full(210, WIDTH / 2))
    assert road["lane_right"][first, 1] == pytest.approx(np.full(210, -WIDTH / 2))


def test_lanes_that_follow_each_other_are_paired():
    lanes = road_map().lanes
    lanes = (replace(lanes[0], next=("1:0:-1", "elsewhere")), *lanes[1:])
    road = adapter.road_of(replace(road_map(), lanes=lanes), observation((0.0, 0.0, 1.0)).route[0])
    assert road["lane_next"].tolist() == [[0, 1]]


def test_walkways_are_no_lanelets():
    lanes = road_map().lanes
    lanes = (lanes[0], replace(lanes[1], kind="sidewalk"), lanes[2])
    road = adapter.road_of(replace(road_map(), lanes=lanes), observation((0.0, 0.0, 1.0)).route[0])
    assert len(road["lane_points"]) == 2
    assert (road["lane_beside"][:, :2] == -1).all()


@pytest.mark.parametrize("curvature", [0.0, 0.01])
def test_the_reference_is_the_routes_centre_longer_both_ways(curvature):
    found = adapter.reference(road_map(curvature), np.zeros((40, 4)))
    steps = np.hypot(*np.diff(found, axis=0).T)
    assert steps.min() >= adapter.CLOSE
    assert steps.max() <= 2.0 + 1e-9
    assert steps.sum() == pytest.approx(LENGTH + 20.0 - 2.0 + 30.0 + 199.0, abs=1.0)
    on_route = along(np.arange(-20.0, LENGTH, 2.0), 0.0, curvature)[:, :2]
    assert found[30:240] == pytest.approx(on_route)


def test_the_reference_is_the_route_ahead_where_no_lane_is_on_it():
    route = observation((50.0, 0.0, 1.0)).route[0]
    found = adapter.reference(replace(road_map(), route=()), route)
    assert found[0] == pytest.approx([20.0, 0.0])


@pytest.mark.parametrize("curvature", [0.0, 0.02])
def test_braking_stays_beside_the_route_and_stops(curvature):
    o = observation((10.0, 0.5, 12.0), curvature=curvature)
    plan = adapter.braking(o, 0, 8.0)
    t = np.arange(21) * 0.1
    moving = np.minimum(t, 1.5)
    stations = 10.0 + 12.0 * moving - 4.0 * moving**2
    assert plan[:, :3] == pytest.approx(along(stations, 0.5, curvature), abs=0.02)
    assert plan[:, 3] == pytest.approx(np.maximum(12.0 - 8.0 * t, 0.0))
    assert (plan[0, :2] == [o.x[0], o.y[0]]).all()


def test_tracks_that_are_not_confirmed_are_none():
    tracks = np.array([track(10.0, 0.0, v=4.0), track(20.0, 0.0)])
    tracks[1, 0] = 1.0
    found = adapter.others_of(tracks, AlongLanes(road_map(), adapter.DRIVABLE))
    assert found.shape == (2, 21, 5)
    assert found[0, -1] == pytest.approx([18.0, 0.0, 0.0, 4.5, 1.8])
    assert np.isnan(found[1]).all()


def test_a_package_that_lacks_is_one_sentence(monkeypatch):
    def none(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr("bridgegen.drivers.planners.version", none)
    with pytest.raises(InputError, match=r"commonroad-reactive-planner==2025\.1.*pip") as error:
        CommonroadReactive()
    assert "\n" not in str(error.value)


@pytest.mark.planners
@pytest.mark.skipif(not has_planner(), reason="commonroad-reactive-planner is not installed")
@pytest.mark.filterwarnings("ignore")  # its packages warn
class TestWithItsPackages:
    def test_it_holds_the_speed_that_is_asked(self):
        driver = CommonroadReactive()
        driver.reset(1, scene(1))
        plan = driver.act(observation((0.0, 0.0, 15.0)))
        assert not driver.emergencies[0]
        assert plan.v[0] == pytest.approx(np.full(21, 15.0), abs=0.5)
        assert plan.y[0] == pytest.approx(np.zeros(21), abs=0.05)
        assert plan.x[0, -1] == pytest.approx(30.0, abs=0.5)

    def test_it_brakes_along_the_route_where_it_has_no_plan(self):
        # A wall of cars across all lanes, too near to stop.
        wall = np.array([[track(14.0, y) for y in (-2.0, 0.0, 2.0, 4.0, 6.0, 8.0)]])
        driver = CommonroadReactive()
        driver.reset(1, scene(1))
        plan = driver.act(observation((0.0, 0.2, 25.0), tracks=wall))
        assert driver.emergencies[0]
        assert plan.v[0] == pytest.approx(np.maximum(25.0 - 9.0 * np.arange(21) * 0.1, 0.0))
        assert plan.y[0] == pytest.approx(np.full(21, 0.2))

    def test_the_script_prints_the_same_plans(self, tmp_path):
        rows = [(4.0 * k, 0.3, 14.0 - k) for k in range(3)]
        seen = [
            observation(
                row, curvature=0.01, time=0.3 * k, tracks=track(45.0, 9.0, v=5.0)[None, None]
            )
            for k, row in enumerate(rows)
        ]
        driver = CommonroadReactive()
        driver.reset(1, scene(1, 0.01))
        plans = [driver.act(one) for one in seen]
        path = tmp_path / "seen.npz"
        np.savez(path, **adapter.export(seen, scene(1, 0.01)))
        script = tmp_path / "alone.py"
        script.write_text(adapter.reproduction(str(path)))
        done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
        lines = [line.split() for line in done.stdout.splitlines() if line.startswith("  ")]
        alone = np.array(lines, dtype=np.float64).reshape(3, 21, 6)
        for k, plan in enumerate(plans):
            ours = np.stack([plan.x[0], plan.y[0], plan.h[0], plan.v[0]], axis=1)
            assert alone[k, :, :4] == pytest.approx(ours, abs=1e-9)

    def test_a_row_does_not_depend_on_the_batch(self):
        rows = [(0.0, 0.0, 2.0), (5.0, 0.3, 12.0), (9.0, -0.2, 5.0)]
        tracks = np.array([[track(25.0 + s, 0.0, v=3.0)] for s, _, _ in rows])
        whole, alone = CommonroadReactive(), CommonroadReactive()
        whole.reset(3, scene(3))
        alone.reset(1, scene(1))
        o = observation(*rows, tracks=tracks)
        o = replace(o, h=o.h + 0.08)  # so that its lateral state has a derivative, by time or way
        for _ in range(2):
            plan, one = whole.act(o), alone.act(o.take(slice(1, 2)))
            for name in ("x", "y", "h", "v"):
                assert getattr(one, name)[0].tobytes() == getattr(plan, name)[1].tobytes()
