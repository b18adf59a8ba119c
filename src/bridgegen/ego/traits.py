"""What a driver of the user's says of itself, by attributes of its class."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bridgegen.ego.interface import WANTS
from bridgegen.errors import InputError

NAMES = ("wants", "period")
"""What a driver may say; each may be left out."""

PERIODS = (0.05, 0.5)
"""Least and greatest time [s] between two calls of a driver that states it."""


@dataclass(frozen=True)
class Traits:
    """What a driver says of itself.

    Attributes:
        wants: what it asks for, of `bridgegen.ego.interface.WANTS`.
        period: [s] between two calls of it; None if it is called at every instant.
        memory: how many numbers a compiled driver keeps; None for one that is called.
    """

    wants: tuple[str, ...] = ()
    period: float | None = None
    memory: int | None = None

    def steps(self, time_step: float) -> int:
        """Return how many time steps [s] there are from one call to the next: the nearest, >= 1."""
        if self.period is None:
            return 1
        return max(1, math.floor(self.period / time_step + 0.5))


def traits_of(said: Mapping[str, Any]) -> Traits:
    """Return what a driver says of itself, checked.

    Args:
        said: values of `NAMES`; None where it says nothing.

    Raises:
        InputError: a value that cannot be.
    """
    wants, period = (said.get(name) for name in NAMES)
    wants = () if wants is None else wants
    if not isinstance(wants, list | tuple) or not all(
        isinstance(one, str) and one in WANTS for one in wants
    ):
        raise InputError(f"wants must be a list of {', '.join(WANTS)}; got {_short(wants)}")
    low, high = PERIODS
    if period is not None and not (type(period) in (int, float) and low <= period <= high):
        raise InputError(f"period [s] must be in {low:g}..{high:g}, got {_short(period)}")
    return Traits(tuple(wants), None if period is None else float(period))


def _short(value: Any) -> str:
    return ascii(value)[:80]
