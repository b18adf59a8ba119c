"""A suite from start to finish: find, run, record, judge; and resuming one."""

import json
import os
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from bridgegen import drivers as egos
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError, Interrupted, StorageError
from bridgegen.base.records import parse_json
from bridgegen.drivers.identity import checked_name, identity_of, labels_of
from bridgegen.engine.options import called_with, range_problems
from bridgegen.engine.workers.processes import cores
from bridgegen.engine.workers.tasks import TaskPool
from bridgegen.jobs import frame
from bridgegen.jobs.suite.drawn import Draw
from bridgegen.jobs.suite.entries import RESULTS as FILE
from bridgegen.jobs.suite.entries import find_entries, of_edition
from bridgegen.jobs.suite.evaluate import Job, evaluate
from bridgegen.jobs.suite.known_failures import KnownFailures
from bridgegen.jobs.suite.options import SUITE, ScenariosOptions, SuiteOptions
from bridgegen.jobs.suite.results import EntryResult, Header
from bridgegen.results.store.sqlite import Lock
from bridgegen.scenario.language.criteria import read_criterion
from bridgegen.scenario.language.protocols import read_clause
from bridgegen.scenario.language.reader import pack_tables
from bridgegen.simulation import vehicles
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice

if TYPE_CHECKING:
    from bridgegen.jobs.frame import Table
    from bridgegen.jobs.preventability.result import PreventabilityMap
    from bridgegen.jobs.suite.sealed import Sealed

LOCK, SEALED = "suite.lock", "sealed.json"
MOST_BYTES = 2**30
"""Largest size of a file of results [bytes]."""


@dataclass(frozen=True)
class SuiteRun:
    """A finished suite.

    Attributes:
        folder: of its results.
        egos: that were tested, as named; "" for the scenarios' own drivers.
        results: of each entry, in the order of entries, then of egos.
        settings: on which the results depend.
        jobs: of which they are the results, in the same order; empty where they were only read.
        maps: preventability maps of its scenarios, in its folder.
        sealed: what an assessor's key drew and found, in its folder.
        unanswered: clauses of its packs that no scenario answers: id, requirement in words, reason;
            empty where results were only read.
        page: that shows all this; None where none was written.
    """

    folder: Path
    egos: tuple[str, ...]
    results: tuple[EntryResult, ...]
    settings: dict[str, Any]
    jobs: tuple[Job, ...] = ()
    maps: "tuple[PreventabilityMap, ...]" = ()
    sealed: "Sealed | None" = None
    unanswered: tuple[tuple[str, str, str], ...] = ()
    page: Path | None = None

    @cached_property
    def known_failures(self) -> KnownFailures:
        """What the indexes of its folders say of its failures.

        Raises:
            FileFormatError: an index is damaged.
        """
        return KnownFailures.of(self.results)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """How each ego is called; of the scenarios' own drivers, the one that all have."""
        found = []
        for ego in self.egos:
            results = self.of_ego(ego)
            own = {result.driver for result in results if result.driver}
            shared = own.pop() if len(own) == 1 else "the scenarios' own drivers"
            digest = next((one.driver_digest for one in results if one.driver_digest), "")
            name = str(self.settings.get("driver_name") or "")
            found.append(identity_of(ego or shared, digest, name))
        labels = tuple(labels_of(found))
        # Files of one content in two folders, whose weights beside them may differ.
        return labels if len(set(labels)) == len(labels) else self.egos

    @property
    def work(self) -> str:
        """How many variations have a result."""
        return f"{sum(len(result.rows) for result in self.results):,} variations"

    def drawn_lines(self, ego: str) -> list[str]:
        """Return what an ego makes of what an assessor's key drew; nothing without one."""
        from bridgegen.jobs.suite.sealed import sealed_lines

        return sealed_lines(self.sealed, ego) if self.sealed else []

    def of_ego(self, ego: str) -> tuple[EntryResult, ...]:
        """Return the results with one ego."""
        return tuple(result for result in self.results if result.ego == ego)

    def to_json(self) -> Any:
        """Return the verdicts, counts, points, clauses and maps as JSON's types."""
        from bridgegen.jobs.suite.shown import json_of_suite

        return json_of_suite(self)

    def shown(self) -> "Sequence[str | Table]":
        """Return the entries, what does not pass first, then clauses and totals."""
        from bridgegen.jobs.suite.shown import suite_shown

        return suite_shown(self)


