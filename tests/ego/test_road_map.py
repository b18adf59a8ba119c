"""The road map that a driver gets: against the road network's own geometry, and its laws."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.drivers import interface
from bridgegen.drivers.road_map import road_map
from bridgegen.openx.opendrive.lanes import lane_pose

from .roads import moved, network_of

SCENARIOS = ["crossroads-s4", "cut-in", "red-light-runner", "roundabout-entry", "motorway-merge"]


@pytest.fixture(scope="module", params=SCENARIOS)
def network(request):
    model, route = network_of(request.param)
    lights = [one.id for road in model.roads for one in road.signals if one.dynamic == "yes"]
    return model, route, road_map(model, route, lights)


def test_centres_and_borders_are_those_of_the_road_network(network):
    """The oracle is `lane_pose`, which evaluates one lane at one place."""
    model, _, roads = network
    for lane in roads.lanes:
        road_id, number, lane_id = lane.id.split(":")
        road, index = model.road(road_id), int(lane_id)
        low = road.sections[int(number)].s
        for end, row in ((low, 0 if road.direction(index) > 0 else -1),):
            pose = lane_pose(road, index, end)
            assert lane.centre[row, :2] == pytest.approx((pose.x, pose.y), abs=1e-6)
            assert math.cos(lane.centre[row, 2] - pose.h) == pytest.approx(1.0, abs=1e-3)
            across = lane.left[row] - lane.right[row]
            assert np.hypot(*across) == pytest.approx(pose.width, abs=1e-6)
            if pose.width > 0.1:  # left is left of the direction of travel
                assert (
                    np.arctan2(*across[::-1])
                    == pytest.approx(math.remainder(pose.h + math.pi / 2, math.tau), abs=0.2)
                    or abs(abs(np.arctan2(*across[::-1])) - math.pi) < 0.2
                )


def test_points_are_two_metres_apart_at_most(network):
    _, _, roads = network
    for lane in roads.lanes:
        assert np.hypot(*np.diff(lane.centre[:, :2], axis=0).T).max() <= 2.0 + 1e-5
    steps = np.diff(roads.pieces[:, :, :2], axis=1)
    assert np.hypot(steps[..., 0], steps[..., 1]).max() <= 2.0 + 1e-5


def test_what_leads_on_begins_where_a_lane_ends(network):
    _, _, roads = network
    by_id = {lane.id: lane for lane in roads.lanes}
    count = 0
    for lane in roads.lanes:
        for one in lane.next:
            other = by_id[one]
            assert lane.id in other.previous
            if lane.kind == "driving":
                count += 1
                gap = np.hypot(*(other.centre[0, :2] - lane.centre[-1, :2]))
                assert gap < 0.01, (lane.id, one)
                assert math.cos(other.centre[0, 2] - lane.centre[-1, 2]) > 0.999
    assert count > 0 or len(by_id) < 8


def test_neighbours_are_symmetric(network):
    _, _, roads = network
    by_id = {lane.id: lane for lane in roads.lanes}
    for lane in roads.lanes:
        for side, other_side in (("left", "right"), ("right", "left")):
            beside = getattr(lane, f"{side}_lane")
            if not beside:
                continue
            other = by_id[beside]
            same = getattr(lane, f"{side}_is_same_way")
            back = other_side if same else side
            assert getattr(other, f"{back}_lane") == lane.id
            assert getattr(other, f"{back}_is_same_way") == same
            assert getattr(other, f"{back}_marking") == getattr(lane, f"{side}_marking")


def test_the_route_is_a_chain_of_lanes(network):
    _, route, roads = network
    by_id = {lane.id: lane for lane in roads.lanes}
    assert len(roads.route) == len({(s.road_id, s.lane_id, s.s) for s in route.steps})
    for one, other in zip(roads.route, roads.route[1:], strict=False):
        assert other in by_id[one].next


def test_pieces_are_the_lanes_in_parts(network):
    _, _, roads = network
    centres = roads.piece_kind == interface.CENTRE
    for number, lane in enumerate(roads.lanes):
        parts = np.flatnonzero(centres & (roads.piece_lane == number))
        joined = [roads.pieces[parts[0], :1]]
        for part in parts:
            count = roads.piece_points[part]
            assert 2 <= count <= interface.PIECE_POINTS
            np.testing.assert_array_equal(roads.pieces[part, 0], joined[-1][-1])
            joined.append(roads.pieces[part, 1:count])
        np.testing.assert_array_equal(np.concatenate(joined), lane.centre)


def test_lights_govern_lanes_that_lead_into_the_junction():
    model, route = network_of("red-light-runner")
    ids = [one.id for road in model.roads for one in road.signals if one.dynamic == "yes"]
    roads = road_map(model, route, ids)
    assert [light.id for light in roads.lights] == ids
    by_id = {lane.id: lane for lane in roads.lanes}
    for number, light in enumerate(roads.lights):
        assert light.lanes
        assert 2.0 < np.hypot(*(light.stop[1] - light.stop[0])) < 30.0
        for one in light.lanes:
            lane = by_id[one]
            near = np.hypot(*(lane.centre[:, :2] - light.stop.mean(axis=0)).T).min()
            assert near < 10.0
            pieces = roads.piece_lane == [each.id for each in roads.lanes].index(one)
            assert set(roads.piece_light[pieces]) <= set(range(number + 1))


@settings(max_examples=6)
@given(
    angle=st.floats(-3.0, 3.0), dx=st.floats(-500.0, 500.0), dy=st.floats(-500.0, 500.0),
    scenario=st.sampled_from(SCENARIOS[:2]),
)  # fmt: skip
def test_a_map_that_is_turned_and_moved_is_the_same_map(angle, dx, dy, scenario):
    model, route = network_of(scenario)
    one, other = road_map(model, route, ()), road_map(moved(model, angle, dx, dy), route, ())
    c, s = math.cos(angle), math.sin(angle)
    x, y = one.pieces[..., 0], one.pieces[..., 1]
    turned = np.stack((c * x - s * y + dx, s * x + c * y + dy), axis=-1)
    np.testing.assert_allclose(other.pieces[..., :2], turned, atol=1e-6)
    turn = other.pieces[..., 2] - one.pieces[..., 2] - angle
    np.testing.assert_allclose(np.cos(turn), 1.0, atol=1e-9)
    for name in ("piece_points", "piece_kind", "piece_lane", "piece_marking"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
