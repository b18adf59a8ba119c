"""Metrics of the road: the ego's offset from its lane's centre, red lights that it ran."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, recorded, steps, without_failed
from bridgegen.base.arrays import Float, as_float
from bridgegen.simulation.rollout import Rollout

# --- l_offset: the ego's largest lateral offset from its lane's centre ---


def l_offset(rollout: Rollout) -> Float:
    """Return the ego's largest absolute lateral offset from its route's lane centre.

    Returns:
        ``(N,)`` float64 [m], ≥ 0, Frenet |d| of the reference point; NaN where the scenario
        failed.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels

    out = np.empty(rollout.shape[0])
    _kernels.largest_offset(recorded(rollout, "offset"), steps(rollout), out)
    return without_failed(rollout, out)


L_OFFSET = Metric(
    name="l_offset",
    unit="m",
    description="largest absolute lateral offset of the ego from its lane's centre",
    sense="larger",
    cap=0.0,
    compute=l_offset,
    needs="offset",
)


# --- r_red: number of red lights that the ego ran ---


ASIDE = 3.5
"""Largest lateral distance from the route at which a body crosses its stop line's prolongation [m];
farther aside, a lane's width, it crosses another lane's line, or none."""


def r_red(rollout: Rollout) -> Float:
    """Return how many traffic lights the ego ran while they were red.

    It runs one when the middle of its front bumper crosses the light's stop line in the line's
    direction of travel, from one instant to the next, and the light shows red, or red and yellow,
    at the first of them. A light counts once, however many lines it has and however often it is
    run.

    Returns:
        ``(N,)`` float64, whole numbers; 0 where no light is on the ego's route; NaN where the
        scenario failed.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels as _light_kernels

    n, _, t = rollout.shape
    n_lights = rollout.lights.shape[1] if rollout.lights.size else 0
    egos = np.flatnonzero(rollout.stop_entities == 0)
    stop_lights = np.ascontiguousarray(rollout.stop_lights[egos], dtype=np.int64)
    out = np.zeros(n)
    if not stop_lights.size:
        return without_failed(rollout, out)
    shape = (n, len(rollout.stop_lights), 3)
    every = as_float("rollout.stop_lines", rollout.stop_lines, shape, finite=False)
    lines = as_float("rollout.stop_lines", every[:, egos], (n, len(egos), 3))
    lights = np.ascontiguousarray(rollout.lights, dtype=np.int8)
    if n and lights.shape != (n, n_lights, t):
        raise ValueError(f"rollout.lights must have shape (N, S, T), got {lights.shape}")
    if n and not (stop_lights.min() >= 0 and stop_lights.max() < n_lights):
        raise ValueError(f"rollout.stop_lights must be in 0..{n_lights - 1}, got {stop_lights}")
    box = rollout.box[0]
    _light_kernels.red_lights(
        # The middle of the front bumper crosses the line.
        float(box[2] + 0.5 * box[0]),
        recorded(rollout, "x"),
        recorded(rollout, "y"),
        *rollout.direction,
        lines,
        stop_lights,
        lights,
        steps(rollout),
        ASIDE,
        out,
    )
    return without_failed(rollout, out)


R_RED = Metric(
    name="r_red",
    unit="count",
    description="red lights that the ego ran",
    sense="larger",
    cap=0.0,
    compute=r_red,
    needs="lights",
)
