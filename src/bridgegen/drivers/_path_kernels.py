"""Reading a path: a lane's centre line sampled at a uniform step.

A path is ``(L, 6)`` float64: x, y [m], heading [rad], its cosine and sine, curvature [1/m]; of
its L rows the first n are real, and row i is at station i · ds.
"""

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


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
    left = -elementary.sin(h) * dx + elementary.cos(h) * dy
    return 2.0 * left / max(dx * dx + dy * dy, 1e-6)


# --- Polylines of the map in the egos' frames ---


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@kernel
def gather_points(at, counts, pieces, directions, x, y, cosine, sine, points, mask):
    """Fill ``points`` ``(N, Q, V, 4)`` and ``mask`` ``(N, Q, V)``, which are zeros.

    ``at`` ``(N, Q)`` are rows of ``pieces`` ``(K, V, 3)`` and of ``directions`` ``(K, V, 2)``, the
    first ``counts`` ``(K,)`` points of which count; the ego of row i is at x, y with a heading.
    """
    for i in range(at.shape[0]):
        c, s = cosine[i], sine[i]
        for q in range(at.shape[1]):
            k = at[i, q]
            for j in range(counts[k]):
                dx, dy = pieces[k, j, 0] - x[i], pieces[k, j, 1] - y[i]
                u, w = directions[k, j, 0], directions[k, j, 1]
                points[i, q, j, 0], points[i, q, j, 1] = dx * c + dy * s, dy * c - dx * s
                points[i, q, j, 2], points[i, q, j, 3] = u * c + w * s, w * c - u * s
                mask[i, q, j] = True


# --- The ego's course beside its route: its offset, and how that changes ---
# A shift is four numbers: an offset to the left of the route [m], the one that follows, the station
# where the change begins, and its length [m]. Between them is a quintic whose slope and bend are 0
# at both ends.


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


UNSHIFTED = (0.0, 0.0, 0.0, 0.0)
BEFORE, AFTER, BEGINS, LENGTH = range(4)  # of a shift in an array

LATERAL_COMFORT = 1.0  # m/s², aside of the lane's own bend; source: UN R79, ACSF category C: 1 m/s²
LATERAL_SHARE = 0.15  # of the friction limit that a change may use
SPARE = 1.5  # as much lateral acceleration as was planned, if it speeds up meanwhile
STEEPEST = 5.7735  # 10/√3: the quintic's greatest second derivative for a change of 1 over 1
SHARPEST = 0.08  # 1/m, the curvature that it plans with at a crawl


@kernel
def aside_at(shift, s):
    """Return how far left of the route the ego's centre line is at a station [m]."""
    before, after, begins, length = shift
    if before == after or s >= begins + length:
        return after
    if s <= begins:
        return before
    u = (s - begins) / length
    return before + (after - before) * u * u * u * (10.0 + u * (6.0 * u - 15.0))


@kernel
def shift_length(across, v, friction_limit):
    """Return the length [m] over which one moves so far across comfortably, at a speed v [m/s]."""
    lateral = min(LATERAL_COMFORT, LATERAL_SHARE * friction_limit)
    bend = STEEPEST * abs(across)
    return max(v * math.sqrt(bend / lateral), math.sqrt(bend / SHARPEST))


@kernel
def shift_speed(shift, s, friction_limit):
    """Return the speed [m/s] that the shift allows at a station; +inf where it is over."""
    before, after, begins, length = shift
    if before == after or s >= begins + length:
        return math.inf
    lateral = SPARE * min(LATERAL_COMFORT, LATERAL_SHARE * friction_limit)
    return length * math.sqrt(lateral / (STEEPEST * abs(after - before)))


@kernel
def pursue_beside(path, n, ds, s, shift, x, y, h, distance):
    """Return the curvature [1/m] of the circle through the rear axle and a point of the course.

    As `bridgegen.drivers._path_kernels.pursue`, on a course that is shifted from the route.
    """
    gx, gy, gh = pose(path, n, ds, s + distance)
    aside = aside_at(shift, s + distance)
    dx, dy = gx - aside * elementary.sin(gh) - x, gy + aside * elementary.cos(gh) - y
    left = -elementary.sin(h) * dx + elementary.cos(h) * dy
    return 2.0 * left / max(dx * dx + dy * dy, 1e-6)
