"""A suite that grows: failures are kept in its folder, one for each mode, that fail there, too."""

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import numpy as np

from bridgegen.assess.cause import CAUSES, Cause
from bridgegen.base.errors import BridgeGenError, InputError, StorageError
from bridgegen.drivers import is_spec
from bridgegen.engine.options import CommonOptions
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.suite.entries import RESULTS, Entry
from bridgegen.jobs.suite.evaluate import Job, pipeline_of, rows_of_job
from bridgegen.jobs.suite.failing import (
    NO_KEY,
    Failing,
    NotFailing,
    Way,
    failing_in,
    seeking_causes,
    ways,
)
from bridgegen.jobs.suite.replay import slug
from bridgegen.results.failures import MOST_TEXT, Failure, read_failures, write_failures
from bridgegen.results.store.run_file import FILE as RUN_FILE
from bridgegen.scenario.language.criteria import CriterionSection
from bridgegen.search.triage.modes import Key
from bridgegen.simulation.choice import EMBEDDED

Outcome = Literal["added", "replaced", "known", "worse", "refused"]

MINIMAL = "-minimal"
"""Ending of the name of a minimal form."""

_STAGING = ".adding"
_CAUSES = tuple(cause.label for cause in CAUSES)


@dataclass(frozen=True)
class Addition:
    """The outcome of adding a failure.

    Attributes:
        source: where it was found, for people.
        outcome: "known": its mode is kept already; "worse": likewise, by a less severe scenario,
            which stays.
        id: of the failure; empty if it is refused.
        title: in words.
        status: that a person gave a known one.
        reason: why it is refused; or what one should know.
        is_same: whether all values are the recorded ones, to the bit.
    """

    source: str
    outcome: Outcome
    id: str = ""
    title: str = ""
    status: str = ""
    reason: str = ""
    is_same: bool = False


class _Refused(Exception):
    """A scenario does not fail as it should in the suite's folder."""


def add_failures(
    given: Sequence[Path | str],
    to: Path,
    *,
    egos: Sequence[str] = (),
    replace_worse: bool = False,
    progress: Callable[[Addition], None] = lambda item: None,
) -> tuple[Addition, ...]:
    """Keep failures in the folder of a suite that grows.

    Of each failure mode that is not there yet: the scenario that stands for it, its minimal form,
    their maps, and a block in the index. Each must fail there as it did where it was found.

    Args:
        given: folders of runs or of suites' results; or scenarios.
        to: the folder; made if there is none.
        egos: see `failing_in`.
        replace_worse: replace the scenario of a known mode by one with more harm.
        progress: called with each outcome.

    Raises:
        InputError: nothing is found in what is given, or a driver that is code must be named.
        FileFormatError: the index is damaged.
        StorageError: a run or results are damaged, or the folder cannot be written.
    """
    if held := [name for name in (RESULTS, RUN_FILE) if (to / name).exists()]:
        raise StorageError(f"{to}: holds results ({held[0]}); choose another folder with --to")
    read_failures(to)  # refuses a damaged one before anything is run
    made = []
    for path in given:
        inside = Path(path).resolve()
        if inside.exists() and to.resolve() in (inside, inside.parent):
            raise InputError(f"{path}: is in the suite {to} already")
        for found in failing_in(path, egos):
            made.append(_add(found, to, replace_worse))
            progress(made[-1])
    return tuple(made)


def _add(found: Failing | NotFailing, to: Path, replace_worse: bool) -> Addition:
    if isinstance(found, NotFailing):
        return Addition(found.source, "refused", reason=found.reason)
    if Path(found.job.entry.scenario).resolve().parent == to.resolve():
        return Addition(found.source, "known", reason="it is a scenario of this suite")
    try:
        job = seeking_causes(found.job)
        way = _way(job)
        key = _agreed(found, way)
        id = identity(found.scenario, key, way)
        index = read_failures(to)
        before = index.failures.get(id)
        is_worse = before is not None and way.harm > before.harm
        if before is not None and not (is_worse and replace_worse):
            return Addition(
                found.source, "worse" if is_worse else "known", id, before.title, before.status
            )
        failure, notes, is_same = _kept(found, replace(way, key=key), id, to)
        if before is not None:
            # What people have decided on a failure outlives its worse form.
            own = {"status": before.status, "comment": before.comment}
            failure = failure.model_copy(update=own)
            for name in {*before.files} - {*failure.files}:
                _remove(to / name)
        try:
            write_failures(index, {id: failure})
        except BridgeGenError:
            for name in failure.files if before is None else ():
                _remove(to / name)
            raise
        outcome: Outcome = "added" if before is None else "replaced"
        return Addition(found.source, outcome, id, failure.title, failure.status, notes, is_same)
    except _Refused as error:
        return Addition(found.source, "refused", reason=str(error))
    except StorageError:
        raise
    except BridgeGenError as error:
        return Addition(found.source, "refused", reason="; ".join(error.problems))


def identity(scenario: str, key: Key, way: Way) -> str:
    """Return the id of a failure: of its scenario and mode, whatever found it and when."""
    ids = sorted(str(violate["id"]) for violate in way.violates)
    # Of the scenario and the mode alone, so that another run that finds the same mode finds the
    # failure known.
    parts = ["violates", *ids] if key == NO_KEY else list(key)
    digest = hashlib.sha256(json.dumps([scenario, *parts]).encode()).hexdigest()[:8]
    what = "-".join(parts[:2]) if key == NO_KEY else key.conflict_type
    return f"{slug(scenario)[:50]}-{slug(what)[:30]}-{digest}"


