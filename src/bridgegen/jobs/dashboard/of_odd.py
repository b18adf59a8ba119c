"""The project's operational design domain, and what its runs have of it."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import BridgeGenError
from bridgegen.jobs.search.scenarios import driven_by, load, within
from bridgegen.jobs.search.settings import Settings
from bridgegen.results.store import Store
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.odd.bounding import Fit, fit_of
from bridgegen.scenario.odd.coverage import OddCoverage, odd_coverage
from bridgegen.scenario.odd.reader import Odd, odd_of


@dataclass
class ProjectOdd:
    """What the runs of a project have of its ODD: of the one given, else of that of the first run.

    Attributes:
        coverage: of the ODD; None while there is none.
        runs: how many are counted.
        outside: their evaluations outside.
        unread: runs whose scenario cannot be read, or states nothing of an ODD.
        others: names of other ODDs that bound runs.
    """

    coverage: OddCoverage | None = None
    runs: int = 0
    outside: int = 0
    unread: int = 0
    others: set[str] = field(default_factory=set)
    _fits: dict[str, Fit | None] = field(default_factory=dict)
    _waiting: list[Path] = field(default_factory=list)

    @classmethod
    def of(cls, odd: Odd | None) -> "ProjectOdd":
        """Return an ODD of which nothing is counted yet."""
        return cls(None if odd is None else odd_coverage(odd))

    def add(self, store: Store, settings: Settings) -> None:
        """Count the evaluations of a run; without an ODD, nothing.

        Raises:
            StorageError, FileFormatError: the run is damaged.
        """
        if settings.odd is not None:
            own = odd_of(settings.odd)
            if self.coverage is None:
                self.coverage = odd_coverage(own)
                waiting, self._waiting = self._waiting, []
                for folder in waiting:
                    with Store.open(folder) as earlier:
                        self.add(earlier, Settings.from_dict(earlier.settings, folder))
            elif own.digest != self.coverage.odd.digest:
                self.others.add(own.name)
        if self.coverage is None:
            self._waiting.append(store.folder)
        if self.coverage is None or not len(store):
            return
        fit = self._fit(settings, self.coverage.odd)
        if fit is None:
            self.unread += 1
            return
        rows = store.read()
        ok = rows.status == 0
        columns: dict[str, Float] = dict(zip(store.parameters, rows.X[ok].T, strict=True))
        inside: Bool = fit.inside(columns) if ok.any() else np.zeros(0, np.bool_)
        self.runs += 1
        self.outside += int((~inside).sum())
        if inside.any():
            kept = {name: values[inside] for name, values in columns.items()}
            self.coverage.add(fit, kept, rows.critical[ok][inside])

    def _fit(self, settings: Settings, odd: Odd) -> Fit | None:
        """Return the ODD for a run's scenario; None where that has changed, or is a file's."""
        key = json.dumps(
            [settings.scenario, settings.others, settings.road_map, settings.fingerprint]
        )
        if key not in self._fits:
            self._fits[key] = None
            try:
                read = load(settings.scenario, settings.distribution, settings.empty_trigger)
                scenario = driven_by(read, settings.others)
                bound = within(scenario, settings.odd, settings.road_map)
                is_same = bound.fingerprint == settings.fingerprint
                if is_same and isinstance(scenario, LogicalScenario):
                    on_map = settings.road_map is not None
                    self._fits[key] = fit_of(scenario, odd, on_map=on_map)
            except (BridgeGenError, OSError, ValueError):  # ValueError: NUL in a path
                pass
        return self._fits[key]
