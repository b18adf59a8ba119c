"""Conflict zones of two paths, and whether to go first.

A conflict zone is a row of `ZONE` numbers: where the ego's route enters and leaves it [m], where
the other's path does [m], whether they cross (`ACROSS`), merge (`MERGE`), or share a stretch and
`PART` again, as in a roundabout; and the `EDGE`: the last station of the ego's bumper [m] at which
it does not touch a body on the other's path. The zone itself begins earlier, by a margin. No zone:
infinity. A passage begins with its zone, see ``_prediction_kernels``.

The first to arrive goes first, with a margin in time, a larger one where the ego has to wait by the
rules; the ego gives way wherever that is in doubt, and does not wait where another actor will pass
(StVO § 11). Where a sign makes the other wait, the ego goes first as long as the other can still
stop. An ego that stands or creeps with its bumper in the zone waits there until it can pass;
a faster one stops again only if both would meet and it can still stop before the edge.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._following_kernels import (
    COMFORT_ACCELERATION,
    COMFORT_DECELERATION,
    follow,
    stop_for,
)
from bridgegen.drivers._path_kernels import COS, SIN, X, Y, aside_at

SIDE_MARGIN = 0.6  # m, kept to another body's side
TIME_MARGIN = 1.0  # s, kept between two bodies' passages of one point, …
WAITING_MARGIN = 1.5  # … where the ego has to wait
GOES_ON = 2.0  # s, for which other actors keep accelerating or braking, …
MOST_GAIN = 3.0  # m/s², … by no more than this, …
# An accelerating vehicle arrives sooner, a braking one leaves later: so the interval only widens.
LEAST_GAIN = 1.0  # … if by more than this, above the noise of tracking (95 % within 0.7)
CAN_STOP = 2.0  # m/s²; an actor that needs less to stop before the conflict can wait
# Without it the ego used to stop in the other's way.
COMMITTED = 0.8  # of the friction limit; if stopping before a conflict needs more, the ego goes on
BUILD_UP = 0.3  # s, until the ego's own acceleration has built up
TAIL_MARGIN = 1.0  # m, kept to the rear of an actor that has passed
KEEP_CLEAR_ROUNDS = 3  # zones that overlap in a row, at most
HORIZON = 10.0  # s, how far ahead arrivals are compared
ENTER, LEAVE, OTHER_ENTERS, OTHER_LEAVES, HOW, EDGE = range(6)
ZONE = 6
"""Number of columns of a zone, after the columns themselves."""
STATION, SPEED, FRONT, REAR, ENTITY, GAIN, RANK = range(ZONE, ZONE + 7)
"""Columns of a passage after its zone."""

ACROSS, MERGE, PART = 0.0, 1.0, 2.0
TOGETHER = 8.0  # m; ways that run together for less only cross

SCAN_STEP = 0.5  # m, between the sampled points of a way
SAME_WAY = 0.9  # cosine of the heading difference above which two ways run together
STANDING = 0.1  # m/s, below which an actor stands
# The zone begins 0.6 m beside the other's body and counts the ego's width, so a bumper may be 1.5 m
# past its start and touch nobody. An ego that took any overrun for being in pulled away into a car
# in sight: 258 harmful evaluations of 3,000 in crossroads-s3, now none.
CREEPING = 1.5  # m/s, from which the ego stops within 0.6 m, comfortably
ELSEWHERE = 1.5  # m beside its route, where the ego does not obstruct actors that join it


@kernel
def find_zone(path, n, ds, body, other_path, other_n, other_ds, other_body, zone):
    """Fill ``zone`` with the first conflict zone of two paths."""
    side = 0.5 * (body[1] + other_body[1]) + SIDE_MARGIN
    for column in range(ZONE):
        zone[column] = math.inf
    zone[HOW] = ACROSS
    stride = max(int(SCAN_STEP / ds), 1)
    other_stride = max(int(SCAN_STEP / other_ds), 1)
    last_i, along, together = -1, 0.0, 0.0
    for i in range(0, n, stride):
        nearest, at, j = side, -1, 0
        while j < other_n:
            dx, dy = path[i, X] - other_path[j, X], path[i, Y] - other_path[j, Y]
            gap = math.sqrt(dx * dx + dy * dy)
            if gap < nearest:
                nearest, at = gap, j
            # No point of the other way that is nearer can come sooner than this.
            # Exact, and worth it: zones are worked out when a road network is compiled, which took
            # 183 ms for jam-tail-in-fog without leaps, and takes 13.
            j += other_stride * max(int((gap - nearest) / (other_stride * other_ds)), 1)
        if at >= 0:
            q = at * other_ds
            if last_i < 0:
                zone[ENTER], zone[OTHER_ENTERS], zone[OTHER_LEAVES] = i * ds, q, q
            zone[LEAVE], zone[OTHER_ENTERS], zone[OTHER_LEAVES] = (
                i * ds,
                min(zone[OTHER_ENTERS], q),
                max(zone[OTHER_LEAVES], q),
            )
            along = path[i, COS] * other_path[at, COS] + path[i, SIN] * other_path[at, SIN]
            if zone[EDGE] == math.inf and nearest < 0.5 * (other_body[1] + body[1] * abs(along)):
                zone[EDGE] = max((i - stride) * ds, zone[ENTER])
            if along > SAME_WAY:
                together += stride * ds
            last_i = i
        elif last_i >= 0:
            break
    if last_i >= 0:
        zone[HOW] = MERGE if along > SAME_WAY else PART if together > TOGETHER else ACROSS
        if zone[HOW] == ACROSS:  # the ego's width counts, too
            zone[OTHER_ENTERS] -= 0.5 * body[1]
            zone[OTHER_LEAVES] += 0.5 * body[1]


@kernel
def time_to(distance, v, pace):
    """Return the time [s] to cover a distance [m], accelerating comfortably from v to ``pace``.

    Below 0 where the distance is: it has been covered.
    """
    pace = max(pace, v, 1.0)
    gained = (pace * pace - v * v) / (2.0 * COMFORT_ACCELERATION)
    if distance <= gained:
        reached = math.sqrt(max(v * v + 2.0 * COMFORT_ACCELERATION * distance, 0.0))
        return (reached - v) / COMFORT_ACCELERATION
    return (pace - v) / COMFORT_ACCELERATION + (distance - gained) / pace


@kernel
def place_on_route(zone, q):
    """Return the other's station on the ego's route [m], from the common end of both ways.

    If the ways part again: from their common beginning.
    """
    if zone[HOW] == PART:
        return zone[ENTER] + q - zone[OTHER_ENTERS]
    return zone[LEAVE] - zone[OTHER_LEAVES] + q


@kernel
def coming(distance, w, gain):
    """Return when [s] an actor has covered a distance; ``gain`` changes its speed for `GOES_ON`.

    Its speed w must be > 0, and stay so.
    """
    if gain == 0.0 or distance <= 0.0:
        return distance / w
    changing = (w + 0.5 * gain * GOES_ON) * GOES_ON
    if distance <= changing:
        return (math.sqrt(w * w + 2.0 * gain * distance) - w) / gain
    return GOES_ON + (distance - changing) / (w + gain * GOES_ON)


@kernel
def give_way(s, v, pace, front, rear, zone, q, w, gain, rank, other_front, other_rear):
    """Return what one other body requires: (an acceleration [m/s²], a station to stop at [m]).

    Each is +inf where it is not required. The ego is at station s of its route at speed v, and
    would go on at ``pace``; the other is at q of its way, at speed w which changes by ``gain``;
    ``rank`` is the right of way (``right_of_way``). Bodies reach ``front`` and ``rear`` [m] ahead
    of and behind these stations.
    """
    together = zone[HOW] != ACROSS
    if s - rear > zone[LEAVE] or (q - other_rear > zone[OTHER_LEAVES] and zone[HOW] != MERGE):
        return math.inf, math.inf
    to_enter = zone[ENTER] - front - s  # from the ego's bumper to the zone
    inside = q + other_front > zone[OTHER_ENTERS]
    # In the ring of a roundabout, or a queue, it is followed and not waited for: in
    # roundabout-entry the ego comes 128 m far in 20 s instead of 91.
    if together and inside:
        # It is ahead of the ego, or will be: its station on the ego's route.
        ahead = place_on_route(zone, q)
        if ahead >= s:
            return follow(ahead - other_rear - front - s, v, w, min(gain, 0.0)), math.inf
        return math.inf, math.inf
    if w < STANDING:
        return math.inf, zone[ENTER] if inside and to_enter > 0.0 else math.inf
    is_in, moves = to_enter <= 0.0, v > STANDING
    width = 0.0 if together else zone[OTHER_LEAVES] - zone[OTHER_ENTERS]
    until = zone[OTHER_ENTERS] - other_front - q
    # Only priority by a sign or by the map: one from the right is a duty to give way and never a
    # claim, since the other may not keep it.
    if rank > 0 and until > 0.0 and w * w < 2.0 * CAN_STOP * until:
        return math.inf, math.inf
    length = width + other_front + other_rear + TAIL_MARGIN
    quicker = min(gain, MOST_GAIN) if gain > LEAST_GAIN else 0.0
    slower = max(gain, -0.5 * w / GOES_ON) if gain < -LEAST_GAIN else 0.0
    enters, leaves = coming(until, w, quicker), coming(until + length, w, slower)
    margin = WAITING_MARGIN if rank < 0 else TIME_MARGIN
    if is_in and moves:
        margin = 0.0  # it has begun to cross
    elif rank < 0 and together:
        # The other must not have to brake much for a slower ego either.
        gained = v * v + 2.0 * COMFORT_ACCELERATION * max(to_enter, 0.0)
        margin += max(w - math.sqrt(gained), 0.0) / CAN_STOP
    through = front + rear + (0.0 if together else zone[LEAVE] - zone[ENTER])
    arrives = time_to(max(to_enter, 0.0), v, pace)
    clears = time_to(to_enter + through, v, pace) + BUILD_UP
    if enters >= HORIZON or arrives >= leaves + margin or clears <= enters - margin:
        return math.inf, math.inf
    if not is_in:
        return math.inf, zone[ENTER]
    if v <= CREEPING:
        return -COMFORT_DECELERATION if moves else 0.0, math.inf
    return math.inf, zone[EDGE]


@kernel
def keep_clear(s, front, rear, length, zone, q, w, other_rear, stop):
    """Return where to stop [m], if not at ``stop``, so as not to block another actor's way.

    ``length`` is the ego's [m]; the rest as for `give_way`.
    """
    gone = q - other_rear > zone[OTHER_LEAVES] or w < STANDING
    if gone or zone[ENTER] - front - s <= 0.0 or zone[ENTER] >= stop or stop - length > zone[LEAVE]:
        return stop
    return zone[ENTER]


@kernel
def is_left(shift, s, passage):
    """Return whether the ego has left its route's lane where the passage joins the route."""
    if passage[HOW] == ACROSS or shift[0] == shift[1] == 0.0:
        return False
    place = max(s, passage[ENTER], place_on_route(passage, passage[STATION]))
    return abs(aside_at(shift, place)) > ELSEWHERE


