"""A table of states, ours or another tool's, and the log that esmini writes."""

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import NAMES
from bridgegen.recordings.readers._motion_kernels import following_headings
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.table import Facts, RecordedTraffic, build, median_step, wrap
from bridgegen.scenario.participants import PARTICIPANTS, ParticipantKind
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
            name=path.stem,
            format=FORMAT.name,
            source=str(path),
            time_step=median_step(time, first),
            frame="as in the table",
            notes=tuple(notes),
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
    )


FORMAT = Format(
    name="states",
    title="a table of states, or esmini's log (.csv)",
    recognises=_recognises,
    read=_read,
)


# --- Directions, velocities and headings from positions; and the usual body of each kind ---


STANDING = 0.5
"""Speed [m/s] below which a body's motion says nothing of its heading."""
SHORTEST_ARM = 0.1
"""Least distance from a rear axle to the point ahead of it whose path gives the heading [m]."""
AWAY = 1.0
"""Distance of the state that gives the first direction of a track [m]."""


def velocities(time: Float, x: Float, y: Float) -> tuple[Float, Float]:
    """Return a track's velocities [m/s]: second-order differences, ``(n,)`` each."""
    if len(time) < 2:
        return np.zeros(len(time)), np.zeros(len(time))
    order: Literal[1, 2] = 2 if len(time) > 2 else 1  # at the ends
    return np.gradient(x, time, edge_order=order), np.gradient(y, time, edge_order=order)


def headings(vx: Float, vy: Float) -> tuple[Float, bool]:
    """Return the direction of motion [rad], and whether there is any.

    Where a body stands it keeps its last direction; before it first moves, it has its first.
    Whatever never moves faster than `STANDING` has 0.
    """
    # Noise of who stands has every direction.
    moving = np.flatnonzero(np.hypot(vx, vy) > STANDING)
    if not len(moving):
        return np.zeros(len(vx)), False
    last = np.searchsorted(moving, np.arange(len(vx)), side="right") - 1
    at = moving[np.maximum(last, 0)]
    return wrap(np.arctan2(vy[at], vx[at])), True


def headings_behind(x: Float, y: Float, first: Int, arm: Float) -> Float:
    """Return headings of bodies on wheels from the paths of their fronts, ``(S,)`` [rad].

    Args:
        x: ``(S,)`` of the front's middle [m].
        y: ``(S,)`` likewise.
        first: ``(P + 1,)`` the states of participant p are ``first[p]:first[p + 1]``.
        arm: ``(P,)`` from the rear axle to the front [m], above 0.
    """
    dx, dy = (np.diff(values, prepend=values[0]) for values in (x, y))
    begin = np.zeros(len(arm))
    for p, (low, high) in enumerate(itertools.pairwise(first.tolist())):
        away = np.flatnonzero(np.hypot(x[low:high] - x[low], y[low:high] - y[low]) >= AWAY)
        if len(away):
            to = low + away[0]
            begin[p] = np.arctan2(y[to] - y[low], x[to] - x[low])
    # The rear axle follows the front (its path is the tractrix of the front's). Headings from the
    # direction of motion let the rear axle swing out when a lane change begins: durations were 2 to
    # 4 % of the range too long. With the tractrix the error is 0.2 %.
    found: Float = following_headings(np.arctan2(dy, dx), np.hypot(dx, dy), first, arm, begin)
    return wrap(found)


def headings_of_centres(
    time: Float, vx: Float, vy: Float, first: Int, arm: Float, begin: Float
) -> Float:
    """Return headings of bodies on wheels from the velocities of their centres, ``(S,)`` [rad].

    Args:
        time: ``(S,)`` [s].
        vx: ``(S,)`` of the centre [m/s].
        vy: ``(S,)`` likewise.
        first: ``(P + 1,)`` the states of participant p are ``first[p]:first[p + 1]``.
        arm: ``(P,)`` from the rear axle to the centre [m], above 0.
        begin: ``(P,)`` heading of the first state [rad].
    """
    mean_x, mean_y = (0.5 * (array + np.concatenate([array[:1], array[:-1]])) for array in (vx, vy))
    way = np.hypot(mean_x, mean_y) * np.maximum(np.diff(time, prepend=time[0]), 0.0)
    found: Float = following_headings(np.arctan2(mean_y, mean_x), way, first, arm, begin)
    return wrap(found)


# --- The usual body of each kind, for what recordings do not say ---


_USUAL = {
    name: next(
        participant for participant in PARTICIPANTS.values() if participant.seen_as.name == name
    )
    for name in NAMES
}
"""The first participant of each class, which is the one that gave the class its name."""


def usual(kind: int) -> ParticipantKind:
    """Return the participant that a kind of `bridgegen.drivers.kinds` usually is."""
    return _USUAL[NAMES[kind]]


def usual_box(kind: int) -> tuple[float, float]:
    """Return length and width [m] of a kind of `bridgegen.drivers.kinds`."""
    body = usual(kind).body
    return body.length, body.width


def centre_ahead(kind: int, length: float) -> float:
    """Return how far a body's centre is ahead of its rear axle [m]; 0 for what has no axles.

    It is the same share of the length as of the usual body.
    """
    body = usual(kind).body
    return body.center_ahead / body.length * length
