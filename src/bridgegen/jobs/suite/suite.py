"""A suite from start to finish: find, run, record, judge; and resuming one."""

import json
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from bridgegen import drivers as egos
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, Interrupted, StorageError
from bridgegen.base.records import parse_json
from bridgegen.engine.options import CommonOptions, called_with
from bridgegen.engine.workers.processes import cores
from bridgegen.engine.workers.tasks import TaskPool
from bridgegen.jobs.search.scenarios import PAPER
from bridgegen.jobs.suite.entries import RESULTS as FILE
from bridgegen.jobs.suite.entries import find_entries, of_edition
from bridgegen.jobs.suite.evaluate import Job, evaluate
from bridgegen.jobs.suite.known_failures import KnownFailures
from bridgegen.jobs.suite.results import EntryResult, Header
from bridgegen.results.store.sqlite import Lock
from bridgegen.scenario.language.criteria import read_criterion
from bridgegen.scenario.language.protocols import read_clause
from bridgegen.simulation import vehicles
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice

LOCK = "suite.lock"
MOST_BYTES = 2**30
"""Of a file of results."""

SAMPLES = 100

NOT_OF_A_SUITE = (
    "ego", "worse_than", "metrics", "causes", "cause", "distribution", "axes", "fixed", "road_map",
    "junction", "weights", "scale", "objectives", "adversary",
)  # fmt: skip
"""Options of a search that would mean nothing in a suite."""


@dataclass(frozen=True)
class SuiteCallbacks:
    """Called as a suite progresses, all from the same thread.

    Attributes:
        begun: with the number of entries (of all egos), and of those that are done already.
        ended: with each entry's result.
    """

    begun: Callable[[int, int], None] = lambda entries, done: None
    ended: Callable[[EntryResult], None] = lambda result: None


@dataclass(frozen=True, kw_only=True)
class SuiteArguments:
    """The arguments of ``run_suite``."""

    files: Sequence[str | Path] | str | Path = field(
        kw_only=False,
        metadata={
            "help": "Folders, scenario and distribution files, or names of the catalogue, of a "
            "pack or of its scenarios."
        },
    )
    egos: Sequence[str] = field(
        default=(), metadata={"help": "Drivers to test; the scenarios' own by default."}
    )
    options: CommonOptions = field(
        default_factory=CommonOptions,
        metadata={
            "help": "Options of all scenarios: criteria, critical, count, ideal, "
            "vehicle, others, time_limit, empty_trigger."
        },
    )
    samples: int = field(
        default=SAMPLES,
        metadata={
            "help": "Evenly spread rows of each logical scenario without a matrix, besides its "
            "defaults."
        },
    )
    matrix: str | None = field(
        default=None,
        metadata={
            "help": "Edition of the logical scenarios' matrices; all by default, ``none`` for "
            "``samples`` instead."
        },
    )
    seed: int = field(default=0, metadata={"help": "Of these rows."})
    simulator: SimulatorChoice = field(
        default=EMBEDDED, metadata={"help": "Simulator that runs the scenarios."}
    )
    workers: int | None = field(
        default=None, metadata={"help": "Processes; as many as there are cores by default."}
    )
    out: Path | str | None = field(
        default=None,
        metadata={"help": "Folder of the results, new or to resume; ``suites/NAME`` by default."},
    )
    callbacks: SuiteCallbacks | None = field(
        default=None, metadata={"help": "Called as the suite progresses."}
    )


@dataclass(frozen=True)
class SuiteRun:
    """A finished suite.

    Attributes:
        folder: of its results.
        egos: that were tested, as named; "" for the scenarios' own drivers.
        results: of each entry, in the order of entries, then of egos.
        settings: on which the results depend.
        jobs: of which they are the results, in the same order; empty where they were only read.
    """

    folder: Path
    egos: tuple[str, ...]
    results: tuple[EntryResult, ...]
    settings: dict[str, Any]
    jobs: tuple[Job, ...] = ()

    @cached_property
    def known_failures(self) -> KnownFailures:
        """What the indexes of its folders say of its failures.

        Raises:
            FileFormatError: an index is damaged.
        """
        return KnownFailures.of(self.results)

    def of_ego(self, ego: str) -> tuple[EntryResult, ...]:
        """Return the results with one ego."""
        return tuple(one for one in self.results if one.ego == ego)


