"""Bicycles beside an ego, with quantities worked out by hand, and laws that hold for all."""

import numpy as np
import pytest
from tests.mining.events.planted import T, found, line, rows_of, turning

from bridgegen.drivers.kinds import BICYCLE, CAR, PEDESTRIAN
from bridgegen.recordings.events.event import NO_CHANGE
from bridgegen.recordings.events.meetings import TOUCH

RIGHT_TURN, SWINGS_OUT = "right-turn-with-bicycle", "bicycle-swings-out"


def right_turn(lead=0.0, speed=4.0):
    """A car drives north at 6 m/s and turns right after 48 m; a bicycle is 2 m to its right.

    The arc of 8 m radius is 2 m aside when it has turned by acos(0.75) = 41.41°, 53.78 m on.
    """
    return (
        turning(0.0, -48.0, 0.5 * np.pi, 6.0, 48.0, 8.0, -1.0),
        line(2.0, -52.0 + lead, 0.5 * np.pi, speed),
    )


@pytest.mark.thorough
def test_a_right_turn_across_the_way_of_a_bicycle():
    """The bicycle is 4 m ahead at first; it passes where they cross 3.4 s after the car."""
    turned = np.arccos(0.75)
    car = (48.0 + 8.0 * turned) / 6.0
    rides = (44.0 + 8.0 * np.sin(turned)) / 4.0
    _, by_kind = found(right_turn(lead=8.0), [CAR, BICYCLE])
    event = by_kind[RIGHT_TURN]
    assert (event.ego.tolist(), event.others["other"].tolist()) == ([0], [1])
    wanted = {
        "ego_first": 1.0, "time_gap": rides - car, "angle": np.degrees(turned), "ego_turn": -90.0,
        "aside": 2.0, "ahead": 4.0 - 2.0 * (car - 6.0), "other_crossing_speed": 4.0,
        "side": 1.0, "pace_before": np.nan, "pace_apart": np.nan,
    }  # fmt: skip
    for name, value in wanted.items():
        assert event.quantities[name][0] == pytest.approx(value, abs=0.6, nan_ok=True), name
    assert len(by_kind["vru-crossing"]) == 0  # the ego is first


def test_the_bicycle_may_be_first():
    event = found(right_turn(lead=28.0), [CAR, BICYCLE])[1][RIGHT_TURN]
    assert event.quantities["ego_first"].tolist() == [0.0]


@pytest.mark.parametrize("lead", [16.0, 20.0, 28.0, 36.0])
def test_an_ego_that_turns_across_is_not_swung_out_before(lead):
    events = found(right_turn(lead=lead), [CAR, BICYCLE])[1][SWINGS_OUT]
    assert len(events) == 0


def test_how_near_the_ego_was_when_the_bicycle_changed_pace():
    """It brakes from 4 to 2 m/s at 1 m/s², from 5 s on, when it is 4 m behind the car."""
    t, x, _ = right_turn()[1]
    way = np.where(T < 5.0, 4.0 * T, np.where(T < 7.0, 4.0 * T - 0.5 * (T - 5.0) ** 2,
                                              26.0 + 2.0 * (T - 7.0)))  # fmt: skip
    slow = (t, x, -24.0 + way)
    early = turning(0.0, -30.0, 0.5 * np.pi, 6.0, 30.0, 8.0, -1.0)
    event = found([early, slow], [CAR, BICYCLE])[1][RIGHT_TURN]
    wanted = {"pace_before": 4.0, "pace_after": 2.0}
    for name, value in wanted.items():
        assert event.quantities[name][0] == pytest.approx(value, abs=0.05), name
    # The car's reference point is 1.35 m behind its centre, which is at (0, 0) then.
    assert event.quantities["pace_apart"][0] == pytest.approx(np.hypot(2.0, 4.0 - 1.35), abs=0.6)


