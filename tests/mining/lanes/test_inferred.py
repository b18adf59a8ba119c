"""Lanes inferred from paths: those that were planted, or none."""

import numpy as np
import pytest
from tests.mining.lanes.planted import highway, on_road, recorded

from bridgegen.recordings.lanes.find import locate
from bridgegen.recordings.lanes.inferred import infer_lanes
from bridgegen.recordings.readers.clean import clean

ROADS = {
    "straight": {},
    "left bend": {"radius": 400.0, "turn": 1.0},
    "right bend": {"radius": -150.0, "length": 350.0},
    "noise of 0.2 m": {"noise": 0.2},
    "narrow lanes": {"lanes": 5, "width": 3.2, "n": 120},
    "one lane": {"lanes": 1, "n": 20},
    "two directions": {"lanes": 2, "opposing": True, "radius": 800.0},
}


@pytest.mark.parametrize("road", ROADS)
def test_states_are_on_the_lanes_that_were_planted(road):
    traffic = clean(highway(1, **ROADS[road])).traffic
    found = locate(traffic)
    lanes, lane = found.lanes, found.placed.lane
    assert lanes.source == "inferred"
    assert (lane >= 0).mean() > 0.999
    assert (lanes.number[lane] == traffic.lane).mean() > 0.99
    assert set(lanes.carriageway) == ({0, 1} if "opposing" in ROADS[road] else {0})
    width = ROADS[road].get("width", 3.6)
    np.testing.assert_allclose(lanes.width, width, atol=0.2)


def test_stations_are_distances_along_the_road_in_a_bend():
    traffic = clean(highway(2, radius=200.0, length=300.0)).traffic
    placed = locate(traffic).placed
    s = np.arctan2(traffic.x, 200.0 - traffic.y) * 200.0
    middle = 1.0 - 1.5 * 3.6 / 200.0  # the middle of the three lanes is shorter than t = 0
    on = placed.lane >= 0
    distance = placed.station[on] - s[on] * middle
    assert np.ptp(distance) < 0.5
    np.testing.assert_allclose(placed.along[on], traffic.speed[on], atol=0.2)


@pytest.mark.parametrize("n", [25, 60, 150])
def test_no_lanes_are_claimed_where_there_are_none(n):
    for seed in range(5):
        traffic = clean(highway(seed, n=n, has_lanes=False, radius=500.0)).traffic
        lanes = infer_lanes(traffic)
        assert lanes.source == "none"
        assert "give a map" in lanes.notes[-1]


def test_no_lanes_within_a_crossing():
    tracks = []
    rng = np.random.default_rng(5)
    for p in range(80):
        s = np.arange(-150.0, 150.0, 1.2)
        t = -1.75 + rng.normal(0.0, 0.2) + np.zeros_like(s)
        x, y, _ = on_road(s, t, turn=p % 4 * np.pi / 2)
        tracks.append({"time": np.arange(len(s)) * 0.1 + p, "x": x, "y": y})
    traffic = clean(recorded(tracks)).traffic
    placed = locate(traffic).placed
    centre = np.hypot(traffic.x, traffic.y)
    assert not (placed.lane[centre < 5.0] >= 0).any()
    assert (placed.lane[centre > 30.0] >= 0).mean() > 0.9


def test_turned_and_moved_traffic_is_on_the_same_lanes():
    first = clean(highway(7, radius=600.0)).traffic
    other = clean(highway(7, radius=600.0, turn=2.0)).traffic
    a, b = locate(first), locate(other)
    number = [one.lanes.number[one.placed.lane] for one in (a, b)]
    assert (number[0] == number[1]).mean() > 0.998
    np.testing.assert_allclose(a.fit.rms, b.fit.rms, atol=0.05)


def test_a_recording_without_vehicles_has_no_lanes():
    walk = {"time": np.arange(50) * 0.1, "x": np.arange(50) * 0.1, "y": np.zeros(50)}
    found = locate(clean(recorded([walk], kind=5)).traffic)
    assert found.lanes.source == "none"
    assert not (found.placed.lane >= 0).any()
    assert np.isnan(found.fit.vehicle_share)
