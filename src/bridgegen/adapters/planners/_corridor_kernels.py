"""The nearest place on a polyline."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel


@kernel
def place(points, directions, lengths, x, y):
    """Return (piece, distance along it [m], offset to the left [m]) of the nearest place.

    The first and the last piece go on beyond the polyline's ends.

    Args:
        points: ``(K + 1, 2)`` [m].
        directions: ``(K, 2)``, unit vectors.
        lengths: ``(K,)`` [m].
        x: of the point [m].
        y: of the point [m].
    """
    n = len(lengths)
    nearest, along, left, least = 0, 0.0, 0.0, math.inf
    for k in range(n):
        dx, dy = x - points[k, 0], y - points[k, 1]
        u = dx * directions[k, 0] + dy * directions[k, 1]
        foot = u
        if k > 0:
            foot = max(foot, 0.0)
        if k < n - 1:
            foot = min(foot, lengths[k])
        aside = dy * directions[k, 0] - dx * directions[k, 1]
        distance = aside * aside + (u - foot) * (u - foot)
        if distance < least:
            nearest, along, left, least = k, foot, aside, distance
    return nearest, along, left


@kernel
def places(points, directions, lengths, x, y, found):
    """Fill ``(Q, 3)`` with what `place` returns for Q points."""
    for q in range(len(x)):
        k, along, left = place(points, directions, lengths, x[q], y[q])
        found[q, 0], found[q, 1], found[q, 2] = k, along, left
