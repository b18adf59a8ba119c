"""How actions begin; what they do from then on: ``_speed_kernels`` and ``_travel_kernels``."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.compiled import inlined_kernel, kernel
from bridgegen.simulation.embedded._codes import (
    ACQUIRE,
    ADD_ENTITY,
    ASSIGN_ROUTE,
    CONTROL,
    DELETE_ENTITY,
    DOES,
    FIRST_GLOBAL,
    FOLLOW,
    KEEP_ASIDE,
    LANE_CHANGE,
    LANE_OFFSET,
    RELATIVE_SPEED,
    SHAPE,
    SPEED_CHANGE,
    TELEPORT,
    WHOM,
)
from bridgegen.simulation.embedded._motion_kernels import STEP
from bridgegen.simulation.embedded.drivers import begin_control, is_steered
from bridgegen.simulation.embedded.motion import (
    begin_add,
    begin_delete,
    begin_follow,
    begin_lane_change,
    begin_lane_offset,
    begin_lateral_distance,
    begin_longitudinal,
    begin_route,
    begin_teleport,
    is_pointless,
    start_at_speed,
    stop_follow,
    stop_lateral,
    stop_longitudinal,
    stop_route,
)
from bridgegen.simulation.embedded.places._place_kernels import body_pose
from bridgegen.simulation.embedded.world import begin_global


@inlined_kernel
def begin(j, k, plan, roads, state, record):
    """Begin action j at instant k: a branch per kind; what is over at once says so."""
    kind = plan.actions[j, DOES]
    steers_ego = (
        kind in (LANE_CHANGE, LANE_OFFSET, KEEP_ASIDE, FOLLOW) and plan.actions[j, WHOM] == 0
    )
    in_vain = steers_ego and is_steered(plan, state)  # its driver does
    if in_vain or (plan.comes_and_goes and is_pointless(j, plan, state)):
        state.action_ended[j] = True
    elif kind == SPEED_CHANGE or RELATIVE_SPEED <= kind < FIRST_GLOBAL:
        begin_longitudinal(j, k, plan, roads, state, record)
    elif kind == LANE_CHANGE:
        begin_lane_change(j, k, plan, roads, state, record)
    elif kind == LANE_OFFSET:
        begin_lane_offset(j, k, plan, roads, state, record)
    elif kind == CONTROL:
        begin_control(j, k, plan, roads, state, record)
    elif kind == ADD_ENTITY:
        begin_add(j, k, plan, roads, state, record)
    elif kind == DELETE_ENTITY:
        begin_delete(j, k, plan, roads, state, record)
    elif kind == KEEP_ASIDE:
        begin_lateral_distance(j, k, plan, roads, state, record)
    elif kind == TELEPORT:
        begin_teleport(j, k, plan, roads, state, record)
    elif kind in (ASSIGN_ROUTE, ACQUIRE):
        begin_route(j, k, plan, roads, state, record)
    elif kind == FOLLOW:
        begin_follow(j, k, plan, roads, state)
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
        elif plan.actions[j, DOES] == TELEPORT:
            e = plan.actions[j, WHOM]
            state.placed[e] = False
            record.x[e, 0], record.y[e, 0], record.h[e, 0] = body_pose(e, roads, state)


@inlined_kernel
def stop(j, k, plan, roads, state, record):
    """Stop action j, which has not ended: whoever it moved goes on as it is."""
    kind = plan.actions[j, DOES]
    if kind == SPEED_CHANGE or RELATIVE_SPEED <= kind < FIRST_GLOBAL:
        stop_longitudinal(j, plan, state)
    elif kind in (LANE_CHANGE, LANE_OFFSET, KEEP_ASIDE):
        stop_lateral(j, plan, state)
    elif kind == FOLLOW:
        stop_follow(j, k, plan, roads, state, record)
    elif kind == ACQUIRE:
        stop_route(j, plan, state)
