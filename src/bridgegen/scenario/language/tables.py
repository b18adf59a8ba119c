"""Packs that are tables: the clauses of a regulation, and the scenarios that answer each of them.

An *entry* is a scenario of the catalogue, or of another pack, as the rows that name it want it:
with their clauses, its parameters held where they say, the cells of its matrix moved. Rows that
change nothing share the entry of their scenario. Clauses are violated by what is critical, or, of a
scenario with clauses of its own, by the collisions that violate these.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.scenario.language.checks import try_out
from bridgegen.scenario.language.parameters import Axis, Parameter, at, nearest
from bridgegen.scenario.language.plain_yaml import Document, read_plain_yaml
from bridgegen.scenario.language.protocols import Clause, Collisions, Grid
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.schema_types import (
    ID,
    NumberOrName,
    ShapedSection,
    Text,
    Word,
    section,
    shape_problems,
)

Key = Annotated[str, Field(strict=True, pattern=f"^{ID}$")]
Some = Annotated[list[NumberOrName], Field(min_length=1)]


class RowSection(ShapedSection):
    """One entry of ``rows``: a clause, and what answers it."""

    text: Text
    """Requirement in words."""
    scenarios: list[Text] = Field(default=[])
    """Scenarios that answer it, by name."""
    given: dict[str, NumberOrName | Some] = Field(default={})
    """Parameters of these scenarios that are held at a value, or from the first to the last."""
    shift: dict[str, Some] = Field(default={})
    """Parameters that are moved from the cells of the scenarios' matrices, and by how much."""
    lacks: Text | None = None
    """Reason why no scenario answers it."""


class PackFile(ShapedSection):
    """A pack that is a table of clauses."""

    pack: Word
    """Name of the pack; the file's name is NAME.yaml."""
    source: Text
    """Source of the clauses."""
    known: Text
    """How the clauses are known: what was read, and what was not."""
    prefix: Key
    """Start of the clauses' ids, before the row's name."""
    matrix: str = ""
    """Start of the labels of the grids that are run of scenarios with a matrix."""
    typology: Word | None = None
    """Typology whose types are rows, too."""
    rows: dict[Key, RowSection] = Field(default={})
    """Clauses by name."""


@dataclass(frozen=True)
class PackTable:
    """A table of clauses.

    Attributes:
        file: what it says besides its rows.
        document: the same, for messages.
        rows: by name, those of its typology first.
        entries: by name within the pack, each with its scenario and the names of its rows.
    """

    file: PackFile
    document: Document
    rows: Mapping[str, RowSection]
    entries: Mapping[str, tuple[str, Sequence[str]]]

    @property
    def unanswered(self) -> tuple[tuple[str, str, str], ...]:
        """The clauses that no scenario answers: id, requirement in words, and the reason."""
        rows = [(self.id_of(key), row.text, row.lacks) for key, row in self.rows.items()]
        return tuple((id, text, lacks) for id, text, lacks in rows if lacks)

    def id_of(self, row: str) -> str:
        """Return the id of the clause that a row is."""
        return f"{self.file.prefix}-{row}"

    def applied(self, entry: str, scenario: LogicalScenario) -> LogicalScenario:
        """Return an entry, by its name, of the scenario that it names.

        Raises:
            ScenarioError: a row changes a parameter that the scenario does not have, or to what it
                cannot be.
        """
        keys = self.entries[entry][1]
        row, where = self.rows[keys[0]], at(self.document.at(("rows", keys[0])))
        parameters, grids = dict(scenario.parameters), list(scenario.matrix)
        grids = [grid for grid in grids if grid.label.startswith(self.file.matrix)]
        stated = (own.collisions for own in scenario.clauses if own.collisions)
        kind: Collisions = next(stated, "critical")
        try:
            for name, change in (*row.given.items(), *row.shift.items()):
                if (old := parameters.get(name)) is None:
                    raise ScenarioError(f"no parameter '{name}'{nearest(name, parameters)}")
                parameters[name], grids = _changed(old, grids, change, moves=name in row.shift)
            made = replace(
                scenario,
                name=f"{self.file.pack}-{entry}",
                source=self.file.source,
                parameters=parameters,
                matrix=tuple(grids),
                # Others are of the regulation that the scenario was written for.
                criteria=scenario.criteria if scenario.objective.rule == "criteria" else (),
                clauses=tuple(Clause(self.id_of(key), self.rows[key].text, kind) for key in keys),
            )
            if row.given:  # defaults follow what is held, as in a search: clouds come with rain
                space = made.space(Axis)
                usual = space.values(space.row({}))
                moved = {name: replace(it, default=usual[name]) for name, it in parameters.items()}
                made = replace(made, parameters=moved)
            try_out(made)
        except InputError as error:
            raise ScenarioError(*(f"{entry}: {one}{where}" for one in error.problems)) from None
        return made


