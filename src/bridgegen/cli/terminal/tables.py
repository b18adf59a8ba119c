"""Tables, and lists of parameters."""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.console import Console
from rich.padding import Padding
from rich.table import Table

if TYPE_CHECKING:
    from bridgegen.cli.verdict.fail_if import Outcome
    from bridgegen.scenario.language.scenario import ParameterLine

WHOLE = 10_000
"""Width of a console that writes to a file or a pipe: nothing is wrapped there."""

LEAST = 24
"""The fewest characters that a line of a wrapped column holds."""


def print_table(
    head: Sequence[str],
    rows: Sequence[Sequence[object]],
    *,
    as_json: bool,
    texts: int = 1_000,
) -> None:
    """Print rows as a table, or as a JSON list of objects.

    Columns from the number ``texts`` on hold numbers, which stand to the right.

    In a file or a pipe no text is wrapped. On a terminal only the widest column is; where not even
    that leaves it ``LEAST`` characters, each row is a block of lines, one for each of its texts.
    """
    if as_json:
        print(json.dumps([dict(zip(head, row, strict=True)) for row in rows], indent=2))
        return
    shown = [["" if value is None else _shown(value) for value in row] for row in rows]
    widths = [max(map(cell_len, column)) for column in zip(head, *shown, strict=True)]
    whole, widest = sum(widths) + 2 * (len(head) - 1), max(range(len(head)), key=widths.__getitem__)
    console = Console(markup=False, emoji=False, highlight=False)
    # Written without rich's wrapping: what reads a pipe wants a row a line.
    if not console.is_terminal:
        for row in (head, *shown):
            spaces = [
                " " * (width - cell_len(text)) for text, width in zip(row, widths, strict=True)
            ]
            cells = [
                text + space if column < texts else space + text
                for column, (text, space) in enumerate(zip(row, spaces, strict=True))
            ]
            print("  ".join(cells).rstrip())
        return
    if whole - widths[widest] + LEAST > console.width:
        _print_blocks(console, head, shown)
        return
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for column, name in enumerate(head):
        table.add_column(
            name,
            overflow="fold",
            no_wrap=column != widest,
            justify="left" if column < texts else "right",
        )
    for row in shown:
        table.add_row(*row)
    console.print(table)


def _print_blocks(console: Console, head: Sequence[str], texts: Sequence[Sequence[str]]) -> None:
    """Print each row as lines of a name and a text, which continues below itself."""
    indent = max(map(cell_len, head)) + 2
    for number, row in enumerate(texts):
        if number:
            console.print()
        grid = Table.grid(padding=0)
        grid.add_column(width=indent, no_wrap=True)
        grid.add_column(overflow="fold")
        for name, text in zip(head, row, strict=True):
            if text:
                grid.add_row(name, text)
        console.print(grid)


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


# --- Outcomes of criteria on standard error: standard output may be JSON ---


_WORDS = {"passed": "passed", "failed": "FAILED", "unknown": "NOT JUDGED"}


def print_outcomes(outcomes: "Sequence[Outcome]") -> bool:
    """Print each outcome; return whether all passed."""
    for outcome in outcomes:
        word = _WORDS[outcome.verdict]
        print(f"bridgegen: {word}: {outcome.test} ({outcome.details})", file=sys.stderr)
    return all(outcome.verdict == "passed" for outcome in outcomes)
