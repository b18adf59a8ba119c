"""A run's folder → a result."""

from collections.abc import Iterator
from math import isfinite
from pathlib import Path

import numpy as np

from bridgegen.assess.criteria import CriterionSummary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import StorageError
from bridgegen.drivers.drivers import join
from bridgegen.jobs.dashboard.names import Driver, driver_of, scenario_name
from bridgegen.jobs.dashboard.results import Failure, Judged, ModeKey, Result, Seen
from bridgegen.jobs.dashboard.sceneries import Sceneries
from bridgegen.jobs.search.run import REPORT
from bridgegen.jobs.search.settings import Settings
from bridgegen.jobs.view.overview import RunLine, read_line
from bridgegen.results.store import Store
from bridgegen.search.triage.record import Mode


def read_run(project: Path, folder: Path, sceneries: Sceneries) -> Result:
    """Return the result of a run.

    Raises:
        StorageError: it cannot be read.
    """
    seen: list[Seen | None] = []
    line = read_line(
        project, folder, lambda store, settings: seen.append(_seen(store, settings, sceneries))
    )
    settings = line.settings
    if settings is None:
        raise StorageError(line.problem)
    distribution = str(settings.distribution or "")
    scenario = scenario_name(settings.scenario, project, distribution)
    driver = driver_of(settings.ego, project, line.version)
    if settings.ideal:
        stages = f" (ideal {join(settings.ideal)})"
        driver = Driver(driver.name + stages, driver.version, driver.label + stages)
    bound = line.triage.bound if line.triage else None
    judged = tuple(map(_judged, line.criteria))
    other = settings.worse_than
    return Result(
        "run" if other is None else "difference",
        line.path,
        f"{line.path}/{REPORT}" if (folder / REPORT).is_file() else "",
        line.changed,
        scenario,
        driver,
        line.evaluations,
        bound.harmful if bound else 0,
        bound.failed if bound else 0,
        line.finished,
        bound.space if bound and other is None else None,
        (*_failures(line, scenario, driver), *violations(judged, scenario, driver.name)),
        judged,
        seen[0],
        worse_than="" if other is None else driver_of(other, project, line.version).label,
        unjudged=bound is not None and not bound.judged,
    )


def violations(judged: tuple[Judged, ...], scenario: str, driver: str) -> Iterator[Failure]:
    """Yield each violated requirement as a failure mode."""
    for one in judged:
        if one.violated:
            key = ModeKey(scenario, driver, requirement=one.criterion.id)
            words = one.criterion.text or one.criterion.states
            yield Failure(key, f"violates {one.criterion.id}: {words}", one.violated)


def _failures(line: RunLine, scenario: str, driver: Driver) -> Iterator[Failure]:
    """Yield the failure modes of a run; those that differ in cause or cluster alone are one."""
    held: dict[ModeKey, list[Mode]] = {}
    for one in line.modes:
        key = ModeKey(
            scenario, driver.name, one.conflict, one.conflict_type, one.responsible,
            one.partner, one.place,
        )  # fmt: skip
        held.setdefault(key, []).append(one)
    for key, modes in held.items():
        yield Failure(
            key,
            modes[0].title,
            sum(one.count for one in modes),
            max(one.severity for one in modes),
            all(one.knife_edge for one in modes),
        )


def _judged(one: CriterionSummary) -> Judged:
    worst = one.worst if isfinite(one.worst) else None
    return Judged(one.criterion, one.met, one.violated, one.unknown, worst, one.unit)


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
    )
    scenery = sceneries.of(source, settings.fingerprint)
    if scenery is None:
        return None
    found = Seen()
    stored = dict(zip(store.parameters, store.columns.X, strict=True))
    column = {name: stored[name] for name in sorted(scenery.columns & stored.keys())}
    for rows in store.select(["status", *column.values()], 0, len(store)):
        with store.damage():
            table: Float = np.array(rows, dtype=np.float64)
        table = table[table[:, 0] == 0.0]
        columns = {name: table[:, k] for k, name in enumerate(column, 1)}
        found.add(scenery.seen(columns, len(table)))
    return found
