"""Compiled metrics of collision courses; public wrappers: ``drac``, ``thw``, ``tet``.

At every instant all bodies are predicted straight ahead at their present speeds.
"""

import math

import numpy as np

from bridgegen.assess.metrics._ttc_kernels import STANDSTILL, time_to_contact
from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel


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
    ), squared  # fmt: skip


@kernel
def circles_of(la: float, wa: float, lb: float, wb: float) -> float:
    """Return the square of the sum of the radii of two boxes, with room for rounding."""
    radii: float = math.sqrt(la * la + wa * wa) + math.sqrt(lb * lb + wb * wb)
    return radii * radii * (1.0 + 1e-9)


@kernel
def avoidance_rate(
    half: Float, x: Float, y: Float, cosine: Float, sine: Float, v: Float, distance: Float,
    n_steps: Int, most: float, out: Float,
) -> None:  # fmt: skip
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
    half: Float, x: Float, y: Float, cosine: Float, sine: Float, v: Float, distance: Float,
    n_steps: Int, out: Float,
) -> None:  # fmt: skip
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
    half: Float, x: Float, y: Float, cosine: Float, sine: Float, v: Float, distance: Float,
    n_steps: Int, target: float, out: Float,
) -> None:  # fmt: skip
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
