"""What a finished run holds, as a safety case needs it; and the files that prove it."""

import hashlib
import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, StorageError
from bridgegen.drivers import file_of, is_remote, is_spec
from bridgegen.jobs.safety_case.model import Evidence, RunFacts
from bridgegen.jobs.safety_case.numbers import RUN
from bridgegen.jobs.search.exported import FOLDER
from bridgegen.jobs.search.restored import searched
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.scenarios import is_file
from bridgegen.results.confirmation.record import Record, file_name, read_records
from bridgegen.results.store import Recorded, Store
from bridgegen.scenario.language.coverage import Coverage, coverage
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.triage.record import JSON_FILE, Triage

BINS, STRENGTH = 5, 2
"""Number of bins of a parameter, and of parameters of a combination, that the coverage counts."""


@dataclass(frozen=True)
class Facts:
    """A finished run.

    Attributes:
        run: on disk.
        triage: of it.
        scenario: that it searched.
        space: likewise.
        coverage: of the space.
        confirmations: in other simulators.
        rows: of the run; what they hold in memory can be read.
        columns: metrics of all evaluations, ``(N,)`` each, by name, as far as they are recorded.
        severity: of the worst evaluation of each failure mode; empty where none is recorded.
    """

    run: Run
    triage: Triage
    scenario: SearchedScenario
    space: SearchSpace
    coverage: Coverage
    confirmations: tuple[Record, ...]
    rows: Recorded
    columns: Mapping[str, Float]
    severity: Sequence[float]

    @property
    def ego(self) -> str:
        """The system under test, as people call it; of a user's file without its folder."""
        named = self.run.settings.ego
        is_file = is_spec(named) and not is_remote(named)
        return self.triage.ego.replace(named, Path(named).name) if is_file else self.triage.ego

    @property
    def fresh_harmful(self) -> int:
        """How many of the fresh random rows, which no search chose, are failures."""
        return 0 if self.triage.fresh is None else self.triage.bound.space.harmful

    @property
    def harm(self) -> Float:
        """``(N,)``, that of the conflicts that count; NaN where an evaluation failed."""
        return self.columns[harm_name(self.triage)]


def harm_name(triage: Triage) -> str:
    """Return the name of the recorded harm that a run counts."""
    return "harm" if triage.count == "ego" else "harm_any"


def read_facts(folder: Path) -> Facts:
    """Read a finished run.

    Raises:
        StorageError: not a run, damaged, not closed, or its scenario has changed since.
        InputError: not finished, of two drivers, without a triage, or of a version that recorded
            too little.
        FileFormatError: its triage, or a confirmation, is damaged or another run's.
    """
    run = Run(folder)
    # Such a run counts a row as a failure only where one driver fails and the other does not.
    if run.settings.worse_than is not None:
        raise InputError(
            f"{folder}: compares {run.settings.ego} with {run.settings.worse_than}: failures of "
            "both do not count in it, so it supports no claim of one; search without --worse-than"
        )
    triage = _triage(run)
    wanted = (harm_name(triage), "d_min", "n_collision", "severity")
    scenario, space, _ = searched(run)
    with Store.open(folder) as store:
        if "implausible" not in store.columns.last or wanted[0] not in store.metrics:
            raise InputError(
                f"{folder}: must be a run that records the harm of its evaluations, as all by "
                f"BridgeGen 0.1.0 and later do; it was made by BridgeGen {run.version}: search "
                "again"
            )
        rows = Recorded(store, whole=wanted)
        columns = {
            name: np.asarray(rows.metrics[:, store.metrics.index(name)])
            for name in wanted
            if name in store.metrics
        }
        ok = rows.status == 0
        covered = coverage(space, rows.X[ok], rows.critical[ok], bins=BINS, strength=STRENGTH)
        confirmations = read_records(folder, rows.X, rows.metrics)
    severity = columns.get("severity")
    return Facts(
        run=run,
        triage=triage,
        scenario=scenario,
        space=space,
        coverage=covered,
        confirmations=confirmations,
        rows=rows,
        columns=columns,
        severity=[] if severity is None else [float(severity[m.worst]) for m in triage.modes],
    )


def _triage(run: Run) -> Triage:
    """Return the triage of a run that is finished and closed.

    Raises:
        StorageError: it is not closed.
        InputError: it is not finished, or has no triage, or one of an earlier version.
    """
    folder, resume = run.folder, f"bridgegen resume {run.folder}"
    if not run.finished:
        done, budget = run.summary.evaluations, run.settings.budget
        raise InputError(
            f"{folder}: the run must be finished, it has {done} of {budget} evaluations; "
            f"finish it: {resume}"
        )
    # A digest of the file must be that of all evaluations: what is in SQLite's log is not in the
    # file yet.
    log = folder / "run.sqlite-wal"
    if log.is_file() and log.stat().st_size:
        raise StorageError(
            f"{folder}: another process has the run open ({log.name} is not empty), so its file "
            f"has no final digest; close it, or: {resume}"
        )
    triage = run.triage
    if triage is None:
        raise InputError(
            f"{folder}: the run must have been examined for failure modes, {JSON_FILE} is "
            f"missing; this writes it: {resume}"
        )
    if triage.bound.space.drawn == "fresh" and triage.fresh is None:
        raise InputError(
            f"{folder}: {JSON_FILE} is of an earlier version, which did not keep the fresh random "
            f"rows of its bound; this writes it again: {resume}"
        )
    return triage


