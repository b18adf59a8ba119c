"""The results of a comparison, for tables, pages and notebooks."""

import csv
import html
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.base.extras import require
from bridgegen.jobs.compare.measures import Measure, Measured
from bridgegen.jobs.compare.plan import Cell, Plan
from bridgegen.jobs.compare.record import Record
from bridgegen.jobs.compare.table import RUNS_FILE, SUMMARY_FILE, TIMES_FILE, Line
from bridgegen.jobs.frame import Judged, Table

if TYPE_CHECKING:
    import pandas as pd

PAGE = "compare.html"
MOST_SHOWN = 60
"""Maximum number of lines of a table in a notebook."""


@dataclass(frozen=True)
class Comparison:
    """The results of a comparison.

    Attributes:
        plan: of the comparison.
        records: of the runs that have ended.
        measured: by scenario.
        gaps: reasons why the other runs failed.
        lines: every measure of every algorithm over its runs, tested against the baseline.
        measures: all measures.
    """

    plan: Plan
    records: Mapping[Cell, Record]
    measured: Mapping[str, Measured]
    gaps: Mapping[Cell, str]
    lines: tuple[Line, ...]
    measures: tuple[Measure, ...]

    @property
    def folder(self) -> Path:
        """The comparison's folder, which holds the runs' folders."""
        return self.plan.out

    @property
    def page(self) -> Path:
        """The HTML page with all results."""
        return self.folder / PAGE

    @property
    def work(self) -> str:
        """How many runs there are."""
        return f"{len(self.plan.cells):,} runs"

    def to_json(self) -> list[dict[str, object]]:
        """Return what ``summary.csv`` says, a measure of an algorithm each."""
        return [
            {
                "scenario": line.scenario,
                "algorithm": line.algorithm,
                "measure": line.measure,
                "runs": line.runs,
                "never": line.never,
                **{name: number(value) for name, value in vars(line.quartiles).items()},
                "p": number(line.p),
                "p_holm": number(line.p_holm),
                "a12": number(line.a12),
            }
            for line in self.lines
        ]

    def shown(self) -> list[str | Table]:
        """Return what the terminal shows."""
        from bridgegen.jobs.compare import words

        return [*words.lines(self)]

    def judged(self) -> tuple[Judged, ...]:
        """Return how many runs have a result."""
        figures = {"runs": float(len(self.records)), "missing": float(len(self.gaps))}
        name = "-".join(self.plan.scenarios)
        return (
            Judged(
                suite=f"{name} comparison",
                group=f"bridgegen.{name}",
                test="runs have results",
                holds=bool(self.records),
                details=f"{len(self.records)} of {self.work}",
                figures=figures,
                facts={"command": self.plan.command(), "page": str(self.page)},
            ),
        )

    def line(self, scenario: str, algorithm: str, measure: str) -> Line:
        """Return one measure of one algorithm in one scenario.

        Raises:
            KeyError: no such line.
        """
        wanted = (scenario, algorithm, measure)
        found = (
            item for item in self.lines if (item.scenario, item.algorithm, item.measure) == wanted
        )
        for item in found:
            return item
        raise KeyError(wanted)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the table of all measures, and where the page is."""
        with (self.folder / SUMMARY_FILE).open(encoding="utf-8", newline="") as file:
            head, *rows = csv.reader(islice(file, MOST_SHOWN + 1))
        table = _tr("th", head) + "".join(_tr("td", row) for row in rows)
        page = html.escape(str(self.page))
        return f"<table>{table}</table><p>Whole comparison: <code>{page}</code></p>"

    def frame(self) -> "pd.DataFrame":
        """Return every measure of every run, one a row: ``runs.csv``. Needs pandas."""
        return self._frame(RUNS_FILE)

    def summary(self) -> "pd.DataFrame":
        """Return every measure over an algorithm's runs: ``summary.csv``. Needs pandas."""
        return self._frame(SUMMARY_FILE)

    def times(self) -> "pd.DataFrame":
        """Return each run's duration, which is not repeatable: ``times.csv``. Needs pandas."""
        return self._frame(TIMES_FILE)

    def _frame(self, name: str) -> "pd.DataFrame":
        require("pandas", "a data frame")
        import pandas as pd

        return pd.read_csv(self.folder / name)


def _tr(kind: str, cells: Iterable[str]) -> str:
    inner = "".join(f"<{kind}>{html.escape(cell)}</{kind}>" for cell in cells)
    return f"<tr>{inner}</tr>"


def number(value: float) -> float | None:
    """Return a value as JSON has it: None for what is infinite or NaN."""
    return value if isfinite(value) else None
