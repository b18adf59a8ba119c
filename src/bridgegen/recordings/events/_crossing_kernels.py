"""Compiled search for places where recorded paths cross; wrapper: ``paths.Paths.crossings``."""

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import kernel


@kernel
def mark_vertices(first: Int, x: Float, y: Float, apart: float, out: Bool) -> None:
    """Mark the states that are a distance or more from the one marked before.

    Args:
        first: ``(P + 1,)`` of each participant's states; the first of them is always marked.
        x: ``(S,)`` [m].
        y: ``(S,)`` [m].
        apart: least distance [m].
        out: ``(S,)``.
    """
    for p in range(len(first) - 1):
        last = first[p]
        for k in range(first[p], first[p + 1]):
            out[k] = k == last or elementary.hypot(x[k] - x[last], y[k] - y[last]) >= apart
            if out[k]:
                last = k


@kernel
def passed(x: Float, y: Float, a: int, b: int, share: float) -> float:
    """Return when a body passes a point of the chord from state a to b, as a place among states.

    It is the last time, should it stop there.
    """
    ux, uy = x[b] - x[a], y[b] - y[a]
    wanted = share * (ux * ux + uy * uy)
    for k in range(b - 1, a - 1, -1):
        here = (x[k] - x[a]) * ux + (y[k] - y[a]) * uy
        if here <= wanted:
            onward = (x[k + 1] - x[a]) * ux + (y[k + 1] - y[a]) * uy
            return float(k + (wanted - here) / max(onward - here, 1e-12))
    return float(a)


@kernel
def mark_crossings(
    cells: Int, first: Int, row: int, who: Int, a: Int, b: Int, x: Float, y: Float, instant: Int,
    role: Int, window: float, least_sine: float, pairs: Int, times: Float,
) -> int:  # fmt: skip
    """Write where pieces of two paths cross, and when each is passed there.

    Args:
        cells: ``(C,)`` numbers of the cells with pieces, increasing; the next row is ``row`` on.
        first: ``(C + 1,)`` where each cell's pieces begin; they are sorted by their end.
        row: see ``cells``.
        who: ``(K,)`` participant of each piece.
        a: ``(K,)`` state at which it begins.
        b: ``(K,)`` state at which it ends.
        x: ``(S,)`` [m].
        y: ``(S,)`` [m].
        instant: ``(S,)``.
        role: ``(P,)`` 0: takes no part; 1: motor vehicle; 2: others, which do not meet each other.
        window: longest time between the two [time steps].
        least_sine: of the angle between them.
        pairs: ``(M, 2)`` takes the participants, the lesser number first; what exceeds it is
            counted, not written.
        times: ``(M, 2)`` takes the instants.

    Returns:
        How many there are.
    """
    count = 0
    for c in range(len(cells)):
        for near in range(9):
            key = cells[c] + (near // 3 - 1) * row + near % 3 - 1
            n = np.searchsorted(cells, key)
            if n == len(cells) or cells[n] != key:
                continue
            for k in range(first[c], first[c + 1]):
                p = who[k]
                if role[p] == 0:
                    continue
                low, high = first[n], first[n + 1]
                begin = instant[a[k]] - window
                while low < high:
                    middle = (low + high) // 2
                    if instant[b[middle]] < begin:
                        low = middle + 1
                    else:
                        high = middle
                ux, uy = x[b[k]] - x[a[k]], y[b[k]] - y[a[k]]
                for j in range(low, first[n + 1]):
                    if instant[b[j]] > instant[b[k]] + window:
                        break
                    q = who[j]
                    if p == q or role[q] == 0 or role[p] + role[q] > 3:
                        continue
                    vx, vy = x[b[j]] - x[a[j]], y[b[j]] - y[a[j]]
                    cross = ux * vy - uy * vx
                    if abs(cross) < least_sine * elementary.hypot(ux, uy) * elementary.hypot(
                        vx, vy
                    ):
                        continue
                    dx, dy = x[a[j]] - x[a[k]], y[a[j]] - y[a[k]]
                    item, other = (dx * vy - dy * vx) / cross, (dx * uy - dy * ux) / cross
                    if not (0.0 <= item <= 1.0 and 0.0 <= other <= 1.0):
                        continue
                    at_one = passed(x, y, a[k], b[k], item) - a[k] + instant[a[k]]
                    at_other = passed(x, y, a[j], b[j], other) - a[j] + instant[a[j]]
                    if abs(at_one - at_other) > window:
                        continue
                    if count < len(pairs):
                        if p < q:
                            pairs[count, 0], pairs[count, 1] = p, q
                            times[count, 0], times[count, 1] = at_one, at_other
                        else:
                            pairs[count, 0], pairs[count, 1] = q, p
                            times[count, 0], times[count, 1] = at_other, at_one
                    count += 1
    return count
