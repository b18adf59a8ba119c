"""What the process of a user's driver says of the driver when it has started."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from bridgegen.ego.interface import WANTS
from bridgegen.errors import InputError, UnknownNameError

PERIODS = (0.05, 0.5)
"""Least and greatest time [s] between two calls of a driver that states it."""


@dataclass(frozen=True)
class DriverFacts:
    """What is known of a user's driver before it drives.

    Attributes:
        memory: how many numbers a compiled driver keeps; None for one called in Python.
        wants: words of `WANTS`, in its order.
        period: [s] between two calls of it; None if it is called at every instant.
    """

    memory: int | None = None
    wants: tuple[str, ...] = ()
    period: float | None = None

    def steps(self, time_step: float) -> int:
        """Return how many time steps [s] there are from one call to the next: the nearest, >= 1."""
        if self.period is None:
            return 1
        return max(1, math.floor(self.period / time_step + 0.5))


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


def checked_period(period: Any) -> float | None:
    """Return the time between two calls that a driver states [s]; None where it states none.

    Raises:
        InputError: it is no number, or not within `PERIODS`.
    """
    low, high = PERIODS
    if period is None:
        return None
    if type(period) not in (int, float) or not low <= period <= high:
        raise InputError(f"period [s] must be in {low:g}..{high:g}, got {ascii(period)[:80]}")
    return float(period)
