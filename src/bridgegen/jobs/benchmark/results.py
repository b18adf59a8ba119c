"""What the runs of a benchmark found, by driver and scenario; and as CSV."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path
from typing import Literal

import numpy as np

from bridgegen.base.errors import BridgeGenError
from bridgegen.base.statistics import quartiles
from bridgegen.jobs.benchmark.failures import (
    CAREFUL,
    RESPONSIBLE,
    SCRIPT,
    failures_of,
    read_judgement,
)
from bridgegen.jobs.benchmark.plan import Cell, Entrant, Plan, why_not
from bridgegen.jobs.compare.plan import RUNS
from bridgegen.jobs.compare.table import write_csv
from bridgegen.jobs.search.exported import FOLDER
from bridgegen.jobs.search.run import REPORT, Run
from bridgegen.search.triage.record import Mode

State = Literal["driven", "not applicable", "failed"]


@dataclass(frozen=True)
class Way:
    """A failure mode of a driver in a scenario, for which it is responsible.

    Attributes:
        title: in words.
        robust: whether most neighbours of its scenario fail, too; None where that is not tested.
        harm: the worst.
        severity: the worst, probability of MAIS3+.
        causes: that it has in the runs that were tested.
        minimal: its minimal scenario in words; empty where none is known.
        scenario: its file, relative to the benchmark's folder; empty where none was exported.
        minimal_scenario: likewise, of the minimal scenario.
        script: likewise, what reproduces it.
        playback: likewise, the report where it is played.
    """

    title: str
    robust: bool | None
    harm: float
    severity: float
    causes: tuple[str, ...]
    minimal: str
    scenario: str
    minimal_scenario: str
    script: str
    playback: str


@dataclass(frozen=True)
class Outcome:
    """What a driver did in a scenario, in one column of perception.

    Attributes:
        driver: its name.
        scenario: its name.
        column: of `COLUMNS`.
        state: whether it drove; "not applicable" says nothing of the driver, "failed" that no run
            has a result.
        why: of the latter two; or why some runs have none.
        runs: that have a result.
        evaluations: of all of them.
        failed_rows: evaluations without a result.
        messages: why, the most frequent first, with their number.
        failures: evaluations in which it failed and was responsible.
        preventable: further ones for which others are responsible, that it could have prevented.
        first: of each run, the evaluations until the first failure; +inf if there is none.
        severity: the worst of its failures, probability of MAIS3+.
        avoided: by careful driver, in how many of its failures that one does not fail.
        judged: number of its failures that they have driven again.
        ways: in which it fails, robust ones first, then by harm.
        unjudged: why none of its triaged runs says anything of it, a sentence; "" if one does.
    """

    driver: str
    scenario: str
    column: str
    state: State
    why: str = ""
    runs: int = 0
    evaluations: int = 0
    failed_rows: int = 0
    messages: tuple[tuple[str, int], ...] = ()
    failures: int = 0
    preventable: int = 0
    first: tuple[float, ...] = ()
    severity: float = 0.0
    avoided: Mapping[str, int] | None = None
    judged: int = 0
    ways: tuple[Way, ...] = ()
    unjudged: str = ""

    @property
    def robust(self) -> int:
        """How many of its ways to fail are robust."""
        return sum(bool(way.robust) for way in self.ways)


@dataclass(frozen=True)
class Standing:
    """A driver over all scenarios that are applicable to it, in one column of perception.

    Attributes:
        driver: its name.
        column: of `COLUMNS`.
        driven: number of scenarios that it drove.
        not_applicable: number outside its domain.
        failed: number of scenarios without a result.
        modes: distinct failure modes for which it is responsible.
        robust: of them.
        first: median over its runs of the evaluations until the first failure; +inf if most have
            none.
        severity: the worst, probability of MAIS3+.
        failures: evaluations in which it failed and was responsible.
        evaluations: of all its runs.
        failed_rows: evaluations without a result.
        causes: of its modes, with their number, the most frequent first.
        avoided: by careful driver, the share of its failures that one avoids; NaN without failures.
    """

    driver: str
    column: str
    driven: int
    not_applicable: int
    failed: int
    modes: int
    robust: int
    first: float
    severity: float
    failures: int
    evaluations: int
    failed_rows: int
    causes: tuple[tuple[str, int], ...]
    avoided: Mapping[str, float]


def outcomes(plan: Plan, gaps: Mapping[Cell, str]) -> tuple[Outcome, ...]:
    """Return every outcome: by driver, scenario and column.

    Args:
        plan: of the benchmark.
        gaps: why runs have no result.
    """
    return tuple(
        _outcome(plan, gaps, entrant, scenario, column)
        for entrant in plan.entrants
        for scenario in plan.scenarios
        for column in entrant.columns
    )


def standings(found: Iterable[Outcome]) -> tuple[Standing, ...]:
    """Return every driver's standing in each of its columns, in the order of the outcomes."""
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for outcome in found:
        groups.setdefault((outcome.driver, outcome.column), []).append(outcome)
    return tuple(_standing(driver, column, some) for (driver, column), some in groups.items())


