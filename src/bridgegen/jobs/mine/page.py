"""What was recorded, as a page without scripts and as tables."""

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

import numpy as np

from bridgegen.base.disk import refuse_other, write_whole
from bridgegen.base.errors import StorageError
from bridgegen.drivers.kinds import BICYCLE, MOTORCYCLE, NAMES, PEDESTRIAN
from bridgegen.jobs.mine import near_misses as conflicts
from bridgegen.jobs.mine.mine import CRITICAL, PATHS_SHOWN, Mined, Summary
from bridgegen.recordings.cells import cell, html_table
from bridgegen.recordings.events.playback import playback_section
from bridgegen.recordings.events.tables import FOLDER, events_section
from bridgegen.recordings.events.tables import HEAD as EVENTS_HEAD
from bridgegen.recordings.events.tables import TABLE as EVENTS
from bridgegen.recordings.lanes.account import LanesFound
from bridgegen.recordings.scenarios.files import FOLDER as SCENARIOS
from bridgegen.recordings.scenarios.files import scenarios_section

GENERATOR = "BridgeGen recordings"
PAGE, TABLE, LANES, QUALITY = "recordings.html", "recordings.csv", "lanes.csv", "quality.csv"
CONFLICTS = "conflicts.csv"
TABLE_HEAD = (
    "recording", "format", "file", "frame", "map", "time_step_s", "duration_s", "participants",
    *(f"n_{name}" for name in NAMES), "tracks", "states", "hours", "km", "hours_read", "km_read",
    "lights", "lanes", "vehicles_on_lanes", "km_on_lanes",
)  # fmt: skip
LANES_HEAD = (
    "recording", "file", "source", "carriageway", "lanes", "width_m", "length_m", "states",
    "rms_m", "p95_m",
)  # fmt: skip
QUALITY_HEAD = ("recording", "file", "rule", "participants", "count", "examples")
HEIGHT, WIDTH = 260, 900
SPACE = 3.0
"""Around the paths [m]."""
CARRIAGEWAYS_SHOWN = 12
SOURCES = {
    "map": "of the map", "lanelets": "of the recording's lanelets",
    "markings": "between the recording's lane markings", "inferred": "inferred from the paths",
}  # fmt: skip
TWO_WHEELED = (BICYCLE, MOTORCYCLE)


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
    for folder in (CRITICAL, FOLDER, SCENARIOS, *more):
        if (out / folder).exists() and not (out / PAGE).exists():
            raise StorageError(
                f"{out / folder}: exists already, is not of recordings, and is not overwritten"
            )
    for name, head in (
        (TABLE, TABLE_HEAD), (LANES, LANES_HEAD), (QUALITY, QUALITY_HEAD),
        (EVENTS, EVENTS_HEAD), (CONFLICTS, conflicts.HEAD),
    ):  # fmt: skip
        try:
            with (out / name).open("rb") as file:
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
    rows = [_row(one) for one in mined.recordings]
    write_whole(mined.out / TABLE, _csv(TABLE_HEAD, rows))
    write_whole(mined.out / LANES, _csv(LANES_HEAD, _lane_rows(mined)))
    write_whole(mined.out / QUALITY, _csv(QUALITY_HEAD, _quality_rows(mined)))
    write_whole(mined.out / CONFLICTS, _csv(conflicts.HEAD, conflicts.rows(mined)))
    fill = {
        "title": "What was recorded",
        "css": _own("page.css"),
        "facts": "".join(f"<li>{escape(one)}</li>" for one in _facts(mined)),
        "table": _table(mined),
        "events": events_section([one.events for one in mined.recordings], mined.scenarios),
        "playback": playback_section(mined.played),
        "scenarios": scenarios_section(mined.mined),
        "recordings": "\n".join(_section(one, mined.time_step) for one in mined.recordings),
        "conflicts": conflicts.section(mined),
        "left_out": _left_out(mined),
        "version": escape(version("bridgegen")),
    }
    parts = re.split(r"\{\{(\w+)\}\}", _own("page.html"))
    text = "".join(fill[part] if i % 2 else part for i, part in enumerate(parts))
    write_whole(mined.out / PAGE, [text.encode("utf-8", "replace")])


