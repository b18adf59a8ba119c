"""The kinds of parameters: what values one takes, how it is decoded, binned, perturbed and shown.

A row of X holds a float64 for every parameter, the *inner* value:

============  ====================================  ============================================
kind          inner value                           as people and files read it
============  ====================================  ============================================
``float``     any number from low to high           the number
``integer``   a whole number from low to high       the number
``category``  the number of one of its names, 0 …   the name
``angle``     low to high, where high is raised by  the angle within one turn (``Angle.shown``)
              360° if it is below low
============  ====================================  ============================================

A kind of one's own is a subclass of `Kind` here, named in ``KINDS``.
"""

import keyword
import math
import re
from abc import ABC
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.units import PATTERN
from bridgegen.scenario.language.expression import RESERVED

# Every check of a bound or a derived value allows TOLERANCE·(1 + |limit|): values that passed
# through a file rounded to four decimals still keep their bounds, and no physical quantity here
# is known better. One constant, so that the decoder and the SHACL shapes cannot disagree.
TOLERANCE = 1e-4

TURN = 360.0
"""Full turn [deg]."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
MOST_NAMES = 100

Value = Float | float
Show = Callable[[float], str]


def slack(limit: Value) -> Float:
    """Return by how much a value may miss ``limit`` and still keep it."""
    return np.asarray(TOLERANCE * (1.0 + np.abs(limit)))


class Kind(ABC):
    """A kind of parameter; this one takes any number of its range.

    Attributes:
        name: in a scenario file.
        keys: those of a parameter in a scenario file that it needs, besides what all have.
        units: those that it may have; None: any.
        apart: whether its values are single ones, of which each has a bin of its own.
        names: of its values, in the order of the inner values; empty where they are numbers.
        turn: the largest of the angles that people read; None where it is no angle.
    """

    name: ClassVar[str]
    keys: ClassVar[tuple[str, ...]] = ("unit", "low", "high")
    units: ClassVar[tuple[str, ...] | None] = None
    apart: ClassVar[bool] = False
    names: tuple[str, ...] = ()
    turn: float | None = None

    def __repr__(self) -> str:
        return repr(self.name)

    @classmethod
    def schema(cls) -> dict[str, Any]:
        """Return what JSON Schema asks of a parameter of this kind, besides what all have."""
        without = {key: {"type": "null"} for key in KEYS if key not in cls.keys}
        return {"required": list(cls.keys), "properties": without | cls._default_schema()}

    @classmethod
    def _default_schema(cls) -> dict[str, Any]:
        measured = {"type": "string", "pattern": PATTERN}
        return {"default": {"anyOf": [{"type": "number"}, measured]}}

    # -- what a file declares ------------------------------------------------------------------

    @classmethod
    def declared(cls, names: Sequence[str], low: float | None, high: float | None) -> "Kind":
        """Return the kind that a scenario file declares, with its settings of ``keys``."""
        return cls()

    def limits(self, low: float | None, high: float | None) -> tuple[float, float]:
        """Return the ends that a scenario file declares; NaN where it should, and does not."""
        return math.nan if low is None else low, math.nan if high is None else high

    def inner(self, low: float, high: float, default: float) -> tuple[float, float, float]:
        """Return the ends and the default of the inner values, of those that are declared."""
        return low, high, default

    def problems(self, label: str, low: float, high: float, default: float) -> list[str]:
        """Return what is wrong with finite ends and default, as `inner` returns them."""
        if low > high:
            return [f"low <= high must hold for {label}, got low={low}, high={high}"]
        if not low <= default <= high:
            return [
                f"low <= default <= high must hold for {label}, "
                f"got low={low}, default={default}, high={high}"
            ]
        return []

    def naming_problems(self, label: str) -> list[str]:
        """Return what is wrong with the names of its values, for a scenario file of ours."""
        return []

    def read(self, given: float | str, low: float, high: float) -> float | None:
        """Return the inner value of what a user gives; None where it is not of this kind.

        It may lie outside the range.
        """
        return None if isinstance(given, str) else float(given)

    def expected(self) -> str:
        """Return the valid values in words, for messages."""
        return "a number"

    # -- the decoder ---------------------------------------------------------------------------

    def at(self, share: Float, lo: Value, hi: Value) -> Float:
        """Return the values at shares of the interval that is left to a parameter.

        Args:
            share: ``(N,)`` in [0, 1].
            lo: smallest value, one or ``(N,)``.
            hi: largest value, likewise.
        """
        value = np.add(lo, share * (hi - lo))
        return np.minimum(np.maximum(value, lo), hi)  # rounding may leave the interval by a bit

    def share(self, value: Float, lo: Value, hi: Value) -> Float:
        """Return the shares at which values are, ``(N,)``; 0.5 where any would do."""
        return _divided(value - lo, np.broadcast_to(hi - lo, len(value)))

    def shares(self, low: float, high: float, lo: Value, hi: Value) -> tuple[Float, Float]:
        """Return the first and the last share of an interval at which values lie in a range.

        See `bridgegen.scenario.language.parameters.Parameter.shares`.
        """
        return _shares(low, high, lo, hi, 0.0)

    def ends(self, low: float, high: float) -> tuple[float, float] | None:
        """Return the lowest and the highest value in a range; None where it may take any there."""
        return None

    def narrowed(self, lo: Value, hi: Value) -> tuple[Value, Value, Bool]:
        """Return the interval that bounds leave to a parameter, and where that is empty."""
        return lo, hi, ~np.atleast_1d(lo <= hi + slack(hi))  # true for NaN, too

    def kept(self, value: Float) -> tuple[Bool, str] | None:
        """Return which values are of this kind, and the rule; None where all are."""
        return None

    def nearest(self, value: Float, lo: Value, hi: Value) -> Float:
        """Return the value in an interval that is nearest to a wanted one, ``(N,)``.

        Args:
            value: ``(N,)`` wanted.
            lo: smallest value, one or ``(N,)``.
            hi: largest value, likewise.
        """
        return np.minimum(np.maximum(value, lo), hi)

    # -- distances -----------------------------------------------------------------------------

    def reach(self, low: float, high: float) -> float:
        """Return the range of which neighbours of a row move by a share; 0: they never move."""
        return high - low

    def step(self, low: float, high: float, share: float) -> float:
        """Return a step on the way to another value: a share of the range, above 0."""
        return share * (high - low)

    def coordinates(self, value: Float, low: float, high: float) -> Float:
        """Return coordinates ``(N, k)`` whose Euclidean distance is that of values: 1 at most.

        Args:
            value: ``(N,)``.
            low: of the declared range.
            high: of the declared range, above low.
        """
        shares: Float = (value - low) / (high - low)
        return shares[:, np.newaxis]

    # -- coverage ------------------------------------------------------------------------------

    def edges(self, low: float, high: float, bins: int) -> Float:
        """Return the edges of the bins of a declared range, ascending."""
        return np.linspace(low, high, bins + 1)

    # -- words ---------------------------------------------------------------------------------

    def shown(self, value: float) -> float:
        """Return the number that people read for an inner value."""
        return value

    def written(self, value: float) -> float | str:
        """Return what files with results hold for an inner value; `read` takes it back."""
        return self.shown(value)

    def text(self, value: float, number: Show) -> str:
        """Return a value as people read it."""
        return number(self.shown(value))

    def range_text(
        self, low: float, high: float, number: Show, *, low_counts: bool, high_counts: bool
    ) -> str:
        """Return a range as people read it; an end that does not count excludes nothing.

        Args:
            low: smallest value, inside.
            high: largest value, inside.
            number: how a number is written.
            low_counts: whether it leaves values below.
            high_counts: whether it leaves values above.
        """
        if low == high:
            return f"= {self.text(low, number)}"
        if low_counts and high_counts:
            return f"in {self.text(low, number)} .. {self.text(high, number)}"
        return f"≥ {self.text(low, number)}" if low_counts else f"≤ {self.text(high, number)}"

    def span_text(self, low: float, high: float, number: Show, unit: str = "") -> str:
        """Return a declared range as people read it: ``1 to 3 m``, or all names."""
        return f"{self.text(low, number)} to {self.text(high, number)}{unit}"

    def need_text(self, sign: str, limit: float, low: float, high: float, number: Show) -> str:
        """Return what harm needs of a parameter besides sign and limit; else "".

        Args:
            sign: ">=" or "<=".
            limit: harm persists as far as here.
            low: of the declared range.
            high: of the declared range.
            number: how a number is written.
        """
        return ""

    def within(self, low: float, high: float) -> tuple[str, ...]:
        """Return the names of the values from low to high; none where they are numbers."""
        return ()

    def labels(self) -> dict[str, Any]:
        """Return what a page needs to write an inner value as people read it."""
        return {}

    def rule(self, name: str, low: float, high: float) -> str:
        """Return the rule that a parameter's inner value keeps."""
        return f"{low:g} <= {name} <= {high:g}"

    # -- the ontology --------------------------------------------------------------------------

    def sparql_value(self, raw: str) -> str:
        """Return the SPARQL expression of the inner value of what a graph holds."""
        return f"xsd:double({raw})"

    def sparql_inside(self, raw: str) -> str | None:
        """Return the filter that what a graph holds keeps; None: between the range's ends."""
        return None

    def sparql_kept(self, x: str) -> tuple[str, str] | None:
        """Return the filter that an inner value keeps besides its range, and the rule; or None."""
        return None


