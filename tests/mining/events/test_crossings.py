"""Paths that cross, with quantities worked out by hand, and laws that hold for all of them."""

import numpy as np
import pytest
from tests.mining.events.planted import T, found, line, rows_of, turning
from tests.mining.lanes.planted import highway

from bridgegen.drivers.kinds import BICYCLE, CAR, PEDESTRIAN
from bridgegen.recordings.events.event import NOT_WHOLE
from bridgegen.recordings.events.find import find_events
from bridgegen.recordings.events.meetings import TOUCH
from bridgegen.recordings.events.of_scenarios import encounters_of
from bridgegen.recordings.lanes.find import locate
from bridgegen.recordings.readers.clean import clean

MEETINGS = ("crossing", "oncoming-left-turn", "vru-crossing")


def straight_crossing():
    """The ego drives east, and passes (0, 0) after 8 s; the other north, after 10 s."""
    return line(-80.0, 0.0, 0.0, 10.0), line(0.0, -60.0, 0.5 * np.pi, 6.0)


def test_a_crossing_from_both_views():
    _, by_kind = found(straight_crossing())
    crossing = by_kind["crossing"]
    assert (crossing.ego.tolist(), crossing.others["other"].tolist()) == ([0, 1], [1, 0])
    assert crossing.begin == pytest.approx([2.0, 2.0], abs=0.01)
    assert crossing.end == pytest.approx([10.0, 10.0], abs=0.01)
    # The ego's rear has left the strip of the other after 8 s + (2.25 + 0.9) / 10 s, and the
    # other's front reaches that of the ego at 10 s - (2.25 + 0.9) / 6 s.
    wanted = {
        "ego_speed": (10.0, 6.0), "other_speed": (6.0, 10.0), "ego_distance": (60.0, 48.0),
        "other_distance": (48.0, 60.0), "time_gap": (2.0, 2.0), "angle": (90.0, 90.0),
        "side": (1.0, -1.0), "ego_first": (1.0, 0.0), "other_turn": (0.0, 0.0),
        "seen_time": (6.0, 6.0), "other_crossing_speed": (6.0, 10.0),
    }  # fmt: skip
    for name, values in wanted.items():
        assert crossing.quantities[name] == pytest.approx(values, rel=1e-3, abs=1e-2), name
    assert crossing.quantities["pet"] == pytest.approx(2.0 - 3.15 / 10.0 - 3.15 / 6.0, abs=0.1)
    assert np.isnan(crossing.quantities["set_off_distance"]).all()


def test_rates_of_crossings_are_of_all_driving():
    """Two vehicles for 13.9 s each, and no lanes."""
    events, _ = found(straight_crossing())
    assert events.hours == 0.0
    met = encounters_of(2, [events], "crossing")
    assert met.hours == pytest.approx(2 * 13.9 / 3600.0, rel=0.01)
    assert met.km == pytest.approx(0.0139 * 16.0, rel=0.01)
    assert encounters_of(2, [events], "cut-in") is None


@pytest.mark.parametrize(("apart", "count"), [(5.8, 2), (6.2, 0)])
def test_both_pass_within_six_seconds(apart, count):
    one, _ = straight_crossing()
    _, by_kind = found([one, line(0.0, -6.0 * (8.0 - apart), 0.5 * np.pi, 6.0)])
    assert len(by_kind["crossing"]) + by_kind["crossing"].refused.get(NOT_WHOLE, 0) == count


@pytest.mark.parametrize(("angle", "count"), [(25.0, 0), (35.0, 2), (100.0, 2), (141.0, 2)])
def test_paths_cross_at_thirty_degrees_or_more(angle, count):
    course = np.radians(angle)
    other = line(-90.0 * np.cos(course), -90.0 * np.sin(course), course, 8.0)
    assert len(found([straight_crossing()[0], other])[1]["crossing"]) == count


def test_bodies_that_touch_are_counted_and_no_event():
    one, _ = straight_crossing()
    _, by_kind = found([one, line(0.0, -48.0, 0.5 * np.pi, 6.0)])
    assert (len(by_kind["crossing"]), by_kind["crossing"].refused) == (0, {TOUCH: 2})


def test_who_appears_when_the_first_is_through_is_not_recorded_as_a_whole():
    one, _ = straight_crossing()
    _, by_kind = found([one, line(0.0, -60.0, 0.5 * np.pi, 6.0, begin=7.5)])
    assert (len(by_kind["crossing"]), by_kind["crossing"].refused) == (0, {NOT_WHOLE: 2})


def oncoming():
    """One drives east; one west, 4 m left of it, turns left across its path."""
    return line(-65.0, 0.0, 0.0, 10.0), turning(60.0, 4.0, np.pi, 6.0, 48.0, 10.0, 1.0)


def test_an_oncoming_left_turn_from_both_views():
    _, by_kind = found(oncoming())
    turn = by_kind["oncoming-left-turn"]
    assert len(by_kind["crossing"]) == 0
    assert turn.quantities["ego_turns"].tolist() == [0.0, 1.0]
    assert turn.quantities["turn"] == pytest.approx([90.0, 90.0], abs=2.0)
    assert turn.quantities["approach_angle"] == pytest.approx([180.0, 180.0], abs=0.5)
    # An arc of 10 m radius that has come 4 m aside has turned by acos(0.6) = 53.1°.
    assert turn.quantities["angle"] == pytest.approx([180.0 - 53.13] * 2, abs=1.0)
    assert turn.quantities["other_crossing_speed"] == pytest.approx([6.0, 10.0], abs=0.05)


