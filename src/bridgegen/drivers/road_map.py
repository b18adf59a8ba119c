"""The road network as drivers get it that want "map": lanes, crosswalks, lights and pieces."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.drivers.interface import (
    BORDER,
    BROKEN,
    CENTRE,
    CROSSWALK,
    PIECE_POINTS,
    SOLID,
    STOP_LINE,
    UNMARKED,
    Lane,
    Light,
    RoadMap,
)
from bridgegen.drivers.right_of_way import inner
from bridgegen.drivers.scene import line_of, speed_limits
from bridgegen.openx.opendrive.geometry import Curve, reference_line
from bridgegen.openx.opendrive.lane_changes import (
    CROSSED,
    NONE,
    allows_change,
    between,
    marking,
    neighbour,
)
from bridgegen.openx.opendrive.lanes import borders, section_end, section_index
from bridgegen.openx.opendrive.legs import governs, signals_on
from bridgegen.openx.opendrive.model import OpenDrive, Road, RoadMark
from bridgegen.openx.opendrive.outline import outline_of, stop_lines
from bridgegen.openx.opendrive.routes import Route, Stretch, next_stretches

SPACING = 2.0
"""Largest distance between two points of a lane or piece [m]."""

ROUNDING = 1e-6
"""Relative tolerance of ``SPACING``."""

MOST_CUTS = 10.0
"""Largest number of cuts across a section per metre."""

UNUSED = frozenset(("none", "median", "curb", "rail", "tram"))
"""Types of lanes that neither vehicles nor cyclists nor pedestrians use."""


class Line(NamedTuple):
    """A polyline of the map.

    Attributes:
        points: ``(K, 2)`` [m].
        kind: CENTRE, BORDER, CROSSWALK or STOP_LINE.
        lane: index of the lane that it belongs to, or -1.
        light: index of a light, or -1.
        marking: of a border.
        h: ``(K,)`` headings [rad]; None: those of its segments.
    """

    points: Float
    kind: int
    lane: int = -1
    light: int = -1
    marking: int = UNMARKED
    h: Float | None = None


class _Section(NamedTuple):
    """A lane section, cut across every `SPACING`."""

    road: Road
    number: int
    s: Float
    line: Curve
    t: dict[int, Float]

    def points(self, t: Float) -> Float:
        return np.stack(
            (
                self.line.x - t * elementary.sin(self.line.h),
                self.line.y + t * elementary.cos(self.line.h),
            ),
            axis=1,
        )


def road_map(model: OpenDrive, route: Route | None, lights: Sequence[str]) -> RoadMap:
    """Return a road network.

    Args:
        model: it.
        route: of the ego; None off the lanes.
        lights: ids of the traffic lights that change.
    """
    sections = [_cut(road, number) for road in model.roads for number in range(len(road.sections))]
    stretches = [
        Stretch(item.road.id, item.number, lane.id)
        for item in sections
        for lane in item.road.sections[item.number].lanes
        if lane.type not in UNUSED
    ]
    numbers = {stretch: number for number, stretch in enumerate(stretches)}
    onward = {
        stretch: tuple(
            _id(item) for item in dict.fromkeys(next_stretches(model, stretch)) if item in numbers
        )
        for stretch in stretches
    }
    back: dict[str, list[str]] = {}
    for stretch, following in onward.items():
        for name in following:
            back.setdefault(name, []).append(_id(stretch))
    lanes: list[Lane] = []
    lines: list[Line] = []
    for section in sections:
        for lane in section.road.sections[section.number].lanes:
            stretch = Stretch(section.road.id, section.number, lane.id)
            if stretch in numbers:
                lanes.append(
                    _lane(section, lane.id, numbers, onward[stretch], back.get(_id(stretch), ()))
                )
                lines.append(_centre(lanes[-1], len(lanes) - 1))
        lines += _borders(section, numbers)
    by_id = {lane.id: number for number, lane in enumerate(lanes)}
    signals = tuple(_light(model, light, by_id) for light in lights)
    light_of = np.full(len(lanes), -1)
    for number in reversed(range(len(signals))):
        light_of[[by_id[name] for name in signals[number].lanes]] = number
    lines = [
        line._replace(light=int(light_of[line.lane])) if line.lane >= 0 else line for line in lines
    ]
    crosswalks = tuple(_crosswalks(model))
    lines += [
        Line(np.concatenate((crosswalk, crosswalk[:1])), CROSSWALK) for crosswalk in crosswalks
    ]
    lines += _stop_lines(model, signals)
    return RoadMap(tuple(lanes), _route(model, route, by_id), crosswalks, signals, **_pieces(lines))


def _id(stretch: Stretch) -> str:
    return ":".join(map(str, stretch))


def _cut(road: Road, number: int) -> _Section:
    low, high = road.sections[number].s, section_end(road, number)
    n = max(1, math.ceil((high - low) / SPACING - ROUNDING))
    while True:
        s = np.linspace(low, high, n + 1)
        found = _Section(road, number, s, reference_line(road, s), borders(road, number, s))
        edges = (np.diff(found.points(found.t[item]), axis=0) for item in found.t)
        longest = max(float(elementary.hypot(edge[:, 0], edge[:, 1]).max()) for edge in edges)
        if longest <= SPACING * (1.0 + ROUNDING) or n >= MOST_CUTS * (high - low):
            return found
        n = math.ceil(n * 1.1 * longest / SPACING)


def _lane(
    section: _Section,
    lane_id: int,
    numbers: dict[Stretch, int],
    following: Sequence[str],
    previous: Sequence[str],
) -> Lane:
    road, number, s, line, t = section
    way = road.direction(lane_id)
    edges = (t[lane_id], t[inner(lane_id)])
    centre = 0.5 * (edges[0] + edges[1])
    tilt = elementary.atan2(np.gradient(centre, s), 1.0 - line.curvature * centre)
    h = line.h + tilt + (0.0 if way > 0 else math.pi)
    # In its direction of travel the outer border is to the right of right-hand traffic.
    left, right = edges[::-1] if (lane_id < 0) == (way > 0) else edges
    beside: dict[str, Any] = {}
    for name, side in (("left", 1), ("right", -1)):
        other = neighbour(road, lane_id, side)
        mark = _mark(section, between(lane_id, other))
        lane = road.sections[number].lane(other)
        is_there = Stretch(road.id, number, other) in numbers
        same = is_there and road.direction(other) == way
        own = road.sections[number].lane(lane_id)
        may = allows_change(mark, between(lane_id, other), lane_id, other)
        both = bool(own and own.drivable and lane and lane.drivable)
        beside |= {
            f"{name}_lane": _id(Stretch(road.id, number, other)) if is_there else "",
            f"{name}_is_same_way": same,
            f"{name}_marking": mark.type if mark else NONE,
            f"may_change_{name}": same and both and may,
        }
    kind = road.sections[number].lane(lane_id)
    assert kind is not None
    return Lane(
        id=_id(Stretch(road.id, number, lane_id)),
        kind=kind.type,
        centre=np.column_stack((section.points(centre), h))[::way],
        left=section.points(left)[::way],
        right=section.points(right)[::way],
        speed_limit=speed_limits(road, number, lane_id, s)[::way],
        junction=road.junction if road.is_connecting else "",
        next=tuple(following),
        previous=tuple(previous),
        **beside,
    )


def _mark(section: _Section, border: int) -> RoadMark | None:
    """Return the marking in the middle of a section."""
    return marking(
        section.road.sections[section.number], border, 0.5 * (section.s[-1] - section.s[0])
    )


def _headings(points: Float) -> Float:
    """Return the headings of a polyline at its points [rad], continuous."""
    dx, dy = np.diff(points, axis=0).T
    h = np.unwrap(elementary.atan2(dy, dx))
    return np.concatenate((h[:1], 0.5 * (h[1:] + h[:-1]), h[-1:]))


def _centre(lane: Lane, number: int) -> Line:
    return Line(lane.centre[:, :2], CENTRE, number, h=lane.centre[:, 2])


def _borders(section: _Section, numbers: dict[Stretch, int]) -> Iterator[Line]:
    """Yield the borders of a section's lanes, in the direction of the road."""
    road, number = section.road, section.number
    for border in sorted(section.t):
        lanes = (border, -1, 1) if border == 0 else (border, _outer(border))
        owners = (numbers.get(Stretch(road.id, number, lane)) for lane in lanes)
        owner = next((item for item in owners if item is not None), None)
        if owner is not None:
            mark = _mark(section, border)
            yield Line(section.points(section.t[border]), BORDER, owner, marking=_code(mark))