@dataclass(frozen=True, repr=False)
class Number(Kind):
    """Any number of a range."""

    name = "float"


@dataclass(frozen=True, repr=False)
class Whole(Kind):
    """The whole numbers of a range."""

    name = "integer"
    apart = True

    def problems(self, label: str, low: float, high: float, default: float) -> list[str]:
        """See `Kind`."""
        values = {"low": low, "high": high, "default": default}
        return super().problems(label, low, high, default) + [
            f"{key} of {label} must be a whole number, got {value}"
            for key, value in values.items()
            if value != math.floor(value)
        ]

    def expected(self) -> str:
        """See `Kind`."""
        return "a whole number"

    def at(self, share: Float, lo: Value, hi: Value) -> Float:
        """See `Kind`."""
        # Each whole number has the same part of the shares; rounding lo + share * (hi - lo) would
        # give the two ends half of one.
        value = np.floor(lo + share * (hi - lo + 1.0))
        return np.minimum(np.maximum(value, lo), hi)

    def share(self, value: Float, lo: Value, hi: Value) -> Float:
        """See `Kind`."""
        # The middle of the number's part: rounding errors on the way back to `at` do not reach the
        # next number.
        return _divided(value - lo + 0.5, np.broadcast_to(hi - lo, len(value)) + 1.0)

    def shares(self, low: float, high: float, lo: Value, hi: Value) -> tuple[Float, Float]:
        """See `Kind`."""
        return _shares(math.ceil(low), math.floor(high), lo, hi, 1.0)

    def ends(self, low: float, high: float) -> tuple[float, float] | None:
        """See `Kind`."""
        return float(math.ceil(low)), float(math.floor(high))

    def narrowed(self, lo: Value, hi: Value) -> tuple[Value, Value, Bool]:
        """See `Kind`."""
        # A bound that a formula computes may miss a whole number by its rounding error; without the
        # tolerance that number would be lost.
        lo, hi = np.ceil(lo - TOLERANCE), np.floor(hi + TOLERANCE)
        return lo, hi, ~np.atleast_1d(lo <= hi)

    def kept(self, value: Float) -> tuple[Bool, str] | None:
        """See `Kind`."""
        return np.abs(value - np.round(value)) <= TOLERANCE, self.expected()

    def nearest(self, value: Float, lo: Value, hi: Value) -> Float:
        """See `Kind`."""
        return super().nearest(np.floor(value + 0.5), lo, hi)

    def step(self, low: float, high: float, share: float) -> float:
        """See `Kind`."""
        return max(1.0, float(np.floor(share * (high - low) + 0.5)))

    def edges(self, low: float, high: float, bins: int) -> Float:
        """See `Kind`."""
        return np.arange(low, high + 2.0) - 0.5

    def sparql_kept(self, x: str) -> tuple[str, str] | None:
        """See `Kind`."""
        return f"ABS({x} - ROUND({x})) <= {TOLERANCE!r}e0", self.expected()


