"""Smoothing of noisy positions, and resampling.

A cubic Savitzky–Golay filter over one second: a least-squares cubic at each instant, so it has no
delay, leaves uniform acceleration and jerk as they are, and gives velocity and acceleration with
the position. Tracks that are smooth already are not touched: a filter would only bend them.

Source: Savitzky and Golay, Analytical Chemistry 36 (1964) 1627.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from bridgegen.base.arrays import Bool, Float, Int

NOISE = 0.02
"""Scatter of positions beyond which they are smoothed [m]."""
# Measured differences, median of tracks: 0.15 m/s in CommonRoad's US-101, 0.49 in its Peachtree,
# 0.43 in its Lankershim, 0.16 in samples of Waymo and nuScenes.
MISFIT = 0.1
"""Difference of velocities from the positions' rate of change beyond which they are not theirs
[m/s]."""
# Over 0.4 s, not over a step: positions that are rounded to 1 cm at 25 Hz differ from their own
# velocities by 0.1 m/s from step to step (highD), which is no reason to smooth.
LAG = 0.4
"""Time over which the positions' rate of change is measured [s]."""
WINDOW = 1.0
"""Window of the smoothing filter [s]."""
DEGREE = 3
COARSEST = 0.2
"""Largest time step at which a window holds enough states [s]."""
LEAST_STATES = 8


def scatter(x: Float, y: Float) -> float:
    """Return the standard deviation of the noise in equally spaced positions [m].

    That of white noise with the third differences (median), where motion itself has next to none.
    """
    if len(x) < LEAST_STATES:
        return 0.0
    sizes = [float(np.median(np.abs(np.diff(values, 3)))) for values in (x, y)]
    # 1.4826 makes a median of absolute values a standard deviation; 20 = 1 + 9 + 9 + 1 is the
    # variance of third differences of white noise.
    return float(1.4826 * max(sizes) / np.sqrt(20.0))


def misfit(time: Float, x: Float, y: Float, vx: Float, vy: Float) -> float:
    """Return by how much velocities are not those of the positions, at the worst [m/s].

    Distances over `LAG` are compared, which the rounding of positions hardly changes. Where a
    velocity is not known, it is 0.
    """
    step = (time[-1] - time[0]) / (len(time) - 1)
    lag = min(max(1, round(LAG / step)), len(time) - 1)
    span = np.diff(time)
    off = np.zeros(len(time) - lag)
    for place, speed in ((x, vx), (y, vy)):
        driven = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * span))
        off = np.hypot(off, place[lag:] - place[:-lag] - (driven[lag:] - driven[:-lag]))
    worst = (off / (time[lag:] - time[:-lag])).max()
    return float(worst) if np.isfinite(worst) else 0.0


def window(time_step: float) -> int:
    """Return the states in the filter's window, an odd number."""
    return 2 * round(0.5 * WINDOW / time_step) + 1


def smooth(values: Float, time_step: float, derivative: int) -> Float:
    """Return smoothed values, or a derivative of them; at the ends, those of the last cubic."""
    size = min(window(time_step), len(values) - 1 + len(values) % 2)
    return np.asarray(
        savgol_filter(values, size, min(DEGREE, size - 1), deriv=derivative, delta=time_step),
        dtype=np.float64,
    )


def slopes(time: Float, values: Float) -> Float:
    """Return the slopes of the smooth curve through values (cubic spline), at their instants.

    With them `hermite` gives that curve, so that velocities are exactly those of the positions.
    """
    # Not the slopes of the filter's own cubics: those are less noisy, but the velocity of one
    # instant and the positions of two are of three different cubics, and disagreed by up to 0.6
    # m/s. With the spline 0.007 to 0.02 m/s remain.
    return np.asarray(CubicSpline(time, values)(time, 1), dtype=np.float64)


def hermite(at: Float, time: Float, values: Float, slopes: Float) -> Float:
    """Return the cubic between each two states that has their values and slopes."""
    i = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    span = time[i + 1] - time[i]
    u = (at - time[i]) / span
    rise = values[i + 1] - values[i]
    a = slopes[i] * span - rise
    b = rise - slopes[i + 1] * span
    return values[i] + u * rise + u * (1.0 - u) * (a * (1.0 - u) + b * u)


def hermite_slopes(at: Float, time: Float, values: Float, slopes: Float) -> Float:
    """Return the slopes of `hermite`."""
    i = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    span = time[i + 1] - time[i]
    u = (at - time[i]) / span
    mean = (values[i + 1] - values[i]) / span
    return (
        6.0 * u * (1.0 - u) * mean
        + (1.0 - u) * (1.0 - 3.0 * u) * slopes[i]
        + u * (3.0 * u - 2.0) * slopes[i + 1]
    )


# --- Where a track jumps, leaves its path for one state, or has a gap ---


JUMP = 2.0
"""Distance from where its motion takes it beyond which a track jumps [m], with `STRONGEST`."""
STRONGEST = 10.0
"""Acceleration that explains a deviation of a track, which is then no jump [m/s²]."""
NEIGHBOURS = 3
"""Number of steps before and after, of which the median is the motion."""
BRIDGED = 0.5
"""Longest gap that is bridged [s], if it has at most `BRIDGED_STEPS` steps."""
BRIDGED_STEPS = 3.0
GAP = 1.5
"""Number of time steps between two states beyond which there is a gap."""


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
    # A quick test of the whole recording at once; only the few suspects are looked at one by one.
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
    # The median of the steps around is not moved by the jump itself, as a mean would be.
    error = np.hypot(*(velocity - medians).T) * steps
    # What braking or steering as hard as tyres allow may explain is no jump, however long the step.
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
