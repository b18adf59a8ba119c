"""One variation of a suite again, to the bit: its files, its result and its page."""

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.drivers import is_spec
from bridgegen.engine.options import CommonOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.suite.drawn import Draw
from bridgegen.jobs.suite.entries import RESULTS, VARIATIONS, Entry, indexed
from bridgegen.jobs.suite.evaluate import Job, evaluate, pipeline_of, rows_of_job
from bridgegen.jobs.suite.results import EntryResult, RowResult, Strict
from bridgegen.jobs.suite.suite import SuiteRun, read_suite
from bridgegen.simulation.choice import SimulatorChoice, Value


class _Settings(Strict):
    """The settings of a suite, as `bridgegen.jobs.suite.suite` records them."""

    samples: int
    seed: int
    simulator: str
    simulator_settings: dict[str, Value]
    criteria: list[dict[str, Any]]
    critical: str | None
    objective: dict[str, float | None] | None
    count: str | None
    ideal: list[str]
    others: str | None
    empty_trigger: str | None
    time_limit: float | None
    matrix: str | None = None
    vehicle: str | None = None
    driver_name: str | None = None
    secret: str | None = None
    drawn: int = 0
    odd: dict[str, Any] | None = None
    repeats: int | None = None
    version: str


_ADAPTER = TypeAdapter(_Settings)


@dataclass(frozen=True)
class Replayed:
    """A variation that was run again.

    Attributes:
        number: of the variation, from 1 on.
        result: of the entry, with this one row.
        job: of which it is the result.
        files: its scenario as files, the ``.xosc`` last, which other tools run, too.
        folder: of these files, and of its page.
        command: that does all this again.
        is_same: whether the result is the recorded one, to the bit.
        is_same_exported: whether the exported file has that result, too, to the bit; by whichever
            rule it is critical.
    """

    number: int
    result: EntryResult
    job: Job
    files: tuple[Path, ...]
    folder: Path
    command: str
    is_same: bool
    is_same_exported: bool


def replay(
    folder: Path,
    entry: str,
    number: int,
    *,
    ego: str | None = None,
    out: Path | None = None,
    simulator: SimulatorChoice | None = None,
) -> Replayed:
    """Run one variation of a suite again, exactly, and export it.

    Its row is made as the suite made it, so that no digit is lost.

    Args:
        folder: of the suite's results.
        entry: the scenario, by its name in the suite.
        number: of the variation, from 1 on.
        ego: the driver, as the suite names it, where it has several or one of the user's own.
        out: folder for the files, ``variations/NAME`` in the suite's by default.
        simulator: the suite's, with its place on this machine; as recorded by default.

    Raises:
        StorageError: there are no such results, or the scenario is not what it was.
        InputError: no such variation, or the driver must be named.
        OntologyError: the scenario breaks a rule of the ontology, and is not exported.
    """
    suite = read_suite(folder)
    before = _result(suite, entry, ego)
    job = replace(job_of(suite, before, simulator), only=number - 1)
    # Another file under the same name would give another result.
    if job.entry.digest != before.digest:
        raise StorageError(
            f"{folder}: scenario {job.entry.distribution or job.entry.scenario} is not what it was "
            "when the suite was run; run the suite again, in the folder in which it was run"
        )
    if before.problem:
        raise InputError(f"{entry} has no variations, it did not run: {before.problem}")
    pipeline = pipeline_of(job)
    x = rows_of_job(job, pipeline)[0]
    result = evaluate(job)
    name = f"{slug(entry)}-{number}"
    target = out or folder / VARIATIONS / (f"{name}-{slug(before.ego)}" if before.ego else name)
    try:
        target.mkdir(parents=True, exist_ok=True)
        files = write_scenario(pipeline, x, target, name)
    except OSError as error:
        raise StorageError(f"{target}: cannot be written: {error.strerror}") from None
    return Replayed(
        number,
        result,
        job,
        tuple(files),
        target,
        replay_command(folder, before, number - 1),
        # Both are said: the same row again, and the exported file, which goes through writer and
        # reader.
        is_same=result.rows[0] == before.rows[number - 1],
        is_same_exported=_moves_alike(result.rows[0], _of_file(job, pipeline, files[-1])),
    )