@dataclass(frozen=True, repr=False)
class Category(Whole):
    """One of some names, which have no order.

    Attributes:
        names: of the values; a row holds the number of one, from 0.
    """

    names: tuple[str, ...] = ()

    name = "category"
    keys = ("values",)
    units = ("1",)

    def __repr__(self) -> str:
        return f"category{self.names}"

    @classmethod
    def _default_schema(cls) -> dict[str, Any]:
        return {"default": {"type": "string"}}

    @classmethod
    def declared(cls, names: Sequence[str], low: float | None, high: float | None) -> "Category":
        """See `Kind`."""
        return cls(tuple(names))

    def limits(self, low: float | None, high: float | None) -> tuple[float, float]:
        """See `Kind`: all names."""
        return 0.0, float(len(self.names) - 1)

    def problems(self, label: str, low: float, high: float, default: float) -> list[str]:
        """See `Kind`: all of it is within the names."""
        return []

    def naming_problems(self, label: str) -> list[str]:
        """See `Kind`."""
        found = [
            f"a value of the category {label} must be a word of letters, digits and '_', "
            f"64 at most, that means nothing else in formulas, got '{name}'"
            for name in self.names
            if not _NAME.fullmatch(name) or keyword.iskeyword(name) or name in RESERVED
        ]
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        found += [f"the category {label} must have each value once, got '{name}'" for name in twice]
        if not 2 <= len(self.names) <= MOST_NAMES:
            found.append(
                f"the category {label} must have 2 to {MOST_NAMES} values, got {len(self.names)}"
            )
        return found

    def read(self, given: float | str, low: float, high: float) -> float | None:
        """See `Kind`."""
        if isinstance(given, str):
            return float(self.names.index(given)) if given in self.names else None
        return float(given) if given in range(len(self.names)) else None

    def expected(self) -> str:
        """See `Kind`."""
        return f"one of {', '.join(self.names)}"

    def reach(self, low: float, high: float) -> float:
        """See `Kind`: no name is near another."""
        return 0.0

    def step(self, low: float, high: float, share: float) -> float:
        """See `Kind`: any other name is one step away."""
        return high - low

    def coordinates(self, value: Float, low: float, high: float) -> Float:
        """See `Kind`: two different names are as far apart as the ends of any other range."""
        # The corners of a simplex, 1 apart: any two names differ alike, whatever their numbers are.
        return np.eye(len(self.names))[np.rint(value).astype(np.int64)] / math.sqrt(2.0)

    def written(self, value: float) -> float | str:
        """See `Kind`."""
        return self.names[round(value)]

    def text(self, value: float, number: Show) -> str:
        """See `Kind`."""
        return self.names[round(value)]

    def range_text(
        self, low: float, high: float, number: Show, *, low_counts: bool, high_counts: bool
    ) -> str:
        """See `Kind`."""
        inside = self.within(low, high)
        return f"= {inside[0]}" if len(inside) == 1 else f"in {{{', '.join(inside)}}}"

    def within(self, low: float, high: float) -> tuple[str, ...]:
        """See `Kind`."""
        return self.names[math.ceil(low) : math.floor(high) + 1]

    def span_text(self, low: float, high: float, number: Show, unit: str = "") -> str:
        """See `Kind`."""
        return ", ".join(self.within(low, high))

    def need_text(self, sign: str, limit: float, low: float, high: float, number: Show) -> str:
        """See `Kind`: a category is as it is, or nominal."""
        return f"= {self.text(limit, number)}"

    def labels(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"words": list(self.names)}

    def rule(self, name: str, low: float, high: float) -> str:
        """See `Kind`."""
        return f"{name} is {self.expected()}"

    def sparql_value(self, raw: str) -> str:
        """See `Kind`."""
        # The numbers of names exist in rows only; a graph holds the words. The query maps the
        # words, so that both sides compare the same numbers.
        found = f"xsd:double({raw})"
        for number in reversed(range(len(self.names))):
            found = f'IF(STR({raw}) = "{self.names[number]}", {float(number)!r}e0, {found})'
        return found

    def sparql_inside(self, raw: str) -> str | None:
        """See `Kind`."""
        names = ", ".join([f'"{name}"' for name in self.names])
        return f"STR({raw}) IN ({names})"

    def sparql_kept(self, x: str) -> tuple[str, str] | None:
        """See `Kind`."""
        return None


