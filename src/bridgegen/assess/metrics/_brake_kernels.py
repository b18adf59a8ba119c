"""Compiled required deceleration; public wrapper: ``btn.btn``.

The ego travels s while the other travels q, both straight on. The boxes touch while (q, s) is in a
convex polygon: between four pairs of parallel lines, one for each axis of the boxes. Avoiding the
other by braking means staying below the polygon, that is below the highest of three lines
low + slope · q, for all q from ``first`` to ``last``. The lines are sorted by slope, so that each
is the highest after the one before it.
"""

import math

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel

PARALLEL = 1e-9  # a sine or cosine below this is rounding


@kernel
def when(q: float, u: float, b: float) -> float:
    """Return when a body with speed u and acceleration b has travelled q ≥ 0; +inf if never."""
    squared = u * u + 2.0 * b * q
    if q == 0.0:
        return 0.0
    if squared <= 0.0 or q == math.inf:
        return math.inf
    # The form of the root that loses no digits for a small b, and holds for b = 0.
    return 2.0 * q / (u + math.sqrt(squared))


@kernel
def at_most(v: float, t: float, s: float) -> float:
    """Return the least deceleration from speed v > 0 to travel at most s > 0 until time t."""
    if v * t <= s:
        return 0.0
    if v * t >= 2.0 * s:
        return v * v / (2.0 * s)  # it has stopped by then
    return 2.0 * (v * t - s) / (t * t)


@kernel
def to_stay_below(
    v: float, u: float, b: float, first: float, last: float, stays: bool, low: Float, slope: Float
) -> float:
    """Return the least deceleration that keeps the ego below the lines; +inf if none does.

    ``stays``: the other, once at ``last``, stays there.
    """
    needed = 0.0
    q = first
    for i in range(3):
        if low[i] == -math.inf:
            continue
        end = last
        for j in range(i + 1, 3):
            if slope[j] > slope[i]:
                # A line is the highest until a steeper one crosses it.
                end = min(end, (low[i] - low[j]) / (slope[j] - slope[i]))
        if end < q:
            continue  # a steeper one is the highest already
        t_q, t_end, moves = when(q, u, b), when(end, u, b), when(end, u, b)
        if stays and end == last:
            t_end, moves = math.inf, (u / -b if b < 0.0 else 0.0)
        s_q, s_end = low[i] + slope[i] * q, low[i] + slope[i] * end
        if s_q <= 0.0 or s_end <= 0.0:
            return math.inf
        needed = max(needed, at_most(v, t_q, s_q), at_most(v, t_end, s_end))
        closing = v - slope[i] * u
        if slope[i] > 0.0 and low[i] > 0.0 and closing > 0.0:
            # Relative to the line the ego comes to rest there; earlier or later, the ends of the
            # piece decide.
            touch = 2.0 * low[i] / closing
            if t_q < touch < moves:  # alongside a line that still moves
                needed = max(needed, closing * closing / (2.0 * low[i]) - slope[i] * b)
        if end == last:
            break
        q = end
    return needed


@kernel
def to_stand_when_touched(
    v: float, u: float, b: float, t_first: float, low: Float, slope: Float
) -> float:
    """Return the deceleration that stops the ego exactly where and when it is touched."""
    latest = t_first
    for i in range(3):
        if low[i] > 0.0 and slope[i] <= 0.0:
            half = 0.5 * v - slope[i] * u
            squared = half * half - 2.0 * low[i] * slope[i] * b
            if squared < 0.0:
                return 0.0
            latest = max(latest, 2.0 * low[i] / (half + math.sqrt(squared)))
    return v / latest


@kernel
def required(
    ahead: float, left: float, c: float, s: float, la: float, wa: float, lb: float, wb: float,
    v: float, u: float, b: float, low: Float, slope: Float,
) -> float:  # fmt: skip
    """Return the deceleration that one other participant requires of the ego; 0 if none.

    In the ego's frame the other's centre is at (ahead, left) and its heading is (c, s); v and u are
    their speeds, b is the other's acceleration. ``low`` and ``slope`` are ``(3,)`` scratch.
    """
    reach = la + (abs(c) * lb + abs(s) * wb)
    if v == 0.0 or ahead <= -reach:
        return 0.0  # it comes from behind
    first, last, stays = 0.0, math.inf, False
    if b < 0.0 or (u == 0.0 and b == 0.0):
        last, stays = (u * u / (-2.0 * b) if u > 0.0 else 0.0), True
    side = wa + (abs(s) * lb + abs(c) * wb)
    low[0], slope[0] = -math.inf, 0.0
    low[1], slope[1] = ahead - reach, c
    low[2], slope[2] = -math.inf, c
    high, high_slope, highest = ahead + reach, c, math.inf
    t_first = 0.0
    if abs(s) <= PARALLEL:
        if abs(left) > side:
            return 0.0
    else:
        first = max(first, min((-side - left) / s, (side - left) / s))
        leaves = max((-side - left) / s, (side - left) / s)
        if leaves < last:
            last, stays = leaves, False
        if first > last:
            return 0.0
        t_first = when(first, u, b)
        if t_first == math.inf or v * t_first > high + high_slope * first:
            return 0.0  # the ego has passed before, as with nearly all vehicles beside it
        across, reach_across = left * c - ahead * s, wb + (abs(s) * la + abs(c) * wa)
        low[0] = min((-reach_across - across) / s, (reach_across - across) / s)
        highest = max((-reach_across - across) / s, (reach_across - across) / s)
        if abs(c) > PARALLEL:
            along = ahead * c + left * s
            reach_along = math.copysign(lb + (abs(c) * la + abs(s) * wa), c)
            low[2], slope[2] = (along - reach_along) / c, 1.0 / c
            highest = min(highest, (along + reach_along + first) / c)
    if v * t_first > min(high + high_slope * first, highest):
        return 0.0
    # Lines by ascending slope, as `to_stay_below` wants them: c and 1 / c are both negative.
    if c < 0.0:
        low[0], low[2] = low[2], low[0]
        slope[0], slope[2] = slope[2], slope[0]
    needed: float = to_stay_below(v, u, b, first, last, stays, low, slope)
    if needed == math.inf:
        needed = to_stand_when_touched(v, u, b, t_first, low, slope)
    return needed


@kernel
def largest_required(
    half: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    v: Float,
    a: Float,
    distance: Float,
    n_steps: Int,
    most: float,
    out: Float,
) -> None:
    """Write the largest deceleration that any participant requires of the ego, at most ``most``."""
    n_rows, n_entities, _ = x.shape
    low, slope = np.empty(3), np.empty(3)
    for i in range(n_rows):
        best = 0.0
        for e in range(1, n_entities):
            for k in range(n_steps[i]):
                # It is absent.
                if distance[i, e, k] == math.inf:
                    continue
                if distance[i, e, k] == 0.0:
                    best = most
                    break
                ca, sa = cosine[i, 0, k], sine[i, 0, k]
                dx, dy = x[i, e, k] - x[i, 0, k], y[i, e, k] - y[i, 0, k]
                needed = required(
                    dx * ca + dy * sa,
                    dy * ca - dx * sa,
                    ca * cosine[i, e, k] + sa * sine[i, e, k],
                    ca * sine[i, e, k] - sa * cosine[i, e, k],
                    half[0, 0],
                    half[0, 1],
                    half[e, 0],
                    half[e, 1],
                    v[i, 0, k],
                    v[i, e, k],
                    a[i, e, k],
                    low,
                    slope,
                )
                best = max(best, needed)
        out[i] = min(best, most)
