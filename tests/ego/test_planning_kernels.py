"""The planner's rules, one by one, against worked-out cases."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.arrays import Float
from bridgegen.drivers import _tracking_kernels as track
from bridgegen.drivers import kinds
from bridgegen.drivers._caution_kernels import careful_speed, safe_speed
from bridgegen.drivers._control_kernels import EMERGENCY_JERK, JERK, SIZE, actuate
from bridgegen.drivers._emergency_kernels import boxes_meet, must_brake
from bridgegen.drivers._following_kernels import (
    COMFORT_DECELERATION,
    follow,
    idm,
    keep_distance,
    stop_for,
)
from bridgegen.drivers._lights_kernels import stop_at_lights, stop_at_signs
from bridgegen.drivers._path_kernels import UNSHIFTED as STAYS
from bridgegen.drivers._prediction_kernels import LOST, PASSAGE, add_straight, predict
from bridgegen.drivers._speed_kernels import bend_speed, limit_speed, scan_length, sight_speed
from bridgegen.drivers._surroundings_kernels import AROUND, surround
from bridgegen.drivers._yielding_kernels import (
    EDGE,
    PART,
    SPEED,
    STATION,
    ZONE,
    coming,
    find_zone,
    place_on_route,
    time_to,
    yield_to_all,
)
from bridgegen.simulation.boxes import box_distance
from bridgegen.simulation.embedded.places.network import next_bends, next_drops

DS = 0.5
GRIP = 0.85 * 9.81
CAR = np.array([4.5, 1.9, 1.4])
RED, YELLOW, GREEN, DARK = 1, 3, 4, 0


def line(x: float, y: float, h: float, length: float) -> Float:
    """A straight path of half-metre steps."""
    s = np.arange(0.0, length + DS, DS)
    c, t = math.cos(h), math.sin(h)
    ones = np.ones_like(s)
    return np.stack([x + s * c, y + s * t, h * ones, c * ones, t * ones, 0.0 * ones], axis=1)


def tracked(*rows: tuple[float, float, float, float, int]) -> Float:
    """The ego's empty row and confirmed tracks: x, y, heading, speed, kind."""
    tracks = np.zeros((len(rows) + 1, track.TRACK))
    for one, (x, y, h, v, kind) in zip(tracks[1:], rows, strict=True):
        one[[track.STATE, track.X, track.Y, track.H]] = track.CONFIRMED, x, y, h
        one[[track.VX, track.VY]] = v * math.cos(h), v * math.sin(h)
        one[[track.LENGTH, track.WIDTH]] = (0.5, 0.5) if kind == kinds.PEDESTRIAN else (4.5, 1.9)
        one[track.KIND] = kind
    return tracks


def seen(path: Float, s: float, tracks: Float) -> Float:
    """The tracks from a path."""
    found = np.zeros((len(tracks), AROUND))
    surround(path, len(path), DS, s, 15.0, 100.0, 0.1, tracks, found)
    return found


# -- following -------------------------------------------------------------------------------------


def test_the_model_is_at_rest_at_its_equilibrium() -> None:
    # Free road: v = 0, gap = s0 → a (1 - 1) = 0; Treiber et al., equation 2.
    assert idm(2.0, 0.0, 0.0) == pytest.approx(0.0)
    assert idm(2.0 + 1.2 * 10.0, 10.0, 10.0) == pytest.approx(0.0)
    assert idm(1e9, 10.0, 10.0) == pytest.approx(1.5)


def test_a_short_gap_to_somebody_as_fast_is_no_reason_to_brake_hard() -> None:
    assert idm(4.0, 20.0, 20.0) < -50.0
    assert -3.0 < follow(4.0, 20.0, 20.0, 0.0) < -1.0


