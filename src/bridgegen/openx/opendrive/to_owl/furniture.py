"""OpenDRIVE2OWL, its layer 2: lights, signs, lines and lamps, and the lights' controllers."""

import math
from collections.abc import Iterable, Iterator, Sequence

import pyoxigraph as ox

from bridgegen.base import elementary
from bridgegen.openx.opendrive.from_owl.furniture import LAMP, SIGNS, STATES, STOP_LINE
from bridgegen.openx.opendrive.furniture import (
    Controller,
    Object,
    Signal,
    SignalReference,
    Validity,
)
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.lanes import centre_of, section_index
from bridgegen.openx.opendrive.legs import junction_end
from bridgegen.openx.opendrive.map_names import lane_name, part_name
from bridgegen.openx.opendrive.model import SPEED_UNITS, Road
from bridgegen.openx.opendrive.user_data import exact, number, values_of
from bridgegen.scenario.ontology.builder import Builder

_CLASSES = {code: cls for cls, code in SIGNS.items()}
_GERMAN = ("", "DE", "DEU", "GER", "GERMANY", "OPENDRIVE")
"""Countries (in capitals) whose signs have the German catalogue's types, or which have none."""
_STOP_LINE_SIGN = "294"
"""The German catalogue's stop line, which some maps have as a signal."""

Box = tuple[float, float, float, float]
"""Extent of an object in road coordinates [m]: s from, to, t from, to."""


def class_of(item: Object) -> str | None:
    """Return the class that an object becomes an individual of; None where it becomes none."""
    kind, subtype = (item.type or "").lower(), (item.subtype or "").lower()
    if kind == "crosswalk":
        return "Crosswalk"
    if kind == "roadmark" and subtype in (STOP_LINE.lower(), "signallines"):
        return "StopLine"
    names = f"{subtype} {item.name or ''}".lower().replace("_", "").replace(" ", "")
    lamp = any(word in names for word in ("streetlamp", "streetlight", "lamppost"))
    return "StreetLight" if kind == LAMP.lower() or (kind == "pole" and lamp) else None


class Furniture:
    """Adds what stands and lies on and beside the roads of a map.

    Args:
        builder: where to.
        network: the road network.
    """

    def __init__(self, builder: Builder, network: ox.NamedNode) -> None:
        self._builder, self._network = builder, network
        self._signals: dict[str, tuple[str, ox.NamedNode]] = {}

    # -- objects -------------------------------------------------------------------------------

    def add_objects(self, road_node: ox.NamedNode, road: Road) -> None:
        """Add the crosswalks, stop lines and street lights of a road."""
        put = self._builder.put
        for index, item in enumerate(road.objects):
            cls = class_of(item)
            if cls is None:
                continue
            node = self._builder.node(part_name(cls.lower(), road.id, index), cls)
            put(self._network, "has_area" if cls == "Crosswalk" else "has_facility", node)
            low, high, right, left = box_of(item)
            distance = self._place(node, road_node, road, item)
            if cls == "Crosswalk" and high > low:
                put(node, "has_width", high - low)
            if cls == "StopLine":
                if distance is not None:
                    nearer = max(distance - 0.5 * (high - low), 0.0)
                    put(node, "has_distance", exact(item.user_data, "has_distance", nearer, 0.5))
                ids = _valid(road, item.s, item.validity) or _between(road, item.s, right, left)
                self._link(node, "marks_lane", road, item.s, ids)
            elif distance is not None:
                put(node, "has_distance", distance)

    def _place(
        self, node: ox.NamedNode, road_node: ox.NamedNode, road: Road, item: Object | Signal
    ) -> float | None:
        """State where something is; return its distance from the junction of its road [m]."""
        put = self._builder.put
        put(node, "has_object_id", item.id)
        if item.name:
            put(node, "has_name", item.name)
        put(node, "on_road", road_node)
        put(node, "has_s", float(item.s))
        put(node, "has_t", float(item.t))
        end = junction_end(road)
        if end == "both":
            return None
        return float(item.s if end != "end" else road.length - item.s)

    def _link(
        self, node: ox.NamedNode, name: str, road: Road, s: float, ids: Iterable[int]
    ) -> None:
        index = section_index(road, s)
        for lane_id in ids:
            lane = self._builder.iri(lane_name(road.id, index, lane_id))
            self._builder.put(node, name, lane)

    # -- signals -------------------------------------------------------------------------------

    def add_signals(self, road_node: ox.NamedNode, road: Road) -> None:
        """Add the traffic lights (signals that change) and signs (that do not) of a road."""
        put = self._builder.put
        for index, signal in enumerate(road.signals):
            cls, limit = sign_of(signal)
            node = self._builder.node(part_name("signal", road.id, index), cls)
            self._signals.setdefault(signal.id, (cls, node))
            put(self._network, "has_facility", node)
            distance = self._place(node, road_node, road, signal)
            if distance is not None:
                put(node, "has_distance", distance)
            put(node, "has_signal_type", signal.type)
            if limit is not None:
                put(node, "has_speed_limit", exact(signal.user_data, "has_speed_limit", limit))
            pose = reference_pose(road, min(signal.s, road.length))
            put(node, "has_world_x", float(pose.x - signal.t * elementary.sin(pose.h)))
            put(node, "has_world_y", float(pose.y + signal.t * elementary.cos(pose.h)))
            self._governs(cls, node, road, signal)

    def add_references(self, road: Road) -> None:
        """Add the lanes of a road that signals of other roads are for."""
        for reference in road.signal_references:
            cls, node = self._signals.get(reference.id, ("", None))
            if node is not None:
                self._governs(cls, node, road, reference)

    def _governs(
        self, cls: str, node: ox.NamedNode, road: Road, signal: Signal | SignalReference
    ) -> None:
        ids = _valid(road, signal.s, signal.validity)
        if cls == "TrafficLight" and not signal.validity:
            ids = _along(road, signal.s, signal.orientation)
        link = "marks_lane" if cls == "StopLine" else "governs_lane"
        self._link(node, link, road, signal.s, ids)

    # -- controllers ---------------------------------------------------------------------------

    def add_controllers(self, controllers: Sequence[Controller]) -> None:
        """Add what switches lights together; those that our ``userData`` calls one are one."""
        put = self._builder.put
        nodes: dict[tuple[str, ...], ox.NamedNode] = {}
        phases: dict[tuple[ox.NamedNode, int], ox.NamedNode] = {}
        for number_, controller in enumerate(controllers):
            lights = [
                light
                for control in controller.controls
                for cls, light in [self._signals.get(control.signal_id, ("", None))]
                if cls == "TrafficLight" and light is not None
            ]
            if not lights:
                continue
            ours = values_of(controller.user_data, "has_object_id")
            key = ("ours", ours[0]) if ours else ("theirs", str(number_))
            node = nodes.get(key)
            if node is None:
                nodes[key] = node = self._builder.node(
                    part_name("controller", *key), "SignalController"
                )
                put(self._network, "has_signal_controller", node)
                put(node, "has_object_id", ours[0] if ours else controller.id)
                names = (
                    values_of(controller.user_data, "has_name") if ours else [controller.name or ""]
                )
                if names and names[0]:
                    put(node, "has_name", names[0])
                offset = number(controller.user_data, "has_offset")
                if offset is not None:
                    put(node, "has_offset", offset)
            for light in lights:
                put(node, "has_light", light)
            for index, state, duration, name in _phases(controller):
                if (node, index) not in phases:
                    phase = self._builder.node(part_name("phase", *key, index), "SignalPhase")
                    phases[node, index] = phase
                    put(node, "has_phase", phase)
                    put(phase, "has_index", index)
                    put(phase, "has_duration", duration)
                    if name:
                        put(phase, "has_name", name)
                for link in (link for link, shown in STATES.items() if shown == state):
                    for light in lights:
                        put(phases[node, index], link, light)


