"""How entities move along and across their paths, and how the actions that move them begin."""

from bridgegen.simulation.embedded.motion._across_kernels import begin_lane_change
from bridgegen.simulation.embedded.motion._begin_kernels import (
    BEGINS,
    begin_motion,
    steers,
    stop_motion,
)
from bridgegen.simulation.embedded.motion._follow_kernels import (
    arrive,
    at_time,
    move_by_timetable,
    stop_follow,
)
from bridgegen.simulation.embedded.motion._lamp_kernels import show_lamps
from bridgegen.simulation.embedded.motion._laying_kernels import move_laid, pose_along
from bridgegen.simulation.embedded.motion._pedal_kernels import (
    command_by_pedals,
    move_pedals,
    pressed,
    steered,
)
from bridgegen.simulation.embedded.motion._presence_kernels import (
    is_pointless,
    leave_out_absent,
    look_round,
    note_presence,
    stay_away,
)
from bridgegen.simulation.embedded.motion._pursuit_kernels import (
    follow_course,
    start_at_distance,
    start_at_speed,
)
from bridgegen.simulation.embedded.motion._speed_kernels import command_speed, stop_longitudinal
from bridgegen.simulation.embedded.motion._steering_kernels import note, steer
from bridgegen.simulation.embedded.motion._towing_kernels import start_towed, tow
from bridgegen.simulation.embedded.motion._travel_kernels import (
    ENDS,
    LANDS,
    move_along_path,
    pass_end,
)

__all__ = [
    "BEGINS",
    "ENDS",
    "LANDS",
    "arrive",
    "at_time",
    "begin_lane_change",
    "begin_motion",
    "command_by_pedals",
    "command_speed",
    "follow_course",
    "is_pointless",
    "leave_out_absent",
    "look_round",
    "move_along_path",
    "move_by_timetable",
    "move_laid",
    "move_pedals",
    "note",
    "note_presence",
    "pass_end",
    "pose_along",
    "pressed",
    "show_lamps",
    "start_at_distance",
    "start_at_speed",
    "start_towed",
    "stay_away",
    "steer",
    "steered",
    "steers",
    "stop_follow",
    "stop_longitudinal",
    "stop_motion",
    "tow",
]
