"""Tunable numbers of drivers: what a driver declares, and files of settings that it reads.

A driver's class has ``tunable = {"headway": (1.5, 0.5, 3.0, "s")}``: default, least and greatest
value, and a unit if there is one. ``--ego my.py:Driver@settings.yaml`` drives with other values.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridgegen.base.errors import FileFormatError, InputError, UnknownNameError
from bridgegen.drivers.address import is_remote

MOST, SHAPE = 64, "(default, low, high) or (default, low, high, unit), finite numbers"
"""Largest number of tunable numbers of a driver, and what each of them has."""

Settings = tuple[tuple[str, float], ...]
"""Names of tunable numbers, and their values; those that are not named have their defaults."""


@dataclass(frozen=True)
class Tunable:
    """A number of a driver that may be set.

    Attributes:
        name: an identifier.
        default: what it is without settings.
        low: its least value.
        high: its greatest value.
        unit: of all three; "" if it has none.
    """

    name: str
    default: float
    low: float
    high: float
    unit: str = ""

    def text(self, value: float) -> str:
        """Return a value with the unit."""
        return f"{value:g} {self.unit}".rstrip()


def checked_tunable(said: Any) -> tuple[Tunable, ...]:
    """Return the tunable numbers that a driver declares; none of None.

    Raises:
        InputError: one has no range, or its default lies outside; all that do.
    """
    if not isinstance(said, Mapping | None) or len(said or ()) > MOST:
        raise InputError(
            f"tunable must map at most {MOST} names to {SHAPE}, got {ascii(said)[:80]}"
        )
    found, problems = [], []
    for name, stated in (said or {}).items():
        parts = stated if isinstance(stated, list | tuple) else ()
        numbers, unit = [_number(part) for part in parts[:3]], "".join(map(str, parts[3:]))
        if len(parts) not in (3, 4) or None in numbers or not str(name).isidentifier():
            problems.append(f"tunable: {name!s:.80} must have {SHAPE}, got {ascii(stated)[:80]}")
            continue
        default, low, high = (float(part) for part in parts[:3])
        if not (low < high and low <= default <= high):
            problems.append(
                f"tunable: low < high and low <= default <= high must hold for {name} "
                f"[{unit or '1'}], got default={default:g}, low={low:g}, high={high:g}"
            )
        found.append(Tunable(str(name), default, low, high, unit[:20]))
    if problems:
        raise InputError(*problems)
    return tuple(found)


def _number(value: Any) -> float | None:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if is_number and math.isfinite(value) else None


# --- Files of settings ---


SUFFIXES = (".yaml", ".yml", ".json")


def split_settings(driver: str) -> tuple[str, Path | None]:
    """Return a driver's name without its file of settings, and that file; None if it has none."""
    plain, at, file = driver.rpartition("@")
    if not (plain and at and file.lower().endswith(SUFFIXES)) or is_remote(driver):
        return driver, None
    return plain, Path(file)


def read_settings(path: Path) -> Settings:
    """Return the numbers of a file: ``headway: 1.8``, or ``headway: {old: 1.5, new: 1.8}``.

    Raises:
        FileFormatError: it cannot be read, or says something else.
    """
    from bridgegen.scenario.language.plain_yaml import read_plain_yaml  # takes a while

    try:
        document = read_plain_yaml(path.read_bytes(), str(path))
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    data = document.data
    if not isinstance(data, dict) or not data:
        raise FileFormatError(f"{path}: must hold names of tunable numbers with their values")
    found = []
    for name, stated in data.items():
        value = _number(stated.get("new") if isinstance(stated, dict) else stated)
        if value is None:
            raise FileFormatError(
                f"{name} must be a number, or {{old: …, new: …}} with one ({document.at((name,))})"
            )
        found.append((str(name), value))
    return tuple(found)


def values_of(tunable: tuple[Tunable, ...], settings: Settings, driver: str) -> dict[str, float]:
    """Return the value of each tunable number of a driver.

    Raises:
        InputError: it declares none, or a value is out of range.
        UnknownNameError: it declares others.
    """
    known = {item.name: item for item in tunable}
    if settings and not known:
        raise InputError(
            f"the driver '{driver}' declares no tunable numbers (tunable), so no settings can be "
            "given to it"
        )
    values = {item.name: item.default for item in tunable}
    for name, value in settings:
        if name not in known:
            raise UnknownNameError(f"tunable number of '{driver}'", name, known)
        item = known[name]
        if not item.low <= value <= item.high:
            raise InputError(
                f"{name} of '{driver}' must be {item.text(item.low)} to {item.text(item.high)}, "
                f"got {item.text(value)}"
            )
        values[name] = value
    return values
