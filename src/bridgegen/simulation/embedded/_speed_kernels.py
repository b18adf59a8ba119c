"""The speeds that the storyboard asks for: how a change begins, and what it asks at an instant."""

import math

from bridgegen.compiled import inlined_kernel
from bridgegen.simulation.embedded._motion_kernels import LINEAR, STEP, duration, progress, ramped


@inlined_kernel
def begin_speed_change(j, k, plan, state):
    """Begin action j, a SpeedAction; an entity's earlier one ends."""
    e, shape, dimension = plan.actions[j, 0], plan.actions[j, 2], plan.actions[j, 3]
    value = state.slots[plan.actions[j, 5]]
    if state.speed_action[e] >= 0:
        state.action_ended[state.speed_action[e]] = True
    state.speed_action[e] = j
    state.target[e] = min(state.slots[plan.actions[j, 4]], plan.bodies[e, 3])
    state.origin[e], state.speed_began[e] = state.command[e], k * plan.dt
    state.rate[e] = math.inf
    if shape == LINEAR and dimension == 0:
        state.rate[e] = abs(value)
    elif shape != STEP:
        lasts = duration(shape, dimension, value, state.command[e], state.target[e])
        state.speed_lasts[e] = max(lasts, 1e-9)
        if shape == LINEAR:
            state.rate[e] = abs(state.target[e] - state.command[e]) / state.speed_lasts[e]


@inlined_kernel
def stop_speed_change(j, plan, state):
    """Stop action j, a SpeedAction: its entity keeps the speed that it has."""
    e = plan.actions[j, 0]
    if state.speed_action[e] == j:
        state.target[e], state.speed_action[e] = state.command[e], -1


@inlined_kernel
def command_speeds(k, plan, state):
    """Set ``command`` to the speeds [m/s] at the instant after k, by the actions that run."""
    dt = plan.dt
    for e in range(state.command.shape[0]):
        j = state.speed_action[e]
        if j >= 0 and plan.actions[j, 2] > LINEAR:
            passed = k * dt + dt - state.speed_began[e]
            share = progress(plan.actions[j, 2], passed / state.speed_lasts[e])[0]
            state.command[e] = state.origin[e] + share * (state.target[e] - state.origin[e])
        else:
            state.command[e] = ramped(state.command[e], state.target[e], state.rate[e] * dt)
        if j >= 0 and state.command[e] == state.target[e]:
            state.action_ended[j] = True
            state.speed_action[e] = -1
