"""What the process of a user's driver says of the driver when it has started."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from bridgegen.ego.interface import WANTS
from bridgegen.errors import InputError, UnknownNameError


@dataclass(frozen=True)
class DriverFacts:
    """What is known of a user's driver before it drives.

    Attributes:
        memory: how many numbers a compiled driver keeps; None for one called in Python.
        wants: words of `WANTS`, in its order.
    """

    memory: int | None = None
    wants: tuple[str, ...] = ()


def checked_wants(wants: Any) -> tuple[str, ...]:
    """Return what a driver says that it wants.

    Raises:
        InputError: not words of `WANTS`, or one of them twice.
    """
    if isinstance(wants, str) or not isinstance(wants, Iterable):
        raise InputError(f'wants must be a tuple of words, such as ("lanes",), got {wants!r}')
    words = tuple(wants)
    for word in words:
        if word not in WANTS:
            raise UnknownNameError("word in wants", str(word), WANTS)
        if words.count(word) > 1:
            raise InputError(f"wants must name '{word}' once, got {words!r}")
    return words