def _outer(lane_id: int) -> int:
    return lane_id + (1 if lane_id > 0 else -1)


def _code(mark: RoadMark | None) -> int:
    """Return how a border is marked, as a code."""
    if mark is None or mark.type == NONE:
        return UNMARKED
    lines = [mark.type] if mark.type in CROSSED else mark.type.split()
    return BROKEN if all(line in CROSSED for line in lines) else SOLID


def _crosswalks(model: OpenDrive) -> Iterator[Float]:
    for road in model.roads:
        for obj in road.objects:
            corners = outline_of(road, obj) if (obj.type or "").lower() == "crosswalk" else None
            if corners is not None and len(corners) >= 3:
                yield corners


def _light(model: OpenDrive, light: str, by_id: dict[str, int]) -> Light:
    """Return a light: the lanes where it stands, and its stop line across the first of them."""
    lanes: dict[str, None] = {}
    stop = np.full((2, 2), np.nan)
    for road in model.roads:
        for signal in signals_on(road):
            if signal.id != light:
                continue
            number = section_index(road, min(max(signal.s, 0.0), road.length))
            governed = [
                lane.id
                for lane in road.sections[number].lanes
                if lane.drivable and governs(road, signal, lane.id)
            ]
            ids = [_id(Stretch(road.id, number, item)) for item in governed]
            lanes |= dict.fromkeys(name for name in ids if name in by_id)
            if governed and np.isnan(stop).all():
                stop = _across(road, number, governed, signal.s)
    return Light(light, tuple(lanes), stop)