def _kept(found: Failing, way: Way, id: str, to: Path) -> tuple[Failure, str, bool]:
    """Write a failure's files into the suite's folder.

    Returns:
        Its block; what one should know of it; whether its values are the recorded ones, to the bit.

    Raises:
        _Refused: it does not fail there as it did.
        StorageError: the folder cannot be written.
    """
    stage, notes = to / _STAGING, [found.note] if found.note else []
    files, needs = [f"{id}.xosc"], "" if found.minimal else found.needs
    try:
        shutil.rmtree(stage, ignore_errors=True)
        # In a folder beside, moved when all is well: a refused failure leaves nothing in the suite.
        stage.mkdir(parents=True)
        there = _put(found.job, way, stage, id)
        is_same = _is_same(way, there.metrics) and _is_same(there, found.metrics)
        if not is_same:
            notes.append("it fails in the same way, but with other values than recorded")
        if found.minimal is not None:
            try:
                _put(found.minimal, way, stage, id + MINIMAL)
                files, needs = [*files, f"{id}{MINIMAL}.xosc"], found.needs
            except (_Refused, InputError) as error:
                _remove(stage / f"{id}{MINIMAL}.xosc")
                notes.append(f"without its minimal form: {error}")
        for file in sorted(stage.iterdir()):
            file.replace(to / file.name)
    except OSError as error:
        raise StorageError(f"{to}: cannot be written: {error.strerror}") from None
    finally:
        shutil.rmtree(stage, ignore_errors=True)
    key, metrics = way.key, there.metrics
    failure = Failure(
        title=_cut(way.title),
        scenario=_cut(found.scenario),
        conflict=key.conflict,
        type=key.conflict_type,
        responsible=key.responsible,
        rule=way.rule,
        partner=key.partner,
        place=key.place,
        cause=key.cause,
        minimal=_cut(needs),
        note=found.note,
        violates=[CriterionSection.model_validate(violated) for violated in way.violates],
        count="any" if found.job.options.count == "any" else "ego",
        driver=_cut(way.driver),
        found=found.found,
        seed=found.seed,
        version=version("bridgegen"),
        harm=there.harm,
        severity=float(np.nan_to_num(metrics["severity"])),
        files=files,
    )
    return failure, "; ".join(notes), is_same


def _cut(text: str) -> str:
    """Return a text, which may come from a file, as long as an index takes it."""
    return text if len(text) <= MOST_TEXT else f"{text[: MOST_TEXT - 1]}…"


def _put(job: Job, way: Way, folder: Path, name: str) -> Way:
    """Write the one row of a job as a scenario with its map; return how it fails there.

    Raises:
        _Refused: not in that way.
        OntologyError: its individuals break a rule.
        OSError: the folder cannot be written.
    """
    pipeline = pipeline_of(job)
    cause = Cause.named(way.key.cause) if way.key.cause in _CAUSES else Cause.NONE
    write_scenario(pipeline, rows_of_job(job, pipeline)[0], folder, name, cause)
    (folder / f"{name}.owl").unlink(missing_ok=True)
    ego = job.ego if job.ego is not None and is_spec(job.ego) else None  # else the file names it
    options = CommonOptions(
        ideal=job.options.ideal if ego else (),
        vehicle=pipeline.runner.vehicle if ego else None,
        time_limit=job.options.time_limit,
    )
    count: Literal["any"] | None = "any" if pipeline.objective.count == "any" else None
    entry = Entry(name, str(folder / f"{name}.xosc"), criteria=way.violates, count=count)
    there = _way(seeking_causes(Job(entry, ego, options, EMBEDDED, 0, 0)))
    if way.key.way != there.key.way:
        raise _Refused(f"it fails otherwise in {folder.parent}: {_other(way.key, there.key)}")
    missing = {str(violate["id"]) for violate in way.violates} - {
        str(violate["id"]) for violate in there.violates
    }
    if missing and name.endswith(MINIMAL) and way.key != NO_KEY:
        missing = set()  # it needs to fail in its mode alone
    if missing:
        raise _Refused(f"it does not violate {', '.join(sorted(missing))} in {folder.parent}")
    return there


def _is_same(way: Way, metrics: Mapping[str, float]) -> bool:
    """Return whether metrics are those of a row to the bit, as far as both are known."""
    both = way.metrics.keys() & metrics.keys()
    return all(
        way.metrics[name] == metrics[name] for name in both if metrics[name] == metrics[name]
    )


def _remove(scenario: Path) -> None:
    for path in (scenario, scenario.with_suffix(".xodr"), scenario.with_suffix(".owl")):
        path.unlink(missing_ok=True)


def _way(job: Job) -> Way:
    """Return how the one row of a job fails.

    Raises:
        _Refused: it does not.
    """
    pipeline = pipeline_of(job)
    (way,) = ways(pipeline, rows_of_job(job, pipeline))
    if way.problem:
        raise _Refused(way.problem)
    return way


def _agreed(found: Failing, way: Way) -> Key:
    """Return the key of a failure, with the tested cause where there is one.

    Raises:
        _Refused: it fails in another way than where it was found.
    """
    if found.key is None:
        return way.key
    if found.key.way != way.key.way:
        raise _Refused(f"it fails otherwise than where it was found: {_other(found.key, way.key)}")
    return found.key


def _other(expected: Key, got: Key) -> str:
    pairs = zip(Key._fields, expected.way, got.way, strict=True)
    return ", ".join(f"{name} '{b}' instead of '{a}'" for name, a, b in pairs if a != b)