def _row(one: Summary) -> list[object]:
    facts = one.facts
    return [
        facts.name, facts.format, facts.source, facts.frame, facts.map, f"{facts.time_step:.6g}",
        f"{one.duration:.6g}", sum(one.participants.values()),
        *(one.participants.get(name, 0) for name in NAMES), one.tracks, one.states,
        f"{one.hours:.6g}", f"{one.kilometres:.6g}", f"{one.read_hours:.6g}",
        f"{one.read_kilometres:.6g}", len(facts.lights), one.lanes.source,
        f"{one.lanes.vehicle_share:.4g}", f"{one.lanes.km_on:.6g}",
    ]  # fmt: skip


def _lane_rows(mined: Mined) -> Iterator[list[object]]:
    for one in mined.recordings:
        for each in one.lanes.carriageways:
            yield [
                one.facts.name, one.facts.source, one.lanes.source, each.number + 1, each.lanes,
                f"{each.width:.4g}", f"{each.length:.5g}", each.states, f"{each.rms:.3g}",
                f"{each.p95:.3g}",
            ]  # fmt: skip


def _quality_rows(mined: Mined) -> Iterator[list[object]]:
    for one in mined.recordings:
        for each in one.findings:
            yield [
                one.facts.name, one.facts.source, each.rule.value, each.participants, each.count,
                "; ".join(each.examples),
            ]  # fmt: skip


def _csv(head: Iterable[str], rows: Iterable[Iterable[object]]) -> Iterator[bytes]:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(head)
    for row in rows:
        writer.writerow([cell(value) for value in row])
    yield text.getvalue().encode("utf-8", "replace")


def _facts(mined: Mined) -> Iterator[str]:
    n = len(mined.recordings)
    yield "1 recording" if n == 1 else f"{n:,} recordings"
    yield f"{sum(sum(one.participants.values()) for one in mined.recordings):,} participants"
    yield f"{sum(one.hours for one in mined.recordings):.4g} h"
    yield f"{sum(one.kilometres for one in mined.recordings):.4g} km"
    yield f"cleaned at {mined.time_step:g} s"
    if mined.skipped:
        count = len(mined.skipped)
        yield "1 file skipped" if count == 1 else f"{count} files skipped"


def _table(mined: Mined) -> str:
    kinds = [name for name in NAMES if any(name in one.participants for one in mined.recordings)]
    head = ["recording", "format", "time step", "duration", *kinds, "h", "km"]
    rows = [
        [
            one.facts.name, one.facts.format, f"{one.facts.time_step:.4g} s",
            f"{one.duration:.4g} s", *(f"{one.participants.get(kind, 0):,}" for kind in kinds),
            f"{one.hours:.4g}", f"{one.kilometres:.4g}",
        ]
        for one in mined.recordings
    ]  # fmt: skip
    return html_table(head, rows)


def _section(one: Summary, time_step: float) -> str:
    facts = one.facts
    used = " (not read)" if one.lanes.source in ("inferred", "none") else ""
    about = [
        f"file: {facts.source}",
        f"frame: {facts.frame}",
        f"map: {facts.map}{used}" if facts.map else "map: none named",
        f"{one.states:,} states read, every {facts.time_step:.4g} s; {one.tracks:,} tracks after "
        f"cleaning, every {time_step:g} s",
        f"{one.read_hours:.4g} h and {one.read_kilometres:.4g} km before cleaning, "
        f"{one.hours:.4g} h and {one.kilometres:.4g} km after",
        f"traffic lights: {len(facts.lights) or 'none recorded'}",
        *facts.notes,
    ]
    findings = [
        [each.rule.value, f"{each.participants:,}", f"{each.count:,}", "; ".join(each.examples)]
        for each in one.findings
    ]
    head = ["quality", "participants", "count", "first places"]
    lines = "".join(f"<li>{escape(text)}</li>" for text in about)
    return (
        f"<section><h2>{escape(facts.name)}</h2><div class='card'><ul>{lines}</ul></div>"
        f"<div class='card'>{_picture(one)}<p class='muted'>{_caption(one)}</p></div>"
        f"{_lanes(one.lanes)}"
        f"<div class='card'><div class='wide'>{html_table(head, findings)}</div></div></section>"
    )


