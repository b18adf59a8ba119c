"""The report's data: plain data in SI units, whose shapes are checked on construction.

Numbers may be NaN or infinite wherever a quantity does not exist (no critical scenario yet, no
time to collision); the page shows a dash there.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.happening import Happening
from bridgegen.assess.criteria import CriterionSummary
from bridgegen.base.arrays import Bool, Float, Int, Numbers, as_float
from bridgegen.pages.notes import NoteTable
from bridgegen.pages.playback import Playback
from bridgegen.results.confirmation.record import Record
from bridgegen.scenario.language.coverage import CoverageMap
from bridgegen.search.triage.record import Triage


@dataclass(frozen=True)
class RunSummary:
    """The search: its scenario, settings and result.

    Attributes:
        scenario: the logical scenario's name ("crossroads-s4").
        title: the same for people ("Left turn into the path of a crossing car").
        description: one or two sentences more; may be empty.
        road: where it was searched ("generated crossroads", "Town05, junction 965").
        ego: the system under test ("route-follower").
        baseline: the driver that it is compared with; "" without one.
        algorithm: the search algorithm's name ("pso").
        seed: the seed of the whole run.
        budget: requested number of evaluations.
        n_evaluations: evaluations done, failed ones included.
        n_critical: number of critical ones.
        r_critic: critical evaluations / all evaluations, in [0, 1]; NaN before the first.
        critical_rule: the criterion, in words that complete "critical means …"
            ("a collision, or d_min below 2 m while v_d is at least 1 m/s").
        critical_distance: the rule's threshold on d_min [m], drawn in the distance curve; None
            draws no line.
        first_critical: evaluations until the first critical one (1 = the very first), or None.
        fiftieth_critical: evaluations until the 50th, or None.
        d_min_best: smallest d_min of the run [m].
        d_min_median: median d_min [m].
        v_d_best: largest v_d of the run [m/s].
        v_d_median: median v_d [m/s].
        wall_seconds: time that the search took [s], all sessions of a resumed run together.
        finished: False if the run was interrupted before its budget.
        version: BridgeGen's version.
        command: the exact command line that starts this run again.
        started: when the run began, as ISO 8601 text; may be empty.
        keep: the command line that keeps its failures in a suite.
        view: the command line that shows this run's page with the motion of every scenario.
        independent: whether each row was drawn by itself, as random search draws them.
        harm: the metric that makes a scenario critical, "harm" or "harm_any"; "" where the paper's
            thresholds do.
        criteria: names of the margins that make a scenario critical, where pass criteria do.
        hashes: of the run's inputs and results, name → digest.
        settings: further settings, name → text, in display order.
        odd: the operational design domain that bounds it, and how much of that is not judged; ""
            without one.
    """

    scenario: str
    title: str
    description: str
    road: str
    ego: str
    algorithm: str
    seed: int
    budget: int
    n_evaluations: int
    n_critical: int
    r_critic: float
    critical_rule: str
    critical_distance: float | None
    first_critical: int | None
    fiftieth_critical: int | None
    d_min_best: float
    d_min_median: float
    v_d_best: float
    v_d_median: float
    wall_seconds: float
    finished: bool
    version: str
    command: str
    started: str = ""
    view: str = ""
    keep: str = ""
    independent: bool = False
    harm: str = ""
    criteria: tuple[str, ...] = ()
    baseline: str = ""
    hashes: Mapping[str, str] | None = None
    settings: Mapping[str, str] | None = None
    odd: str = ""


WHOLE = ("d_min", "v_d", "n_collision", "harm", "harm_any", "severity")
"""The metrics that the page summarises over the whole run."""


class Deferred:
    """The values of a column, read when the page needs those of the rows that it holds.

    Args:
        held: the columns that are read together.
        place: index of this one among them.
    """

    def __init__(self, held: "PageRows", place: int) -> None:
        self._held, self._place = held, place

    @property
    def size(self) -> int:
        """N."""
        return len(self._held.table)

    def __getitem__(self, rows: Bool) -> Float:
        """Return the values of the rows selected by ``(N,)`` bool."""
        return self._held.of(rows)[:, self._place]


class PageRows:
    """The rows of a table that a page holds, read once, when they are known.

    Args:
        table: ``(N, k)``, possibly larger than memory.

    Attributes:
        table: the same.
    """

    def __init__(self, table: Numbers) -> None:
        self.table = table
        self._rows: Bool | None = None
        self._values = np.empty((0, 0))

    def of(self, rows: Bool) -> Float:
        """Return some rows, ``(n, k)``.

        Args:
            rows: ``(N,)`` bool.
        """
        # All columns of one page ask for the same rows: the store is read once.
        if self._rows is None or not np.array_equal(rows, self._rows):
            self._rows, self._values = rows.copy(), self.table[rows]
        return self._values


@dataclass(frozen=True)
class Column:
    """One quantity of every evaluation.

    Attributes:
        name: of the parameter, metric or objective, unique over all columns.
        unit: "m", "m/s", "%", "deg", "s", "count" …; "1" or "" for a pure number.
        values: ``(N,)`` float64 in that unit; NaN or ±inf where it does not exist. Those of
            objectives, of the metrics of `WHOLE` and of margins must be in memory.
        description: one line for people; may be empty.
        low: lower end of the declared range, in the unit; None where there is none.
        high: upper end.
        searched: a parameter that the algorithm varied; False for fixed and derived ones.
        labels: texts of a parameter's values, see `bridgegen.scenario.language.kinds.Kind.labels`.
    """

    name: str
    unit: str
    values: "Float | Deferred"
    description: str = ""
    low: float | None = None
    high: float | None = None
    searched: bool = False
    labels: Mapping[str, Any] = field(default_factory=dict)

    @property
    def whole(self) -> Float:
        """The values of all rows.

        Raises:
            ValueError: they are not in memory.
        """
        if isinstance(self.values, Deferred):
            raise ValueError(f"the values of {self.name} must be in memory")
        return self.values


@dataclass(frozen=True)
class Evaluations:
    """All N evaluations of a run, in the order in which they were made.

    Attributes:
        iteration: ``(N,)`` int64, the batch that each row belongs to, counted from 0, ascending.
        parameters: all parameters, searched, fixed and derived.
        metrics: all recorded metrics; the page's charts and lists expect ``d_min`` [m] and
            ``v_d`` [m/s] among them and show ``n_collision`` and ``ttc`` where they exist.
        objectives: columns of F, minimised.
        critical: ``(N,)`` bool.
        status: ``(N,)`` int64, 0 is success; every other row is counted but not drawn.
        cause: ``(N,)``, a `bridgegen.assess.cause.Cause` each; None where causes were not sought.
        findings: the decisive conflict of each row; None where conflicts were not recorded.
    """

    iteration: Int
    parameters: tuple[Column, ...]
    metrics: tuple[Column, ...]
    objectives: tuple[Column, ...]
    critical: Bool
    status: Int
    cause: npt.NDArray[np.int8] | None = None
    findings: Findings | None = None

    def __post_init__(self) -> None:
        n = self.iteration.size
        names = [column.name for column in self.columns]
        if len(set(names)) != len(names):
            twice = sorted({name for name in names if names.count(name) > 1})
            raise ValueError(f"column names must be unique, got {', '.join(twice)} twice")
        for column in self.columns:
            if not isinstance(column.values, Deferred):
                as_float(f"{column.name} [{column.unit}]", column.values, (n,), finite=False)
            elif column.values.size != n:
                raise ValueError(f"{column.name} must have {n} values, got {column.values.size}")
        arrays = {"critical": self.critical, "status": self.status, "cause": self.cause}
        for name, array in arrays.items():
            if array is not None and array.shape != (n,):
                raise ValueError(f"{name} must have shape {(n,)}, got {array.shape}")
        if self.findings is not None and len(self.findings) != n:
            raise ValueError(f"findings must be those of {n} rows, got {len(self.findings)}")
        if n and (self.iteration[1:] < self.iteration[:-1]).any():
            raise ValueError("iteration must ascend")

    @property
    def columns(self) -> tuple[Column, ...]:
        """Parameters, metrics and objectives, in this order."""
        return self.parameters + self.metrics + self.objectives


@dataclass(frozen=True)
class ReportData:
    """The input of ``page.write_report``.

    Attributes:
        summary: the run in figures.
        evaluations: every row.
        kept: the exported scenarios, most critical first; may be empty.
        more: further scenarios, most critical first, whose motion the page holds as far as there
            is room; iterated once per page, which simulates them then.
        files: those of the exported scenarios, by their paths relative to the page, the most
            important first; the page holds them as far as there is room.
        coverage: which bins and pairs of bins were evaluated, if it is to be shown.
        notes: the algorithm's notes on the run.
        regions: the critical ones, in the form of `bridgegen.search.regions.record`, if they are
            known.
        confirmations: of its scenarios in other simulators, one each.
        triage: the failure modes and the bound of the harmful share, once the run has finished.
        minimal: the minimal scenarios of failure modes; ``evaluation`` is the mode's ``shown``.
        drawn: the failing fresh random draws, the worst first, which are no rows.
        criteria: how the evaluations meet the pass criteria, whose margins are metrics.
        screened: how far the run's screen agrees, as `screened_payload` returns it.
        happening: which events began, and who came near the ego, if the run recorded it.
        simulation: what the page simulates with; see `simulation_payload`. None: it does not.
        beside: pages of other analyses of the run, files of its folder.
        alone: whether the page is about its only exported scenario, see `only`.
    """

    summary: RunSummary
    evaluations: Evaluations
    kept: tuple[Playback, ...] = ()
    coverage: CoverageMap | None = None
    notes: tuple[NoteTable, ...] = ()
    regions: Mapping[str, Any] | None = None
    more: Iterable[Playback] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    confirmations: Sequence[Record] = ()
    triage: Triage | None = None
    minimal: tuple[Playback, ...] = ()
    drawn: tuple[Playback, ...] = ()
    criteria: tuple[CriterionSummary, ...] = ()
    screened: Mapping[str, Any] | None = None
    happening: Happening | None = None
    simulation: Mapping[str, Any] | None = None
    beside: tuple[str, ...] = ()
    alone: bool = False

    def __post_init__(self) -> None:
        n = self.evaluations.iteration.size
        for playback in (*self.kept, *self.minimal):
            if not 0 <= playback.evaluation < n:
                raise ValueError(
                    f"evaluation of playback '{playback.name}' must be in 0..{n - 1}, "
                    f"got {playback.evaluation}"
                )


def only(data: ReportData, name: str) -> ReportData | None:
    """Return the data of a report on one of its exported scenarios; None if there is none such.

    The page then has its row, motion and files; the rest of the run is in its figures alone.
    """
    kept = tuple(playback for playback in data.kept if playback.name == name)
    if not kept:
        return None
    return replace(
        data,
        kept=kept,
        coverage=None,
        notes=(),
        regions=None,
        more=(),
        files={path: text for path, text in data.files.items() if path in kept[0].files},
        confirmations=(),
        triage=None,
        minimal=(),
        drawn=(),
        screened=None,
        happening=None,
        alone=True,
    )
