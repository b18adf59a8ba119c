"""The shipped drivers by name: the kernel of each, compiled when it drives first."""

from collections.abc import Callable
from typing import Any

from numba import types

from bridgegen.base.compiled import address_of, row_type
from bridgegen.drivers import (
    _careful_fsm_kernels,
    _careful_kernels,
    _fsm_kernels,
    _reference_kernels,
    _route_follower_kernels,
    _un_r157_kernels,
    drivers,
)
from bridgegen.simulation.embedded._memory_kernels import Plan, Record, Roads, State

DEMANDS: dict[str, Callable[..., Any]] = {
    drivers.ROUTE_FOLLOWER.name: _route_follower_kernels.drive,
    drivers.REFERENCE.name: _reference_kernels.drive,
    drivers.UN_R157.name: _un_r157_kernels.drive,
    drivers.FSM.name: _fsm_kernels.drive,
    drivers.CAREFUL.name: _careful_kernels.drive,
    drivers.CAREFUL_FSM.name: _careful_fsm_kernels.drive,
}
"""The kernel of each shipped driver: what it demands at an instant."""


def code_of(
    demands: Callable[..., Any], plan: Plan, networks: Roads, states: State, records: Record
) -> int:
    """Return the address of a driver's kernel for rows of such arrays, compiled if need be.

    Args:
        demands: the kernel.
        plan: the compiled storyboard.
        networks: the road networks.
        states: of N rows.
        records: of N rows.
    """
    rows = (row_type(roads) for roads in (networks, states, records))
    return address_of(demands, (types.int64, row_type(plan, 0), *rows))
