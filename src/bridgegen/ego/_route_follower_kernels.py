"""The paper's baseline ego: holds its target speed on its route and sees nobody (Section V-A)."""

from bridgegen.compiled import kernel
from bridgegen.ego._path_kernels import pursue

PREVIEW = 0.6  # s, pure pursuit looks this far ahead at the present speed …
PREVIEW_MIN, PREVIEW_MAX = 3.0, 15.0  # m, … within these
SPEED_TIME = 0.5  # s, time constant of the speed controller


@kernel
def preview(v):
    """Return how far ahead [m] of the rear axle the point lies that it steers for."""
    return min(max(PREVIEW * v, PREVIEW_MIN), PREVIEW_MAX)


@kernel
def steer(path, n, ds, s, x, y, h, v):
    """Return the curvature [1/m] that follows the path (pure pursuit)."""
    return pursue(path, n, ds, s, x, y, h, preview(v))


@kernel
def hold_speed(v, target):
    """Return the acceleration [m/s²] that brings the speed to its target."""
    return (target - v) / SPEED_TIME
