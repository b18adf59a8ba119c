"""Reading a path: a lane's centre line sampled at a uniform step.

A path is ``(L, 6)`` float64: x, y [m], heading [rad], its cosine and sine, curvature [1/m]; of
its L rows the first n are real, and row i is at station i · ds.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel

X, Y, H, COS, SIN, CURVATURE = 0, 1, 2, 3, 4, 5


@kernel
def locate(n, ds, s):
    """Return (i, f): station s lies at the fraction f between rows i and i + 1."""
    u = s / ds
    i = int(u)
    if i < 0:
        i = 0
    elif i > n - 2:
        i = n - 2
    return i, u - i


@kernel
def pose(path, n, ds, s):
    """Return (x, y, heading) at station s; beyond the ends, on the tangent."""
    i, f = locate(n, ds, s)
    return (
        path[i, X] + f * (path[i + 1, X] - path[i, X]),
        path[i, Y] + f * (path[i + 1, Y] - path[i, Y]),
        path[i, H] + f * (path[i + 1, H] - path[i, H]),
    )


@kernel
def project(path, n, ds, s, x, y):
    """Return (station, offset) of a point's foot on the path near station s; left is positive.

    Newton's method on the tangent's dot product; two steps from the previous instant's foot are
    exact to a micrometre at driving speeds.
    """
    d = 0.0
    for _ in range(2):
        i, f = locate(n, ds, s)
        c = path[i, COS] + f * (path[i + 1, COS] - path[i, COS])
        t = path[i, SIN] + f * (path[i + 1, SIN] - path[i, SIN])
        px = x - (path[i, X] + f * (path[i + 1, X] - path[i, X]))
        py = y - (path[i, Y] + f * (path[i + 1, Y] - path[i, Y]))
        curvature = path[i, CURVATURE]
        d = py * c - px * t
        # The foot moves slower than the point outside of a bend, faster inside.
        s += (px * c + py * t) / max(1.0 - curvature * d, 0.2)
    length = (n - 1) * ds
    return min(max(s, 0.0), length), d


@kernel
def shrinks(path, n, ds, s, d):
    """Return the distance travelled at an offset d to the left [m] per metre of the path.

    Below 1 in left bends. At least 0.2, as in ``project``: beyond a bend's centre the motion does
    not reverse.
    """
    i, _ = locate(n, ds, s)
    return max(1.0 - path[i, CURVATURE] * d, 0.2)


@kernel
def pursue(path, n, ds, s, x, y, h, distance):
    """Return the curvature [1/m] of the circle through the rear axle and a point ahead.

    Source: R. C. Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm, 1992.
    """
    gx, gy, _ = pose(path, n, ds, s + distance)
    dx, dy = gx - x, gy - y
    left = -math.sin(h) * dx + math.cos(h) * dy
    return 2.0 * left / max(dx * dx + dy * dy, 1e-6)
