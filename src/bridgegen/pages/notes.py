"""The search algorithm's notes as tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bridgegen.scenario.language.space import SearchSpace

MOST = 200
"""Maximum number of rows of a table on the page, the first ones."""


@dataclass(frozen=True)
class NoteTable:
    """A table of text.

    Attributes:
        title: what it is about.
        columns: headings.
        rows: as many texts as columns, each.
        left_out: number of further rows that are not shown.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    left_out: int = 0


def tables(notes: Mapping[str, Any], space: SearchSpace) -> tuple[NoteTable, ...]:
    """Return an algorithm's notes as tables: a list of mappings is one; single values are one.

    Args:
        notes: see `bridgegen.search.algorithms.algorithm.TakesNotes`.
        space: the search space; boxes of its unit cube are given in its units where possible.
    """
    found = [
        NoteTable(title, *_cells(value, space))
        for title, value in notes.items()
        if _is_table(value)
    ]
    single = {title: value for title, value in notes.items() if not _is_table(value)}
    if single:
        rows = tuple((title, _text(value)) for title, value in single.items())
        found.insert(0, NoteTable("In short", ("", "value"), rows))
    return tuple(found)


def notes_payload(notes: Sequence[NoteTable]) -> list[dict[str, Any]]:
    """Return tables as the plain data that the page shows."""
    return [
        {"title": t.title, "columns": t.columns, "rows": t.rows, "left_out": t.left_out}
        for t in notes
    ]


def _is_table(value: Any) -> bool:
    return isinstance(value, list) and len(value) > 0 and all(isinstance(v, dict) for v in value)


def _cells(
    records: Sequence[Mapping[str, Any]], space: SearchSpace
) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...], int]:
    columns = tuple(dict.fromkeys(key for record in records for key in record))
    rows = tuple(
        tuple(_cell(key, record.get(key, ""), space) for key in columns)
        for record in records[:MOST]
    )
    return columns, rows, max(0, len(records) - MOST)


def _cell(key: str, value: Any, space: SearchSpace) -> str:
    """Return a value as text; a box as a rule, if it is one of this space."""
    if (
        key == "box"
        and isinstance(value, dict)
        and all(_is_side(*pair, space) for pair in value.items())
    ):
        return box_in_words(value, space)
    return _text(value)


def _is_side(name: str, edges: Any, space: SearchSpace) -> bool:
    return (
        name in space.variables
        and isinstance(edges, list)
        and len(edges) == 2
        and all(isinstance(edge, int | float) and 0.0 <= edge <= 1.0 for edge in edges)
    )


def box_in_words(box: Mapping[str, Sequence[float]], space: SearchSpace) -> str:
    """Return a box of the unit cube as a rule.

    A parameter that no constraint limits is given in its own unit; another one as shares of the
    interval that the constraints leave.
    """
    if not box:
        return "anywhere"
    return "; ".join(_side(name, low, high, space) for name, (low, high) in box.items())


def _side(name: str, low: float, high: float, space: SearchSpace) -> str:
    parameter = space.parameters[name]
    if space.bounds[name]:
        edges = [f"{100 * share:.1f}" for share in (low, high)]
        unit = " % of what is left to it"
    else:
        values = parameter.at(np.array([low, high]), parameter.low, parameter.high).tolist()
        unit = "" if parameter.unit in ("1", "count") else f" {parameter.unit}"
        if parameter.kind.labels():
            text = parameter.kind.range_text(
                values[0], values[1], "{:.4g}".format, low_counts=low > 0.0, high_counts=high < 1.0
            )
            return f"{name} {text}{unit}"
        edges = [f"{value:.4g}" for value in values]
    if low <= 0.0:
        return f"{name} ≤ {edges[1]}{unit}"
    if high >= 1.0:
        return f"{name} ≥ {edges[0]}{unit}"
    return f"{name} {edges[0]} … {edges[1]}{unit}"


def _text(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    if isinstance(value, dict):
        return "; ".join(f"{key}: {_text(item)}" for key, item in value.items())
    return str(value)
