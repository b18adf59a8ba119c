"""Numbers in bulk, rounded to what a screen can show; NaN and infinity become None."""

import math

import numpy as np

from bridgegen.base.arrays import Float

DIGITS = 5
"""Significant digits of the largest value of a column in bulk."""


def significant(values: Float, digits: int = DIGITS) -> list[float | None]:
    """Round to ``digits`` significant digits of the largest finite magnitude."""
    finite = np.abs(values[np.isfinite(values)])
    top = float(finite.max()) if finite.size else 0.0
    if top == 0.0:
        return decimals(values, 0)
    return decimals(values, digits - 1 - math.floor(math.log10(top)))


def decimals(values: Float, places: int) -> list[float | None]:
    """Round to decimal places; None if not finite, and no negative zero."""
    with np.errstate(over="ignore", invalid="ignore"):
        rounded = np.round(values, min(places, 300)) + 0.0  # 10**300: the last that float64 holds
    kept = np.where(np.isfinite(rounded), rounded, values)
    if np.isfinite(kept).all():
        return kept.tolist()  # type: ignore[no-any-return]
    return [value if math.isfinite(value) else None for value in kept.tolist()]
