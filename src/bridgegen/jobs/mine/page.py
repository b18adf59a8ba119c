"""What was recorded, as a page without scripts and as tables."""

import csv
import io
import math
import shlex
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from bridgegen.base.disk import refuse_other, write_whole
from bridgegen.base.errors import StorageError
from bridgegen.base.units import percent
from bridgegen.drivers.kinds import BICYCLE, MOTORCYCLE, NAMES, PEDESTRIAN
from bridgegen.jobs.mine import near_misses as conflicts
from bridgegen.jobs.mine.mine import CRITICAL, PATHS_SHOWN, Mined, Summary
from bridgegen.pages import charts, exposure, templates
from bridgegen.pages.moving import SMALL, moving_picture
from bridgegen.pages.templates import counted
from bridgegen.recordings.cells import cell
from bridgegen.recordings.events.playback import SHOWN, caption
from bridgegen.recordings.events.tables import FOLDER, against_in_words, kind_rows, rates_in_words
from bridgegen.recordings.events.tables import HEAD as EVENTS_HEAD
from bridgegen.recordings.events.tables import TABLE as EVENTS
from bridgegen.recordings.lanes.account import LanesFound
from bridgegen.recordings.scenarios.files import ENDINGS
from bridgegen.recordings.scenarios.files import FOLDER as SCENARIOS
from bridgegen.recordings.scenarios.mined import MinedScenario, Unmade

GENERATOR = "BridgeGen recordings"
PAGE, TABLE, LANES, QUALITY = "recordings.html", "recordings.csv", "lanes.csv", "quality.csv"
CONFLICTS = "conflicts.csv"
TABLE_HEAD = (
    "recording", "format", "file", "frame", "map", "time_step_s", "duration_s", "participants",
    *(f"n_{name}" for name in NAMES), "tracks", "states", "hours", "km", "hours_read", "km_read",
    "lights", "lanes", "vehicles_on_lanes", "km_on_lanes",
)  # fmt: skip
LANES_HEAD = (
    "recording",
    "file",
    "source",
    "carriageway",
    "lanes",
    "width_m",
    "length_m",
    "states",
    "rms_m",
    "p95_m",
)
QUALITY_HEAD = ("recording", "file", "rule", "participants", "count", "examples")
SPACE = 3.0
"""Margin around the paths in the picture [m]."""
CARRIAGEWAYS_SHOWN = 12
SOURCES = {
    "map": "of the map",
    "lanelets": "of the recording's lanelets",
    "markings": "between the recording's lane markings",
    "inferred": "inferred from the paths",
}
TWO_WHEELED = (BICYCLE, MOTORCYCLE)
_LINKS = ("scenario", "how well its distributions fit", "OpenSCENARIO distribution")


def refuse_foreign(out: Path, more: Sequence[str] = ()) -> None:
    """Refuse a folder in which other files have the names of ours.

    Args:
        out: the folder.
        more: names of files and folders of this call that are not of every call.

    Raises:
        StorageError: it has, or is none.
    """
    if out.exists() and not out.is_dir():
        raise StorageError(f"{out}: exists already, and is no folder")
    refuse_other(out / PAGE, GENERATOR, "page of recordings")
    # The page marks a folder as ours: without it, the folders in it are somebody's.
    for folder in (CRITICAL, FOLDER, SCENARIOS, *more):
        if (out / folder).exists() and not (out / PAGE).exists():
            raise StorageError(
                f"{out / folder}: exists already, is not of recordings, and is not overwritten"
            )
    for name, head in (
        (TABLE, TABLE_HEAD),
        (LANES, LANES_HEAD),
        (QUALITY, QUALITY_HEAD),
        (EVENTS, EVENTS_HEAD),
        (CONFLICTS, conflicts.HEAD),
    ):
        try:
            with (out / name).open("rb") as file:
                # Of a table, the first line tells; a file of others may have a line without end.
                ours = file.readline(4096).decode("utf-8", "replace").strip() == ",".join(head)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise StorageError(f"{out / name}: cannot be read: {error.strerror}") from None
        if not ours:
            raise StorageError(
                f"{out / name}: exists already, is not a table of recordings, and is not "
                "overwritten"
            )


