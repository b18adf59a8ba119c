"""Speed that the road allows: limits, bends, and sight."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._following_kernels import COMFORT_DECELERATION
from bridgegen.drivers._path_kernels import CURVATURE

LIMIT = 0  # column of the road ahead: the speed limit [m/s], +inf if none is posted
LEFT, RIGHT = 1, 2  # m, to the centre of the adjacent lane of the same direction; 0: none
ROAD = 3

STRAIGHT = 1e-4  # 1/m, up to which a curvature is no bend

LATERAL_COMFORT = 3.0  # m/s², in bends; drivers keep below 4 (UN R79 annex 3 allows 3)
FRICTION_SHARE = 0.6  # of the friction limit that it plans to use in a bend
SCAN_STEP = 1.0  # m, between the points of its route that it looks at
REACTION = 0.5  # s, from seeing to braking: perception, confirmation, build-up
SIGHT_SHARE = 0.7  # of the friction limit with which it could stop within what it sees
SIGHT_MARGIN = 3.0  # m, left then
FAST_ROAD = 17.0  # m/s; above this limit pedestrians are excluded (60 km/h; StVO § 18 Abs. 1)


@kernel
def scan_length(v):
    """Return how far ahead [m] the driver looks: to stop comfortably, and a reaction more."""
    return 12.0 + 1.5 * v + v * v / (2.0 * COMFORT_DECELERATION)


@kernel
def bend_speed(path, bends, n, ds, s, v, target, friction_limit):
    """Return the speed [m/s] that the bends ahead allow, at most ``target``.

    ``bends`` ``(L,)`` is the first row from each on that is in a bend: what is straight is skipped.
    """
    lateral = min(LATERAL_COMFORT, FRICTION_SHARE * friction_limit)
    stride = max(int(SCAN_STEP / ds), 1)
    first = min(int(s / ds), n - 1)
    last = min(n - 1, first + int(scan_length(v) / ds))
    best = target * target
    i = first
    while i < last:
        bend = abs(path[i, CURVATURE])
        if bend > STRAIGHT:
            best = min(best, lateral / bend + 2.0 * COMFORT_DECELERATION * max(i * ds - s, 0.0))
            i += stride
        else:
            # By whole strides, so that the points that are looked at are those of a walk over every
            # metre, and the bits, too. At 130 km/h that walk was 390 m long.
            i += -(-max(bends[i] - i, 1) // stride) * stride
    return math.sqrt(best)


@kernel
def limit_speed(road, drops, n, ds, s, v):
    """Return the speed [m/s] that the limits here and ahead allow; +inf if there are none.

    ``drops`` ``(L,)`` is the first row after each with a lower limit: no other matters before it.
    """
    stride = max(int(SCAN_STEP / ds), 1)
    first = min(int(s / ds), n - 1)
    last = min(n - 1, first + int(scan_length(v) / ds))
    best = road[first, LIMIT] * road[first, LIMIT]
    i = first + -(-(drops[first] - first) // stride) * stride
    while i < last:
        ahead = 2.0 * COMFORT_DECELERATION * max(i * ds - s, 0.0)
        best = min(best, road[i, LIMIT] * road[i, LIMIT] + ahead)
        i += stride
    return math.sqrt(best)


@kernel
def sight_speed(sight, friction_limit):
    """Return the speed [m/s] from which the ego can stop within what it sees [m]."""
    b = SIGHT_SHARE * friction_limit
    within = max(sight - SIGHT_MARGIN, 0.0)
    return math.sqrt(b * b * REACTION * REACTION + 2.0 * b * within) - b * REACTION
