"""Folders of a project become results: runs, suites, and those that test no driver for failures."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from bridgegen.assess.criteria import CriterionSummary, unit_of
from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, StorageError
from bridgegen.base.records import parse_json, read_bytes, read_model
from bridgegen.drivers.drivers import join
from bridgegen.drivers.identity import Identity
from bridgegen.jobs.compare.plan import FILE as COMPARISON_FILE
from bridgegen.jobs.compare.result import PAGE as COMPARISON_PAGE
from bridgegen.jobs.dashboard.of_odd import ProjectOdd
from bridgegen.jobs.dashboard.results import (
    Driver,
    Failure,
    Judged,
    ModeKey,
    Result,
    Seen,
    as_one,
    driver_of,
    scenario_name,
)
from bridgegen.jobs.dashboard.scenery import Sceneries, Scenery
from bridgegen.jobs.preventability.result import PAGE as MAP_PAGE
from bridgegen.jobs.preventability.result import SETTINGS as MAP_FILE
from bridgegen.jobs.preventability.result import SUMMARY
from bridgegen.jobs.search.run import REPORT
from bridgegen.jobs.search.settings import Settings
from bridgegen.jobs.suite.difference import Difference, difference
from bridgegen.jobs.suite.entries import RESULTS
from bridgegen.jobs.suite.failing import searched_scenario
from bridgegen.jobs.suite.page import FILE as PAGE
from bridgegen.jobs.suite.results import EntryResult, RowResult
from bridgegen.jobs.suite.suite import SuiteRun, read_suite
from bridgegen.jobs.view.overview import RunLine, find_folders, is_run, read_line
from bridgegen.results.store import Store
from bridgegen.scenario.language.criteria import read_criterion
from bridgegen.search.triage.modes import Key, title
from bridgegen.search.triage.record import Mode
from bridgegen.search.triage.words import covered

# --- A run's folder → a result ---


def read_run(project: Path, folder: Path, sceneries: Sceneries, odd: ProjectOdd) -> Result:
    """Return the result of a run.

    Raises:
        StorageError: it cannot be read.
    """
    seen: list[Seen | None] = []

    def read(store: Store, settings: Settings) -> None:
        seen.append(_seen(store, settings, sceneries))
        odd.add_run(store.folder, settings)

    line = read_line(project, folder, read)
    settings = line.settings
    if settings is None:
        raise StorageError(line.problem)
    distribution = str(settings.distribution or "")
    scenario = scenario_name(settings.scenario, project, distribution)
    driver = driver_of(
        settings.ego, project, line.version, settings.driver_digest, settings.driver_name or ""
    )
    if settings.ideal:
        stages = f" (ideal {join(settings.ideal)})"
        own = driver.identity
        if own.content:
            own = Identity(own.name + stages, own.content + stages)
        driver = Driver(driver.name + stages, driver.version, driver.label + stages, own)
    bound = line.triage.bound if line.triage else None
    judged = tuple(map(_judged, line.criteria))
    other = settings.worse_than
    failures = (*_failures(line, scenario, driver), *violations(judged, scenario, driver.name))
    searched = ""
    if line.triage is not None:
        searched = searched_scenario(line.triage.scenario, settings.road_map)
    return Result(
        "run" if other is None else "difference",
        line.path,
        f"{line.path}/{REPORT}" if (folder / REPORT).is_file() else "",
        line.changed,
        scenario,
        driver,
        line.evaluations,
        bound.failures if bound else 0,
        bound.failed if bound else 0,
        line.finished,
        bound.space if bound and other is None else None,
        tuple(replace(failure, searched=searched) for failure in failures),
        judged,
        seen[0],
        worse_than="" if other is None else driver_of(other, project, line.version).label,
        unjudged=bound is not None and not bound.judged,
        covered=covered(line.triage),
    )


def violations(judged: tuple[Judged, ...], scenario: str, driver: str) -> Iterator[Failure]:
    """Yield each violated requirement as a failure mode."""
    for item in judged:
        if item.violated:
            key = ModeKey(scenario, driver, requirement=item.criterion.id)
            words = item.criterion.text or item.criterion.states
            yield Failure(key, f"violates {item.criterion.id}: {words}", item.violated)


def key_of(mode: Mode, scenario: str, driver: Driver) -> ModeKey:
    """Return what a failure mode of a run has in common with the same one of other results."""
    return ModeKey(
        scenario,
        driver.name,
        mode.conflict,
        mode.conflict_type,
        mode.responsible,
        mode.partner,
        mode.place,
    )


def _failures(line: RunLine, scenario: str, driver: Driver) -> Iterator[Failure]:
    """Yield the failure modes of a run; those that differ in cause or cluster alone are one."""
    held: dict[ModeKey, list[Mode]] = {}
    for mode in line.modes:
        held.setdefault(key_of(mode, scenario, driver), []).append(mode)
    for key, modes in held.items():
        yield Failure(
            key,
            modes[0].title,
            sum(mode.count for mode in modes),
            max(mode.severity for mode in modes),
            all(mode.knife_edge for mode in modes),
        )


def _judged(criterion_summary: CriterionSummary) -> Judged:
    worst = criterion_summary.worst if isfinite(criterion_summary.worst) else None
    return Judged(
        criterion_summary.criterion,
        criterion_summary.met,
        criterion_summary.violated,
        criterion_summary.unknown,
        worst,
        criterion_summary.unit,
    )


def _seen(store: Store, settings: Settings, sceneries: Sceneries) -> Seen | None:
    """Count a run's evaluations, a chunk at a time; None where its scenario cannot be read.

    Raises:
        StorageError: the database is damaged.
    """
    source = (
        settings.scenario,
        str(settings.distribution or ""),
        settings.empty_trigger or "",
        settings.road_map is not None,
        "" if settings.odd is None else json.dumps(settings.odd),
    )
    scenery = sceneries.of(source, settings.fingerprint)
    if scenery is None:
        return None
    found = Seen()
    stored = dict(zip(store.parameters, store.columns.X, strict=True))
    column = {name: stored[name] for name in sorted(scenery.columns & stored.keys())}
    for rows in store.select(["status", *column.values()], 0, len(store)):
        # A text where a number belongs shows only here: a database column takes any type.
        with store.damage():
            table: Float = np.array(rows, dtype=np.float64)
        table = table[table[:, 0] == 0.0]
        columns = {name: table[:, k] for k, name in enumerate(column, 1)}
        found.add(scenery.seen(columns, len(table)))
    return found


# --- A suite's folder → a result for each of its entries and egos ---


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
        files: the scenario files that it runs without distributions, by what results call them.
    """

    source: str
    page: str
    time: float
    egos: tuple[str, ...]
    results: tuple[Result, ...]
    difference: Difference | None
    lost: tuple[tuple[str, str], ...]
    files: Mapping[str, Path] = field(default_factory=dict)