def walker(stands=4.0, speed=1.5):
    """Steps off from 5 m right of the ego's path at x = 0; within 1 s it has its speed."""
    t = np.clip(T - stands, 0.0, None)
    y = -5.0 + speed * np.where(t < 1.0, 0.5 * t**2, t - 0.5)
    return T, np.zeros_like(T), y


def parked(x):
    return T, np.full_like(T, x), np.full_like(T, -2.5)


@pytest.mark.parametrize("hidden", [False, True])
def test_a_pedestrian_crosses_perhaps_from_behind_a_parked_car(hidden):
    """It sets off at 4 s, and is on the ego's path at 7.83 s; the ego comes at 9 s."""
    tracks = [line(-90.0, 0.0, 0.0, 10.0), walker()]
    tracks += [parked(-4.0)] if hidden else [parked(8.0)]
    _, by_kind = found(tracks, [CAR, PEDESTRIAN, CAR])
    crossing = by_kind["vru-crossing"]
    assert (crossing.ego.tolist(), crossing.others["other"].tolist()) == ([0], [1])
    wanted = {
        "time_gap": 9.0 - 4.5 - 5.0 / 1.5, "side": 1.0, "is_bicycle": 0.0, "angle": 90.0,
        "other_crossing_speed": 1.5, "set_off_distance": 5.0, "set_off_ego_distance": 50.0,
        "hidden": float(hidden), "occluder_gap": 4.0 - 2.25 if hidden else np.nan,
    }  # fmt: skip
    for name, value in wanted.items():
        assert crossing.quantities[name][0] == pytest.approx(value, abs=0.2, nan_ok=True), name
    assert crossing.others["occluder"].tolist() == ([2] if hidden else [-1])


def test_who_crosses_behind_the_ego_is_not_ahead_of_it():
    _, by_kind = found([line(-40.0, 0.0, 0.0, 10.0), walker()], [CAR, PEDESTRIAN])
    assert len(by_kind["vru-crossing"]) == 0


def test_persons_do_not_meet_each_other_and_bicycles_are_no_egos():
    one, other = straight_crossing()
    assert len(found([one, other], [BICYCLE, PEDESTRIAN])[1]["vru-crossing"]) == 0
    one_view = found([one, other], [BICYCLE, CAR])[1]["vru-crossing"]
    assert (one_view.ego.tolist(), one_view.quantities["is_bicycle"].tolist()) == ([1], [1.0])


def scene_of_all():
    """Tracks and kinds that hold an event of each kind, far from each other."""
    far = [(t, x + 500.0, y) for t, x, y in oncoming()]
    street = [(t, x, y + 500.0) for t, x, y in (line(-90.0, 0.0, 0.0, 10.0), walker(), parked(-4))]
    return [*straight_crossing(), *far, *street], [CAR] * 5 + [PEDESTRIAN, CAR]


@pytest.mark.parametrize("moved", [
    {"turn": 0.7}, {"turn": -2.5}, {"shift": (3.0e5, -5.0e6)}, {"later": 3600.0},
])  # fmt: skip
def test_place_direction_and_time_change_nothing(moved):
    tracks, kinds = scene_of_all()
    here = rows_of(found(tracks, kinds)[1], MEETINGS)
    there = rows_of(found(tracks, kinds, **moved)[1], MEETINGS)
    assert [row[0] for row in here] == [
        "crossing", "crossing", "oncoming-left-turn", "oncoming-left-turn", "vru-crossing",
    ]  # fmt: skip
    for one, other in zip(here, there, strict=True):
        assert one[:2] == other[:2]
        assert other[2] == pytest.approx(one[2], abs=1e-3)
        # A post-encroachment time is a number of time steps.
        assert other[3] == pytest.approx(one[3], rel=1e-3, abs=0.051, nan_ok=True)


def test_numbers_of_participants_change_nothing():
    tracks, kinds = scene_of_all()
    order = [4, 6, 1, 3, 5, 0, 2]
    here = rows_of(found(tracks, kinds)[1], MEETINGS)
    there = found([tracks[i] for i in order], [kinds[i] for i in order])[1]
    for one, other in zip(here, rows_of(there, MEETINGS, order), strict=True):
        assert one[:2] == other[:2]
        assert other[3] == pytest.approx(one[3], nan_ok=True)


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_a_motorway_with_lane_changes_has_no_crossings(noise):
    cleaned = clean(highway(3, n=20, length=300.0, noise=noise), 0.05).traffic
    located = locate(cleaned)
    counts = {one.kind.name: len(one) for one in find_events(cleaned, located).kinds}
    assert [counts[kind] for kind in MEETINGS] == [0, 0, 0]


def test_a_fragment_meets_nobody():
    one, other = straight_crossing()
    brief = tuple(values[(T > 9.6) & (T < 10.4)] for values in other)
    events = found([one, brief])[1]["crossing"]
    assert (len(events), events.refused) == (0, {})