@kernel
def yield_to_all(s, v, pace, front, rear, shift, friction_limit, passages, count):
    """Return the acceleration [m/s²] that all predicted passages require; +inf if none does.

    Passages into a lane that the ego's ``shift`` has left, or will have left, are ignored.
    """
    asked, stop = math.inf, math.inf
    for i in range(count):
        passage = passages[i]
        if is_left(shift, s, passage):
            continue
        follows, stops = give_way(
            s,
            v,
            pace,
            front,
            rear,
            passage,
            passage[STATION],
            passage[SPEED],
            passage[GAIN],
            passage[RANK],
            passage[FRONT],
            passage[REAR],
        )
        asked = min(asked, follows)
        if v * v <= 2.0 * COMMITTED * friction_limit * (stops - front - s):
            stop = min(stop, stops)
    if stop == math.inf:
        return asked
    # To stop before one zone may be to stand in the one before it.
    for _ in range(KEEP_CLEAR_ROUNDS):
        before = stop
        for i in range(count):
            passage = passages[i]
            if is_left(shift, s, passage):
                continue
            stop = keep_clear(
                s,
                front,
                rear,
                front + rear,
                passage,
                passage[STATION],
                passage[SPEED],
                passage[REAR],
                stop,
            )
        if stop == before:
            break
    return min(asked, stop_for(stop - front - s, v))
