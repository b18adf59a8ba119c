"""What may vary (``Parameter``), what limits it (``Bound``), what follows (``Derived``)."""

import keyword
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from enum import StrEnum

from bridgegen.base.arrays import Float
from bridgegen.base.errors import ScenarioError, UnknownNameError
from bridgegen.base.units import has_unit, in_unit
from bridgegen.scenario.language.expression import RESERVED, Expression
from bridgegen.scenario.language.kinds import FLOAT, Kind
from bridgegen.scenario.language.prior import Prior

UNITS = {
    "m": "length",
    "m/s": "speed",
    "m/s²": "acceleration",
    "s": "time",
    "deg": "angle",
    "deg/s": "angular speed",
    "%": "share of the range of CARLA's weather parameters",
    "mm/h": "rain rate",
    "kg": "mass",
    "lx": "illuminance",
    "°C": "temperature",
    "1/m": "curvature",
    "count": "number of things",
    "1": "dimensionless",
}

_NAME = re.compile(r"[a-z][a-z0-9_]{0,63}")


class Axis(StrEnum):
    """The five axes of the search space (paper, Section III-A)."""

    STATIC = "static"
    TEMPORARY = "temporary"
    PARTICIPANTS = "participants"
    WEATHER = "weather"
    EXTENSION = "extension"


def read_axes(axes: Iterable[str]) -> tuple[Axis, ...]:
    """Return axes by name, each once, in the order of ``Axis``.

    Raises:
        UnknownNameError: no such axis.
    """
    # A single text is an iterable of its letters; it means one axis.
    names = {axes} if isinstance(axes, str) else set(axes)
    for name in sorted(names - set(Axis)):
        raise UnknownNameError("axis", name, list(Axis))
    return tuple(axis for axis in Axis if axis in names)


@dataclass(frozen=True)
class Parameter:
    """One quantity that may vary.

    Attributes:
        name: lower case, digits and underscores.
        axis: where it belongs.
        unit: one of ``UNITS``.
        low: smallest value.
        high: largest value.
        default: value while its axis is not searched.
        kind: what values it takes; low, high and default are its inner values.
        description: what it is, for people.
        source: where its range comes from.
        place: file and line that declare it, for messages.
        prior: how often its values are met; None: a search draws it evenly.

    Raises:
        ScenarioError: a rule is broken; all that are.
    """

    name: str
    axis: Axis
    unit: str
    low: float
    high: float
    default: float
    kind: Kind = FLOAT
    description: str = ""
    source: str = ""
    place: str = field(default="", compare=False, repr=False)
    prior: Prior | None = field(default=None, repr=False, kw_only=True)

    def __post_init__(self) -> None:
        label = f"{self.name} [{self.unit}]"
        values = {"low": self.low, "high": self.high, "default": self.default}
        problems = self._naming_problems()
        unusable = [key for key, value in values.items() if not math.isfinite(value)]
        problems += [f"{key} of {label} must be finite, got {values[key]}" for key in unusable]
        if not unusable:
            for key, value in zip(values, self.kind.inner(*values.values()), strict=True):
                # The dataclass is frozen, and its inner values replace the declared ones.
                object.__setattr__(self, key, value)
            problems += self.kind.problems(label, self.low, self.high, self.default)
        if self.kind.units and self.unit not in self.kind.units:
            units = ", ".join(self.kind.units)
            problems.append(f"{label} of kind {self.kind.name} must have the unit {units}")
        _refuse(problems, self.place)

    def at(self, share: Float, lo: Float | float, hi: Float | float) -> Float:
        """Return the values at shares of the interval that is left to it.

        Args:
            share: ``(N,)`` in [0, 1].
            lo: smallest value, one or ``(N,)``.
            hi: largest value, likewise.
        """
        return (self.prior or self.kind).at(share, lo, hi)

    def share(self, value: Float, lo: Float | float, hi: Float | float) -> Float:
        """Return the shares at which values are, ``(N,)``; 0.5 where any would do."""
        return (self.prior or self.kind).share(value, lo, hi)

    def shares(
        self, low: float, high: float, lo: Float | float, hi: Float | float
    ) -> tuple[Float, Float]:
        """Return the shares of the interval that is left to it at which values lie in a range.

        Args:
            low: smallest value, inclusive.
            high: largest value, inclusive.
            lo: smallest value that is left to it, one or ``(N,)``.
            hi: largest value, likewise.

        Returns:
            The first and the last share, one or ``(N,)`` each, in [0, 1]; the last is at most the
            first where no value, or but one of infinitely many, lies in the range.
        """
        return (self.prior or self.kind).shares(low, high, lo, hi)

    def ends(self, low: float, high: float) -> tuple[float, float] | None:
        """Return its lowest and its highest value in a range; None where it may take any there.

        The range holds a value of it at least.
        """
        return self.kind.ends(low, high)

    def read(self, given: float | str) -> float:
        """Return the inner value of what a user gives (`bridgegen.scenario.language.kinds`).

        A text may be a number with a unit, ``90 km/h``.

        Raises:
            ScenarioError: it is not of this kind, or its unit is of another dimension; it may be
                outside the range.
        """
        # A category is left out: its names are texts, and no number with a unit.
        if isinstance(given, str) and not self.kind.names and has_unit(given):
            try:
                given = in_unit(given, self.unit)
            except ValueError as error:
                raise ScenarioError(f"{self.name} {error}, got '{given}'") from None
        value = self.kind.read(given, self.low, self.high)
        if value is None:
            raise ScenarioError(f"{self.name} must be {self.kind.expected()}, got {given!r}")
        return value

    def _naming_problems(self) -> list[str]:
        return [
            *_name_problems(self.name),
            *_unit_problems(self.name, self.unit),
            *self.kind.naming_problems(self.name),
        ]


