"""The road along the ego's route with its lanes beside, for planners that know lanes and no map.

A corridor is a chain of sections; each has the lanes of the ego's direction, from left to right.
A place in it is a station s along the centre of the route's lanes and an offset d to the left.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter

import numpy as np

from bridgegen.adapters.planners._corridor_kernels import places
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import Lane, RoadMap

DRIVABLE = frozenset(
    ("driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane", "bidirectional")
)
"""OpenDRIVE's types of the lanes that a corridor has."""

BEFORE, BEYOND = 150.0, 300.0
"""Length of the road that a corridor has before the route's begin and beyond its end [m], where the
way is the only one."""

PARALLEL, PARALLEL_ANGLE = 1.0, np.radians(5.0)
"""Largest distance [m] and angle [rad] between the ends of lanes of a junction that run beside each
other."""


@dataclass(frozen=True)
class CorridorLane:
    """One lane of a section.

    Attributes:
        centre: ``(K, 2)`` float64, x and y [m].
        station: ``(K,)`` float64 [m], of these points along the route, increasing.
        offset: ``(K,)`` float64 [m], how far to the left of the route they are.
        width: ``(K,)`` float64 [m].
        speed_limit: ``(K,)`` float64 [m/s]; +inf where none is posted.
        next: the index of the lane of the next section that it leads to; -1: none.
        may_change_left: whether the marking allows it.
        may_change_right: likewise.
    """

    centre: Float
    station: Float
    offset: Float
    width: Float
    speed_limit: Float
    next: int
    may_change_left: bool
    may_change_right: bool

    def at(self, s: float) -> tuple[float, float, float]:
        """Return offset [m], width [m] and speed limit [m/s] at a station."""
        stations, offset, width, limit = self._columns
        k = bisect_right(stations, s) - 1
        if k < 0 or k == len(stations) - 1:
            k = max(k, 0)
            return offset[k], width[k], limit[k]
        u = (s - stations[k]) / (stations[k + 1] - stations[k])
        return (
            offset[k] + u * (offset[k + 1] - offset[k]),
            width[k] + u * (width[k + 1] - width[k]),
            limit[k],
        )

    @cached_property
    def _columns(self) -> tuple[list[float], ...]:
        arrays = (self.station, self.offset, self.width, self.speed_limit)
        return tuple(array.tolist() for array in arrays)  # lists: a number of an array takes longer


@dataclass(frozen=True)
class Section:
    """A piece of the road with the same lanes all along.

    Attributes:
        start: the station of its begin [m].
        end: of its end [m].
        lanes: from left to right.
    """

    start: float
    end: float
    lanes: tuple[CorridorLane, ...]


class Corridor:
    """The road along a route.

    Args:
        road: the network, with the ego's route.

    Attributes:
        sections: from the first to the last.

    Raises:
        InputError: the route is on no lane.
    """

    def __init__(self, road: RoadMap) -> None:
        lanes = {lane.id: lane for lane in road.lanes}
        route = [lanes[name] for name in road.route if name in lanes]
        if not route:
            raise InputError("a planner that drives on lanes needs a route on them, got none")
        chain = _extended(route, lanes)
        pieces = [lane.centre[:, :2] for lane in chain]
        points = np.concatenate(pieces)
        step = np.hypot(*np.diff(points, axis=0).T)
        distinct = np.concatenate([[True], step > 1e-6])
        self._points = points[distinct]
        delta = np.diff(self._points, axis=0)
        self._length = np.hypot(delta[:, 0], delta[:, 1])
        self._direction = delta / self._length[:, None]
        self._station = np.concatenate([[0.0], np.cumsum(self._length)])
        all_stations = np.interp(
            np.cumsum(distinct) - 1, np.arange(len(self._station)), self._station
        )
        ends = np.cumsum([len(piece) for piece in pieces])
        rows = _rows(chain, lanes)
        sections = []
        for k, row in enumerate(rows):
            first, last = ends[k] - len(pieces[k]), ends[k] - 1
            following = [item.id for item in rows[k + 1]] if k + 1 < len(rows) else []
            begin, end = float(all_stations[first]), float(all_stations[last])
            sections.append(
                Section(begin, end, tuple(self._lane(item, following, begin, end) for item in row))
            )
        self.sections = tuple(sections)
        self._starts = np.array([section.start for section in sections])

    @property
    def length(self) -> float:
        """Its length along the route [m]."""
        return float(self._station[-1])

    def places(self, x: Float, y: Float) -> tuple[Float, Float, Float]:
        """Return the nearest place of each of Q points: station, offset [m], heading there [rad].

        Before the begin and beyond the end, the road goes straight on.
        """
        found = np.empty((len(x), 3))
        places(self._points, self._direction, self._length, x, y, found)
        nearest = found[:, 0].astype(np.int64)
        direction = self._direction[nearest]
        return (
            self._station[nearest] + found[:, 1],
            found[:, 2],
            np.arctan2(direction[:, 1], direction[:, 0]),
        )

    def point(self, s: float, d: float) -> tuple[float, float]:
        """Return x and y [m] of a place."""
        k = min(
            max(int(np.searchsorted(self._station, s, side="right")) - 1, 0), len(self._length) - 1
        )
        along, direction = s - self._station[k], self._direction[k]
        x, y = self._points[k] + along * direction
        return float(x - d * direction[1]), float(y + d * direction[0])

    def poses(self, s: Float) -> Float:
        """Return x, y [m] and heading [rad] of the route at each station ``(Q,)``, ``(Q, 3)``."""
        last = len(self._length) - 1
        k = np.clip(np.searchsorted(self._station, s, side="right") - 1, 0, last)
        direction = self._direction[k]
        place = self._points[k] + (s - self._station[k])[:, None] * direction
        return np.column_stack([place, np.arctan2(direction[:, 1], direction[:, 0])])

    def section_at(self, s: Float) -> Int:
        """Return the index of the section at each station ``(Q,)``."""
        return np.clip(
            np.searchsorted(self._starts, s, side="right") - 1, 0, len(self.sections) - 1
        ).astype(np.int64)

    def lane_at(self, section: int, s: float, d: float) -> tuple[int, bool]:
        """Return the nearest lane of a section, and whether the place is on it."""
        nearest, least, width = 0, math.inf, 0.0
        for i, lane in enumerate(self.sections[section].lanes):
            offset, wide, _ = lane.at(s)
            aside = abs(d - offset)
            if aside < least:
                nearest, least, width = i, aside, wide
        return nearest, least <= 0.5 * width

    def _lane(self, lane: Lane, following: list[str], begin: float, end: float) -> CorridorLane:
        station, offset, _ = self.places(lane.centre[:, 0], lane.centre[:, 1])
        kept: Bool = np.concatenate([[True], np.diff(np.maximum.accumulate(station)) > 1e-6])
        if kept.sum() < 2:
            kept[:] = True
        width = np.hypot(*(lane.left - lane.right).T)
        leads = [following.index(name) for name in lane.next if name in following]
        return CorridorLane(
            lane.centre[kept, :2],
            np.clip(station[kept], begin, end),
            offset[kept],
            width[kept],
            lane.speed_limit[kept],
            leads[0] if leads else -1,
            lane.may_change_left,
            lane.may_change_right,
        )


