"""Lanes along a route: where a place is on them, whatever the road's shape and place."""

from dataclasses import replace

import numpy as np
import pytest
from tests.approval import refuses
from tests.ego.planners.roads import LANE_WIDTH, road_map

from bridgegen.adapters.planners._corridor import Corridor
from bridgegen.base.errors import InputError

RADIUS = 800.0


def around(s, d, turn=0.0):
    """A place on a left bend whose leftmost lane's centre has `RADIUS`, by its definition."""
    h = s / RADIUS + turn
    centre = RADIUS * np.array([-np.sin(turn), np.cos(turn)])
    return centre + (RADIUS - d) * np.array([np.sin(h), -np.cos(h)])


@pytest.mark.parametrize("turn", [0.0, 2.1, -1.0])
def test_a_place_on_a_bend_is_its_arc_length_and_its_distance(turn):
    corridor = Corridor(road_map((3,), curvature=1 / RADIUS, turn=turn))
    for s, d in [(100.0, 0.0), (333.3, -3.5), (500.0, 2.0)]:
        x, y = around(s, d, turn)
        station, offset, heading = corridor.places(np.array([x]), np.array([y]))
        # Chords of 2 m are 4/(8R) m from the arc, and shorter by a hundred-thousandth.
        assert station[0] == pytest.approx(s, abs=0.01)
        assert offset[0] == pytest.approx(d, abs=0.001)
        assert np.cos(heading[0] - s / RADIUS - turn) == pytest.approx(1.0, abs=1e-5)
        assert corridor.point(station[0], offset[0]) == pytest.approx((x, y), abs=1e-6)


def test_lanes_are_numbered_from_left_to_right_from_the_lane_of_the_route():
    corridor = Corridor(road_map((3,), route=1))
    offsets = [lane.at(50.0)[0] for lane in corridor.sections[0].lanes]
    assert offsets == pytest.approx([LANE_WIDTH, 0.0, -LANE_WIDTH])
    assert corridor.lane_at(0, 50.0, -3.0) == (2, True)
    assert corridor.lane_at(0, 50.0, 1.7) == (1, True)
    assert corridor.lane_at(0, 50.0, 6.0) == (0, False)


def test_a_lane_that_ends_leads_nowhere():
    corridor = Corridor(road_map((3, 2)))
    assert [lane.next for lane in corridor.sections[0].lanes] == [0, 1, -1]
    assert corridor.sections[1].start == pytest.approx(600.0)
    assert corridor.section_at(np.array([599.0, 601.0])).tolist() == [0, 1]


def test_the_road_before_and_beyond_the_route_belongs_to_it():
    corridor = Corridor(road_map((2, 2, 2), length=400.0, keep=[1]))
    assert len(corridor.sections) == 3
    assert corridor.length == pytest.approx(1200.0)


def test_the_road_goes_straight_on_beyond_its_ends():
    corridor = Corridor(road_map((1,), length=100.0))
    s, d, _ = corridor.places(np.array([-30.0, 130.0]), np.array([1.0, -1.0]))
    assert s == pytest.approx([-30.0, 130.0])
    assert d == pytest.approx([1.0, -1.0])


def test_a_route_off_the_lanes_is_refused():
    with refuses(InputError):
        Corridor(road_map((2,), keep=[]))


def test_lanes_beside_in_a_junction_are_roads_of_their_own():
    road = road_map((2, 2, 2), length=60.0, route=1)
    alone = {"left_lane": "", "right_lane": "", "junction": "9"}
    alone |= {"left_is_same_way": False, "right_is_same_way": False}
    apart = [replace(one, **alone) if ":1:" in one.id else one for one in road.lanes]
    sections = Corridor(replace(road, lanes=tuple(apart))).sections
    assert [[lane.next for lane in one.lanes] for one in sections] == [[0, 1], [0, 1], [-1, -1]]
    assert sections[1].lanes[0].offset == pytest.approx(np.full(31, 3.5))
    # One that turns away is none of the road's lanes.
    away = apart[2].centre.copy()
    away[:, 1] += np.linspace(0.0, 5.0, len(away))
    apart[2] = replace(apart[2], centre=away)
    sections = Corridor(replace(road, lanes=tuple(apart))).sections
    assert [len(one.lanes) for one in sections] == [2, 1, 2]


def test_a_place_on_a_lane_is_numpys_to_the_bit():
    rng = np.random.default_rng(3)
    lane = Corridor(road_map((2,), length=90.0, curvature=0.004)).sections[0].lanes[1]
    station = lane.station
    for s in (*rng.uniform(-20.0, 120.0, 500), *station[:5], station[-1]):
        k = min(max(int(np.searchsorted(station, s, side="right")) - 1, 0), len(station) - 1)
        j = min(k + 1, len(station) - 1)
        span = station[j] - station[k]
        u = np.clip((s - station[k]) / span, 0.0, 1.0) if span > 0.0 else 0.0
        there = [one[k] + u * (one[j] - one[k]) for one in (lane.offset, lane.width)]
        assert lane.at(float(s))[:2] == tuple(there)
