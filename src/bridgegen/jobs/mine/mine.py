"""``bridgegen mine``: read recordings, clean and place them, find near misses, account for all."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen import drivers as egos
from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.engine.options import called_with, range_problems
from bridgegen.jobs.frame import Judged, Table, command_of
from bridgegen.jobs.mine.options import MineOptions
from bridgegen.pages.templates import counted
from bridgegen.recordings.conflicts.find import RecordedConflict, conflicts_of, order
from bridgegen.recordings.events.find import FoundEvents, find_events
from bridgegen.recordings.events.of_scenarios import (
    ScenarioEvents,
    recorded_scenarios,
    scenario_events,
)
from bridgegen.recordings.events.playback import PlayedEvent, closest
from bridgegen.recordings.events.tables import write_events
from bridgegen.recordings.excerpt import Clock, clock_of
from bridgegen.recordings.lanes.account import LanesFound, account_of
from bridgegen.recordings.lanes.find import Located, locate, read_map
from bridgegen.recordings.readers.clean import Cleaned, check_time_step, clean
from bridgegen.recordings.readers.format import read_head
from bridgegen.recordings.readers.formats import files_of, read
from bridgegen.recordings.readers.quality import Finding
from bridgegen.recordings.readers.table import Facts, RecordedTraffic, kind_in_words
from bridgegen.recordings.replays.write import Prepared, Replay, prepare, write
from bridgegen.recordings.scenarios.files import FOLDER as MINED
from bridgegen.recordings.scenarios.files import write_mined
from bridgegen.recordings.scenarios.mined import MinedScenario, Unmade
from bridgegen.recordings.scenarios.update import ENDING as DIFF
from bridgegen.recordings.scenarios.update import Update, refuse_same_names, write_updates

PATHS_SHOWN = 300
POINTS_SHOWN = 40
"""Number of points of a path in the picture."""
MARGIN = 10.0
"""Margin around the paths in the picture [m]."""
CRITICAL, SUFFIXES = "critical", (".xosc", ".xodr", ".owl")
"""Folder of the critical scenarios, as of a run, and endings of its files."""


@dataclass(frozen=True)
class Summary:
    """What one recording holds.

    Attributes:
        facts: as it was read; its time step is the recording's own.
        participants: number by kind, most frequent first.
        states: number of states read.
        duration: from the first instant to the last [s].
        hours: driven or walked, of all participants, after cleaning.
        kilometres: the same.
        read_hours: before cleaning.
        read_kilometres: before cleaning, jumps included.
        tracks: after cuts.
        findings: of cleaning, all rules.
        paths: for the picture: kind and points ``(n, 2)`` [m] of at most `PATHS_SHOWN` tracks.
        lanes: on which it was.
        events: in it.
        conflicts: near misses, then contacts, the most harmful first.
        names: of the participants in them, by number.
        kinds: theirs, likewise.
    """

    facts: Facts
    participants: dict[str, int]
    states: int
    duration: float
    hours: float
    kilometres: float
    read_hours: float
    read_kilometres: float
    tracks: int
    findings: tuple[Finding, ...]
    paths: tuple[tuple[int, Float], ...]
    lanes: LanesFound
    events: FoundEvents
    conflicts: tuple[RecordedConflict, ...]
    names: dict[int, str]
    kinds: dict[int, str]


@dataclass(frozen=True)
class Mined:
    """What was recorded, and what was left out.

    Attributes:
        recordings: in the order of the files.
        skipped: files left out, or what of them could not be read, and why.
        others: files of folders that are no recordings.
        time_step: after cleaning [s].
        out: the folder.
        warnings: of reading the map.
        replays: the most critical events, as files.
        played: the closest events of each kind.
        scenarios: the events that are a scenario, per scenario.
        mined: what was made of each of these.
        updates: ranges proposed for scenario files.
        command: that does it again with a driver in the ego's place; "" where it was given one.
    """

    recordings: tuple[Summary, ...]
    skipped: tuple[tuple[Path, tuple[str, ...]], ...]
    others: tuple[Path, ...]
    time_step: float
    out: Path
    warnings: tuple[str, ...] = ()
    replays: tuple[Replay, ...] = ()
    played: tuple[PlayedEvent, ...] = ()
    scenarios: tuple[ScenarioEvents, ...] = ()
    mined: tuple[MinedScenario | Unmade, ...] = ()
    updates: tuple[Update, ...] = ()
    command: str = ""

    @property
    def work(self) -> str:
        """How much was read."""
        return f"{sum(recording.states for recording in self.recordings):,} states"

    @property
    def unread(self) -> list[str]:
        """Why each file was not read, or not to its end: a line each."""
        return [
            first + (f" (and {counted(len(more), 'problem')} more)" if more else "")
            for _, (first, *more) in self.skipped
        ]

    def to_json(self) -> Any:
        """Return what was recorded, found and written as JSON's types."""
        from bridgegen.jobs.mine.shown import json_of

        return json_of(self)

    def shown(self) -> list[str | Table]:
        """Return what was recorded, the events, the quality, and the files."""
        from bridgegen.jobs.mine.shown import shown_of

        return [*shown_of(self)]

    def judged(self) -> list[Judged]:
        """Return whether all files could be read, and the figures."""
        conflicts = [each for recording in self.recordings for each in recording.conflicts]
        figures = {
            "recordings": len(self.recordings),
            "skipped": len(self.skipped),
            "hours": sum(recording.hours for recording in self.recordings),
            "kilometres": sum(recording.kilometres for recording in self.recordings),
            "near_misses": sum(not conflict.is_contact for conflict in conflicts),
            "contacts": sum(conflict.is_contact for conflict in conflicts),
            "events": sum(
                len(kind) for recording in self.recordings for kind in recording.events.kinds
            ),
            "scenarios": len(self.replays),
            "mined": sum(isinstance(scenario, MinedScenario) for scenario in self.mined),
        }
        return [
            Judged(
                suite=str(self.out),
                group="bridgegen.mine",
                test="all recordings are read",
                holds=not self.skipped,
                details=f"{len(self.recordings)} read, {len(self.skipped)} skipped",
                figures=figures,
                facts={},
                missing="skipped",
            )
        ]