def _changed(
    parameter: Parameter, grids: Sequence[Grid], change: Any, *, moves: bool
) -> tuple[Parameter, list[Grid]]:
    """Return a parameter that is held, or has room to be moved; and the cells with it there.

    Either may leave the range that the scenario declares: the row's source says how far it goes.
    """
    given = change if isinstance(change, list) else [change]
    values, default = [parameter.read(value) for value in given], parameter.default
    if not moves:
        low, high = values[0], values[-1]
        held = replace(parameter, low=low, high=high, default=min(max(default, low), high))
        return held, [_cells(grid, held, 0.0, "") for grid in grids]
    if not grids:
        raise ScenarioError(f"{parameter.name} is moved from a matrix's cells, and there is none")
    there = [grid.columns().get(parameter.name, np.array([default])) for grid in grids]
    ends = [value + step for cells in there for value in cells.tolist() for step in values]
    low, high = min(parameter.low, *ends), max(parameter.high, *ends)
    wide, steps = replace(parameter, low=low, high=high), zip(values, given, strict=True)
    more = [(step, f", {parameter.name} by {text}") for step, text in steps]
    return wide, [_cells(grid, wide, step, text) for step, text in more for grid in grids]


def _cells(grid: Grid, parameter: Parameter, step: float, more: str) -> Grid:
    """Return a grid, not rated, in whose cells a parameter is moved, and within its range."""
    columns = grid.columns()
    own = columns.get(parameter.name, np.full(len(grid), parameter.default)) + step
    columns[parameter.name] = np.clip(own, parameter.low, parameter.high)
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    sets = tuple(dict.fromkeys(tuple(zip(columns, row, strict=True)) for row in rows))
    return replace(grid, name=grid.name + more, values=(), sets=sets, score="", points=0.0)


def read_table(document: Document, exists: Callable[[str], bool]) -> PackTable:
    """Return the table that a file is; ``exists`` says whether there is such a scenario.

    Raises:
        ScenarioError: it breaks rules; all of them, with file and line.
    """
    file = section(PackFile, document.data)
    if file is None:
        raise ScenarioError(*shape_problems(PackFile, document))
    problems, rows = list[str](), _of_typology(file.typology, document) | file.rows
    entries: dict[str, tuple[str, list[str]]] = {}
    for key, row in rows.items():
        where = at(document.at(("rows", key)))
        if bool(row.scenarios) == bool(row.lacks):
            problems.append(f"rows.{key} must have 'scenarios', or say in 'lacks' why none{where}")
        for scenario in row.scenarios:
            name = scenario.rpartition("/")[2]
            name += f"-{key.replace('.', '-')}" if row.given or row.shift else ""
            of, keys = entries.setdefault(name, (scenario, []))
            keys.append(key)
            if not exists(scenario):
                problems.append(f"rows.{key}: there is no scenario '{scenario}'{where}")
            elif of != scenario:
                problems.append(f"rows.{key}: '{name}' is both {of} and {scenario}{where}")
    if problems:
        raise ScenarioError(*problems)
    return PackTable(file, document, rows, entries)


def _of_typology(name: str | None, document: Document) -> dict[str, RowSection]:
    """Return the types of a typology as rows; none without a name."""
    text = resources.files("bridgegen.scenario").joinpath("typology.yaml").read_bytes()
    data: Any = read_plain_yaml(text, "typology.yaml").data
    if name is not None and name not in data:
        where = at(document.at(("typology",)))
        raise ScenarioError(f"there is no typology '{name}'{nearest(name, data)}{where}")
    found = {}
    for key, kind in data[name]["types"].items() if name else ():
        scenarios, given = list(kind.get("scenarios", ())), kind.get("given", {})
        lacks = None if scenarios else "no scenario of the catalogue realises it"
        found[key] = RowSection(text=kind["name"], scenarios=scenarios, given=given, lacks=lacks)
    return found