def lanes_in_words(found: LanesFound) -> str:
    """Return what the lanes are of, and how many of the vehicles are on them."""
    if found.source == "none":
        return "no lanes"
    share = (
        ""
        if math.isnan(found.vehicle_share)
        else f", {found.vehicle_share:.1%} of the states \
of vehicles that drive on them"
    )
    count = len(found.carriageways)
    ways = "1 carriageway" if count == 1 else f"{count:,} carriageways"
    return f"{SOURCES[found.source]}: {ways} with traffic{share}"


def _lanes(found: LanesFound) -> str:
    notes = [f"lanes: {lanes_in_words(found)}; {found.km_on:.4g} km on lanes, {found.km_off:.4g} \
km off", *found.notes]  # fmt: skip
    head = ["carriageway", "lanes", "mean width", "length", "states", "off the middle, RMS",
            "95 % within"]  # fmt: skip
    rows = [
        [f"{each.number + 1}", f"{each.lanes or '–'}", f"{each.width:.2f} m",
         f"{each.length:.0f} m", f"{each.states:,}", f"{each.rms:.2f} m", f"{each.p95:.2f} m"]
        for each in found.carriageways[:CARRIAGEWAYS_SHOWN]
    ]  # fmt: skip
    lines = "".join(f"<li>{escape(text)}</li>" for text in notes)
    more = len(found.carriageways) - len(rows)
    rest = f"<p class='muted'>And {more:,} more, in {LANES}.</p>" if more > 0 else ""
    table = f"<div class='wide'>{html_table(head, rows)}</div>{rest}" if rows else ""
    return f"<div class='card'><ul>{lines}</ul>{table}</div>"


def _caption(one: Summary) -> str:
    shown = "all" if len(one.paths) == one.tracks else f"{len(one.paths):,} of {one.tracks:,}"
    return f"Paths of {shown} tracks, x to the right, y up. <span class='walks'>On foot</span>, \
<span class='cycles'>two-wheeled</span>, all others dark; \
<span class='lanes'>borders of lanes</span>."


def _picture(one: Summary) -> str:
    points = np.concatenate([path for _, path in one.paths])
    low, high = points.min(axis=0) - SPACE, points.max(axis=0) + SPACE
    span = np.maximum(high - low, 1.0)
    scale = min((WIDTH - 20) / span[0], (HEIGHT - 40) / span[1])
    height = span[1] * scale + 40
    length = 10.0 ** np.floor(np.log10(0.4 * (WIDTH - 20) / scale))
    lines = []
    for border in one.lanes.borders:
        xy = (border - low) * scale
        text = " ".join(f"{10 + x:.1f},{height - 30 - y:.1f}" for x, y in xy.tolist())
        lines.append(f'<polyline class="lane" points="{text}"/>')
    for kind, path in one.paths[:PATHS_SHOWN]:
        xy = (path - low) * scale
        text = " ".join(f"{10 + x:.1f},{height - 30 - y:.1f}" for x, y in xy.tolist())
        name = "walks" if kind == PEDESTRIAN else "cycles" if kind in TWO_WHEELED else "drives"
        lines.append(f'<polyline class="{name}" points="{text}"/>')
    bar = (
        f'<path class="bar" d="M10 {height - 8:.1f}h{length * scale:.1f}"/>'
        f'<text x="{16 + length * scale:.1f}" y="{height - 4:.1f}">{length:g} m</text>'
    )
    return (
        f'<svg viewBox="0 0 {WIDTH} {height:.0f}" role="img" aria-label="Paths of the recording">'
        f"{''.join(lines)}{bar}</svg>"
    )


def _left_out(mined: Mined) -> str:
    if not mined.skipped and not mined.others:
        return "<p>No file was left out.</p>"
    lines = [f"<li>{escape(text)}</li>" for _, texts in mined.skipped for text in texts]
    lines += [f"<li>{escape(str(path))}: no recording</li>" for path in mined.others]
    return f"<ul>{''.join(lines)}</ul>"


def _own(name: str) -> str:
    return files("bridgegen.jobs.mine").joinpath(name).read_text("utf-8")
