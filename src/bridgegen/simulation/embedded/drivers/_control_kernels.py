"""Control of the ego: by its driver, by the storyboard, or by one each for speed and steering.

``state.drives`` ``(2,)`` int64 is whether the driver steers and whether it sets the speed. The
storyboard does the rest, as for any other entity.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import inlined_kernel, kernel
from bridgegen.drivers._path_kernels import project
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.simulation.embedded._codes import LATERALLY, LONGITUDINALLY, SETS_SPEED, STEERS
from bridgegen.simulation.embedded.drivers._ego_kernels import move_ego
from bridgegen.simulation.embedded.motion import move_along_path, stop_follow, stop_longitudinal
from bridgegen.simulation.embedded.places._place_kernels import end_lateral
from bridgegen.simulation.embedded.places._slope_kernels import slope


@kernel
def begin_control(j, k, plan, roads, state, record):
    """Begin, and end, action j, by which the ego's driver is switched on or off.

    The storyboard takes over the ego where it is and as fast as it is, on its way's heading. What
    it asked for meanwhile was asked of the driver, and is over.
    """
    lateral, longitudinal = plan.actions[j, STEERS], plan.actions[j, SETS_SPEED]
    state.action_ended[j] = True
    if lateral >= 0 and lateral != state.drives[LATERALLY]:
        state.drives[LATERALLY] = lateral
        end_lateral(0, state)
        running = state.follow_action[0]
        if running >= 0:
            stop_follow(running, k, plan, roads, state, record)
            state.action_ended[running] = True
        p = state.on[0]
        state.aside[0] = state.turn[0] = 0.0
        if lateral == 0 and p >= 0:
            state.station[0], state.aside[0] = project(
                roads.paths[p], roads.counts[p], roads.steps[p], state.station[0],
                record.x[0, k], record.y[0, k],
            )  # fmt: skip
    if longitudinal >= 0 and longitudinal != state.drives[LONGITUDINALLY]:
        state.drives[LONGITUDINALLY] = longitudinal
        running = state.speed_action[0]
        if running >= 0:
            stop_longitudinal(running, plan, state)
            state.action_ended[running] = True
        if longitudinal == 0:
            state.command[0] = state.target[0] = record.v[0, k]


@inlined_kernel
def is_steered(plan, state):
    """Return whether the ego's driver steers it."""
    return plan.is_driven and state.drives[LATERALLY] == 1


@kernel
def move_paced(k, demanded, plan, roads, state, record):
    """Move the ego on along the storyboard's way, as fast as its driver asks for."""
    body, v = plan.bodies[0], record.v[0, k]
    uphill, _, press = slope(0, roads, state)
    grip = press * state.weather[FRICTION]
    a = min(max(demanded, -min(body[5], grip) - uphill), min(body[4], grip) - uphill)
    asked, target = state.command[0], state.target[0]
    state.command[0] = min(max(v + a * plan.dt, 0.0), body[3])
    state.mean[0] = math.nan
    move_along_path(0, k, plan, roads, state, record)
    state.command[0], state.target[0] = asked, target


@inlined_kernel
def move_steered(k, demanded, curvature, plan, roads, state, record):
    """Move the ego on from instant k as its driver steers; return its new x, y [m], heading.

    If it has been teleported, it stays there for this instant, at its speed.
    """
    if state.placed[0]:
        move_paced(k, 0.0, plan, roads, state, record)
        return record.x[0, k], record.y[0, k], record.h[0, k]
    if state.drives[LONGITUDINALLY] == 0:
        demanded = (state.command[0] - record.v[0, k]) / plan.dt
    return move_ego(k, demanded, curvature, plan, roads, state, record)
