"""A comparison: one bar for all its runs, then its tables."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from bridgegen.screen.live import Live

if TYPE_CHECKING:
    from bridgegen.comparison import Comparison, ComparisonCallbacks
    from bridgegen.comparison.plan import Plan

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
        from bridgegen.comparison import ComparisonCallbacks

        return ComparisonCallbacks(
            compile=self.say_compiling, batch=self.batch, ended=self.end, begun=self._begin,
            stage=lambda stage: self.show(what=_STAGES[stage], facts=""),
        )  # fmt: skip

    def _begin(self, plan: "Plan", ended: int, made: int) -> None:
        self.begin(len(plan.cells), plan.budget, ended, made)


def print_comparison(comparison: "Comparison", seconds: float) -> None:
    """Print, for each scenario, its findings and two tables; then the files' paths."""
    from bridgegen.comparison import words

    plan = comparison.plan
    console = Console(markup=False, emoji=False, highlight=False)
    if not sys.stdout.isatty():
        console.width = 120
    for scenario in plan.scenarios:
        console.print(f"\n{scenario}, {plan.budget} evaluations a run, medians over the runs")
        if scenario in comparison.measured:
            console.print(_criticality(comparison, scenario))
            console.print(_variety(comparison, scenario))
        for sentence in words.sentences(comparison, scenario):
            console.print(sentence)
    for cell, why in comparison.gaps.items():
        console.print(f"missing: {cell.name}: {why}")
    print()
    for name, path in (("page", comparison.page), ("tables", Path(comparison.folder) / "*.csv")):
        print(f"{name:<10}{path}")
    print(f"{'runs':<10}{Path(comparison.folder) / 'runs'}  (bridgegen resume, coverage, …)")
    print(f"{'wall time':<10}{seconds:.1f} s")


def _criticality(comparison: "Comparison", scenario: str) -> Table:
    """Return the table of how often and how soon, with the tests of R_critic."""
    from bridgegen.comparison import words

    early = [one for one in comparison.measures if one.name.startswith("to_")]
    table = _table(
        "algorithm", "runs", "R_critic", "quartiles", "p", "A12", "T_critic",
        *(one.title for one in early),
    )  # fmt: skip
    kinds = {one.name: one for one in comparison.measures}
    for name in comparison.plan.algorithms:
        share, relative = (comparison.line(scenario, name, one) for one in ("r_critic", "t_critic"))
        table.add_row(
            name,
            str(share.runs),
            words.median(share, kinds["r_critic"]),
            words.span(share, kinds["r_critic"]),
            words.p_value(share.p_holm),
            words.number(share.a12, 2),
            words.median(relative, kinds["t_critic"]),
            *(words.median(comparison.line(scenario, name, one.name), one) for one in early),
        )
    return table


def _variety(comparison: "Comparison", scenario: str) -> Table:
    """Return the table of variety and of the time that it took."""
    from bridgegen.comparison import words

    shown_names = {
        "distinct", "modes", "critical_bins", "critical_pairs", "hypervolume", "gd", "spread",
        "seconds",
    }  # fmt: skip
    shown = [one for one in comparison.measures if one.name in shown_names]
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
