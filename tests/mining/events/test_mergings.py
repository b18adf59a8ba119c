"""Mergings with quantities worked out by hand, and laws that hold for all of them."""

import numpy as np
import pytest
from tests.mining.events.planted import T, found, line, rows_of, turning
from tests.mining.lanes.planted import highway
from tests.mining.lanes.planted import recorded as on_lanes

from bridgegen.drivers.kinds import BICYCLE, CAR
from bridgegen.recordings.events.event import NO_CHANGE, NOT_WHOLE
from bridgegen.recordings.events.find import find_events
from bridgegen.recordings.events.meetings import TOUCH
from bridgegen.recordings.lanes.find import Located, fit_of, locate
from bridgegen.recordings.lanes.model import Strip, assemble
from bridgegen.recordings.lanes.placing import place
from bridgegen.recordings.readers.clean import clean

LENGTH = 4.5


def turns_into_a_street(ahead=0.0):
    """At 6 m/s, one drives east, one comes from the south and turns right, to the east.

    The arc has a radius of 10 m, from (-10, -10) to (0, 0); it is 2 m from the other's path when
    it still has to turn by acos(0.8) = 36.87°, at (-6, -2), after 30 + 9.27 m. Points of the other
    path are 2 m from the arc from (-sqrt(12² - 10²), 0) on.
    """
    return line(-66.0 + ahead, 0.0, 0.0, 6.0), turning(-10.0, -40.0, 0.5 * np.pi, 6.0, 30.0, 10.0,
                                                        -1.0)  # fmt: skip


def test_a_turn_into_a_street_from_both_views():
    """The one on the street comes 3.3 s after the one that merges."""
    arc = 10.0 * (0.5 * np.pi - np.arccos(0.8))
    joins, arrives = (30.0 + arc) / 6.0, (66.0 - np.sqrt(44.0)) / 6.0
    _, by_kind = found(turns_into_a_street())
    merging = by_kind["merging"]
    assert (merging.ego.tolist(), merging.others["other"].tolist()) == ([0, 1], [1, 0])
    assert merging.begin == pytest.approx([joins - 6.0] * 2, abs=0.05)
    assert merging.end == pytest.approx([arrives] * 2, abs=0.05)
    gap = 6.0 * (arrives - joins) - LENGTH
    wanted = {
        "ego_speed": [6.0, 6.0], "other_joining_speed": [6.0, 6.0], "ego_merges": [0.0, 1.0],
        "ego_first": [0.0, 1.0], "time_gap": [arrives - joins] * 2, "side": [1.0, -1.0],
        "ego_distance": [36.0 + 6.0 * (arrives - joins), 36.0], "gap": [gap] * 2,
        "follower_gap": [gap] * 2, "lead_gap": [np.nan] * 2, "lane_left": [np.nan] * 2,
        "angle": [90.0 - np.degrees((arc - 5.0) / 10.0)] * 2,
    }  # fmt: skip
    for name, values in wanted.items():
        assert merging.quantities[name] == pytest.approx(values, abs=0.5, nan_ok=True), name


def test_of_several_in_the_street_the_next_ones_count():
    """Two come before it, two after."""
    street = [turns_into_a_street(ahead)[0] for ahead in (38.0, 28.0, 0.0, -12.0)]
    _, by_kind = found([*street, turns_into_a_street()[1]])
    merging = by_kind["merging"]
    pairs = sorted(zip(merging.ego.tolist(), merging.others["other"].tolist(), strict=True))
    assert pairs == [(1, 4), (2, 4), (4, 1), (4, 2)]
    gaps = merging.quantities
    assert (gaps["lead_gap"] > 0.0).all()
    assert (gaps["follower_gap"] > 0.0).all()


def roundabout(begin=-1.0):
    """One in a ring of 16 m radius, and one that comes to it from outside.

    The entry is an arc to the right of 12 m radius, tangential to the ring at (16, 0), from where
    on it drives in the ring.
    """
    way = 6.0 * T - 54.0
    ring = (T, 16.0 * np.cos(way / 16.0), 16.0 * np.sin(way / 16.0))
    way = 6.0 * T - 36.0 + begin
    turned = np.clip(way / 12.0, -0.4 * np.pi, 0.0)
    straight = np.minimum(way + 0.4 * np.pi * 12.0, 0.0)
    x = 28.0 - 12.0 * np.cos(turned) + straight * np.cos(0.9 * np.pi)
    y = 12.0 * np.sin(turned) + straight * np.sin(0.9 * np.pi)
    on = np.maximum(way, 0.0) / 16.0
    inside = way > 0.0
    entering = (T, np.where(inside, 16.0 * np.cos(on), x), np.where(inside, 16.0 * np.sin(on), y))
    return ring, entering


def test_who_enters_a_roundabout_merges():
    _, by_kind = found(roundabout())
    merging = by_kind["merging"]
    assert merging.quantities["ego_merges"].tolist() == [0.0, 1.0]
    assert merging.quantities["side"].tolist() == [1.0, -1.0]


