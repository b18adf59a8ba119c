"""What a driver of the user's says of itself, by attributes of its class or by a message."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bridgegen.ego.interface import WANTS
from bridgegen.errors import InputError

NAMES = ("wants", "period", "max_rows")
"""What a driver may say; each may be left out."""

MAX_PERIOD = 10.0
"""Greatest time [s] between two plans of a driver."""


@dataclass(frozen=True)
class Traits:
    """What a driver says of itself.

    Attributes:
        wants: what it asks for, of `bridgegen.ego.interface.WANTS`.
        period: [s] between two of its plans; None if it is asked at every instant.
        max_rows: how many scenarios it can drive at once; None for any number.
        memory: how many numbers a compiled driver keeps; None for one that is called.
    """

    wants: tuple[str, ...] = ()
    period: float | None = None
    max_rows: int | None = None
    memory: int | None = None


def traits_of(said: Mapping[str, Any]) -> Traits:
    """Return what a driver says of itself, checked.

    Args:
        said: values of `NAMES`; None where it says nothing.

    Raises:
        InputError: a value that cannot be.
    """
    wants, period, most = (said.get(name) for name in NAMES)
    wants = () if wants is None else wants
    if not isinstance(wants, list | tuple) or not all(
        isinstance(one, str) and one in WANTS for one in wants
    ):
        raise InputError(f"wants must be a list of {', '.join(WANTS)}; got {_short(wants)}")
    if period is not None and not (type(period) in (int, float) and 0.0 < period <= MAX_PERIOD):
        raise InputError(f"period must be > 0 and at most {MAX_PERIOD:g} s, got {_short(period)}")
    if most is not None and not (type(most) is int and most > 0):
        raise InputError(f"max_rows must be a whole number > 0, got {_short(most)}")
    return Traits(tuple(wants), None if period is None else float(period), most)


def _short(value: Any) -> str:
    return ascii(value)[:80]
