"""Failures for a suite that grows: where they are found, and in which way each fails."""

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.arrays import Float
from bridgegen.base.errors import BridgeGenError, InputError, UnknownNameError
from bridgegen.drivers import is_spec
from bridgegen.engine.options import CommonOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.exported import FOLDER, exported_scenarios, read_facts
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.suite.entries import RESULTS, Entry, find_entries
from bridgegen.jobs.suite.evaluate import Job, evaluate, pipeline_of, rows_of_job
from bridgegen.jobs.suite.options import SAMPLES
from bridgegen.jobs.suite.replay import job_of, refuse_code
from bridgegen.jobs.suite.results import EntryResult
from bridgegen.jobs.suite.suite import read_suite
from bridgegen.openx.file_scenario import FileScenario
from bridgegen.openx.openscenario.declarations import CAUSE
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.results.store.run_file import FILE as RUN_FILE
from bridgegen.scenario.language.criteria import PREFIX
from bridgegen.search.triage.modes import Key, keys_of, title
from bridgegen.search.triage.record import Mode
from bridgegen.simulation.choice import EMBEDDED
from bridgegen.simulation.rollout import STATUS_MESSAGES

# --- How a row fails: in which failure mode, and which pass criteria it violates ---


NO_KEY = Key("", "", "", "", "")
"""Key of a scenario that is no failure by its conflict, but violates pass criteria."""


@dataclass(frozen=True)
class Way:
    """How a row fails.

    Attributes:
        key: of its mode; NO_KEY where it only violates criteria.
        rule: label of the rule that decides on the responsibility; "" likewise.
        violates: the criteria that it violates, as `Criterion.to_dict` gives them.
        metrics: by name, all that are recorded.
        harm: that counts.
        title: in words.
        driver: that drove the ego, by name.
        problem: why it does not fail; empty if it does.
    """

    key: Key
    rule: str
    violates: tuple[Mapping[str, Any], ...]
    metrics: Mapping[str, float]
    harm: float
    title: str
    driver: str
    problem: str = ""


def ways(pipeline: Pipeline, X: Float) -> list[Way]:
    """Return how rows fail: by harm, as a triage has it, or by pass criteria alone.

    Args:
        pipeline: with the quick causes.
        X: ``(N, len(pipeline.space.names))``.
    """
    found = pipeline.evaluate(X)
    places = pipeline.try_all(X).place.tolist()
    causes = [""] * len(X) if found.cause is None else [Cause(k).label for k in found.cause]
    keys = keys_of(found.findings, pipeline.runner.kinds, places, causes)
    margins = found.metrics[:, [pipeline.metrics.index(name) for name in pipeline.monitor.names]]
    made = []
    for i, key in enumerate(keys):
        metrics = dict(zip(pipeline.metrics, found.metrics[i].tolist(), strict=True))
        harm = float(np.nan_to_num(metrics[pipeline.objective.harm]))
        violates = tuple(
            criterion.to_dict()
            for criterion, margin in zip(pipeline.monitor, margins[i], strict=True)
            if margin < 0.0
        )
        problem, rule = "", str(found.findings.rule[i])
        if found.status[i]:
            text = STATUS_MESSAGES[int(found.status[i])]
            problem = ": ".join(filter(None, (text, found.messages.get(i, ""))))
        elif harm < NEAR_MISS or found.findings.implausible[i]:
            key, rule = NO_KEY, ""
            if not violates:
                why = found.findings.implausible[i]
                problem = f"it is no failure of the ego: harm {harm:.2g} of {NEAR_MISS:g}"
                problem = f"its traffic is implausible: {why}" if why else problem
        ids = ", ".join(violate["id"] for violate in violates)
        words = f"violates {ids}"
        if key is not NO_KEY:
            left = pipeline.runner.left_hand
            words = title(key, [rule], pipeline.objective.count, left_hand=left)
        made.append(Way(key, rule, violates, metrics, harm, words, pipeline.driver.label, problem))
    return made


def seeking_causes(job: Job) -> Job:
    """Return a job whose pipeline is the embedded simulator's, and finds quick causes."""
    return replace(job, options=replace(job.options, causes=True), simulator=EMBEDDED)


OURS = "BridgeGen"
"""The author of the files that are exported here."""


@dataclass(frozen=True)
class Failing:
    """A scenario that was found to fail.

    Attributes:
        source: where, for people: "runs/a, 0001".
        job: runs it; one row.
        scenario: in which it was found, by name, and the map if it was found on one.
        found: what found it, in words.
        seed: of the search or suite, if there was one.
        key: of its mode, with the tested cause, where a triage says; None: to be found out.
        metrics: as recorded, by name; empty where they are not.
        minimal: runs its minimal form, if there is one.
        needs: what that needs, in words.
        note: what makes the verdict doubtful; "" if nothing is known to.
    """

    source: str
    job: Job
    scenario: str
    found: str
    seed: int | None = None
    key: Key | None = None
    metrics: Mapping[str, float] = field(default_factory=dict)
    minimal: Job | None = None
    needs: str = ""
    note: str = ""


