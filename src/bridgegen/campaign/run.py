"""A run on disk, as people and notebooks look at it."""

from collections import Counter
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.campaign.handover import FOLDER, MINIMAL, Refused, not_exported
from bridgegen.campaign.settings import Settings
from bridgegen.simulation.rollout import STATUS_MESSAGES
from bridgegen.store import Recorded, Store
from bridgegen.store.summary import summarise
from bridgegen.triage.record import JSON_FILE, Mode, Triage, read_record

if TYPE_CHECKING:
    import pandas as pd

REPORT = "report.html"


class Run:
    """A finished or interrupted run: its folder, its results, its files.

    Attributes:
        folder: of the run.
        settings: what it was made with.
        finished: whether it has ended.
        failures: why evaluations failed, and how many for each reason.
        summary: its figures.
        notes: what the algorithm learnt, by title; nothing where it takes no notes. nsga2-dt: its
            trees' critical boxes.
    """

    def __init__(self, folder: Path | str) -> None:
        """Open a run's folder.

        Raises:
            StorageError: not a run, or damaged.
        """
        self.folder = Path(folder)
        with Store.open(self.folder) as store:
            self.settings = Settings.from_dict(store.settings, self.folder)
            self.finished = store.finished is not None
            self.notes = store.notes
            rows = Recorded(store, whole=("d_min", "v_d"))
            self.failures = _in_words(rows, store.failures())
            self.summary = summarise(
                rows.critical,
                rows.status == 0,
                rows.metrics[:, store.metrics.index("d_min")],
                rows.metrics[:, store.metrics.index("v_d")],
                rows.cause,
                store.seconds,
            )

    def frame(self) -> "pd.DataFrame":
        """Return every evaluation as a row: parameters, metrics, objectives, status, critical."""
        with Store.open(self.folder) as store:
            return store.frame()

    @property
    def scenarios(self) -> tuple[Path, ...]:
        """The handed-over OpenSCENARIO files, the most critical first."""
        return tuple(sorted((self.folder / FOLDER).glob("[0-9]*.xosc")))

    @property
    def minimal_scenarios(self) -> tuple[Path, ...]:
        """The OpenSCENARIO files of minimal scenarios, in the order of the failure modes."""
        return tuple(sorted((self.folder / FOLDER).glob(f"{MINIMAL}*.xosc")))

    @cached_property
    def triage(self) -> Triage | None:
        """What is known of its failures and of the space; None before the run has finished.

        Raises:
            FileFormatError: its record is damaged, or another run's.
        """
        path = self.folder / JSON_FILE
        if not path.is_file():
            return None
        with Store.open(self.folder) as store:
            return read_record(path, Recorded(store).digest())

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The ways in which the driver comes to harm, robust ones first; see ``triage``."""
        return self.triage.modes if self.triage is not None else ()

    @property
    def not_exported(self) -> tuple[Refused, ...]:
        """The critical scenarios whose export was refused, and why, the most critical first."""
        return not_exported(self.folder)

    @property
    def report(self) -> Path:
        """The report page; written when the run finishes."""
        return self.folder / REPORT

    def __repr__(self) -> str:
        s = self.summary
        return f"Run({str(self.folder)!r}: {s.critical} critical of {s.evaluations} evaluations)"


def _in_words(rows: Recorded, said: Mapping[int, str]) -> Counter[str]:
    """Return why evaluations failed, the most frequent reason first."""
    failed = np.flatnonzero(rows.status)
    reasons = Counter(
        ": ".join([STATUS_MESSAGES.get(status, f"status {status}"), *filter(None, [said.get(i)])])
        for i, status in zip(failed.tolist(), rows.status[failed].tolist(), strict=True)
    )
    return Counter(dict(reasons.most_common()))