@given(
    gap=st.floats(5.0, 200.0), v=st.floats(0.0, 40.0), w=st.floats(0.0, 40.0),
    slowing=st.floats(-8.0, 0.0, allow_subnormal=False),
)  # fmt: skip
def test_a_leader_that_brakes_never_lets_one_go_faster(
    gap: float, v: float, w: float, slowing: float
) -> None:
    assert follow(gap, v, w, slowing) <= follow(gap, v, w, 0.0) + 1e-9


@given(v=st.floats(1.0, 35.0), w=st.floats(0.0, 35.0), free=st.floats(0.0, 100.0))
def test_following_stops_short_of_the_leader(v: float, w: float, free: float) -> None:
    # From a gap that braking at 4 m/s² needs, whoever follows the rule never touches.
    gap = 3.0 + max(v - w, 0.0) ** 2 / 8.0 + v * 0.2 + free
    for _ in range(2000):
        v = max(v + max(follow(gap, v, w, 0.0), -GRIP) * 0.02, 0.0)
        gap += (w - v) * 0.02
    assert gap > 0.0


def test_who_is_beside_or_behind_is_not_followed() -> None:
    path = line(0.0, 0.0, 0.0, 200.0)
    for x, y in ((20.0, 3.5), (-10.0, 0.0)):
        around = seen(path, 10.0, tracks := tracked((x, y, 0.0, 0.0, kinds.CAR)))
        assert keep_distance(around, tracks, 10.0, 3.65, 0.85, 0.95, STAYS, 10.0) == math.inf
    around = seen(path, 10.0, tracks := tracked((40.0, 0.5, 0.0, 0.0, kinds.CAR)))
    assert keep_distance(around, tracks, 10.0, 3.65, 0.85, 0.95, STAYS, 10.0) < 0.0


def test_who_moves_into_the_way_is_followed_before_arriving() -> None:
    path = line(0.0, 0.0, 0.0, 200.0)
    tracks = tracked((30.0, 3.0, 0.0, 10.0, kinds.CAR))
    straight = keep_distance(seen(path, 10.0, tracks), tracks, 10.0, 3.65, 0.85, 0.95, STAYS, 15.0)
    tracks[1, track.VY] = -1.0
    drifting = keep_distance(seen(path, 10.0, tracks), tracks, 10.0, 3.65, 0.85, 0.95, STAYS, 15.0)
    assert straight == math.inf
    assert drifting < 0.0


def test_stopping_for_a_point_is_the_textbooks_deceleration() -> None:
    assert stop_for(100.0, 10.0) == math.inf  # 0.5 m/s² would do
    assert stop_for(1.5 + 10.0, 10.0) == pytest.approx(-5.0)  # v²/2s


# -- speed -----------------------------------------------------------------------------------------


def test_limits_and_bends_are_braked_for_in_time() -> None:
    path, road = line(0.0, 0.0, 0.0, 200.0), np.full((401, 3), math.inf)

    def limited(s: float) -> float:
        return limit_speed(road, next_drops(road[None])[0], 401, DS, s, 20.0)

    def bent(grip: float) -> float:
        bends = next_bends(path[None, None])[0, 0]
        return bend_speed(path, bends, 401, DS, 50.0, 5.0, 20.0, grip)

    assert limited(0.0) == math.inf
    road[100:, 0] = 10.0  # from 50 m on
    assert limited(0.0) == pytest.approx(math.sqrt(100.0 + 4.0 * 50.0))
    assert limited(60.0) == pytest.approx(10.0)
    path[100:, 5] = 0.1
    assert bent(GRIP) == pytest.approx(math.sqrt(30.0))
    assert bent(2.0) == pytest.approx(math.sqrt(12.0))


PIECES = st.lists(st.tuples(st.integers(1, 60), st.sampled_from([0, 1, 2, 3])), max_size=8)


