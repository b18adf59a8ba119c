"""A benchmark of drivers: one bar for all its runs, then the table of drivers."""

import sys
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from bridgegen.cli.terminal.comparison import RunsScreen
from bridgegen.cli.terminal.tables import WHOLE

if TYPE_CHECKING:
    from bridgegen.jobs.benchmark import Benchmark, BenchmarkCallbacks
    from bridgegen.jobs.benchmark.plan import Plan

_STAGES = {
    "domains": "reading the scenarios", "speeds": "measuring speeds", "search": "searching",
    "triage": "testing failures", "judge": "careful drivers", "read": "reading the runs",
}  # fmt: skip


class BenchmarkScreen(RunsScreen):
    """A benchmark's live progress."""

    @property
    def callbacks(self) -> "BenchmarkCallbacks":
        """The callbacks for a benchmark."""
        from bridgegen.jobs.benchmark import BenchmarkCallbacks

        return BenchmarkCallbacks(
            compile=self.say_compiling, batch=self.batch, ended=self.end, begun=self._begin,
            stage=lambda stage: self.show(what=_STAGES[stage], facts=""),
            measuring=lambda driver: self.show(facts=driver),
            estimated=self._estimated,
            tasks=lambda number, done: self.show(done=done, total=number, facts=""),
        )  # fmt: skip

    def _estimated(self, plan: "Plan", seconds: float) -> None:
        self._of_each = plan.budget
        for one in plan.entrants:
            if one.problem:
                self.console.print(f"{one.name}: {one.problem}", markup=False, highlight=False)
        self.console.print(
            f"{len(plan.cells)} runs of {plan.budget:,} evaluations: about {_duration(seconds)}, "
            "by the speed of each driver on this machine; less where runs have ended already",
            markup=False, highlight=False,
        )  # fmt: skip

    def _begin(self, runs: int, ended: int, made: int) -> None:
        self.begin(runs, self._of_each, ended, made)


def print_benchmark(result: "Benchmark", seconds: float) -> None:
    """Print the table of drivers, and the files' paths."""
    from bridgegen.jobs.benchmark.failures import CAREFUL
    from bridgegen.jobs.benchmark.plan import COLUMNS
    from bridgegen.jobs.compare.words import number

    console = Console(markup=False, emoji=False, highlight=False)
    if not sys.stdout.isatty():
        console.width = WHOLE
    table = Table(box=None, pad_edge=False, header_style="bold")
    heads = (
        "driver", "perception", "modes", "robust", "first", "severity",
        *(f"{name} avoids" for name in CAREFUL), "scenarios", "n/a", "no result", "failed rows",
    )  # fmt: skip
    for name in heads:
        table.add_column(name, justify="left" if name in heads[:2] else "right", overflow="fold")
    for one in result.standings:
        shares = (one.avoided.get(name, float("nan")) for name in CAREFUL)
        table.add_row(
            one.driver, COLUMNS[one.column].removesuffix(" perception"), str(one.modes),
            str(one.robust), number(one.first, 0), f"{one.severity:.2f}",
            *(number(100 * share, 0) + ("" if share != share else " %") for share in shares),
            str(one.driven), str(one.not_applicable), str(one.failed), str(one.failed_rows),
        )  # fmt: skip
    console.print(table)
    for cell, why in result.gaps.items():
        console.print(f"missing: {cell.name}: {why}")
    print()
    print(f"{'page':<10}{result.page}")
    print(f"{'tables':<10}{result.plan.out / '*.csv'}")
    print(f"{'runs':<10}{result.plan.out / 'runs'}  (bridgegen resume, view, …)")
    print(f"{'wall time':<10}{_duration(seconds)}")


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 90 else f"{minutes / 60:.1f} h"
