"""Traffic of paths that are planted, without lanes."""

import numpy as np

from bridgegen.drivers.kinds import CAR
from bridgegen.recordings.events.find import find_events
from bridgegen.recordings.lanes.find import locate
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.table import Facts, RecordedLight, build

T = np.arange(0.0, 14.0, 0.1)
CAR_BOX, PERSON_BOX = (4.5, 1.8), (0.5, 0.5)


def line(x, y, course, speed, begin=0.0):
    """A straight path through (x, y) at the time 0; recorded from a time on."""
    t = T[begin <= T]
    return t, x + speed * t * np.cos(course), y + speed * t * np.sin(course)


def turning(x, y, course, speed, way, radius, side):
    """A path that turns by 90° after a way [m], to the left if ``side`` is 1."""
    h = course + side * np.clip((speed * T - way) / radius, 0.0, 0.5 * np.pi)
    step = 0.1 * speed
    middle = 0.5 * (h[1:] + h[:-1])
    return (
        T, x + np.concatenate([[0.0], np.cumsum(step * np.cos(middle))]),
        y + np.concatenate([[0.0], np.cumsum(step * np.sin(middle))]),
    )  # fmt: skip


def course_of(x, y):
    """The headings of a path; of who stands that in which it sets off, or 0."""
    dx, dy = np.gradient(x), np.gradient(y)
    moves = np.hypot(dx, dy) > 1e-9
    if not moves.any():
        return np.zeros_like(x)
    course = np.unwrap(np.arctan2(dy[moves], dx[moves]))
    return np.interp(np.arange(len(x)), np.flatnonzero(moves), course)


def traffic_of(tracks, kinds=None, lights=(), turn=0.0, shift=(0.0, 0.0), later=0.0):
    kinds = [CAR] * len(tracks) if kinds is None else kinds
    t, x, y = (np.concatenate(values) for values in zip(*tracks, strict=True))
    c, s = np.cos(turn), np.sin(turn)
    columns = {
        "time": t + later, "x": c * x - s * y + shift[0], "y": s * x + c * y + shift[1],
        "heading": np.concatenate([course_of(*track[1:]) for track in tracks]) + turn,
    }  # fmt: skip
    boxes = np.array([CAR_BOX if kind == CAR else PERSON_BOX for kind in kinds])
    ids = np.repeat(np.arange(len(tracks)), [len(track[0]) for track in tracks])
    known = {
        str(k): RecordedLight(
            tuple((time + later, state) for time, state in changes), str(k),
            np.array(path) @ np.array([[c, s], [-s, c]]) + shift,
        )
        for k, (changes, path) in enumerate(lights)
    }  # fmt: skip
    facts = Facts("planted", "none", "planted", 0.1, "a plane", lights=known)
    return build(facts, ids, columns, lambda i: f"state {i}", kind=np.array(kinds),
                 length=boxes[:, 0], width=boxes[:, 1])  # fmt: skip


def found(tracks, kinds=None, lights=(), **moved):
    cleaned = clean(traffic_of(tracks, kinds, lights, **moved), 0.05).traffic
    events = find_events(cleaned, locate(cleaned))
    return events, {one.kind.name: one for one in events.kinds}


def rows_of(by_kind, kinds, renamed=None):
    """The events with all quantities, sorted, by what the tracks were before they were renamed."""
    rows = []
    for kind in kinds:
        events = by_kind[kind]
        who = [events.ego, *events.others.values()]
        for i in range(len(events)):
            names = [int(one[i]) for one in who]
            if renamed is not None:
                names = [renamed[name] if name >= 0 else name for name in names]
            rows.append((kind, names, events.end[i] - events.begin[i],
                         [values[i] for values in events.quantities.values()]))  # fmt: skip
    return sorted(rows, key=lambda row: row[:2])
