"""Each track relative to the ego's route: station, offset and motion.

``around`` ``(E, AROUND)`` has a row per track; following, avoidance and caution read it.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import COS, SIN, X, Y, project
from bridgegen.drivers._tracking_kernels import AGE, CONFIRMED, LENGTH, STATE, VX, VY, WIDTH, H
from bridgegen.drivers._tracking_kernels import X as TRACK_X
from bridgegen.drivers._tracking_kernels import Y as TRACK_Y

NEAR = 0  # 1 where the rest of the row counts: confirmed, and within reach of the route ahead
AT, ASIDE = 1, 2  # m, station of the box's centre, and how far left of the route it is
ALONG, ACROSS = 3, 4  # m/s, its velocity along the route and to the left of it
HALF_LENGTH, HALF_WIDTH = 5, 6  # m, how far the turned box reaches along and across
COSINE = 7  # of the angle between its heading and the route's
GAINING = 8  # m/s², how its speed along the route has changed lately, smoothed
PACE = 9  # m/s, 1 more than its speed; 0 until it is known
QUICKENING = 10  # m/s², how its speed has changed lately, smoothed
AROUND = 11

MEMORY_OF_GAIN = 0.3  # s, over which changes of speed are smoothed
SETTLED = 1.0  # s, after which a track's speed is good enough to see it change

BEHIND = 15.0  # m, how far back it looks at least
REACH = 25.0  # m, how far to the side
COARSE = 3.0  # m, between the points of the route that are tried first


@kernel
def surround(path, n, ds, s, behind, ahead, elapsed, tracks, around):
    """Fill ``around``.

    ``behind`` and ``ahead`` [m] are how far along its route from s the ego looks; ``elapsed``
    [s] is the time since the last call.
    """
    share = 1.0 - elementary.exp(-elapsed / MEMORY_OF_GAIN)
    stride = max(int(COARSE / ds), 1)
    first = max(int((s - behind) / ds), 0)
    last = min(int((s + ahead) / ds) + stride, n - 1)
    middle = min(max(int((s + 0.5 * (ahead - behind)) / ds), 0), n - 1)
    mx, my = path[middle, X], path[middle, Y]
    widest = 0.5 * (ahead + behind) + REACH
    for e in range(1, tracks.shape[0]):
        was_near = around[e, NEAR] > 0.0
        around[e, NEAR] = 0.0
        if tracks[e, STATE] < CONFIRMED:
            around[e, PACE] = around[e, QUICKENING] = 0.0
            continue
        pace = 1.0 + elementary.hypot(tracks[e, VX], tracks[e, VY])
        if around[e, PACE] > 0.0 and tracks[e, AGE] > SETTLED:
            gain = (pace - around[e, PACE]) / elapsed
            around[e, QUICKENING] += share * (gain - around[e, QUICKENING])
        around[e, PACE] = pace
        x, y = tracks[e, TRACK_X], tracks[e, TRACK_Y]
        if (x - mx) ** 2 + (y - my) ** 2 > widest * widest:
            continue
        # All points are tried. To leap over those that cannot be nearest, by the triangle
        # inequality, saved nothing: those before the nearest must be visited all the same.
        nearest, at = math.inf, first
        for i in range(first, last + 1, stride):
            gap = (path[i, X] - x) ** 2 + (path[i, Y] - y) ** 2
            if gap < nearest:
                nearest, at = gap, i
        if nearest > (REACH + COARSE) ** 2:
            continue
        foot, d = project(path, n, ds, at * ds, x, y)
        i = min(int(foot / ds), n - 1)
        c, t = path[i, COS], path[i, SIN]
        cosine = elementary.cos(tracks[e, H]) * c + elementary.sin(tracks[e, H]) * t
        sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
        length, width = tracks[e, LENGTH], tracks[e, WIDTH]
        around[e, NEAR] = 1.0
        around[e, AT], around[e, ASIDE] = foot, d
        along = tracks[e, VX] * c + tracks[e, VY] * t
        if was_near:
            gain = (along - around[e, ALONG]) / elapsed
            around[e, GAINING] += share * (gain - around[e, GAINING])
        else:
            around[e, GAINING] = 0.0
        around[e, ALONG] = along
        around[e, ACROSS] = tracks[e, VY] * c - tracks[e, VX] * t
        around[e, HALF_LENGTH] = 0.5 * (length * abs(cosine) + width * sine)
        around[e, HALF_WIDTH] = 0.5 * (length * sine + width * abs(cosine))
        around[e, COSINE] = cosine
