"""The road network as areas and lines, for a bird's-eye view."""

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.openx.opendrive.furniture import Object, Signal
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.lanes import borders, breaks, points, section_end
from bridgegen.openx.opendrive.model import Junction, LaneSection, OpenDrive, Road
from bridgegen.openx.opendrive.plan_view import Line

# --- What stands on and beside the roads, for a bird's-eye view: crosswalks, stop lines, signs ---


STRIPE = 0.5
"""Width of a crosswalk's stripes and of the gaps between them [m]; source: RMS-1, sign 293."""

_SIGN_WIDTH = 0.7  # m, where the file says none
_CORNERS = 4


@dataclass(frozen=True)
class Light:
    """A traffic light.

    Attributes:
        id: as the road network has it.
        x: [m].
        y: [m].
        h: the direction of the traffic that it is for [rad].
    """

    id: str
    x: float
    y: float
    h: float


def crosswalk_stripes(road: Road) -> Iterator[Float]:
    """Yield the stripes of a road's crosswalks, each as its four corners ``(4, 2)`` [m]."""
    for obj in road.objects:
        corners = outline_of(road, obj) if obj.type == "crosswalk" else None
        if corners is None or len(corners) != _CORNERS:
            continue
        a, b, c, d = corners
        if math.dist(a, b) < math.dist(b, c):  # the stripes lie beside each other along a to b
            a, b, c, d = b, c, d, a
        long = math.dist(a, b)
        count = max(round((long / STRIPE - 1.0) / 2.0), 1)
        gap = long / (2 * count + 1)
        for k in range(count):
            u, v = (2 * k + 1) * gap / long, (2 * k + 2) * gap / long
            yield np.array([a + u * (b - a), a + v * (b - a), d + v * (c - d), d + u * (c - d)])


def stop_lines(road: Road) -> Iterator[tuple[float, Float]]:
    """Yield the stop lines that a road's objects are: s [m], and both ends ``(2, 2)`` [m]."""
    for obj in road.objects:
        t = [corner for _, corner in obj.corners]
        if t and (obj.subtype or "").lower() == "stopline":
            yield obj.s, points(road, np.array([obj.s, obj.s]), np.array([min(t), max(t)]))


def signs(road: Road) -> Iterator[Float]:
    """Yield the signs beside a road as they look from above: a line across, ``(2, 2)`` [m]."""
    for signal in road.signals:
        if signal.dynamic == "no":
            half = 0.5 * (signal.width or _SIGN_WIDTH)
            yield points(
                road, np.array([signal.s, signal.s]), np.array([signal.t - half, signal.t + half])
            )


def lights(model: OpenDrive) -> list[Light]:
    """Return the traffic lights of a road network."""
    return [
        _light(road, signal)
        for road in model.roads
        for signal in road.signals
        if signal.dynamic == "yes"
    ]


def _light(road: Road, signal: Signal) -> Light:
    ((x, y),) = points(road, np.array([signal.s]), np.array([signal.t]))
    h = reference_pose(road, min(max(signal.s, 0.0), road.length)).h
    return Light(signal.id, float(x), float(y), h if signal.orientation != "-" else h + math.pi)


def outline_of(road: Road, obj: Object) -> Float | None:
    """Return the corners of an object's outline, ``(P, 2)`` [m]; None if it has none."""
    outline = obj.outline or (obj.outlines[0] if obj.outlines else None)
    if outline is None:
        return None
    if outline.corners_road:
        s, t = (np.array([getattr(each, name) for each in outline.corners_road]) for name in "st")
        found = points(road, np.clip(s, 0.0, road.length), t)
    elif outline.corners_local:
        ((x, y),) = points(road, np.array([min(obj.s, road.length)]), np.array([obj.t]))
        h = reference_pose(road, min(obj.s, road.length)).h + (obj.hdg or 0.0)
        u, v = (np.array([getattr(each, name) for each in outline.corners_local]) for name in "uv")
        found = np.stack(
            [
                x + u * elementary.cos(h) - v * elementary.sin(h),
                y + u * elementary.sin(h) + v * elementary.cos(h),
            ],
            axis=1,
        )
    else:
        return None
    closed = len(found) > 1 and np.allclose(found[0], found[-1])
    return found[:-1] if closed else found


