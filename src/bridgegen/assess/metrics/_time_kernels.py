"""Compiled metrics of time; public wrappers in ``times``."""

import math

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel

# --- Compiled two-dimensional time to collision; public wrapper: ``ttc.ttc`` ---


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
    value = (-reach - position) / rate
    other = (reach - position) / rate
    return min(value, other), max(value, other)


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
    ca, sa, cb, sb = elementary.cos(ha[nearest]), elementary.sin(ha[nearest]), 0.0, 0.0
    known_a, known_b = ha[nearest], np.nan
    for j in range(n):
        k = nearest - j if j <= nearest else j
        speeds = abs(va[k]) + abs(vb[k])
        if speeds == 0.0 or gap[k] >= best * speeds * (1.0 + 1e-9) + 1e-6:
            continue
        if ha[k] != known_a:
            known_a = ha[k]
            ca, sa = elementary.cos(known_a), elementary.sin(known_a)
        if hb[k] != known_b:
            known_b = hb[k]
            cb, sb = elementary.cos(known_b), elementary.sin(known_b)
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
            time_to_contact(dx, dy, wx, wy, ca, sa, cb, sb, la, wa, lb, wb, STANDSTILL * speeds),
        )
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


# --- Compiled post-encroachment time; public wrapper: ``pet.pet`` ---


@kernel
def separation(
    dx: float,
    dy: float,
    ca: float,
    sa: float,
    cb: float,
    sb: float,
    la: float,
    wa: float,
    lb: float,
    wb: float,
) -> float:
    """Return the widest gap [m] between boxes A and B over their four axes; ≤ 0 if they touch.

    (dx, dy) leads from A's centre to B's. Their distance is no less.
    """
    c = abs(ca * cb + sa * sb)
    s = abs(ca * sb - sa * cb)
    value = max(
        abs(dx * ca + dy * sa) - (la + (c * lb + s * wb)),
        abs(dy * ca - dx * sa) - (wa + (s * lb + c * wb)),
    )
    other = max(
        abs(dx * cb + dy * sb) - (lb + (c * la + s * wa)),
        abs(dy * cb - dx * sb) - (wb + (s * la + c * wa)),
    )
    return max(value, other)


@kernel
def stride(x: Float, y: Float, c: Float, s: Float, radius: float, n: int) -> float:
    """Return the greatest distance [m] that a point of a body moves between two instants."""
    most = 0.0
    for k in range(1, n):
        moved = math.sqrt((x[k] - x[k - 1]) ** 2 + (y[k] - y[k - 1]) ** 2)
        turned = math.sqrt((c[k] - c[k - 1]) ** 2 + (s[k] - s[k - 1]) ** 2)
        most = max(most, moved + radius * turned)
    return most


@kernel
def nearest_in_time(
    half: Float,
    x: Float,
    y: Float,
    c: Float,
    s: Float,
    distance: Float,
    e: int,
    n: int,
    best: int,
) -> int:
    """Return the least of ``best`` and the steps between the ego and e covering one point.

    From each instant of the ego, e's track is searched in both directions. Where the boxes are
    apart, as many instants are skipped as e needs for the distance.
    """
    la, wa, lb, wb = half[0, 0], half[0, 1], half[e, 0], half[e, 1]
    pace = stride(x[e], y[e], c[e], s[e], math.sqrt(lb * lb + wb * wb), n) * (1.0 + 1e-9)
    nearest = 0
    for k in range(n):
        if distance[k] < distance[nearest]:
            nearest = k
    if distance[nearest] == 0.0:
        return 0
    for m in range(n):  # outwards from the smallest distance, so that the best is found early
        i = nearest - m if m <= nearest else m
        for way in (-1, 1):
            j = i
            while 0 <= j < n and abs(j - i) < best:
                skip = 1
                if distance[j] < math.inf:  # else it is absent
                    apart = separation(
                        x[e, j] - x[0, i],
                        y[e, j] - y[0, i],
                        c[0, i],
                        s[0, i],
                        c[e, j],
                        s[e, j],
                        la,
                        wa,
                        lb,
                        wb,
                    )
                    if apart <= 0.0:
                        best = abs(j - i)
                        break
                    if apart >= pace * n:
                        break
                    skip = max(int(apart / pace), 1)
                j += way * skip
    return best


@kernel
def encroachment(
    half: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    distance: Float,
    n_steps: Int,
    longest: int,
    out: Float,
) -> None:
    """Write each scenario's least number of steps between covering one point; +inf if none.

    More than ``longest`` steps do not count.
    """
    n_rows, n_entities, _ = x.shape
    for i in range(n_rows):
        best = longest + 1
        for e in range(1, n_entities):
            best = nearest_in_time(
                half, x[i], y[i], cosine[i], sine[i], distance[i, e], e, n_steps[i], best
            )
        out[i] = best if best <= longest else np.inf


# --- Compiled metrics of collision courses; public wrappers: ``drac``, ``thw``, ``tet`` ---
# At every instant all bodies are predicted straight ahead at their present speeds.


