"""Compiled post-encroachment time; public wrapper: ``pet.pet``."""

import math

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel


@kernel
def separation(
    dx: float, dy: float, ca: float, sa: float, cb: float, sb: float,
    la: float, wa: float, lb: float, wb: float,
) -> float:  # fmt: skip
    """Return the widest gap [m] between boxes A and B over their four axes; ≤ 0 if they touch.

    (dx, dy) leads from A's centre to B's. Their distance is no less.
    """
    c = abs(ca * cb + sa * sb)
    s = abs(ca * sb - sa * cb)
    one = max(
        abs(dx * ca + dy * sa) - (la + (c * lb + s * wb)),
        abs(dy * ca - dx * sa) - (wa + (s * lb + c * wb)),
    )
    other = max(
        abs(dx * cb + dy * sb) - (lb + (c * la + s * wa)),
        abs(dy * cb - dx * sb) - (wb + (s * la + c * wa)),
    )
    return max(one, other)


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
    half: Float, x: Float, y: Float, c: Float, s: Float, distance: Float, e: int, n: int,
    best: int,
) -> int:  # fmt: skip
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
                        x[e, j] - x[0, i], y[e, j] - y[0, i],
                        c[0, i], s[0, i], c[e, j], s[e, j], la, wa, lb, wb,
                    )  # fmt: skip
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
    half: Float, x: Float, y: Float, cosine: Float, sine: Float, distance: Float, n_steps: Int,
    longest: int, out: Float,
) -> None:  # fmt: skip
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
