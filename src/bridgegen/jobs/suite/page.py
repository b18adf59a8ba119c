"""The page of a suite: one self-contained file, with playbacks of what fails the worst."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from bridgegen.base.errors import BridgeGenError
from bridgegen.engine.options import CommonOptions
from bridgegen.engine.options.option import options_of
from bridgegen.jobs.preventability.result import PreventabilityMap
from bridgegen.jobs.suite.difference import Difference, WorseThan, in_order, suite_difference
from bridgegen.jobs.suite.evaluate import Job, pipeline_of, rows_of_job
from bridgegen.jobs.suite.maps import picture_payload
from bridgegen.jobs.suite.page_payload import Key, Motion, key_of, payload
from bridgegen.jobs.suite.replay import Replayed, replay_command
from bridgegen.jobs.suite.results import EntryResult, rank
from bridgegen.jobs.suite.suite import SuiteRun
from bridgegen.pages.page import code_of, write_page
from bridgegen.pages.payload import script_json
from bridgegen.pages.playback import Playback
from bridgegen.pages.playbacks import beside_others, measured_playbacks
from bridgegen.pages.templates import Banner
from bridgegen.pages.thumbnails import Thumbnail, thumbnail, write_thumbnails
from bridgegen.simulation.choice import EMBEDDED

FILE = "suite.html"

MOST_PLAYBACKS = 50
"""Maximum number of playbacks in a page."""

MOST_PAIRS = 200
"""Maximum number of variations that a page plays with two egos."""

PLAYED = ("broken", "fixed", "worse", "milder")

_MODULE = "suite.js"

_SIMULATE = ("ideal", "vehicle", "others", "time_limit", "criteria", "empty_trigger", "odd")
"""Options that ``bridgegen simulate`` has, too."""


def write_suite_page(
    suite: SuiteRun,
    jobs: Sequence[Job],
    *,
    searches: Sequence[WorseThan] = (),
    maps: Sequence[PreventabilityMap] = (),
) -> Path:
    """Write the page of a suite, whole or not at all.

    Args:
        suite: its results.
        jobs: of which they are; those that fail the worst are simulated again, to be played.
        searches: for where the second of two egos is worse.
        maps: of its scenarios, in its folder.

    Returns:
        The page, in the folder of the results.

    Raises:
        StorageError: it cannot be written.
    """
    by_key = {(job.entry.name, job.ego or ""): job for job in jobs}
    commands = {
        key_of(result): command_of(suite.folder, by_key[key_of(result)], result)
        for result in suite.results
        if result.verdict == "failed" and key_of(result) in by_key
    }
    found = suite_difference(suite)
    motions = list(_worst(suite, by_key) if found is None else _pairs(suite, by_key, found))
    write_thumbnails(suite.folder, _thumbnails(suite, motions))
    return _write(suite, motions, commands, searches, maps)


def _thumbnails(suite: SuiteRun, motions: Sequence[Motion]) -> Iterator[Thumbnail | None]:
    """Yield what other pages show of the entries that fail: the worst variation of each."""
    played = {
        (motion.entry, ego, motion.row): playback
        for motion in motions
        for ego, playback in zip(motion.egos[::-1], (motion.playback, motion.twin), strict=False)
        if playback is not None
    }
    for result in suite.results:
        playback = played.get((*key_of(result), result.worst or 0))
        if playback is not None and result.worst is not None:
            words = f"{result.entry}: {result.rows[result.worst].conflict_type or 'critical'}"
            yield thumbnail(playback, words, entry=result.entry, ego=result.ego or result.driver)


def write_replay_page(made: Replayed) -> Path:
    """Write the page of a variation that was run again, with its playback, whether it fails or not.

    Returns:
        The page, in the folder of its files.

    Raises:
        StorageError: it cannot be written.
    """
    name = f"{made.result.entry}, variation {made.number}"
    result = made.result.model_copy(update={"entry": name})
    suite = SuiteRun(made.folder, (result.ego,), (result,), {})
    job = replace(made.job, entry=replace(made.job.entry, name=name))
    playback = _playback(job, result, 0)
    played = [] if playback is None else [Motion(name, (result.ego,), 0, playback)]
    return _write(suite, played, {key_of(result): made.command})


def _write(
    suite: SuiteRun,
    played: Sequence[Motion],
    commands: Mapping[Key, str],
    searches: Sequence[WorseThan] = (),
    maps: Sequence[PreventabilityMap] = (),
) -> Path:
    pictures = [picture_payload(map_, suite.folder) for map_ in maps]
    data = payload(suite, played, commands, searches=searches, maps=pictures, code=code_of(_MODULE))
    path = suite.folder / FILE
    name, is_diff = suite.folder.resolve().name, bool(data["suite"]["changed"])
    banner = _banner(suite, data["suite"], commands)
    heading = data["suite"]["changed"]["headline"].rpartition(": ")[0] if is_diff else name
    trail = ["diff", name] if is_diff else ["suite"]
    write_page(
        path,
        _MODULE,
        f"{name}: {trail[0]}",
        script_json(data),
        verdict=banner,
        heading=heading,
        trail=trail,
    )
    return path


def _banner(suite: SuiteRun, page: Mapping[str, Any], commands: Mapping[Key, str]) -> Banner:
    """Return the verdict on all egos; of two, on the second, and what it fixes and breaks.

    Its command plays the most severe failure.
    """
    egos = suite.egos[-1:] if page["changed"] else suite.egos
    verdicts = {result.verdict for ego in egos for result in suite.of_ego(ego)}
    kind, word = "passes", "PASSES"
    if "failed" in verdicts:
        kind, word = "fails", "FAILS"
    elif verdicts != {"passed"}:
        kind, word = "open", "NOT JUDGED"
    said = "; ".join(page["headlines"])
    if page["changed"]:  # the heading says who against whom
        said = page["changed"]["headline"].rpartition(": ")[2].capitalize()
    worst = [key_of(result) for result in _failed(suite) if result.ego in (*egos, "", None)]
    return Banner(f"{said}.", kind, word, next((commands[k] for k in worst if k in commands), ""))


def command_of(folder: Path, job: Job, result: EntryResult) -> str:
    """Return the command that shows the worst failure of an entry again.

    A file in which nothing varies is simulated; of anything else that one variation is run again.
    """
    entry = job.entry
    is_alone = entry.distribution is None and entry.scenario.lower().endswith(".xosc")
    if not is_alone or result.parameters or entry.criteria or entry.count:
        return replay_command(folder, result, result.worst or 0)
    words = ["bridgegen", "simulate", entry.scenario]
    words += ["--ego", job.ego] if job.ego else []
    for option in options_of(CommonOptions):
        if option.name in _SIMULATE:
            words += option.words(getattr(job.options, option.name))
    if job.simulator.name != EMBEDDED.name:
        words += ["--simulator", job.simulator.name]
    return shlex.join(words)


def _worst(suite: SuiteRun, jobs: Mapping[Key, Job]) -> Iterator[Motion]:
    """Yield the motions of the worst failed rows, the most severe first."""
    for result in _failed(suite)[:MOST_PLAYBACKS]:
        job = jobs.get(key_of(result))
        others = [jobs.get((result.entry, ego)) for ego in suite.egos if ego != result.ego]
        shown = [other for other in others if other is not None]
        playback = None if job is None else _playback(job, result, result.worst or 0, shown)
        if playback is not None:
            yield Motion(result.entry, (result.ego,), result.worst or 0, playback)


def _failed(suite: SuiteRun) -> list[EntryResult]:
    """Return the results that fail, the most severe first."""
    failed = [result for result in suite.results if result.worst is not None]
    failed.sort(
        key=lambda result: (
            -result.rows[result.worst or 0].severity,
            *rank(result.rows[result.worst or 0]),
        )
    )
    return failed


def _pairs(suite: SuiteRun, jobs: Mapping[Key, Job], found: Difference) -> Iterator[Motion]:
    """Yield what both egos do in the variations that change, the most important first.

    The worst failure of each entry comes before those that are only worse or milder.
    """
    changed = [(row.entry, row.row) for row in in_order(found) if row.kind in PLAYED]
    verdicts = sum(row.kind in ("broken", "fixed") for row in found.rows)
    worst = [(result.entry, result.worst or 0) for result in _failed(suite)[:MOST_PLAYBACKS]]
    wanted = list(dict.fromkeys([*changed[:verdicts], *worst, *changed[verdicts:]]))[:MOST_PAIRS]
    of_entry: dict[str, list[int]] = {}
    for entry, number in wanted:
        of_entry.setdefault(entry, []).append(number)
    made = {
        (entry, motion.row): motion
        for entry, numbers in of_entry.items()
        for motion in _both(suite, jobs, entry, numbers)
    }
    yield from (made[key] for key in wanted if key in made)


def _both(
    suite: SuiteRun, jobs: Mapping[Key, Job], entry: str, numbers: Sequence[int]
) -> Iterator[Motion]:
    """Yield the motions of some rows of an entry; none where the files have changed since."""
    played = []
    try:
        for ego in suite.egos:
            job, (result,) = (
                jobs[entry, ego],
                [result for result in suite.of_ego(ego) if result.entry == entry],
            )
            if not job.is_of(result):
                return
            pipeline = pipeline_of(job)
            X = rows_of_job(job, pipeline)[list(numbers)]
            names = [(f"{entry}, variation {number + 1}", number, ()) for number in numbers]
            played.append(measured_playbacks(pipeline, names, X))
    except (BridgeGenError, OSError, KeyError, IndexError):
        return  # its results stand, and the page has the command
    for number, first, second in zip(numbers, *played, strict=True):
        yield Motion(entry, suite.egos, number, second, first)


def _playback(
    job: Job, result: EntryResult, row: int, others: Sequence[Job] = ()
) -> Playback | None:
    """Return the playback of an entry's row; None if that is no longer to be had.

    Args:
        job: the entry with the ego.
        result: its.
        row: its number.
        others: the same with other egos, whose motion is shown beside.
    """
    if not job.is_of(result):  # the files have changed since
        return None
    try:
        pipeline = pipeline_of(job)
        X = rows_of_job(job, pipeline)[row : row + 1]
        if not len(X):
            return None
        played = measured_playbacks(pipeline, [(job.name, row, ())], X)
    except (BridgeGenError, OSError):
        return None  # its results stand, and the page has the command
    try:
        beside = {other.ego or other.name: pipeline_of(other) for other in others}
        return beside_others(played, X, beside)[0]
    except (BridgeGenError, OSError):
        return played[0]