@given(PIECES, PIECES, st.floats(0.0, 130.0), st.floats(0.0, 40.0))
def test_what_is_skipped_changes_no_bit(bends, limits, s, v) -> None:
    """Beside a look at every metre; straight pieces and limits that do not fall are skipped."""
    curvatures, allowed = (0.0, 5e-5, -0.004, 0.03), (math.inf, 30.0, 13.9, 8.3)
    path, road = line(0.0, 0.0, 0.0, 130.0), np.full((261, 3), math.inf)
    for column, values, pieces in ((path[:, 5], curvatures, bends), (road[:, 0], allowed, limits)):
        at = 0
        for rows, which in pieces:
            column[at : at + rows] = values[which]
            at += rows
    n, first = 261, min(int(s / DS), 260)
    seen = range(first, min(n - 1, first + int(scan_length(v) / DS)), max(int(1.0 / DS), 1))
    ahead = {i: 2.0 * COMFORT_DECELERATION * max(i * DS - s, 0.0) for i in seen}
    lateral = min(3.0, 0.6 * GRIP)
    least = [lateral / abs(path[i, 5]) + ahead[i] for i in seen if abs(path[i, 5]) > 1e-4]
    bend = bend_speed(path, next_bends(path[None, None])[0, 0], n, DS, s, v, 36.0, GRIP)
    assert bend == math.sqrt(min([36.0 * 36.0, *least]))
    least = [road[first, 0] ** 2, *(road[i, 0] * road[i, 0] + ahead[i] for i in seen)]
    assert limit_speed(road, next_drops(road[None])[0], n, DS, s, v) == math.sqrt(min(least))


@given(seen_at=st.floats(4.0, 200.0), grip=st.floats(2.0, 9.0))
def test_one_stops_within_what_one_sees(seen_at: float, grip: float) -> None:
    v = sight_speed(seen_at, grip)
    assert v * 0.5 + v * v / (2.0 * 0.7 * grip) == pytest.approx(seen_at - 3.0, abs=1e-6)


def test_less_grip_and_less_sight_never_allow_more_speed() -> None:
    speeds = [[sight_speed(d, g) for d in (10.0, 30.0, 90.0)] for g in (3.0, 5.0, 8.0)]
    assert (np.diff(speeds, axis=0) > 0).all()
    assert (np.diff(speeds, axis=1) > 0).all()


# -- lights ----------------------------------------------------------------------------------------


def stops(state: int, distance: float, v: float, *, since: int = -1, sight: float = 150.0) -> bool:
    found = stop_at_lights(
        np.array([distance, math.inf]), np.array([state, RED], np.int8), 0.0, 0.0, v, sight, since
    )
    return bool(found[1] == 0)


def test_red_is_stopped_for_and_green_is_not() -> None:
    assert stops(RED, 40.0, 10.0)
    assert stops(2, 40.0, 10.0)
    assert not stops(GREEN, 40.0, 10.0)
    assert not stops(DARK, 40.0, 10.0)
    assert not stops(RED, -1.0, 10.0)  # the line is behind
    assert not stops(RED, 40.0, 10.0, sight=30.0)  # not seen


def test_yellow_is_a_dilemma_decided_once() -> None:
    # 10 m/s stops at 3 m/s² within 16.7 m.
    assert stops(YELLOW, 17.0, 10.0)
    assert not stops(YELLOW, 16.0, 10.0)
    assert stops(YELLOW, 16.0, 10.0, since=0)


def test_a_stop_sign_is_halted_at_once_and_then_left_behind() -> None:
    lines = np.array([50.0, 120.0])
    assert stop_at_signs(lines, 10.0, 3.65, 8.0, 0.0) == (math.inf, 0.0)  # not urgent
    asked, halted = stop_at_signs(lines, 36.35, 3.65, 8.0, 0.0)
    assert asked == pytest.approx(-(8.0**2) / (2.0 * 8.5))  # v²/2s, 1.5 m before the line
    assert halted == 0.0
    assert stop_at_signs(lines, 44.8, 3.65, 0.1, 0.0) == (math.inf, 50.0)
    assert stop_at_signs(lines, 44.9, 3.65, 1.0, 50.0) == (math.inf, 50.0)  # the next is far
    assert stop_at_signs(lines, 47.0, 3.65, 6.0, 0.0)[1] == 0.0  # past the line


