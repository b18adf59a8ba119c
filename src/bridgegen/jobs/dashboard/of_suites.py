"""A suite's folder → a result for each of its entries and egos, and the difference of two egos."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.assess.criteria import unit_of
from bridgegen.base.arrays import Float
from bridgegen.jobs.dashboard.names import driver_of, scenario_name
from bridgegen.jobs.dashboard.of_runs import violations
from bridgegen.jobs.dashboard.results import Failure, Judged, ModeKey, Result, Seen
from bridgegen.jobs.dashboard.sceneries import Sceneries
from bridgegen.jobs.dashboard.scenery import Scenery
from bridgegen.jobs.suite.difference import Difference, difference
from bridgegen.jobs.suite.entries import RESULTS
from bridgegen.jobs.suite.page import FILE as PAGE
from bridgegen.jobs.suite.results import EntryResult, RowResult
from bridgegen.jobs.suite.suite import SuiteRun, read_suite
from bridgegen.scenario.language.criteria import read_criterion
from bridgegen.search.triage.modes import Key, title

_NO_CONFLICT = ("", "none")


@dataclass(frozen=True)
class SuiteLine:
    """A suite in a line.

    Attributes:
        source: folder, as seen from the project's.
        page: of the suite, or "".
        time: when its file was last written [s since 1970].
        egos: labels of its drivers.
        results: of each entry and ego.
        difference: of its two drivers; None where it has another number of them.
        lost: entries that did not run, with the reason.
    """

    source: str
    page: str
    time: float
    egos: tuple[str, ...]
    results: tuple[Result, ...]
    difference: Difference | None
    lost: tuple[tuple[str, str], ...]


def read_suite_line(project: Path, folder: Path, sceneries: Sceneries) -> SuiteLine:
    """Return a suite.

    Raises:
        StorageError: it cannot be read.
    """
    suite = read_suite(folder)
    source, time = folder.relative_to(project).as_posix(), (folder / RESULTS).stat().st_mtime
    page = f"{source}/{PAGE}" if (folder / PAGE).is_file() else ""
    made = str(suite.settings.get("version", ""))
    results = tuple(  # the file has them as they ended
        _result(project, source, page, time, made, one, sceneries)
        for one in sorted(suite.results, key=lambda one: (one.entry, one.ego))
    )
    egos = tuple(dict.fromkeys(one.driver.label for one in results))
    lost = tuple(
        (f"{one.entry} ({one.ego})" if one.ego else one.entry, one.problem)
        for one in suite.results
        if one.problem
    )
    return SuiteLine(source, page, time, egos, results, _difference(project, suite, made), lost)


def _difference(project: Path, suite: SuiteRun, made: str) -> Difference | None:
    """Compare two egos, in the order of names: results do not say which was given first."""
    if len(suite.egos) != 2:
        return None
    egos = sorted(suite.egos)
    labels = [driver_of(ego or "the scenarios' own", project, made).label for ego in egos]
    first, second = (
        {one.entry: one for one in suite.of_ego(ego)} for ego in egos
    )  # a suite that was stopped lacks some
    both = sorted(name for name in first if name in second)
    return difference(
        [first[name] for name in both], [second[name] for name in both],
        (labels[0], labels[1]),
    )  # fmt: skip


def _result(
    project: Path,
    source: str,
    page: str,
    time: float,
    made: str,
    one: EntryResult,
    sceneries: Sceneries,
) -> Result:
    scenario = scenario_name(one.scenario, project, one.distribution)
    driver = driver_of(one.ego or one.driver or "the scenario's own", project, made)
    judged = tuple(_judged(one))
    return Result(
        "suite",
        source,
        page,
        time,
        scenario,
        driver,
        len(one.rows),
        one.count("failed"),
        one.count("not run"),
        finished=not one.problem,
        failures=(
            *_failures(one, scenario, driver.name),
            *violations(judged, scenario, driver.name),
        ),
        judged=judged,
        unjudged=one.verdict == "not judged",
        seen=_seen(one, _scenery(project, one, sceneries)),
        entry=one.entry,
    )


def _judged(one: EntryResult) -> Iterator[Judged]:
    for i, given in enumerate(one.criteria):
        criterion = read_criterion(given)
        margins = [
            row.margins[i]
            for row, verdict in zip(one.rows, one.verdicts, strict=True)
            if i < len(row.margins) and verdict != "not judged"
        ]
        violated = sum(margin < 0.0 for margin in margins)
        yield Judged(
            criterion,
            len(margins) - violated,
            violated,
            len(one.rows) - len(margins),
            min(margins, default=None),
            unit_of(criterion),
        )


def _failures(one: EntryResult, scenario: str, driver: str) -> Iterator[Failure]:
    """Yield the critical variations, grouped by what happens."""
    held: dict[ModeKey, list[RowResult]] = {}
    for row in one.rows:
        if row.critical:
            key = ModeKey(
                scenario, driver, row.conflict, row.conflict_type, row.responsible,
                partner=row.partner,
            )  # fmt: skip
            held.setdefault(key, []).append(row)
    for key, rows in held.items():
        severity = max(row.severity for row in rows)
        yield Failure(key, _title(rows[0]), len(rows), severity)


def _title(row: RowResult) -> str:
    if row.conflict in _NO_CONFLICT:
        return "is critical without a conflict"
    key = Key(row.conflict, row.conflict_type, row.responsible, "", "")
    return title(key).replace("another participant", f"'{row.partner}'")


def _scenery(project: Path, one: EntryResult, sceneries: Sceneries) -> Scenery | None:
    """Return the scenery of an entry; its file may be relative to the project's folder."""
    paths = []
    for text in (one.scenario, one.distribution):
        path = next(
            (base / text for base in (project, project.parent) if text and (base / text).is_file()),
            None,
        )
        paths.append(str(path) if path else text)
    return sceneries.of((paths[0], paths[1], "", False))


def _seen(one: EntryResult, scenery: Scenery | None) -> Seen | None:
    """Count an entry's variations."""
    if scenery is None or one.problem:
        return None
    rows = [row for row in one.rows if not row.problem and len(row.x) == len(one.parameters)]
    columns: dict[str, Float] = {}
    for k, name in enumerate(one.parameters):
        values = [row.x[k] for row in rows]
        if name in scenery.edges:
            columns[name] = np.array([scenery.inner(name, value) for value in values])
        elif not any(isinstance(value, str) for value in values):
            columns[name] = np.array(values, dtype=np.float64)
    return scenery.seen(columns, len(rows))