@dataclass(frozen=True)
class Bound:
    """An interval that earlier parameters leave to one parameter.

    Attributes:
        target: the parameter that is limited.
        lo: smallest value, or ``None``.
        hi: largest value, or ``None``.
        why: the reason in the world, one sentence.
        source: where the reason, or its numbers, come from.
        place: file and line that declare it, for messages.

    Raises:
        ScenarioError: neither ``lo`` nor ``hi``, or no reason or source.
    """

    target: str
    lo: Expression | None
    hi: Expression | None
    why: str
    source: str
    place: str = field(default="", compare=False, repr=False)

    def __post_init__(self) -> None:
        problems = _reason_problems(f"the bound on {self.target}", self.why, self.source)
        if self.lo is None and self.hi is None:
            problems.append(f"the bound on {self.target} needs lo or hi")
        _refuse(problems, self.place)

    @property
    def names(self) -> frozenset[str]:
        """The parameters that limit the target."""
        return frozenset().union(*(side.names for side in (self.lo, self.hi) if side))

    def __str__(self) -> str:
        """Return the rule as read: ``cloudiness >= 0.5*precipitation``."""
        low = f"{self.target} >= {self.lo}" if self.lo else ""
        high = f"{self.target} <= {self.hi}" if self.hi else ""
        return " and ".join(side for side in (low, high) if side)


@dataclass(frozen=True)
class Derived:
    """A quantity that follows from others.

    Attributes:
        name: as a parameter's.
        axis: where it belongs.
        unit: one of ``UNITS``.
        value: its formula.
        why: the reason in the world, one sentence.
        source: where the formula comes from.
        description: what it is, for people.
        place: file and line that declare it, for messages.

    Raises:
        ScenarioError: a rule is broken; all that are.
    """

    name: str
    axis: Axis
    unit: str
    value: Expression
    why: str
    source: str
    description: str = ""
    place: str = field(default="", compare=False, repr=False)

    def __post_init__(self) -> None:
        _refuse(
            [
                *self._naming_problems(),
                *_reason_problems(f"the derived {self.name}", self.why, self.source),
            ],
            self.place,
        )

    def _naming_problems(self) -> list[str]:
        return [*_name_problems(self.name), *_unit_problems(self.name, self.unit)]

    @property
    def names(self) -> frozenset[str]:
        """The quantities that it follows from."""
        return self.value.names

    def __str__(self) -> str:
        """Return the rule as read: ``fog_distance = 100 - fog_density``."""
        return f"{self.name} = {self.value}"


def nearest(name: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean '…'?"`` for the known name next to ``name``, or nothing."""
    near = get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{near[0]}'?" if near else ""


def at(place: str) -> str:
    """Return a place as the end of a message, or nothing."""
    return f" ({place})" if place else ""


def _name_problems(name: str) -> list[str]:
    if not _NAME.fullmatch(name):
        return [f"a name is lower case letters, digits and '_', 64 at most, got '{name}'"]
    if keyword.iskeyword(name) or name in RESERVED:
        return [f"'{name}' has a meaning in formulas and cannot name a parameter"]
    return []


def _unit_problems(name: str, unit: str) -> list[str]:
    if unit in UNITS:
        return []
    return [f"unknown unit '{unit}' of {name}; known: {', '.join(UNITS)}"]


def _reason_problems(label: str, why: str, source: str) -> list[str]:
    given = {"why": why, "source": source}
    return [f"{label} must say its {key}" for key, text in given.items() if not text.strip()]


def _refuse(problems: list[str], place: str) -> None:
    if problems:
        raise ScenarioError(*(problem + at(place) for problem in problems))
