"""Compiled search for where the ego leaves its lane or the road, and whom it passes how closely.

Public wrapper: ``violations.with_violations``.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.assess.conflict import severity as injury
from bridgegen.assess.conflict._codes import (
    CLOSE_PASS,
    CONTACT,
    COURSE,
    DECIDED,
    DID_NOT_KEEP_LANE,
    EGO,
    INSTANT,
    KIND,
    LANE_DEPARTURE,
    LEFT_THE_ROAD,
    NEAR_MISS,
    PASSED_TOO_CLOSE,
    RESPONSIBLE,
    ROAD_DEPARTURE,
    RULE,
    TYPE,
    V_EGO,
    V_OTHER,
    VIOLATION,
)
from bridgegen.assess.conflict._conflict_kernels import fails
from bridgegen.assess.conflict._limits import (
    CLEAR_ZONE,
    CLOSE,
    CLOSE_TIME,
    COMFORT,
    CREEPS,
    EDGE_MARGIN,
    HORIZON,
    LINE_MARGIN,
    PASSED_AHEAD,
    PASSED_BESIDE,
    PASSES,
    REACTION,
    SAME_WAY,
    WALKING_PACE,
)
from bridgegen.assess.conflict._severity_kernels import severity
from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import CAR, IS_PEDESTRIAN, NEEDS_ROOM, OTHER
from bridgegen.drivers.lane_tables import EDGES, HEADING, LANES, STRAYS, TOWN

AT, WORST, ROAD, SIDE, SAMPLE, END = range(6)
LEAVINGS = 6
"""Columns of a departure: the instant at which it begins, that of the most encroachment times
speed, whether the road is left, 1 to the left or -1 to the right, the corridor's sample where it
begins, the instant at which it is over; and their number."""

MOMENT, IN_TOWN = range(2)
PASSINGS = 2
"""Columns of a pass: the instant of the least clearance that is the ego's, -1 without one; whether
it is in town; and their number."""

_TO_LANES, _TO_EDGES = LANES.start, EDGES.start


@kernel
def samples(corridor):
    """Return how many samples a corridor has before its padding."""
    n = corridor.shape[0]
    while n > 0 and not corridor[n - 1, 0] < math.inf:
        n -= 1
    return n


@kernel
def away(corridor, i, x, y):
    """Return the square of the distance of a point from a sample."""
    dx, dy = x - corridor[i, 0], y - corridor[i, 1]
    return dx * dx + dy * dy


@kernel
def nearest(corridor, n, x, y, i):
    """Return the sample nearest to a point, downhill from sample i; of all if i < 0."""
    if i < 0:
        i, least = 0, math.inf
        for j in range(n):
            d = away(corridor, j, x, y)
            if d < least:
                i, least = j, d
        return i
    least = away(corridor, i, x, y)
    while i + 1 < n and away(corridor, i + 1, x, y) < least:
        i += 1
        least = away(corridor, i, x, y)
    while i > 0 and away(corridor, i - 1, x, y) < least:
        i -= 1
        least = away(corridor, i, x, y)
    return i


@kernel
def beside(corridor, i, x, y):
    """Return how far left of the route a point is at a sample [m]."""
    h = corridor[i, HEADING]
    return (y - corridor[i, 1]) * elementary.cos(h) - (x - corridor[i, 0]) * elementary.sin(h)


@kernel
def leaving(corridor, x, y, c, s, v, offset, half_width, begin, until, whole, real):
    """Find the ego's first departure from an instant on; ``whole`` keeps -1 if there is none.

    Its rear axle counts, with both wheels: what the body sweeps beside it in a turn is no fault.
    ``real`` becomes how far [m] it is beyond the border of its lanes, or the edge of the road, at
    the most.
    """
    n, i, worst = samples(corridor), -1, -math.inf
    for k in range(begin, until if n else 0):
        # Corridors are made only where an ego strays by more.
        if abs(offset[k]) <= STRAYS:
            if whole[AT] >= 0:
                return
            i = -1
            continue
        i = nearest(corridor, n, x[k], y[k], i)
        if i == 0 or i == n - 1:  # before or behind the route
            continue
        h = corridor[i, HEADING]
        # The rear axle: the front and the corners of a body sweep more than its lane in a turn,
        # although its driver follows the route.
        half = half_width * abs(c[k] * elementary.cos(h) + s[k] * elementary.sin(h))
        aside = beside(corridor, i, x[k], y[k])
        side = 1 if aside > 0.0 else -1
        at = 0 if side > 0 else 1
        lane = side * aside + half - corridor[i, _TO_LANES + at]
        edge = side * aside + half - corridor[i, _TO_EDGES + at]
        off = edge >= EDGE_MARGIN
        out = off or lane >= LINE_MARGIN
        if whole[AT] < 0:
            if not out:
                continue
            whole[AT], whole[ROAD], whole[SIDE], whole[SAMPLE] = k, 0, side, i
        elif lane <= 0.0 or side != whole[SIDE]:  # it is back
            return
        whole[END] = k + 1
        # A slide begins in its lane: leaving the road takes the place of leaving the lane.
        if off and whole[ROAD] == 0:
            whole[ROAD], real[0], worst = 1, 0.0, -math.inf
        if not out or (whole[ROAD] == 1 and not off):
            continue
        over = edge if off else lane
        real[0] = max(real[0], over)
        if over * v[k] > worst:
            worst, whole[WORST] = over * v[k], k


@kernel
def passing(corridor, half, kinds, e, x, y, c, s, v, distance, dt, until, whole, real):
    """Find the ego's pass of body e, which rides, drives or walks on the lanes of its way.

    It passes once its front is ahead of the other's. Not counted is whom it drew level with before
    it could have slowed down, and who drew level from behind. ``real`` becomes the clearance [m]
    that is the ego's: the least one, or that with which it drew level where the other moved over
    then; and the speed by which the ego was faster [m/s]. ``x``, ``y`` are centres.
    """
    n, level, entry, own, early, i = samples(corridor), -1, 0.0, 0.0, False, -1
    reach = half[0, 0] + half[e, 0]
    for k in range(until if n else 0):
        dx, dy = x[e, k] - x[0, k], y[e, k] - y[0, k]
        ahead = dx * c[0, k] + dy * s[0, k]
        if abs(ahead) > reach or not distance[k] < math.inf:
            level, i = -1, -1
            continue
        i = nearest(corridor, n, x[e, k], y[e, k], i)
        its = beside(corridor, i, x[e, k], y[e, k])
        cosine = c[0, k] * c[e, k] + s[0, k] * s[e, k]
        faster = v[0, k] - v[e, k] * cosine
        if level < 0:
            level, entry, own = k, distance[k], its
            # Whom it drew level with sooner after the start than it takes to slow down to that
            # speed is not its doing.
            early = ahead < 0.0 or k * dt < REACTION + max(faster, 0.0) / COMFORT
        if early or cosine < SAME_WAY or ahead > half[0, 0] - half[e, 0]:
            continue
        if faster < PASSES or v[0, k] < WALKING_PACE:
            continue
        # Who waits is not overtaken, and StVO § 5 (4) does not hold.
        if IS_PEDESTRIAN[kinds[e]] and v[e, k] < CREEPS:
            continue
        if its > corridor[i, _TO_LANES] or -its > corridor[i, _TO_LANES + 1]:
            continue
        clearance = distance[k]
        if abs(its - own) > 0.5 * abs(entry - clearance):
            clearance = max(clearance, entry)  # it was the other that came near
        if whole[MOMENT] < 0 or clearance < real[0]:
            whole[MOMENT], whole[IN_TOWN] = k, int(corridor[i, TOWN] == 1.0)
            real[0], real[1] = clearance, faster


@kernel
def knows_edges(corridor, i):
    """Return whether the road's edges are known at a sample."""
    return math.isfinite(corridor[i, _TO_EDGES]) and math.isfinite(corridor[i, _TO_EDGES + 1])


