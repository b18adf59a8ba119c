"""How the actions that move an entity begin and stop, by kind.

What they do from then on: ``_speed_kernels`` and ``_travel_kernels``.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from collections.abc import Callable
from typing import Any

from bridgegen.base.compiled import kernel, run_kernel_at
from bridgegen.simulation.embedded._codes import (
    ACQUIRE,
    ADD_ENTITY,
    ASSIGN_ROUTE,
    CONNECT_TRAILER,
    DELETE_ENTITY,
    DISCONNECT_TRAILER,
    DOES,
    FIRST_ACROSS,
    FIRST_ALONG,
    FIRST_GLOBAL,
    FOLLOW,
    FOLLOW_LAID,
    KEEP_ASIDE,
    KEEP_DISTANCE,
    LANE_CHANGE,
    LANE_OFFSET,
    PRESS,
    RELATIVE_SPEED,
    SHOW,
    SPEED_CHANGE,
    SPEED_PROFILE,
    SWITCH,
    SYNCHRONIZE,
    TELEPORT,
)
from bridgegen.simulation.embedded.motion._across_kernels import (
    begin_lane_change,
    begin_lane_offset,
    stop_lateral,
)
from bridgegen.simulation.embedded.motion._aside_kernels import begin_lateral_distance
from bridgegen.simulation.embedded.motion._follow_kernels import (
    begin_follow,
    begin_route,
    begin_teleport,
    stop_follow,
    stop_route,
)
from bridgegen.simulation.embedded.motion._lamp_kernels import begin_switch
from bridgegen.simulation.embedded.motion._laying_kernels import begin_laid
from bridgegen.simulation.embedded.motion._pedal_kernels import begin_press
from bridgegen.simulation.embedded.motion._presence_kernels import (
    begin_add,
    begin_delete,
    begin_show,
)
from bridgegen.simulation.embedded.motion._pursuit_kernels import begin_course
from bridgegen.simulation.embedded.motion._speed_kernels import (
    begin_speed_change,
    stop_longitudinal,
    take_speed,
)
from bridgegen.simulation.embedded.motion._towing_kernels import begin_connect, begin_disconnect

BEGINS: dict[int, Callable[..., Any]] = {
    SPEED_CHANGE: begin_speed_change,
    **dict.fromkeys((RELATIVE_SPEED, SPEED_PROFILE, KEEP_DISTANCE, SYNCHRONIZE), begin_course),
    LANE_CHANGE: begin_lane_change,
    LANE_OFFSET: begin_lane_offset,
    KEEP_ASIDE: begin_lateral_distance,
    ADD_ENTITY: begin_add,
    DELETE_ENTITY: begin_delete,
    CONNECT_TRAILER: begin_connect,
    DISCONNECT_TRAILER: begin_disconnect,
    SHOW: begin_show,
    SWITCH: begin_switch,
    PRESS: begin_press,
    TELEPORT: begin_teleport,
    **dict.fromkeys((ASSIGN_ROUTE, ACQUIRE), begin_route),
    FOLLOW: begin_follow,
    FOLLOW_LAID: begin_laid,
}
"""Kernels that begin an action, by its kind; compiled where a storyboard has one, see
`addresses`."""


@kernel
def begin_motion(j, k, plan, roads, state, record):
    """Begin action j, which moves an entity, at instant k."""
    if FIRST_ALONG <= plan.actions[j, DOES] < FIRST_ACROSS:
        take_speed(j, plan, state)
    # By an address for each action: kinds that the storyboard does not have are not compiled.
    run_kernel_at(plan.begins[j], (j, k, plan, roads, state, record))


@kernel
def stop_motion(j, k, plan, roads, state, record):
    """Stop action j, which has not ended: whoever it moved goes on as it is."""
    kind = plan.actions[j, DOES]
    if FIRST_ALONG <= kind < FIRST_ACROSS:
        stop_longitudinal(j, plan, state)
    elif FIRST_ACROSS <= kind < FIRST_GLOBAL:
        stop_lateral(j, plan, state)
    elif kind in (FOLLOW, FOLLOW_LAID):
        stop_follow(j, k, plan, roads, state, record)
    elif kind == ACQUIRE:
        stop_route(j, plan, state)


@kernel
def steers(j, plan):
    """Return whether action j steers its entity, as a driver does."""
    kind = plan.actions[j, DOES]
    return FIRST_ACROSS <= kind < FIRST_GLOBAL or kind in (FOLLOW, FOLLOW_LAID)