AREAS = ("driving", "junction", "shoulder", "sidewalk", "median", "stripe")
"""Kinds that are areas; the last point is joined to the first. A stripe is a crosswalk's."""

LINES = ("edge", "solid", "broken", "centre", "stop", "sign")
"""Kinds that are lines: the border of what cars drive on; between lanes of one direction;
between the directions; across the lanes into a junction; a sign as it looks from above."""

Shape = tuple[str, Float]

_WAIT = ("205", "206")  # signs: give way, stop (VzKat)
_NEAR = 15.0
"""Distance from a road's end within which a stop line of the map's own is the one there [m]."""

_BESIDE = {
    "shoulder": "shoulder",
    "parking": "shoulder",
    "stop": "shoulder",
    "biking": "shoulder",
    "sidewalk": "sidewalk",
    "curb": "sidewalk",
    "median": "median",
}
"""Drawing styles of lanes that cars do not travel on, by OpenDRIVE's type; other lanes are left
out."""


def outline(
    model: OpenDrive,
    junction_id: str | None = None,
    *,
    along: Collection[str] = (),
    step: float = 1.0,
) -> list[Shape]:
    """Return what to draw: areas first, lines after them.

    Args:
        model: the road network.
        junction_id: draw this junction and its legs only, each up to the next junction.
        along: draw the roads of these ids only, what they touch, and what touches that.
        step: distance between points on curves [m]; straight parts have only their ends.

    Returns:
        Pairs of a kind (one of ``AREAS`` or ``LINES``) and its points, ``(P, 2)`` float64 [m].

    Raises:
        InputError: there is no such junction.
    """
    junctions, roads = list(model.junctions), list(model.roads)
    if along:
        touched = dict.fromkeys(_junctions_at(model, along))
        junctions = [model.junction(name) for name in touched]
        beside = {road.id: road for name in touched for road in _legs(model, name)}
        roads = list((beside | {name: model.road(name) for name in along}).values())
    elif junction_id:
        junctions, roads = [model.junction(junction_id)], _legs(model, junction_id)
    shapes = [
        shape for road in roads if not road.is_connecting for shape in _road(model, road, step)
    ]
    for junction in junctions:
        shapes += _junction(model, junction, step)
    return sorted(shapes, key=lambda shape: (shape[0] in LINES, shape[0] == "stripe"))


def _junctions_at(model: OpenDrive, roads: Collection[str]) -> Iterator[str]:
    """Yield the ids of the junctions that roads touch."""
    for road_id in roads:
        road = model.road(road_id)
        for link in (road.predecessor, road.successor):
            if link is not None and link.element_type == "junction":
                yield link.element_id


def _legs(model: OpenDrive, junction_id: str) -> list[Road]:
    """Return the roads that touch a junction and those that continue them."""
    found: dict[str, Road] = {}
    todo = [road for road in model.roads if road.ends_at(junction_id)]
    while todo:
        road = todo.pop()
        if road.id not in found and not road.is_connecting:
            found[road.id] = road
            for link in (road.predecessor, road.successor):
                if link and link.element_type == "road":
                    todo.append(model.road(link.element_id))
    return list(found.values())