def write_all(mined: Mined) -> None:
    """Write the page and the tables.

    Raises:
        StorageError: they cannot be written.
    """
    rows = [_row(recording) for recording in mined.recordings]
    write_whole(mined.out / TABLE, _csv(TABLE_HEAD, rows))
    write_whole(mined.out / LANES, _csv(LANES_HEAD, _lane_rows(mined)))
    write_whole(mined.out / QUALITY, _csv(QUALITY_HEAD, _quality_rows(mined)))
    write_whole(mined.out / CONFLICTS, _csv(conflicts.HEAD, conflicts.rows(mined)))
    templates.write_page(
        mined.out / PAGE,
        "jobs/mine/page.html",
        title="Near misses in recorded traffic",
        generator=GENERATOR,
        facts=[*_facts(mined)],
        verdict=_banner(mined),
        **_recordings(mined),
        **_events(mined),
        played={
            kind: [
                (
                    event.name,
                    moving_picture(event.motion, 1, event.when, caption(event), size=SMALL),
                    caption(event),
                )
                for event in mined.played
                if event.kind == kind
            ]
            for kind in dict.fromkeys(event.kind for event in mined.played)
        },
        per_kind=SHOWN,
        mined=[scenario for scenario in mined.mined if isinstance(scenario, MinedScenario)],
        unmade=_grouped(
            (scenario.source, scenario.reason)
            for scenario in mined.mined
            if isinstance(scenario, Unmade)
        ),
        files=[*zip(ENDINGS, _LINKS, strict=True)],
        folder=SCENARIOS,
        conflicts=_grouped(conflicts.recordings_in_words(mined)),
        near_misses=conflicts.gallery(mined),
        more=conflicts.other_rows(mined),
        listed=conflicts.LISTED,
        step=f"{mined.time_step:g}",
        skipped=mined.unread,
        others=[f"{path}: no recording" for path in mined.others],
    )
    for scenario in mined.mined:
        if isinstance(scenario, MinedScenario) and scenario.fit is not None:
            exposure.write_page(
                mined.out / SCENARIOS / f"{scenario.name}{ENDINGS[1]}", scenario.fit
            )


def _row(summary: Summary) -> list[object]:
    facts = summary.facts
    return [
        facts.name, facts.format, facts.source, facts.frame, facts.map, f"{facts.time_step:.6g}",
        f"{summary.duration:.6g}", sum(summary.participants.values()),
        *(summary.participants.get(name, 0) for name in NAMES), summary.tracks, summary.states,
        f"{summary.hours:.6g}", f"{summary.kilometres:.6g}", f"{summary.read_hours:.6g}",
        f"{summary.read_kilometres:.6g}", len(facts.lights), summary.lanes.source,
        f"{summary.lanes.vehicle_share:.4g}", f"{summary.lanes.km_on:.6g}",
    ]  # fmt: skip


def _lane_rows(mined: Mined) -> Iterator[list[object]]:
    for recording in mined.recordings:
        for each in recording.lanes.carriageways:
            yield [
                recording.facts.name,
                recording.facts.source,
                recording.lanes.source,
                each.number + 1,
                each.lanes,
                f"{each.width:.4g}",
                f"{each.length:.5g}",
                each.states,
                f"{each.rms:.3g}",
                f"{each.p95:.3g}",
            ]


def _quality_rows(mined: Mined) -> Iterator[list[object]]:
    for recording in mined.recordings:
        for each in recording.findings:
            yield [
                recording.facts.name,
                recording.facts.source,
                each.rule.value,
                each.participants,
                each.count,
                "; ".join(each.examples),
            ]


