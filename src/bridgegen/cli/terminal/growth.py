"""What `suite add` and `suite replay` print."""

import json
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from bridgegen.base.units import percent
from bridgegen.cli.terminal.tables import WHOLE

if TYPE_CHECKING:
    from bridgegen.jobs.suite.growth import Addition
    from bridgegen.jobs.suite.replay import Replayed

_WORDS = {
    "added": "added",
    "replaced": "replaced by a worse one",
    "known": "already known",
    "worse": "already known, less severe",
    "refused": "refused",
}


def print_additions(made: "Sequence[Addition]", to: Path, *, as_json: bool = False) -> None:
    """Print the outcome of each failure, then the totals."""
    if as_json:
        print(json.dumps([vars(addition) for addition in made], indent=2, ensure_ascii=False))
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("found in", "outcome", "failure"):
        table.add_column(name, overflow="fold")
    for addition in made:
        outcome = _WORDS[addition.outcome]
        if addition.status == "fixed":
            outcome += ", called fixed: it is there again"
        elif addition.outcome in ("known", "worse") and addition.status:
            outcome += f" ({addition.status})"
        failure = ": ".join(filter(None, (addition.id, addition.title)))
        table.add_row(addition.source, outcome, "\n".join(filter(None, (failure, addition.reason))))
    console = Console(markup=False, emoji=False, highlight=False)
    if not sys.stdout.isatty():
        console.width = WHOLE
    if made:
        console.print(table)
        print()
    count = Counter(addition.outcome for addition in made)
    parts = [f"{count['added']} added"]
    parts += [f"{count['replaced']} replaced"] if count["replaced"] else []
    parts += [f"{count['known'] + count['worse']} already known"]
    if count["worse"]:
        parts[-1] += f", {count['worse']} of them by a less severe scenario (--replace-worse)"
    parts += [f"{count['refused']} refused"]
    print(f"{to}: {', '.join(parts)}")
    written = [addition for addition in made if addition.outcome in ("added", "replaced")]
    if written:
        same = sum(addition.is_same for addition in written)
        all_same = (
            "with the recorded values, to the bit"
            if same == len(written)
            else (f"{same} with the recorded values, to the bit")
        )
        print(f"Run again there, each fails in its mode, {all_same}.")


def print_replayed(made: "Replayed", page: Path, *, as_json: bool = False) -> None:
    """Print a variation that was run again: its values, what happens, whether it is the same."""
    result, row = made.result, made.result.rows[0]
    if as_json:
        facts = {
            "scenario": result.entry,
            "variation": made.number,
            "ego": result.driver,
            "values": dict(zip(result.parameters, row.x, strict=True)),
            "result": row.model_dump(exclude={"x", "margins"}),
            "margins": {
                str(c["id"]): margin
                for c, margin in zip(result.criteria, row.margins, strict=False)
            },
            "same": made.is_same,
            "exported_same": made.is_same_exported,
            "files": [str(file) for file in made.files],
            "page": str(page),
        }
        print(json.dumps(facts, indent=2, ensure_ascii=False))
        return
    print(f"{result.entry}, variation {made.number}, ego {result.driver}: {row.verdict}")
    for name, value, unit in zip(result.parameters, row.x, result.units, strict=True):
        shown = "" if unit in ("1", "count", "?") else f" {unit}"
        print(f"  {name:<28}{value}{shown}")
    if row.conflict:
        from bridgegen.assess.conflict.findings import with_whom

        responsible = f", {row.responsible} responsible" if row.responsible else ""
        kind = f" ({row.conflict_type}{responsible})" if row.conflict_type else ""
        print(f"  {with_whom(row.conflict, row.partner)}{kind}, MAIS3+ {percent(row.severity)}")
    if row.problem or row.implausible:
        print(f"  {row.problem or f'implausible: {row.implausible}'}")
    for criterion, margin in zip(result.criteria, row.margins, strict=False):
        print(f"  {'violates' if margin < 0 else 'meets'} {criterion['id']}: margin {margin:.6g}")
    same = "the recorded one, to the bit" if made.is_same else "NOT the recorded one"
    print(f"result: {same}")
    exported = "gives it, too" if made.is_same_exported else "gives ANOTHER one"
    print(f"{made.files[-1]}: {exported}")
    print(f"page: {page}")
