"""A run on disk: what every command and notebook that reads one starts from."""

from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from bridgegen.assess.conflict.happening import Happening
from bridgegen.assess.criteria import CriterionSummary, summarise_criteria
from bridgegen.base.errors import StorageError
from bridgegen.jobs.search.exported import (
    FOLDER,
    MINIMAL,
    Exported,
    Refused,
    exported_scenarios,
    not_exported,
)
from bridgegen.jobs.search.settings import Settings
from bridgegen.results.store import Recorded, Rows, Store
from bridgegen.results.store.summary import Summary, summarise
from bridgegen.scenario.language.criteria import read_criterion
from bridgegen.search.screened import Agreement
from bridgegen.search.triage.fresh import FRESH
from bridgegen.search.triage.record import JSON_FILE, NOT_JUDGED, Mode, Triage, Verdict, read_record
from bridgegen.simulation.rollout import STATUS_MESSAGES

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

REPORT = "report.html"


def load(name_or_path: str | Path) -> Any:
    """Load a scenario; or a run, as `Run` does.

    Args:
        name_or_path: a name of the catalogue or of a pack ("r157/cut-in"), the path of a scenario's
            file (.yaml, .xosc), or the folder of a run.

    Raises:
        UnknownNameError: no such name in the catalogue or the packs.
        InputError: the file or folder is missing, or breaks rules; all of them, with their lines.
    """
    from bridgegen.jobs.search.scenarios import load as load_scenario

    return Run(name_or_path) if Path(name_or_path).is_dir() else load_scenario(name_or_path)


class Run:
    """A finished or interrupted run: its folder, its results, its files.

    Attributes:
        folder: of the run.
        settings: with which it was made.
        finished: whether it has ended.
        metrics: names of the metrics that it records.
        parameters: names of its parameters, the columns of X.
        version: of BridgeGen that made it.
        notes: of the algorithm, by title; empty where it takes none. nsga2-dt: its trees' critical
            boxes.
        screened: how far its screen agrees with its simulator; None without a screen, or before the
            search has ended.
    """

    def __init__(self, folder: Path | str) -> None:
        """Open a run's folder.

        Raises:
            StorageError: not a run, or damaged.
        """
        with Store.open(folder) as store:
            self._take(store)

    @classmethod
    def of(cls, store: Store, rows: Rows | Recorded | None = None) -> Self:
        """Return the run of a store that is open.

        Args:
            store: of the run.
            rows: all of its evaluations, where they have been read: the summary is of these.
        """
        # __init__ would open the store a second time.
        self = cls.__new__(cls)
        self._take(store)
        if rows is not None:
            self.summary, self.failures = _summary(store, rows), _failures(store, rows)
            self.happening = _happening(store, rows)
        return self

    def _take(self, store: Store) -> None:
        self.folder = store.folder
        self.settings = Settings.from_dict(store.settings, store.folder)
        self.finished = store.finished is not None
        self.metrics, self.version, self.notes = store.metrics, store.version, store.notes
        self.parameters = store.parameters
        try:
            self.screened = Agreement.from_notes(store.notes)
        except ValueError as error:
            raise StorageError(f"{store.folder}: {error}") from None

    @cached_property
    def summary(self) -> Summary:
        """The key figures."""
        with Store.open(self.folder) as store:
            return _summary(store, Recorded(store, whole=("d_min", "v_d")))

    @cached_property
    def happening(self) -> Happening:
        """What happened: which events began, who came near the ego, whether the ego got along.

        Raises:
            StorageError: the database is damaged.
        """
        with Store.open(self.folder) as store:
            return _happening(store, Recorded(store))

    @cached_property
    def failures(self) -> Counter[str]:
        """The number of failed evaluations for each reason, the most frequent first."""
        with Store.open(self.folder) as store:
            return _failures(store, Recorded(store))

    def rows(self) -> Rows:
        """Return every evaluation, in the order of recording."""
        with Store.open(self.folder) as store:
            return store.read()

    def frame(self) -> "pd.DataFrame":
        """Return every evaluation as a row: parameters, metrics, objectives, status, critical.

        Raises:
            InputError: pandas is not installed.
        """
        with Store.open(self.folder) as store:
            return store.frame()

    def exported(self, evaluations: int | None = None) -> tuple[Exported, ...]:
        """Return the exported scenarios; see `exported_scenarios`."""
        return exported_scenarios(self.folder, evaluations)

    @property
    def scenarios(self) -> tuple[Path, ...]:
        """The OpenSCENARIO files of the exported scenarios, the most critical first."""
        return tuple(sorted((self.folder / FOLDER).glob("[0-9]*.xosc")))

    @property
    def minimal_scenarios(self) -> tuple[Path, ...]:
        """The OpenSCENARIO files of minimal scenarios, in the order of the failure modes."""
        return tuple(sorted((self.folder / FOLDER).glob(f"{MINIMAL}*.xosc")))

    @property
    def fresh_scenarios(self) -> tuple[Path, ...]:
        """Those of failures that only the fresh random draws have, the worst first."""
        return tuple(sorted((self.folder / FOLDER).glob(f"{FRESH}*.xosc")))

    @cached_property
    def triage(self) -> Triage | None:
        """Its failure modes and the bound on the space; None before the run has finished.

        Raises:
            FileFormatError: its record is damaged, or another run's.
        """
        path = self.folder / JSON_FILE
        if not path.is_file():
            return None
        with Store.open(self.folder) as store:
            return read_record(path, Recorded(store).digest())

    @cached_property
    def criteria(self) -> tuple[CriterionSummary, ...]:
        """How its evaluations meet its pass criteria, in their order."""
        with Store.open(self.folder) as store:
            return judged(store, self.settings)

    @property
    def verdict(self) -> Verdict:
        """Whether its driver "fails", "no failure" was "found", or the run was "not judged".

        It fails by harm, or by a pass criterion. It is not judged before it has ended.
        """
        # Pass criteria come first: one that is violated is so whether or not harm could be judged.
        if any(criterion.violated for criterion in self.criteria):
            return "fails"
        if self.triage is None or not self.triage.bound.judged:
            return NOT_JUDGED
        return "fails" if self.triage.bound.failures else "no failure found"

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The failure modes, robust ones first; see ``triage``."""
        return self.triage.modes if self.triage is not None else ()

    @property
    def not_exported(self) -> tuple[Refused, ...]:
        """The critical scenarios whose export was refused, and why, the most critical first."""
        return not_exported(self.folder)

    @property
    def report(self) -> Path:
        """The report page; written when the run finishes."""
        return self.folder / REPORT

    def plot(self) -> "Figure":
        """Return a figure: critical scenarios in parameter space, and the worst one over time.

        The space is drawn over the first two parameters that the worst failure mode's simplest
        scenario needs; else over those in which critical scenarios differ most from the others.
        The worst exported scenario is simulated again for its speed and distance, unless that
        would import a driver of your own, or needs another simulator.
        """
        from bridgegen.jobs.search.notebook import draw

        return draw(self)

    def _repr_html_(self) -> str:
        """Return what a notebook shows: figures, failure modes, the worst scenario's playback."""
        from bridgegen.jobs.search.notebook import run_html

        return run_html(self)

    def __repr__(self) -> str:
        s = self.summary
        return f"Run({str(self.folder)!r}: {s.critical} critical of {s.evaluations} evaluations)"


