"""Intervals of shares, and of how much a change lowers one in the same scenarios."""

import math

from bridgegen.search.regions.evidence import wilson


def paired_drop(both: int, gone: int, new: int, neither: int) -> tuple[float, float, float]:
    """Return by how much a share drops between two measurements of the same n cases.

    Args:
        both: cases with the property before and after.
        gone: before only.
        new: after only.
        neither: neither before nor after.

    Returns:
        The drop (gone − new) / n, and its 95 % interval; (0, −1, 1) without cases.

    Source: R. G. Newcombe, Improved confidence intervals for the difference between binomial
    proportions based on paired data, Statistics in Medicine 17 (1998), 2635-2650, method 10.
    """
    n = both + gone + new + neither
    if not n:
        return 0.0, -1.0, 1.0
    before, after = both + gone, both + new
    p, q = before / n, after / n
    low_p, high_p = wilson(before, n)
    low_q, high_q = wilson(after, n)
    phi = _phi(both, gone, new, neither)
    drop = (gone - new) / n

    def reach(a: float, b: float) -> float:
        return math.sqrt(max(0.0, a * a - 2.0 * phi * a * b + b * b))

    low = drop - reach(p - low_p, high_q - q)
    high = drop + reach(high_p - p, q - low_q)
    return drop, max(-1.0, low), min(1.0, high)


def _phi(a: int, b: int, c: int, d: int) -> float:
    """Return the continuity-corrected correlation of the two measurements; see the source."""
    product = (a + b) * (c + d) * (a + c) * (b + d)
    if not product:
        return 0.0
    excess, n = a * d - b * c, a + b + c + d
    if excess > 0:
        excess_corrected = max(excess - n / 2.0, 0.0)
        return excess_corrected / math.sqrt(product)
    return excess / math.sqrt(product)
