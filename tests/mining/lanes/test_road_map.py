"""States on an OpenDRIVE map: the lanes and offsets that they were put at."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.mining.lanes.planted import STEP, recorded
from tests.openx.opendrive.kinds import KINDS, model

from bridgegen.openx.opendrive.lane_graph import LaneGraph
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.recordings.lanes.placing import place
from bridgegen.recordings.lanes.road_map import lanes_of_map

NAMES = ("signals", "turn-lanes", "straight", "curved", "merge-3", "roundabout-3")


def drive(roads, seed, n=60):
    """Return traffic along lanes that follow one another, each lane's name, offset and end."""
    graph, rng = LaneGraph(roads), np.random.default_rng(seed)
    starts = [
        number for number, node in enumerate(graph.nodes)
        if roads.roads_by_id[node.road_id].direction(node.lane_id) == node.way
        and roads.roads_by_id[node.road_id].sections[node.section].lane(node.lane_id).drivable
    ]  # fmt: skip
    tracks, names, offsets, inside = [], [], [], []
    for start in rng.choice(starts, n).tolist():
        offset, states, number = rng.uniform(-1.2, 1.2), [], start
        for _ in range(6):
            node, (entry, leave) = graph.nodes[number], graph.ends[number]
            at = np.arange(0.3, abs(leave - entry) - 0.2, 1.0)
            for s in (entry + np.sign(leave - entry) * at).tolist():
                here = lane_pose(roads.roads_by_id[node.road_id], node.lane_id, s)
                aside = min(offset, 0.4 * here.width, key=abs)
                states.append((here.x - aside * math.sin(here.h),
                               here.y + aside * math.cos(here.h), here.h))  # fmt: skip
                names.append(f"{node.road_id}:{node.section}:{node.lane_id}")
                offsets.append(aside)
                inside.append(here.width > 2.6)
            if not graph.following[number]:
                break
            number = int(rng.choice(graph.following[number]))
        x, y, h = np.array(states).T
        tracks.append({"time": np.arange(len(x)) * STEP, "x": x, "y": y, "heading": h,
                       "vx": 9.0 * np.cos(h), "vy": 9.0 * np.sin(h)})  # fmt: skip
    return recorded(tracks), np.array(names), np.array(offsets), np.array(inside)


@pytest.mark.parametrize("name", NAMES)
def test_states_are_on_the_lanes_that_they_were_put_on(name):
    roads = model(name)
    traffic, names, offsets, inside = drive(roads, 3)
    lanes = lanes_of_map(roads, name)
    placed = place(traffic, lanes)
    assert placed.on_lane[inside].all()
    same = np.array(lanes.names)[placed.lane] == names
    # At the end of a track nothing says into which of the lanes that overlap there it leads.
    assert same[inside].mean() > 0.98
    is_same_track = np.diff(traffic.participant) == 0
    changes = is_same_track & placed.on_lane[1:] & placed.on_lane[:-1] & (np.diff(placed.lane) != 0)
    for i in np.flatnonzero(changes).tolist():
        assert placed.lane[i + 1] in lanes.successors[placed.lane[i]]
    np.testing.assert_allclose(placed.offset[same], offsets[same], atol=0.05)
    np.testing.assert_allclose(placed.along[same & inside], 9.0, atol=0.1)
    np.testing.assert_allclose(placed.heading[same & inside], 0.0, atol=0.1)


def test_stations_go_on_along_a_track_and_across_lanes():
    roads = model("curved")
    lanes = lanes_of_map(roads, "curved")
    traffic, *_ = drive(roads, 4)
    placed = place(traffic, lanes)
    steps, on = np.diff(placed.station), np.diff(traffic.participant) == 0
    assert (steps[on] > 0.0).all()
    assert np.median(steps[on]) == pytest.approx(1.0, abs=0.1)
    # Two side by side at the same s of the road have the same station.
    for lane in range(len(lanes)):
        if lanes.left[lane] >= 0:
            own, other = lanes.points(lane), lanes.points(int(lanes.left[lane]))
            np.testing.assert_array_equal(lanes.station[own], lanes.station[other])