def _extended(route: list[Lane], lanes: dict[str, Lane]) -> list[Lane]:
    """Return the route's lanes, with those before and beyond where there is one way only."""
    chain, known = list(route), {lane.id for lane in route}
    for limit, ahead in ((BEFORE, False), (BEYOND, True)):
        length = 0.0
        while length < limit:
            edge = chain[-1] if ahead else chain[0]
            ways = [name for name in (edge.next if ahead else edge.previous) if name in lanes]
            if len(ways) != 1 or ways[0] in known:
                break
            lane = lanes[ways[0]]
            known.add(lane.id)
            chain.insert(len(chain) if ahead else 0, lane)
            length += float(np.hypot(*np.diff(lane.centre[:, :2], axis=0).T).sum())
    return chain


def _rows(chain: list[Lane], lanes: dict[str, Lane]) -> list[list[Lane]]:
    """Return the lanes of each section, from left to right.

    In a junction each lane may be a road of its own: those that go on from the lanes before it,
    parallel to the route, belong to it.
    """
    rows = [_beside(lane, lanes) for lane in chain]
    for k in range(1, len(chain)):
        if not chain[k].junction:
            continue
        known = {row.id for row in rows[k]}
        ways = [lanes[name] for row in rows[k - 1] for name in row.next if name in lanes]
        others = [way for way in ways if way.id not in known and way.kind in DRIVABLE]
        sides = [(_side(chain[k], other), other) for other in others]
        sides.sort(key=itemgetter(0), reverse=True)
        rows[k] = [
            *(side for left, side in sides if left > 0.0),
            *rows[k],
            *(side for left, side in sides if left < 0.0),
        ]
    return rows


def _side(lane: Lane, other: Lane) -> float:
    """Return how far to the left of a lane another one is that runs parallel to it [m]; else 0."""
    lefts = []
    for end in (0, -1):
        (x, y, h), (u, w, g) = lane.centre[end, :3], other.centre[end, :3]
        ahead = (u - x) * np.cos(h) + (w - y) * np.sin(h)
        if abs(ahead) > PARALLEL or np.cos(g - h) < np.cos(PARALLEL_ANGLE):
            return 0.0
        lefts.append(float((w - y) * np.cos(h) - (u - x) * np.sin(h)))
    return lefts[0] if abs(lefts[1] - lefts[0]) <= PARALLEL else 0.0


def _beside(lane: Lane, lanes: dict[str, Lane]) -> list[Lane]:
    """Return a lane and those beside it that go the same way, from left to right."""
    row = [lane]
    while row[0].left_is_same_way and row[0].left_lane in lanes:
        row.insert(0, lanes[row[0].left_lane])
        if row[0].kind not in DRIVABLE or len(row) > len(lanes):
            row.pop(0)
            break
    while row[-1].right_is_same_way and row[-1].right_lane in lanes:
        row.append(lanes[row[-1].right_lane])
        if row[-1].kind not in DRIVABLE or len(row) > len(lanes):
            row.pop()
            break
    return row
