"""What concerns all entities: weather, time of day, traffic lights, parameters and variables."""

from bridgegen.simulation.embedded.world._global_kernels import begin_global, set_clock, time_of_day
from bridgegen.simulation.embedded.world._signal_kernels import (
    DURATION,
    enter_phase,
    run_controllers,
    start_controllers,
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
