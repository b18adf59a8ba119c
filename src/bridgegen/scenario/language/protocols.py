"""Test protocols in a scenario file: matrices of values, and clauses for the ego."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.criteria import Criterion, Tag
from bridgegen.scenario.language.parameters import Derived, Parameter, at, nearest
from bridgegen.scenario.language.plain_yaml import Document, Path, entries
from bridgegen.scenario.language.schema_types import (
    ID,
    Number,
    NumberOrName,
    ShapedSection,
    Text,
    section,
)

# --- Test matrices: values of parameters, of which all combinations are tested ---
# A protocol tests certain speeds and overlaps, a search what lies between them too. So a matrix is
# no # range: it names values within the ranges, by editions of the protocol.


MOST_ROWS = 100_000
"""Largest number of combinations of all grids of a file together."""

Score = Literal["relative impact speed", "impact speed", "speed reduction", "avoidance"]
"""Quantity by which a row is rated."""

Some = Annotated[list[NumberOrName], Field(min_length=1, max_length=1000)]


class GridSection(ShapedSection):
    """One grid of ``matrix``: all combinations of some values."""

    edition: Annotated[str, Field(strict=True, pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,31}$")]
    """Edition of the protocol, such as "2026" (in quotes); see --matrix."""
    name: Annotated[str, Field(strict=True, max_length=60)] = ""
    """Part of the edition that this grid is."""
    source: Text
    """Place in the protocol that states the grid."""
    values: dict[str, Some] = Field(default={})
    """Values of parameters, by name; each is combined with all of the others."""
    sets: Annotated[list[dict[str, NumberOrName]], Field(max_length=1000)] = Field(default=[])
    """Values of several parameters that go together: each set is combined with all values."""
    score: Score | None = None
    """Quantity by which the grid's rows are rated; see docs/suites.md."""
    points: Annotated[Number, Field(gt=0.0, le=1000.0)] | None = None
    """Points of all rows of the grid together, if they are rated."""
    graded: Annotated[bool, Field(strict=True)] = True
    """Whether colours score in part; if not, any colour but red scores fully (extended ranges)."""


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
        rows = [dict(pair for item in some for pair in item) for some in product(*choices)]
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
    declared: dict[str, Parameter | Derived] = {**derived, **parameters}
    found = [
        _read_grid(grid_section, ("matrix", number), declared, report)
        for number, data in entries(document, "matrix")
        if (grid_section := section(GridSection, data)) is not None
    ]
    labels = [grid.label for grid in found]
    for number, label in enumerate(labels):
        if label in labels[:number]:
            report(f"two grids are called '{label}': their names must differ", ("matrix", number))
    if (count := sum(map(len, found))) > MOST_ROWS:
        report(f"a matrix has at most {MOST_ROWS:,} combinations, got {count:,}", ("matrix",))
    return tuple(found)


def _read_grid(
    given: GridSection,
    path: Path,
    declared: Mapping[str, Parameter | Derived],
    report: Callable[[str, Path], None],
) -> Grid:
    values = []
    for name, some in given.values.items():
        inner = _numbers([(name, item) for item in some], declared, (*path, "values", name), report)
        if len(set(inner)) < len(inner):
            report(f"{name} has a value twice", (*path, "values", name))
        values.append((name, tuple(value for _, value in inner)))
    sets = []
    for k, together in enumerate(given.sets):
        if together.keys() != given.sets[0].keys():
            report("all sets of a grid must name the same parameters", (*path, "sets", k))
        sets.append(tuple(_numbers(together.items(), declared, (*path, "sets", k), report)))
    if both := sorted(given.values.keys() & set().union(*given.sets)):
        report(f"{', '.join(both)} must stand in values or in sets, not in both", path)
    if not given.values and not given.sets:
        report("a grid must have values or sets", path)
    if (given.score is None) != (given.points is None):
        report("a grid that is rated must have both score and points", path)
    return Grid(
        given.edition,
        given.name,
        given.source,
        tuple(values),
        tuple(sets),
        given.score or "",
        given.points or 0.0,
        given.graded,
    )


def _numbers(
    given: Iterable[tuple[str, float | str]],
    declared: Mapping[str, Parameter | Derived],
    path: Path,
    report: Callable[[str, Path], None],
) -> list[tuple[str, float]]:
    """Return inner values with their parameters; what is none is reported, each problem once."""
    found, problems = [], []
    for name, value in given:
        inner = _value(name, value, declared)
        if isinstance(inner, str):
            problems.append(inner)
        else:
            found.append((name, inner))
    for problem in dict.fromkeys(problems):
        report(problem, path)
    return found


