"""Drivers of users: their files, and what they say of themselves by attributes."""

import ast
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.drivers import drivers
from bridgegen.drivers.address import is_remote
from bridgegen.drivers.interface import WANTS
from bridgegen.drivers.tunable import Tunable

# --- A driver's file named without its class: what it could be called ---


MAX_BYTES = 2**20


def get(name: str, ideal: Iterable[str] = (), time_limit: float | None = None) -> drivers.Driver:
    """Return a driver by name; see `bridgegen.drivers.drivers.get`.

    Raises:
        InputError: a file without the class in it; names the classes and functions that it has.
    """
    if name.endswith(".py") and not is_remote(name):
        raise InputError(
            f"a driver in a file is named FILE.py:CLASS, or FILE.py:FUNCTION if it is compiled, "
            f"got '{name}'; {_names_in(name)}"
        )
    return drivers.get(name, ideal, time_limit)


def _names_in(name: str) -> str:
    """Say what a file defines, without running it."""
    try:
        with Path(name).open("rb") as file:
            body = ast.parse(file.read(MAX_BYTES)).body
    except OSError as error:
        return f"the file cannot be read: {error.strerror}"
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        return f"the file is no Python: {error}"
    kinds = (ast.ClassDef, ast.FunctionDef)
    found = [stmt for stmt in body if isinstance(stmt, kinds) and not stmt.name.startswith("_")]
    if not found:
        return "it defines no class and no function"
    return "it defines " + ", ".join(f"{name}:{def_.name}" for def_ in found)


# --- What a driver of the user's says of itself, by attributes of its class or by a message ---


NAMES = ("wants", "period", "max_rows")
"""Attributes that a user's driver may have; each may be left out."""

PERIODS = (0.05, 0.5)
"""Least and greatest time [s] between two calls of a driver that states it."""


@dataclass(frozen=True)
class Traits:
    """What a driver says of itself.

    Attributes:
        wants: what it asks for, of `bridgegen.drivers.interface.WANTS`.
        period: [s] between two calls of it; None if it is called at every instant.
        max_rows: how many scenarios it can drive at once; None for any number.
        memory: how many numbers a compiled driver keeps; None for one that is called.
        tunable: its numbers that may be set.
    """

    wants: tuple[str, ...] = ()
    period: float | None = None
    max_rows: int | None = None
    memory: int | None = None
    tunable: tuple[Tunable, ...] = ()

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
    wants, period, most = (said.get(name) for name in NAMES)
    wants = checked_wants(() if wants is None else wants)
    low, high = PERIODS
    if period is not None and not (type(period) in (int, float) and low <= period <= high):
        raise InputError(f"period [s] must be in {low:g}..{high:g}, got {_short(period)}")
    if most is not None and not (type(most) is int and most > 0):
        raise InputError(f"max_rows must be a whole number > 0, got {_short(most)}")
    return Traits(wants, None if period is None else float(period), most)


def checked_wants(wants: Any) -> tuple[str, ...]:
    """Return what a driver says that it wants.

    Raises:
        InputError: not words of `WANTS`, or one of them twice.
    """
    if not isinstance(wants, list | tuple):
        raise InputError(f'wants must be a tuple of words, such as ("lanes",), got {_short(wants)}')
    words = tuple(wants)
    for word in words:
        if not isinstance(word, str) or word not in WANTS:
            raise UnknownNameError("word in wants", str(word)[:80], WANTS)
        if words.count(word) > 1:
            raise InputError(f"wants must name '{word}' once, got {_short(words)}")
    return words


def _short(value: Any) -> str:
    return ascii(value)[:80]