def _of_file(job: Job, pipeline: Pipeline, file: Path) -> EntryResult:
    """Return the result of an exported scenario."""
    options = replace(
        job.options,
        criteria=[criterion.to_dict() for criterion in pipeline.monitor],
        critical=None,
        objective=None,
        count=pipeline.objective.count,
        others=None,
        empty_trigger=None,
        odd=None,
    )
    entry = Entry(file.stem, str(file))
    return evaluate(replace(job, entry=entry, options=options, only=None, draw=None))


def _moves_alike(row: RowResult, exported: EntryResult) -> bool:
    """Return whether results are equal but for values, clauses and the rule of what is critical."""
    bare = {
        "x": [],
        "critical": False,
        "clauses": "",
        "fails": 0,
    }  # a file states neither rule nor clauses
    rows = exported.rows
    return len(rows) == 1 and rows[0].model_copy(update=bare) == row.model_copy(update=bare)


def replay_command(folder: Path, entry_result: EntryResult, row: int) -> str:
    """Return the command that runs a variation again, by its row from 0 on."""
    words = ["bridgegen", "suite", "replay", str(folder), entry_result.entry, str(row + 1)]
    return shlex.join([*words, *(["--ego", entry_result.ego] if entry_result.ego else [])])


def job_of(suite: SuiteRun, result: EntryResult, simulator: SimulatorChoice | None = None) -> Job:
    """Return the job of which a suite recorded a result.

    Raises:
        StorageError: the suite's settings are damaged.
        InputError: another simulator than the suite's is given.
    """
    try:
        settings = _ADAPTER.validate_python(suite.settings)
    except ValidationError as error:
        first = error.errors(include_input=False, include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise StorageError(
            f"{suite.folder / RESULTS}: is damaged: settings.{where}: {first['msg']}"
        ) from None
    if simulator is not None and simulator.name != settings.simulator:
        raise InputError(
            f"{suite.folder}: the simulator of this suite must be {settings.simulator}, got "
            f"{simulator.name}"
        )
    options = CommonOptions(
        criteria=settings.criteria,
        critical=settings.critical,
        objective=settings.objective,
        count=settings.count,
        driver_name=settings.driver_name,
        ideal=settings.ideal,
        vehicle=settings.vehicle,
        others=settings.others,
        empty_trigger=settings.empty_trigger,
        time_limit=settings.time_limit,
        odd=settings.odd,
    )
    entry = indexed(Entry(result.entry, result.scenario, result.distribution or None))
    chosen = SimulatorChoice(
        settings.simulator, settings.simulator_settings, simulator.access if simulator else {}
    )
    return Job(
        entry,
        result.ego or None,
        options,
        chosen,
        settings.samples,
        settings.seed,
        settings.matrix,
        draw=Draw(settings.secret, settings.drawn) if settings.secret else None,
        repeats=settings.repeats or 1,
    )


def refuse_code(results: Sequence[EntryResult], named: Sequence[str], command: str) -> None:
    """Refuse drivers that are code and that only the file of results names.

    Raises:
        InputError: which they are, and how to name them.
    """
    # A file of results may come from others: code that only it names is not imported unasked.
    code = {result.ego for result in results if is_spec(result.ego)} - {*named}
    if code:
        raise InputError(
            *(
                f"the ego is driven by {name}, which is code; to run it, name it: "
                f"{command} --ego {shlex.quote(name)}"
                for name in sorted(code)
            )
        )


def slug(text: str) -> str:
    """Return a text as a part of a file's name."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")[:60] or "scenario"


def _result(suite: SuiteRun, entry: str, ego: str | None) -> EntryResult:
    """Return the result of an entry with an ego."""
    found = [result for result in suite.results if result.entry == entry]
    if not found:
        raise UnknownNameError(
            f"scenario of {suite.folder}", entry, {result.entry for result in suite.results}
        )
    if ego is not None:
        if ego not in (names := [result.ego for result in found if result.ego]):
            raise UnknownNameError(f"driver of {suite.folder}", ego, names)
        return next(result for result in found if result.ego == ego)
    if len(found) > 1:
        egos = ", ".join(result.ego for result in found)
        raise InputError(f"{entry} was run with several drivers: name one with --ego: {egos}")
    refuse_code(found, (), f"bridgegen suite replay {suite.folder} {entry}")
    return found[0]
