"""Searches of a suite's scenarios for where one ego is worse than another."""

import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from bridgegen.base.errors import BridgeGenError, InputError, Interrupted
from bridgegen.engine.options import SearchOptions
from bridgegen.jobs.search import Run, resume, run_search
from bridgegen.jobs.search.campaign import SearchCallbacks
from bridgegen.jobs.suite.evaluate import Job, pipeline_of
from bridgegen.jobs.suite.rows import is_sample
from bridgegen.jobs.suite.suite import SuiteRun
from bridgegen.results.store.run_file import FILE
from bridgegen.search.triage.record import NOT_JUDGED

FOLDER = "worse"
"""In a suite's folder, that of the searches, a run each."""

BUDGET = 300
"""Evaluations of a search, each with both egos."""

ALGORITHM = "es"
"""It finds the most failure modes with few evaluations; see docs/decisions/search.md."""


@dataclass(frozen=True)
class WorseThan:
    """What a search of one scenario found.

    Attributes:
        entry: of the suite, by name.
        folder: of the run; its report has the playback of both egos.
        evaluations: that were made.
        worse: those that the second ego fails and the first passes.
        modes: the titles of the failure modes that they make up, the worst first.
        sentence: the finding in words, with the share of the space.
        problem: why there is no result; else empty.
    """

    entry: str
    folder: Path
    evaluations: int = 0
    worse: int = 0
    modes: tuple[str, ...] = ()
    sentence: str = ""
    problem: str = ""


@dataclass(frozen=True)
class WorseCallbacks:
    """Called as searches progress, all from the same thread.

    Attributes:
        begun: with the name of the entry that is searched next, its number from 0, and how many
            there are.
        batch: with the evaluations of that search so far.
    """

    begun: Callable[[str, int, int], None] = lambda entry, number, count: None
    batch: Callable[[int], None] = lambda evaluations: None


def search_worse(
    suite: SuiteRun,
    egos: tuple[str, str],
    *,
    budget: int = BUDGET,
    seed: int = 0,
    callbacks: WorseCallbacks | None = None,
) -> tuple[WorseThan, ...]:
    """Search each scenario of a suite for where the second ego fails and the first does not.

    Only scenarios whose rows are a sample of a space are searched, logical ones say: of all others
    the suite has run each variation. A search that was stopped is resumed.

    Args:
        suite: that both egos have run, with its jobs.
        egos: the one that is compared with, then the other.
        budget: evaluations of each search; 0: nothing is searched.
        seed: of each search.
        callbacks: called as they progress.

    Returns:
        Of each searched scenario what was found, in the order of the suite.

    Raises:
        Interrupted: Ctrl-C; what is done is kept.
        StorageError: a folder cannot be written.
    """
    callbacks = callbacks or WorseCallbacks()
    if not budget:
        return ()
    first, second = egos
    runs = {(one.entry, one.ego): one for one in suite.results}
    jobs = [
        job
        for job in suite.jobs
        if job.ego == second
        and not any(runs[job.entry.name, ego].problem for ego in egos)
        and _is_searched(job)
    ]
    found = []
    for number, job in enumerate(jobs):
        callbacks.begun(job.entry.name, number, len(jobs))
        found.append(_searched(job, first, suite.folder / FOLDER, budget, seed, callbacks))
    return tuple(found)


def _is_searched(job: Job) -> bool:
    pipeline = pipeline_of(job)
    return bool(pipeline.space.n_var) and is_sample(pipeline.scenario)


def _searched(
    job: Job, first: str, home: Path, budget: int, seed: int, callbacks: WorseCallbacks
) -> WorseThan:
    """Search one scenario, resume the search, or read what it found."""
    options = SearchOptions.of(
        job.options, ego=job.ego, worse_than=first, distribution=job.entry.distribution,
        algorithm=ALGORITHM, budget=budget, seed=seed, simulator=job.simulator, causes=True,
    )  # fmt: skip
    how = SearchCallbacks(batch=lambda progress: callbacks.batch(progress.evaluations))
    name = job.entry.name
    folder = home / _folder_name(job, replace(job, ego=first), options)
    try:
        if not (folder / FILE).exists():
            run = run_search(job.entry.scenario, **vars(options), out=folder, callbacks=how)
        elif not (run := Run(folder)).report.exists():
            run = resume(folder, ego=job.ego, worse_than=first, callbacks=how)
    except Interrupted:
        raise
    except InputError as error:
        return WorseThan(name, folder, problem="; ".join(error.problems))
    except BridgeGenError as error:
        return WorseThan(name, folder, problem=str(error))
    triage, summary = run.triage, run.summary
    if run.verdict == NOT_JUDGED and triage is not None and not summary.critical:
        return WorseThan(name, folder, summary.evaluations, problem=triage.bound.sentence)
    sentence = triage.bound.sentence if triage else ""
    if triage is None or triage.bound.harmful != summary.critical:  # critical by another rule
        words = f"{summary.critical} of {summary.evaluations} evaluations are critical"
        sentence = "; ".join(filter(None, (f"{words} with {job.ego} alone", sentence)))
    modes = tuple(one.title for one in triage.modes) if triage else ()
    return WorseThan(name, folder, summary.evaluations, summary.critical, modes, sentence)


def _folder_name(job: Job, first: Job, options: SearchOptions) -> str:
    """Return a name that is another one for each scenario, driver and option."""
    facts = [job.entry.digest, job.driver_digest, first.driver_digest, repr(options)]
    short = hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:8]
    return f"{re.sub(r'[^A-Za-z0-9._-]+', '-', job.entry.name)}-{short}"
