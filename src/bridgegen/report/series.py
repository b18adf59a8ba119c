"""Numbers over time as few characters: rounded, and as what they differ from a straight line.

A series is its runs of finite values, each ``[first instant, length, value, difference, second
differences …]`` in whole units of 1/scale; second differences of 0 at the end are left out. What
moves smoothly has small ones, and what stands still has none at all. ``series.js`` reads them.
"""

import numpy as np

from bridgegen.arrays import Float

LARGEST = 2.0**50
"""In units. What is larger counts as missing: beyond, JavaScript does not count exactly."""

Runs = list[list[int]]


def packed(values: Float, scale: int) -> Runs:
    """Return a series.

    Args:
        values: ``(T,)`` float64; what is not finite is missing.
        scale: units to 1, so that what is read differs by half a unit at most.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        units = np.round(values * scale)
        there = np.abs(units) <= LARGEST
    edges = np.flatnonzero(np.diff(there, prepend=False, append=False)).reshape(-1, 2)
    return [_run(first, units[first:end].astype(np.int64)) for first, end in edges.tolist()]


def _run(first: int, units: np.ndarray) -> list[int]:
    steps = np.diff(units)
    told = np.concatenate([units[:1], steps[:1], np.diff(steps)])
    kept = np.trim_zeros(told[1:], "b")
    return [first, len(units), int(told[0]), *kept.tolist()]


def unpacked(runs: Runs, n: int, scale: int) -> Float:
    """Return the ``(n,)`` values of a series; NaN where they are missing."""
    values = np.full(n, np.nan)
    for first, length, start, *rest in runs:
        told = np.zeros(max(length - 1, 0), dtype=np.int64)
        told[: len(rest)] = rest
        units = start + np.concatenate([[0], np.cumsum(np.cumsum(told))])
        values[first : first + length] = units / scale
    return values
