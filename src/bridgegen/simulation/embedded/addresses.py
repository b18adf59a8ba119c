"""Kernels that few storyboards need: compiled for those that do, and called by their addresses."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types

from bridgegen.base.compiled import address_of, row_type
from bridgegen.simulation.embedded._codes import (
    BY_TRAJECTORY,
    DOES,
    FIRST_ACROSS,
    PLACE_KIND,
    RELATIVE_SPEED,
)
from bridgegen.simulation.embedded._memory_kernels import Plan, Record, Roads, State
from bridgegen.simulation.embedded.chassis._multi_body_columns import MULTI_BODY
from bridgegen.simulation.embedded.conditions import look_closely
from bridgegen.simulation.embedded.drivers import (
    DEMANDS,
    ask,
    begin_waiting,
    heed,
    move_chassis,
    move_multi_body,
)
from bridgegen.simulation.embedded.motion import (
    BEGINS,
    follow_course,
    move_laid,
    pose_along,
    start_towed,
    tow,
)

# With the branches of all conditions in the inlined instant, crossroads-s4 ran at 0.4 of the speed.
_BY_FIELD = {
    "follows_courses": follow_course,
    "poses_along": pose_along,
    "moves_laid": move_laid,
    "tows_trailers": tow,
    "starts_towed": start_towed,
    "looks_closely": look_closely,
    "heeds": heed,
    "begins_waiting": begin_waiting,
}

FIELDS = (*_BY_FIELD, "begins", "moves_chassis", "driver_code")
"""Fields of `Plan` that hold addresses of kernels; 0: of none."""

_NUMBER, _TWO = (types.int64,), (types.int64, types.int64)
_MOTION = (types.int64, types.float64, types.float64)

CALLED: dict[Callable[..., Any], tuple[Any, ...]] = {
    **dict.fromkeys((*DEMANDS.values(), ask), _NUMBER),
    **dict.fromkeys(_BY_FIELD.values(), _NUMBER),
    **dict.fromkeys((follow_course, pose_along, move_laid, *BEGINS.values()), _TWO),
    **dict.fromkeys((move_chassis, move_multi_body), _MOTION),
    start_towed: (),
}
"""All kernels that are called by their address, with the types of what they take before bundles."""

Places = Callable[[Callable[..., Any]], int]
"""Returns the address of a kernel of ``CALLED``."""


def here(plan: Plan, networks: Roads, states: State, records: Record) -> Places:
    """Return the addresses of kernels in this process, for such arrays; compile if need be."""
    rows = (row_type(plan, 0), *map(row_type, (networks, states, records)))
    return lambda kernel: address_of(kernel, (*CALLED[kernel], *rows))


def addressed(plan: Plan, drives: Callable[..., Any] | None, at: Places) -> Plan:
    """Return a plan with the addresses of the kernels that it needs.

    Args:
        plan: the compiled storyboard.
        drives: the kernel of the ego's driver, if it has one.
        at: where kernels are; see `here`.
    """
    kinds = plan.actions[:, DOES]
    begins = {kind: at(BEGINS[kind]) for kind in np.unique(kinds).tolist() if kind in BEGINS}
    tows, attends = len(plan.tows) > 0, plan.attends > 0
    needed = {
        "follows_courses": ((kinds >= RELATIVE_SPEED) & (kinds < FIRST_ACROSS)).any(),
        "poses_along": (plan.places[:, PLACE_KIND] == BY_TRAJECTORY).any(),
        "moves_laid": len(plan.layouts) > 0,
        "tows_trailers": tows,
        "starts_towed": tows,
        "looks_closely": plan.looks_closely,
        "heeds": attends,
        "begins_waiting": attends,
    }
    moves = move_multi_body if plan.chassis.size == MULTI_BODY else move_chassis
    called: Any = {name: at(_BY_FIELD[name]) if needed[name] else 0 for name in needed}
    return plan._replace(
        begins=np.array([begins.get(kind, 0) for kind in kinds.tolist()], dtype=np.int64),
        moves_chassis=at(moves) if plan.chassis.size else 0,
        driver_code=at(drives) if drives else 0,
        **called,
    )
