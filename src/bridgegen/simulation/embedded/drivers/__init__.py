"""What drives the ego and attentive participants, and how their demands move them."""

from bridgegen.simulation.embedded.drivers._chassis_kernels import move_chassis, move_multi_body
from bridgegen.simulation.embedded.drivers._conflict_view_kernels import see_conflicts_of_rows
from bridgegen.simulation.embedded.drivers._ego_kernels import (
    begin_control,
    begin_waiting,
    demand,
    ego_is_through,
    egos_are_through,
    heed,
    impose_rows,
    is_steered,
    move_heeding,
    move_paced,
    move_steered,
    take,
)
from bridgegen.simulation.embedded.drivers._lane_view_kernels import LANES, see_lanes_of_rows
from bridgegen.simulation.embedded.drivers._map_view_kernels import MEMORY, see_map_of_rows
from bridgegen.simulation.embedded.drivers._observation_kernels import observe_rows
from bridgegen.simulation.embedded.drivers._own_driver_kernels import (
    ACCELERATION,
    ANSWER,
    CURVATURE,
    EGO,
    N_INPUTS,
    RETURNED,
    ask,
    fill_input_rows,
)
from bridgegen.simulation.embedded.drivers.demands import DEMANDS

__all__ = [
    "ACCELERATION",
    "ANSWER",
    "CURVATURE",
    "DEMANDS",
    "EGO",
    "LANES",
    "MEMORY",
    "N_INPUTS",
    "RETURNED",
    "ask",
    "begin_control",
    "begin_waiting",
    "demand",
    "ego_is_through",
    "egos_are_through",
    "fill_input_rows",
    "heed",
    "impose_rows",
    "is_steered",
    "move_chassis",
    "move_heeding",
    "move_multi_body",
    "move_paced",
    "move_steered",
    "observe_rows",
    "see_conflicts_of_rows",
    "see_lanes_of_rows",
    "see_map_of_rows",
    "take",
]
