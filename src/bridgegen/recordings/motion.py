"""Directions and velocities from positions."""

from typing import Literal

import numpy as np

from bridgegen.arrays import Float
from bridgegen.recordings.table import wrap

STANDING = 0.5
"""Speed [m/s] below which a body's motion says nothing of its heading."""


def velocities(time: Float, x: Float, y: Float) -> tuple[Float, Float]:
    """Return a track's velocities [m/s]: second-order differences, ``(n,)`` each."""
    if len(time) < 2:
        return np.zeros(len(time)), np.zeros(len(time))
    order: Literal[1, 2] = 2 if len(time) > 2 else 1  # at the ends
    return np.gradient(x, time, edge_order=order), np.gradient(y, time, edge_order=order)


def headings(vx: Float, vy: Float) -> tuple[Float, bool]:
    """Return the direction of motion [rad], and whether there is any.

    Where a body stands it keeps its last direction; before it first moves, it has its first.
    Whatever never moves faster than `STANDING` has 0.
    """
    moving = np.flatnonzero(np.hypot(vx, vy) > STANDING)
    if not len(moving):
        return np.zeros(len(vx)), False
    last = np.searchsorted(moving, np.arange(len(vx)), side="right") - 1
    at = moving[np.maximum(last, 0)]
    return wrap(np.arctan2(vy[at], vx[at])), True
