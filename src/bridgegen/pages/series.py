"""Compact time series: rounded second differences.

A series is its runs of finite values, each ``[first instant, length, value, difference, second
differences …]`` in whole units of 1/scale; second differences of 0 at the end are left out. Smooth
motion has small ones, standstill none. ``series.js`` reads them.
"""

import math

import numpy as np

from bridgegen.base.arrays import Float, Int

LARGEST = 2.0**50
"""Largest value, in units; larger ones count as missing, as JavaScript's integers are not exact."""

Runs = list[list[int]]


def packed(values: Float, scale: int) -> Runs:
    """Return a series.

    Args:
        values: ``(T,)`` float64; what is not finite is missing.
        scale: units to 1; the rounding error is at most half a unit.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        # Second differences of whole units: smooth motion has small ones, a standing body zeros. A
        # playback of two vehicles takes 2 kB instead of 14.
        units = np.round(values * scale)
        there = np.abs(units) <= LARGEST
    if there.all():
        return [_run(0, units.astype(np.int64))] if len(units) else []
    padded = np.zeros(len(there) + 2, dtype=bool)
    padded[1:-1] = there
    edges = np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2)
    return [_run(first, units[first:end].astype(np.int64)) for first, end in edges.tolist()]


def _run(first: int, units: Int) -> list[int]:
    # Slices: np.diff and np.trim_zeros take five times as long for so few numbers.
    steps, numbers = units.copy(), units.copy()
    steps[1:] -= units[:-1]
    numbers[1:] = steps[1:]
    numbers[2:] -= steps[1:-1]
    (changes,) = numbers[1:].nonzero()
    end = int(changes[-1]) + 2 if len(changes) else 1
    return [first, len(units), *numbers[:end].tolist()]


def unpacked(runs: Runs, n: int, scale: int) -> Float:
    """Return the ``(n,)`` values of a series; NaN where they are missing."""
    values = np.full(n, np.nan)
    for first, length, start, *rest in runs:
        changes = np.zeros(max(length - 1, 0), dtype=np.int64)
        changes[: len(rest)] = rest
        units = start + np.concatenate([[0], np.cumsum(np.cumsum(changes))])
        values[first : first + length] = units / scale
    return values


# --- Numbers in bulk, rounded to what a screen can show; NaN and infinity become None ---


DIGITS = 5
"""Number of significant digits of the largest value of a column in bulk."""


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