@pytest.mark.parametrize("what", ["straight", "left", "pedestrian", "oncoming", "from the left"])
def test_other_ways_are_no_right_turns_with_a_bicycle(what):
    car, bicycle = right_turn(lead=8.0)
    kinds = [CAR, PEDESTRIAN if what == "pedestrian" else BICYCLE]
    if what == "straight":
        car = line(0.0, -48.0, 0.5 * np.pi, 6.0)
    if what == "left":
        car = turning(0.0, -48.0, 0.5 * np.pi, 6.0, 48.0, 8.0, 1.0)
    if what == "oncoming":
        bicycle = line(2.0, 45.0, -0.5 * np.pi, 4.0)
    if what == "from the left":
        bicycle = line(-50.0, 5.9, 0.0, 5.0)
    assert len(found([car, bicycle], kinds)[1][RIGHT_TURN]) == 0


def test_bodies_that_touch_are_counted_and_no_event():
    event = found(right_turn(lead=14.0, speed=4.8), [CAR, BICYCLE])[1][RIGHT_TURN]
    assert (len(event), event.refused) == (0, {TOUCH: 1})


def swinging(begin=6.0, duration=3.0, one=-1.6, other=0.2, speed=4.0, ahead=30.0):
    """A bicycle that moves sideways as a cosine; east, so far ahead of x = 0."""
    phase = np.clip((T - begin) / duration, 0.0, 1.0)
    return T, ahead + speed * T, one + 0.5 * (other - one) * (1.0 - np.cos(np.pi * phase))


def street():
    """A car at 6 m/s, 18 m behind the bicycle when it swings out; a car stands 20 m before it."""
    return [line(0.0, 0.0, 0.0, 6.0), swinging(), (T, np.full_like(T, 74.0), np.full_like(T, -2.0))]


def test_a_bicycle_swings_out_before_a_car_that_stands():
    beside = T, np.full_like(T, 66.0), np.full_like(T, -6.0)
    _, by_kind = found([*street(), beside], [CAR, BICYCLE, CAR, CAR])
    event = by_kind[SWINGS_OUT]
    roles = {role: who.tolist() for role, who in event.others.items()}
    assert (event.ego.tolist(), roles) == ([0], {"other": [1], "obstacle": [2]})
    assert (event.begin[0], event.end[0]) == pytest.approx((6.0, 9.0), abs=0.2)
    wanted = {
        "ego_speed": 6.0, "other_speed": 4.0, "gap": 18.0 - 2.25 - 0.25, "offset_before": -1.6,
        "offset_after": 0.2, "change_time": 3.0, "lateral_speed": 0.6, "side": 1.0,
        "obstacle_gap": 20.0 - 2.25 - 0.25,
    }  # fmt: skip
    for name, value in wanted.items():
        assert event.quantities[name][0] == pytest.approx(value, abs=0.3), name


def bent(track, radius):
    """The same in a street that bends to the left."""
    t, x, y = track
    course = x / radius
    return t, (radius - y) * np.sin(course), radius - (radius - y) * np.cos(course)


@pytest.mark.parametrize("radius", [80.0, -80.0])
@pytest.mark.parametrize(("other", "count"), [(swinging(), 1), (swinging(other=-1.6), 0)])
def test_a_bend_is_no_swing(other, count, radius):
    tracks = [bent(one, radius) for one in (street()[0], other)]
    events = found(tracks, [CAR, BICYCLE])[1][SWINGS_OUT]
    assert (len(events), events.refused) == (count, {})
    if count:
        assert events.quantities["offset_before"][0] == pytest.approx(-1.6, abs=0.3)
        assert events.quantities["offset_after"][0] == pytest.approx(0.2, abs=0.3)


