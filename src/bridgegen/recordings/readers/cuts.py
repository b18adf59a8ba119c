"""Where a track jumps, leaves its path for one state, or has a gap."""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int

JUMP = 2.0
"""A track jumps if it is farther than this [m] from where its motion takes it …"""
STRONGEST = 10.0
"""… and what this acceleration [m/s²] explains."""
NEIGHBOURS = 3
"""Steps before and after, of which the median is the motion."""
BRIDGED = 0.5
"""Gaps up to this [s], and up to `BRIDGED_STEPS`, are bridged."""
BRIDGED_STEPS = 3.0
GAP = 1.5
"""More than so many time steps between two states are a gap."""


def bridged_up_to(time_step: float) -> float:
    """Return the longest gap that is bridged [s]."""
    return max(BRIDGED, BRIDGED_STEPS * time_step)


@dataclass(frozen=True)
class Jumps:
    """Where a track jumps.

    Attributes:
        off: states that are off the path, each alone.
        after: states after which the track jumps to another place.
    """

    off: Int
    after: Int


def suspects(time: Float, x: Float, y: Float, first: Int) -> Int:
    """Return the participants with a change of velocity that a jump would need; few, usually."""
    if len(time) < 3:
        return np.zeros(0, dtype=np.int64)
    steps = np.maximum(np.diff(time), 1e-9)
    change = np.hypot(np.diff(np.diff(x) / steps), np.diff(np.diff(y) / steps))
    change *= np.maximum(steps[1:], steps[:-1])
    ends = first[1:-1]  # a change is about the state after it, and needs its two neighbours
    for beside in (ends - 2, ends - 1):
        change[beside[(beside >= 0) & (beside < len(change))]] = 0.0
    odd = np.flatnonzero(change > 0.5 * JUMP) + 1
    return np.unique(np.searchsorted(first, odd, side="right") - 1)


def jumps(time: Float, x: Float, y: Float) -> Jumps:
    """Return where one track jumps: in place, of a body whose velocity is that around."""
    n = len(time)
    steps = np.diff(time)
    velocity = np.column_stack([np.diff(x) / steps, np.diff(y) / steps])
    medians = _medians_around(velocity)
    error = np.hypot(*(velocity - medians).T) * steps
    far = error > JUMP + 0.5 * STRONGEST * steps**2
    off, after = [], []
    i = 0
    while i < n - 1:
        if far[i] and i + 2 < n and far[i + 1] and _returns(time, x, y, medians[i], i):
            off.append(i + 1)
            i += 2
            continue
        if far[i]:
            after.append(i)
        i += 1
    return Jumps(np.array(off, dtype=np.int64), np.array(after, dtype=np.int64))


def _medians_around(values: Float) -> Float:
    """Return per row the median of those around it, without its own, ``(n, 2)``; alone, its own."""
    n, width = len(values), 2 * NEIGHBOURS + 1
    medians = values.copy()
    if n >= width:
        windows = np.lib.stride_tricks.sliding_window_view(values, width, axis=0)
        others = np.delete(windows, NEIGHBOURS, axis=2)
        medians[NEIGHBOURS : n - NEIGHBOURS] = np.median(others, axis=2)
    inner = range(NEIGHBOURS, n - NEIGHBOURS) if n >= width else range(0)
    for i in set(range(n)).difference(inner):
        around = np.r_[max(0, i - NEIGHBOURS) : i, i + 1 : min(n, i + 1 + NEIGHBOURS)]
        if len(around):
            medians[i] = np.median(values[around], axis=0)
    return medians


def _returns(time: Float, x: Float, y: Float, velocity: Float, i: int) -> bool:
    """Whether state i + 2 goes on where state i was going."""
    span = time[i + 2] - time[i]
    error = np.hypot(x[i + 2] - x[i] - velocity[0] * span, y[i + 2] - y[i] - velocity[1] * span)
    return bool(error <= JUMP + 0.5 * STRONGEST * span**2)


def gaps(time: Float, time_step: float) -> tuple[Int, Bool]:
    """Return the states after which there is a gap, and whether it is bridged."""
    steps = np.diff(time)
    at = np.flatnonzero(steps > GAP * time_step)
    return at, steps[at] <= bridged_up_to(time_step) + 0.1 * time_step
