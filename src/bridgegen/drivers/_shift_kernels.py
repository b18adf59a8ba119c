"""The ego's course beside its route: its offset, and how that changes.

A shift is four numbers: an offset to the left of the route [m], the one that follows, the station
where the change begins, and its length [m]. Between them is a quintic whose slope and bend are 0 at
both ends.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import pose

UNSHIFTED = (0.0, 0.0, 0.0, 0.0)

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
    dx, dy = gx - aside * math.sin(gh) - x, gy + aside * math.cos(gh) - y
    left = -math.sin(h) * dx + math.cos(h) * dy
    return 2.0 * left / max(dx * dx + dy * dy, 1e-6)
