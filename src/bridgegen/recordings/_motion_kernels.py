"""Headings of bodies whose fronts are known; compiled, raises nothing."""

import math

import numpy as np

from bridgegen.arrays import Float, Int
from bridgegen.compiled import kernel

BEGIN = 1.0
"""A track's first direction is that to the first state this far away [m]."""


@kernel
def headings_of_fronts(x: Float, y: Float, first: Int, arm: Float) -> Float:
    """Return headings [rad] of bodies whose rear axles follow their fronts.

    The rear axle moves towards the front at all times, so that its path is the tractrix of the
    front's. Between two states the front goes straight on by d along φ, and tan((θ − φ)/2) falls by
    the factor exp(−d/arm).

    Args:
        x: ``(S,)`` of the front's middle [m].
        y: ``(S,)`` likewise.
        first: ``(P + 1,)`` the states of participant p are ``first[p]:first[p + 1]``.
        arm: ``(P,)`` from the rear axle to the front [m], above 0.
    """
    found = np.zeros(len(x))
    for p in range(len(first) - 1):
        begin, end = first[p], first[p + 1]
        heading = 0.0
        for k in range(begin + 1, end):
            dx, dy = x[k] - x[begin], y[k] - y[begin]
            if dx * dx + dy * dy >= BEGIN * BEGIN:
                heading = math.atan2(dy, dx)
                break
        for k in range(begin, end):
            if k > begin:
                dx, dy = x[k] - x[k - 1], y[k] - y[k - 1]
                step = math.hypot(dx, dy)
                if step > 0.0:
                    course = math.atan2(dy, dx)
                    half = math.tan(0.5 * (heading - course)) * math.exp(-step / arm[p])
                    heading = course + 2.0 * math.atan(half)
            found[k] = heading
    return found
