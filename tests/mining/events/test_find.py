"""Events on a straight road with two lanes, with quantities worked out by hand."""

import numpy as np
import pytest
from tests.mining.lanes.planted import BOX, on_road, recorded

from bridgegen.drivers.kinds import CAR
from bridgegen.recordings.events.event import EGO_CHANGES, OVERLAP
from bridgegen.recordings.events.find import DETECTORS, find_events
from bridgegen.recordings.events.of_scenarios import encounters_of, scenario_events, whole_share
from bridgegen.recordings.lanes.find import Located, fit_of
from bridgegen.recordings.lanes.model import Strip, assemble
from bridgegen.recordings.lanes.placing import place
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.states import centre_ahead
from bridgegen.scenario.language.event_kinds import EVENT_KINDS
from bridgegen.scenario.language.reader import load

WIDTH = 3.6
T = np.arange(0.0, 14.0, 0.1)
RIGHT, LEFT = 0.5 * WIDTH, 1.5 * WIDTH
LENGTH = BOX[0]


def two_lanes(turn):
    s = np.arange(0.0, 801.0, 1.0)
    strips = []
    for lane in range(2):
        x, y, _ = on_road(s - 100.0, np.full_like(s, (lane + 0.5) * WIDTH), turn=turn)
        strips.append(Strip(
            str(lane), "driving", 0, np.column_stack([x, y]), np.full_like(s, WIDTH), s,
            left=1 if lane == 0 else -1, right=0 if lane == 1 else -1,
        ))  # fmt: skip
    return assemble("map", strips)


def change(begin, duration, one, other):
    """An offset that goes from one lane to the other."""
    phase = np.clip((T - begin) / duration, 0.0, 1.0)
    return one + 0.5 * (other - one) * (1.0 - np.cos(np.pi * phase))


def ramp(first, last, begin, rate):
    """The path and speed of who brakes."""
    speed = np.clip(first - rate * (T - begin), last, first)
    return np.concatenate([[0.0], np.cumsum(0.05 * (speed[1:] + speed[:-1]))])


def placed(*paths, turn=0.0):
    """Cleaned traffic of vehicles with stations, and offsets of their rear axles, and its lanes."""
    tracks = []
    for s, t in paths:
        t = np.broadcast_to(t, T.shape)
        course = np.arctan2(np.gradient(t), np.maximum(np.gradient(s), 1e-9))
        ahead = centre_ahead(CAR, LENGTH) * np.sin(course)
        x, y, _ = on_road(s, t + np.where(np.gradient(t) == 0.0, 0.0, ahead), turn=turn)
        tracks.append({"time": T, "x": x, "y": y})
    traffic = clean(recorded(tracks), 0.05).traffic
    lanes = two_lanes(turn)
    states = place(traffic, lanes)
    return traffic, Located(lanes, states, fit_of(traffic, states, lanes))


def found(*paths, turn=0.0):
    """Events, and by kind, of vehicles with stations, and offsets of their rear axles."""
    events = find_events(*placed(*paths, turn=turn))
    return events, {one.kind.name: one for one in events.kinds}


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_a_cut_in(turn):
    """The other is 40 m ahead at first, 5 m/s slower, and changes from 4 s to 8 s."""
    _, by_kind = found((25.0 * T, RIGHT), (40.0 + 20.0 * T, change(4.0, 4.0, LEFT, RIGHT)),
                       turn=turn)  # fmt: skip
    cut_in = by_kind["cut-in"]
    assert (len(cut_in), cut_in.ego[0], cut_in.others["other"][0]) == (1, 0, 1)
    assert cut_in.begin[0] == pytest.approx(4.0, abs=0.1)
    wanted = {
        "ego_speed": 25.0, "other_speed": 20.0, "relative_speed": 5.0, "gap": 20.0 - LENGTH,
        "lateral_distance": WIDTH, "change_time": 4.0,
        "lateral_speed": 0.9, "side": 1.0, "lane_width": WIDTH, "lead_time": 4.0,
    }  # fmt: skip
    for name, value in wanted.items():
        assert cut_in.quantities[name][0] == pytest.approx(value, rel=0.02, abs=0.05), name
    # The centre, ahead of the rear axle, crosses the line a little before half of the time.
    assert 10.0 - LENGTH <= cut_in.quantities["crossing_gap"][0] <= 10.5 - LENGTH


