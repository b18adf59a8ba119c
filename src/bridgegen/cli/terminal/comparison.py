"""A comparison: one bar for all its runs, then its tables."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from bridgegen.cli.terminal.live import Live
from bridgegen.cli.terminal.tables import WHOLE

if TYPE_CHECKING:
    from bridgegen.jobs.compare import Comparison, ComparisonCallbacks
    from bridgegen.jobs.compare.plan import Plan

_STAGES = {"read": "reading the runs", "draw": "drawing"}


class RunsScreen(Live):
    """The live progress of many runs: evaluations of all, runs that have ended."""

    def __init__(self) -> None:
        super().__init__()
        self._runs = self._ended = self._budget = self._total = self._failed = 0
        self._evaluations: dict[str, int] = {}
        self._before = 0

    def begin(self, runs: int, budget: int, ended: int, made: int) -> None:
        """Begin with a number of runs, of which some have ended, and their evaluations."""
        self._runs, self._ended, self._before = runs, ended, made
        self._budget = budget
        self._total = made + (runs - ended) * budget
        self._show()

    def batch(self, name: str, evaluations: int) -> None:
        """Show a run's number of evaluations."""
        self._evaluations[name] = evaluations
        self._show()

    def end(self, name: str, failure: str | None) -> None:
        """Show that a run has ended, or why it failed."""
        self._ended += 1
        if failure is not None:
            self._failed += 1
            self.console.print(f"{name} failed: {failure}", markup=False, highlight=False)
        self._total -= self._budget - self._evaluations.get(name, 0)
        self._show()

    def _show(self) -> None:
        made = self._before + sum(self._evaluations.values())
        facts = f"{self._ended} of {self._runs} runs"
        if self._failed:
            facts += f", {self._failed} failed"
        self.show(what="", done=made, total=self._total, facts=facts)


class ComparisonScreen(RunsScreen):
    """A comparison's live progress."""

    @property
    def callbacks(self) -> "ComparisonCallbacks":
        """The callbacks for a comparison."""
        from bridgegen.jobs.compare import ComparisonCallbacks

        return ComparisonCallbacks(
            compile=self.say_compiling, batch=self.batch, ended=self.end, begun=self._begin,
            stage=lambda stage: self.show(what=_STAGES[stage], facts=""),
        )  # fmt: skip

    def _begin(self, plan: "Plan", ended: int, made: int) -> None:
        self.begin(len(plan.cells), plan.budget, ended, made)


def print_comparison(comparison: "Comparison", seconds: float) -> None:
    """Print, for each scenario, its findings and two tables; then the files' paths."""
    from bridgegen.jobs.compare import words

    plan = comparison.plan
    console = Console(markup=False, emoji=False, highlight=False)
    if not sys.stdout.isatty():
        console.width = WHOLE
    for scenario in plan.scenarios:
        console.print(f"\n{scenario}, {plan.budget} evaluations a run, medians over the runs")
        if scenario in comparison.measured:
            console.print(_findings(comparison, scenario))
            console.print(_others(comparison, scenario))
        for sentence in words.sentences(comparison, scenario):
            console.print(sentence)
    for cell, why in comparison.gaps.items():
        console.print(f"missing: {cell.name}: {why}")
    print()
    for name, path in (("page", comparison.page), ("tables", Path(comparison.folder) / "*.csv")):
        print(f"{name:<10}{path}")
    print(f"{'runs':<10}{Path(comparison.folder) / 'runs'}  (bridgegen resume, coverage, …)")
    print(f"{'wall time':<10}{seconds:.1f} s")


def _findings(comparison: "Comparison", scenario: str) -> Table:
    """Return the table of what was found and how soon, with the tests of ``distinct``."""
    from bridgegen.jobs.compare import words

    kinds = {one.name: one for one in comparison.measures}
    early = [name for name in kinds if name.endswith(("_distinct", "_modes", "to_1"))]
    table = _table(
        "algorithm", "found in", "modes", "distinct", "quartiles", "p", "A12",
        *(kinds[name].title for name in early), "R_critic",
    )  # fmt: skip
    for name in comparison.plan.algorithms:
        lines = {one: comparison.line(scenario, name, one) for one in kinds}
        distinct = lines["distinct"]
        table.add_row(
            name,
            words.runs_that_find(lines["to_1"]),
            words.median(lines["modes"], kinds["modes"]),
            words.median(distinct, kinds["distinct"]),
            words.span(distinct, kinds["distinct"]),
            words.p_value(distinct.p_holm),
            words.number(distinct.a12, 2),
            *(words.median(lines[one], kinds[one]) for one in (*early, "r_critic")),
        )
    return table


def _others(comparison: "Comparison", scenario: str) -> Table:
    """Return the table of the other measures, and of the time that it took."""
    from bridgegen.jobs.compare import words

    names = {
        "t_critic", "to_10", "to_50", "critical_bins", "critical_pairs", "hypervolume", "gd",
        "spread", "seconds",
    }  # fmt: skip
    shown = [one for one in comparison.measures if one.name in names]
    table = _table("algorithm", *(one.title for one in shown))
    for name in comparison.plan.algorithms:
        lines = (comparison.line(scenario, name, one.name) for one in shown)
        table.add_row(
            name, *(words.median(line, one) for line, one in zip(lines, shown, strict=True))
        )
    return table


def _table(*head: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in head:
        table.add_column(name, justify="left" if name == "algorithm" else "right")
    return table
