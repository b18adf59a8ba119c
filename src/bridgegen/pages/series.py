"""Compact time series: rounded second differences.

A series is its runs of finite values, each ``[first instant, length, value, difference, second
differences …]`` in whole units of 1/scale; second differences of 0 at the end are left out. Smooth
motion has small ones, standstill none. ``series.js`` reads them.
"""

import numpy as np

from bridgegen.base.arrays import Float, Int

LARGEST = 2.0**50
"""In units. Larger values count as missing: beyond, JavaScript's integers are not exact."""

Runs = list[list[int]]


def packed(values: Float, scale: int) -> Runs:
    """Return a series.

    Args:
        values: ``(T,)`` float64; what is not finite is missing.
        scale: units to 1; the rounding error is at most half a unit.
    """
    with np.errstate(over="ignore", invalid="ignore"):
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
