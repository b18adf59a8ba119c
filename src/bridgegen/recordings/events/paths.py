"""The paths of a recording's participants as lines, and where those of two cross or join.

A path leads through states that are 1 m apart at least, so that noise of who stands makes none.
Neither needs lanes.
"""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import BICYCLE, PEDESTRIAN
from bridgegen.recordings.conflicts.find import EGOS
from bridgegen.recordings.events._crossing_kernels import mark_crossings, mark_vertices
from bridgegen.recordings.events._joining_kernels import mark_joins
from bridgegen.recordings.excerpt import Clock
from bridgegen.recordings.readers.table import RecordedTraffic, wrap

VERTEX = 1.0
"""Least distance between two points of a path [m]."""
WINDOW = 6.0
"""Largest time between two that pass the point at which their paths cross [s]."""
LEAST_ANGLE = np.radians(15.0)
"""Least angle between pieces of paths that cross [rad]; detectors ask for more."""
CELL = 4.0
"""Least cell size of the grid in which pieces of paths are looked up [m]."""
# By a chord and not by headings, which some formats take from the motion and some from a tracker's
# box.
AROUND = 2.0
"""Distance before and after a point of a path between which its course is taken [m]."""
BEFORE, AFTER = 30.0, 15.0
"""Path length before and after a crossing over which the turn angle is measured [m]."""

# The joining point is where a path comes this near, not where both are one: the last metres of a
# turn are tangential, so that 0.1 m of noise moves their end by metres, and the 2 m line, which is
# crossed at 30°, by 0.2 m.
NEAR = 2.0
"""Distance below which two paths are one [m]: a car is 1.8 m wide."""
ONE_WAY = np.radians(20.0)
"""Largest angle between the courses of paths that are one [rad]."""


@dataclass(frozen=True, eq=False)
class Joins:
    """Where paths of two motor vehicles come together, and lead the same way for a while.

    A pair may have several. Where one of both has been on the shared part from its beginning there
    is none.

    Attributes:
        first: ``(K,)`` participant.
        other: ``(K,)`` participant, a greater number.
        first_at: ``(K,)`` instant at which its centre comes to the shared part.
        other_at: ``(K,)``.
        first_length: ``(K,)`` of its path until there [m].
        other_length: ``(K,)`` [m].
        shared: ``(K,)`` length of the shared part [m].
    """

    first: Int
    other: Int
    first_at: Float
    other_at: Float
    first_length: Float
    other_length: Float
    shared: Float


@dataclass(frozen=True, eq=False)
class Crossings:
    """Where paths of two cross: of each pair the crossing with the least time between them.

    Attributes:
        first: ``(K,)`` participant.
        other: ``(K,)`` participant, a greater number.
        first_at: ``(K,)`` instant at which its centre passes the point.
        other_at: ``(K,)``.
    """

    first: Int
    other: Int
    first_at: Float
    other_at: Float


