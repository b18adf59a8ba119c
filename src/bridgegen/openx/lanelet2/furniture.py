"""Lanelet2's traffic lights, signs, stop lines and crosswalks, on the roads of their lanelets."""

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.openx.lanelet2.read import Lanelet, LaneletMap, Rule, Way
from bridgegen.openx.lanelet2.strips import Shape, Strip
from bridgegen.openx.opendrive.from_owl.furniture import LIGHT, SIGNS, STOP_LINE, STOP_LINE_WIDTH
from bridgegen.openx.opendrive.furniture import (
    CornerLocal,
    Object,
    Outline,
    Signal,
    SignalReference,
    Validity,
)
from bridgegen.openx.opendrive.model import Road
from bridgegen.openx.opendrive.notes import Notes

_SIGNS = {
    "stop_sign": "StopSign",
    "de206": "StopSign",
    "de205": "YieldSign",
    "yield_sign": "YieldSign",
}
_READ = ("traffic_light", "traffic_sign", "speed_limit", "right_of_way", "crosswalk")
_HEIGHT = {True: 5.0, False: 2.2}  # m, of a light, and of a sign, where the file has no heights
_NEAR = 3.0  # m, from the end of a lanelet, that a stop line for it may be away

Place = tuple[int, int, bool]
"""Where a lanelet is: the index of its road, of its lane, and whether that runs along the road."""


def add_furniture(
    found: LaneletMap,
    strips: Sequence[Strip],
    shapes: dict[str, Shape],
    roads: Sequence[Road],
    notes: Notes,
) -> list[Road]:
    """Return the roads with what stands beside and lies on them.

    Args:
        found: the map.
        strips: its roads in the same order.
        shapes: likewise, by their ids.
        roads: without anything.
        notes: takes what is left out.
    """
    places: dict[str, list[Place]] = defaultdict(list)
    for number, strip in enumerate(strips):
        for index, (lanelets, along) in enumerate(strip.lanes):
            for lanelet in lanelets:
                places[lanelet.id].append((number, index, along))
    users: dict[str, list[Lanelet]] = defaultdict(list)
    for lanelet in found.lanelets.values():
        for key in lanelet.rules:
            users[key].append(lanelet)
    objects: dict[int, list[Object]] = defaultdict(list)
    signals: dict[int, list[Signal]] = defaultdict(list)
    references: dict[int, list[SignalReference]] = defaultdict(list)
    lines: dict[str, tuple[Way, list[Lanelet]]] = {way.id: (way, []) for way in found.stop_lines}
    for rule in found.rules.values():
        if rule.subtype not in _READ:
            notes.add(
                rule.subtype,
                rule.line,
                f"regulatory element {rule.id}: '{rule.subtype}' is not read",
            )
            continue
        # As CommonRoad has it, a light names no lanelets but its stop line, which is at their end.
        for way in rule.ways.get("ref_line", ()):
            lines.setdefault(way.id, (way, []))[1].extend(users[rule.id])
        if rule.subtype not in ("traffic_light", "traffic_sign"):
            continue
        marks = rule.ways.get("ref_line", [])
        first = None
        by_road: dict[int, list[tuple[int, bool, float]]] = defaultdict(list)
        for lanelet in users[rule.id]:
            for number, index, along in places[lanelet.id]:
                by_road[number].append(
                    (index, along, _station(strips[number], shapes, index, lanelet, along, marks))
                )
        for number, held in by_road.items():
            strip, line = strips[number], shapes[strips[number].id]
            along, s = held[0][1], held[0][2]
            t = float(line.values[-1, 0] - 0.5 if along else line.values[0, 0] + 0.5)
            validity = _validity(strip.lane_id(index) for index, _, _ in held)
            sense = "+" if along else "-"
            if first is None:
                first = _signal(rule, s, t, sense, validity, notes)
                if first is not None:
                    signals[number].append(first)
            else:
                references[number].append(SignalReference(rule.id, s, t, sense, validity))
    for way, named in lines.values():
        _add_stop_line(way, named, places, strips, shapes, objects, notes)
    for lanelet in found.lanelets.values():
        if lanelet.type == "crosswalk":
            _add_crosswalk(lanelet, strips, shapes, objects, notes)
    return [
        replace(
            road,
            objects=tuple(objects[number]),
            signals=tuple(signals[number]),
            signal_references=tuple(references[number]),
        )
        for number, road in enumerate(roads)
    ]