@dataclass(frozen=True)
class NotFailing:
    """What is no failure to keep.

    Attributes:
        source: where, for people.
        reason: why not.
    """

    source: str
    reason: str


def failing_in(given: Path | str, egos: Sequence[str]) -> Iterator[Failing | NotFailing]:
    """Yield the failures in a run, in a suite's results, or among scenarios; the worst of a mode.

    Args:
        given: folder of a run or of a suite's results; or scenarios, as
            `bridgegen.jobs.suite.entries.find_entries` takes them.
        egos: of scenarios, their drivers; of a suite, those whose failures count; of a run, its
            driver. A driver of the user's own must be named.

    Raises:
        InputError: nothing is found there, or a driver that is code must be named.
        StorageError: a run or results are damaged.
    """
    folder = Path(given)
    if (folder / RUN_FILE).is_file():
        yield from _of_run(folder, egos)
    elif folder.parent.name == FOLDER and (folder.parent.parent / RUN_FILE).is_file():
        yield from _of_run(folder.parent.parent, egos, folder.stem)
    elif (folder / RESULTS).is_file():
        yield from _of_suite(folder, egos)
    else:
        for entry in find_entries([given]):
            for ego in egos or (None,):
                job = Job(entry, ego, CommonOptions(), EMBEDDED, SAMPLES, 0)
                yield from _of_rows(job, evaluate(job), entry.distribution or entry.scenario)


# ---- of a run ----


def _of_run(
    folder: Path, egos: Sequence[str], only: str | None = None
) -> Iterator[Failing | NotFailing]:
    """Yield the failures of a run, of each mode the scenario that stands for it.

    Args:
        folder: of the run.
        egos: see `failing_in`.
        only: the name of one exported scenario, of which alone it is asked.
    """
    run = Run(folder)
    if run.triage is None:
        raise InputError(
            f"{folder}: its failure modes are not known yet; finish it: bridgegen resume {folder}"
        )
    settings = run.settings
    code = is_spec(settings.ego)
    if code and not egos:
        raise InputError(
            f"{folder}: its ego is driven by {settings.ego}, which is code; to run it, name it: "
            f"--ego {shlex.quote(settings.ego)}"
        )
    if egos and settings.ego not in egos:
        given = ", ".join(egos)
        raise InputError(f"{folder}: the ego of this run must be {settings.ego}, got {given}")
    ego = settings.ego if code else None
    options = CommonOptions(
        criteria=settings.criteria,
        count=run.triage.count,
        ideal=settings.ideal if ego else (),
        vehicle=settings.vehicle,
    )
    exported = {item.name: item.evaluation for item in exported_scenarios(folder)}
    moded = {name for mode in run.modes for name in mode.exports}

    def failing(name: str, found: str) -> Failing:
        path = folder / FOLDER / f"{name}.xosc"
        return Failing(
            f"{folder}, {name}",
            Job(Entry(name, str(path)), ego, options, EMBEDDED, 0, 0),
            scenario=scenario,
            found=f"search by {settings.algorithm}, {found}",
            seed=settings.seed,
            note=run.triage.doubts(exported.get(name, -1)) if run.triage else "",
        )

    scenario = searched_scenario(run.triage.scenario, settings.road_map)
    for mode in run.modes:
        found = _of_mode(folder, mode, failing, exported, only)
        if found is not None:
            yield found
    for name, evaluation in exported.items():
        if name in moded or only not in (None, name):
            continue
        metrics = _recorded(folder, name)
        violates = any(key.startswith(PREFIX) and metric < 0.0 for key, metric in metrics.items())
        if violates or name == only:
            made = failing(name, f"evaluation {evaluation + 1}")
            yield replace(made, metrics=metrics)


def searched_scenario(name: str, road_map: Path | str | None) -> str:
    """Return what failures call the scenario of a run: its name, and the map if it is on one."""
    return f"{name} on {Path(road_map).stem}" if road_map else name