def _road(model: OpenDrive, road: Road, step: float) -> Iterator[Shape]:
    for index, section in enumerate(road.sections):
        s = _stations(road, index, step)
        t = borders(road, index, s)
        drivable = sorted(lane.id for lane in section.lanes if lane.drivable)
        for lane in section.lanes:
            kind = _BESIDE.get(lane.type)
            if kind:
                yield kind, _area(road, s, _border(t, lane.id, outer=False), t[lane.id])
        if drivable:
            left = _border(t, drivable[-1], outer=drivable[-1] > 0)
            right = _border(t, drivable[0], outer=drivable[0] < 0)
            yield "driving", _area(road, s, right, left)
            yield "edge", points(road, s, left)
            yield "edge", points(road, s, right)
        yield from _between(road, section, s, t, drivable)
    lines = list(stop_lines(road))
    for contact in ("start", "end"):
        end = 0.0 if contact == "start" else road.length
        if not any(abs(s - end) < _NEAR for s, _ in lines) and _waits(model, road, contact):
            yield from _stop_line(road, contact)
    yield from (("stop", line) for _, line in lines)
    yield from (("stripe", area) for area in crosswalk_stripes(road))
    yield from (("sign", line) for line in signs(road))


def _between(
    road: Road, section: LaneSection, s: Float, t: dict[int, Float], drivable: list[int]
) -> Iterator[Shape]:
    """Yield the lines between neighbouring lanes that cars drive on."""
    order = sorted(lane_id for lane_id in t if lane_id)
    for right, left in pairwise(order):
        if right not in drivable or left not in drivable:
            continue
        inner = min(right, left, key=abs)  # its outer border lies between them, unless 0 does
        border = t[inner] if right * left > 0 else t[0]
        if road.direction(right) != road.direction(left):
            yield "centre", points(road, s, border)
            continue
        lane = section.lane(inner) if right * left > 0 else section.center[0]
        marks = sorted(lane.road_marks if lane else (), key=lambda mark: mark.s)
        ends = [section.s + mark.s for mark in marks[1:]]
        for mark, low, high in zip(marks, [-math.inf, *ends], [*ends, math.inf], strict=True):
            here = (low <= s) & (s <= high)
            if mark.type != "none" and here.sum() > 1:
                kind = "solid" if "solid" in mark.type else "broken"
                yield kind, points(road, s[here], border[here])


def _waits(model: OpenDrive, road: Road, contact: str) -> bool:
    """Return whether traffic that leaves a road by one of its ends may have to wait there.

    Not on motorways; if some of a junction's roads have lights or signs, only on those.
    """
    link = road.link(contact)
    if link is None or any(kind.type == "motorway" for kind in road.types):
        return False
    legs = [
        item for item in model.roads if item.ends_at(link.element_id) and not item.is_connecting
    ]
    signed = [
        leg for leg in legs if any(s.dynamic == "yes" or s.type in _WAIT for s in leg.signals)
    ]
    return not signed or road in signed


def _stop_line(road: Road, contact: str) -> Iterator[Shape]:
    link = road.link(contact)
    if link is None or link.element_type != "junction":
        return
    outwards = 1 if contact == "end" else -1
    lanes = [
        lane.id
        for lane in road.section_at(contact).lanes
        if lane.drivable and road.direction(lane.id) == outwards
    ]
    if lanes:
        s, t = _at(road, contact)
        sides = [
            _border(t, lane_id, outer=outer)[0] for lane_id in lanes for outer in (True, False)
        ]
        yield "stop", points(road, np.repeat(s, 2), np.array([min(sides), max(sides)]))


def _junction(model: OpenDrive, junction: Junction, step: float) -> Iterator[Shape]:
    """Yield the area between the legs; its corners follow the right turns, where there are any."""
    ends = [
        (road, end)
        for road in model.roads
        if not road.is_connecting
        for end in road.ends_at(junction.id)
        if any(lane.drivable for lane in road.section_at(end).lanes)
    ]
    if len(ends) < 2:
        return
    ends.sort(key=lambda end: _outward(*end))
    ring: list[Float] = []
    for (road, end), (following, _) in zip(ends, ends[1:] + ends[:1], strict=True):
        s, t = _at(road, end)
        drivable = [lane.id for lane in road.section_at(end).lanes if lane.drivable]
        sides = [
            _border(t, lane_id, outer=outer)[0] for lane_id in drivable for outer in (True, False)
        ]
        # Seen from the junction the right edge comes first: that is counter-clockwise.
        edges = [min(sides), max(sides)] if end == "start" else [max(sides), min(sides)]
        ring.append(points(road, np.repeat(s, 2), np.array(edges)))
        corner = _corner(model, junction, road, following, step)
        if corner is not None:
            ring.append(corner)
            yield "edge", corner
    yield "junction", np.concatenate(ring)