def _value(
    name: str, given: float | str, declared: Mapping[str, Parameter | Derived]
) -> float | str:
    """Return a parameter's inner value, or in words why it has none."""
    parameter = declared.get(name)
    if parameter is None:
        return f"there is no parameter '{name}'{nearest(name, declared)}"
    if isinstance(parameter, Derived):
        return f"{name} is derived, and cannot be set"
    try:
        value = parameter.read(given)
    except InputError as error:
        return "; ".join(error.problems)
    if not parameter.low <= value <= parameter.high:
        return (
            f"{parameter.kind.rule(name, parameter.low, parameter.high)} [{parameter.unit}] must "
            f"hold, got {given!r}"
        )
    if (kept := parameter.kind.kept(np.array([value]))) and value != round(value):
        return f"{name} [{parameter.unit}] must be {kept[1]}, got {given!r}"
    return value


# --- Clauses: what a regulation requires of the ego, and what decides it ---


Collisions = Literal["any", "preventable", "critical"]


@dataclass(frozen=True)
class Clause:
    """A requirement of a regulation or protocol, which the ego passes or fails in a variation.

    Attributes:
        id: of the clause, ``R157-5.2.5.2`` say.
        text: the requirement in words.
        collisions: which collisions of the ego violate it: "any"; those that are "preventable"
            by the models of UN R157; or what is "critical" by the scenario's own rule, near misses
            by harm among it; None: none does.
        criteria: ids of the criteria whose violation violates it.
        place: file and line that declare it, for messages.
    """

    id: str
    text: str
    collisions: Collisions | None = None
    criteria: tuple[str, ...] = ()
    place: str = field(default="", compare=False, repr=False)

    def to_dict(self) -> dict[str, Any]:
        """Return it as a file declares it, without what is not said."""
        found: dict[str, Any] = {"id": self.id, "text": self.text}
        if self.collisions:
            found["collisions"] = self.collisions
        if self.criteria:
            found["criteria"] = list(self.criteria)
        return found


class ClauseSection(ShapedSection):
    """One entry of ``clauses``: a requirement of a regulation, and what violates it."""

    id: Annotated[str, Field(strict=True, pattern=f"^{ID}$")]
    """Id of the clause: letters, digits, '.', '_' and '-'."""
    text: Text
    """Requirement in words."""
    collisions: Collisions | None = None
    """Collisions of the ego that violate the clause: any; those that a model of UN R157 avoids; or
    what is critical by the scenario's own rule, near misses by harm among it."""
    criteria: Annotated[list[Tag], Field(default=[])]
    """Ids of criteria of this file; a violated one violates the clause."""


def read_clause(given: Mapping[str, Any]) -> Clause:
    """Return a clause of plain data, as ``Clause.to_dict`` gives them.

    Raises:
        InputError: it is not of that shape.
    """
    shaped = section(ClauseSection, dict(given))
    if shaped is None:
        raise InputError("a clause has an id, a text, 'collisions' and 'criteria', and no more")
    return _clause(shaped, "")


def read_clauses_in(
    document: Document, criteria: Iterable[Criterion]
) -> tuple[tuple[Clause, ...], list[str]]:
    """Return the clauses of a scenario file, and what is wrong with them.

    What has not the shape of a clause is left to the check of the file's shape.

    Args:
        document: the file.
        criteria: its pass criteria.
    """
    known = [criterion.id for criterion in criteria]
    found, problems = list[Clause](), list[str]()
    for number, data in entries(document, "clauses"):
        given = section(ClauseSection, data)
        if given is None:
            continue
        clause = _clause(given, document.at(("clauses", number)))
        where = f"clause {clause.id}:"
        if not clause.collisions and not clause.criteria:
            problems.append(
                f"{where} nothing can violate it, state 'collisions' or "
                f"'criteria'{at(clause.place)}"
            )
        problems += [
            f"{where} unknown criterion '{name}'{nearest(name, known)}{at(clause.place)}"
            for name in clause.criteria
            if name not in known
        ]
        if clause.id in [other.id for other in found]:
            problems.append(
                f"{where} it is there twice, each has an id of its own{at(clause.place)}"
            )
        found.append(clause)
    return tuple(found), problems


def _clause(given: ClauseSection, place: str) -> Clause:
    return Clause(given.id, given.text, given.collisions, tuple(given.criteria), place)