@called_with(MineOptions)
def mine(given: MineOptions) -> Mined:
    """Read and clean recordings, place them on lanes, find near misses, and write all that.

    The folder gets recordings.html, recordings.csv, lanes.csv, quality.csv, events.csv,
    conflicts.csv, in the folder ``events`` the parameters of scenarios, in the folder ``scenarios``
    logical scenarios made of them, and in the folder ``critical`` the most critical near misses as
    concrete ones.

    Returns:
        What was recorded, and what was left out.

    Raises:
        FileFormatError: no file of `recordings` can be read, or one of the names is of nothing.
        InputError: no recordings, a time step or a number out of range, a map of another place, or
            a scenario that declares no events.
        UnknownNameError: no such driver.
        StorageError: the folder holds other files of these names, or cannot be written.
    """
    from bridgegen.jobs.mine.page import refuse_foreign, write_all
    from bridgegen.jobs.mine.shown import warnings_of

    if problems := range_problems(given):
        raise InputError(*problems)
    if given.ego is not None:
        egos.get(given.ego)
    out = Path(given.out or "mined")
    update, scenarios = _paths(given.update), _paths(given.scenarios)
    time_step = given.time_step
    check_time_step(time_step)
    # What can be refused is refused before the first recording is read, which may take long.
    _refuse_replaced([*update, *scenarios], out / MINED)
    refuse_same_names(update)
    refuse_foreign(out, [f"{path.name}{DIFF}" for path in update])
    sought = recorded_scenarios([*update, *(path for path in scenarios if path not in update)])
    on_map = read_map(Path(given.road_map)) if given.road_map is not None else None
    files, others = _files(_paths(given.recordings))
    found: list[Summary] = []
    skipped: list[tuple[Path, tuple[str, ...]]] = []
    kept: list[Prepared] = []
    played: list[PlayedEvent] = []
    counts: Counter[str] = Counter()
    for number, file in enumerate(files):
        given.callbacks.progress("files", number, len(files), "")
        for traffic, cleaned in _readable(file, time_step, skipped):
            located = locate(cleaned.traffic, on_map)
            conflicts = conflicts_of(cleaned.traffic)
            summary = summarise(traffic, cleaned, located, conflicts)
            found.append(summary)
            clock = clock_of(cleaned.traffic)
            # Of each recording only the closest events are kept, with an excerpt: its traffic
            # is not.
            played = closest(played, cleaned.traffic, clock, summary.events, counts)
            counts.update({each.kind.name: len(each) for each in summary.events.kinds})
            kept = _most_critical(kept, cleaned.traffic, clock, conflicts, given.keep)
    if not found:
        problems = [text for _, texts in skipped for text in texts]
        raise FileFormatError(*problems, *["no recording could be read"] * (len(files) > 1))
    replays = _written(kept, out / CRITICAL, given.ego)
    warnings = on_map.warnings if on_map is not None else ()
    events = [item.events for item in found]
    met = tuple(scenario_events(item.scenario, item.spec, events) for item in sought)
    write_events(out, events, met)
    made = write_mined(
        out,
        sought,
        met,
        events,
        time_step,
        lambda done, total: given.callbacks.progress("scenarios", done, total, ""),
    )
    updates = write_updates(out, sought, met, update)
    mined = Mined(
        tuple(found),
        tuple(skipped),
        tuple(others),
        time_step,
        out,
        warnings,
        replays,
        tuple(played),
        met,
        made,
        updates,
        "" if given.ego else command_of("mine", given, out, ego="reference"),
    )
    write_all(mined)
    for text in warnings_of(mined):
        given.callbacks.say(f"bridgegen: {text}")
    return mined