# -- yielding --------------------------------------------------------------------------------------


def crossing() -> tuple[Float, Float, Float]:
    """Two ways that cross at 50 m of each, and their zone."""
    own, other = line(0.0, 0.0, 0.0, 100.0), line(50.0, -50.0, math.pi / 2, 100.0)
    zone = np.empty(ZONE)
    find_zone(own, len(own), DS, CAR, other, len(other), DS, CAR, zone)
    return own, other, zone


def test_a_zone_is_where_two_bodies_would_be_too_near() -> None:
    zone = crossing()[2]
    side = 0.5 * (1.9 + 1.9) + 0.6
    assert zone[0] == pytest.approx(50.0 - side, abs=DS)
    assert zone[1] == pytest.approx(50.0 + side, abs=DS)
    assert zone[4] == 0.0
    apart = np.empty(ZONE)
    own, far = line(0.0, 0.0, 0.0, 100.0), line(0.0, 5.0, 0.0, 100.0)
    find_zone(own, len(own), DS, CAR, far, len(far), DS, CAR, apart)
    assert math.isinf(apart[0])


def test_ways_that_go_together_for_a_while_are_followed_not_waited_for() -> None:
    s = np.arange(0.0, 60.0 + DS, DS)
    h = np.clip((s - 20.0) / 12.0, 0.0, math.pi / 2)  # straight on, then a bend to the left
    x, y = (np.concatenate([[0.0], np.cumsum(DS * f(h[:-1]))]) for f in (np.cos, np.sin))
    left = np.stack([x, y, h, np.cos(h), np.sin(h), 0.0 * s], axis=1)
    straight = line(0.0, 0.0, 0.0, 100.0)
    zone = np.empty(ZONE)
    find_zone(straight, len(straight), DS, CAR, left, len(left), DS, CAR, zone)
    assert zone[4] == PART
    assert zone[0] == zone[2] == 0.0
    assert 25.0 < zone[1] < 40.0
    assert place_on_route(zone, 12.0) == 12.0
    ahead = passage(zone, 22.0, 6.0)
    asked = yield_to_all(5.0, 6.0, 6.0, 3.65, 0.85, STAYS, GRIP, ahead, 1)
    assert asked == pytest.approx(follow(22.0 - 2.25 - 3.65 - 5.0, 6.0, 6.0, 0.0))
    gone = passage(zone, 45.0, 6.0)
    assert yield_to_all(5.0, 6.0, 6.0, 3.65, 0.85, STAYS, GRIP, gone, 1) == math.inf


def test_who_has_to_wait_joins_only_if_nobody_has_to_brake_for_it() -> None:
    zone = np.array([40.0, 80.0, 40.0, 80.0, PART, 41.0])
    far = {}
    for rank in (0, -1):
        rows = [passage(zone, q, 9.0, 0.0, rank) for q in np.arange(-60.0, 30.0)]
        asked = [yield_to_all(35.0, 0.0, 8.0, 3.65, 0.85, STAYS, GRIP, one, 1) for one in rows]
        far[rank] = min(i for i, a in enumerate(asked) if a < 0.0)
    # From rest it enters at 2 m/s: half a second of margin more, and 7 m/s over 2 m/s².
    assert far[0] - far[-1] == pytest.approx(
        9.0 * (0.5 + (9.0 - math.sqrt(3.0 * 1.35)) / 2.0), abs=1
    )


def passage(zone: Float, q: float, w: float, gain: float = 0.0, rank: int = 0) -> Float:
    return np.array([[*zone, q, w, 2.25, 2.25, 1.0, gain, rank]])


