"""Smoothing of noisy positions, and resampling.

A cubic Savitzky–Golay filter over one second: a least-squares cubic at each instant, so it has no
delay, leaves uniform acceleration and jerk as they are, and gives velocity and acceleration with
the position. Tracks that are smooth already are not touched: a filter would only bend them.

Source: Savitzky and Golay, Analytical Chemistry 36 (1964) 1627.
"""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from bridgegen.base.arrays import Float

NOISE = 0.02
"""Positions that scatter by more than this [m] are smoothed."""
MISFIT = 0.1
"""Velocities that differ by more than this [m/s] from how fast the positions change are not
theirs."""
LAG = 0.4
"""Time over which positions change [s]."""
WINDOW = 1.0
"""Of the filter [s]."""
DEGREE = 3
COARSEST = 0.2
"""Time step [s] up to which a window holds enough states."""
LEAST_STATES = 8


def scatter(x: Float, y: Float) -> float:
    """Return the standard deviation of the noise in equally spaced positions [m].

    That of white noise with the third differences (median), where motion itself has next to none.
    """
    if len(x) < LEAST_STATES:
        return 0.0
    sizes = [float(np.median(np.abs(np.diff(values, 3)))) for values in (x, y)]
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
