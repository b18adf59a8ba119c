"""Lanes that come with a recording, as it describes them."""

from dataclasses import dataclass

from bridgegen.base.arrays import Float


@dataclass(frozen=True, eq=False)
class Lanelet:
    """A piece of a lane between two bounds, which run in the direction of travel.

    Attributes:
        name: the recording's own.
        left: ``(n, 2)`` of the left bound [m].
        right: ``(m, 2)`` of the right bound [m].
        left_same: name of the neighbour to the left in the same direction; "" for none.
        right_same: to the right.
        left_opposite: to the left in the other direction.
        successors: names of those that it leads to.
        kinds: what it is for, in the recording's words.
        is_marked: it lies between painted markings that the recording gives, and has its name.
    """

    name: str
    left: Float
    right: Float
    left_same: str = ""
    right_same: str = ""
    left_opposite: str = ""
    successors: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    is_marked: bool = False
