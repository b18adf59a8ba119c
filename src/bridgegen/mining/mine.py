"""``bridgegen mine``: read recordings, clean them, say where they are, account for them."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.arrays import Float
from bridgegen.errors import FileFormatError, InputError, StorageError
from bridgegen.mining.events.find import FoundEvents, find_events
from bridgegen.mining.events.of_scenarios import (
    ScenarioEvents,
    recorded_scenarios,
    scenario_events,
)
from bridgegen.mining.lanes.account import LanesFound, account_of
from bridgegen.mining.lanes.find import Located, locate, read_map
from bridgegen.recordings.clean import TIME_STEP, Cleaned, clean
from bridgegen.recordings.formats import files_of, read
from bridgegen.recordings.quality import Finding
from bridgegen.recordings.table import Facts, RecordedTraffic, kind_in_words

PATHS_SHOWN = 300
POINTS_SHOWN = 40
"""Of a path in the picture."""
MARGIN = 10.0
"""Around the paths in the picture [m]."""


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


@dataclass(frozen=True)
class Mined:
    """What was recorded, and what was left out.

    Attributes:
        recordings: in the order of the files.
        skipped: with ``lenient``: files left out, or what of them could not be read, and why.
        others: files of folders that are no recordings.
        time_step: after cleaning [s].
        out: the folder.
        warnings: of reading the map.
        scenarios: the events that are a scenario, per scenario.
    """

    recordings: tuple[Summary, ...]
    skipped: tuple[tuple[Path, tuple[str, ...]], ...]
    others: tuple[Path, ...]
    time_step: float
    out: Path
    warnings: tuple[str, ...] = ()
    scenarios: tuple[ScenarioEvents, ...] = ()


def mine(
    paths: Sequence[Path],
    *,
    out: Path,
    road_map: Path | None = None,
    lenient: bool = False,
    time_step: float = TIME_STEP,
    scenarios: Sequence[Path] = (),
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Mined:
    """Read and clean recordings, place them on lanes, and write what was recorded.

    Args:
        paths: files, or folders of files.
        out: a folder, new or of an earlier call; gets recordings.html, recordings.csv, lanes.csv,
            quality.csv, events.csv, and a folder events.
        road_map: the OpenDRIVE map of all of them; without one the lanes are those that come with
            the recording, or inferred from its paths.
        lenient: leave out what cannot be read, and list it.
        time_step: to resample at [s].
        scenarios: files of scenarios that declare their events, besides those that ship.
        progress: is told how many of how many files are done.

    Raises:
        FileFormatError: a file that is no recording, or breaks its format's rules.
        InputError: no recordings, a time step out of range, a map of another place, or a scenario
            that declares no events.
        StorageError: the folder holds other files of these names, or cannot be written.
    """
    from bridgegen.mining.page import refuse_foreign, write_all

    refuse_foreign(out)
    sought = recorded_scenarios(scenarios)
    on_map = read_map(road_map) if road_map is not None else None
    files, others = _files(paths)
    found: list[Summary] = []
    skipped: list[tuple[Path, tuple[str, ...]]] = []
    for number, file in enumerate(files):
        progress(number, len(files))
        try:
            for traffic in read(file):
                cleaned = clean(traffic, time_step)
                found.append(summarise(traffic, cleaned, locate(cleaned.traffic, on_map)))
        except FileFormatError as error:
            if not lenient:
                raise
            skipped.append((file, error.problems))
    progress(len(files), len(files))
    if not found:
        problems = [text for _, texts in skipped for text in texts]
        raise FileFormatError(*problems, "no recording could be read")
    warnings = on_map.warnings if on_map is not None else ()
    events = [one.events for one in found]
    mined = Mined(
        tuple(found), tuple(skipped), tuple(others), time_step, out, warnings,
        tuple(scenario_events(one, one.recorded, events) for one in sought if one.recorded),
    )  # fmt: skip
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{out}: cannot be made: {error.strerror}") from None
    write_all(mined)
    return mined


def _files(paths: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    files, others = [], []
    for path in paths:
        recordings, beside = files_of(path)
        files += recordings
        others += beside
    twice = [path for path, count in Counter(path.resolve() for path in files).items() if count > 1]
    if twice:
        raise InputError(f"{twice[0]}: is named twice; its traffic would count twice")
    return files, others


def summarise(traffic: RecordedTraffic, cleaned: Cleaned, located: Located) -> Summary:
    """Return what a recording holds, and where."""
    after = cleaned.traffic
    kinds = Counter(kind_in_words(kind) for kind in cleaned.kinds.tolist())
    shown = np.linspace(0, len(after.names) - 1, min(PATHS_SHOWN, len(after.names))).astype(int)
    paths = []
    for p in np.unique(shown).tolist():
        first, last = int(after.first[p]), int(after.first[p + 1]) - 1
        at = np.unique(np.linspace(first, last, POINTS_SHOWN).astype(int))
        paths.append((int(after.kind[p]), np.column_stack([after.x[at], after.y[at]])))
    points = np.concatenate([path for _, path in paths])
    lanes = account_of(located, points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN)
    return Summary(
        facts=traffic.facts, participants=dict(kinds.most_common()), states=len(traffic.time),
        duration=float(np.ptp(traffic.time)), hours=after.hours, kilometres=after.kilometres,
        read_hours=traffic.hours, read_kilometres=traffic.kilometres, tracks=len(after.names),
        findings=cleaned.quality.findings, paths=tuple(paths), lanes=lanes,
        events=find_events(after, located),
    )  # fmt: skip