def test_who_drives_behind_another_merges_not():
    one, other = turns_into_a_street()
    t, x, y = other
    assert len(found([other, (t[30:], x[:-30], y[:-30])])[1]["merging"]) == 0
    assert len(found([one, line(-90.0, 0.5, 0.0, 6.0)])[1]["merging"]) == 0


def test_who_crosses_or_drives_beside_does_not_merge():
    one, _ = turns_into_a_street()
    for other in (line(-40.0, -60.0, 0.4 * np.pi, 6.0), line(-60.0, 3.5, 0.0, 9.0)):
        events = found([one, other])[1]["merging"]
        assert (len(events), events.refused) == (0, {})


def test_paths_that_part_soon_do_not_join():
    """It moves on to a line 3 m aside, so that they are one for 7 m."""
    one, (t, x, y) = turns_into_a_street()
    aside = 3.0 * np.clip((x + 6.0) / 10.0, 0.0, 1.0)
    assert len(found([one, (t, x, y - aside)])[1]["merging"]) == 0


def test_who_turns_into_the_far_side_of_a_street_crosses_it():
    """It crosses the other path at acos(0.84) = 33°, and goes on 1.6 m to its left."""
    one, (t, x, y) = turns_into_a_street()
    assert len(found([one, (t, x, y + 1.6)])[1]["merging"]) == 0
    assert len(found([one, (t, x, y + 0.5)])[1]["merging"]) == 2


@pytest.mark.parametrize(("later", "count"), [(3.0, 2), (5.8, 2), (6.2, 0)])
def test_both_pass_within_six_seconds(later, count):
    """It joins 12 m of path earlier, so that enough is recorded of both beyond."""
    joins = (18.0 + 10.0 * (0.5 * np.pi - np.arccos(0.8))) / 6.0
    street = line(-6.0 * (joins + later) - np.sqrt(44.0), 0.0, 0.0, 6.0)
    merges = turning(-10.0, -28.0, 0.5 * np.pi, 6.0, 18.0, 10.0, -1.0)
    assert len(found([street, merges])[1]["merging"]) == count


def test_bodies_that_touch_are_counted_and_no_event():
    _, by_kind = found(turns_into_a_street(18.0))
    assert (len(by_kind["merging"]), by_kind["merging"].refused) == (0, {TOUCH: 2})


def test_who_appears_when_the_first_joins_is_not_recorded_as_a_whole():
    _, other = turns_into_a_street()
    _, by_kind = found([line(-66.0, 0.0, 0.0, 6.0, begin=5.9), other])
    assert (len(by_kind["merging"]), by_kind["merging"].refused) == (0, {NOT_WHOLE: 2})


def test_bicycles_merge_with_nobody():
    assert len(found(turns_into_a_street(), [CAR, BICYCLE])[1]["merging"]) == 0


def scene_of_all():
    street = turns_into_a_street()
    ring = [(t, x + 400.0, y - 300.0) for t, x, y in roundabout()]
    return [*street, *ring]


@pytest.mark.parametrize("moved", [
    {"turn": 0.7}, {"turn": -2.5}, {"shift": (3.0e5, -5.0e6)}, {"later": 3600.0},
])  # fmt: skip
def test_place_direction_and_time_change_nothing(moved):
    here = rows_of(found(scene_of_all())[1], ["merging"])
    there = rows_of(found(scene_of_all(), **moved)[1], ["merging"])
    assert len(here) == 4
    for one, other in zip(here, there, strict=True):
        assert one[:2] == other[:2]
        assert other[3] == pytest.approx(one[3], rel=1e-3, abs=0.051, nan_ok=True)


def test_numbers_of_participants_change_nothing():
    order = [2, 1, 3, 0]
    tracks = scene_of_all()
    here = rows_of(found(tracks)[1], ["merging"])
    there = rows_of(found([tracks[i] for i in order])[1], ["merging"], order)
    for one, other in zip(here, there, strict=True):
        assert one[:2] == other[:2]
        assert other[3] == pytest.approx(one[3], rel=1e-6, nan_ok=True)


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_a_motorway_without_ramps_has_no_mergings(noise):
    cleaned = clean(highway(3, n=20, length=300.0, noise=noise), 0.05).traffic
    located = locate(cleaned)
    counts = {one.kind.name: len(one) for one in find_events(cleaned, located).kinds}
    assert counts["merging"] == 0
    assert counts["lane-change"] > 0


WIDTH = 3.6


def straight(name, group, x, y, **links):
    """A lane along x from one place to another, at an offset."""
    s = np.arange(x[0], x[1] + 1.0)
    line = np.column_stack([s, np.linspace(y[0], y[1], len(s))])
    return Strip(name, "driving", group, line, np.full_like(s, WIDTH), s - x[0], **links)


