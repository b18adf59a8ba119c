"""How bodies move across their path while they move along it.

A body's speed is along the line that it draws: what it moves sideways, it does not move ahead, and
a body that stands does not slide. A body with wheels needs some metres of road to change its lane,
however long the change may take: it moves across no faster than its steering allows.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.simulation.embedded._motion_kernels import (
    CUBIC,
    DISTANCE,
    LINEAR,
    RATE,
    SINUSOIDAL,
    STEP,
    progress,
)

SLOWEST = 1e-6  # m, a step shorter than this is none


@kernel
def lane_change_lasts(shape, dimension, value, metres):
    """Return over which time [s] or distance [m] a change of lane goes; 0: at once.

    A rate [m/s] is that of the steepest place of the shape.
    """
    if shape == STEP:
        return 0.0
    if dimension != RATE:
        return value
    steepest = 1.0
    if shape == CUBIC:
        steepest = 1.5
    elif shape == SINUSOIDAL:
        steepest = 0.5 * math.pi
    return steepest * abs(metres) / value if value > 0.0 else math.inf


@kernel
def offset_lasts(shape, most, metres):
    """Return how long [s] a move aside takes that must not exceed a lateral acceleration [m/s²].

    The shapes' second derivatives at their ends: 6/T² and pi²/(2·T²) of the way. A linear one
    would need an infinite acceleration; it takes as long as a cubic one.
    """
    if shape == STEP or most == math.inf:
        return 0.0
    if shape == SINUSOIDAL:
        return math.pi * math.sqrt(abs(metres) / (2.0 * most))
    return math.sqrt(6.0 * abs(metres) / most)


@kernel
def least_length(shape, curvature, metres):
    """Return how many metres of road a body with wheels at full lock needs to move across [m].

    The steepest bend of a shape over a length L is 6/L² (cubic) or pi²/(2·L²) (sinusoidal) of the
    lateral distance, as in ``offset_lasts``; a linear one, which has kinks, is as long as a cubic.
    0 for bodies that can move sideways (infinite curvature).
    """
    if curvature == math.inf:
        return 0.0
    return offset_lasts(shape, curvature, metres)


@kernel
def glide(shape, dimension, lasts, passed, origin, target, step, dt, curvature):
    """Return (aside, ahead, passed, tilt) of a body one step on, on its way across.

    Where a body with wheels is too slow for the time that the change is to take, it goes by
    distance over ``least_length``, and the change takes longer.

    Args:
        shape: of the change.
        dimension: what it goes by, time or distance along the path.
        lasts: the time [s] or distance [m] of the whole change.
        passed: what of it has passed.
        origin: how far left of the path it began [m].
        target: how far left of the path it ends [m].
        step: how far the body moves [m], ≥ 0.
        dt: [s].
        curvature: of its path at full lock [1/m]; inf: it can go sideways.

    Returns:
        how far left of the path it is then, how far along the path it has come [m], what has
        passed, and by how much its nose is turned from the path's direction [rad].
    """
    if lasts <= 0.0:
        return target, step, passed, 0.0
    span = target - origin
    before = origin + span * progress(shape, passed / lasts)[0]
    if dimension == DISTANCE and (step > SLOWEST or curvature == math.inf):
        if step <= SLOWEST:
            return before, 0.0, passed, 0.0
        return _by_distance(shape, lasts, passed, origin, span, before, step)
    # A bus at 1 m/s would stand across the road at 90° if it were across in the time asked for.
    # Where the speed is enough, nothing changes, to the bit.
    length = least_length(shape, curvature, span)
    if step <= SLOWEST:
        if length == 0.0 or passed <= 0.0:
            return before, 0.0, passed, 0.0
        length = max(length, lasts) if dimension == DISTANCE else length
        return (
            before,
            0.0,
            passed,
            elementary.atan(span * progress(shape, passed / lasts)[1] / length),
        )
    share, slope = progress(shape, (passed + dt) / lasts)
    across = origin + span * share - before
    if length > 0.0:
        forward = math.sqrt(max(step * step - across * across, 0.0))
        if forward * lasts < length * dt:  # too slow to be across in time
            aside, ahead, come, tilt = _by_distance(
                shape, length, passed / lasts * length, origin, span, before, step
            )
            return aside, ahead, lasts if come >= length else come / length * lasts, tilt
    if abs(across) >= step:  # faster than it moves: straight across, as fast as it can
        moved = math.copysign(step, across)
        if (target - before - moved) * span <= 0.0:
            return target, 0.0, lasts, 0.0
        share = (before + moved - origin) / span
        return (
            before + moved,
            0.0,
            lasts * inverse(shape, share),
            math.copysign(0.5 * math.pi, across),
        )
    passed = min(passed + dt, lasts)
    sideways = span * slope / lasts * dt
    ahead = math.sqrt(step * step - across * across)
    tilt = elementary.asin(min(max(sideways / step, -1.0), 1.0))
    return origin + span * share, ahead, passed, tilt


@kernel
def _by_distance(shape, lasts, passed, origin, span, before, step):
    """Do what ``glide`` does, of a change that goes by the distance along the path."""
    ahead = step
    share, slope = progress(shape, (passed + ahead) / lasts)
    for _ in range(3):  # towards ahead² + across² = step²
        across = origin + span * share - before
        ahead = step / math.sqrt(1.0 + (across / ahead) ** 2)
        share, slope = progress(shape, (passed + ahead) / lasts)
    passed = min(passed + ahead, lasts)
    return origin + span * share, ahead, passed, elementary.atan(span * slope / lasts)


@kernel
def inverse(shape, share):
    """Return at which share of its time a change has come so far (bisection)."""
    if shape == LINEAR:
        return share
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if progress(shape, middle)[0] < share:
            low = middle
        else:
            high = middle
    return low


@kernel
def approach(left, speed, most_speed, most_acceleration, most_deceleration, dt):
    """Return (way across [m], speed across [m/s]) of a body that closes a distance across its path.

    As fast as its limits let it, so that it can stop where nothing is left: after a step at v a
    deceleration d takes it v²/(2·d) farther, so v·dt + v²/(2·d) is what is left at most.
    """
    wanted = min(most_speed, abs(left) / dt)
    if most_deceleration < math.inf:
        # The root of v·dt + v²/(2·d) = |left|.
        least = most_deceleration * dt
        stops = math.sqrt(least * least + 2.0 * most_deceleration * abs(left)) - least
        wanted = min(wanted, stops)
    wanted = math.copysign(wanted, left)
    change = (most_acceleration if abs(wanted) > abs(speed) else most_deceleration) * dt
    speed += min(max(wanted - speed, -change), change)
    return speed * dt, speed
