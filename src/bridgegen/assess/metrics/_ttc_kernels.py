"""Compiled two-dimensional time to collision; public wrapper: ``ttc.ttc``."""

import math

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel

# A rate of approach below this share of the two speeds is rounding of a cosine, not motion: without
# it, two vehicles abreast on parallel courses would collide in 10¹⁶ s.
STANDSTILL = 1e-12


@kernel
def sweep(position: float, rate: float, reach: float, still: float) -> tuple[float, float]:
    """Return when |position + rate·t| ≤ reach begins and ends; never if begin > end."""
    if abs(rate) <= still:
        if abs(position) <= reach:
            return -np.inf, np.inf
        return np.inf, -np.inf
    one = (-reach - position) / rate
    other = (reach - position) / rate
    return min(one, other), max(one, other)


@kernel
def time_to_contact(
    dx: float, dy: float, wx: float, wy: float, ca: float, sa: float, cb: float, sb: float,
    la: float, wa: float, lb: float, wb: float, still: float,
) -> float:  # fmt: skip
    """Return when boxes A and B first touch, ≥ 0; +inf if they never do.

    (dx, dy) leads from A's centre to B's, (wx, wy) is B's velocity relative to A's. They overlap
    while their projections on all four axes (the separating-axis theorem) do.
    """
    c = abs(ca * cb + sa * sb)
    s = abs(ca * sb - sa * cb)
    begin, end = sweep(dx * ca + dy * sa, wx * ca + wy * sa, la + (c * lb + s * wb), still)
    start, stop = sweep(dy * ca - dx * sa, wy * ca - wx * sa, wa + (s * lb + c * wb), still)
    begin, end = max(begin, start), min(end, stop)
    start, stop = sweep(dx * cb + dy * sb, wx * cb + wy * sb, lb + (c * la + s * wa), still)
    begin, end = max(begin, start), min(end, stop)
    start, stop = sweep(dy * cb - dx * sb, wy * cb - wx * sb, wb + (s * la + c * wa), still)
    begin, end = max(0.0, begin, start), min(end, stop)
    return begin if begin <= end else np.inf


@kernel
def pair(
    box_a: Float, box_b: Float, xa: Float, ya: Float, ha: Float, va: Float,
    xb: Float, yb: Float, hb: Float, vb: Float, gap: Float, n: int, best: float,
) -> float:  # fmt: skip
    """Return the least of ``best`` and the first n times to collision of A and B.

    Instants that cannot be less than the best so far are skipped: boxes a gap apart need at least
    gap / (sum of speeds). The search runs outwards from the smallest gap, where the best is found
    early. Both bounds leave room for rounding, so skipping never changes the result.
    """
    la, wa, lb, wb = 0.5 * box_a[0], 0.5 * box_a[1], 0.5 * box_b[0], 0.5 * box_b[1]
    circles = (math.sqrt(la * la + wa * wa) + math.sqrt(lb * lb + wb * wb)) ** 2 * (1.0 + 1e-9)
    nearest = 0
    for k in range(1, n):
        if gap[k] < gap[nearest]:
            nearest = k
    if gap[nearest] == 0.0:
        return 0.0
    ca, sa, cb, sb = math.cos(ha[nearest]), math.sin(ha[nearest]), 0.0, 0.0
    known_a, known_b = ha[nearest], np.nan
    for j in range(n):
        k = nearest - j if j <= nearest else j
        speeds = abs(va[k]) + abs(vb[k])
        if speeds == 0.0 or gap[k] >= best * speeds * (1.0 + 1e-9) + 1e-6:
            continue
        if ha[k] != known_a:
            known_a = ha[k]
            ca, sa = math.cos(known_a), math.sin(known_a)
        if hb[k] != known_b:
            known_b = hb[k]
            cb, sb = math.cos(known_b), math.sin(known_b)
        dx = (xb[k] - xa[k]) + (box_b[2] * cb - box_a[2] * ca)
        dy = (yb[k] - ya[k]) + (box_b[2] * sb - box_a[2] * sa)
        wx = vb[k] * cb - va[k] * ca
        wy = vb[k] * sb - va[k] * sa
        if dx * dx + dy * dy > circles:
            # The boxes' circles are apart now; do they separate, or pass each other?
            across = dx * wy - dy * wx
            if dx * wx + dy * wy >= 0.0 or across * across > circles * (wx * wx + wy * wy):
                continue
        best = min(
            best,
            time_to_contact(
                dx, dy, wx, wy, ca, sa, cb, sb, la, wa, lb, wb, STANDSTILL * speeds
            ),
        )  # fmt: skip
    return best


@kernel
def least_time(
    box: Float, x: Float, y: Float, h: Float, v: Float, distance: Float, n_steps: Int, out: Float
) -> None:
    """Write each scenario's least time to collision of entity 0 with any other."""
    n_rows, n_entities, _ = x.shape
    for i in range(n_rows):
        best = np.inf
        for e in range(1, n_entities):
            best = pair(
                box[0], box[e], x[i, 0], y[i, 0], h[i, 0], v[i, 0],
                x[i, e], y[i, e], h[i, e], v[i, e], distance[i, e], n_steps[i], best,
            )  # fmt: skip
        out[i] = best