@pytest.mark.parametrize("other", [
    swinging(one=0.2, other=-1.6), swinging(one=-2.6, other=-1.6), swinging(one=-0.6, other=0.2),
    swinging(ahead=-30.0), swinging(ahead=70.0), swinging(speed=-3.0, ahead=60.0),
    swinging(one=-1.6, other=-1.6),
])  # fmt: skip
def test_who_does_not_come_into_the_path_closely_ahead_swings_not_out(other):
    """It leaves the path, stays beside it, is in it, is behind, far ahead, or comes towards it."""
    events = found([street()[0], other], [CAR, BICYCLE])[1][SWINGS_OUT]
    assert (len(events), events.refused) == (0, {})


def test_who_is_in_the_path_already_swings_not_out():
    """It drifts to the edge of the path, and later goes to its middle."""
    t, x, y = swinging(one=-1.05, other=0.2)
    drifts = y - 0.15 + 0.15 * np.clip(T - 2.0, 0.0, 1.0)
    assert len(found([street()[0], (t, x, drifts)], [CAR, BICYCLE])[1][SWINGS_OUT]) == 0


def test_an_ego_that_evades_has_been_in_the_way_nevertheless():
    """It moves to the left by 2 m as the bicycle swings out, and stays there for 3 s."""
    t, x, y = street()[0]
    out = 1.0 - np.cos(np.pi * np.clip((T - 6.5) / 2.0, 0.0, 1.0))
    back = 1.0 - np.cos(np.pi * np.clip((T - 11.5) / 2.0, 0.0, 1.0))
    events = found([(t, x, y + out - back), *street()[1:]], [CAR, BICYCLE, CAR])[1][SWINGS_OUT]
    assert len(events) == 1


def test_an_ego_that_comes_nearer_by_itself_is_not_swung_out_before():
    """It drives 2 m to the left of the bicycle's line, and moves to the right."""
    phase = np.clip((T - 5.0) / 3.0, 0.0, 1.0)
    nearer = 2.2 - 0.9 * (1.0 - np.cos(np.pi * phase))
    straight = swinging(one=0.0, other=0.0)
    t, x, _ = street()[0]
    assert len(found([(t, x, nearer), straight], [CAR, BICYCLE])[1][SWINGS_OUT]) == 0


def test_who_is_in_the_path_for_a_moment_is_counted_and_no_event():
    t, x, y = swinging(other=-1.6)
    y = y + 1.8 * np.exp(-(((T - 7.0) / 0.6) ** 2))
    events = found([street()[0], (t, x, y)], [CAR, BICYCLE])[1][SWINGS_OUT]
    assert (len(events), events.refused) == (0, {NO_CHANGE: 1})


def scene_of_all():
    far = [(t, x + 400.0, y - 300.0) for t, x, y in right_turn(lead=8.0)]
    return [*street(), *far], [CAR, BICYCLE, CAR, CAR, BICYCLE]


@pytest.mark.parametrize("moved", [
    {"turn": 0.7}, {"turn": -2.5}, {"shift": (3.0e5, -5.0e6)}, {"later": 3600.0},
])  # fmt: skip
def test_place_direction_and_time_change_nothing(moved):
    tracks, kinds = scene_of_all()
    here = rows_of(found(tracks, kinds)[1], [RIGHT_TURN, SWINGS_OUT])
    there = rows_of(found(tracks, kinds, **moved)[1], [RIGHT_TURN, SWINGS_OUT])
    assert len(here) == 2
    for one, other in zip(here, there, strict=True):
        assert one[:2] == other[:2]
        assert other[3] == pytest.approx(one[3], rel=1e-3, abs=0.051, nan_ok=True)


def test_numbers_of_participants_change_nothing():
    tracks, kinds = scene_of_all()
    order = [4, 1, 3, 0, 2]
    here = rows_of(found(tracks, kinds)[1], [RIGHT_TURN, SWINGS_OUT])
    there = found([tracks[i] for i in order], [kinds[i] for i in order])[1]
    for one, other in zip(here, rows_of(there, [RIGHT_TURN, SWINGS_OUT], order), strict=True):
        assert one[:2] == other[:2]
        assert other[3] == pytest.approx(one[3], rel=1e-6, nan_ok=True)