def run_facts(facts: Facts, name: str, out: Path) -> RunFacts:
    """Return what a recomputation needs to know of a run.

    Args:
        facts: of the run.
        name: id of the run in the record.
        out: the record's folder, which the run's is named from.
    """
    settings, triage = facts.run.settings, facts.triage
    folder = os.path.relpath(facts.run.folder.resolve(), out.resolve())
    drawn = triage.bound.space.drawn
    return RunFacts(
        id=name,
        folder=Path(folder).as_posix(),
        scenario=triage.scenario,
        ego=facts.ego,
        algorithm=settings.algorithm,
        seed=settings.seed,
        version=facts.run.version,
        results=triage.results,
        count=triage.count,
        drawn="" if not drawn else "fresh" if drawn == "fresh" else "run",
        edges={
            parameter.name: tuple(parameter.edges[1:-1].tolist())
            for parameter in facts.coverage.parameters
        },
    )


# --- The files that a safety case rests on, with their digests ---


MOST_SHOWN = 10
"""Largest number of failure modes that are counter goals of their own, with their files."""


class Files:
    """The evidence of one run.

    Args:
        facts: of the run.
        number: of the run, from 1.
        out: the folder of the case.

    Attributes:
        all: every file.
        run: id of the file of evaluations.
        triage: id of the record of failure modes.
        modes: ids of the exported files of each failure mode, by its number.
        confirmations: ids of the records of other simulators, by their names.
        inputs: ids of the files that the run was made from.
        driver: id of the file of a driver of the user's; "" without.
        resume: the command that makes the run's record of failure modes again.
    """

    def __init__(self, facts: Facts, number: int, out: Path) -> None:
        self._folder, self._out, self._number = facts.run.folder, out, number
        self.all: list[Evidence] = []
        settings, name = facts.run.settings, facts.run.folder.resolve().name
        self.resume = shlex.join(["bridgegen", "resume", name])
        search = settings.command(Path(name))
        self.run = self.add(self._folder / RUN, "every evaluation of the search", search)
        self.triage = self.add(
            self._folder / JSON_FILE,
            "failure modes, their neighbours, and the bound on the harmful share",
            self.resume,
        )
        self.modes = {}
        for mode in facts.triage.modes[:MOST_SHOWN]:
            stems = [*mode.exports[:1], *([mode.minimal.name] if mode.minimal else [])]
            self.modes[mode.number] = [
                self.add(path, shows, self.resume)
                for stem in stems
                for path, shows in self._scenario(stem)
            ]
        self.confirmations = {
            confirmation.simulator: self.add(
                self._folder / file_name(confirmation.simulator),
                f"exported scenarios simulated again in {confirmation.label}",
                shlex.join(["bridgegen", "confirm", name, "--simulator", confirmation.simulator]),
            )
            for confirmation in facts.confirmations
        }
        self.inputs = [
            self.add(path, shows, "")
            for path, shows in (
                (settings.scenario if is_file(settings.scenario) else "", "the logical scenario"),
                (settings.distribution, "the distribution of its parameters"),
                (settings.road_map, "its map"),
            )
            if path and Path(path).is_file()
        ]
        code = file_of(settings.ego)
        self.driver = ""
        if code is not None and code.is_file():
            self.driver = self.add(code, "the driver, as it is at the export", "")

    def _scenario(self, stem: str) -> Iterator[tuple[Path, str]]:
        """Yield the files of an exported scenario that exist, and what each shows."""
        for kind, shows in (
            ("xosc", "the scenario"),
            ("xodr", "its road"),
            ("json", "its metrics"),
        ):
            path = self._folder / FOLDER / f"{stem}.{kind}"
            # The stem is of a record, which is untrusted: it must not name files outside the run.
            inside = path.resolve().is_relative_to(self._folder.resolve())
            if stem and inside and path.is_file():
                yield path, f"{stem}: {shows}"

    def add(self, path: Path | str, shows: str, command: str) -> str:
        """Add a file, unless it is known; return its id.

        Raises:
            StorageError: it cannot be read.
        """
        path = Path(path)
        # Relative, and with the slashes of POSIX: the case and its runs may be moved together, and
        # read on another system.
        file = Path(os.path.relpath(path.resolve(), self._out.resolve())).as_posix()
        known = next((item.id for item in self.all if item.file == file), None)
        if known is not None:
            return known
        try:
            with path.open("rb") as data:
                digest = hashlib.file_digest(data, "sha256").hexdigest()
            size = path.stat().st_size
        except OSError as error:
            raise StorageError(f"{path}: cannot be read: {error.strerror}") from None
        evidence = Evidence(
            id=f"E{self._number}.{len(self.all) + 1}",
            file=file,
            sha256=digest,
            bytes=size,
            shows=shows,
            command=command,
        )
        self.all.append(evidence)
        return evidence.id