@kernel
def contact(
    dx: float, dy: float, ca: float, sa: float, cb: float, sb: float, va: float, vb: float,
    la: float, wa: float, lb: float, wb: float, circles: float,
) -> tuple[float, float]:  # fmt: skip
    """Return when boxes A and B touch [s], +inf if they never do, and their squared relative speed.

    (dx, dy) leads from A's centre to B's; ``circles`` is the square of the sum of their radii.
    """
    wx, wy = vb * cb - va * ca, vb * sb - va * sa
    squared = wx * wx + wy * wy
    across = dx * wy - dy * wx
    if across * across > circles * squared or (
        dx * wx + dy * wy >= 0.0 and dx * dx + dy * dy > circles
    ):
        return math.inf, squared  # they pass each other, or separate
    return time_to_contact(
        dx, dy, wx, wy, ca, sa, cb, sb, la, wa, lb, wb, STANDSTILL * (va + vb)
    ), squared


@kernel
def circles_of(la: float, wa: float, lb: float, wb: float) -> float:
    """Return the square of the sum of the radii of two boxes, with room for rounding."""
    radii: float = math.sqrt(la * la + wa * wa) + math.sqrt(lb * lb + wb * wb)
    return radii * radii * (1.0 + 1e-9)


@kernel
def avoidance_rate(
    half: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    v: Float,
    distance: Float,
    n_steps: Int,
    most: float,
    out: Float,
) -> None:
    """Write the largest relative speed over twice the time to collision, at most ``most``."""
    n_rows, n_entities, _ = x.shape
    la, wa = half[0, 0], half[0, 1]
    for i in range(n_rows):
        px, py, ca, sa, va = x[i, 0], y[i, 0], cosine[i, 0], sine[i, 0], v[i, 0]
        best = 0.0
        for e in range(1, n_entities):
            lb, wb = half[e, 0], half[e, 1]
            circles = circles_of(la, wa, lb, wb)
            qx, qy, cb, sb, vb = x[i, e], y[i, e], cosine[i, e], sine[i, e], v[i, e]
            gap = distance[i, e]
            for k in range(n_steps[i]):
                if gap[k] == 0.0:
                    best = most
                    break
                if gap[k] == math.inf or (va[k] + vb[k]) ** 2 <= 2.0 * best * gap[k]:
                    continue  # it is absent, or too slow even head-on
                time, squared = contact(
                    qx[k] - px[k], qy[k] - py[k], ca[k], sa[k], cb[k], sb[k], va[k], vb[k],
                    la, wa, lb, wb, circles,
                )  # fmt: skip
                if time < math.inf:
                    best = max(best, math.sqrt(squared) / (2.0 * time))
        out[i] = min(best, most)


@kernel
def headway(
    half: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    v: Float,
    distance: Float,
    n_steps: Int,
    out: Float,
) -> None:
    """Write the least time in which the ego reaches the place where another is."""
    n_rows, n_entities, _ = x.shape
    la, wa = half[0, 0], half[0, 1]
    for i in range(n_rows):
        px, py, ca, sa, va = x[i, 0], y[i, 0], cosine[i, 0], sine[i, 0], v[i, 0]
        best = math.inf
        for e in range(1, n_entities):
            lb, wb = half[e, 0], half[e, 1]
            circles = circles_of(la, wa, lb, wb)
            qx, qy, cb, sb, gap = x[i, e], y[i, e], cosine[i, e], sine[i, e], distance[i, e]
            for k in range(n_steps[i]):
                if gap[k] == 0.0:
                    best = 0.0
                    break
                if va[k] > 0.0 and gap[k] < best * va[k]:
                    time, _ = contact(
                        qx[k] - px[k], qy[k] - py[k], ca[k], sa[k], cb[k], sb[k], va[k], 0.0,
                        la, wa, lb, wb, circles,
                    )  # fmt: skip
                    best = min(best, time)
        out[i] = best


@kernel
def short_times(
    half: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    v: Float,
    distance: Float,
    n_steps: Int,
    target: float,
    out: Float,
) -> None:
    """Write for how many instants the least time to collision is ≤ ``target``, and their sum short.

    ``out`` is ``(N, 2)``.
    """
    n_rows, n_entities, n_instants = x.shape
    least = np.empty(n_instants)
    la, wa = half[0, 0], half[0, 1]
    for i in range(n_rows):
        px, py, ca, sa, va = x[i, 0], y[i, 0], cosine[i, 0], sine[i, 0], v[i, 0]
        least[:] = np.inf
        for e in range(1, n_entities):
            lb, wb = half[e, 0], half[e, 1]
            circles = circles_of(la, wa, lb, wb)
            qx, qy, cb, sb, vb = x[i, e], y[i, e], cosine[i, e], sine[i, e], v[i, e]
            gap = distance[i, e]
            for k in range(n_steps[i]):
                if gap[k] == 0.0:
                    least[k] = 0.0
                elif gap[k] <= min(target, least[k]) * (va[k] + vb[k]):
                    time, _ = contact(
                        qx[k] - px[k], qy[k] - py[k], ca[k], sa[k], cb[k], sb[k], va[k], vb[k],
                        la, wa, lb, wb, circles,
                    )  # fmt: skip
                    least[k] = min(least[k], time)
        out[i, :] = 0.0
        for k in range(n_steps[i]):
            if least[k] <= target:
                out[i, 0] += 1.0
                out[i, 1] += target - least[k]
