"""What concerns all entities: weather, time of day, traffic lights, parameters and variables."""

from bridgegen.simulation.embedded.world._world_kernels import (
    DURATION,
    begin_global,
    enter_phase,
    run_controllers,
    set_clock,
    start_controllers,
    time_of_day,
)

__all__ = [
    "DURATION",
    "begin_global",
    "enter_phase",
    "run_controllers",
    "set_clock",
    "start_controllers",
    "time_of_day",
]
