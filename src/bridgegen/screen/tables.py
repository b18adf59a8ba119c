"""Tables, and lists of parameters."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from rich.console import Console
from rich.padding import Padding
from rich.table import Table

if TYPE_CHECKING:
    from bridgegen.odd.scenario import ParameterLine


def print_table(head: Sequence[str], rows: Sequence[Sequence[object]], *, as_json: bool) -> None:
    """Print rows as a table, or as a JSON list of objects."""
    if as_json:
        print(json.dumps([dict(zip(head, row, strict=True)) for row in rows], indent=2))
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in head:
        table.add_column(name, overflow="fold")  # a narrow terminal cuts nothing
    for row in rows:
        table.add_row(*("" if value is None else _shown(value) for value in row))
    Console(markup=False, emoji=False).print(table)


def _shown(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def print_entries(head: Sequence[str], rows: Sequence[Sequence[str]], *, as_json: bool) -> None:
    """Print rows as paragraphs, each under its first text; or as a JSON list of objects.

    Args:
        head: what the texts are.
        rows: texts; empty ones are left out.
        as_json: as JSON, with all texts.
    """
    if as_json:
        print_table(head, rows, as_json=True)
        return
    console = Console(markup=False, emoji=False, highlight=False)
    for name, *texts in rows:
        console.print(name, style="bold")
        for what, text in zip(head[1:], texts, strict=True):
            if text:
                said = text if what == "description" else f"{what}: {text}"
                console.print(Padding(said, (0, 0, 0, 4)))


def print_parameters(lines: "Sequence[ParameterLine]", *, as_json: bool) -> None:
    """Print parameters with range and default; below each, its description and constraints."""
    if as_json:
        print(json.dumps([{**asdict(line), "axis": str(line.axis)} for line in lines], indent=2))
        return
    width = max(len(line.name) for line in lines)
    for line in lines:
        default = f", default {line.standard}" if line.standard else ""
        print(f"{line.name:<{width}}  {line.axis}, {line.range}{default}")
        for text in (line.description, *line.bounds.split("; ")):
            if text:
                print(f"{'':<{width}}    {text}")
