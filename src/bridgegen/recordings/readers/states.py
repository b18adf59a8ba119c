"""A table of states, ours or another tool's, and the log that esmini writes."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.table import Facts, RecordedTraffic, build, median_step
from bridgegen.simulation.recording import read_tracks
from bridgegen.simulation.trace import COLUMNS


def _recognises(head: Head) -> bool:
    return head.has(*COLUMNS) or head.data.removeprefix(b"\xef\xbb\xbf").startswith(b"esmini")


def _read(path: Path) -> Iterator[RecordedTraffic]:
    found = read_tracks(path)
    tracks = found.tracks.values()
    counts = [len(track.lines) for track in tracks]
    ids = np.repeat(np.arange(len(counts)), counts)
    order = np.concatenate([np.argsort(track.states["time"], kind="stable") for track in tracks])
    order += np.repeat(np.cumsum([0, *counts[:-1]]), counts)
    lines = np.concatenate([track.lines for track in tracks])[order]
    names = ("time", "x", "y", "h", "speed", "acceleration", "length", "width", "centre")
    states = {
        name: np.concatenate(
            [track.states.get(name, [math.nan] * len(track.lines)) for track in tracks]
        )[order]
        for name in names
    }
    ahead = np.nan_to_num(states["centre"])
    h, time = states["h"], states["time"]
    first = np.cumsum([0, *counts])
    notes = list(found.notes)
    if not np.isfinite(states["centre"]).all():
        notes.append("without the column centre, positions are taken as the bodies' centres")
    yield build(
        Facts(
            name=path.stem, format=FORMAT.name, source=str(path),
            time_step=median_step(time, first), frame="as in the table", notes=tuple(notes),
        ),
        ids,
        {
            "time": time,
            "x": states["x"] + ahead * np.cos(h),
            "y": states["y"] + ahead * np.sin(h),
            "heading": h,
            "vx": states["speed"] * np.cos(h),
            "vy": states["speed"] * np.sin(h),
            "acceleration": states["acceleration"],
        },
        lambda i: f"{path}, line {lines[i]}",
        names=list(found.tracks),
        length=states["length"][first[:-1]],
        width=states["width"][first[:-1]],
    )  # fmt: skip


FORMAT = Format(
    name="states", title="a table of states, or esmini's log (.csv)",
    recognises=_recognises, read=_read,
)  # fmt: skip
