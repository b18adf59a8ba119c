"""The ego: what its driver demands, and what its tyres give."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import call_kernel_at, inlined_kernel, kernel, run_kernel_at
from bridgegen.drivers._path_kernels import project
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.simulation.embedded._motion_kernels import bicycle, standing
from bridgegen.simulation.embedded.chassis._chassis_columns import SPEED, H, X, Y
from bridgegen.simulation.embedded.motion import ENDS, pass_end
from bridgegen.simulation.embedded.places._slope_kernels import slope


@inlined_kernel
def demand(k, plan, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m].

    The driver is called where its machine code lies (`demands.code_of`); one in Python gives the
    same two numbers.
    """
    if plan.driver_code == 0:
        return 0.0, 0.0
    return call_kernel_at(plan.driver_code, (k, plan, roads, state, record))


@kernel
def ego_is_through(plan, roads, state):
    """Return whether an ego with a driver is at the end of its route, or of the road."""
    p = state.on[0]
    if plan.is_driven == 0 or state.station[0] < (roads.counts[p] - 1) * roads.steps[p]:
        return False
    return (p == 0 and state.route[0] > 0) or roads.follows[p] == ENDS


@inlined_kernel
def move_ego(k, demanded, curvature, plan, roads, state, record):
    """Move the ego on from instant k; return its new x, y [m] and heading [rad]."""
    v, dt, p = record.v[0, k], plan.dt, state.on[0]
    if plan.moves_chassis:
        run_kernel_at(plan.moves_chassis, (k, demanded, curvature, plan, roads, state, record))
        x, y = state.chassis[X], state.chassis[Y]
        h, after = state.chassis[H], state.chassis[SPEED]
        given = (after - v) / dt
    else:
        uphill, aside, press = slope(0, roads, state)
        x, y, h, after, given = bicycle(
            record.x[0, k], record.y[0, k], record.h[0, k], v, demanded, curvature,
            plan.bodies[0, 3:7], press * state.weather[FRICTION], uphill, aside, dt,
        )  # fmt: skip
    step = 0.5 * (v + after) * dt
    record.a[0, k] = given
    state.travelled[0] += step
    state.stood[0] = standing(state.stood[0], v, after, dt)
    if k < record.x.shape[1] - 1:
        record.x[0, k + 1], record.y[0, k + 1] = x, y
        record.h[0, k + 1], record.v[0, k + 1] = h, after
        state.station[0], record.offset[0, k + 1] = project(
            roads.paths[p], roads.counts[p], roads.steps[p], state.station[0] + step, x, y
        )
        state.aside[0] = record.offset[0, k + 1]
        at_end = state.station[0] >= (roads.counts[p] - 1) * roads.steps[p]
        if at_end and (p > 0 or state.route[0] == 0):
            pass_end(0, 0.0, roads, state)
    return x, y, h