def _outcome(
    plan: Plan, gaps: Mapping[Cell, str], entrant: Entrant, scenario: str, column: str
) -> Outcome:
    name = entrant.name
    if not plan.is_applicable(entrant, scenario):
        why = why_not(plan, entrant, scenario)
        return Outcome(name, scenario, column, "not applicable", why)
    if entrant.problem:
        return Outcome(name, scenario, column, "failed", entrant.problem)
    cells = [plan.cell(scenario, entrant, column, seed) for seed in range(plan.seeds)]
    why = next((gaps[cell] for cell in cells if cell in gaps), "")
    why = why.replace(f"{plan.out}/", "")  # a folder may be moved, and says the same
    good = [cell for cell in cells if cell not in gaps]
    if not good:
        return Outcome(name, scenario, column, "failed", why)
    messages: Counter[str] = Counter()
    avoided: Counter[str] = Counter()
    evaluations = failed_rows = failures = preventable = judged = 0
    first, severity, modes, bounds = [], 0.0, [], []
    for cell in good:
        run = Run(plan.folder(cell))
        rows = run.rows()
        own = failures_of(run, rows)
        messages += run.failures
        evaluations, failed_rows = (
            evaluations + len(rows),
            failed_rows + int((rows.status != 0).sum()),
        )
        failures, preventable = failures + len(own.rows), preventable + own.others
        first.append(float(own.rows[0] + 1) if len(own.rows) else inf)
        severity = max(severity, *own.severity, 0.0)
        judgement = read_judgement(plan.folder(cell))
        if judgement is not None:
            judged += judgement.failures
            avoided += Counter(judgement.avoided)
        bounds += [run.triage.bound] if run.triage is not None else []
        modes += [(cell, run, mode) for mode in run.modes if mode.responsible in RESPONSIBLE]
    return Outcome(
        name, scenario, column, "driven", why, len(good), evaluations, failed_rows,
        tuple(messages.most_common()), failures, preventable, tuple(first), severity,
        dict(avoided), judged, _ways(modes),
        "" if any(bound.judged for bound in bounds) or not bounds else bounds[0].sentence,
    )  # fmt: skip


def _ways(modes: Iterable[tuple[Cell, Run, Mode]]) -> tuple[Way, ...]:
    """Return the distinct ways to fail of several runs; those that differ in cause are one."""
    groups: dict[tuple[str, ...], list[tuple[Cell, Run, Mode]]] = {}
    for cell, run, mode in modes:
        key = (
            mode.conflict,
            mode.conflict_type,
            mode.responsible,
            mode.partner,
            mode.place,
        )
        groups.setdefault(key, []).append((cell, run, mode))
    found = [_way(some) for some in groups.values()]
    return tuple(sorted(found, key=lambda way: (not way.robust, -way.harm, way.title)))


def _way(same: list[tuple[Cell, Run, Mode]]) -> Way:
    """Return what several runs found of one way to fail; the worst exported one stands for it."""
    cell, run, shown = max(
        same, key=lambda each: (bool(each[2].exports), not each[2].knife_edge, each[2].harm)
    )
    tested = [mode for _, _, mode in same if mode.robustness is not None]
    robust = any(not mode.knife_edge for mode in tested) if tested else None
    place = Path(RUNS) / cell.name
    name = shown.exports[0] if shown.exports else ""
    stem = place / FOLDER / name
    small = next((each for each in same if each[2].minimal is not None), None)
    minimal = small[2].minimal if small else None
    file = ""
    if small and minimal and minimal.name:
        at = Path(RUNS) / small[0].name / FOLDER / f"{minimal.name}.xosc"
        file = at.as_posix() if (small[1].folder / FOLDER / at.name).is_file() else ""
    script = run.folder / FOLDER / f"{name}{SCRIPT}"
    return Way(
        title=shown.title,
        robust=robust,
        harm=max(mode.harm for _, _, mode in same),
        severity=max(mode.severity for _, _, mode in same),
        causes=tuple(sorted({mode.cause for _, _, mode in same if mode.cause})),
        minimal=minimal.sentence if minimal else "",
        scenario=f"{stem.as_posix()}.xosc" if name else "",
        minimal_scenario=file,
        script=f"{stem.as_posix()}{SCRIPT}" if name and script.is_file() else "",
        playback=f"{place.as_posix()}/{REPORT}#{name}" if name else "",
    )


