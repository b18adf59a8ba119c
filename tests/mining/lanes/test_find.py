"""A map given for recordings: it fits, fits in its projection, or is refused."""

from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve, refuses
from tests.mining.lanes.planted import recorded
from tests.mining.lanes.test_road_map import drive
from tests.openx.opendrive.kinds import model

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.model import Offset
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.recordings.lanes.find import locate, read_map
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.table import Lanelet


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A map in a file, with an offset in its header, and traffic in its coordinates."""
    roads = model("signals")
    traffic, names, *_ = drive(roads, 2)
    roads = replace(roads, header=replace(roads.header, offset=Offset(5e5, 4e6, 0.0, 0.4)))
    path = tmp_path_factory.mktemp("map") / "place.xodr"
    path.write_bytes(to_xml(roads))
    return path, traffic, names


def moved(traffic, x, y):
    return replace(traffic, x=x, y=y, heading=traffic.heading + 0.4)


def test_a_map_is_taken_before_all_else(scene):
    path, traffic, _ = scene
    found = locate(clean(traffic).traffic, read_map(path))
    assert found.lanes.source == "map"
    assert found.fit.vehicle_share > 0.99
    assert found.lanes.notes == ()


def test_a_recording_in_the_maps_projection_is_placed_by_the_headers_offset(scene):
    path, traffic, _ = scene
    x, y = traffic.x + 5e5, traffic.y + 4e6
    c, s = np.cos(0.4), np.sin(0.4)
    there = moved(traffic, c * x - s * y, s * x + c * y)
    cleaned = clean(replace(there, vx=np.full(len(x), np.nan), vy=np.full(len(x), np.nan)))
    found = locate(cleaned.traffic, read_map(path))
    here = locate(clean(traffic).traffic, read_map(path))
    assert found.fit.vehicle_share > 0.99
    assert "header's offset" in found.lanes.notes[0]
    assert (found.placed.lane == here.placed.lane).mean() > 0.98


def test_a_map_of_another_place_is_refused_with_both_places(scene):
    path, traffic, _ = scene
    there = clean(replace(traffic, x=traffic.x + 3000.0)).traffic
    with refuses(InputError) as got:
        locate(there, read_map(path))
    assert str(path) in str(got.value)


def test_a_map_that_fits_badly_is_said_to(scene):
    path, traffic, _ = scene
    there = clean(replace(traffic, x=traffic.x + 7.0, y=traffic.y + 7.0)).traffic
    found = locate(there, read_map(path))
    assert 0.5 <= found.fit.vehicle_share < 0.9
    approve(found.lanes.notes[-1], "place")


def test_a_recording_without_vehicles_is_not_judged(scene):
    path, *_ = scene
    walk = {"time": np.arange(50) * 0.1, "x": np.arange(50) * 0.1 + 900.0, "y": np.zeros(50)}
    found = locate(clean(recorded([walk], kind=5)).traffic, read_map(path))
    assert np.isnan(found.fit.vehicle_share)


def _on_a_lanelet(y):
    """Return a recording of four parked cars and one that drives at y, on the lane at 0."""
    time, rng = np.arange(100) * 0.1, np.random.default_rng(3)
    tracks = [{"time": time, "x": 10.0 * time, "y": np.full(100, y)}]
    for k in range(4):
        noise = rng.normal(0.0, 0.3, (2, 100))
        tracks.append({"time": time, "x": 20.0 * k + noise[0], "y": 6.0 + noise[1]})
    ends = np.array([-10.0, 130.0])
    lane = Lanelet(
        name="1",
        left=np.column_stack([ends, np.full(2, 1.75)]),
        right=np.column_stack([ends, np.full(2, -1.75)]),
    )
    return clean(recorded(tracks, lanelets=[lane])).traffic


def test_parked_vehicles_do_not_speak_against_the_lanes():
    found = locate(_on_a_lanelet(0.0))
    assert (found.lanes.source, found.fit.vehicle_share) == ("lanelets", 1.0)
    assert found.placed.on_lane.mean() < 0.3


def test_lanes_that_nobody_drives_on_are_not_used():
    found = locate(_on_a_lanelet(4.0))
    assert found.lanes.source == "none"
    approve(found.lanes.notes[0], "vehicles")
