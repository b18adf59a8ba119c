"""Lanelet2's traffic lights, signs, stop lines and crosswalks, on the roads of their lanelets."""

import re
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from bridgegen.openx.lanelet2.read import DRIVEN, Lanelet, LaneletMap, Rule, Way
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


def add_furniture(
    found: LaneletMap,
    strips: Sequence[Strip],
    shapes: dict[str, Shape],
    roads: list[Road],
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
    beside = _Furniture(strips, [shapes[strip.id] for strip in strips], notes)
    users: dict[str, list[Lanelet]] = defaultdict(list)
    for lanelet in found.lanelets.values():
        for key in lanelet.rules:
            users[key].append(lanelet)
    lines: dict[str, tuple[Way, list[Lanelet]]] = {way.id: (way, []) for way in found.stop_lines}
    for rule in found.rules.values():
        if rule.subtype not in _READ:
            what = f"regulatory element {rule.id}: '{rule.subtype[:40]}' is not read"
            notes.add(rule.subtype, rule.line, what)
        else:
            for way in rule.ways.get("ref_line", ()):
                lines.setdefault(way.id, (way, []))[1].extend(users[rule.id])
            if rule.subtype in ("traffic_light", "traffic_sign"):
                beside.add_signal(rule, users[rule.id])
    for way, named in lines.values():
        beside.add_stop_line(way, named)
    for lanelet in found.lanelets.values():
        if lanelet.type == "crosswalk":
            beside.add_crosswalk(lanelet)
    return [
        replace(
            road,
            objects=tuple(beside.objects[number]),
            signals=tuple(beside.signals[number]),
            signal_references=tuple(beside.references[number]),
        )
        for number, road in enumerate(roads)
    ]


class _Furniture:
    """What is beside and on roads, by the numbers of these."""

    def __init__(self, strips: Sequence[Strip], shapes: Sequence[Shape], notes: Notes) -> None:
        self._roads, self._notes = list(zip(strips, shapes, strict=True)), notes
        self.objects: dict[int, list[Object]] = defaultdict(list)
        self.signals: dict[int, list[Signal]] = defaultdict(list)
        self.references: dict[int, list[SignalReference]] = defaultdict(list)

    def add_signal(self, rule: Rule, users: list[Lanelet]) -> None:
        """Put a light or a sign on each road with lanelets that it is for: at its stop line."""
        marks = [way.points[:, :2].mean(axis=0) for way in rule.ways.get("ref_line", ())]
        made = None
        for number, (strip, shape) in enumerate(self._roads):
            held = [
                (index, along)
                for index, (lanelets, along) in enumerate(strip.lanes)
                if any(lanelet in users for lanelet in lanelets)
            ]
            if not held:
                continue
            along = held[0][1]
            # Without a stop line, vehicles meet it where they leave a road, or enter a junction.
            s = 0.0 if along == (strip.junction is not None) else shape.length
            if marks:
                met = shape.project(np.mean(marks, axis=0)[None])[0][0]
                s = float(np.clip(met, 0.0, shape.length))
            t = float(shape.values[-1, 0] - 0.5 if along else shape.values[0, 0] + 0.5)
            validity = _validity(strip.lane_id(index) for index, _ in held)
            reference = SignalReference(rule.id, s, t, "+" if along else "-", validity)
            if made is None:
                made = self._signal(rule, reference)
                self.signals[number].append(made)
            else:
                self.references[number].append(reference)

    def _signal(self, rule: Rule, place: SignalReference) -> Signal:
        light = rule.subtype == "traffic_light"
        kind, country, value = LIGHT, "OpenDRIVE", None
        if not light:
            named = next((way.tags.get("subtype", "") for way in rule.ways.get("refers", ())), "")
            named = rule.tags.get("sign_type", named)[:40]
            limit = re.fullmatch(r"de274(?:[-_.](\d{1,3}))?", named)
            kind, country = named or "-1", "DE"
            if named in _SIGNS:
                kind = SIGNS[_SIGNS[named]]
            elif limit:
                kind, value = SIGNS["SpeedLimitSign"], float(limit[1]) if limit[1] else None
            elif re.fullmatch(r"[a-z]{2}\d[\w.-]*", named):
                kind, country = named[2:], named[:2].upper()
            else:
                what = f"regulatory element {rule.id}: sign '{named}' has no meaning here"
                self._notes.add("sign", rule.line, what)
                country = "OpenDRIVE"
        return Signal(
            rule.id, place.s, place.t, "yes" if light else "no", place.orientation, kind,
            z_offset=_HEIGHT[light], country=country, value=value,
            name=" ".join(way.id for way in rule.ways.get("refers", ())) or None,
            unit=None if value is None else "km/h", height=0.9, width=0.3 if light else 0.6,
            validity=place.validity,
        )  # fmt: skip

    def add_stop_line(self, way: Way, named: list[Lanelet]) -> None:
        """Put a stop line on the road that ends at it: before the junction rather than within."""
        middle = way.points[:, :2].mean(axis=0)[None]
        found = []
        for number, (strip, shape) in enumerate(self._roads):
            s, t = (float(part[0]) for part in shape.project(middle))
            borders = shape.at(s)
            for index, (lanelets, along) in enumerate(strip.lanes):
                within = borders[index + 1] - 0.5 <= t <= borders[index] + 0.5
                if within and -_NEAR < s < shape.length + _NEAR and lanelets[0].type in DRIVEN:
                    left = abs(shape.length - s if along else s)
                    found.append((strip.junction is not None, left, number, s))
        if not found:
            what = f"stop line {way.id} is on no lane, and is left out"
            self._notes.add("stop line", way.line, what)
            return
        _, _, number, s = min(found)
        strip, shape = self._roads[number]
        half = 0.5 * min(STOP_LINE_WIDTH, shape.length)
        s = min(max(s, half), shape.length - half)
        across = shape.project(way.points[:, :2])[1]
        low, high, borders = float(across.min()), float(across.max()), shape.at(s)
        centres = 0.5 * (borders[1:] + borders[:-1])
        ids = [
            strip.lane_id(index)
            for index, (lanelets, _) in enumerate(strip.lanes)
            if any(item in named for item in lanelets) or low <= centres[index] <= high
        ]
        area = _area(way.id, "roadMark", s, (-half, half, low, high))
        self.objects[number].append(replace(area, subtype=STOP_LINE, validity=_validity(ids)))

    def add_crosswalk(self, lanelet: Lanelet) -> None:
        """Put a crosswalk on the road that it lies across: outside junctions rather than within."""
        line = lanelet.centre[:, :2]
        axis = line[0] + np.linspace(0.0, 1.0, 21)[:, None] * (line[-1] - line[0])
        found = []
        for number, (strip, shape) in enumerate(self._roads):
            s, t = shape.project(axis)
            inside = (s > 0.0) & (s < shape.length)
            places = zip(s[inside], t[inside], strict=True)
            count = sum(shape.at(a)[-1] < b < shape.at(a)[0] for a, b in places)
            if count and strip.lanes[0][0][0].type != "sidewalk":
                found.append((strip.junction is not None, -count, number))
        if not found:
            what = f"crosswalk {lanelet.id} lies across no road, and is left out"
            self._notes.add("crosswalk", lanelet.line, what)
            return
        number = min(found)[2]
        shape = self._roads[number][1]
        ring = np.concatenate((lanelet.left.points, lanelet.right.points))[:, :2]
        s, t = shape.project(ring)
        low, high = max(float(s.min()), 0.0), min(float(s.max()), shape.length)
        middle = 0.5 * (low + high)
        box = low - middle, high - middle, float(t.min()), float(t.max())
        self.objects[number].append(_area(lanelet.id, "crosswalk", middle, box))


def _area(key: str, kind: str, s: float, box: tuple[float, float, float, float]) -> Object:
    back, fore, low, high = box
    t = 0.5 * (low + high)
    corners = [(back, low - t), (fore, low - t), (fore, high - t), (back, high - t)]
    outline = Outline(
        0, corners_local=tuple(CornerLocal(u, v, 0.0, 0.0, k) for k, (u, v) in enumerate(corners))
    )
    return Object(
        key, s, t, type=kind, orientation="none", hdg=0.0, length=fore - back, width=high - low,
        height=0.0, outline=outline,
    )  # fmt: skip


def _validity(ids: Iterable[int]) -> tuple[Validity, ...]:
    return tuple(Validity(lane, lane) for lane in sorted(set(ids)))