class Paths:
    """The paths of all participants of a cleaned recording.

    Args:
        traffic: the recording.
        clock: its own.

    Attributes:
        traffic: the recording.
        clock: its own.
        vertices: the states through which the paths lead, by participant and time.
    """

    def __init__(self, traffic: RecordedTraffic, clock: Clock) -> None:
        self.traffic, self.clock = traffic, clock
        marked = np.zeros(len(traffic.x), np.bool_)
        # With all states, the noise of who stands in a queue would cross everything.
        mark_vertices(traffic.first, traffic.x, traffic.y, VERTEX, marked)
        self.vertices = np.flatnonzero(marked)
        self._first = np.searchsorted(self.vertices, traffic.first)
        steps = np.hypot(np.diff(traffic.x[self.vertices]), np.diff(traffic.y[self.vertices]))
        self._length = np.concatenate([[0.0], np.cumsum(steps)])

    def crossings(self) -> Crossings:
        """Return where paths cross that are passed within `WINDOW`; one at least by a vehicle."""
        traffic, vertex = self.traffic, self.vertices
        who = traffic.participant[vertex]
        piece = np.flatnonzero(who[1:] == who[:-1])
        a, b, who = vertex[piece], vertex[piece + 1], who[piece]
        if not len(piece):
            none = np.empty(0, np.int64)
            return Crossings(none, none, np.empty(0), np.empty(0))
        x, y, instant = traffic.x, traffic.y, self.clock.instant
        # Not smaller than the longest piece: pieces that cross then lie in neighbouring cells.
        size = max(CELL, float(np.hypot(x[b] - x[a], y[b] - y[a]).max()))
        column, line = (
            np.floor((values[a] + values[b]) / (2.0 * size)).astype(np.int64) for values in (x, y)
        )
        column, line = column - column.min(), line - line.min() + 1
        row = int(line.max()) + 2
        cell = column * row + line
        order = np.lexsort((instant[b], cell))
        cells, first = np.unique(cell[order], return_index=True)
        arguments = (
            cells,
            np.append(first, len(order)).astype(np.int64),
            row,
            who[order],
            a[order],
            b[order],
            x,
            y,
            instant,
            _roles(traffic, self.clock),
            WINDOW / traffic.facts.time_step,
            float(np.sin(LEAST_ANGLE)),
        )
        room = 1 << 12
        while True:
            pairs, times = np.empty((room, 2), np.int64), np.empty((room, 2))
            count = mark_crossings(*arguments, pairs, times)
            if count <= room:
                break
            room = count
        return _of_pairs(pairs[:count], times[:count])

    def joins(self) -> Joins:
        """Return where paths of motor vehicles join that are passed within `WINDOW`."""
        traffic, vertex = self.traffic, self.vertices
        who, instant = traffic.participant[vertex], self.clock.instant
        x, y = traffic.x[vertex], traffic.y[vertex]
        column, line = (np.floor(values / NEAR).astype(np.int64) for values in (x, y))
        column, line = column - column.min(), line - line.min() + 1
        row = int(line.max()) + 2
        cell = column * row + line
        entries = np.lexsort((instant[vertex], cell))
        cells, first = np.unique(cell[entries], return_index=True)
        arguments = (
            cells, np.append(first, len(entries)).astype(np.int64), row, entries, cell, self._first,
            who, x, y, self._length, vertex, traffic.x, traffic.y, instant,
            _roles(traffic, self.clock), WINDOW / traffic.facts.time_step, NEAR,
            float(np.cos(ONE_WAY)),
        )  # fmt: skip
        room = 1 << 12
        while True:
            pairs, places = np.empty((room, 2), np.int64), np.empty((room, 5))
            count = mark_joins(*arguments, pairs, places)
            if count <= room:
                break
            room = count
        return Joins(*pairs[:count].T, *places[:count].T)

    def length(self, who: int, instant: float) -> float:
        """Return how long a path is up to an instant at which its participant is recorded [m]."""
        x, y, state = self._position(who, instant)
        first, last = int(self._first[who]), int(self._first[who + 1])
        v = first + int(np.searchsorted(self.vertices[first:last], state, side="right")) - 1
        at = self.vertices[v]
        rest = float(np.hypot(x - self.traffic.x[at], y - self.traffic.y[at]))
        return float(self._length[v] - self._length[first]) + rest

    def point(self, who: int, length: float) -> tuple[float, float]:
        """Return the point of a path at a length, or the nearer end (x, y) [m]."""
        part = slice(int(self._first[who]), int(self._first[who + 1]))
        lengths = self._length[part] - self._length[part.start]
        at = self.vertices[part]
        return (
            float(np.interp(length, lengths, self.traffic.x[at])),
            float(np.interp(length, lengths, self.traffic.y[at])),
        )

    def course(self, who: int, length: float) -> float:
        """Return the direction of a path at a length, or at the nearer end [rad]."""
        first, last = int(self._first[who]), int(self._first[who + 1]) - 1
        whole = float(self._length[last] - self._length[first])
        middle = min(max(length, min(AROUND, 0.5 * whole)), max(whole - AROUND, 0.5 * whole))
        (x, y), (u, v) = (self.point(who, middle + way * AROUND) for way in (-1.0, 1.0))
        return float(np.arctan2(v - y, u - x))

    def turn(self, who: int, length: float) -> tuple[float, float]:
        """Return the course `BEFORE` a length, and by how much it turns until `AFTER` it [rad].

        Where less is recorded, it is that of what is. A turn to the left is positive.
        """
        before, after = (self.course(who, max(length + way, 0.0)) for way in (-BEFORE, AFTER))
        return before, float(wrap(np.array([after - before]))[0])

    def _position(self, who: int, instant: float) -> tuple[float, float, int]:
        """Return x, y [m], and the state before."""
        first, last = int(self.traffic.first[who]), int(self.traffic.first[who + 1]) - 1
        at = min(max(instant - int(self.clock.begin[who]) + first, first), last)
        k = min(int(at), last - 1) if last > first else first
        onward, share = min(k + 1, last), at - k
        x, y = (
            float(values[k] + share * (values[onward] - values[k]))
            for values in (self.traffic.x, self.traffic.y)
        )
        return x, y, k


def _roles(traffic: RecordedTraffic, clock: Clock) -> Int:
    role = np.zeros(len(traffic.kind), np.int64)
    role[np.isin(traffic.kind, (PEDESTRIAN, BICYCLE))] = 2
    role[np.isin(traffic.kind, EGOS)] = 1
    return np.where(clock.is_whole, role, 0)


def _of_pairs(pairs: Int, times: Float) -> Crossings:
    """Return of each pair the crossing with the least time between; of equal ones the first."""
    apart = np.abs(times[:, 0] - times[:, 1])
    order = np.lexsort((times[:, 0], apart, pairs[:, 1], pairs[:, 0]))
    pairs, times = pairs[order], times[order]
    new = np.ones(len(pairs), np.bool_)
    new[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    return Crossings(pairs[new, 0], pairs[new, 1], times[new, 0], times[new, 1])