def test_bodies_that_overlap_are_counted_and_no_event():
    _, by_kind = found((20.0 * T, RIGHT), (3.0 + 20.0 * T, change(4.0, 4.0, LEFT, RIGHT)))
    assert len(by_kind["cut-in"]) == 0
    assert by_kind["cut-in"].refused == {OVERLAP: 1}


def test_an_ego_that_leaves_the_lane_meanwhile_is_cut_in_by_nobody():
    _, by_kind = found(
        (20.0 * T, change(4.5, 4.0, RIGHT, LEFT)),
        (30.0 + 20.0 * T, change(4.0, 4.0, LEFT, RIGHT)),
    )
    assert len(by_kind["cut-in"]) == 0
    assert by_kind["cut-in"].refused == {EGO_CHANGES: 1}


def test_who_touches_the_line_changes_no_lane():
    bump = RIGHT + 2.0 * np.exp(-(((T - 6.0) / 0.8) ** 2))
    _, by_kind = found((20.0 * T, bump), (40.0 + 20.0 * T, RIGHT))
    assert len(by_kind["lane-change"]) == 0


def test_a_cut_out_reveals_who_stands():
    """The leader leaves from 4 s to 6 s, 30 m before a vehicle that stands."""
    _, by_kind = found(
        (20.0 * T, RIGHT), (30.0 + 20.0 * T, change(4.0, 2.0, RIGHT, LEFT)),
        (np.full_like(T, 140.0 + LENGTH), RIGHT),
    )  # fmt: skip
    cut_out = by_kind["cut-out"]
    assert (len(cut_out), cut_out.others["revealed"][0]) == (1, 2)
    wanted = {
        "gap": 30.0 - LENGTH, "revealed_speed": 0.0, "revealed_gap": 30.0, "change_time": 2.0,
        "side": -1.0, "lead_time": 4.0,
    }  # fmt: skip
    for name, value in wanted.items():
        assert cut_out.quantities[name][0] == pytest.approx(value, rel=0.02, abs=0.1), name


def test_a_leader_brakes_before_one_that_stands():
    """From 20 m/s at 4 m/s² to 8 m/s; the ego, 60 m behind, keeps its speed."""
    lead = 60.0 + ramp(20.0, 8.0, 5.0, 4.0)
    stands = np.full_like(T, 280.0)
    _, by_kind = found((20.0 * T, RIGHT), (lead, RIGHT), (stands, RIGHT))
    brakes = by_kind["lead-brakes"]
    assert (len(brakes), brakes.ego[0], brakes.others["next"][0]) == (1, 0, 2)
    wanted = {
        "lead_speed": 20.0, "deceleration": 4.0, "low_speed": 8.0, "gap": 60.0 - LENGTH,
        "next_speed": 0.0, "next_gap": 120.0 - LENGTH, "lead_time": 5.0,
    }  # fmt: skip
    for name, value in wanted.items():
        assert brakes.quantities[name][0] == pytest.approx(value, rel=0.02, abs=0.1), name
    assert np.isnan(brakes.quantities["queue_gap"][0])


def test_an_approach_begins_ten_seconds_before_the_collision():
    _, by_kind = found((25.0 * T, RIGHT), (80.0 + LENGTH + 20.0 * T, RIGHT - 0.5))
    approach = by_kind["approach"]
    assert len(approach) == 1
    assert approach.begin[0] == pytest.approx(6.0, abs=0.1)  # 50 m at 5 m/s
    assert approach.quantities["gap"][0] == pytest.approx(50.0, abs=0.5)
    assert approach.quantities["lead_offset"][0] == pytest.approx(-0.5, abs=0.02)