@called_with(SuiteOptions)
def run_suite(given: SuiteOptions) -> SuiteRun:
    """Run scenario files with all their variations, with one ego or several, and write the page.

    Killed at any moment and called again, it resumes: what has been run with the same settings and
    unchanged files is kept. No result depends on the number of workers.

    Returns:
        The results, with maps and page. An entry that cannot run is one of them, with its problem.

    Raises:
        InputError: no scenario is found, or an argument breaks a rule.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    from bridgegen.jobs.suite.maps import map_suite
    from bridgegen.jobs.suite.page import write_suite_page

    suite = evaluate_suite(**vars(given))
    maps = map_suite(suite, given.callbacks) if given.with_maps else ()
    given.callbacks.stage("page")
    return replace(suite, maps=maps, page=write_suite_page(suite, suite.jobs, maps=maps))


@called_with(SuiteOptions)
def evaluate_suite(given: SuiteOptions) -> SuiteRun:
    """Run scenario files with all their variations; as `run_suite`, without maps and page.

    Returns:
        The results. An entry that cannot run is one of them, with its problem.

    Raises:
        InputError: no scenario is found, or an argument breaks a rule.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    if given.assessor is None:
        return run_entries(SUITE, given)
    from bridgegen.jobs.suite.sealed import assess

    return assess(given, given.assessor)


def run_entries(
    job: frame.Job, given: ScenariosOptions, draw: Draw | None = None, file: str = FILE
) -> SuiteRun:
    """Run scenario files with all their variations; see `run_suite`.

    Args:
        job: for which; its command repeats this.
        given: its options.
        draw: what an assessor's key draws in place of the variations.
        file: of the results, in the folder.

    Returns:
        The results. An entry that cannot run is one of them, with its problem.

    Raises:
        InputError: no scenario is found, or an argument breaks a rule.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    files = [given.files] if isinstance(given.files, str | Path) else list(given.files)
    simulator = given.simulator if isinstance(given, SuiteOptions) else EMBEDDED
    check(given, simulator)
    name = given.of_each.driver_name
    entries = of_edition(find_entries(files), given.matrix)
    drivers = tuple(dict.fromkeys(given.egos)) or ("",)
    folder = Path(given.out) if given.out is not None else default_folder(files)
    settings = settings_of(given, simulator) | ({"driver_name": name} if name else {})
    settings |= {"secret": draw.secret, "drawn": draw.number} if draw else {}
    jobs = [
        Job(
            entry,
            ego or None,
            given.of_each,
            simulator,
            given.samples,
            given.seed,
            given.matrix,
            draw=draw,
            repeats=given.repeats or 1,
        )
        for entry in entries
        for ego in drivers
    ]
    path = folder / file
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
    # Two processes would append to one file, and each would run all that the other has not ended.
    lock = Lock(folder / LOCK)
    try:
        done = _done(path, settings, jobs)
        waiting = [job for job in jobs if (job.entry.name, job.ego or "") not in done]
        given.callbacks.compile()
        _run(waiting, given, path, done, len(jobs))
    except KeyboardInterrupt:
        done = _done(path, settings, jobs)
        again = frame.command_of(job.name, given, folder)
        raise Interrupted(folder, len(done), len(jobs), what="entries", command=again) from None
    finally:
        lock.release()
    results = tuple(done[job.entry.name, job.ego or ""] for job in jobs)
    tables = [table for item in files if (table := pack_tables().get(str(item))) is not None]
    left = tuple(clause for table in tables for clause in table.unanswered)
    return SuiteRun(folder, drivers, results, settings, tuple(jobs), unanswered=left)


def read_suite(folder: Path) -> SuiteRun:
    """Return the results in a folder, finished or not.

    Raises:
        StorageError: there are none, or they are damaged.
    """
    header, results, _ = _read(folder / FILE)
    if header is None:
        raise StorageError(f"{folder}: holds no results of a suite ({FILE})")
    egos = tuple(dict.fromkeys(result.ego for result in results))
    return SuiteRun(folder, egos, tuple(results), header.settings)


def check(given: ScenariosOptions, simulator: SimulatorChoice) -> None:
    """Refuse options that cannot be run.

    Raises:
        InputError: a number is out of range, or a driver or vehicle unknown.
    """
    problems = range_problems(given)
    for name in given.egos:
        egos.get(name, (), given.time_limit)
    if given.vehicle is not None:
        vehicles.require(given.vehicle)
        if given.vehicle != vehicles.KINEMATIC and simulator.name != EMBEDDED.name:
            problems.append(
                f"the vehicle '{given.vehicle}' is of the embedded simulator; {simulator.name} "
                f"moves the ego in its own way (--vehicle {vehicles.KINEMATIC})"
            )
    if given.of_each.driver_name is not None:
        checked_name(given.of_each.driver_name)
        if len(given.egos) != 1:
            problems.append(f"--name names one driver (--ego), got {len(given.egos)}")
    if problems:
        raise InputError(*problems)


def default_folder(files: Sequence[str | Path]) -> Path:
    """Return the folder of results by default: none of those that hold the scenarios."""
    names = [Path(file).resolve().stem for file in files]
    folder = Path("suites") / ("-".join(names[:3]) + ("-and-more" if len(names) > 3 else ""))
    # A folder of scenarios in `suites` would be its own folder of results.
    if folder.resolve() in {Path(file).resolve() for file in files}:
        return folder.with_name(f"{folder.name}-results")
    return folder


def settings_of(options: ScenariosOptions, simulator: SimulatorChoice) -> dict[str, Any]:
    """Return what results depend on besides the files, as JSON's types."""
    return {
        "samples": options.samples,
        "matrix": options.matrix,
        "seed": options.seed,
        "simulator": simulator.name,
        "simulator_settings": dict(simulator.settings),
        "criteria": [dict(criterion) for criterion in options.criteria],
        "critical": options.critical,
        "objective": None,  # each scenario's own; earlier versions took one for all
        "count": options.count,
        "ideal": list(options.ideal),
        "vehicle": options.vehicle,
        "others": options.others,
        "empty_trigger": options.empty_trigger,
        "time_limit": options.time_limit,
        "version": version("bridgegen"),
        **({} if options.odd is None else {"odd": options.odd}),
        **({} if options.repeats is None else {"repeats": options.repeats}),
    }


