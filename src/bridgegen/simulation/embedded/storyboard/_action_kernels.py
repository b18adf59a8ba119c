"""How actions begin: those of who drives, those that move an entity, those that concern all."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel
from bridgegen.simulation.embedded._codes import (
    CONTROL,
    DOES,
    FIRST_GLOBAL,
    FIRST_MOTION,
    KEEP_DISTANCE,
    RELATIVE_SPEED,
    SHAPE,
    TELEPORT,
    WHOM,
)
from bridgegen.simulation.embedded._motion_kernels import STEP
from bridgegen.simulation.embedded.drivers import begin_control, is_steered
from bridgegen.simulation.embedded.motion import (
    begin_motion,
    is_pointless,
    start_at_distance,
    start_at_speed,
    steers,
)
from bridgegen.simulation.embedded.places._place_kernels import body_pose
from bridgegen.simulation.embedded.world import begin_global


@kernel
def begin(j, k, plan, roads, state, record):
    """Begin action j at instant k; what is over at once says so."""
    kind = plan.actions[j, DOES]
    steers_ego = steers(j, plan) and plan.actions[j, WHOM] == 0
    in_vain = steers_ego and is_steered(plan, state)  # its driver does
    if in_vain or (plan.comes_and_goes and is_pointless(j, plan, state)):
        state.action_ended[j] = True
    elif kind == CONTROL:
        begin_control(j, k, plan, roads, state, record)
    elif FIRST_MOTION <= kind < FIRST_GLOBAL:
        begin_motion(j, k, plan, roads, state, record)
    else:
        begin_global(j, k, plan, state)


@kernel
def begin_initially(plan, roads, state, record):
    """Begin the actions that begin at the start: what they set at once is the first state."""
    for i in range(plan.initial.shape[0]):
        j = plan.initial[i]
        begin(j, 0, plan, roads, state, record)
        if plan.actions[j, DOES] == RELATIVE_SPEED and plan.actions[j, SHAPE] == STEP:
            start_at_speed(j, plan, state, record)
        elif plan.actions[j, DOES] == KEEP_DISTANCE:
            start_at_distance(j, plan, roads, state, record)
        elif plan.actions[j, DOES] == TELEPORT:
            e = plan.actions[j, WHOM]
            state.placed[e] = False
            record.x[e, 0], record.y[e, 0], record.h[e, 0] = body_pose(e, roads, state)
