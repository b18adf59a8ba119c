"""Compiled count of red lights run; public wrapper: ``r_red.r_red``."""

import math

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel

RED, RED_AND_YELLOW = 1, 2  # of Rollout.lights


@kernel
def red_lights(
    front: float, x: Float, y: Float, cosine: Float, sine: Float, lines: Float, stop_lights: Int,
    lights: Int, n_steps: Int, aside: float, out: Float,
) -> None:  # fmt: skip
    """Count the lights whose stop line the ego crosses while they are red.

    ``front`` [m] is how far its front bumper is ahead of its reference point.
    """
    n_rows, n_lights, _ = lights.shape
    ran = np.empty(n_lights, dtype=np.bool_)
    for i in range(n_rows):
        ran[:] = False
        for j in range(lines.shape[1]):
            c, s = math.cos(lines[i, j, 2]), math.sin(lines[i, j, 2])
            light = stop_lights[j]
            before = math.inf
            for k in range(n_steps[i]):
                px = (x[i, 0, k] - lines[i, j, 0]) + front * cosine[i, 0, k]
                py = (y[i, 0, k] - lines[i, j, 1]) + front * sine[i, 0, k]
                past = px * c + py * s
                if before <= 0.0 and past > 0.0 and abs(py * c - px * s) <= aside:
                    state = lights[i, light, k - 1]
                    ran[light] = ran[light] or state in (RED, RED_AND_YELLOW)
                before = past
        out[i] = np.sum(ran)
