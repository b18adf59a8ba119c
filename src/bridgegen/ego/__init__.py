"""Systems under test: the drivers that an ego can have, by name."""

from bridgegen.ego.drivers import (
    DRIVERS,
    GUESTS,
    OTHERS,
    STAGES,
    STORYBOARD,
    Driver,
    get,
    is_spec,
    join,
    split,
)

__all__ = [
    "DRIVERS",
    "GUESTS",
    "OTHERS",
    "STAGES",
    "STORYBOARD",
    "Driver",
    "get",
    "is_spec",
    "join",
    "split",
]
