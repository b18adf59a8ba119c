"""OpenDRIVE2OWL: a whole map as the static part of an ontology (Algorithm 1, step 3).

Every road, lane, junction, crosswalk, traffic light and sign becomes an individual, linked as the
map links them; shapes and elevations stay in the map's own file, which the road network names.
"""

import math
from pathlib import PurePath
from urllib.parse import quote

import pyoxigraph as ox

from bridgegen.ontology.builder import Builder
from bridgegen.ontology.graph import Individuals
from bridgegen.openx.opendrive.furniture import Object, Signal
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.lanes import section_end, width_of
from bridgegen.openx.opendrive.model import Connection, Junction, Lane, OpenDrive, Road, RoadLink
from bridgegen.openx.opendrive.references import contacts

STRIPS = {"shoulder": "Shoulder", "sidewalk": "Sidewalk", "walking": "Sidewalk"}
"""The class of a lane that cars do not travel on, by its type; of all others, ``RoadStrip``."""


def individuals_from_opendrive(model: OpenDrive, map_file: str) -> Individuals:
    """Return the individuals of a whole map.

    Lanes are individuals per lane section. A lane that cars travel on is a ``Lane``; every other
    one is a strip of its road.

    Args:
        model: the road network, as `bridgegen.openx.opendrive.read` returns it.
        map_file: the path that its file has, seen from the ontology's.
    """
    return Individuals(_Map(model, map_file).quads)