@called_with(SuiteArguments)
def run_suite(given: SuiteArguments) -> SuiteRun:
    """Run scenario files with all their variations, with one ego or several.

    Killed at any moment and called again, it resumes: what has been run with the same settings and
    unchanged files is kept. No result depends on the number of workers.

    Returns:
        The results. An entry that cannot run is one of them, with its problem.

    Raises:
        InputError: no scenario is found, or an argument breaks a rule.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    callbacks = given.callbacks or SuiteCallbacks()
    files = [given.files] if isinstance(given.files, str | Path) else list(given.files)
    _check(given)
    entries = of_edition(find_entries(files), given.matrix)
    drivers = tuple(dict.fromkeys(given.egos)) or ("",)
    folder = Path(given.out) if given.out is not None else _folder(files)
    settings = _settings(given)
    jobs = [
        Job(
            one,
            ego or None,
            given.options,
            given.simulator,
            given.samples,
            given.seed,
            given.matrix,
        )
        for one in entries
        for ego in drivers
    ]
    path = folder / FILE
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
    lock = Lock(folder / LOCK)
    try:
        done = _done(path, settings, jobs)
        waiting = [job for job in jobs if (job.entry.name, job.ego or "") not in done]
        callbacks.begun(len(jobs), len(done))
        _run(waiting, given.workers, path, done, callbacks)
    except KeyboardInterrupt:
        done = _done(path, settings, jobs)
        again = f"bridgegen suite … --out {folder}"
        raise Interrupted(folder, len(done), len(jobs), what="entries", command=again) from None
    finally:
        lock.release()
    results = tuple(done[job.entry.name, job.ego or ""] for job in jobs)
    return SuiteRun(folder, drivers, results, settings, tuple(jobs))


def read_suite(folder: Path) -> SuiteRun:
    """Return the results in a folder, finished or not.

    Raises:
        StorageError: there are none, or they are damaged.
    """
    header, results, _ = _read(folder / FILE)
    if header is None:
        raise StorageError(f"{folder}: holds no results of a suite ({FILE})")
    egos = tuple(dict.fromkeys(one.ego for one in results))
    return SuiteRun(folder, egos, tuple(results), header.settings)


def _check(given: SuiteArguments) -> None:
    problems = []
    for name in given.egos:
        egos.get(name, (), given.options.time_limit)
    vehicle = given.options.vehicle
    if vehicle is not None:
        vehicles.require(vehicle)
        if vehicle != vehicles.KINEMATIC and given.simulator.name != EMBEDDED.name:
            problems.append(
                f"the vehicle '{vehicle}' is of the embedded simulator; {given.simulator.name} "
                f"moves the ego in its own way (--vehicle {vehicles.KINEMATIC})"
            )
    if given.samples < 0:
        problems.append(f"samples must be at least 0, got {given.samples}")
    if given.workers is not None and given.workers < 1:
        problems.append(f"workers must be at least 1, got {given.workers}")
    if given.options.objective and PAPER in given.options.objective and given.options.critical:
        problems.append("the objective 'paper' says what is critical; leave --critical out")
    default = CommonOptions()
    problems += [
        f"a suite takes no option '{name}'"
        for name in NOT_OF_A_SUITE
        if getattr(given.options, name) != getattr(default, name)
    ]
    if problems:
        raise InputError(*problems)


def _folder(files: Sequence[str | Path]) -> Path:
    """Return the folder of results by default: none of those that hold the scenarios."""
    names = [Path(one).resolve().stem for one in files]
    folder = Path("suites") / ("-".join(names[:3]) + ("-and-more" if len(names) > 3 else ""))
    if folder.resolve() in {Path(one).resolve() for one in files}:
        return folder.with_name(f"{folder.name}-results")
    return folder


def _settings(given: SuiteArguments) -> dict[str, Any]:
    """Return what results depend on besides the files, as JSON's types."""
    options = given.options
    return {
        "samples": given.samples,
        "matrix": given.matrix,
        "seed": given.seed,
        "simulator": given.simulator.name,
        "simulator_settings": dict(given.simulator.settings),
        "criteria": [dict(one) for one in options.criteria],
        "critical": options.critical,
        "objective": dict(options.objective) if options.objective else None,
        "count": options.count,
        "ideal": list(options.ideal),
        "vehicle": options.vehicle,
        "others": options.others,
        "empty_trigger": options.empty_trigger,
        "time_limit": options.time_limit,
        "version": version("bridgegen"),
    }