def read_suite_line(
    project: Path, folder: Path, sceneries: Sceneries, odd: ProjectOdd
) -> SuiteLine:
    """Return a suite.

    Raises:
        StorageError: it cannot be read.
    """
    suite = read_suite(folder)
    source, time = folder.relative_to(project).as_posix(), (folder / RESULTS).stat().st_mtime
    page = f"{source}/{PAGE}" if (folder / PAGE).is_file() else ""
    made, called = (str(suite.settings.get(key) or "") for key in ("version", "driver_name"))
    results = tuple(  # the file has them as they ended
        _result(project, source, page, time, made, called, result, sceneries)
        for result in sorted(suite.results, key=lambda result: (result.entry, result.ego))
    )
    for result in suite.results:
        files = {name: getattr(result, name) for name in ("scenario", "distribution")}
        here = {name: str(_path(project, text)) if text else "" for name, text in files.items()}
        odd.add_entry(suite, result.model_copy(update=here))
    egos = tuple(dict.fromkeys(result.driver.label for result in results))
    lost = tuple(
        (f"{result.entry} ({result.ego})" if result.ego else result.entry, result.problem)
        for result in suite.results
        if result.problem
    )
    files = {
        scenario_name(result.scenario, project): path.resolve()
        for result in suite.results
        if result.scenario.lower().endswith(".xosc")
        and not result.distribution
        and (path := _path(project, result.scenario)).is_file()
    }
    return SuiteLine(
        source, page, time, egos, results, _difference(project, suite, made), lost, files
    )