def judged(store: Store, settings: Settings) -> tuple[CriterionSummary, ...]:
    """Return how a run's evaluations meet its pass criteria; only their margins are read.

    Raises:
        StorageError: the database is damaged.
    """
    criteria = [read_criterion(criterion) for criterion in settings.criteria]
    if not criteria:
        return ()
    of, n = dict(zip(store.metrics, store.columns.metrics, strict=True)), len(store)
    names = [criterion.quantity for criterion in criteria]
    if missing := sorted({*names} - of.keys()):
        # The settings and the columns of a damaged store need not fit each other.
        raise StorageError(f"{store.folder}: the margins of {', '.join(missing)} are not recorded")
    margins, at = np.empty((n, len(names))), 0
    for found in store.select([of[name] for name in names], 0, n):
        with store.damage():
            margins[at : at + len(found)] = np.array(found, dtype=np.float64)
        at += len(found)
    return summarise_criteria(criteria, margins, names)


def _summary(store: Store, rows: Rows | Recorded) -> Summary:
    metric = store.metrics.index
    return summarise(
        rows.critical,
        rows.status == 0,
        rows.metrics[:, metric("d_min")],
        rows.metrics[:, metric("v_d")],
        rows.cause,
        store.seconds,
    )


def _happening(store: Store, rows: Rows | Recorded) -> Happening:
    with store.damage():
        return Happening.of(rows.findings.happened, store.domain)


def _failures(store: Store, rows: Rows | Recorded) -> Counter[str]:
    messages: Mapping[int, str] = store.failures()
    failed = np.flatnonzero(rows.status)
    reasons = Counter(
        ": ".join(
            [STATUS_MESSAGES.get(status, f"status {status}"), *filter(None, [messages.get(i)])]
        )
        for i, status in zip(failed.tolist(), rows.status[failed].tolist(), strict=True)
    )
    return Counter(dict(reasons.most_common()))