def _run(
    jobs: Sequence[Job],
    workers: int | None,
    path: Path,
    done: dict[tuple[str, str], EntryResult],
    callbacks: SuiteCallbacks,
) -> None:
    """Run entries, and append each result to the file as it is there."""
    at_once = min(workers or cores(), len(jobs))

    def ended(job: Job, result: EntryResult | None, crash: str | None) -> None:
        if result is None:
            result = EntryResult(
                entry=job.entry.name, ego=job.ego or "", digest="", scenario=job.entry.scenario,
                distribution=job.entry.distribution or "", problem=crash or "",
            )  # fmt: skip
        done[job.entry.name, job.ego or ""] = result
        _append(path, result.model_dump_json() + "\n")
        callbacks.ended(result)

    if at_once > 1:
        TaskPool(jobs, work, ended=ended).run(at_once)
        return
    for job in jobs:
        ended(job, evaluate(job), None)


def work(job: Job, say: Callable[..., None]) -> EntryResult:
    """Run an entry in a worker process."""
    return evaluate(job)


def _append(path: Path, text: str) -> None:
    try:
        with path.open("ab") as file:
            file.write(text.encode())
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None


def _done(
    path: Path, settings: dict[str, Any], jobs: Iterable[Job]
) -> dict[tuple[str, str], EntryResult]:
    """Return the results that a file holds already, of unchanged files; begin a new file.

    Raises:
        StorageError: the file is damaged, or of other settings.
    """
    header, results, torn = _read(path)
    if header is None:
        line = Header(settings=settings).model_dump_json() + "\n"
        write_whole(path, [line.encode()])
        return {}
    if header.settings != json.loads(json.dumps(settings)):
        other = [name for name in settings if header.settings.get(name) != settings[name]]
        raise StorageError(
            f"{path.parent}: holds the results of a suite with other settings "
            f"({', '.join(other)}); choose another folder with --out"
        )
    wanted = {(job.entry.name, job.ego or ""): job for job in jobs}
    found = {}
    for one in results:
        job = wanted.get((one.entry, one.ego))
        # Earlier versions did not record what happened: such an entry is run again.
        is_whole = {"not_happened", "outside"} <= one.model_fields_set
        if job is not None and job.is_of(one) and is_whole:
            found[one.entry, one.ego] = one
    if torn or len(found) < len(results):  # what has changed is run again, and said once
        lines = [header.model_dump_json(), *(one.model_dump_json() for one in found.values())]
        write_whole(path, [("\n".join(lines) + "\n").encode()])
    return found


def _read(path: Path) -> tuple[Header | None, list[EntryResult], bool]:
    """Return the header and the results in a file, and whether its last line has no end.

    Such a line, of a process that was killed as it wrote, is left out.

    Raises:
        StorageError: it cannot be read, or is damaged.
    """
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise StorageError(f"{path}: may have at most {MOST_BYTES} bytes, got {size}")
        data = path.read_bytes()
    except FileNotFoundError:
        return None, [], False
    except OSError as error:
        raise StorageError(f"{path}: cannot be read: {error.strerror}") from None
    *lines, rest = data.split(b"\n")
    if not lines:
        return None, [], False
    try:
        header = Header.model_validate(parse_json(lines[0]))
        results = [EntryResult.model_validate(parse_json(line)) for line in lines[1:]]
        for one in results:
            for criterion in one.criteria:
                read_criterion(criterion)
            for clause in one.clauses:
                read_clause(clause)
    except ValidationError as error:
        first = error.errors(include_input=False, include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise StorageError(f"{path}: is damaged: {where}: {first['msg']}") from None
    except (InputError, ValueError) as error:
        raise StorageError(f"{path}: is damaged: {error}") from None
    return header, results, bool(rest)
