"""Compiled search for where the ego leaves its lane or the road, and whom it passes how closely."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.assess.conflict._limits import (
    COMFORT,
    CREEPS,
    EDGE_MARGIN,
    LINE_MARGIN,
    PASSES,
    REACTION,
    SAME_WAY,
    WALKING_PACE,
)
from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import IS_PEDESTRIAN, NEEDS_ROOM
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
def find_rows(
    rows, corridors, corridor_of, half, kinds, rear_x, rear_y, x, y, c, s, v, offset,
    distance, dt, begins, until, leavings, over, passings, clearances,
):  # fmt: skip
    """Fill the departures ``(N, LEAVINGS)`` and passes ``(N, E, PASSINGS)`` of some rows.

    Departures count from the instants ``begins`` on; the rows' columns are -1.
    """
    for i in rows:
        corridor = corridors[corridor_of[i]]
        leaving(
            corridor,
            rear_x[i, 0],
            rear_y[i, 0],
            c[i, 0],
            s[i, 0],
            v[i, 0],
            offset[i, 0],
            half[0, 1],
            begins[i],
            until[i],
            leavings[i],
            over[i],
        )
        for e in range(1, x.shape[1]):
            if NEEDS_ROOM[kinds[e]]:
                passing(
                    corridor, half, kinds, e, x[i], y[i], c[i], s[i], v[i], distance[i, e], dt,
                    until[i], passings[i, e], clearances[i, e],
                )  # fmt: skip
