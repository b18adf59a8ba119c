"""Measure perception and tracking alone, without a rollout around them.

    .venv/bin/python benchmarks/perception.py

Bodies drive straight on, up to 85 m around the ego, on a clear day, for 20 s at 0.05 s.
"""

import time

import numpy as np

from bridgegen.compiled import borrowed, kernel
from bridgegen.ego._perception_kernels import MEMORY, perceive
from bridgegen.ego._tracking_kernels import TRACK
from bridgegen.ego.detections import DETECTION
from bridgegen.ego.kinds import CAR
from bridgegen.ego.sight import Sky

STEPS, DT = 401, 0.05
CARS = (4.5, 1.8, 1.4, 50.0, 3.0, 9.0, 0.2, 1.5)


@kernel
def drive(n_rows, present, x, y, h, v, bodies, kinds, weather, memory, tracks, detections):
    """Perceive N rows, each with noise of its own."""
    present = borrowed(present)
    x, y, h, v = borrowed(x), borrowed(y), borrowed(h), borrowed(v)
    bodies, kinds, weather = borrowed(bodies), borrowed(kinds), borrowed(weather)
    memory, tracks, detections = borrowed(memory), borrowed(tracks), borrowed(detections)
    for row in range(n_rows):
        memory[:] = 0.0
        tracks[:] = 0.0
        for k in range(x.shape[1]):
            perceive(
                k, DT, np.uint64(row), False, present, x, y, h, v, bodies, kinds, weather, memory,
                tracks, detections,
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
    arrays = (
        np.ones(e, dtype=np.bool_), x, y, h, v, np.tile(CARS, (e, 1)), np.full(e, CAR),
        Sky().numbers(),
        np.zeros((e, MEMORY)), np.zeros((e, TRACK)), np.zeros((e, STEPS, DETECTION)),
    )  # fmt: skip
    drive(1, *arrays)
    times = []
    for _ in range(10):
        began = time.thread_time()
        drive(n_rows, *arrays)
        times.append((time.thread_time() - began) / n_rows)
    return min(times)


if __name__ == "__main__":
    for bodies, rows in ((1, 100), (2, 100), (10, 20), (30, 5)):
        seconds = perception(bodies, rows)
        each = seconds / bodies / (STEPS // 2)
        print(
            f"{bodies:>2} bodies: {1e6 * seconds:7.1f} µs a row, {1e9 * each:.0f} ns each a frame"
        )