def _difference(project: Path, suite: SuiteRun, made: str) -> Difference | None:
    """Compare two egos, in the order of names: results do not say which was given first."""
    if len(suite.egos) != 2:
        return None
    egos = sorted(suite.egos)
    labels = [driver_of(ego or "the scenarios' own", project, made).label for ego in egos]
    first, second = (
        {result.entry: result for result in suite.of_ego(ego)} for ego in egos
    )  # a suite that was stopped lacks some
    both = sorted(name for name in first if name in second)
    return difference(
        [first[name] for name in both],
        [second[name] for name in both],
        (labels[0], labels[1]),
    )


def _result(
    project: Path,
    source: str,
    page: str,
    time: float,
    made: str,
    called: str,
    entry_result: EntryResult,
    sceneries: Sceneries,
) -> Result:
    scenario = scenario_name(entry_result.scenario, project, entry_result.distribution)
    driver = driver_of(
        entry_result.ego or entry_result.driver or "the scenario's own",
        project,
        made,
        entry_result.driver_digest,
        called,
    )
    judged = tuple(_judged_entry(entry_result))
    return Result(
        "suite",
        source,
        page,
        time,
        scenario,
        driver,
        len(entry_result.rows),
        entry_result.count("failed"),
        entry_result.count("not run"),
        finished=not entry_result.problem,
        failures=(
            *_failures_of_entry(entry_result, scenario, driver.name),
            *violations(judged, scenario, driver.name),
        ),
        judged=judged,
        unjudged=entry_result.verdict in ("not judged", "flaky"),
        seen=_seen_in_entry(entry_result, _scenery(project, entry_result, sceneries)),
        entry=entry_result.entry,
        ego=entry_result.ego or entry_result.driver,
    )


def _judged_entry(entry_result: EntryResult) -> Iterator[Judged]:
    for i, given in enumerate(entry_result.criteria):
        criterion = read_criterion(given)
        margins = [
            row.margins[i]
            for row, verdict in zip(entry_result.rows, entry_result.verdicts, strict=True)
            if i < len(row.margins) and verdict not in ("not judged", "flaky")
        ]
        violated = sum(margin < 0.0 for margin in margins)
        yield Judged(
            criterion,
            len(margins) - violated,
            violated,
            len(entry_result.rows) - len(margins),
            min(margins, default=None),
            unit_of(criterion),
        )


def _failures_of_entry(entry_result: EntryResult, scenario: str, driver: str) -> Iterator[Failure]:
    """Yield the critical variations, grouped by what happens."""
    held: dict[ModeKey, list[RowResult]] = {}
    for row in entry_result.rows:
        if row.critical:
            key = ModeKey(
                scenario,
                driver,
                row.conflict,
                row.conflict_type,
                row.responsible,
                partner=row.partner,
            )
            held.setdefault(key, []).append(row)
    for key, rows in held.items():
        severity = max(row.severity for row in rows)
        yield Failure(key, _title(rows[0]), len(rows), severity)


def _title(row: RowResult) -> str:
    if row.conflict in _NO_CONFLICT:
        return "is critical without a conflict"
    key = Key(row.conflict, row.conflict_type, row.responsible, "", "")
    return title(key).replace("another participant", f"'{row.partner}'")


def _scenery(project: Path, entry_result: EntryResult, sceneries: Sceneries) -> Scenery | None:
    """Return the scenery of an entry."""
    scenario = str(_path(project, entry_result.scenario))
    distribution = (
        str(_path(project, entry_result.distribution)) if entry_result.distribution else ""
    )
    return sceneries.of((scenario, distribution, "", False, ""))


def _path(project: Path, text: str) -> Path:
    """Return the path of a file, which may be relative to the project's folder or its parent."""
    tried = (base / text for base in (project, project.parent))
    return next((path for path in tried if path.is_file()), Path(text))


def _seen_in_entry(entry_result: EntryResult, scenery: Scenery | None) -> Seen | None:
    """Count an entry's variations."""
    if scenery is None or entry_result.problem:
        return None
    rows = [
        row
        for row in entry_result.rows
        if not row.problem and len(row.x) == len(entry_result.parameters)
    ]
    columns: dict[str, Float] = {}
    for k, name in enumerate(entry_result.parameters):
        values = [row.x[k] for row in rows]
        if name in scenery.edges:
            columns[name] = np.array([scenery.inner(name, value) for value in values])
        elif not any(isinstance(value, str) for value in values):
            columns[name] = np.array(values, dtype=np.float64)
    return scenery.seen(columns, len(rows))


