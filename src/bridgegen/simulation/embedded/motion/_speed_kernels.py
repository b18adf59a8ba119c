"""The speeds that the storyboard asks for: how a change begins, and what it asks at an instant."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import inlined_kernel, kernel, run_kernel_at
from bridgegen.simulation.embedded._codes import (
    DIMENSION,
    DOES,
    LASTS,
    RELATIVE_SPEED,
    SHAPE,
    TARGET,
    WHOM,
)
from bridgegen.simulation.embedded._motion_kernels import (
    LINEAR,
    RATE,
    SAME_SPEED,
    STEP,
    ramp_mean,
    ramped,
)
from bridgegen.simulation.embedded.motion._course_kernels import change_time, changed


@kernel
def take_speed(j, plan, state):
    """Let action j, which moves an entity along its path, end an earlier one."""
    e = plan.actions[j, WHOM]
    if state.speed_action[e] >= 0:
        state.action_ended[state.speed_action[e]] = True
    state.speed_action[e] = j


@kernel
def begin_speed_change(j, k, plan, roads, state, record):
    """Begin action j, a SpeedAction to a speed of its own."""
    e, shape, dimension = plan.actions[j, WHOM], plan.actions[j, SHAPE], plan.actions[j, DIMENSION]
    value = state.slots[plan.actions[j, LASTS]]
    before, fastest = state.command[e], plan.bodies[e, 3]
    after = min(max(state.slots[plan.actions[j, TARGET]], -fastest), fastest)
    most = plan.bodies[e, 4] if abs(after) > abs(before) else plan.bodies[e, 5]
    state.target[e], state.origin[e], state.speed_began[e] = after, before, k * plan.dt
    state.rate[e] = math.inf
    if shape == LINEAR and dimension == RATE:
        state.rate[e] = min(abs(value), most)
    elif shape != STEP:
        lasts = change_time(shape, dimension, value, before, after, most)
        state.speed_lasts[e] = max(lasts, 1e-9)
        if shape == LINEAR:
            state.rate[e] = abs(after - before) / state.speed_lasts[e]


@kernel
def stop_longitudinal(j, plan, state):
    """Stop action j: its entity keeps the speed that it has."""
    e = plan.actions[j, WHOM]
    if state.speed_action[e] == j:
        state.target[e], state.speed_action[e] = state.command[e], -1
        state.rate[e] = math.inf


@inlined_kernel
def command_speed(e, k, plan, roads, state, record):
    """Set ``command`` of an entity to the speed [m/s] at the instant after k."""
    j, before = state.speed_action[e], state.command[e]
    # NaN: a constant acceleration over the step, unless a branch below knows better.
    state.mean[e] = math.nan
    if j >= 0 and plan.actions[j, DOES] >= RELATIVE_SPEED:
        run_kernel_at(plan.follows_courses, (j, k, plan, roads, state, record))
        return
    if j >= 0 and plan.actions[j, SHAPE] > LINEAR:
        shape, origin, target = plan.actions[j, SHAPE], state.origin[e], state.target[e]
        passed, lasts = k * plan.dt + plan.dt - state.speed_began[e], state.speed_lasts[e]
        state.command[e] = changed(shape, origin, target, passed / lasts)
        half = changed(shape, origin, target, (passed - 0.5 * plan.dt) / lasts)
        # The speed is known at every time, not only at instants: so a cubic shape's way is exact, a
        # sinusoidal one's to 0.1 mm.
        mean = (before + 4.0 * half + state.command[e]) / 6.0  # Simpson's rule
    else:
        state.command[e] = ramped(before, state.target[e], state.rate[e] * plan.dt)
        mean = ramp_mean(before, state.target[e], state.rate[e], plan.dt)
    # Else somebody else (a driver, a pedal) has set the speed, and the mean of the script is not
    # the body's.
    if record.v[e, k] == before:
        state.mean[e] = mean
    # Up to rounding: 0.1 m/s added forty times are not 4.
    if j >= 0 and abs(state.command[e] - state.target[e]) <= SAME_SPEED:
        state.action_ended[j] = True
        state.speed_action[e] = -1
