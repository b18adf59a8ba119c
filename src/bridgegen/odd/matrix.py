"""Test matrices of a scenario file: values of its parameters, of which all combinations are tested.

A protocol tests certain speeds and overlaps, a search what lies between them too. So a matrix is no
range: it names values within the ranges, by editions of the protocol.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from bridgegen.arrays import Float
from bridgegen.errors import InputError
from bridgegen.odd.parameters import Derived, Parameter, nearest
from bridgegen.odd.plain_yaml import Document, Path, entries
from bridgegen.odd.shape import Number, NumberOrName, ShapedSection, Text, section

MOST_ROWS = 100_000
"""Combinations of all grids of a file together."""

Score = Literal["relative impact speed", "impact speed", "speed reduction", "avoidance"]
"""How a row is rated."""

Some = Annotated[list[NumberOrName], Field(min_length=1, max_length=1000)]


class GridSection(ShapedSection):
    """One grid of ``matrix``: all combinations of some values."""

    edition: Annotated[str, Field(strict=True, pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,31}$")]
    """Of the protocol, such as "2026" (in quotes); see --matrix."""
    name: Annotated[str, Field(strict=True, max_length=60)] = ""
    """Which part of the edition it is."""
    source: Text
    """Where the protocol says so."""
    values: dict[str, Some] = Field(default={})
    """By parameter: its values, each combined with all of the others."""
    sets: Annotated[list[dict[str, NumberOrName]], Field(max_length=1000)] = Field(default=[])
    """Values of several parameters that go together: each set is combined with all values."""
    score: Score | None = None
    """How its rows are rated; see docs/suites.md."""
    points: Annotated[Number, Field(gt=0.0, le=1000.0)] | None = None
    """What all of its rows are worth together, if they are rated."""
    graded: Annotated[bool, Field(strict=True)] = True
    """Whether colours count in part; if not, any colour but red counts fully (extended ranges)."""


@dataclass(frozen=True)
class Grid:
    """A grid of a matrix: all combinations of some parameters' values.

    Attributes:
        edition: of the protocol, such as "2026".
        name: which part of it this is, or "".
        source: where the protocol says so.
        values: by parameter: its inner values, each combined with all others.
        sets: values of several parameters that go together; empty: none.
        score: how its rows are rated, a name of ``Score``; "" if they are not.
        points: that its rows are worth together, if they are rated.
        graded: whether colours count in part; if not, any but red counts fully.
    """

    edition: str
    name: str
    source: str
    values: tuple[tuple[str, tuple[float, ...]], ...]
    sets: tuple[tuple[tuple[str, float], ...], ...] = ()
    score: str = ""
    points: float = 0.0
    graded: bool = True

    @property
    def label(self) -> str:
        """Edition and name."""
        return f"{self.edition} {self.name}".rstrip()

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters to which it gives values."""
        return (*(name for name, _ in self.values), *dict(self.sets[0] if self.sets else ()))

    def __len__(self) -> int:
        return math.prod(len(values) for _, values in self.values) * max(1, len(self.sets))

    def columns(self) -> dict[str, Float]:
        """Return the values of all combinations, ``(len(self),)`` by parameter."""
        choices: list[Sequence[tuple[tuple[str, float], ...]]] = [
            [((name, value),) for value in values] for name, values in self.values
        ]
        choices += [self.sets] if self.sets else []
        rows = [dict(pair for one in some for pair in one) for some in product(*choices)]
        return {name: np.array([row[name] for row in rows]) for name in self.names}


def read_matrix(
    document: Document,
    parameters: Mapping[str, Parameter],
    derived: Mapping[str, Derived],
    report: Callable[[str, Path], None],
) -> tuple[Grid, ...]:
    """Return the grids of a file, and report what is wrong with them.

    What has not the shape of a grid is left to the check of the file's shape.

    Args:
        document: the scenario file.
        parameters: of the scenario.
        derived: likewise; a grid cannot set them.
        report: is given each problem, and where it is.
    """
    found = list[Grid]()
    for number, data in entries(document, "matrix"):
        if (one := section(GridSection, data)) is None:
            continue
        path: Path = ("matrix", number)
        values, sets = list[tuple[str, tuple[float, ...]]](), list[tuple[tuple[str, float], ...]]()
        for name, some in one.values.items():
            inner = [_value(name, each, parameters, derived) for each in some]
            _report_all(inner, (*path, "values", name), report)
            kept = tuple(each for each in inner if isinstance(each, float))
            if len(set(kept)) < len(kept):
                report(f"{name} has a value twice", (*path, "values", name))
            values.append((name, kept))
        for k, together in enumerate(one.sets):
            where: Path = (*path, "sets", k)
            if together.keys() != one.sets[0].keys():
                report("all sets of a grid must name the same parameters", where)
            inner = [_value(name, each, parameters, derived) for name, each in together.items()]
            _report_all(inner, where, report)
            pairs = zip(together, inner, strict=True)
            sets.append(tuple((name, each) for name, each in pairs if isinstance(each, float)))
        if both := sorted(one.values.keys() & set().union(*one.sets)):
            report(f"{', '.join(both)} must stand in values or in sets, not in both", path)
        if not one.values and not one.sets:
            report("a grid must have values or sets", path)
        if (one.score is None) != (one.points is None):
            report("a grid that is rated must have both score and points", path)
        found.append(
            Grid(
                one.edition, one.name, one.source, tuple(values), tuple(sets),
                one.score or "", one.points or 0.0, one.graded,
            )
        )  # fmt: skip
    labels = [one.label for one in found]
    for number, label in enumerate(labels):
        if label in labels[:number]:
            report(f"two grids are called '{label}': their names must differ", ("matrix", number))
    if (count := sum(map(len, found))) > MOST_ROWS:
        report(f"a matrix has at most {MOST_ROWS:,} combinations, got {count:,}", ("matrix",))
    return tuple(found)


def _report_all(
    values: Iterable[float | str], path: Path, report: Callable[[str, Path], None]
) -> None:
    for problem in dict.fromkeys(one for one in values if isinstance(one, str)):
        report(problem, path)


def _value(
    name: str,
    given: float | str,
    parameters: Mapping[str, Parameter],
    derived: Mapping[str, Derived],
) -> float | str:
    """Return a parameter's inner value, or in words why it has none."""
    if name in derived:
        return f"{name} is derived, and cannot be set"
    if name not in parameters:
        return f"there is no parameter '{name}'{nearest(name, parameters)}"
    one = parameters[name]
    try:
        value = one.read(given)
    except InputError as error:
        return "; ".join(error.problems)
    if not one.low <= value <= one.high:
        return f"{one.kind.rule(name, one.low, one.high)} [{one.unit}] must hold, got {given!r}"
    if (kept := one.kind.kept(np.array([value]))) and value != round(value):
        return f"{name} [{one.unit}] must be {kept[1]}, got {given!r}"
    return value
