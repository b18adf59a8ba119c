"""NURBS: the weights by which control points give the points of a curve.

Source: Piegl, Tiller, The NURBS Book (2nd edition, Springer 1997), equations 2.5 and 4.1.
"""

from collections.abc import Sequence

import numpy as np

from bridgegen.base.arrays import Float


def basis(order: int, knots: Sequence[float], weights: Sequence[float], count: int) -> Float:
    """Return by which weights control points give points that are spread evenly over the knots.

    Args:
        order: degree plus 1.
        knots: as many as control points and the order together, not decreasing.
        weights: of the control points, > 0.
        count: of points, the two ends among them.

    Returns:
        ``(count, control points)`` float64; each row adds up to 1, or is NaN where the knots leave
        a gap.
    """
    knot, degree, n = np.asarray(knots, dtype=np.float64), order - 1, len(weights)
    u = np.linspace(knot[degree], knot[n], count)
    span = np.clip(np.searchsorted(knot, u, side="right") - 1, degree, n - 1)
    functions = np.zeros((count, len(knot) - 1))
    functions[np.arange(count), span] = 1.0
    for p in range(1, order):
        for i in range(len(knot) - 1 - p):
            rising, falling = knot[i + p] - knot[i], knot[i + p + 1] - knot[i + 1]
            left = (u - knot[i]) / rising * functions[:, i] if rising > 0.0 else 0.0
            right = (knot[i + p + 1] - u) / falling * functions[:, i + 1] if falling > 0.0 else 0.0
            functions[:, i] = left + right
    rational = functions[:, :n] * np.asarray(weights)
    with np.errstate(invalid="ignore"):
        made: Float = rational / rational.sum(axis=1, keepdims=True)
    return made