def _run(
    jobs: Sequence[Job],
    given: ScenariosOptions,
    path: Path,
    done: dict[tuple[str, str], EntryResult],
    total: int,
) -> None:
    """Run entries, and append each result to the file as it is there."""
    at_once = min(given.workers or cores(), len(jobs))
    number: Counter[str] = Counter()

    def show() -> None:
        facts = [
            f"{number[name]} {name}" for name in ("flaky", "not judged", "not run") if number[name]
        ]
        facts = [f"{number['failed']} failed", *facts]
        given.callbacks.progress("scenarios", len(done), total, ", ".join(facts))

    show()

    def ended(job: Job, result: EntryResult | None, crash: str | None) -> None:
        if result is None:
            # Without a digest: a worker that crashed is run again by the next call, see
            # `Job.is_of`.
            result = EntryResult(
                entry=job.entry.name,
                ego=job.ego or "",
                digest="",
                scenario=job.entry.scenario,
                distribution=job.entry.distribution or "",
                problem=crash or "",
            )
        done[job.entry.name, job.ego or ""] = result
        _append(path, result.model_dump_json() + "\n")
        number[result.verdict] += 1
        show()

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
        # A line a result, synced: what was run is kept whatever happens; a torn last line is
        # dropped by `_read`.
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
    # Through JSON, as the file has them: tuples are lists there.
    if header.settings != json.loads(json.dumps(settings)):
        other = [name for name in settings if header.settings.get(name) != settings[name]]
        raise StorageError(
            f"{path.parent}: holds the results of a suite with other settings "
            f"({', '.join(other)}); choose another folder with --out"
        )
    wanted = {(job.entry.name, job.ego or ""): job for job in jobs}
    found = {}
    for result in results:
        job = wanted.get((result.entry, result.ego))
        # Earlier versions did not record what happened: such an entry is run again.
        is_whole = {"not_happened", "outside"} <= result.model_fields_set
        if job is not None and job.is_of(result) and is_whole:
            found[result.entry, result.ego] = result
    if torn or len(found) < len(results):  # what has changed is run again, and said once
        lines = [header.model_dump_json(), *(result.model_dump_json() for result in found.values())]
        write_whole(path, [("\n".join(lines) + "\n").encode()])
    return found


def _read(path: Path) -> tuple[Header | None, list[EntryResult], bool]:
    """Return the header and the results in a file, and whether its last line has no end.

    Such a line, of a process that was killed as it wrote, is left out.

    Raises:
        StorageError: it cannot be read, or is damaged.
    """
    try:
        # A results file may come from others: its size is bounded before it is read.
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
        for result in results:
            for criterion in result.criteria:
                read_criterion(criterion)
            for clause in result.clauses:
                read_clause(clause)
    except ValidationError as error:
        first = error.errors(include_input=False, include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise StorageError(f"{path}: is damaged: {where}: {first['msg']}") from None
    except (InputError, ValueError) as error:
        raise StorageError(f"{path}: is damaged: {error}") from None
    return header, results, bool(rest)