def test_who_comes_first_goes_first() -> None:
    zone = crossing()[2]
    first = yield_to_all(20.0, 10.0, 10.0, 3.65, 0.85, STAYS, GRIP, passage(zone, 30.0, 10.0), 1)
    assert first < 0.0  # it is 20 m away, as the ego is
    late = yield_to_all(20.0, 10.0, 10.0, 3.65, 0.85, STAYS, GRIP, passage(zone, 0.0, 5.0), 1)
    assert late == math.inf  # 10 s away: the ego has passed
    gone = yield_to_all(20.0, 10.0, 10.0, 3.65, 0.85, STAYS, GRIP, passage(zone, 80.0, 10.0), 1)
    assert gone == math.inf
    standing = yield_to_all(20.0, 10.0, 10.0, 3.65, 0.85, STAYS, GRIP, passage(zone, 30.0, 0.0), 1)
    assert standing == math.inf
    blocking = yield_to_all(35.0, 10.0, 10.0, 3.65, 0.85, STAYS, GRIP, passage(zone, 50.0, 0.0), 1)
    assert blocking < 0.0


def test_who_speeds_up_comes_sooner_and_who_brakes_leaves_later() -> None:
    assert coming(8.0, 2.0, 2.0) == pytest.approx(2.0)  # 2·2 + ½·2·2²
    assert coming(14.0, 2.0, 2.0) == pytest.approx(3.0)  # then 6 m/s
    assert coming(3.0, 2.0, 2.0) == pytest.approx(1.0)
    assert coming(6.0, 4.0, -1.0) == pytest.approx(2.0)  # 4·2 − ½·2²
    assert coming(-5.0, 2.0, 2.0) == coming(-5.0, 2.0, 0.0) == -2.5
    zone = crossing()[2]

    def asked(q: float, w: float, gain: float) -> float:
        one = passage(zone, q, w, gain)
        return float(yield_to_all(20.0, 10.0, 10.0, 3.65, 0.85, STAYS, GRIP, one, 1))

    assert asked(20.0, 4.0, 0.0) == math.inf  # 6.2 s away
    assert asked(20.0, 4.0, 3.0) < 0.0
    assert asked(20.0, 4.0, 0.9) == math.inf  # may be noise


def test_signs_say_who_goes_first_and_margins_follow() -> None:
    zone = crossing()[2]

    def asked(q: float, rank: int) -> float:
        one = passage(zone, q, 10.0, 0.0, rank)
        return float(yield_to_all(20.0, 10.0, 10.0, 3.65, 0.85, STAYS, GRIP, one, 1))

    assert asked(12.0, 0) < 0.0
    assert asked(12.0, 1) == math.inf  # 1.5 m/s² stop it before the conflict
    assert asked(25.0, 1) < 0.0  # it can no longer stop comfortably: better not to insist
    waits = {rank: min(q for q in range(-40, 30) if asked(q, rank) < 0.0) for rank in (0, -1)}
    assert waits[0] - waits[-1] == pytest.approx(0.5 * 10.0, abs=1.0)  # half a second more


def test_who_can_no_longer_stop_before_a_conflict_goes_on() -> None:
    zone, other = crossing()[2], 30.0
    for s, stays in ((20.0, True), (zone[0] - 3.65 - 6.0, False)):
        asked = yield_to_all(s, 10.0, 10.0, 3.65, 0.85, STAYS, GRIP, passage(zone, other, 10.0), 1)
        assert (asked < 0.0) == stays


def test_the_edge_of_a_zone_is_where_the_bumper_does_not_yet_touch() -> None:
    edge = crossing()[2][EDGE]
    assert edge == pytest.approx(50.0 - 0.5 * 1.9, abs=DS)  # half of the other car's width
    assert edge < 50.0 - 0.5 * 1.9
    own, beside = line(0.0, 0.0, 0.0, 100.0), line(0.0, 2.2, 0.0, 100.0)
    zone = np.empty(ZONE)
    find_zone(own, len(own), DS, CAR, beside, len(beside), DS, CAR, zone)
    assert zone[0] == 0.0  # 0.3 m beside each other, too near
    assert zone[EDGE] == math.inf  # but they never touch


