"""Confirmation of a run's critical scenarios in another simulator; the record is in its folder."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.base.errors import InputError, Interrupted
from bridgegen.engine.options import checked
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Choice, open_workers
from bridgegen.jobs.search.cross_simulator import run_elsewhere
from bridgegen.jobs.search.report import rewrite_report
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.jobs.search.run import Run
from bridgegen.results.confirmation.record import (
    Record,
    Scenario,
    check_rows,
    file_name,
    read_record,
    write_record,
)
from bridgegen.results.confirmation.summary import ConfirmationSummary, summarise
from bridgegen.results.store import Rows
from bridgegen.search.algorithms.dominance import by_merit
from bridgegen.search.triage.record import JSON_FILE as TRIAGE_FILE
from bridgegen.search.triage.record import read_record as read_triage
from bridgegen.simulation.choice import SimulatorChoice

SECONDS = 1.0
"""Time that results may wait before they are written [s]."""

Tally = Counter[bool | None]
"""Numbers of scenarios that are confirmed (True), not confirmed (False), and failed (None)."""

MOST_TRACKS = 100
"""Largest number of scenarios whose tracks are recorded: some ten kilobytes each."""


@dataclass(frozen=True)
class RunConfirmation:
    """The result of a confirmation.

    Attributes:
        folder: the run's.
        record: of all that was ever confirmed of the run in that simulator.
        scenarios: those that this call was asked for, most critical first.
        ran: how many of these it ran; the others had been confirmed before.
        files: that were written.
    """

    folder: Path
    record: Record
    scenarios: tuple[Scenario, ...]
    ran: int
    files: tuple[Path, ...]

    @property
    def summary(self) -> ConfirmationSummary:
        """The counts over ``scenarios``."""
        return summarise(self.scenarios)


@checked
def confirm(
    folder: Path | str,
    simulator: SimulatorChoice | str,
    *,
    rows: int | None = None,
    again: bool = False,
    ego: str | None = None,
    metrics: Sequence[str] | None = None,
    workers: Choice = None,
    stage: Callable[[str], None] | None = None,
    progress: Callable[[int, int, Tally], None] | None = None,
) -> RunConfirmation:
    """Run a run's critical scenarios in another simulator, and compare.

    The results are written to ``confirmation-SIMULATOR.json`` in the run's folder; a scenario that
    it has already is not run again, unless it failed. An existing report is written again.

    Args:
        folder: of the run, finished or not.
        simulator: the other one; its name, where it needs no settings.
        rows: how many of the run's critical scenarios, the most critical ones; the exported
            ones by default.
        again: whether to discard earlier results.
        ego: where a driver of your own drives, that same driver.
        metrics: likewise, those of your own.
        workers: run the other simulator, see ``run_search``.
        stage: called as a stage begins: "compile", "confirm", "report".
        progress: called with the number of scenarios done, of all, and the numbers of confirmed
            (True), not confirmed (False) and failed ones (None).

    Raises:
        WorkersError: there are no workers, or they are lost; the same call resumes.
        StorageError: not a run, its scenario or map is not what it was, or not writable.
        FileFormatError: an earlier record is damaged, or another run's.
        InputError: nothing to confirm; the simulator is the run's own, is missing, or differs from
            that of the earlier record; or the ego has to be named.
        Interrupted: Ctrl-C; the same call resumes.
    """
    stage = stage or (lambda name: None)
    if isinstance(simulator, str):
        simulator = SimulatorChoice(simulator)
    if rows is not None and rows < 1:
        raise InputError(f"1 <= rows must hold, got {rows}")
    run = Run(folder)
    every, settings, place = run.rows(), run.settings, run.folder
    if simulator.name == settings.simulator.name:
        raise InputError(
            f"{place}: was searched in the simulator {simulator.name}; confirm it in another one "
            "(--simulator)"
        )
    names = {exported.evaluation: exported.name for exported in run.exported(len(every))}
    asked = _chosen(place, every, names, rows, settings.budget)
    command = f"confirm --simulator {simulator.name}"
    own = metrics or ()
    here = pipeline_of(run, command, ego=ego, metrics=own)
    stage("compile")
    here.warm_up()
    with open_workers(workers) as pool:
        there = pipeline_of(run, command, ego=ego, metrics=own, elsewhere=simulator, workers=pool)
        empty = _empty(here, there, simulator, run)
        known = {} if again else _known(place, empty, every)
        todo = [k for k in asked if k not in known or known[k].there is None]
        growing = _GrowingRecord(
            place, empty, known, names, _merit(every), _robustness(place, every)
        )
        growing.write()  # fails before anything is run, if the folder cannot be written
        stage("confirm")
        try:
            for scenario in run_elsewhere(here, there, every, todo):
                growing.add(scenario)
                if progress:
                    progress(growing.tally.total(), len(todo), growing.tally)
        except KeyboardInterrupt:
            raise _stopped(place, simulator.name, rows, growing.tally.total(), len(todo)) from None
        finally:
            record = growing.write()
    try:
        report = rewrite_report(run, here, stage)
    except KeyboardInterrupt:
        raise _stopped(place, simulator.name, rows, len(todo), len(todo)) from None
    files = (place / file_name(simulator.name), *report)
    return RunConfirmation(place, record, tuple(growing.of(asked)), len(todo), files)


def _empty(
    here: Pipeline,
    there: Pipeline,
    simulator: SimulatorChoice,
    run: Run,
) -> Record:
    """Return the record of a run before its first confirmation."""
    objective = here.objective
    version = getattr(there.runner.simulator, "version", "")
    known = any(letter.isdigit() for letter in version)  # esmini may not know its own
    return Record(
        simulator=simulator.name,
        label=f"{simulator.name} {version}" if known else simulator.name,
        settings=dict(simulator.settings),
        reference=run.settings.simulator.name,
        run=str(run.folder),
        scenario=here.scenario.name,
        ego=here.driver.label,
        thresholds=objective.thresholds,
        rule=objective.rule,
        count=objective.count,
        objectives=objective.names if objective.objectives == "many" else ("F",),
    )


class _GrowingRecord:
    """A record that grows.

    Attributes:
        tally: of the scenarios that were run by this call.
    """

    def __init__(
        self,
        folder: Path,
        empty: Record,
        known: dict[int, Scenario],
        names: dict[int, str],
        merit: dict[int, int],
        robustness: dict[int, float | None],
    ) -> None:
        self.tally: Tally = Counter()
        self._folder, self._empty = folder, empty
        self._found, self._names, self._merit = known, names, merit
        self._robustness = robustness
        self._written = 0.0

    def add(self, scenario: Scenario) -> None:
        """Add a scenario's result; write it within ``SECONDS``."""
        self._found[scenario.evaluation] = scenario
        self.tally[scenario.confirmed] += 1
        if time.monotonic() - self._written >= SECONDS:
            self.write()

    def of(self, evaluations: Sequence[int]) -> list[Scenario]:
        """Return the results of some evaluations, with names of files and robustness."""
        return [
            self._found[k].model_copy(
                update={"name": self._names.get(k), "robustness": self._robustness.get(k)}
            )
            for k in evaluations
        ]

    def write(self) -> Record:
        """Write all, most critical first."""
        order = sorted(self._found, key=lambda k: self._merit.get(k, len(self._merit)))
        scenarios = [
            # By merit and not by time of arrival: the tracks that are kept are of the most critical
            # ones.
            scenario if place < MOST_TRACKS else scenario.model_copy(update={"tracks": ()})
            for place, scenario in enumerate(self.of(order))
        ]
        record = self._empty.model_copy(update={"scenarios": tuple(scenarios)})
        write_record(self._folder, record)
        self._written = time.monotonic()
        return record


