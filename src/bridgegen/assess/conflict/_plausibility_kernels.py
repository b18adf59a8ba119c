"""Compiled: the first implausible motion of a participant other than the ego; wrapper beside it.

One scenario after the other; each result depends on its scenario alone.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

import numpy as np

from bridgegen.assess.conflict._codes import COURSE, NEAR_MISS
from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel

OTHERS_COLLIDE, OVERLAP_AT_START, SIDEWAYS, ACCELERATION, DECELERATION = 1, 2, 3, 4, 5
CURVATURE, LATERAL_ACCELERATION, JUMP = 6, 7, 8

# Columns of the limits of a kind, see ``plausibility.LIMITS``.
SPEEDS_UP, BRAKES, CURVES, CORNERS, SLIPS = range(5)
IS_PROP = 5

DEPTH = 0.01  # m, boxes with less penetration only touch: the rounding of a file
SLIDE = 0.2  # m/s, of motion across the body: rounding of positions, and kinks of a lane's centre
KINK = 0.05  # rad, by which a lane's centre may turn at once, as maps from surveys do
SURGE = 0.1  # m/s, of a change of speed: rounding
LEAP, FASTER = 0.1, 1.2  # m and ratio, by which a displacement may exceed the speed


@kernel
def overlap_depth(box_a, box_b, dx, dy, cos_a, sin_a, cos_b, sin_b):
    """Return the penetration of two boxes along the axis of least depth [m].

    Their reference points are (dx, dy) apart; ≤ 0 where they are apart or touch.
    """
    la, wa, lb, wb = 0.5 * box_a[0], 0.5 * box_a[1], 0.5 * box_b[0], 0.5 * box_b[1]
    dx += box_b[2] * cos_b - box_a[2] * cos_a
    dy += box_b[2] * sin_b - box_a[2] * sin_a
    c, s = abs(cos_a * cos_b + sin_a * sin_b), abs(cos_a * sin_b - sin_a * cos_b)
    depth = min(
        la + c * lb + s * wb - abs(dx * cos_a + dy * sin_a),
        wa + s * lb + c * wb - abs(dy * cos_a - dx * sin_a),
    )
    return min(
        depth,
        lb + c * la + s * wa - abs(dx * cos_b + dy * sin_b),
        wb + s * la + c * wa - abs(dy * cos_b - dx * sin_b),
    )


@kernel
def last_conflict(kind, instant, after, n):
    """Return the instant up to which motion belongs to a row's conflicts; n if there are none.

    Near misses and contacts count alike; collision courses only where there is neither.

    Args:
        kind: ``(E,)`` of the conflicts, without violations.
        instant: ``(E,)`` likewise.
        after: instants that still belong to one.
        n: of instants.
    """
    worst, last = COURSE, -1
    for e in range(len(kind)):
        if min(kind[e], NEAR_MISS) > worst:
            worst, last = NEAR_MISS, -1
        if min(kind[e], NEAR_MISS) == worst:
            last = max(last, instant[e] + after)
    return n if last < 0 else last


@kernel
def last_conflicts(kind, instant, after, n, last):
    """Fill the last, ``(N,)``."""
    for i in range(len(last)):
        last[i] = last_conflict(kind[i], instant[i], after, n)


@kernel
def _first_contact(distance, n):
    """Return the last instant that is judged: that of the ego's first contact, else the last."""
    last = n - 1
    for e in range(1, distance.shape[0]):
        for k in range(last + 1):
            if distance[e, k] <= 0.0:
                last = k
                break
    return last


@kernel
def _motion(i, e, x, y, h, v, c, s, present, limits, last, window, dt, found):
    """Judge the motion of body e of row i up to an instant.

    x, y, h, v, c and s are that body's own, ``(T,)``. ``found`` ``(4,)`` is filled with the first
    implausible motion: code (0: none), instant, value, limit. Returns whether the body ever moves,
    and the longest of its steps [m].
    """
    span = window * dt
    moves, longest, since = False, 0.0, 0
    comes = present.shape[0] > 0
    found[0] = 0.0
    for k in range(last):
        dx, dy = x[k + 1] - x[k], y[k + 1] - y[k]
        if comes and not (present[i, e, k] and present[i, e, k + 1]):
            since, moves = k + 1, True
            longest = max(longest, math.sqrt(dx * dx + dy * dy))  # it may come back elsewhere
            continue
        if dx == 0.0 and dy == 0.0 and v[k] == 0.0 and v[k + 1] == 0.0 and h[k] == h[k + 1]:
            continue
        moves = True
        step = math.sqrt(dx * dx + dy * dy)
        longest = max(longest, step)
        most = FASTER * max(abs(v[k]), abs(v[k + 1])) * dt + LEAP
        if step > most:
            found[0], found[1], found[2], found[3] = JUMP, k + 1, step, most
            return moves, longest
        slide = 0.5 * abs(dy * (c[k] + c[k + 1]) - dx * (s[k] + s[k + 1])) / dt
        most = SLIDE + limits[SLIPS] * 0.5 * (abs(v[k]) + abs(v[k + 1]))
        if slide > most:
            found[0], found[1], found[2], found[3] = SIDEWAYS, k + 1, slide, most
            return moves, longest
        # Changes count over 0.25 s, as brakes need to build up: a linear lane change has kinks, but
        # hardly differs from what a car can do.
        j = k + 1 - window  # from j to k + 1
        if j < since:
            continue
        gain = v[k + 1] - v[j]
        if v[j] <= 0.0 and v[k + 1] <= 0.0:  # it reverses, and gains speed backwards
            gain = v[j] - v[k + 1]
        if gain > limits[SPEEDS_UP] * span + SURGE:
            found[0], found[1], found[2] = ACCELERATION, k + 1, gain / span
            found[3] = limits[SPEEDS_UP]
            return moves, longest
        if -gain > limits[BRAKES] * span + SURGE:
            found[0], found[1], found[2] = DECELERATION, k + 1, -gain / span
            found[3] = limits[BRAKES]
            return moves, longest
        turn = abs(h[k + 1] - h[j])
        mean = 0.5 * (abs(v[k + 1]) + abs(v[j]))
        if turn > limits[CURVES] * mean * span + KINK:
            found[0], found[1], found[3] = CURVATURE, k + 1, limits[CURVES]
            found[2] = turn / (mean * span) if mean > 0.0 else math.inf
            return moves, longest
        if turn * mean > limits[CORNERS] * span:
            found[0], found[1], found[2] = LATERAL_ACCELERATION, k + 1, turn * mean / span
            found[3] = limits[CORNERS]
            return moves, longest
    return moves, longest


