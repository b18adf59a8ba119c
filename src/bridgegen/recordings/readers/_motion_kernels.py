"""Headings of bodies on wheels, of whose motion one point is known; compiled, raises nothing."""

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel


@kernel
def following_headings(course: Float, way: Float, first: Int, arm: Float, begin: Float) -> Float:
    """Return headings [rad] of bodies whose rear axles follow a point ahead of them.

    The rear axle moves towards the point at all times, so that its path is the tractrix of the
    point's. Where the point goes straight on by d along φ, tan((θ − φ)/2) falls by the factor
    exp(−d/arm).

    Args:
        course: ``(S,)`` of the point, on its way from the state before [rad].
        way: ``(S,)`` how far it went since then [m].
        first: ``(P + 1,)`` the states of participant p are ``first[p]:first[p + 1]``.
        arm: ``(P,)`` from the rear axle to the point [m], above 0.
        begin: ``(P,)`` heading of the first state [rad].
    """
    found = np.zeros(len(course))
    for p in range(len(first) - 1):
        heading = begin[p]
        for k in range(first[p], first[p + 1]):
            if k > first[p] and way[k] > 0.0:
                half = elementary.tan(0.5 * (heading - course[k])) * elementary.exp(
                    -way[k] / arm[p]
                )
                heading = course[k] + 2.0 * elementary.atan(half)
            found[k] = heading
    return found