def _across(road: Road, number: int, lanes: Sequence[int], s: float) -> Float:
    """Return the stop line before a light across some lanes: its ends ``(2, 2)`` [m]."""
    way = road.direction(lanes[0])
    entry = 0.0 if way > 0 else road.length  # of a junction: one does not stop within
    at = entry if road.is_connecting else line_of(road, s, lanes[0])
    at = min(max(at, 0.0), road.length)
    number = section_index(road, at) if not road.is_connecting else number
    t = borders(road, number, np.array([at]))
    edges = [float(t[item][0]) for lane in lanes if lane in t for item in (lane, inner(lane))]
    line = reference_line(road, np.array([at, at]))
    ends = np.array([min(edges, default=0.0), max(edges, default=0.0)])
    return np.stack(
        (line.x - ends * elementary.sin(line.h), line.y + ends * elementary.cos(line.h)), axis=1
    )


def _stop_lines(model: OpenDrive, lights: Sequence[Light]) -> Iterator[Line]:
    """Yield the stop lines of lights, then the painted ones."""
    for number, light in enumerate(lights):
        if np.isfinite(light.stop).all():
            yield Line(light.stop, STOP_LINE, light=number)
    for road in model.roads:
        for _, ends in stop_lines(road):
            yield Line(ends, STOP_LINE)


def _route(model: OpenDrive, route: Route | None, by_id: dict[str, int]) -> tuple[str, ...]:
    found: dict[str, None] = {}
    for step in route.steps if route else ():
        road = model.road(step.road_id)
        number = section_index(road, 0.5 * (step.s + step.s_end))
        found[_id(Stretch(step.road_id, number, step.lane_id))] = None
    return tuple(name for name in found if name in by_id)


def _pieces(lines: Sequence[Line]) -> dict[str, Any]:
    """Return polylines cut into pieces, as the arrays of a `RoadMap`."""
    each = PIECE_POINTS - 1
    pieces: list[Float] = []
    counts: list[int] = []
    owners: list[int] = []
    for owner, line in enumerate(lines):
        points = line.points if line.h is not None else _refined(line.points)
        h = _headings(points) if line.h is None else line.h
        whole = np.column_stack((points, h))
        for first in range(0, max(len(whole) - 1, 1), each):
            part = whole[first : first + PIECE_POINTS]
            counts.append(len(part))
            owners.append(owner)
            pieces.append(np.concatenate((part, np.repeat(part[-1:], PIECE_POINTS - len(part), 0))))
    of = np.array(owners, dtype=np.int64)

    def column(name: str, kind: Any) -> Any:
        return np.array([getattr(line, name) for line in lines], dtype=kind)[of]

    return {
        "pieces": np.array(pieces).reshape(len(pieces), PIECE_POINTS, 3),
        "piece_points": np.array(counts, dtype=np.int64),
        "piece_kind": column("kind", np.int8),
        "piece_lane": column("lane", np.int64),
        "piece_light": column("light", np.int64),
        "piece_marking": column("marking", np.int8),
    }


def _refined(points: Float) -> Float:
    """Return a polyline with points `SPACING` apart at most."""
    found = [points[:1]]
    for a, b in pairwise(points):
        n = max(1, math.ceil(elementary.hypot(b[0] - a[0], b[1] - a[1]) / SPACING - ROUNDING))
        found.append(a + (b - a) * (np.arange(1, n + 1) / n)[:, None])
    return np.concatenate(found)