def on_strips(strips, tracks):
    lanes = assemble("map", strips)
    tracks = [{"time": T, "x": x, "y": np.broadcast_to(y, T.shape)} for x, y in tracks]
    traffic = clean(on_lanes(tracks), 0.05).traffic
    states = place(traffic, lanes)
    found = find_events(traffic, Located(lanes, states, fit_of(traffic, states, lanes)))
    return next(one for one in found.kinds if one.kind.name == "merging")


def lane_that_ends():
    """A lane and one to its right, which ends at x = 300 m; the left one goes on."""
    return [
        straight("left", 0, (0.0, 300.0), (0.0, 0.0), right=1, successors=(2,)),
        straight("right", 0, (0.0, 300.0), (-WIDTH, -WIDTH), left=0),
        straight("on", 1, (300.0, 500.0), (0.0, 0.0)),
    ]


def changing(begin, duration):
    phase = np.clip((T - begin) / duration, 0.0, 1.0)
    return -WIDTH + 0.5 * WIDTH * (1.0 - np.cos(np.pi * phase))


def test_who_leaves_a_lane_that_ends_merges():
    """It changes lane from 6 s to 10 s, at 20 m/s, from x = 100 on; it is over the line at 8 s."""
    merging = on_strips(lane_that_ends(), [
        (-20.0 + 20.0 * T, changing(6.0, 4.0)), (-65.0 + 22.0 * T, 0.0), (10.0 + 20.0 * T, 0.0),
    ])  # fmt: skip
    pairs = list(zip(merging.ego.tolist(), merging.others["other"].tolist(), strict=True))
    assert sorted(pairs) == [(0, 1), (0, 2), (1, 0), (2, 0)]
    behind = pairs.index((1, 0))
    wanted = {
        "ego_merges": 0.0, "ego_first": 0.0, "side": 1.0, "time_gap": 29.0 / 22.0, "gap": 24.5,
        "lead_gap": 25.5, "follower_gap": 24.5, "lane_left": 160.0, "change_time": 4.0,
        "change_distance": 40.0,
    }  # fmt: skip
    for name, value in wanted.items():
        # The centre is over the line a little before the middle of the change.
        assert merging.quantities[name][behind] == pytest.approx(value, abs=2.5, rel=0.03), name


def test_who_speeds_up_before():
    """From 15 to 20 m/s at 2 m/s² from 2 s on; it is over the line at 8 s."""
    speed = np.clip(15.0 + 2.0 * (T - 2.0), 15.0, 20.0)
    way = np.concatenate([[0.0], np.cumsum(0.05 * (speed[1:] + speed[:-1]))])
    merging = on_strips(lane_that_ends(), [(way, changing(6.0, 4.0)), (-70.0 + 22.0 * T, 0.0)])
    wanted = {"slow_speed": 15.0, "fast_speed": 20.0, "speeding_rate": 2.0,
              "speeding_distance": 120.0 - 6.25}  # fmt: skip
    for name, value in wanted.items():
        assert merging.quantities[name] == pytest.approx([value] * 2, rel=0.03), name
    assert np.isnan(on_strips(lane_that_ends(), [
        (20.0 * T, changing(6.0, 4.0)), (-50.0 + 22.0 * T, 0.0),
    ]).quantities["slow_speed"]).all()  # fmt: skip


def test_where_both_lanes_go_on_nobody_merges():
    strips = lane_that_ends()
    strips[1] = straight("right", 0, (0.0, 300.0), (-WIDTH, -WIDTH), left=0, successors=(3,))
    strips.append(straight("right on", 1, (300.0, 500.0), (-WIDTH, -WIDTH), left=2))
    strips[2] = straight("on", 1, (300.0, 500.0), (0.0, 0.0), right=3)
    merging = on_strips(strips, [(20.0 * T, changing(6.0, 4.0)), (-50.0 + 22.0 * T, 0.0)])
    assert (len(merging), merging.refused) == (0, {})


def test_a_drift_across_the_line_is_no_lane_change():
    """It moves across in 20 s, of which 14 are recorded."""
    drift = -WIDTH + 1.2 * WIDTH * T / T[-1]
    merging = on_strips(lane_that_ends(), [(20.0 * T, drift), (-50.0 + 22.0 * T, 0.0)])
    assert (len(merging), merging.refused) == (0, {NO_CHANGE: 2})


def test_two_lanes_that_lead_into_one():
    """A ramp comes at 5.7°; one follows the other by 36 m, at 18 m/s."""
    strips = [
        straight("main", 0, (0.0, 200.0), (0.0, 0.0), successors=(2,)),
        straight("ramp", 1, (0.0, 200.0), (-20.0, 0.0), successors=(2,)),
        straight("on", 2, (200.0, 500.0), (0.0, 0.0)),
    ]
    x = 18.0 * T
    merging = on_strips(strips, [(36.0 + x, 0.0), (x, np.minimum(0.1 * x - 20.0, 0.0))])
    assert merging.quantities["ego_merges"].tolist() == [0.0, 1.0]
    assert merging.quantities["angle"] == pytest.approx([5.71] * 2, abs=0.1)
    assert merging.quantities["time_gap"] == pytest.approx([2.0] * 2, abs=0.06)
