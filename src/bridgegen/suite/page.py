"""The page of a suite: one self-contained file, with playbacks of what fails the worst."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from bridgegen.disk import write_whole
from bridgegen.errors import BridgeGenError
from bridgegen.options import CommonOptions
from bridgegen.options.option import options_of
from bridgegen.preventability.result import PreventabilityMap
from bridgegen.report.page import code_of, page_of
from bridgegen.report.payload import script_json
from bridgegen.report.playback import Playback
from bridgegen.report.playbacks import measured_playbacks
from bridgegen.simulation.choice import EMBEDDED
from bridgegen.suite.evaluate import Job, pipeline_of, rows_of_job
from bridgegen.suite.maps import picture_payload
from bridgegen.suite.page_payload import Key, key_of, payload
from bridgegen.suite.results import EntryResult, rank
from bridgegen.suite.suite import SAMPLES, SuiteRun

FILE = "suite.html"

MOST_PLAYBACKS = 50
"""Maximum number of playbacks in a page."""

_MODULE = "suite.js"

_SIMULATE = ("ideal", "others", "time_limit", "criteria", "empty_trigger")
"""Options that ``bridgegen simulate`` has, too."""


def write_suite_page(
    suite: SuiteRun, jobs: Sequence[Job], maps: Sequence[PreventabilityMap] = ()
) -> Path:
    """Write the page of a suite, whole or not at all.

    Args:
        suite: its results.
        jobs: of which they are; those that fail the worst are simulated again, to be played.
        maps: of its scenarios, in its folder.

    Returns:
        The page, in the folder of the results.

    Raises:
        StorageError: it cannot be written.
    """
    by_key = {(job.entry.name, job.ego or ""): job for job in jobs}
    played = dict(_playbacks(suite, by_key))
    commands = {
        key_of(one): command_of(by_key[key_of(one)], one)
        for one in suite.results
        if one.verdict == "failed" and key_of(one) in by_key
    }
    pictures = [picture_payload(one, suite.folder) for one in maps]
    data = payload(suite, played, commands, pictures, code=code_of(_MODULE))
    path = suite.folder / FILE
    title = f"{suite.folder.resolve().name}: suite – BridgeGen"
    write_whole(path, page_of(_MODULE, title, script_json(data)))
    return path


def command_of(job: Job, result: EntryResult) -> str:
    """Return the command that shows a failure again.

    A file in which nothing varies is simulated; anything else is a suite of its own, whose page
    plays its worst variation.
    """
    entry, logical = job.entry, not job.entry.scenario.lower().endswith(".xosc")
    alone = entry.distribution is None and not logical and not result.parameters
    words = ["bridgegen", "simulate" if alone else "suite", entry.distribution or entry.scenario]
    words += ["--ego", job.ego] if job.ego else []
    for one in options_of(CommonOptions):
        if one.name in _SIMULATE or (not alone and one.name in ("critical", "count")):
            words += one.words(getattr(job.options, one.name))
    if logical:
        words += ["--samples", str(job.samples)] if job.samples != SAMPLES else []
        words += ["--seed", str(job.seed)] if job.seed else []
    if job.simulator.name != EMBEDDED.name:
        words += ["--simulator", job.simulator.name]
    return shlex.join(words)


def _playbacks(suite: SuiteRun, jobs: Mapping[Key, Job]) -> Iterator[tuple[Key, Playback]]:
    """Yield the playbacks of the worst failed rows, the most severe first."""
    failed = [one for one in suite.results if one.worst is not None]
    failed.sort(
        key=lambda one: (-one.rows[one.worst or 0].severity, *rank(one.rows[one.worst or 0]))
    )
    for one in failed[:MOST_PLAYBACKS]:
        job = jobs.get(key_of(one))
        playback = None if job is None else _playback(job, one)
        if playback is not None:
            yield key_of(one), playback


def _playback(job: Job, result: EntryResult) -> Playback | None:
    """Return the playback of an entry's worst failed row; None if that is no longer to be had."""
    row = result.worst
    if row is None or job.entry.digest != result.digest:  # the files have changed since
        return None
    try:
        pipeline = pipeline_of(job)
        X = rows_of_job(job, pipeline)
        if row >= len(X):
            return None
        return measured_playbacks(pipeline, [(job.name, row, ())], X[row : row + 1])[0]
    except (BridgeGenError, OSError):
        return None  # its results stand, and the page has the command