def _station(
    strip: Strip,
    shapes: dict[str, Shape],
    index: int,
    lanelet: Lanelet,
    along: bool,
    marks: Sequence[Way],
) -> float:
    """Return where a light or sign holds on a road [m]: at its stop line, else where it is met."""
    line = shapes[strip.id]
    if marks:
        middle = np.mean([way.points[:, :2].mean(axis=0) for way in marks], axis=0)
        return float(np.clip(line.project(middle[None])[0][0], 0.0, line.length))
    inside = strip.junction is not None
    return 0.0 if along == inside else line.length


def _signal(
    rule: Rule, s: float, t: float, sense: str, validity: tuple[Validity, ...], notes: Notes
) -> Signal | None:
    light = rule.subtype == "traffic_light"
    kind, country, value = LIGHT, "OpenDRIVE", None
    if not light:
        named = next((way.tags.get("subtype", "") for way in rule.ways.get("refers", ())), "")
        named = rule.tags.get("sign_type", named)
        limit = re.fullmatch(r"de274(?:[-_.](\d{1,3}))?", named)
        country = "DE"
        if named in _SIGNS:
            kind = SIGNS[_SIGNS[named]]
        elif limit:
            kind, value = SIGNS["SpeedLimitSign"], float(limit[1]) if limit[1] else None
        elif re.fullmatch(r"[a-z]{2}\d[\w.-]{0,20}", named):
            kind, country = named[2:], named[:2].upper()
        else:
            notes.add(
                "sign",
                rule.line,
                f"regulatory element {rule.id}: sign '{named[:40]}' has no meaning here",
            )
            kind, country = named[:40] or "-1", "OpenDRIVE"
    return Signal(
        rule.id,
        s,
        t,
        "yes" if light else "no",
        sense,
        kind,
        z_offset=_HEIGHT[light],
        country=country,
        value=value,
        unit=None if value is None else "km/h",
        height=0.9,
        width=0.3 if light else 0.6,
        validity=validity,
    )


def _add_stop_line(
    way: Way,
    named: list[Lanelet],
    places: dict[str, list[Place]],
    strips: Sequence[Strip],
    shapes: dict[str, Shape],
    objects: dict[int, list[Object]],
    notes: Notes,
) -> None:
    """Put a stop line on the road that ends at it: before the junction rather than within."""
    middle = way.points[:, :2].mean(axis=0)
    best: tuple[bool, float, int, float] | None = None
    for number, strip in enumerate(strips):
        line = shapes[strip.id]
        s, t = (float(part[0]) for part in line.project(middle[None]))
        if (
            -_NEAR < s < line.length + _NEAR
            and line.values[-1].min() - 0.5 < t < line.values[0].max() + 0.5
        ):
            for index, (lanelets, along) in enumerate(strip.lanes):
                if not _within(line, index, s, t) or lanelets[0].type in ("sidewalk", "rail"):
                    continue
                left = (line.length - s) if along else s
                rank = (strip.junction is not None, abs(left), number, s)
                if best is None or rank < best:
                    best = rank
    if best is None:
        notes.add("stop line", way.line, f"stop line {way.id} is on no lane, and is left out")
        return
    number, s = best[2], best[3]
    strip, line = strips[number], shapes[strips[number].id]
    s = min(max(s, 0.5 * STOP_LINE_WIDTH), line.length - 0.5 * STOP_LINE_WIDTH)
    across = [float(t) for t in line.project(way.points[:, :2])[1]]
    lanes = [
        index
        for index in range(len(strip.lanes))
        if min(across) <= _centre(line, index, s) <= max(across)
    ]
    held = [
        index
        for index, (lanelets, _) in enumerate(strip.lanes)
        if any(item in named for item in lanelets)
    ]
    ids = [strip.lane_id(index) for index in (held or lanes)]
    if not ids or s < 0.0:
        notes.add("stop line", way.line, f"stop line {way.id} is on no lane, and is left out")
        return
    box = [(-0.5 * STOP_LINE_WIDTH, min(across)), (0.5 * STOP_LINE_WIDTH, max(across))]
    objects[number].append(
        _area(f"{way.id}", "roadMark", s, box, subtype=STOP_LINE, validity=_validity(ids))
    )