def _corner(
    model: OpenDrive, junction: Junction, road: Road, following: Road, step: float
) -> Float | None:
    """Return the border between a leg and the next one counter-clockwise.

    It is the right border of the way from the one to the other; where there is none, as inside a
    roundabout, the left border of the way back.
    """
    right = _border_of_way(model, junction, road, following, step, outer=True)
    if right is not None:
        return right
    left = _border_of_way(model, junction, following, road, step, outer=False)
    return None if left is None else left[::-1]


def _border_of_way(
    model: OpenDrive, junction: Junction, road: Road, to: Road, step: float, *, outer: bool
) -> Float | None:
    """Return the right (outer) or left border of the way from one leg to another, as driven."""
    for connection in model.connections_from.get((junction.id, road.id), ()):
        way = model.road(connection.entered_road)
        forward = connection.contact_point == "start"
        onward = way.link("end" if forward else "start")
        lanes = {link.to_lane for link in connection.lane_links}
        if onward is None or onward.element_id != to.id or not lanes:
            continue
        side = 1 if max(lanes, key=abs) > 0 else -1
        found = []
        for index, section in enumerate(way.sections):
            ids = [lane.id for lane in section.lanes if lane.drivable and lane.id * side > 0]
            if ids:
                s = _stations(way, index, step)
                lane_id = (max if outer else min)(ids, key=abs)
                t = _border(borders(way, index, s), lane_id, outer=outer)
                found.append(points(way, s, t))
        if found:
            line = np.concatenate(found)
            return line if forward else line[::-1]
    return None


def _outward(road: Road, end: str) -> float:
    h = reference_pose(road, 0.0 if end == "start" else road.length).h
    return (h + (0.0 if end == "start" else math.pi)) % math.tau


def _at(road: Road, end: str) -> tuple[Float, dict[int, Float]]:
    """Return a road's end as an array of one s, and the t of its lanes' outer borders there."""
    s = np.array([0.0 if end == "start" else road.length])
    return s, borders(road, 0 if end == "start" else len(road.sections) - 1, s)


def _border(t: dict[int, Float], lane_id: int, *, outer: bool) -> Float:
    return t[lane_id] if outer else t[lane_id - int(math.copysign(1, lane_id))]


def _area(road: Road, s: Float, right: Float, left: Float) -> Float:
    return np.concatenate((points(road, s, right), points(road, s, left)[::-1]))


def _stations(road: Road, index: int, step: float) -> Float:
    """Return the s [m] at which to evaluate a lane section: dense only where something bends."""
    section = road.sections[index]
    low, high = section.s, section_end(road, index)
    cuts = {low, high}
    bending: list[tuple[float, float]] = []
    for position, geometry in enumerate(road.plan_view):
        end = road.plan_view[position + 1].s if position + 1 < len(road.plan_view) else road.length
        cuts.add(geometry.s)
        if not isinstance(geometry.shape, Line):
            bending.append((geometry.s, end))
    for lane in section.lanes:
        cuts.update(breaks(road, section, lane))
    for lane in (*section.lanes, *section.center):
        cuts.update(section.s + mark.s for mark in lane.road_marks)
    records = [(section.s, lane.widths) for lane in section.lanes] + [(0.0, road.lane_offsets)]
    for origin, cubics in records:
        for position, cubic in enumerate(cubics):
            last = position + 1 == len(cubics)
            if cubic.b or cubic.c or cubic.d:
                end = high if last else origin + cubics[position + 1].s
                bending.append((origin + cubic.s, end))
    for a, b in bending:
        a, b = max(a, low), min(b, high)
        if b > a:
            cuts.update(np.linspace(a, b, max(2, math.ceil((b - a) / step) + 1)).tolist())
    return np.array(sorted(cut for cut in cuts if low <= cut <= high))