def test_following_is_behind_the_same_leader_at_its_speed():
    _, by_kind = found((20.0 * T, RIGHT), (40.0 + LENGTH + 20.0 * T, RIGHT), (20.0 * T, LEFT))
    following = by_kind["following"]
    assert (len(following), following.ego[0]) == (1, 0)
    assert following.quantities["headway"][0] == pytest.approx(2.0, rel=0.01)
    assert following.quantities["following_time"][0] == pytest.approx(13.9, abs=0.1)


def test_an_overtaking_is_a_lane_change_until_it_is_level():
    """8 m/s faster and 48 m behind at 2 s: level 6 s later."""
    _, by_kind = found((28.0 * T, change(2.0, 3.0, RIGHT, LEFT)), (64.0 + 20.0 * T, RIGHT))
    (passing,) = by_kind["lane-change"].quantities["passing_time"]
    assert passing == pytest.approx(6.0, abs=0.1)


def test_rates_are_of_all_that_can_be_the_ego():
    """Two vehicles, 13.9 s each; one event has the exact interval 0.0253 to 5.5716 (Garwood)."""
    events, _ = found((25.0 * T, RIGHT), (40.0 + 20.0 * T, change(4.0, 4.0, LEFT, RIGHT)))
    assert events.hours == pytest.approx(2 * 13.9 / 3600, rel=0.01)
    assert events.kilometres == pytest.approx(0.0139 * 45, rel=0.01)
    rate = encounters_of(1, [events], "cut-in").per_hour
    assert rate.low * events.hours == pytest.approx(0.025318, rel=1e-4)
    assert rate.high * events.hours == pytest.approx(5.571643, rel=1e-6)


def test_driving_counts_by_the_share_of_events_that_are_not_cut_off():
    """One lane change is recorded as a whole, of another one only the beginning."""
    whole = (25.0 * T, RIGHT), (40.0 + 20.0 * T, change(4.0, 4.0, LEFT, RIGHT))
    cut = (25.0 * T, RIGHT), (40.0 + 25.0 * T, change(10.8, 5.0, LEFT, RIGHT))
    events = [found(*one)[0] for one in (whole, cut)]
    assert whole_share(events, "cut-in") == 0.5
    assert whole_share(events, "approach") == 1.0
    assert encounters_of(1, events, "cut-in").hours == pytest.approx(2 * 13.9 / 3600, rel=0.01)
    assert encounters_of(1, events, "approach").hours == pytest.approx(4 * 13.9 / 3600, rel=0.01)


def test_events_are_set_against_ranges_and_constraints():
    """40 m/s are beyond the range, and 4 m ahead at a difference of 5 m/s no cut-in for it."""
    scenario = load("cut-in")
    events, _ = found((40.0 * T, RIGHT), (45.0 + 35.0 * T, change(4.0, 4.0, LEFT, RIGHT)))
    met = scenario_events(scenario, scenario.recorded, [events])
    assert (met.count, met.incomplete) == (1, 0)
    assert met.rows["cut_in_distance"][0] == pytest.approx(
        np.hypot(25.0 - LENGTH + 4.6, WIDTH), rel=0.02
    )
    outside = {one.parameter: (one.below, one.above) for one in met.outside}
    assert outside == {"ego_speed": (0, 1)}
    close, _ = found((25.0 * T, RIGHT), (19.7 + 22.5 * T, change(4.0, 4.0, LEFT, RIGHT)))
    met = scenario_events(scenario, scenario.recorded, [close])
    (broken,) = met.broken
    assert (broken.rule.split(" ")[0], broken.events) == ("cut_in_distance", ("cut-in-1",))


def test_every_declared_kind_has_a_detector():
    assert DETECTORS.keys() == EVENT_KINDS.keys()