def _add_crosswalk(
    lanelet: Lanelet,
    strips: Sequence[Strip],
    shapes: dict[str, Shape],
    objects: dict[int, list[Object]],
    notes: Notes,
) -> None:
    """Put a crosswalk on the road that it lies across: outside junctions rather than within."""
    line = lanelet.centre[:, :2]
    steps = np.linspace(0.0, 1.0, 21)[:, None]
    axis = line[0] + steps * (line[-1] - line[0])
    best: tuple[bool, int, int] | None = None
    for number, strip in enumerate(strips):
        if strip.lanes[0][0][0].type == "sidewalk":
            continue
        shape = shapes[strip.id]
        s, t = shape.project(axis)
        count = sum(
            0.0 < a < shape.length and _between(shape, a, b)
            for a, b in zip(s.tolist(), t.tolist(), strict=True)
        )
        rank = (strip.junction is not None, -count, number)
        if count and (best is None or rank < best):
            best = rank
    if best is None:
        notes.add(
            "crosswalk",
            lanelet.line,
            f"crosswalk {lanelet.id} lies across no road, and is left out",
        )
        return
    number = best[2]
    shape = shapes[strips[number].id]
    ring = np.concatenate((lanelet.left.points, lanelet.right.points[::-1]))[:, :2]
    s, t = shape.project(ring)
    low, high = max(float(s.min()), 0.0), min(float(s.max()), shape.length)
    box = [(low - 0.5 * (low + high), float(t.min())), (high - 0.5 * (low + high), float(t.max()))]
    objects[number].append(_area(lanelet.id, "crosswalk", 0.5 * (low + high), box))


def _area(key: str, kind: str, s: float, box: list[tuple[float, float]], **more: object) -> Object:
    (back, low), (fore, high) = box
    t = 0.5 * (low + high)
    corners = [(back, low - t), (fore, low - t), (fore, high - t), (back, high - t)]
    outline = Outline(
        0, corners_local=tuple(CornerLocal(u, v, 0.0, 0.0, k) for k, (u, v) in enumerate(corners))
    )
    made = Object(
        key,
        s,
        t,
        type=kind,
        orientation="none",
        hdg=0.0,
        length=fore - back,
        width=high - low,
        height=0.0,
        outline=outline,
    )
    return replace(made, **more)  # type: ignore[arg-type]


def _validity(ids: Iterable[int]) -> tuple[Validity, ...]:
    return tuple(Validity(lane, lane) for lane in sorted(set(ids)))


def _borders(shape: Shape, s: float) -> Float:
    return np.array([np.interp(s, shape.stations, row) for row in shape.values])


def _between(shape: Shape, s: float, t: float) -> bool:
    borders = _borders(shape, s)
    return bool(borders[-1] < t < borders[0])


def _within(shape: Shape, index: int, s: float, t: float) -> bool:
    borders = _borders(shape, s)
    return bool(borders[index + 1] - 0.5 <= t <= borders[index] + 0.5)


def _centre(shape: Shape, index: int, s: float) -> float:
    borders = _borders(shape, s)
    return float(0.5 * (borders[index] + borders[index + 1]))
