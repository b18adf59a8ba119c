"""Measure perception and tracking alone, without a rollout around them.

    .venv/bin/python benchmarks/perception.py

Bodies drive straight on, up to 85 m around the ego, on a clear day, for 20 s at 0.05 s.
"""

import time
from typing import NamedTuple

import numpy as np

from bridgegen.base.compiled import bundled, kernel
from bridgegen.drivers._perception_kernels import MEMORY, perceive
from bridgegen.drivers._tracking_kernels import TRACK
from bridgegen.drivers.kinds import CAR, DETECTION
from bridgegen.drivers.sight import Sky

STEPS, DT = 401, 0.05
CARS = (4.5, 1.8, 1.4, 50.0, 3.0, 9.0, 0.2, 1.5)


class Arrays(NamedTuple):
    """What `perceive` takes and writes, see there."""

    present: np.ndarray
    x: np.ndarray
    y: np.ndarray
    h: np.ndarray
    v: np.ndarray
    bodies: np.ndarray
    kinds: np.ndarray
    weather: np.ndarray
    memory: np.ndarray
    tracks: np.ndarray
    detections: np.ndarray


@kernel
def drive(n_rows, arrays):
    """Perceive N rows, each with noise of its own."""
    a = bundled(arrays)
    for row in range(n_rows):
        a.memory[:] = 0.0
        a.tracks[:] = 0.0
        for k in range(a.x.shape[1]):
            perceive(
                k, DT, np.uint64(row), False, a.present, a.x, a.y, a.h, a.v, a.bodies, a.kinds,
                a.weather, a.memory, a.tracks, a.detections,
            )  # fmt: skip


def perception(n_bodies: int, n_rows: int) -> float:
    """Return the time of a row [s], on one core: the best of ten."""
    rng = np.random.default_rng(n_bodies)
    e = n_bodies + 1
    heading, speed = rng.uniform(-np.pi, np.pi, e), rng.uniform(0.0, 8.0, e)
    start = rng.uniform(-60.0, 60.0, (2, e))
    start[:, 0] = heading[0] = 0.0
    t = np.arange(STEPS) * DT
    h, v = (np.repeat(one[:, None], STEPS, axis=1) for one in (heading, speed))
    x = start[0][:, None] + v * np.cos(h) * t
    y = start[1][:, None] + v * np.sin(h) * t
    arrays = Arrays(
        np.ones(e, dtype=np.bool_), x, y, h, v, np.tile(CARS, (e, 1)), np.full(e, CAR),
        Sky().numbers(),
        np.zeros((e, MEMORY)), np.zeros((e, TRACK)), np.zeros((e, STEPS, DETECTION)),
    )  # fmt: skip
    drive(1, arrays)
    times = []
    for _ in range(10):
        began = time.thread_time()
        drive(n_rows, arrays)
        times.append((time.thread_time() - began) / n_rows)
    return min(times)


if __name__ == "__main__":
    for bodies, rows in ((1, 100), (2, 100), (10, 20), (30, 5)):
        seconds = perception(bodies, rows)
        each = seconds / bodies / (STEPS // 2)
        print(
            f"{bodies:>2} bodies: {1e6 * seconds:7.1f} µs a row, {1e9 * each:.0f} ns each a frame"
        )