@pytest.mark.parametrize("depth", [0.0, 0.6, 1.0, 2.0])
def test_an_ego_that_has_stopped_in_a_zone_does_not_pull_away_before_a_car(depth: float) -> None:
    """Its bumper overran the start of the zone; a car comes at 6 m/s, and then has passed."""
    zone = crossing()[2]
    s = zone[0] - 3.65 + depth

    def asked(q: float, w: float) -> float:
        one = passage(zone, q, w)
        return float(yield_to_all(s, 0.0, 10.0, 3.65, 0.85, STAYS, GRIP, one, 1))

    # The ego needs some 4 s to clear the crossing.
    assert all(asked(q, 6.0) <= 0.0 for q in np.arange(30.0, 53.0))
    assert asked(0.0, 5.0) == math.inf  # 9 s away: it passes before
    assert asked(60.0, 6.0) == math.inf  # it has passed
    assert asked(40.0, 0.0) == math.inf  # it stands: both would wait for ever


@pytest.mark.parametrize(
    ("depth", "v", "stops"),
    [(0.2, 3.0, True), (0.2, 6.0, False), (0.9, 2.0, False), (2.0, 3.0, False)],
)
def test_an_ego_that_has_begun_to_cross_stops_only_before_the_edge(
    depth: float, v: float, stops: bool
) -> None:
    zone, limit = crossing()[2], 0.8 * GRIP
    s = zone[0] - 3.65 + depth
    one = passage(zone, 36.0, 6.0)  # 1.5 s away
    asked = yield_to_all(s, v, 10.0, 3.65, 0.85, STAYS, GRIP, one, 1)
    assert (asked < 0.0) == stops == (depth + v * v / (2.0 * limit) <= zone[EDGE] - zone[0])


def test_an_ego_that_creeps_past_the_edge_stops_for_who_comes() -> None:
    zone = crossing()[2]
    s, one = zone[EDGE] - 3.65 + 0.5, passage(zone, 36.0, 6.0)
    asked = [
        yield_to_all(s, v, 10.0, 3.65, 0.85, STAYS, GRIP, one, 1) for v in (0.0, 0.5, 1.4, 1.6)
    ]
    assert asked == [0.0, -2.0, -2.0, math.inf]


def test_an_ego_that_crosses_does_not_stop_for_a_margin() -> None:
    """It clears the zone 0.7 s before the other comes: enough to go on, not enough to begin."""
    zone = crossing()[2]
    s, v = zone[0] - 3.65 + 0.2, 3.0
    through = zone[1] - zone[0] + 4.5 - 0.2
    clears = (math.sqrt(v * v + 3.0 * through) - v) / 1.5 + 0.3
    other = passage(zone, zone[2] - 2.25 - 6.0 * (clears + 0.7), 6.0)
    assert yield_to_all(s, v, 10.0, 3.65, 0.85, STAYS, GRIP, other, 1) == math.inf
    assert yield_to_all(s - 0.3, v, 10.0, 3.65, 0.85, STAYS, 99.0, other, 1) < 0.0


def test_one_does_not_wait_in_somebody_elses_way() -> None:
    near = np.array([40.0, 46.0, 40.0, 46.0, 0.0, 41.0])
    far = np.array([47.0, 52.0, 47.0, 52.0, 0.0, 48.0])
    only = passage(far, 37.0, 5.0)
    both = np.concatenate([only, passage(near, 0.0, 2.0)])
    before_far = yield_to_all(30.0, 6.0, 6.0, 3.65, 0.85, STAYS, GRIP, only, 1)
    before_near = yield_to_all(30.0, 6.0, 6.0, 3.65, 0.85, STAYS, GRIP, both, 2)
    assert before_far == pytest.approx(stop_for(47.0 - 33.65, 6.0))
    assert before_near == pytest.approx(stop_for(40.0 - 33.65, 6.0))


