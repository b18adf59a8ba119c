"""Confirmation in another simulator: the bar, then the table and the result."""

import json
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from bridgegen.cli.terminal.live import Live

if TYPE_CHECKING:
    from bridgegen.jobs.search.confirm import RunConfirmation, Tally
    from bridgegen.results.confirmation.record import Outcome

MOST_MARGINS = 3
"""Maximum number of columns with margins of pass criteria."""


class ConfirmationProgress(Live):
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
    from bridgegen.results.confirmation.summary import to_json
    from bridgegen.results.confirmation.words import name_of, sentences

    record = found.record
    if as_json:
        facts: dict[str, Any] = record.model_dump(mode="json", exclude={"scenarios"})
        facts["summary"] = to_json(found.summary)
        facts["scenarios"] = [
            {
                "confirmed": scenario.confirmed,
                **scenario.model_dump(mode="json", exclude={"tracks"}),
            }
            for scenario in found.scenarios
        ]
        facts["files"] = [str(path) for path in found.files]
        print(json.dumps(facts, indent=2))
        return
    print(f"{found.folder}: {record.scenario}, ego {record.ego}, in {record.label}\n")
    console = Console(markup=False, emoji=False, highlight=False)
    console.print(_table(found))
    for scenario in found.scenarios:
        if scenario.confirmed is False:
            console.print(f"\n{name_of(scenario)} is not confirmed. {scenario.explanation}")
    failures = Counter(scenario.failure for scenario in found.scenarios if scenario.there is None)
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
    figures = _figures(found)
    for name in (*figures, "collision [s]", "diverges [s]"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("first", overflow="fold")
    words = {True: "critical", False: "NOT", None: "not run"}
    for scenario in found.scenarios:
        here, there = scenario.here, scenario.there
        name = scenario.name or f"eval. {scenario.evaluation + 1}"
        if there is None or scenario.differences is None:
            table.add_row(name, words[scenario.confirmed])
            continue
        parting = next(iter(scenario.differences.partings), None)
        table.add_row(
            name,
            words[scenario.confirmed],
            *(
                _change(of(here), of(there), none="∞" if of is _distance else "–")
                for of in figures.values()
            ),
            _change(_touch(here), _touch(there), none="–"),
            f"{parting.time:.2f}" if parting else "never",
            parting.entity if parting else "",
        )
    return table


def _figures(found: "RunConfirmation") -> dict[str, Callable[["Outcome"], float | None]]:
    """Return what the verdict depends on, by its title: of the run's rule."""
    if found.record.rule == "harm":
        return {"harm": lambda outcome: outcome.harm, "d_min [m]": _distance}
    if found.record.rule == "thresholds":
        return {"d_min [m]": _distance, "v_d [m/s]": lambda outcome: outcome.v_d}
    margins = found.scenarios[0].here.margins if found.scenarios else {}
    units = {
        name: f"{name} [{margin.unit}]".replace(" [1]", "") for name, margin in margins.items()
    }
    shown = list(units.items())[:MOST_MARGINS]
    return {title: partial(_margin_of, name) for name, title in shown} | {"d_min [m]": _distance}


def _margin_of(name: str, outcome: "Outcome") -> float | None:
    return outcome.margins[name].value if name in outcome.margins else None


def _distance(outcome: "Outcome") -> float | None:
    return outcome.d_min


def _touch(outcome: "Outcome") -> float | None:
    return None if outcome.contact is None else outcome.contact.time


def _change(here: float | None, there: float | None, *, none: str = "∞") -> str:
    """Return a value in both simulators; once if both print the same."""
    a, b = (none if value is None else f"{value:.2f}" for value in (here, there))
    return a if a == b else f"{a} → {b}"
