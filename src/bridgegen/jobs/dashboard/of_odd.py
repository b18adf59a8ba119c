"""The project's operational design domain, and what its runs and suites have of it."""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import BridgeGenError
from bridgegen.jobs.search.scenarios import driven_by, load, within
from bridgegen.jobs.search.settings import Settings
from bridgegen.jobs.suite.evaluate import run_of, scenario_of
from bridgegen.jobs.suite.replay import job_of
from bridgegen.jobs.suite.results import EntryResult
from bridgegen.jobs.suite.suite import SuiteRun
from bridgegen.results.store import Store
from bridgegen.scenario.odd.bounding import Fit, fit_of
from bridgegen.scenario.odd.coverage import OddCoverage, odd_coverage
from bridgegen.scenario.odd.reader import Odd, odd_of


@dataclass
class ProjectOdd:
    """What a project has of its ODD: of the one given, else of that of the first result with one.

    Attributes:
        coverage: of the ODD; None while there is none.
        runs: how many are counted.
        entries: of suites, likewise.
        outside: their evaluations outside.
        unread: runs and entries whose scenario cannot be read, or states nothing of an ODD.
        others: names of other ODDs that bound results.
    """

    coverage: OddCoverage | None = None
    runs: int = 0
    entries: int = 0
    outside: int = 0
    unread: int = 0
    others: set[str] = field(default_factory=set)
    _known: dict[str, tuple[Fit, Float | None] | None] = field(default_factory=dict)
    _waiting: list[Callable[[Odd], None]] = field(default_factory=list)

    @classmethod
    def of(cls, odd: Odd | None) -> "ProjectOdd":
        """Return an ODD of which nothing is counted yet."""
        return cls(None if odd is None else odd_coverage(odd))

    def add_run(self, folder: Path, settings: Settings) -> None:
        """Count the evaluations of a run; without an ODD, nothing.

        Raises:
            StorageError, FileFormatError: the run is damaged.
        """
        self._add(settings.odd, partial(self._count_run, folder, settings))

    def add_entry(self, suite: SuiteRun, result: EntryResult) -> None:
        """Count the variations of a suite's entry, as it is found; without an ODD, nothing.

        Raises:
            FileFormatError: the suite's ODD is damaged.
        """
        if not result.problem:
            self._add(suite.settings.get("odd"), partial(self._count_entry, suite, result))

    def _add(self, record: Mapping[str, Any] | None, count: Callable[[Odd], None]) -> None:
        own = None if record is None else odd_of(record)
        if own is not None and self.coverage is None:
            self.coverage = odd_coverage(own)
        self._waiting.append(count)
        if self.coverage is not None:
            if own is not None and own.digest != self.coverage.odd.digest:
                self.others.add(own.name)
            waiting, self._waiting = self._waiting, []
            for each in waiting:
                each(self.coverage.odd)

    def _count_run(self, folder: Path, settings: Settings, odd: Odd) -> None:
        with Store.open(folder) as store:
            rows = store.read()
        if not len(rows.status):
            return
        given = (settings.scenario, settings.others, settings.road_map, settings.fingerprint)
        if found := self._fit(json.dumps(given), lambda: _of_run(settings, odd)):
            self.runs += 1
            self._count(found[0], store.parameters, rows.X, rows.status == 0, rows.critical)

    def _count_entry(self, suite: SuiteRun, result: EntryResult, odd: Odd) -> None:
        given = (suite.settings, result.scenario, result.distribution, result.digest)
        found = self._fit(json.dumps(given), lambda: _of_entry(suite, result, odd))
        if found and found[1] is not None:
            self.entries += 1
            ok = np.array([not row.problem for row in result.rows])
            critical = np.array([row.critical for row in result.rows])
            self._count(found[0], found[0].states.scenario.space().names, found[1], ok, critical)

    def _fit(self, key: str, read: Callable[[], tuple[Fit, Float | None] | None]) -> Any:
        """Return the ODD for a scenario; None where that has changed, or is a file's."""
        if key not in self._known:
            self._known[key] = None
            with suppress(BridgeGenError, OSError, ValueError):  # ValueError: NUL in a path
                self._known[key] = read()
        self.unread += self._known[key] is None
        return self._known[key]

    def _count(self, fit: Fit, names: Sequence[str], X: Float, ok: Bool, critical: Bool) -> None:
        assert self.coverage is not None
        columns: dict[str, Float] = dict(zip(names, X[ok].T, strict=True))
        inside: Bool = fit.inside(columns) if ok.any() else np.zeros(0, np.bool_)
        self.outside += int((~inside).sum())
        if inside.any():
            kept = {name: values[inside] for name, values in columns.items()}
            self.coverage.add(fit, kept, critical[ok][inside])


def _of_run(settings: Settings, odd: Odd) -> tuple[Fit, None] | None:
    read = load(settings.scenario, settings.distribution, settings.empty_trigger)
    scenario = driven_by(read, settings.others)
    bound = within(scenario, settings.odd, settings.road_map)
    if bound.fingerprint != settings.fingerprint:
        return None
    return fit_of(scenario, odd, on_map=settings.road_map is not None), None


def _of_entry(suite: SuiteRun, result: EntryResult, odd: Odd) -> tuple[Fit, Float] | None:
    """Return the ODD for a suite's entry, and the rows that the suite has run of it."""
    job = job_of(suite, result)
    scenario = scenario_of(replace(job, options=replace(job.options, odd=None)))
    if job.entry.digest != result.digest:
        return None
    bound = scenario_of(job)
    X = run_of(job, bound, bound.space()).X
    return (fit_of(scenario, odd), X) if len(X) == len(result.rows) else None
