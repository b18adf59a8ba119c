"""Uniform B-splines: the knots by which a curve begins at its first point and ends at its last.

Source: Piegl, Tiller, The NURBS Book (2nd edition, Springer 1997), section 2.4.
"""

from collections.abc import Sequence


def uniform_knots(order: int, points: int) -> tuple[float, ...]:
    """Return the knots of a clamped uniform B-spline.

    Args:
        order: degree plus 1; at least 2.
        points: how many control points it has; at least ``order``.

    Returns:
        ``order + points`` whole numbers, from 0 on, not decreasing.
    """
    last = points - order + 1
    return tuple(float(min(max(i - order + 1, 0), last)) for i in range(order + points))


def is_uniform(knots: Sequence[float], order: int) -> bool:
    """Return whether knots are those of a clamped uniform B-spline, but for origin and scale."""
    usual = uniform_knots(order, len(knots) - order)
    span = knots[-1] - knots[0]
    return span > 0.0 and all(
        abs((knot - knots[0]) / span - one / usual[-1]) < 1e-9
        for knot, one in zip(knots, usual, strict=True)
    )