@pytest.mark.parametrize("d", [-0.1, -3.0, -500.0])
def test_what_has_been_covered_takes_no_time(d):
    t = time_to(d, 5.0, 10.0)
    assert math.isfinite(t)
    assert t < 0.0
    assert t == time_to.py_func(d, 5.0, 10.0)


@given(d=st.floats(0.0, 100.0), v=st.floats(0.0, 20.0), pace=st.floats(2.0, 20.0))
def test_arrival_is_that_of_a_comfortable_start(d: float, v: float, pace: float) -> None:
    t, x, now = time_to(d, v, pace), 0.0, v
    for _ in range(1000):
        after = min(now + 1.5 * t / 1000, max(pace, v, 1.0))
        x += 0.5 * (now + after) * t / 1000
        now = after
    assert x == pytest.approx(d, abs=0.02 + 1e-3 * d)


# -- prediction ------------------------------------------------------------------------------------


def test_somebody_on_foot_is_expected_straight_ahead() -> None:
    path = line(0.0, 0.0, 0.0, 100.0)
    tracks = tracked((40.0, -6.0, math.pi / 2, 1.5, kinds.PEDESTRIAN))
    passages = np.zeros((4, PASSAGE))
    assert add_straight(path, len(path), DS, 0.0, 90.0, 1.9, tracks[1], 1, 0.0, passages, 0) == 1
    enter, leave, other_enter, other_leave, merges, edge, q, w = passages[0, :8]
    assert 0.5 * (enter + leave) == pytest.approx(40.0, abs=0.1)
    assert 0.5 * (other_enter + other_leave) == pytest.approx(6.0, abs=0.1)
    assert (merges, q) == (0.0, 0.0)
    assert edge == pytest.approx(enter + 1.0)  # what is kept from somebody on foot
    assert w == pytest.approx(1.5)
    tracks[1, track.VY] = -1.5  # walks away
    assert add_straight(path, len(path), DS, 0.0, 90.0, 1.9, tracks[1], 1, 0.0, passages, 0) == 0


def test_a_vehicle_is_expected_on_the_ways_that_it_is_on() -> None:
    own, other, zone = crossing()
    turn = line(50.0, -50.0, math.pi / 2 - 0.2, 100.0)  # leaves the other way by degrees
    n = len(other)
    ways, zones = np.stack([other, turn]), np.stack([zone, zone])
    counts, steps, feet = np.array([n, n]), np.array([DS, DS]), np.full(2, LOST)
    passages = np.zeros((4, PASSAGE))
    for y, expected in ((-48.0, 2), (-20.0, 1)):
        tracks = tracked((50.0, y, math.pi / 2, 8.0, kinds.CAR))
        count = predict(
            own, len(own), DS, 0.0, 90.0, 1.9, tracks, np.zeros((2, AROUND)), True, ways, counts,
            steps, zones, np.zeros(2, np.int64), np.array([0, 0, 2]), feet, passages,
        )  # fmt: skip
        assert count == expected
        assert passages[0, STATION] == pytest.approx(y + 50.0)
        assert passages[0, SPEED] == pytest.approx(8.0)


# -- caution ---------------------------------------------------------------------------------------


def test_nobody_who_steps_out_at_the_safe_speed_is_hit() -> None:
    for room in (0.8, 1.5, 2.5, 4.0):
        v, t = safe_speed(room, GRIP), room / 1.5
        if v > 2.0:  # the creep is always allowed
            # What stopping takes is passed before somebody is there.
            assert v * 0.4 + v * v / (2.0 * 0.7 * GRIP) == pytest.approx(v * t)