def _readable(
    file: Path, time_step: float, skipped: list[tuple[Path, tuple[str, ...]]]
) -> Iterator[tuple[RecordedTraffic, Cleaned]]:
    """Yield the recordings in a file, cleaned, and note why it cannot be read to its end."""
    try:
        for traffic in read(file):
            yield traffic, clean(traffic, time_step)
    # Also what a format needs and is not installed, or not supported: the other files are read.
    except InputError as error:
        skipped.append((file, error.problems))


def _paths(given: Any) -> list[Path]:
    """Return the paths that an option holds; its form has made them a tuple of these."""
    return list(given)


def _refuse_replaced(paths: Sequence[Path], folder: Path) -> None:
    """Refuse scenario files that lie where mined scenarios are written."""
    for path in paths:
        if path.resolve().parent == folder.resolve():
            raise InputError(
                f"{path}: lies in the folder {folder}, whose scenarios are replaced: copy it "
                "elsewhere"
            )


def _most_critical(
    kept: list[Prepared],
    traffic: RecordedTraffic,
    clock: Clock,
    conflicts: tuple[RecordedConflict, ...],
    keep: int,
) -> list[Prepared]:
    """Return the most critical events of earlier recordings and of one more."""
    # The conflicts of a recording are in this order already: no later one can be kept.
    more = [prepare(traffic, clock, conflict) for conflict in conflicts[:keep]]
    return sorted([*kept, *more], key=lambda prepared: order(prepared.event))[:keep]


def _written(kept: list[Prepared], folder: Path, ego: str | None) -> tuple[Replay, ...]:
    """Write events in the place of those of an earlier call."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for old in folder.glob("[0-9][0-9][0-9][0-9].*"):
            if old.suffix in SUFFIXES:
                old.unlink()
    except OSError as error:
        raise StorageError(f"{folder}: cannot be made: {error.strerror}") from None
    return tuple(write(prepared, folder / f"{k:04}", ego) for k, prepared in enumerate(kept, 1))


def _files(paths: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    files, others = [], []
    for path in paths:
        if not path.exists():
            read_head(path)  # says why not: a mistyped name is no broken file
        recordings, beside = files_of(path)
        files += recordings
        others += beside
    twice = [path for path, count in Counter(path.resolve() for path in files).items() if count > 1]
    if twice:
        raise InputError(f"{twice[0]}: is named twice; its traffic would count twice")
    return files, others


def summarise(
    traffic: RecordedTraffic,
    cleaned: Cleaned,
    located: Located,
    conflicts: tuple[RecordedConflict, ...],
) -> Summary:
    """Return what a recording holds, and where."""
    after = cleaned.traffic
    kinds = Counter(kind_in_words(kind) for kind in cleaned.kinds.tolist())
    met = {p for conflict in conflicts for p in (conflict.ego, conflict.other)}
    shown = np.linspace(0, len(after.names) - 1, min(PATHS_SHOWN, len(after.names))).astype(int)
    paths = []
    for p in np.unique(shown).tolist():
        first, last = int(after.first[p]), int(after.first[p + 1]) - 1
        at = np.unique(np.linspace(first, last, POINTS_SHOWN).astype(int))
        paths.append((int(after.kind[p]), np.column_stack([after.x[at], after.y[at]])))
    points = np.concatenate([path for _, path in paths])
    lanes = account_of(located, points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN)
    return Summary(
        facts=traffic.facts,
        participants=dict(kinds.most_common()),
        states=len(traffic.time),
        duration=float(np.ptp(traffic.time)),
        hours=after.hours,
        kilometres=after.kilometres,
        read_hours=traffic.hours,
        read_kilometres=traffic.kilometres,
        tracks=len(after.names),
        findings=cleaned.quality.findings,
        paths=tuple(paths),
        lanes=lanes,
        events=find_events(after, located),
        conflicts=conflicts,
        names={p: after.names[p] for p in met},
        kinds={p: kind_in_words(int(after.kind[p])) for p in met},
    )