def _standing(driver: str, column: str, some: list[Outcome]) -> Standing:
    ways = [way for outcome in some for way in outcome.ways]
    judged = sum(outcome.judged for outcome in some)
    avoided: Counter[str] = Counter()
    for outcome in some:
        avoided.update(outcome.avoided or {})
    first = [value for outcome in some for value in outcome.first]
    causes = Counter(cause for way in ways for cause in way.causes)
    states = Counter(outcome.state for outcome in some)
    return Standing(
        driver=driver,
        column=column,
        driven=states["driven"],
        not_applicable=states["not applicable"],
        failed=states["failed"],
        modes=len(ways),
        robust=sum(bool(element.robust) for element in ways),
        first=quartiles(np.array(first, dtype=np.float64)).median,
        severity=max((outcome.severity for outcome in some), default=0.0),
        failures=sum(outcome.failures for outcome in some),
        evaluations=sum(outcome.evaluations for outcome in some),
        failed_rows=sum(outcome.failed_rows for outcome in some),
        causes=tuple(sorted(causes.items(), key=lambda item: (-item[1], item[0]))),
        avoided={
            name: count / judged if judged else nan for name, count in sorted(avoided.items())
        },
    )


def read_gaps(plan: Plan, failures: Mapping[Cell, str]) -> dict[Cell, str]:
    """Return why runs have no result: those that failed, and those that cannot be read."""
    gaps = dict(failures)
    for cell in plan.cells:
        if cell not in gaps:
            try:
                Run(plan.folder(cell)).modes  # noqa: B018 - it is read
            except BridgeGenError as error:
                gaps[cell] = str(error)
    return gaps


# --- Results as CSV: drivers, outcomes by scenario, failure modes ---


DRIVERS_FILE, OUTCOMES_FILE, MODES_FILE = "drivers.csv", "outcomes.csv", "modes.csv"

DRIVERS_HEAD = (
    "driver",
    "perception",
    "scenarios",
    "not_applicable",
    "failed",
    "modes",
    "robust",
    "first_failure",
    "severity",
    "failures",
    "evaluations",
    "failed_rows",
    "causes",
    *(f"avoided_by_{name}" for name in CAREFUL),
)
"""Columns of the table of drivers. ``first_failure``: median of the runs, inf where most runs have
none; ``avoided_by_…``: share of the failures."""

OUTCOMES_HEAD = (
    "driver", "scenario", "perception", "state", "why", "runs", "evaluations", "failed_rows",
    "failures", "preventable", "first_failure", "severity", "modes", "robust",
    *(f"avoided_by_{name}" for name in CAREFUL),
)  # fmt: skip
"""Columns of the table of runs. ``preventable``: evaluations in which others are responsible, and
the driver could have prevented the conflict; they are no failures here."""

MODES_HEAD = (
    "driver",
    "scenario",
    "perception",
    "mode",
    "robust",
    "harm",
    "severity",
    "causes",
    "minimal",
    "scenario_file",
    "minimal_file",
    "script",
    "playback",
)
"""Columns of the table of failure modes. ``robust``: empty where it was not tested."""


def write_tables(plan: Plan, found: Sequence[Outcome], standings: Sequence[Standing]) -> None:
    """Write the three tables; the same bytes for the same runs.

    Raises:
        StorageError: they cannot be written.
    """
    write_csv(plan.out / DRIVERS_FILE, DRIVERS_HEAD, map(_of_standing, standings))
    write_csv(plan.out / OUTCOMES_FILE, OUTCOMES_HEAD, map(_of_outcome, found))
    write_csv(
        plan.out / MODES_FILE, MODES_HEAD, (line for outcome in found for line in _modes(outcome))
    )


def _of_standing(standing: Standing) -> Sequence[object]:
    causes = "; ".join(f"{name} {count}" for name, count in standing.causes)
    shares = (standing.avoided.get(name, float("nan")) for name in CAREFUL)
    return (
        standing.driver,
        standing.column,
        standing.driven,
        standing.not_applicable,
        standing.failed,
        standing.modes,
        standing.robust,
        standing.first,
        standing.severity,
        standing.failures,
        standing.evaluations,
        standing.failed_rows,
        causes,
        *shares,
    )


def _of_outcome(outcome: Outcome) -> Sequence[object]:
    head = (
        outcome.driver,
        outcome.scenario,
        outcome.column,
        outcome.state,
        outcome.why or outcome.unjudged,
    )
    if outcome.state != "driven":
        return (*head, *[""] * (len(OUTCOMES_HEAD) - len(head)))
    shares = [
        (outcome.avoided or {}).get(name, 0) / outcome.judged if outcome.judged else ""
        for name in CAREFUL
    ]
    return (
        *head,
        outcome.runs,
        outcome.evaluations,
        outcome.failed_rows,
        outcome.failures,
        outcome.preventable,
        first(outcome),
        outcome.severity,
        len(outcome.ways),
        outcome.robust,
        *shares,
    )


def first(outcome: Outcome) -> float:
    """Return the median of the evaluations until the first failure; +inf where most have none."""
    return quartiles(np.array(outcome.first, dtype=np.float64)).median


def _modes(outcome: Outcome) -> Iterable[Sequence[object]]:
    for way in outcome.ways:
        robust = "" if way.robust is None else "yes" if way.robust else "no"
        yield (
            outcome.driver,
            outcome.scenario,
            outcome.column,
            way.title,
            robust,
            way.harm,
            way.severity,
            "; ".join(way.causes),
            way.minimal,
            way.scenario,
            way.minimal_scenario,
            way.script,
            way.playback,
        )
