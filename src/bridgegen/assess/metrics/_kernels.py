"""Compiled loops of the metrics, one scenario after the other; each metric's file wraps its own.

Only the first ``n_steps`` instants of a scenario count; the padding after them is never read.
"""

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel

TIE = 1e-9
"""Distances that differ by no more are equal [m]."""


@kernel
def closest(distance: Float, n_steps: Int, least: Float, instant: Int) -> None:
    """Write the least distance and its first instant; +inf and −1 without other entities.

    The instant is the first within ``TIE`` of the least: at a constant gap, the last bits do not
    choose it.
    """
    n_rows, n_entities, _ = distance.shape
    for i in range(n_rows):
        best = np.inf
        for e in range(1, n_entities):
            for k in range(n_steps[i]):
                best = min(best, distance[i, e, k])
        at = -1
        if best < np.inf:
            for e in range(1, n_entities):
                for k in range(n_steps[i] if at < 0 else at):
                    if distance[i, e, k] <= best + TIE:
                        at = k
                        break
        least[i] = best
        instant[i] = at


@kernel
def contacts(distance: Float, n_steps: Int, merge_steps: int, out: Float) -> None:
    """Count contacts; one resumed within ``merge_steps`` of its last instant is the same."""
    n_rows, n_entities, _ = distance.shape
    for i in range(n_rows):
        count = 0
        for e in range(1, n_entities):
            last = -1
            for k in range(n_steps[i]):
                if distance[i, e, k] == 0.0:
                    if last < 0 or k - last > merge_steps:
                        count += 1
                    last = k
        out[i] = count


@kernel
def largest_offset(offset: Float, n_steps: Int, out: Float) -> None:
    """Write the ego's largest absolute offset."""
    for i in range(offset.shape[0]):
        most = 0.0
        for k in range(n_steps[i]):
            most = max(most, abs(offset[i, 0, k]))
        out[i] = most


@kernel
def widen(high: Float, low: Float, shift: int, n: int) -> None:
    """Extend window k by window k + shift: maximum and minimum, in place."""
    for k in range(n - shift):
        high[k] = max(high[k], high[k + shift])
        low[k] = min(low[k], low[k + shift])


@kernel
def acceleration_change(a: Float, n_steps: Int, window: int, out: Float) -> None:
    """Write the largest range of the ego's acceleration in any window of ``window`` steps.

    Windows grow by doubling: log₂(window) passes instead of comparing every pair.
    """
    n_rows, _, n_instants = a.shape
    high = np.empty(n_instants)
    low = np.empty(n_instants)
    for i in range(n_rows):
        n = n_steps[i]
        for k in range(n):
            high[k] = low[k] = a[i, 0, k]
        length = 1
        while 2 * length <= window + 1:
            widen(high, low, length, n)
            length *= 2
        if window + 1 > length:
            widen(high, low, window + 1 - length, n)
        most = 0.0
        for k in range(n):
            most = max(most, high[k] - low[k])
        out[i] = most


@kernel
def braking_edges(a: Float, n_steps: Int, threshold: float, out: Float) -> None:
    """Count how often the ego's deceleration rises to the threshold; before instant 0 it is 0."""
    for i in range(a.shape[0]):
        count = 0
        braking = False
        for k in range(n_steps[i]):
            hard = -a[i, 0, k] >= threshold
            if hard and not braking:
                count += 1
            braking = hard
        out[i] = count
