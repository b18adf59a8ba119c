"""Confirmation in another simulator: the bar, then the table and the result."""

import json
from collections import Counter
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from bridgegen.screen.live import Live

if TYPE_CHECKING:
    from bridgegen.campaign.confirm import RunConfirmation, Tally
    from bridgegen.confirmation.schema import Outcome


class ConfirmationScreen(Live):
    """The live progress of scenarios that run in another simulator."""

    def stage(self, stage: str) -> None:
        """Show the stage that begins."""
        if stage == "compile":
            self.say_compiling()
        if stage == "confirm":
            self.show(what="confirming")
        if stage == "report":
            self.show(what="writing the report", facts="")

    def progress(self, done: int, total: int, tally: "Tally") -> None:
        """Show how many scenarios are done, of how many, and their results."""
        facts = f"{tally[True]} confirmed, {tally[False]} not, {tally[None]} not run"
        self.show(done=done, total=total, facts=facts)


def print_confirmation(found: "RunConfirmation", *, as_json: bool) -> None:
    """Print each scenario's result, why some are not confirmed, and the totals."""
    from bridgegen.confirmation.summary import to_json
    from bridgegen.confirmation.verdict import name_of, sentences

    record = found.record
    if as_json:
        facts: dict[str, Any] = record.model_dump(mode="json", exclude={"scenarios"})
        facts["summary"] = to_json(found.summary)
        facts["scenarios"] = [
            {"confirmed": one.confirmed, **one.model_dump(mode="json", exclude={"tracks"})}
            for one in found.scenarios
        ]
        facts["files"] = [str(path) for path in found.files]
        print(json.dumps(facts, indent=2))
        return
    print(f"{found.folder}: {record.scenario}, ego {record.ego}, in {record.label}\n")
    console = Console(markup=False, emoji=False, highlight=False)
    console.print(_table(found))
    for one in found.scenarios:
        if one.confirmed is False:
            console.print(f"\n{name_of(one)} is not confirmed. {one.explanation}")
    failures = Counter(one.failure for one in found.scenarios if one.there is None)
    if failures:
        console.print("\nNot run, so neither confirmed nor refuted:")
        for why, count in failures.most_common():
            console.print(f"  {count} x {why}")
    console.print("\n" + "\n".join(sentences(record.label, found.scenarios)))
    if earlier := len(found.scenarios) - found.ran:
        console.print(f"{earlier} of them had been confirmed before (--again runs them anew).")
    console.print(", ".join(map(str, found.files)))


def _table(found: "RunConfirmation") -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    table.add_column("scenario", no_wrap=True)
    table.add_column("there", no_wrap=True)
    by_harm = found.record.rule == "harm"
    figures = ("harm", "d_min [m]") if by_harm else ("d_min [m]", "v_d [m/s]")
    for name in (*figures, "collision [s]", "diverges [s]"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("first", overflow="fold")
    words = {True: "critical", False: "NOT", None: "not run"}
    for one in found.scenarios:
        here, there = one.here, one.there
        name = one.name or f"eval. {one.evaluation + 1}"
        if there is None or one.differences is None:
            table.add_row(name, words[one.confirmed])
            continue
        parting = next(iter(one.differences.partings), None)
        table.add_row(
            name,
            words[one.confirmed],
            *([_change(here.harm, there.harm, none="–")] if by_harm else []),
            _change(here.d_min, there.d_min),
            *([] if by_harm else [_change(here.v_d, there.v_d)]),
            _change(_touch(here), _touch(there), none="–"),
            f"{parting.time:.2f}" if parting else "never",
            parting.entity if parting else "",
        )
    return table


def _touch(one: "Outcome") -> float | None:
    return None if one.contact is None else one.contact.time


def _change(here: float | None, there: float | None, *, none: str = "∞") -> str:
    """Return a value in both simulators; once if both print the same."""
    a, b = (none if one is None else f"{one:.2f}" for one in (here, there))
    return a if a == b else f"{a} → {b}"
