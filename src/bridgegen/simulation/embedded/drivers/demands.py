"""The shipped drivers by name: the kernel of each, compiled when it drives first."""

from collections.abc import Callable
from typing import Any

from bridgegen.drivers import (
    _careful_fsm_kernels,
    _careful_kernels,
    _fsm_kernels,
    _reference_kernels,
    _route_follower_kernels,
    _un_r157_kernels,
    drivers,
)

DEMANDS: dict[str, Callable[..., Any]] = {
    drivers.ROUTE_FOLLOWER.name: _route_follower_kernels.drive,
    drivers.REFERENCE.name: _reference_kernels.drive,
    drivers.UN_R157.name: _un_r157_kernels.drive,
    drivers.FSM.name: _fsm_kernels.drive,
    drivers.CAREFUL.name: _careful_kernels.drive,
    drivers.CAREFUL_FSM.name: _careful_fsm_kernels.drive,
}
"""The kernel of each shipped driver: what it demands at an instant."""
