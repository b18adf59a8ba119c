"""How entities move along and across their paths, and how the actions that move them begin."""

from bridgegen.simulation.embedded.motion._across_kernels import (
    begin_lane_change,
    begin_lane_offset,
    stop_lateral,
)
from bridgegen.simulation.embedded.motion._aside_kernels import begin_lateral_distance
from bridgegen.simulation.embedded.motion._follow_kernels import (
    arrive,
    at_time,
    begin_follow,
    begin_route,
    begin_teleport,
    move_by_timetable,
    stop_follow,
    stop_route,
)
from bridgegen.simulation.embedded.motion._presence_kernels import (
    begin_add,
    begin_delete,
    is_pointless,
    leave_out_absent,
    stay_away,
)
from bridgegen.simulation.embedded.motion._pursuit_kernels import start_at_speed
from bridgegen.simulation.embedded.motion._speed_kernels import (
    begin_longitudinal,
    command_speed,
    stop_longitudinal,
)
from bridgegen.simulation.embedded.motion._steering_kernels import note, steer
from bridgegen.simulation.embedded.motion._travel_kernels import ENDS, move_along_path, pass_end

__all__ = [
    "ENDS",
    "arrive",
    "at_time",
    "begin_add",
    "begin_delete",
    "begin_follow",
    "begin_lane_change",
    "begin_lane_offset",
    "begin_lateral_distance",
    "begin_longitudinal",
    "begin_route",
    "begin_teleport",
    "command_speed",
    "is_pointless",
    "leave_out_absent",
    "move_along_path",
    "move_by_timetable",
    "note",
    "pass_end",
    "start_at_speed",
    "stay_away",
    "steer",
    "stop_follow",
    "stop_lateral",
    "stop_longitudinal",
    "stop_route",
]
