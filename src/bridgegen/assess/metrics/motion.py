"""Shared by the metrics beyond Table I: every body's position and direction, computed once."""

from dataclasses import dataclass

import numpy as np

from bridgegen.assess.metrics.metric import distance, recorded, shared, steps
from bridgegen.base.arrays import Bool, Float, Int, as_float
from bridgegen.simulation.rollout import Rollout

STANDS = 0.05
"""A body that is slower than this [m/s] stands, and does not turn round by the sign of noise."""


@dataclass(frozen=True)
class Motion:
    """A rollout's bodies for compiled code; instants from ``n_steps`` on are unset.

    Attributes:
        half: ``(E, 2)`` float64 [m], half lengths and half widths.
        x, y: ``(N, E, T)`` float64 [m], the boxes' centres.
        cosine, sine: ``(N, E, T)`` float64, of the direction in which each body drives: that of
            its heading, the opposite one where it reverses. Its box is the same either way.
        v: ``(N, E, T)`` float64 [m/s], ≥ 0, in that direction.
        a: ``(N, E, T)`` float64 [m/s²], likewise.
        reverses: ``(N, E, T)`` bool, at more than `STANDS`; None where no speed is < 0.
        distance: ``(N, E, T)`` float64 [m], from the ego's box; +inf where absent.
        n_steps: ``(N,)`` int64.
    """

    half: Float
    x: Float
    y: Float
    cosine: Float
    sine: Float
    v: Float
    a: Float
    reverses: Bool | None
    distance: Float
    n_steps: Int


def motion(rollout: Rollout) -> Motion:
    """Return a rollout's bodies, computed once for all metrics."""
    return shared(rollout, _motion)


def _motion(rollout: Rollout) -> Motion:
    from bridgegen.assess.metrics import _motion_kernels

    box = as_float("rollout.box [m]", rollout.box, (rollout.shape[1], 3))
    x, y, v = (recorded(rollout, field) for field in ("x", "y", "v"))
    n_steps, (cosine, sine) = steps(rollout), rollout.direction
    centre_x, centre_y = np.empty(rollout.shape), np.empty(rollout.shape)
    _motion_kernels.place(box, x, y, cosine, sine, n_steps, centre_x, centre_y)
    a, reverses = recorded(rollout, "a"), None
    if v.size and v.min() < 0.0:
        reverses = _reverses(v)
        cosine, sine, v, a = (np.where(reverses, -one, one) for one in (cosine, sine, v, a))
        v = np.maximum(v, 0.0)
    half = 0.5 * box[:, :2]
    return Motion(
        half, centre_x, centre_y, cosine, sine, v, a, reverses, distance(rollout), n_steps
    )


def _reverses(v: Float) -> Bool:
    """Return when bodies drive backwards, ``(N, E, T)``: while one stands, as it did before.

    One that has not driven yet stands as it will drive; where it never drives, its sign decides.
    """
    drives = np.abs(v) > STANDS
    instants = np.arange(v.shape[-1])
    last = np.maximum.accumulate(np.where(drives, instants, -1), axis=-1)
    first = np.argmax(drives, axis=-1, keepdims=True)
    ever = np.asarray(drives.any(axis=-1, keepdims=True))
    decides = np.where(ever, np.where(last < 0, first, last), instants)
    backwards: Bool = np.take_along_axis(v, decides, axis=-1) < 0.0
    return backwards