def _csv(head: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[bytes]:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(head)
    for row in rows:
        writer.writerow([cell(value) for value in row])
    # Names come from recordings, and may hold what UTF-8 cannot.
    yield text.getvalue().encode("utf-8", "replace")


def _banner(mined: Mined) -> templates.Banner:
    found = conflicts.ranked(mined)
    sure = sum(not event.is_contact and not event.doubt for _, event in found)
    doubtful = sum(not event.is_contact and event.doubt != "" for _, event in found)
    touching = len(found) - sure - doubtful
    text = f"in {counted(len(mined.recordings), 'recording')}"
    if doubtful:
        text += f"; {doubtful:,} more with motion that could not happen"
    if touching:
        text += f"; boxes of {counted(touching, 'pair')} touch"
    text += "."
    if found:
        text += f" The most severe: {conflicts.sentence(*found[0], mined.time_step)}."
    command = mined.command if mined.replays else ""
    if command:
        text += " Next, with a driver in the ego's place:"
    elif mined.replays:
        text += " Next, simulated with its driver:"
        command = f"bridgegen simulate {shlex.quote(str(mined.replays[0].scenario))}"
    word = counted(sure, "near miss") if sure else "no near miss"
    return templates.Banner(text, word=word.upper(), command=command)


def _facts(mined: Mined) -> Iterator[str]:
    yield counted(len(mined.recordings), "recording")
    yield (
        f"{sum(sum(recording.participants.values()) for recording in mined.recordings):,} "
        "participants"
    )
    yield _driven(sum(recording.hours for recording in mined.recordings))
    yield f"{sum(recording.kilometres for recording in mined.recordings):,.3g} km"
    if mined.replays:
        yield f"{counted(len(mined.replays), 'scenario')} written"
    if mined.skipped:
        yield f"{counted(len(mined.skipped), 'file')} not read"


def _driven(hours: float) -> str:
    """Return a duration in the unit in which it is read at a glance."""
    seconds = 3600.0 * hours
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    return f"{seconds / 60.0:.3g} min" if seconds < 7200.0 else f"{hours:,.4g} h"


def _grouped(pairs: Iterable[tuple[str, str]]) -> list[str]:
    """Return what is said of each name, once for all names of which the same is said."""
    names: dict[str, list[str]] = {}
    for name, text in pairs:
        names.setdefault(text, []).append(name)
    return [f"{', '.join(some)}: {text}" for text, some in names.items()]


def _recordings(mined: Mined) -> dict[str, object]:
    """Return the table of recordings, and what is shown of each."""
    return {
        "rows": [_recording_row(recording) for recording in mined.recordings],
        "recordings": [_recording(recording, mined.time_step) for recording in mined.recordings],
    }


def _recording_row(summary: Summary) -> list[object]:
    contacts = sum(each.is_contact for each in summary.conflicts)
    source = Path(summary.facts.source).name
    return [
        (source, "" if Path(source).stem == summary.facts.name else summary.facts.name),
        ", ".join(f"{count:,} {kind}" for kind, count in summary.participants.items()),
        f"{summary.duration:.3g} s",
        _driven(summary.hours),
        f"{summary.kilometres:.3g} km",
        len(summary.conflicts) - contacts,
        contacts,
        sum(len(kind) for kind in summary.events.kinds),
        "–" if math.isnan(summary.lanes.vehicle_share) else percent(summary.lanes.vehicle_share),
    ]


def _events(mined: Mined) -> dict[str, object]:
    """Return the tables of events and scenarios; those without any event in a line."""
    found = [recording.events for recording in mined.recordings]
    kinds = [*kind_rows(found)]
    met = [
        (
            scenario.complete + scenario.incomplete,
            [
                scenario.scenario,
                scenario.kind,
                scenario.complete,
                scenario.incomplete,
                *rates_in_words(scenario.encounters),
                ", ".join(scenario.unmapped) or "–",
            ],
        )
        for scenario in mined.scenarios
    ]
    return {
        "seen": [row for row in kinds if row[1] or row[4]],
        "unseen": _grouped(
            (kind, "not seen" if hour == km == "–" else f"{hour} per hour, {km} per 1000 km")
            for kind, count, hour, km, refused in kinds
            if not count and not refused
        ),
        "met": [row for count, row in met if count],
        "unmet": _grouped(
            (
                f"{scenario.scenario} ({', '.join(scenario.unmapped)} not given)"
                if scenario.unmapped
                else scenario.scenario,
                f"no {scenario.kind}",
            )
            for scenario, (count, _) in zip(mined.scenarios, met, strict=True)
            if not count
        ),
        "against": [
            f"{scenario.scenario}: {text}"
            for scenario in mined.scenarios
            for text in against_in_words(scenario)
        ],
        "driven": [
            sum(getattr(events, name) for events in found)
            for name in ("hours", "kilometres", "all_hours", "all_kilometres")
        ],
    }


def _recording(summary: Summary, time_step: float) -> dict[str, object]:
    facts, lanes = summary.facts, summary.lanes
    used = " (not read)" if lanes.source in ("inferred", "none") else ""
    ways = lanes.carriageways
    return {
        "name": facts.name,
        "about": [
            f"file: {facts.source}",
            f"frame: {facts.frame}",
            f"map: {facts.map}{used}" if facts.map else "map: none named",
            f"{summary.states:,} states read, every {facts.time_step:.4g} s; {summary.tracks:,} "
            "tracks "
            f"after cleaning, every {time_step:g} s",
            f"{summary.read_hours:.4g} h and {summary.read_kilometres:.4g} km before cleaning, "
            f"{summary.hours:.4g} h and {summary.kilometres:.4g} km after",
            f"traffic lights: {len(facts.lights) or 'none recorded'}",
            *facts.notes,
        ],
        "picture": _picture(summary),
        "paths": "all"
        if len(summary.paths) == summary.tracks
        else f"{len(summary.paths):,} of {summary.tracks:,}",
        "lanes": [
            f"lanes: {lanes_in_words(lanes)}; {lanes.km_on:.4g} km on lanes, "
            f"{lanes.km_off:.4g} km off",
            *lanes.notes,
        ],
        "ways": [
            [
                f"{each.number + 1}",
                f"{each.lanes or '–'}",
                f"{each.width:.2f} m",
                f"{each.length:.0f} m",
                each.states,
                f"{each.rms:.2f} m",
                f"{each.p95:.2f} m",
            ]
            for each in ways[:CARRIAGEWAYS_SHOWN]
        ],
        "more_ways": max(0, len(ways) - CARRIAGEWAYS_SHOWN),
        "findings": [
            [each.rule.value, each.participants, each.count, "; ".join(each.examples)]
            for each in summary.findings
            if each.count or each.participants
        ],
        "clean": [
            each.rule.value for each in summary.findings if not (each.count or each.participants)
        ],
    }


def lanes_in_words(found: LanesFound) -> str:
    """Return what the lanes are of, and how many of the vehicles are on them."""
    if found.source == "none":
        return "no lanes"
    share = (
        ""
        if math.isnan(found.vehicle_share)
        else f", {percent(found.vehicle_share)} of the states \
of vehicles that drive on them"
    )
    ways = counted(len(found.carriageways), "carriageway")
    return f"{SOURCES[found.source]}: {ways} with traffic{share}"


def _picture(summary: Summary) -> str:
    def kind(code: int) -> str:
        return "walks" if code == PEDESTRIAN else "cycles" if code in TWO_WHEELED else "drives"

    points = np.concatenate([path for _, path in summary.paths])
    lines = [("lane", border) for border in summary.lanes.borders]
    lines += [(kind(code), path) for code, path in summary.paths[:PATHS_SHOWN]]
    low, high = points.min(axis=0) - SPACE, points.max(axis=0) + SPACE
    return charts.ground(lines, low, high, "Paths of the recording")