@dataclass(frozen=True, repr=False)
class Angle(Kind):
    """The angles from low to high, which may lie beyond the end of the turn.

    Attributes:
        turn: the largest of the angles that people read: 360°, or 180°.
    """

    turn: float = TURN

    name = "angle"
    units = ("deg",)

    def __repr__(self) -> str:
        return f"angle({self.turn:g})"

    @classmethod
    def declared(cls, names: Sequence[str], low: float | None, high: float | None) -> "Angle":
        """See `Kind`."""
        # A negative end says that the file counts from -180° to 180°; results are written so, too.
        return cls(0.5 * TURN if min(low or 0.0, high or 0.0) < 0.0 else TURN)

    def inner(self, low: float, high: float, default: float) -> tuple[float, float, float]:
        """See `Kind`."""
        if low > high:
            # A range across the end of the turn, like 350° to 10°, goes on beyond 360°. So all code
            # that compares low, value and high works on angles as on any number.
            high += TURN
        return low, high, self._into(default, low, high)

    def problems(self, label: str, low: float, high: float, default: float) -> list[str]:
        """See `Kind`."""
        found = []
        if not (-TURN <= low <= TURN and high - low <= TURN):
            found.append(
                f"low and high of the angle {label} must be -360 to 360, and not more than a turn "
                f"apart, got low={low}, high={high}"
            )
        elif not low <= default <= high:
            found.append(
                f"the default of the angle {label} must lie from {self.shown(low):g} to "
                f"{self.shown(high):g}, got {self.shown(default):g}"
            )
        return found

    def read(self, given: float | str, low: float, high: float) -> float | None:
        """See `Kind`."""
        return None if isinstance(given, str) else self._into(float(given), low, high)

    def nearest(self, value: Float, lo: Value, hi: Value) -> Float:
        """See `Kind`: also round the other way."""
        inside = (value >= lo) & (value <= hi)
        above = np.add(lo, np.mod(value - lo, TURN))
        # Outside the range, the nearer of its ends on the circle: hi below, or lo a turn above.
        beyond = np.where(above - hi <= lo + TURN - above, hi, lo)
        return np.where(inside, value, np.where(above <= hi, above, beyond))

    def coordinates(self, value: Float, low: float, high: float) -> Float:
        """See `Kind`: of a whole turn, on a circle of that circumference."""
        if high - low < TURN:
            return super().coordinates(value, low, high)
        around = 2.0 * math.pi / TURN * value
        return np.stack([elementary.cos(around), elementary.sin(around)], axis=1) / (2.0 * math.pi)

    def shown(self, value: float) -> float:
        """See `Kind`."""
        # The subtraction may leave digits such as 10.000000000000057 of a given 10°; nine decimals
        # drop them.
        return round(value - TURN, 9) if value > self.turn else value

    def range_text(
        self, low: float, high: float, number: Show, *, low_counts: bool, high_counts: bool
    ) -> str:
        """See `Kind`: always with both ends, as neither is the lower one of a turn."""
        return super().range_text(low, high, number, low_counts=True, high_counts=True)

    def need_text(self, sign: str, limit: float, low: float, high: float, number: Show) -> str:
        """See `Kind`: with both ends."""
        ends = (limit, high) if sign == ">=" else (low, limit)
        return self.range_text(*ends, number, low_counts=True, high_counts=True)

    def labels(self) -> dict[str, Any]:
        """See `Kind`."""
        return {"turn": self.turn}

    @staticmethod
    def _into(value: float, low: float, high: float) -> float:
        """Return a value by whole turns nearer to a range, if it is outside."""
        if math.isfinite(value) and math.isfinite(low) and not low <= value <= high:
            moved = low + (value - low) % TURN
            return moved if moved <= high else value
        return value


FLOAT, INTEGER = Number(), Whole()

KINDS: Mapping[str, type[Kind]] = MappingProxyType(
    {function.name: function for function in (Number, Whole, Category, Angle)}
)
"""Kinds of parameters by the name that a scenario file gives."""

KEYS = ("unit", "low", "high", "values")
"""Keys of a parameter in a scenario file that only some kinds have."""


def _divided(below: Float, width: Float) -> Float:
    share = np.divide(below, width, out=np.full(len(below), 0.5), where=width > 0.0)
    return np.asarray(np.clip(share, 0.0, 1.0))


def _shares(low: float, high: float, lo: Value, hi: Value, more: float) -> tuple[Float, Float]:
    below, above = np.asarray(low - lo), np.asarray(high - lo + more)
    width = np.asarray(hi - lo + more)
    safe = np.where(width > 0.0, width, 1.0)
    first = np.where(width > 0.0, below / safe, np.where(below <= 0.0, 0.0, 1.0))
    last = np.where(width > 0.0, above / safe, np.where(above >= 0.0, 1.0, 0.0))
    return np.clip(first, 0.0, 1.0), np.clip(last, 0.0, 1.0)