@kernel
def _appears(i, e, present, last):
    """Return the first instant at which body e of row i is present, ``last + 1`` if never."""
    if present.shape[0] == 0:
        return 0
    for k in range(last + 1):
        if present[i, e, k]:
            return k
    return last + 1


@kernel
def _is_towed_by_ego(e, towed_by):
    """Return whether a body is a trailer of the ego's."""
    while e > 0:
        e = towed_by[e]
    return e == 0


@kernel
def judge(
    box, limits, x, y, h, v, cosine, sine, distance, present, towed_by, n_steps, failed, dt,
    window, code, instant, entity, other, value, limit,
):  # fmt: skip
    """Fill the last six, each ``(N,)``; see ``plausibility.Plausibility`` and ``LIMITS``."""
    n_rows, n_entities, _ = x.shape
    found, longest, reach = np.zeros(4), np.zeros(n_entities), np.zeros(n_entities)
    moves, first = np.zeros(n_entities, np.bool_), np.zeros(n_entities, np.int64)
    comes = present.shape[0] > 0
    for e in range(n_entities):
        reach[e] = elementary.hypot(abs(box[e, 2]) + 0.5 * box[e, 0], 0.5 * box[e, 1])
    for i in range(n_rows):
        code[i], instant[i], entity[i], other[i] = 0, -1, -1, -1
        value[i] = limit[i] = math.nan
        if failed[i]:
            continue
        last = _first_contact(distance[i], n_steps[i])
        best = last + 1
        for e in range(n_entities):
            first[e] = _appears(i, e, present, last)
        for e in range(1, n_entities):
            moves[e], longest[e] = _motion(
                i, e, x[i, e], y[i, e], h[i, e], v[i, e], cosine[i, e], sine[i, e], present,
                limits[e], last, window, dt, found,
            )  # fmt: skip
            if found[0] > 0.0 and found[1] < best:
                best = int(found[1])
                code[i], instant[i], entity[i] = int(found[0]), best, e
                value[i], limit[i] = found[2], found[3]
        for a in range(n_entities):
            for b in range(a + 1, n_entities):
                if towed_by[a] == b or towed_by[b] == a:
                    continue
                is_ego_s = a == 0 or _is_towed_by_ego(a, towed_by) or _is_towed_by_ego(b, towed_by)
                at = max(first[a], first[b])
                if at > last or at > best:
                    continue
                stand = a > 0 and not (moves[a] or moves[b])
                # Props may stand in each other, as the parts of a barrier do; parked vehicles may
                # not.
                if stand and limits[a, IS_PROP] > 0.0 and limits[b, IS_PROP] > 0.0:
                    continue
                until = at if is_ego_s or stand else min(best, last)
                k = at
                while k <= until:
                    if comes and not (present[i, a, k] and present[i, b, k]):
                        k += 1
                        continue
                    dx, dy = x[i, b, k] - x[i, a, k], y[i, b, k] - y[i, a, k]
                    apart = math.sqrt(dx * dx + dy * dy) - reach[a] - reach[b]
                    if apart <= 0.0:
                        depth = overlap_depth(
                            box[a],
                            box[b],
                            dx,
                            dy,
                            cosine[i, a, k],
                            sine[i, a, k],
                            cosine[i, b, k],
                            sine[i, b, k],
                        )
                        if depth > DEPTH:
                            kind = OVERLAP_AT_START if k == at else OTHERS_COLLIDE
                            if k < best or kind < code[i]:
                                best = k
                                code[i], instant[i], entity[i], other[i] = kind, k, a, b
                                value[i], limit[i] = depth, DEPTH
                            break
                        k += 1
                    else:
                        closing = longest[a] + longest[b]
                        k += 1 + int(min(apart / closing, 1e6)) if closing > 0.0 else until + 1