def _phases(controller: Controller) -> Iterator[tuple[int, str, float, str]]:
    """Yield the phases that our ``userData`` knows: index, state, duration [s], name."""
    for text in values_of(controller.user_data, "phase"):
        words = text.split(maxsplit=3)
        try:
            index, state, duration = int(words[0]), words[1], float(words[2])
        except (ValueError, IndexError):
            continue
        if math.isfinite(duration) and duration >= 0.0:
            yield index, state, duration, words[3] if len(words) > 3 else ""


def sign_of(signal: Signal) -> tuple[str, float | None]:
    """Return the class of a signal, and the speed limit that it shows [m/s], if any."""
    if signal.dynamic == "yes":
        return "TrafficLight", None
    if (signal.country or "").upper() not in _GERMAN:
        return "Signage", None
    if signal.type == _STOP_LINE_SIGN:
        return "StopLine", None
    cls = _CLASSES.get(signal.type, "Signage")
    if cls != "SpeedLimitSign":
        return cls, None
    factor = SPEED_UNITS.get(signal.unit or "km/h")
    if signal.value is None or factor is None or signal.value <= 0.0:
        return "Signage", None
    return cls, signal.value * factor


# -- which lanes, and how far ----------------------------------------------------------------------


def _valid(road: Road, s: float, validity: Sequence[Validity]) -> list[int]:
    """Return the ids of the driving lanes at ``s`` that an element is valid for."""
    return [
        lane.id
        for lane in road.sections[section_index(road, s)].lanes
        if lane.drivable and any(item.from_lane <= lane.id <= item.to_lane for item in validity)
    ]


def _along(road: Road, s: float, orientation: str) -> list[int]:
    """Return the ids of the driving lanes at ``s`` that lead in a direction ("none": both)."""
    way = {"+": 1, "-": -1}.get(orientation)
    return [
        lane.id
        for lane in road.sections[section_index(road, s)].lanes
        if lane.drivable and way in (None, road.direction(lane.id))
    ]


def _between(road: Road, s: float, right: float, left: float) -> list[int]:
    """Return the ids of the driving lanes at ``s`` whose centres lie between two t [m]."""
    section = road.sections[section_index(road, s)]
    return [
        lane.id
        for lane in section.lanes
        if lane.drivable and right <= centre_of(road, section, lane, s, s)[0] <= left
    ]


def box_of(item: Object) -> Box:
    """Return an object's extent; its position only, if it states no size."""
    corners = item.corners
    hdg = item.hdg or 0.0
    length, width = item.length, item.width
    if length is not None and width is not None and (not corners or hdg == 0.0):
        along, across = length, width
        if hdg != 0.0:
            cos, sin = abs(elementary.cos(hdg)), abs(elementary.sin(hdg))
            along, across = length * cos + width * sin, length * sin + width * cos
        low = item.s - 0.5 * along
        middle = 0.5 * sum(_extent(t for _, t in corners)) if corners else item.t
        return low, low + along, middle - 0.5 * across, middle + 0.5 * across
    if not corners:
        return item.s, item.s, item.t, item.t
    return (*_extent(s for s, _ in corners), *_extent(t for _, t in corners))


def _extent(values: Iterable[float]) -> tuple[float, float]:
    known = list(values)
    return (min(known), max(known)) if known else (0.0, 0.0)