def _chosen(
    folder: Path, every: Rows, names: dict[int, str], rows: int | None, budget: int
) -> list[int]:
    """Return the evaluations to confirm, most critical first.

    Raises:
        InputError: there is nothing to confirm.
    """
    if rows is None and names:
        if outside := [k for k in names if not 0 <= k < len(every) or every.status[k] != 0]:
            raise InputError(f"{folder}: has no result of evaluation {outside[0] + 1}")
        return list(names)
    order = sorted(_merit(every).items(), key=lambda pair: pair[1])
    finish = f"'bridgegen resume {folder}'"
    if not order:
        more = "search with a larger --budget, another --seed or another --algorithm"
        if len(every) < budget:
            more = f"{finish} runs the other {budget - len(every)}"
        raise InputError(
            f"{folder}: none of {len(every)} evaluations is critical, so that there is nothing to "
            f"confirm; {more}"
        )
    if rows is None:
        raise InputError(
            f"{folder}: no scenario is exported; {finish} finishes a search that was stopped, "
            f"--rows N confirms the N most critical of its {len(order)} critical evaluations"
        )
    return [k for k, _ in order[:rows]]


def _merit(every: Rows) -> dict[int, int]:
    """Return the places of all critical evaluations, 0 for the most critical."""
    critical = np.flatnonzero(every.critical & (every.status == 0))
    order = critical[by_merit(every.F[critical])]
    # Places and not merits: F has several columns, which only by_merit puts in order.
    return {k: place for place, k in enumerate(order.tolist())}


def _robustness(folder: Path, every: Rows) -> dict[int, float | None]:
    """Return the robustness of the evaluations whose neighbours were tested."""
    found = read_triage(folder / TRIAGE_FILE)
    if found is None or found.results != every.digest():
        return {}
    return {
        neighbourhood.evaluation: neighbourhood.robustness for neighbourhood in found.neighbourhoods
    }


def _known(folder: Path, empty: Record, every: Rows) -> dict[int, Scenario]:
    """Return the results of the earlier record, by evaluation.

    Raises:
        InputError: simulator, settings or criteria were others.
        FileFormatError: the record is damaged, or another run's.
    """
    path = folder / file_name(empty.simulator)
    earlier = read_record(path)
    if earlier is None:
        return {}
    check_rows(path, earlier.scenarios, every.X, every.metrics)
    # A record is of one simulator as it was set and of one objective: results of others do not add
    # up to counts.
    for name in ("label", "settings", "ego", "thresholds", "rule", "count", "objectives"):
        was, would = getattr(earlier, name), getattr(empty, name)
        if was != would:
            raise InputError(
                f"{path}: its {'simulator' if name == 'label' else name} is {was}, and now would "
                f"be {would}; confirm all of it with --again"
            )
    return {scenario.evaluation: scenario for scenario in earlier.scenarios}


def _stopped(folder: Path, simulator: str, rows: int | None, done: int, total: int) -> Interrupted:
    command = f"bridgegen confirm {folder} --simulator {simulator}"
    if rows is not None:
        command += f" --rows {rows}"
    return Interrupted(folder, done, total, what="scenarios", command=command)
