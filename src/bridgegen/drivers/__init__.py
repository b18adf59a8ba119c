"""The system under test: drivers that an ego can have, those that ship and those of users.

Those that ship are compiled; users' run in processes of their own (`remote` is the protocol to
other languages). Imports `openx` and below.
"""

from bridgegen.drivers.address import is_remote
from bridgegen.drivers.drivers import (
    DRIVERS,
    GUESTS,
    OTHERS,
    STAGES,
    STORYBOARD,
    Driver,
    file_of,
    is_planner,
    is_spec,
    join,
    split,
)
from bridgegen.drivers.user_drivers import get

__all__ = [
    "DRIVERS",
    "GUESTS",
    "OTHERS",
    "STAGES",
    "STORYBOARD",
    "Driver",
    "file_of",
    "get",
    "is_planner",
    "is_remote",
    "is_spec",
    "join",
    "split",
]
