"""The results of a comparison, for tables, pages and notebooks."""

import html
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bridgegen.comparison.measures import Measure, Measured
from bridgegen.comparison.plan import Cell, Plan
from bridgegen.comparison.record import Record
from bridgegen.comparison.table import RUNS_FILE, SUMMARY_FILE, TIMES_FILE, Line

if TYPE_CHECKING:
    import pandas as pd

PAGE = "compare.html"


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

    def line(self, scenario: str, algorithm: str, measure: str) -> Line:
        """Return one measure of one algorithm in one scenario.

        Raises:
            KeyError: no such line.
        """
        wanted = (scenario, algorithm, measure)
        found = (one for one in self.lines if (one.scenario, one.algorithm, one.measure) == wanted)
        for one in found:
            return one
        raise KeyError(wanted)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the table of all measures, and where the page is."""
        table = self.summary().to_html(index=False, max_rows=60, border=0)
        page = html.escape(str(self.page))
        return f"{table}<p>Whole comparison: <code>{page}</code></p>"

    def frame(self) -> "pd.DataFrame":
        """Return every measure of every run, one a row: ``runs.csv``."""
        import pandas as pd

        return pd.read_csv(self.folder / RUNS_FILE)

    def summary(self) -> "pd.DataFrame":
        """Return every measure over the runs of an algorithm, one a row: ``summary.csv``."""
        import pandas as pd

        return pd.read_csv(self.folder / SUMMARY_FILE)

    def times(self) -> "pd.DataFrame":
        """Return the duration of every run, which is not repeatable: ``times.csv``."""
        import pandas as pd

        return pd.read_csv(self.folder / TIMES_FILE)
