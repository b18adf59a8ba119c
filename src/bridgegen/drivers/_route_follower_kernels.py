"""The paper's baseline ego: holds its target speed on its route, ignores traffic (Section V-A)."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import LENGTH, pursue, pursue_beside

PREVIEW = 0.6  # s, pure pursuit looks this far ahead at the present speed …
PREVIEW_MIN, PREVIEW_MAX = 3.0, 15.0  # m, … within these
SPEED_TIME = 0.5  # s, time constant of the speed controller


@kernel
def preview(v):
    """Return the preview distance [m] from the rear axle to the point that it steers for."""
    return min(max(PREVIEW * v, PREVIEW_MIN), PREVIEW_MAX)


@kernel
def steer(path, n, ds, s, x, y, h, v):
    """Return the curvature [1/m] that follows the path (pure pursuit)."""
    return pursue(path, n, ds, s, x, y, h, preview(v))


@kernel
def hold_speed(v, target):
    """Return the acceleration [m/s²] that brings the speed to its target."""
    return (target - v) / SPEED_TIME


@kernel
def keep_to_route(k, roads, state, record):
    """Return the curvature [1/m] that keeps the ego to its route, or its shoulder, at instant k."""
    p = state.on[0]
    to = state.shoulder
    if to[LENGTH] > 0.0:
        return pursue_beside(
            roads.paths[p], roads.counts[p], roads.steps[p], state.station[0],
            (to[0], to[1], to[2], to[3]), record.x[0, k], record.y[0, k], record.h[0, k],
            preview(record.v[0, k]),
        )  # fmt: skip
    return steer(
        roads.paths[p],
        roads.counts[p],
        roads.steps[p],
        state.station[0],
        record.x[0, k],
        record.y[0, k],
        record.h[0, k],
        record.v[0, k],
    )


@kernel
def drive(k, plan, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m]."""
    return hold_speed(record.v[0, k], state.command[0]), keep_to_route(k, roads, state, record)
