"""Systems under test: the drivers that an ego can have, by name."""

from bridgegen.ego.drivers import (
    DRIVERS,
    GUESTS,
    OTHERS,
    STAGES,
    STORYBOARD,
    Driver,
    is_planner,
    is_spec,
    join,
    split,
)
from bridgegen.ego.own_file import get

__all__ = [
    "DRIVERS",
    "GUESTS",
    "OTHERS",
    "STAGES",
    "STORYBOARD",
    "Driver",
    "get",
    "is_planner",
    "is_spec",
    "join",
    "split",
]