class _Map(Builder):
    """Adds the parts of a map; names keep their parts apart by a colon, which ids are rid of."""

    def __init__(self, model: OpenDrive, map_file: str) -> None:
        name = PurePath(map_file).stem
        super().__init__(name, {})
        self.model = model
        self.network = self.node("road_network", "RoadNetwork")
        self.put(self.network, "has_name", name)
        self.put(self.network, "has_map_file", map_file)
        for road in model.roads:
            self.map_road(road)
        for junction in model.junctions:
            self.junction(junction)

    def area(self, name: str, cls: str) -> ox.NamedNode:
        """Add an individual as an area of the network."""
        node = self.node(name, cls)
        self.put(self.network, "has_area", node)
        return node

    # -- roads -------------------------------------------------------------------------------------

    def map_road(self, road: Road) -> None:
        """Add a road with its lanes and what stands beside it."""
        node = self.area(_road(road.id), "Road")
        self.put(node, "has_road_id", road.id)
        if road.name:
            self.put(node, "has_name", road.name)
        self.put(node, "has_length", float(road.length))
        self.put(node, "has_junction_end", _junction_end(road))
        limit = _speed_limit(road)
        if limit is not None:
            self.put(node, "has_speed_limit", limit)
        self.join(node, "has_predecessor", road.predecessor)
        self.join(node, "has_successor", road.successor)
        for index, section in enumerate(road.sections):
            for lane in section.lanes:
                self.lane(node, road, index, lane)
        for index, item in enumerate(road.objects):
            if item.type == "crosswalk":
                self.place(self.area(_part("crosswalk", road.id, index), "Crosswalk"), node, item)
        for index, signal in enumerate(road.signals):
            self.signal(node, road, index, signal)

    def join(self, node: ox.NamedNode, name: str, link: RoadLink | None) -> None:
        """Link a road to what it is joined to."""
        if link is not None:
            kind = _road if link.element_type == "road" else _junction
            self.put(node, name, self.iri(kind(link.element_id)))

    def lane(self, road_node: ox.NamedNode, road: Road, index: int, lane: Lane) -> None:
        """Add a lane of a section, or a strip beside the lanes."""
        section = road.sections[index]
        cls = "Lane" if lane.drivable else STRIPS.get(lane.type, "RoadStrip")
        node = self.node(_lane(road.id, index, lane.id), cls)
        self.put(road_node, "has_lane" if lane.drivable else "has_strip", node)
        self.put(node, "has_lane_id", lane.id)
        self.put(node, "has_lane_type", lane.type)
        self.put(node, "has_section_start", float(section.s))
        self.put(node, "has_start_width", width_of(section, lane, section.s, section.s)[0])
        if lane.drivable:
            along = road.direction(lane.id) > 0
            self.put(node, "has_direction", "forward" if along else "backward")
            middle = (section.s + section_end(road, index)) / 2.0
            self.put(node, "has_width", width_of(section, lane, middle, middle)[0])

    # -- what stands on and beside roads -----------------------------------------------------------

    def place(self, node: ox.NamedNode, road_node: ox.NamedNode, item: Object | Signal) -> None:
        """State which road something is on, and where."""
        self.put(node, "has_object_id", item.id)
        if item.name:
            self.put(node, "has_name", item.name)
        self.put(node, "on_road", road_node)
        self.put(node, "has_s", float(item.s))
        self.put(node, "has_t", float(item.t))

    def signal(self, road_node: ox.NamedNode, road: Road, index: int, signal: Signal) -> None:
        """Add a traffic light (a signal that changes) or a sign (one that does not)."""
        cls = "TrafficLight" if signal.dynamic == "yes" else "Signage"
        node = self.node(_part("signal", road.id, index), cls)
        self.put(self.network, "has_facility", node)
        self.place(node, road_node, signal)
        self.put(node, "has_signal_type", signal.type)
        pose = reference_pose(road, min(signal.s, road.length))
        self.put(node, "has_world_x", float(pose.x - signal.t * math.sin(pose.h)))
        self.put(node, "has_world_y", float(pose.y + signal.t * math.cos(pose.h)))

    # -- junctions ---------------------------------------------------------------------------------

    def junction(self, junction: Junction) -> None:
        """Add a junction with the ways across."""
        node = self.area(_junction(junction.id), "Intersection")
        self.put(node, "has_junction_id", junction.id)
        if junction.name:
            self.put(node, "has_name", junction.name)
        for road in self.model.roads:
            if road.junction == junction.id:
                self.put(node, "has_inner_road", self.iri(_road(road.id)))
            elif any(contacts(road, junction.id)):
                self.put(node, "has_leg", self.iri(_road(road.id)))
        for index, connection in enumerate(junction.connections):
            self.connection(node, junction, index, connection)

    def connection(
        self, junction_node: ox.NamedNode, junction: Junction, index: int, connection: Connection
    ) -> None:
        """Add a way into a junction, lane by lane."""
        node = self.node(_part("connection", junction.id, index), "JunctionConnection")
        self.put(junction_node, "has_connection", node)
        self.put(node, "has_connection_id", connection.id)
        self.put(node, "has_incoming_road", self.iri(_road(connection.incoming_road)))
        self.put(node, "has_connecting_road", self.iri(_road(connection.connecting_road)))
        entered = self.model.road(connection.connecting_road)
        left = self.model.road(connection.incoming_road)
        start = 0 if connection.contact_point == "start" else len(entered.sections) - 1
        end = 0 if _leaves_at(left, junction, entered, connection) == "start" else -1
        for number, lanes in enumerate(connection.lane_links):
            link = self.node(_part("link", junction.id, index, number), "LaneLink")
            self.put(node, "has_lane_link", link)
            last = end % len(left.sections)
            self.put(link, "from_lane", self.iri(_lane(left.id, last, lanes.from_lane)))
            self.put(link, "to_lane", self.iri(_lane(entered.id, start, lanes.to_lane)))


def _leaves_at(left: Road, junction: Junction, entered: Road, connection: Connection) -> str:
    """Return the end of the incoming road that a connection leaves it at."""
    link = entered.link(connection.contact_point)
    if link is not None and link.element_id == left.id and link.contact_point is not None:
        return link.contact_point
    return next(iter(contacts(left, junction.id)), "end")


def _junction_end(road: Road) -> str:
    """Return which ends of a road touch a junction."""
    ends = [
        end
        for end in ("start", "end")
        if (link := road.link(end)) is not None and link.element_type == "junction"
    ]
    return "both" if len(ends) == 2 else ends[0] if ends else "none"


def _speed_limit(road: Road) -> float | None:
    """Return the first speed limit of a road [m/s], where it has one above 0."""
    speeds = [one.speed.metres_per_second for one in road.types if one.speed is not None]
    return speeds[0] if speeds and speeds[0] else None


def _part(kind: str, *parts: str | int) -> str:
    return ":".join((kind, *(quote(str(part), safe="") for part in parts)))


def _road(road_id: str) -> str:
    return _part("road", road_id)


def _junction(junction_id: str) -> str:
    return _part("junction", junction_id)


def _lane(road_id: str, section: int, lane_id: int) -> str:
    return _part("lane", road_id, section, lane_id)
