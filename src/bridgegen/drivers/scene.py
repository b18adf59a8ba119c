"""What a driver knows of the map before it drives: its route, and the ways of other participants.

All of it comes from the map. The ways are all lane chains that lead on from where an entity starts
(or changes to); the driver does not know which of them it takes.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.drivers.right_of_way import (
    AT_JUNCTION,
    NO_RULE,
    STOP_SIGN,
    WE_WAIT,
    claims,
    crossings,
    inner,
    right_of_way,
)
from bridgegen.openx.opendrive.geometry import reference_line
from bridgegen.openx.opendrive.lane_changes import changes, marking
from bridgegen.openx.opendrive.lanes import borders, section_end, section_index
from bridgegen.openx.opendrive.legs import governs, signals_on
from bridgegen.openx.opendrive.model import SPEED_UNITS, OpenDrive, Road
from bridgegen.openx.opendrive.outline import outline_of
from bridgegen.openx.opendrive.routes import Place, Route, Step, Stretch, next_stretches, plan_route
from bridgegen.scenario.weather import ROAD_TYPES

Number = TypeVar("Number", bound=np.generic)

WAYS = 6
"""Maximum number of ways on which an entity is expected."""

WAY_LENGTH = 300.0
"""Length up to which a way is followed [m]."""

NARROW = 2.2
"""Minimum width [m] of a lane to change to."""

LINE_REACH = 15.0
"""Maximum distance between a light and its stop line [m along the road]."""

SAMPLE = 0.5
"""Approximate distance between two samples of a way [m]."""

STOP_LINE = "stopline"

KERB_REACH = 1.0
"""Maximum distance between a kerb and where its crosswalk begins [m]; ours."""


class Scene(NamedTuple):
    """What a driver knows of P road networks; padding has no samples, or lies at infinity.

    Attributes:
        road: ``(P, L, 3)``, see `road_along`.
        classes: ``(P, M, 5)``, see `classes_along`.
        stops: ``(P, S)`` [m], the stations of the stop lines of S lights on the ego's route.
        halts: ``(P, H)`` [m], the stations of the lines of stop signs on it.
        crosswalks: ``(P, C, 4)``, see `crosswalks`.
        hypotheses: ``(P, W, L', 6)``, ways: x, y [m], heading [rad], its cosine and sine,
            curvature [1/m].
        hypothesis_counts: ``(P, W)`` int64, samples of each.
        hypothesis_steps: ``(P, W)`` [m], between two samples.
        hypothesis_zones: ``(P, W, ZONE)``, where each meets the ego's; see ``_yielding_kernels``.
        hypothesis_ranks: ``(P, W)`` int64, which gives way where they meet; see ``right_of_way``.
        hypothesis_first: ``(P, E + 1)`` int64: entity e's are those from ``[e]`` to ``[e + 1]``.
        path_ranks: ``(P, E)`` int64, as `hypothesis_ranks`, of the ways that the entities take.
        claims: ``(P, E, E)`` int64, which of two entities' routes goes first; see
            ``right_of_way.claim``.
    """

    road: Float
    classes: Float
    stops: Float
    halts: Float
    crosswalks: Float
    hypotheses: Float
    hypothesis_counts: Int
    hypothesis_steps: Float
    hypothesis_zones: Float
    hypothesis_ranks: Int
    hypothesis_first: Int
    path_ranks: Int
    claims: Int


def survey(
    model: OpenDrive,
    routes: Sequence[Route | None],
    path: Float,
    step: float,
    lights: Sequence[str],
    starts: Sequence[Sequence[tuple[Stretch, float]]],
    bodies: Float,
    ranks: Int,
) -> Scene:
    """Return what the driver knows of one road network, P = 1.

    Args:
        model: the road network.
        routes: of the entities, the ego's first; None off the lanes.
        path: the samples of the ego's, ``(n, 6)``.
        step: between two of them [m].
        lights: ids of the traffic lights that change.
        starts: per entity the lanes that it starts or changes to, and where [m along the road].
        bodies: ``(E, ≥2)``: length and width [m].
        ranks: ``(E,)``, see `right_of_way.claims`: above 0 all give way to it.
    """
    from bridgegen.drivers._yielding_kernels import ZONE, find_zone  # numba is slow to import

    stops, route = np.full(len(lights), np.inf), routes[0]
    if route is not None:
        for line in reversed(stop_lines(model, route, lights)):
            stops[lights.index(line.light)] = line.station
        road = road_along(model, route, step, len(path))
    else:
        road = np.zeros((len(path), 3))
        road[:, 0] = np.inf
    tables: list[Float] = []
    steps: list[float] = []
    zones: list[Float] = []
    lane_ranks: list[int] = []
    first = [0]
    for e, lanes in enumerate(starts):
        for way in [way for stretch, s in lanes for way in ways_from(model, stretch, s)]:
            # A whole number of equal steps, so that the last sample is the way's end.
            way_step = way.length / math.ceil(way.length / SAMPLE)
            line_ = way.sample(way_step)
            columns = (
                line_.x,
                line_.y,
                line_.h,
                elementary.cos(line_.h),
                elementary.sin(line_.h),
                line_.curvature,
            )
            tables.append(np.stack(columns, axis=1))
            steps.append(way_step)
            zone = np.empty(ZONE)
            find_zone(
                path,
                len(path),
                step,
                bodies[0],
                tables[-1],
                len(tables[-1]),
                way_step,
                bodies[e],
                zone,
            )
            zones.append(zone)
            rank = right_of_way(model, route, way, lights) if route is not None else NO_RULE
            # An emergency vehicle on a call goes first on every way that it may take.
            lane_ranks.append(WE_WAIT if ranks[e] > 0 else rank)
        first.append(len(tables))
    ways = np.zeros((len(tables), max(map(len, tables), default=0), 6))
    for i, table in enumerate(tables):
        ways[i, : len(table)] = table
    return Scene(
        road[None],
        classes_along(model, route)[None],
        stops[None],
        np.array([[] if route is None else stop_signs(model, route)], dtype=np.float64),
        crosswalks(model, path, step)[None],
        ways[None],
        np.array([[len(table) for table in tables]], dtype=np.int64),
        np.array([steps], dtype=np.float64),
        np.array(zones, dtype=np.float64).reshape(1, len(zones), ZONE),
        np.array([lane_ranks], dtype=np.int64),
        np.array([first], dtype=np.int64),
        np.array(
            [
                [
                    WE_WAIT
                    if ranks[e] > 0
                    else NO_RULE
                    if item is None or route is None
                    else right_of_way(model, route, item, lights)
                    for e, item in enumerate(routes)
                ]
            ]
        ),
        claims(model, routes, ranks, lights)[None],
    )


def stacked(scenes: Sequence[Scene]) -> Scene:
    """Return the scenes of several road networks as one; what is missing is padded."""
    return Scene(
        _padded([scene.road for scene in scenes], np.inf),
        _padded([scene.classes for scene in scenes], np.inf),
        _padded([scene.stops for scene in scenes], np.inf),
        _padded([scene.halts for scene in scenes], np.inf),
        _padded([scene.crosswalks for scene in scenes], np.inf),
        _padded([scene.hypotheses for scene in scenes], 0.0),
        _padded([scene.hypothesis_counts for scene in scenes], 0),
        _padded([scene.hypothesis_steps for scene in scenes], 1.0),
        _padded([scene.hypothesis_zones for scene in scenes], np.inf),
        _padded([scene.hypothesis_ranks for scene in scenes], 0),
        _padded([scene.hypothesis_first for scene in scenes], 0),
        _padded([scene.path_ranks for scene in scenes], 0),
        _padded([scene.claims for scene in scenes], 0),
    )


def _padded(arrays: Sequence[npt.NDArray[Number]], pad: float) -> npt.NDArray[Number]:
    """Return arrays ``(1, …)`` as one, each as large as the largest."""
    shape = np.max([array.shape[1:] for array in arrays], axis=0)
    found = np.full((len(arrays), *shape), pad, dtype=arrays[0].dtype)
    for each, array in zip(found, arrays, strict=True):
        each[tuple(slice(0, size) for size in array.shape[1:])] = array[0]
    return found


@dataclass(frozen=True)
class StopLine:
    """Where the ego's route crosses the stop line of a light.

    Attributes:
        light: the light's id.
        station: on the route [m].
    """

    light: str
    station: float


def road_along(model: OpenDrive, route: Route, step: float, count: int) -> Float:
    """Return speed limits and lanes beside a route, at every sample of it.

    Returns:
        ``(count, 3)``: the speed limit [m/s], +inf where none is posted; how far left [m] the
        centre of the left lane beside is that goes the same way, and (negative) of the right one;
        0 where there is none.
    """
    found = np.zeros((count, 3))
    found[:, 0] = np.inf
    stations = np.arange(count) * step
    starts = np.array([piece.station for piece in route.pieces])
    which = np.maximum(np.searchsorted(starts, stations, side="right") - 1, 0)
    for index, piece in enumerate(route.pieces):
        at = np.flatnonzero(which == index)
        if not len(at):
            continue
        s = piece.s + piece.rate * (stations[at] - piece.station)
        road = model.road(piece.road_id)
        number = section_index(road, 0.5 * (piece.s + piece.s_end))
        lane_id = lane_of(route.steps, piece.road_id, piece.s, piece.s_end)
        section = road.sections[number]
        s = np.clip(s, section.s, section_end(road, number))
        found[at, 0] = speed_limits(road, number, lane_id, s)
        if not road.is_connecting:
            found[at, 1], found[at, 2] = _beside(road, number, lane_id, s)
    return found


def classes_along(model: OpenDrive, route: Route | None) -> Float:
    """Return the class of the road, its markings and its shoulder, from where on they are so.

    Returns:
        ``(M, 5)``: the station on the route [m], ascending; the road's class as a row of
        `ROAD_TYPES`, NaN of others; 1 where a border of the route's lane is marked, else 0; how
        far left [m] the middle of the shoulder to its right is, negative; and how wide that is
        [m], 0 where there is none. One row of NaN off the lanes.
    """
    found: list[tuple[float, ...]] = []
    for piece in route.pieces if route is not None else ():
        road = model.road(piece.road_id)
        number = section_index(road, 0.5 * (piece.s + piece.s_end))
        lane_id = lane_of(route.steps, piece.road_id, piece.s, piece.s_end) if route else 0
        section = road.sections[number]
        cuts = [kind.s for kind in road.types] + [section.s + s for s in changes(section)]
        low, high = sorted((piece.s, piece.s_end))
        ends = sorted({low, high, *(s for s in cuts if low < s < high)}, reverse=low != piece.s)
        for a, b in pairwise(ends):
            s = np.array([a, 0.5 * (a + b), b])
            kind = next((kind.type for kind in reversed(road.types) if kind.s <= s[1]), "")
            marks = [marking(section, at, s[1] - section.s) for at in (lane_id, inner(lane_id))]
            row = (
                ROAD_TYPES.index(kind) if kind in ROAD_TYPES else math.nan,
                any(mark is not None and mark.type != "none" for mark in marks),
                *_shoulder(road, number, lane_id, s),
            )
            if not found or not np.array_equal(found[-1][1:], row, equal_nan=True):
                found.append((piece.station + (a - piece.s) / piece.rate, *row))
    return np.array(found or [(0.0, *[math.nan] * 4)], dtype=np.float64)


def _shoulder(road: Road, number: int, lane_id: int, s: Float) -> tuple[float, float]:
    """Return how far left the middle of the shoulder right of a lane is, and how wide it is [m]."""
    other, t = lane_id + (1 if lane_id > 0 else -1), borders(road, number, s)
    lane = road.sections[number].lane(other)
    is_right = (lane_id < 0) == (road.direction(lane_id) > 0)
    if lane is None or lane.type not in ("shoulder", "stop") or not is_right:
        return 0.0, 0.0
    aside = 0.5 * np.abs(t[other] - t[inner(lane_id)])
    # Rounded: on a bend the same shoulder would have many rows.
    return -round(float(aside.min()), 3), round(float(np.abs(t[other] - t[lane_id]).min()), 3)


def stop_lines(model: OpenDrive, route: Route, lights: Sequence[str]) -> list[StopLine]:
    """Return the stop lines of some lights that a route crosses, in its order."""
    found: list[StopLine] = []
    for step in route.steps:
        road = model.road(step.road_id)
        low, high = min(step.s, step.s_end), max(step.s, step.s_end)
        for signal in signals_on(road):
            if signal.id not in lights or not governs(road, signal, step.lane_id):
                continue
            # Inside a junction it is for those who enter: one does not stop within.
            s = step.s if road.is_connecting else line_of(road, signal.s, step.lane_id)
            if low <= s <= high:
                a, b = route.station(road.id, s)
                found.append(StopLine(signal.id, a + b * s))
    return sorted(found, key=lambda line: line.station)


def stop_signs(model: OpenDrive, route: Route) -> list[float]:
    """Return where a route crosses the lines of stop signs [m], in its order."""
    found: list[float] = []
    for crossing in crossings(model, route):
        road, lane = model.road(crossing.before.road_id), crossing.before.lane_id
        for signal in road.signals:
            if signal.type == STOP_SIGN and governs(road, signal, lane):
                s = line_of(road, signal.s, lane)
                a, b = route.station(road.id, s)
                found.append(a + b * s)
    return sorted(found)


def crosswalks(model: OpenDrive, path: Float, step: float) -> Float:
    """Return the crosswalks that a path leads over.

    Args:
        model: the road network.
        path: ``(n, ≥4)``: x, y [m], heading [rad], its cosine and sine.
        step: between two rows [m].

    Returns:
        ``(C, 4)`` [m]: the stations where it enters and leaves each, and how far to the right
        (negative) and to the left of the path that reaches.
    """
    found: list[tuple[float, ...]] = []
    for road in model.roads:
        for obj in road.objects:
            corners = outline_of(road, obj) if (obj.type or "").lower() == "crosswalk" else None
            if corners is None or len(corners) < 3:
                continue
            inside = np.flatnonzero(_inside(path[:, :2], corners))
            if not len(inside):
                continue
            middle = path[inside[len(inside) // 2]]
            d = corners - middle[:2]
            left = -d[:, 0] * middle[4] + d[:, 1] * middle[3]
            found.append(
                (inside[0] * step, inside[-1] * step, float(left.min()), float(left.max()))
            )
    return np.array(sorted(found)).reshape(len(found), 4)


class Kerb(NamedTuple):
    """Where a path off the lanes comes onto the lanes of a road.

    Attributes:
        station: on the path [m].
        crossing: whether a crosswalk begins there.
        lights: the lights for the traffic over that crosswalk; who crosses has red while one of
            them is not red.
    """

    station: float
    crossing: bool
    lights: tuple[str, ...]


def kerbs(model: OpenDrive, path: Float, step: float, lights: Sequence[str]) -> list[Kerb]:
    """Return the kerbs that a path crosses from outside the road, in its order.

    Args:
        model: the road network.
        path: ``(n, ≥2)``: x, y [m].
        step: between two rows [m].
        lights: ids of the traffic lights that change.
    """
    points = path[:, :2]
    on_lanes = np.zeros(len(points), np.bool_)
    walks: list[tuple[Bool, tuple[str, ...]]] = []
    for road in model.roads:
        on_lanes |= _on_lanes(road, points)
        for obj in road.objects:
            corners = outline_of(road, obj) if (obj.type or "").lower() == "crosswalk" else None
            if corners is not None and len(corners) >= 3:
                near = (item for item in signals_on(road) if abs(item.s - obj.s) <= AT_JUNCTION)
                ids = tuple(dict.fromkeys(item.id for item in near if item.id in lights))
                walks.append((_inside(points, corners), ids))
    found: list[Kerb] = []
    for i in (np.flatnonzero(on_lanes[1:] & ~on_lanes[:-1]) + 1).tolist():
        at = slice(max(i - math.ceil(KERB_REACH / step), 0), i + math.ceil(KERB_REACH / step) + 1)
        here = [ids for inside, ids in walks if inside[at].any()]
        all_lights = tuple(dict.fromkeys(light for ids in here for light in ids))
        found.append(Kerb((i - 1) * step, bool(here), all_lights))
    return found


def _on_lanes(road: Road, points: Float) -> Bool:
    """Return which points ``(P, 2)`` are on lanes of a road that traffic drives on, ``(P,)``."""
    found = np.zeros(len(points), np.bool_)
    stations = np.linspace(0.0, road.length, math.ceil(road.length / SAMPLE) + 1)
    line = reference_line(road, stations)
    for i, (x, y) in enumerate(points.tolist()):
        dx, dy = x - line.x, y - line.y
        j = int(np.argmin(dx * dx + dy * dy))
        c, s = elementary.cos(line.h[j]), elementary.sin(line.h[j])
        at = stations[j] + dx[j] * c + dy[j] * s
        if not 0.0 <= at <= road.length:
            continue
        t = dy[j] * c - dx[j] * s
        number = section_index(road, float(at))
        border = {lane: float(edge[0]) for lane, edge in borders(road, number, at[None]).items()}
        section = road.sections[number]
        found[i] = any(
            min(border[lane.id], border[inner(lane.id)]) <= t
            and t <= max(border[lane.id], border[inner(lane.id)])
            for lane in (*section.left, *section.right)
            if lane.drivable
        )
    return found


def ways_from(model: OpenDrive, start: Stretch, s: float) -> list[Route]:
    """Return the ways that lead on from a lane, one for each choice at each fork.

    Args:
        model: the road network.
        start: the lane.
        s: where on it [m along its road].
    """
    lane = model.road(start.road_id).sections[start.section].lane(start.lane_id)
    if lane is None or not lane.drivable:
        return []
    return [_route(model, chain, s) for chain in _chains(model, start, s)][:WAYS]


def beside(road: Road, number: int, lane_id: int) -> list[int]:
    """Return a lane and those beside it that go the same way, the lane itself first."""
    section, way = road.sections[number], road.direction(lane_id)
    found = [lane_id]
    for other in (lane_id + 1, lane_id - 1):
        lane = section.lane(other) if other else None
        if lane is not None and lane.drivable and road.direction(other) == way:
            found.append(other)
    return found


def _chains(model: OpenDrive, start: Stretch, s: float) -> Iterator[tuple[Stretch, ...]]:
    """Yield chains of lanes up to `WAY_LENGTH`, the first choices first."""
    rest = abs(_exit(model, start) - s)
    open_: list[tuple[tuple[Stretch, ...], float]] = [((start,), rest)]
    while open_:
        chain, length = open_.pop(0)
        following = [
            stretch for stretch in next_stretches(model, chain[-1]) if stretch not in chain
        ]
        if length >= WAY_LENGTH or not following or len(chain) > 50:
            yield chain
            continue
        for stretch in following:
            road = model.road(stretch.road_id)
            span = section_end(road, stretch.section) - road.sections[stretch.section].s
            open_.append(((*chain, stretch), length + span))


def _route(model: OpenDrive, chain: Sequence[Stretch], s: float) -> Route:
    first, last = chain[0], chain[-1]
    end = Place(last.road_id, last.lane_id, _inner(model, last, _exit(model, last)))
    via = [
        Place(stretch.road_id, stretch.lane_id, _inner(model, stretch, _middle(model, stretch)))
        for stretch in chain[1:-1]
    ]
    road = model.road(first.road_id)
    entry = road.sections[first.section].s
    if road.direction(first.lane_id) < 0:
        entry = _inner(model, first, section_end(road, first.section))
    if len(chain) == 1 and abs(entry - end.s) < 1e-6:
        entry = s
    return plan_route(model, Place(first.road_id, first.lane_id, entry), via, end)


def _exit(model: OpenDrive, stretch: Stretch) -> float:
    """Return where traffic leaves a lane of a section [m along the road]."""
    road = model.road(stretch.road_id)
    if road.direction(stretch.lane_id) > 0:
        return section_end(road, stretch.section)
    return road.sections[stretch.section].s


def _middle(model: OpenDrive, stretch: Stretch) -> float:
    road = model.road(stretch.road_id)
    return 0.5 * (road.sections[stretch.section].s + section_end(road, stretch.section))


def _inner(model: OpenDrive, stretch: Stretch, s: float) -> float:
    """Return a place that lies in its section, not on the border where the next one begins."""
    road = model.road(stretch.road_id)
    if stretch.section + 1 < len(road.sections):
        return min(s, float(np.nextafter(section_end(road, stretch.section), 0.0)))
    return s


def lane_of(steps: Sequence[Step], road_id: str, s: float, s_end: float) -> int:
    """Return on which lane a route leads from one place of a road to another [m]."""
    middle = 0.5 * (s + s_end)
    for step in steps:
        low, high = min(step.s, step.s_end), max(step.s, step.s_end)
        if step.road_id == road_id and low <= middle <= high:
            return step.lane_id
    raise AssertionError("a piece lies on one of its route's steps")


def speed_limits(road: Road, number: int, lane_id: int, s: Float) -> Float:
    """Return the speed limits [m/s] that hold on a lane."""
    limits = np.full(len(s), np.inf)
    for kind in sorted(road.types, key=lambda each: each.s):
        speed = kind.speed.metres_per_second if kind.speed else None
        limits[s >= kind.s] = np.inf if speed is None else speed
    section = road.sections[number]
    lane = section.lane(lane_id)
    for each in sorted(lane.speeds if lane else (), key=lambda each: each.s):
        limits[s >= section.s + each.s] = each.max * SPEED_UNITS[each.unit]
    return limits


def _beside(road: Road, number: int, lane_id: int, s: Float) -> tuple[Float, Float]:
    """Return how far left the centres of the lanes beside are that go the same way; 0: none."""
    section, way = road.sections[number], road.direction(lane_id)
    border = borders(road, number, s)

    def centre(item: int) -> Float:
        middle: Float = 0.5 * (border[item] + border[item - (1 if item > 0 else -1)])
        return middle

    found = []
    for outwards in (1, -1):
        other = lane_id + outwards * way
        lane = section.lane(other) if other else None
        if lane is None or not lane.drivable or road.direction(other) != way:
            found.append(np.zeros(len(s)))
            continue
        width = np.abs(border[other] - border[other - (1 if other > 0 else -1)])
        found.append(np.where(width >= NARROW, way * (centre(other) - centre(lane_id)), 0.0))
    return found[0], found[1]


def line_of(road: Road, s: float, lane_id: int) -> float:
    """Return where the stop line of a light at ``s`` is [m along the road]: there, if none is."""
    lines = [
        obj.s
        for obj in road.objects
        if (obj.subtype or "").lower() == STOP_LINE
        and abs(obj.s - s) <= LINE_REACH
        and (
            not obj.validity
            or any(each.from_lane <= lane_id <= each.to_lane for each in obj.validity)
        )
    ]
    return min(lines, key=lambda at: abs(at - s), default=s)


def _inside(points: Float, corners: Float) -> Bool:
    """Return which points lie inside a polygon (even-odd rule); ``(P,)`` bool."""
    x, y = points.T
    inside = np.zeros(len(points), dtype=np.bool_)
    for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        spans = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            at = ax + (y - ay) / (by - ay) * (bx - ax)
        inside ^= spans & (x < at)
    return inside
