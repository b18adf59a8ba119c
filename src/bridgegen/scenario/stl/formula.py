"""The parts of formulas."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from math import inf
from typing import Literal, TypeAlias

from bridgegen.scenario.stl.dimensions import Dimension


@dataclass(frozen=True)
class Constant:
    """A number.

    Attributes:
        value: in SI units; angles in radians.
        dimension: of its unit; None without one: it takes that of what it is compared with.
    """

    value: float
    dimension: Dimension | None = None


@dataclass(frozen=True)
class Reading:
    """A quantity that is read from a recording: a signal over time, or a metric.

    Attributes:
        name: ``v`` of ``ego.v``, ``gap`` of ``gap to bv``, or a metric's.
        of: the entities: ``("ego",)``, ``("ego", "bv")`` of ``gap to bv``, ``("ego", "any")``;
            empty for a metric, which is one number of the whole recording.
        column: where it stands in the text, from 1.
    """

    name: str
    of: tuple[str, ...] = ()
    column: int = 0

    @property
    def is_signal(self) -> bool:
        """Whether it is a function of time."""
        return bool(self.of)

    def __str__(self) -> str:
        if not self.of:
            return self.name
        quoted = [name if name.isidentifier() else f'"{name}"' for name in self.of]
        return f"{self.name} to {quoted[1]}" if len(quoted) > 1 else f"{quoted[0]}.{self.name}"


@dataclass(frozen=True)
class Arithmetic:
    """A sum, difference, product or quotient of two terms, at each instant."""

    sign: Literal["+", "-", "*", "/"]
    left: "Term"
    right: "Term"


@dataclass(frozen=True)
class Function:
    """A function of terms at each instant: ``abs`` of one, ``min`` or ``max`` of several."""

    name: Literal["abs", "min", "max"]
    terms: "tuple[Term, ...]"


@dataclass(frozen=True)
class Whole:
    """One number of a term's values over the whole recording."""

    name: Literal["min", "max", "first", "last"]
    term: "Term"


Term: TypeAlias = Constant | Reading | Arithmetic | Function | Whole


@dataclass(frozen=True)
class Comparison:
    """A comparison of two terms."""

    sign: Literal["<", "<=", ">", ">=", "==", "!="]
    left: Term
    right: Term
    column: int = 0


@dataclass(frozen=True)
class Not:
    """The negation of a formula."""

    formula: "Formula"


@dataclass(frozen=True)
class Junction:
    """All formulas (``and``), or at least one (``or``)."""

    sign: Literal["and", "or"]
    left: "Formula"
    right: "Formula"


@dataclass(frozen=True)
class Interval:
    """Instants relative to the present one.

    Attributes:
        low: [s], ≥ 0, from the present one.
        high: [s], ≥ ``low``; inf: to the end of the recording, or from its start.
    """

    low: float = 0.0
    high: float = inf


@dataclass(frozen=True)
class Temporal:
    """A formula at all, or at some, instants of an interval ahead or in the past."""

    name: Literal["always", "eventually", "historically", "once"]
    interval: Interval
    formula: "Formula"


@dataclass(frozen=True)
class Until:
    """``left`` holds until ``right`` does, within an interval; ``since`` is the same backwards."""

    name: Literal["until", "since"]
    interval: Interval
    left: "Formula"
    right: "Formula"


Formula: TypeAlias = Comparison | Not | Junction | Temporal | Until
Part: TypeAlias = Formula | Term


def parts(part: Part) -> tuple[Part, ...]:
    """Return the parts that a part consists of."""
    if isinstance(part, Arithmetic | Comparison | Junction | Until):
        return part.left, part.right
    if isinstance(part, Not | Temporal):
        return (part.formula,)
    if isinstance(part, Function):
        return part.terms
    return (part.term,) if isinstance(part, Whole) else ()


def readings(comparison: Part) -> Iterator[Reading]:
    """Yield the quantities that a formula reads, in the order of its text."""
    if isinstance(comparison, Reading):
        yield comparison
    for part in parts(comparison):
        yield from readings(part)


def joined(sign: Literal["and", "or"], formulas: "list[Formula]") -> "Formula":
    """Return the junction of formulas, at least one."""
    return reduce(lambda left, right: Junction(sign, left, right), formulas)


def horizon(temporal: Part) -> float:
    """Return how far ahead a formula looks at least [s].

    Of intervals inside one another the ends add up; of an interval without an end the beginning.
    """
    inside = max((horizon(part) for part in parts(temporal)), default=0.0)
    if isinstance(temporal, Temporal | Until) and temporal.name in (
        "always",
        "eventually",
        "until",
    ):
        high = temporal.interval.high
        return inside + (temporal.interval.low if high == inf else high)
    return inside
