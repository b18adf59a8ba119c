"""Tracks are predicted along the lane that they are on."""

from dataclasses import replace

import numpy as np
import pytest

from bridgegen.adapters.planners._along_lanes import AlongLanes

from .two_lane_road import LENGTH, WIDTH, along, lane, road_map, track

TIMES = np.arange(21) * 0.1
DRIVING = frozenset({"driving"})


@pytest.mark.parametrize("curvature", [0.0, 0.02, -0.02])
def test_a_car_stays_as_far_beside_its_lane(curvature):
    lanes = AlongLanes(road_map(curvature), DRIVING)
    now = along(np.array([11.0]), WIDTH + 0.4, curvature)[0]
    found = lanes.predict(track(*now, v=10.0)[None], TIMES)[0]
    stations = 11.0 + 10.0 * TIMES / (1.0 - curvature * WIDTH)  # the speed is along its lane
    expected = along(stations, WIDTH + 0.4, curvature)
    assert found == pytest.approx(expected, abs=0.05)
    assert found[0] == pytest.approx(now, abs=1e-3)


def test_a_car_beyond_the_lanes_end_goes_straight_on():
    lanes = AlongLanes(road_map(), DRIVING)
    found = lanes.predict(track(LENGTH - 5.0, 0.2, v=20.0)[None], TIMES)[0]
    assert found[-1] == pytest.approx([LENGTH + 35.0, 0.2, 0.0], abs=1e-6)


@pytest.mark.parametrize(
    "one", [track(10.0, 0.0, np.pi / 2, 8.0), track(10.0, 12.0, 0.4, 8.0), track(10.0, 0.0)]
)
def test_what_follows_no_lane_keeps_its_velocity(one):
    found = AlongLanes(road_map(0.02), DRIVING).predict(one[None], TIMES)[0]
    expected = one[1:3] + TIMES[:, None] * one[4:6]
    assert found[:, :2] == pytest.approx(expected, abs=1e-12)
    assert (found[:, 2] == one[3]).all()


def test_at_a_fork_it_takes_the_lane_that_turns_least():
    start = lane("a", 0.0, 0.0, next=("bent", "straight"))
    start = replace(start, centre=start.centre[:15])  # to x = 8 m
    straight = lane("straight", 0.0, 0.0)
    straight = replace(straight, centre=straight.centre[14:])
    bent = lane("bent", 0.0, 0.05)
    bent = replace(bent, centre=bent.centre[10:] + np.array([8.0, 0.0, 0.0]))
    fork = replace(road_map(), lanes=(start, bent, straight))
    found = AlongLanes(fork, DRIVING).predict(track(0.0, 0.0, v=15.0)[None], TIMES)[0]
    assert found[-1] == pytest.approx([30.0, 0.0, 0.0], abs=1e-9)


def test_without_lanes_all_go_straight():
    empty = replace(road_map(), lanes=())
    found = AlongLanes(empty, DRIVING).predict(track(0.0, 0.0, v=5.0)[None], TIMES)
    assert found[0, -1] == pytest.approx([10.0, 0.0, 0.0])