@pytest.mark.parametrize("rule", ["RHT", "LHT"])
@pytest.mark.parametrize("name", NAMES)
def test_neighbours_are_on_the_side_that_they_are_said_to_be_on(name, rule):
    roads = model(name)
    roads = replace(roads, roads=tuple(replace(road, rule=rule) for road in roads.roads))
    lanes = lanes_of_map(roads, name)
    found = 0
    for lane in range(len(lanes)):
        own = lanes.points(lane)
        for side, beside in ((1, lanes.left[lane]), (-1, lanes.right[lane])):
            if beside < 0:
                continue
            other = lanes.points(int(beside))
            h = lanes.heading[own]
            aside = (lanes.y[other] - lanes.y[own]) * np.cos(h)
            aside -= (lanes.x[other] - lanes.x[own]) * np.sin(h)
            apart = 0.5 * (lanes.width[own] + lanes.width[other])
            np.testing.assert_allclose(side * aside, apart, atol=0.05)
            if lanes.kinds[lane] == "driving":
                assert lanes.number[beside] == lanes.number[lane] + side
            found += 1
    assert found or name == "roundabout-3"  # of one lane
    assert set(lanes.kinds) <= {"driving", "bicycle", "sidewalk"}
    assert ("sidewalk" in lanes.kinds) == (name in ("signals", "straight", "roundabout-3"))


@pytest.mark.parametrize("name", ["signals", "roundabout-3"])
def test_turned_and_moved_together_nothing_changes(name):
    roads, (turn, dx, dy) = model(name), (2.2, 5e5, -3e3)
    c, s = math.cos(turn), math.sin(turn)
    moved = replace(roads, roads=tuple(
        replace(road, plan_view=tuple(
            replace(one, x=c * one.x - s * one.y + dx, y=s * one.x + c * one.y + dy,
                    hdg=one.hdg + turn)
            for one in road.plan_view
        ))
        for road in roads.roads
    ))  # fmt: skip
    traffic, *_ = drive(roads, 6)
    there = replace(
        traffic, x=c * traffic.x - s * traffic.y + dx, y=s * traffic.x + c * traffic.y + dy,
        heading=traffic.heading + turn, vx=c * traffic.vx - s * traffic.vy,
        vy=s * traffic.vx + c * traffic.vy,
    )  # fmt: skip
    a = place(traffic, lanes_of_map(roads, "here"))
    b = place(there, lanes_of_map(moved, "there"))
    same = a.lane == b.lane
    assert same.mean() > 0.99  # rounding decides where two lanes are equally near
    np.testing.assert_allclose(a.station[same], b.station[same], atol=1e-5)
    np.testing.assert_allclose(a.offset[same], b.offset[same], atol=1e-5)


def test_who_drives_on_the_wrong_side_is_on_the_lane_of_oncoming_traffic():
    lanes = lanes_of_map(model("straight"), "straight")
    lane = int(lanes.opposite.max())
    part = lanes.points(lane)
    x, y, h = (values[part][::-1] for values in (lanes.x, lanes.y, lanes.heading))
    track = {"time": np.arange(len(x)) * STEP, "x": x, "y": y, "heading": h + np.pi,
             "vx": -9.0 * np.cos(h), "vy": -9.0 * np.sin(h)}  # fmt: skip
    placed = place(recorded([track]), lanes)
    assert (placed.lane == lane).all()
    np.testing.assert_allclose(np.abs(placed.heading), np.pi, atol=1e-3)
    np.testing.assert_allclose(placed.along, -9.0, atol=1e-3)


def test_what_crosses_a_lane_is_on_it_if_it_walks_and_not_if_it_drives():
    lanes = lanes_of_map(model("straight"), "straight")
    part = lanes.points(lanes.kinds.index("driving"))
    k = part.start + 20
    h = float(lanes.heading[k]) + np.pi / 2
    at = np.linspace(-1.0, 1.0, 21)
    track = {"time": np.arange(21) * STEP, "x": lanes.x[k] + at * np.cos(h),
             "y": lanes.y[k] + at * np.sin(h), "heading": np.full(21, h),
             "vx": np.full(21, np.cos(h)), "vy": np.full(21, np.sin(h))}  # fmt: skip
    for kind, is_on in ((5, True), (0, False)):
        placed = place(recorded([track], kind=kind), lanes)
        assert (placed.on_lane == is_on).all()
    np.testing.assert_allclose(place(recorded([track], kind=5), lanes).across, 1.0, atol=1e-6)


def test_a_track_is_placed_by_itself():
    roads = model("signals")
    traffic, *_ = drive(roads, 9, n=8)
    lanes = lanes_of_map(roads, "signals")
    whole = place(traffic, lanes)
    for p, states in enumerate(traffic.states()):
        one = {key: getattr(traffic, key)[states] for key in ("time", "x", "y", "heading", "vx",
                                                              "vy")}  # fmt: skip
        alone = place(recorded([one]), lanes)
        np.testing.assert_array_equal(alone.lane, whole.lane[states], f"{p}")
        np.testing.assert_array_equal(alone.station, whole.station[states])


def test_every_kind_of_road_has_lanes():
    for name in KINDS:
        lanes = lanes_of_map(model(name), name)
        assert "driving" in lanes.kinds
        for lane in range(len(lanes)):
            assert (np.diff(lanes.station[lanes.points(lane)]) > 0.0).all(), name