@kernel
def is_excused(corridor, half, x, y, c, s, v, distance, dt, leave, whole):
    """Return whether a departure is another's fault, or leads round what is in the ego's lane."""
    at, sample = leave[AT], leave[SAMPLE]
    ahead_x, ahead_y = c[0, at], s[0, at]
    for e in range(len(whole)):
        if whole[e, KIND] < NEAR_MISS or fails(whole[e]):
            continue
        dx, dy = x[e, at] - x[0, at], y[e, at] - y[0, at]
        left = (dy * ahead_x - dx * ahead_y) * leave[SIDE]  # how far towards where the ego leaves
        if abs((at - whole[e, INSTANT]) * dt) <= HORIZON and left < 0.0:
            return True
    # A first definition let a departure from the road pass as a way round what is ahead, and missed
    # 117 of 572 slides, which begin in the junction and end behind it.
    if leave[ROAD] == 1 or not knows_edges(corridor, sample):
        return False  # within a junction, it passes none
    for e in range(1, len(whole)):
        its_speed = v[e, at] * (c[e, at] * ahead_x + s[e, at] * ahead_y)
        if not (distance[e, at] < PASSED_AHEAD and v[0, at] - its_speed > PASSES):
            continue
        i, least = 0, math.inf
        for j in range(len(corridor)):
            apart = elementary.hypot(corridor[j, 0] - x[e, at], corridor[j, 1] - y[e, at])
            if apart < least:
                i, least = j, apart
        its, reach = beside(corridor, i, x[e, at], y[e, at]), half[e, 1]
        overlaps = (
            its + reach > -corridor[i, _TO_LANES + 1] and its - reach < corridor[i, _TO_LANES]
        )
        if i >= sample and overlaps:
            return True
    return False


