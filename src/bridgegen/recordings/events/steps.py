"""Fits of a step with a known shape: of an offset during a lane change, of a speed while braking.

Least squares by Gauss and Newton with damping (Levenberg), for many windows at once; the result of
a window does not depend on those around it.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.recordings.events.scene import Scene

SPAN = 20.0
"""Longest window of a fit [s]."""
MARGIN = 1.5
"""Time of the window before and after the step [s]."""
ROUNDS, ITERATIONS = 4, 10
AT_ONCE = 512
LANES = 16
"""Number to a multiple of which rows are padded: NumPy may compute the rest of a row otherwise than
whole SIMD registers."""
DAMPING = 1e-9
Shape = Literal["cosine", "ramp"]


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps from one level to another.

    Attributes:
        begin: ``(K,)`` instant, in time steps.
        duration: ``(K,)`` in time steps, > 0.
        level: ``(K,)`` before.
        height: ``(K,)`` of the step.
        rms: ``(K,)`` of what remains.
    """

    begin: Float
    duration: Float
    level: Float
    height: Float
    rms: Float


def fit_steps(
    values: Float, first: Int, last: Int, guess: tuple[Float, Float], step: float, shape: Shape
) -> Steps:
    """Fit steps.

    Args:
        values: ``(S,)``.
        first: ``(K,)`` the first state that belongs to each.
        last: ``(K,)`` the last one.
        guess: ``(K,)`` begin, as a place among the states, and duration in states.
        step: between two states [s].
        shape: "cosine": half a wave; "ramp": straight.
    """
    count = len(first)
    found = np.zeros((5, count))
    for low in range(0, count, AT_ONCE):
        part = slice(low, min(low + AT_ONCE, count))
        found[:, part] = _fit(
            values, first[part], last[part], guess[0][part], guess[1][part], step, shape
        )
    return Steps(*found)


def _fit(
    values: Float, first: Int, last: Int, begin: Float, duration: Float, step: float, shape: Shape
) -> Float:
    columns = -(-round(SPAN / step) // LANES) * LANES
    theta = np.stack([np.zeros_like(begin), np.zeros_like(begin), begin, duration])
    rms = np.full(len(begin), np.inf)
    for _ in range(ROUNDS):
        middle = theta[2] + 0.5 * theta[3]
        half = np.minimum(0.5 * theta[3] + MARGIN / step, 0.5 * columns - 1.0)
        low = np.clip(np.floor(middle - half).astype(np.int64), first, last)
        high = np.clip(np.ceil(middle + half).astype(np.int64), first, last)
        at = low[:, None] + np.arange(columns)
        valid = at <= high[:, None]
        at = np.minimum(at, high[:, None])
        y = values[at]
        t = at.astype(np.float64)
        theta, rms = _improved(t, y, valid, theta, shape)
    return np.stack([theta[2], theta[3], theta[0], theta[1], rms])


def _improved(t: Float, y: Float, valid: Bool, theta: Float, shape: Shape) -> tuple[Float, Float]:
    weight = valid.astype(np.float64)
    count = np.maximum(weight.sum(axis=1), 1.0)
    begin, duration = theta[2].copy(), theta[3].copy()
    level, height = _levels(t, y, weight, begin, duration, shape)
    for _ in range(ITERATIONS):
        phase, value, slope = _shape(t, begin, duration, shape)
        rest = (y - level[:, None] - height[:, None] * value) * weight
        by_begin = -(height / duration)[:, None] * slope * weight
        by_duration = by_begin * phase
        columns = (weight, value * weight, by_begin, by_duration)
        normal = np.empty((len(t), 4, 4))
        right = np.empty((len(t), 4, 1))
        for i, column in enumerate(columns):
            right[:, i, 0] = (column * rest).sum(axis=1)
            for j, other in enumerate(columns[: i + 1]):
                normal[:, i, j] = normal[:, j, i] = (column * other).sum(axis=1)
        for i in range(4):
            normal[:, i, i] += DAMPING * count
        change = np.linalg.solve(normal, right)[:, :, 0]
        most = 0.3 * duration
        begin = begin + np.clip(change[:, 2], -most, most)
        duration = np.maximum(duration + np.clip(change[:, 3], -most, most), 1.0)
        level, height = _levels(t, y, weight, begin, duration, shape)
    _, value, _ = _shape(t, begin, duration, shape)
    rest = (y - level[:, None] - height[:, None] * value) * weight
    return np.stack([level, height, begin, duration]), np.sqrt((rest**2).sum(axis=1) / count)


def _levels(
    t: Float, y: Float, weight: Float, begin: Float, duration: Float, shape: Shape
) -> tuple[Float, Float]:
    """Return the level before and the height that fit a step best."""
    _, value, _ = _shape(t, begin, duration, shape)
    count = np.maximum(weight.sum(axis=1), 1.0)
    mean, mean_y = (value * weight).sum(axis=1) / count, (y * weight).sum(axis=1) / count
    centred = (value - mean[:, None]) * weight
    spread = (centred * centred).sum(axis=1)
    height = (centred * y).sum(axis=1) / np.maximum(spread, 1e-12)
    return mean_y - height * mean, height


def _shape(t: Float, begin: Float, duration: Float, shape: Shape) -> tuple[Float, Float, Float]:
    """Return phase in [0, 1], the share of the step that is done, and its slope."""
    raw = (t - begin[:, None]) / duration[:, None]
    phase = np.clip(raw, 0.0, 1.0)
    if shape == "cosine":
        return phase, 0.5 * (1.0 - np.cos(np.pi * phase)), 0.5 * np.pi * np.sin(np.pi * phase)
    return phase, phase, ((raw > 0.0) & (raw < 1.0)).astype(np.float64)


# --- Runs of states in which something holds, and the ego keeps its leader ---


def runs_of(scene: Scene, holds: Bool, least: int) -> tuple[Int, Int]:
    """Return the first and the last state of each run.

    Args:
        scene: the recording.
        holds: ``(S,)``.
        least: how many time steps a run must last.
    """
    edge = np.ones(len(holds) + 1, np.bool_)
    edge[1:-1] = (holds[1:] != holds[:-1]) | (scene.led_since[1:] != scene.led_since[:-1])
    bounds = np.flatnonzero(edge)
    first, last = bounds[:-1], bounds[1:] - 1
    kept = holds[first] & (last - first >= least)
    return first[kept], last[kept]


def least_of(values: Float, first: Int, last: Int) -> Float:
    """Return the least value of each run, ``(N,)``."""
    found = [values[a : b + 1].min() for a, b in zip(first.tolist(), last.tolist(), strict=True)]
    return np.array(found, np.float64)


def mean_of(values: Float, first: Int, last: Int) -> Float:
    """Return the mean value of each run, ``(N,)``."""
    found = [values[a : b + 1].mean() for a, b in zip(first.tolist(), last.tolist(), strict=True)]
    return np.array(found, np.float64)
