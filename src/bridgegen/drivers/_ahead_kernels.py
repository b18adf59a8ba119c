"""Which vehicles drive on the ego's way, ahead of it, or beside it and may come in.

Only what goes the ego's way counts, or stands along it: crossing and oncoming traffic has no place
in the disturbances of UN Regulation 157.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._conflict_kernels import SAME_WAY, STANDS, foot_on_way
from bridgegen.drivers._path_kernels import COS, SIN


@kernel
def place_on_way(path, n, ds, s, reach, own, x, y, h, w, other):
    """Return (ahead, gap, aside, side, along) of a body beside the ego's way; ahead +inf: none.

    The ego, body ``own``, is at station ``s`` [m] of its path, ``n`` rows ``ds`` [m] apart. The
    other's reference point is at (``x``, ``y``, ``h``) [m, rad]; it goes at speed ``w`` [m/s].
    ``ahead`` is the distance of the centres along the way, ``gap`` that of the bumpers, < 0 if they
    are beside each other; ``aside`` is the distance of the other's centre from the way, ``side``
    that of the bodies across it, <= 0 if the other is on the strip that the ego sweeps [m];
    ``along`` is the other's speed on the way [m/s]. A body that neither goes the ego's way nor
    stands along it has no place, and none is farther than ``reach`` [m].
    """
    cx, cy = x + other[2] * elementary.cos(h), y + other[2] * elementary.sin(h)
    station, offset = foot_on_way(path, n, ds, s, reach, cx, cy)
    if offset == math.inf:
        return math.inf, math.inf, math.inf, math.inf, 0.0
    i = min(int(station / ds), n - 1)
    cosine = elementary.cos(h) * path[i, COS] + elementary.sin(h) * path[i, SIN]
    stands = w < STANDS
    if (abs(cosine) if stands else cosine) <= SAME_WAY:
        return math.inf, math.inf, math.inf, math.inf, 0.0
    across = math.sqrt(max(1.0 - cosine * cosine, 0.0))
    length = other[0] * abs(cosine) + other[1] * across  # as the way sees it
    width = other[0] * across + other[1] * abs(cosine)
    ahead, aside = station - s - own[2], abs(offset)
    along = 0.0 if stands else w * cosine
    return ahead, ahead - 0.5 * (own[0] + length), aside, aside - 0.5 * (own[1] + width), along