@kernel
def departure(
    corridor, half, rear_x, rear_y, x, y, c, s, v, offset, distance, dt, until, whole, leave, over
):
    """Find the ego's first departure that is not excused; ``leave`` is -1 if there is none."""
    others, begin = False, 0
    for e in range(len(whole)):
        others |= whole[e, KIND] >= NEAR_MISS and not fails(whole[e])
    while True:  # what comes after a departure that is excused is looked at, too
        leave[:], over[0] = -1, 0.0
        leaving(
            corridor, rear_x[0], rear_y[0], c[0], s[0], v[0], offset[0], half[0, 1], begin, until,
            leave, over,
        )  # fmt: skip
        if leave[AT] < 0:
            return
        passes = leave[ROAD] == 0 and knows_edges(corridor, leave[SAMPLE])
        if not (passes or others):
            return
        if not is_excused(corridor, half, x, y, c, s, v, distance, dt, leave, whole):
            return
        begin = leave[END]


@kernel
def put(pair, real, what, rule, instant, decided, v_ego):
    """Make a violation of the ego's of a pair."""
    pair[KIND], pair[RESPONSIBLE], pair[TYPE], pair[RULE] = VIOLATION, EGO, what, rule
    pair[INSTANT], pair[DECIDED], real[V_EGO] = instant, decided, v_ego


@kernel
def violate(
    corridor, half, kinds, rear_x, rear_y, x, y, c, s, v, offset, distance, friction, dt, n, whole,
    real, potential, aside, breach, leave, over, passed, gaps,
):  # fmt: skip
    """Put the ego's violations among the conflicts of a row; return whether there are any.

    ``leave`` ``(LEAVINGS,)``, ``over`` ``(1,)``, ``passed`` ``(PASSINGS,)`` and ``gaps`` ``(2,)``
    are scratch. A departure has the ego's own column, 0.
    """
    # Only what happens up to the ego's first contact counts.
    until, any_violation = n, False
    for e in range(len(whole)):
        if whole[e, KIND] == CONTACT:
            until = min(until, whole[e, INSTANT])
    departure(
        corridor, half, rear_x, rear_y, x, y, c, s, v, offset, distance, dt, until, whole, leave,
        over,
    )  # fmt: skip
    for e in range(1, len(whole)):
        if not NEEDS_ROOM[kinds[e]] or whole[e, KIND] >= NEAR_MISS:
            continue
        passed[:], gaps[:] = -1, 0.0
        passing(corridor, half, kinds, e, x, y, c, s, v, distance[e], dt, until, passed, gaps)
        moment, clearance, faster = passed[MOMENT], gaps[0], gaps[1]
        if moment < 0:
            continue
        limit = PASSED_BESIDE[passed[IN_TOWN]]
        closest = min(CLOSE + CLOSE_TIME * faster, limit)
        if not clearance < (closest if whole[e, KIND] == COURSE else limit):
            continue
        any_violation = True
        put(whole[e], real[e], CLOSE_PASS, PASSED_TOO_CLOSE, moment, moment, v[0, moment])
        front = severity(kinds[0], kinds[e], faster, 0.0, injury.FRONT, injury.REAR, True)
        real[e, V_OTHER], aside[e] = v[e, moment], clearance
        potential[e] = front * max(1.0 - clearance / closest, 0.0)
        breach[e] = min((limit - clearance) / max(limit - closest, 1e-9), 1.0)
    if leave[AT] < 0:
        return any_violation
    worst, off = leave[WORST], leave[ROAD] == 1
    put(
        whole[0], real[0], ROAD_DEPARTURE if off else LANE_DEPARTURE,
        LEFT_THE_ROAD if off else DID_NOT_KEEP_LANE, worst, leave[AT], v[0, worst],
    )  # fmt: skip
    aside[0], breach[0] = leave[SIDE] * over[0], 1.0
    speed = v[0, worst]
    # Severity is that of what the departure may lead to: a solid obstacle beside the road, or a car
    # that comes on the next lane.
    if off:
        grip = friction if math.isfinite(friction) else 0.0
        struck = math.sqrt(max(speed * speed - 2.0 * grip * CLEAR_ZONE, 0.0))
        potential[0] = severity(kinds[0], OTHER, struck, 0.0, injury.FRONT, injury.FRONT, False)
    else:
        share = min(over[0] / (2.0 * half[0, 1]), 1.0)
        potential[0] = share * severity(
            kinds[0], CAR, 2.0 * speed, 0.0, injury.FRONT, injury.FRONT, True
        )
    return True


@kernel
def violate_rows(
    known, corridors, corridor_of, half, kinds, rear_x, rear_y, x, y, c, s, v, offset, distance,
    friction, dt, n_steps, whole, real, potential, aside, breach, leave, over, passed, gaps,
):  # fmt: skip
    """Put the ego's violations among the conflicts of some rows; return whether there are any."""
    any_violation = False
    for i in known:
        any_violation |= violate(
            corridors[corridor_of[i]], half, kinds, rear_x[i], rear_y[i], x[i], y[i], c[i], s[i],
            v[i], offset[i], distance[i], friction[i], dt, n_steps[i], whole[i], real[i],
            potential[i], aside[i], breach[i], leave, over, passed, gaps,
        )  # fmt: skip
    return any_violation