def with_drivers_as_one(
    runs: Sequence[Result], suites: Sequence[SuiteLine]
) -> tuple[tuple[Result, ...], tuple[SuiteLine, ...]]:
    """Return results in which each driver has one name, by whatever path it was named."""
    found = as_one([*runs, *(result for suite in suites for result in suite.results)])

    def renamed(result: Result) -> Result:
        driver = found.get(result.driver, result.driver)
        failures = tuple(
            replace(each, key=replace(each.key, driver=driver.name)) for each in result.failures
        )
        return replace(result, driver=driver, failures=failures)

    lines = []
    for suite in suites:
        results = tuple(map(renamed, suite.results))
        egos = tuple(dict.fromkeys(result.driver.label for result in results))
        pairs = zip(suite.results, results, strict=True)
        label = {before.driver.label: after.driver.label for before, after in pairs}
        change = suite.difference
        if change is not None:
            first, second = (label.get(name, name) for name in (change.first, change.second))
            change = replace(change, first=first, second=second)
        lines.append(replace(suite, egos=egos, results=results, difference=change))
    return tuple(map(renamed, runs)), tuple(lines)


# --- Folders that test no driver: preventability maps, comparisons ---


Count = Annotated[int, Field(ge=0, le=10**12)]
Text = Annotated[str, Field(max_length=4096)]


class MapFigures(BaseModel):
    """A driver's numbers of cells, as ``summary.json`` states them."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    driver: Text
    avoided: Count
    preventable: Count
    unpreventable: Count
    not_applicable: Count
    no_result: Count

    @property
    def judged(self) -> int:
        """The number of cells that apply and have a result."""
        return self.avoided + self.preventable + self.unpreventable


class _Summary(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    scenario: Text
    cells: Count
    drivers: Annotated[tuple[MapFigures, ...], Field(max_length=1000)]


@dataclass(frozen=True)
class MapLine:
    """A preventability map in a line.

    Attributes:
        source: folder, as seen from the project's.
        page: of the map, or "".
        scenario: its name; "" of a map that is not finished.
        cells: number of them.
        drivers: the figures of each.
    """

    source: str
    page: str
    scenario: str = ""
    cells: int = 0
    drivers: tuple[MapFigures, ...] = ()


@dataclass(frozen=True)
class ComparisonLine:
    """A comparison of algorithms in a line.

    Attributes:
        source: folder, as seen from the project's.
        page: of the comparison, or "".
        scenarios: their names.
        algorithms: their names.
        runs: number of its runs.
    """

    source: str
    page: str
    scenarios: tuple[str, ...]
    algorithms: tuple[str, ...]
    runs: int


def read_map(project: Path, folder: Path) -> MapLine:
    """Return a map.

    Raises:
        FileFormatError: its figures are damaged.
        StorageError: they cannot be read.
    """
    source = folder.relative_to(project).as_posix()
    summary = read_model(folder / SUMMARY, _Summary, _no_map)
    page = f"{source}/{MAP_PAGE}" if (folder / MAP_PAGE).is_file() else ""
    if summary is None:
        _object(folder / MAP_FILE)
        return MapLine(source, page)
    return MapLine(source, page, summary.scenario, summary.cells, summary.drivers)


def read_comparison(project: Path, folder: Path) -> ComparisonLine:
    """Return a comparison.

    Raises:
        FileFormatError: its record is damaged.
        StorageError: it cannot be read.
    """
    source, record = folder.relative_to(project).as_posix(), _object(folder / COMPARISON_FILE)
    page = f"{source}/{COMPARISON_PAGE}" if (folder / COMPARISON_PAGE).is_file() else ""
    return ComparisonLine(
        source,
        page,
        _behind("scenario ", record),
        _behind("settings of ", record),
        len(find_folders(folder, is_run)),
    )


def _behind(prefix: str, record: dict[str, Any]) -> tuple[str, ...]:
    return tuple(key.removeprefix(prefix) for key in record if key.startswith(prefix))


def _object(path: Path) -> dict[str, Any]:
    try:
        value = parse_json(read_bytes(path))
    except OSError as error:
        raise StorageError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise FileFormatError(f"{path}: is damaged: {error}") from None
    if not isinstance(value, dict):
        raise FileFormatError(f"{path}: is damaged: it must hold an object")
    return value


def _no_map(path: Path, why: str) -> FileFormatError:
    return FileFormatError(f"{path}: is damaged: {why}")
