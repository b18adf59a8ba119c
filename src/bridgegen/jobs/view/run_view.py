"""A run as a site: its page, the news since, the motion of any scenario, its files."""

import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bridgegen.base.disk import read_inside
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.jobs.search.regions import OWL_FILE
from bridgegen.jobs.search.report import finding_page, further_files, run_data
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.jobs.search.run import Run
from bridgegen.pages.data import WHOLE
from bridgegen.pages.further import motion_payload
from bridgegen.pages.page import report_page
from bridgegen.pages.payload import news
from bridgegen.results.confirmation.record import Record, file_name, read_records
from bridgegen.results.store import Recorded, Store
from bridgegen.search.regions.record import JSON_FILE
from bridgegen.search.triage.record import JSON_FILE as TRIAGE_FILE
from bridgegen.simulation.choice import SIMULATORS, SimulatorChoice


class RunView:
    """A run, read only, that another process may be extending.

    May be called from several threads at a time.

    Args:
        folder: of the run.
        ego: where a driver of your own drives, that same driver.
        simulator: the run's, with where it is on this machine; the run's by default.

    Attributes:
        home: address of the page that leads here; "" where there is none.
        also: returns what its page holds besides, by key.

    Raises:
        StorageError: not a run, or its scenario or map is not what it was.
        InputError: the scenario or the map is missing, or the ego has to be named.
    """

    def __init__(
        self,
        folder: Path | str,
        *,
        ego: str | None = None,
        simulator: SimulatorChoice | None = None,
    ) -> None:
        self._run = Run(folder)
        self.folder, self.settings = self._run.folder, self._run.settings
        self.home = ""
        self.also: Callable[[], Mapping[str, Any]] = dict
        self._rows: Recorded | None = None
        self._pipeline = pipeline_of(self._run, "open", ego=ego, simulator=simulator)
        # The server's threads share the rows in memory, which each request may extend.
        self._lock = threading.Lock()

    def fragment(self, evaluation: int) -> str:
        """Return what the page's address ends with to show an evaluation, counted from 1.

        Raises:
            InputError: there is none, or it failed.
        """
        with self._lock, Store.open(self.folder) as store:
            rows = self._read(store)
            n, failed = len(rows), rows.status != 0
        if not 1 <= evaluation <= n:
            raise InputError(f"1 <= evaluation <= {n} must hold in {self.folder}, got {evaluation}")
        if failed[evaluation - 1]:
            raise InputError(f"{self.folder}: evaluation {evaluation} failed: it has no motion")
        return f"#evaluation-{evaluation}"

    def page(self) -> bytes:
        """Return the run's page, as it stands."""
        with self._lock, Store.open(self.folder) as store:
            rows = self._read(store)
            run = Run.of(store, rows)
            data = run_data(self._pipeline, run, rows, run.exported(len(rows)))
            return report_page(data, live=True, also=self.also(), home=self.home)

    def news(self, after: int) -> Mapping[str, Any]:
        """Return what is new since the page knew of so many evaluations."""
        with self._lock, Store.open(self.folder) as store:
            rows = self._read(store)
            state = {
                "finished": store.finished is not None,
                "kept": len(self._run.exported()) + len(self._run.fresh_scenarios),
                "elsewhere": sum(len(record.scenarios) for record in self._elsewhere(rows)),
            }
            if len(rows) == after:
                return state
            data = run_data(self._pipeline, Run.of(store, rows), rows, (), coverage=False)
            return {**state, **news(data, after)}

    def motion(self, evaluation: int) -> Mapping[str, Any] | None:
        """Return the motion of an evaluation; None if there is none, or if it failed."""
        with self._lock, Store.open(self.folder) as store:
            rows = self._read(store)
            if evaluation >= len(rows) or rows.status[evaluation] != 0:
                return None
            known = {exported.evaluation: exported for exported in self._run.exported()}
            return motion_payload(self._pipeline, rows, evaluation, known.get(evaluation))

    def finding(self, name: str) -> bytes | None:
        """Return the page of one exported scenario, to be sent; None if there is none."""
        with self._lock, Store.open(self.folder) as store:
            rows = self._read(store)
            try:
                return finding_page(self._pipeline, Run.of(store, rows), rows, name)
            except UnknownNameError:
                return None

    def file(self, name: str) -> bytes | None:
        """Return an exported file, or a record of a later command; None for any other name."""
        names = {name for exported in self._run.exported() for name in exported.files} | {
            JSON_FILE,
            OWL_FILE,
        }
        names |= {file_name(name) for name in SIMULATORS}
        names |= {TRIAGE_FILE, *further_files(self.folder)}
        try:
            # Only names that this run has written: a request is untrusted.
            return read_inside(self.folder, name) if name in names else None
        except FileNotFoundError:
            return None

    def _elsewhere(self, rows: Recorded) -> tuple[Record, ...]:
        return read_records(self.folder, rows.X, rows.metrics)

    def _read(self, store: Store) -> Recorded:
        """Return all rows, to be used while the store is open; only what is new is read."""
        names = (*WHOLE, *self._pipeline.monitor.names)
        self._rows = Recorded(store, self._rows, whole=names)
        return self._rows