def _of_mode(
    folder: Path,
    mode: Mode,
    failing: Callable[[str, str], Failing],
    exported: Mapping[str, int],
    only: str | None,
) -> Failing | NotFailing | None:
    """Return what stands for a mode: its worst robust exported scenario, else its minimal one.

    None if only another scenario is asked for.
    """
    key = Key(
        mode.conflict,
        mode.conflict_type,
        mode.responsible,
        mode.partner,
        mode.place,
        mode.cause,
    )
    kept = [name for name in mode.exports if name in exported]
    minimal = mode.minimal
    if minimal is None or not (folder / FOLDER / f"{minimal.name}.xosc").is_file():
        minimal = None
    if only not in (None, *kept, minimal.name if minimal else None):
        return None
    if not kept:
        if minimal is None:
            why = "no scenario of it was exported; search again, and --keep more"
            return NotFailing(f"{folder}, mode {mode.number}", why)
        made = failing(minimal.name, f"minimal form of evaluation {mode.shown + 1}")
        # The row's own metrics are not those of its minimal form.
        metrics = {"harm": minimal.harm, "severity": minimal.severity}
        return replace(made, key=key, metrics=metrics, needs=minimal.sentence)
    name = only if only in kept else kept[0]
    assert name is not None
    made = failing(name, f"evaluation {exported[name] + 1}")
    made = replace(made, key=key, metrics=_recorded(folder, name))
    if minimal is None:
        return made
    return replace(made, minimal=failing(minimal.name, "minimal form").job, needs=minimal.sentence)


def _recorded(folder: Path, name: str) -> dict[str, float]:
    """Return the metrics of an exported scenario as the run recorded them, as far as finite."""
    facts = read_facts(folder / FOLDER / f"{name}.json")
    return {key: metric.value for key, metric in facts.metrics.items() if metric.value is not None}


# ---- of a suite, and of files ----


def _of_suite(folder: Path, egos: Sequence[str]) -> Iterator[Failing | NotFailing]:
    suite = read_suite(folder)
    known = [name for name in suite.egos if name]
    for ego in egos:
        if ego not in known:
            raise UnknownNameError(f"driver of {folder}", ego, known)
    results = [result for result in suite.results if not egos or result.ego in egos]
    refuse_code(results, egos, f"bridgegen suite add {folder}")
    for result in results:
        job = job_of(suite, result)
        source = f"{folder}, {result.entry}"
        if result.verdict == "failed" and job.entry.digest != result.digest:
            yield NotFailing(source, "it is not what it was when the suite was run")
        elif result.verdict == "failed":
            yield from _of_rows(job, result, source)


def _of_rows(job: Job, result: EntryResult, source: str) -> Iterator[Failing | NotFailing]:
    """Yield the worst failing row of each mode of an entry."""
    failed = [i for i, row in enumerate(result.rows) if row.verdict == "failed"]
    if result.problem or not failed:
        yield NotFailing(source, result.problem or "no variation of it fails")
        return
    job = seeking_causes(job)
    try:
        pipeline = pipeline_of(job)
        X = rows_of_job(job, pipeline)[failed]
        found = ways(pipeline, X)
    except BridgeGenError as error:
        yield NotFailing(source, "; ".join(error.problems))
        return
    seen = set()
    several = len(result.rows) > 1
    # The worst of each mode; of equal ones the first variation.
    order = sorted(range(len(failed)), key=lambda k: (-found[k].harm, failed[k]))
    for k in order:
        way, number = found[k], failed[k] + 1
        if (same := (way.key, tuple(violate["id"] for violate in way.violates))) in seen:
            continue
        seen.add(same)
        where = f"{source}, variation {number}" if several else source
        if way.problem:
            yield NotFailing(where, way.problem)
            continue
        is_file = is_storyboard(job.entry.scenario)
        yield Failing(
            where,
            replace(job, only=failed[k]),
            scenario=scenario_name(pipeline),
            found=f"suite, variation {number} of {len(result.rows)}" if several else "suite",
            seed=None if is_file else job.seed,
            metrics=way.metrics,
            key=_stated(job, pipeline, way.key) if way.key is not NO_KEY else None,
        )


def scenario_name(pipeline: Pipeline) -> str:
    """Return the scenario's name; of a file that BridgeGen exported, that of the searched one."""
    if isinstance(pipeline.scenario, FileScenario):
        # A file that was exported here says in its header which scenario was searched, so a failure
        # found again has the same id.
        header = pipeline.scenario.storyboard.file_header
        if str(header.author) == OURS and str(header.description):
            return str(header.description)
    return pipeline.scenario.name


def _stated(job: Job, pipeline: Pipeline, key: Key) -> Key:
    """Return a key with the cause that a file states of its own driver: neighbours tested it."""
    if job.ego is not None or not isinstance(pipeline.scenario, FileScenario):
        return key
    properties = pipeline.scenario.storyboard.file_header.properties
    stated = properties.get(CAUSE) if properties is not None else None
    return key if stated is None else key._replace(cause=str(stated))
