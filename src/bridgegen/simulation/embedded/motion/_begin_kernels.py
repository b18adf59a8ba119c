"""How the actions that move an entity begin and stop: a branch per kind.

What they do from then on: ``_speed_kernels`` and ``_travel_kernels``.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.compiled import kernel
from bridgegen.simulation.embedded._codes import (
    ACQUIRE,
    ADD_ENTITY,
    ASSIGN_ROUTE,
    DELETE_ENTITY,
    DOES,
    FIRST_ACROSS,
    FIRST_ALONG,
    FIRST_GLOBAL,
    FOLLOW,
    KEEP_ASIDE,
    LANE_CHANGE,
    LANE_OFFSET,
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
from bridgegen.simulation.embedded.motion._presence_kernels import begin_add, begin_delete
from bridgegen.simulation.embedded.motion._speed_kernels import (
    begin_longitudinal,
    stop_longitudinal,
)


@kernel
def begin_motion(j, k, plan, roads, state, record):
    """Begin action j, which moves an entity, at instant k."""
    kind = plan.actions[j, DOES]
    if FIRST_ALONG <= kind < FIRST_ACROSS:
        begin_longitudinal(j, k, plan, roads, state, record)
    elif kind == LANE_CHANGE:
        begin_lane_change(j, k, plan, roads, state, record)
    elif kind == LANE_OFFSET:
        begin_lane_offset(j, k, plan, roads, state, record)
    elif kind == KEEP_ASIDE:
        begin_lateral_distance(j, k, plan, roads, state, record)
    elif kind == ADD_ENTITY:
        begin_add(j, k, plan, roads, state, record)
    elif kind == DELETE_ENTITY:
        begin_delete(j, k, plan, roads, state, record)
    elif kind == TELEPORT:
        begin_teleport(j, k, plan, roads, state, record)
    elif kind in (ASSIGN_ROUTE, ACQUIRE):
        begin_route(j, k, plan, roads, state, record)
    elif kind == FOLLOW:
        begin_follow(j, k, plan, roads, state)


@kernel
def stop_motion(j, k, plan, roads, state, record):
    """Stop action j, which has not ended: whoever it moved goes on as it is."""
    kind = plan.actions[j, DOES]
    if FIRST_ALONG <= kind < FIRST_ACROSS:
        stop_longitudinal(j, plan, state)
    elif FIRST_ACROSS <= kind < FIRST_GLOBAL:
        stop_lateral(j, plan, state)
    elif kind == FOLLOW:
        stop_follow(j, k, plan, roads, state, record)
    elif kind == ACQUIRE:
        stop_route(j, plan, state)


@kernel
def steers(j, plan):
    """Return whether action j steers its entity, as a driver does."""
    kind = plan.actions[j, DOES]
    return FIRST_ACROSS <= kind < FIRST_GLOBAL or kind == FOLLOW
