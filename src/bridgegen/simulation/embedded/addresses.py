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


def addressed(plan: Plan, networks: Roads, states: State, records: Record) -> Plan:
    """Return a plan with the addresses of the kernels that it needs, compiled if need be.

    The addresses are this process's.

    Args:
        plan: the compiled storyboard.
        networks: the road networks.
        states: of N rows.
        records: of N rows.
    """
    rows = (row_type(plan, 0), *map(row_type, (networks, states, records)))

    def at(kernel: Callable[..., Any], *first: Any) -> int:
        return address_of(kernel, (*first, *rows))

    kinds = plan.actions[:, DOES]
    begins = {
        kind: at(BEGINS[kind], types.int64, types.int64)
        for kind in np.unique(kinds).tolist()
        if kind in BEGINS
    }
    along = (plan.places[:, PLACE_KIND] == BY_TRAJECTORY).any()
    moves = move_multi_body if plan.chassis.size == MULTI_BODY else move_chassis
    chases = ((kinds >= RELATIVE_SPEED) & (kinds < FIRST_ACROSS)).any()
    return plan._replace(
        begins=np.array([begins.get(kind, 0) for kind in kinds.tolist()], dtype=np.int64),
        follows_courses=at(follow_course, types.int64, types.int64) if chases else 0,
        poses_along=at(pose_along, types.int64, types.int64) if along else 0,
        moves_laid=at(move_laid, types.int64, types.int64) if len(plan.layouts) else 0,
        tows_trailers=at(tow, types.int64) if len(plan.tows) else 0,
        starts_towed=at(start_towed) if len(plan.tows) else 0,
        looks_closely=at(look_closely, types.int64) if plan.looks_closely else 0,
        heeds=at(heed, types.int64) if plan.attends else 0,
        moves_chassis=(
            at(moves, types.int64, types.float64, types.float64) if plan.chassis.size else 0
        ),
        begins_waiting=at(begin_waiting, types.int64) if plan.attends else 0,
    )
