"""Runs of states in which something holds, and the ego keeps its leader."""

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.recordings.events.scene import Scene


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