def test_one_slows_for_somebody_at_the_kerb_and_for_a_crosswalk_that_is_hidden() -> None:
    path, none = line(0.0, 0.0, 0.0, 200.0), np.zeros((0, 4))
    walk = np.array([[60.0, 64.0, -6.0, 6.0]])

    def speed(tracks: Float, crosswalks: Float, town: bool = True) -> float:
        around = seen(path, 30.0, tracks)
        return float(careful_speed(around, tracks, crosswalks, 30.0, 3.65, 0.95, STAYS, town, GRIP))

    kerb = tracked((45.0, 2.5, 0.0, 0.0, kinds.PEDESTRIAN))
    far = tracked((45.0, 9.0, 0.0, 0.0, kinds.PEDESTRIAN))
    van = tracked((55.0, -2.6, 0.0, 0.0, kinds.CAR))
    assert speed(kerb, none) < 10.0
    assert speed(far, none) == math.inf
    assert speed(van, walk) < speed(van, none) < math.inf
    assert speed(van, none, town=False) == math.inf


# -- emergency -------------------------------------------------------------------------------------


@given(
    x=st.floats(-6.0, 6.0), y=st.floats(-6.0, 6.0), h=st.floats(-3.2, 3.2), g=st.floats(-3.2, 3.2)
)
def test_boxes_meet_where_their_distance_is_nothing(x: float, y: float, h: float, g: float) -> None:
    box = np.array([[4.5, 1.9, 0.0], [3.0, 1.0, 0.0]])
    xs, ys, hs = (np.array([[[0.0], [v]]]) for v in (x, y, g))
    hs[0, 0, 0] = h
    apart = box_distance(box, xs, ys, hs, np.array([1]))[0, 1, 0]
    meets = boxes_meet(x, y, h, 2.25, 0.95, g, 1.5, 0.5)
    assert meets == (apart == 0.0) or apart < 1e-6


def test_full_braking_is_for_what_nothing_else_avoids() -> None:
    path = line(0.0, 0.0, 0.0, 200.0)

    def brakes(x: float, y: float, h: float, v: float) -> bool:
        tracks = tracked((x, y, h, v, kinds.CAR))
        around = seen(path, 30.0, tracks)
        return bool(must_brake(path, len(path), DS, 30.0, 12.0, CAR, STAYS, around, tracks, GRIP))

    assert brakes(42.0, 0.0, 0.0, 0.0)
    assert not brakes(80.0, 0.0, 0.0, 0.0)
    assert not brakes(42.0, 3.5, 0.0, 0.0)
    assert brakes(42.0, -4.0, math.pi / 2, 5.0)
    assert not brakes(42.0, 4.0, math.pi / 2, 5.0)  # drives away
    assert not brakes(22.0, 0.0, 0.0, 20.0)  # from behind: braking would not help


# -- control ---------------------------------------------------------------------------------------


def test_ideal_control_does_what_is_demanded_at_once() -> None:
    assert actuate(np.zeros(SIZE), -7.0, 0.1, 0.05, 1, 1) == (-7.0, 0.1)


@pytest.mark.parametrize("dt", [0.005, 0.01, 0.05])
def test_brakes_build_up_late_and_with_limited_jerk_at_any_step(dt: float) -> None:
    state, applied = np.zeros(SIZE), []
    for _ in range(round(2.0 / dt)):
        applied.append(actuate(state, -8.0, 0.0, dt, 0, 1)[0])
    a = np.array(applied)
    assert (np.diff(a, prepend=0.0) / dt >= -EMERGENCY_JERK - 1e-9).all()
    half = (np.argmax(a < -4.0) + 1) * dt
    assert 0.2 < half < 0.45
    assert a[-1] == pytest.approx(-8.0, abs=0.01)
    gentle = np.zeros(SIZE)
    a = np.array([actuate(gentle, -2.0, 0.0, dt, 0, 1)[0] for _ in range(round(1.0 / dt))])
    assert (np.diff(a, prepend=0.0) / dt >= -JERK - 1e-9).all()
