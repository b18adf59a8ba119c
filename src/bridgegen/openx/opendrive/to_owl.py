"""OpenDRIVE2OWL: a whole map as the static part of an ontology (Algorithm 1, step 3).

Every road, lane, junction, crosswalk, traffic light, sign, line and lamp becomes an individual,
linked as the map links them. What the ontology cannot say stays in the map's own file, which the
road network names; `bridgegen.openx.opendrive.map_losses` lists it.
"""

from collections.abc import Sequence
from pathlib import PurePath

import pyoxigraph as ox

from bridgegen.ontology.builder import Builder
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import tbox
from bridgegen.openx.opendrive.from_owl import KINDS, MEASURES
from bridgegen.openx.opendrive.geometry import pose
from bridgegen.openx.opendrive.lanes import section_end, width_of
from bridgegen.openx.opendrive.legs import heading, junction_end
from bridgegen.openx.opendrive.map_furniture import Furniture
from bridgegen.openx.opendrive.map_names import junction_name, lane_name, part_name, road_name
from bridgegen.openx.opendrive.model import Connection, Junction, Lane, OpenDrive, Road, RoadLink
from bridgegen.openx.opendrive.plan_view import Arc, Line, Spiral
from bridgegen.openx.opendrive.references import contacts
from bridgegen.openx.opendrive.user_data import number, said

STRIPS = {"shoulder": "Shoulder", "sidewalk": "Sidewalk", "walking": "Sidewalk"}
"""The class of a lane that cars do not travel on, by its type; of all others, ``RoadStrip``."""

_BY_LEGS = {3: "TJunction", 4: "Crossroads"}
_NEEDED = {"Roundabout": ("has_radius",), "Merge": ("has_merge_length", "has_taper_length")}
_CLOSES = ("closes_above_fog_density", "closes_above_precipitation")


def individuals_from_opendrive(
    model: OpenDrive, map_file: str, digest: str | None = None
) -> Individuals:
    """Return the individuals of a whole map.

    Lanes are individuals per lane section. A lane that cars travel on is a ``Lane``; every other
    one is a strip of its road. Lines are one individual per road, type and colour, which marks
    all lanes whose outer border is of that kind; where along the lane it begins is the map's to
    know. A ``paramPoly3`` or ``poly3`` is a segment with its length and its curvature at both
    ends. What OWL2OpenDRIVE made comes back whole, from the map and from its ``userData``: it can
    be made again from the individuals, once ``has_map_file`` is taken away.

    Args:
        model: the road network, as `bridgegen.openx.opendrive.read` returns it.
        map_file: the path that its file has, seen from the ontology's.
        digest: SHA-256 of the file, in hexadecimal.
    """
    return Individuals(_Map(model, map_file, digest).quads)


class _Map(Builder):
    """Adds the parts of a map.

    Attributes:
        kinds: per junction, its class.
        whole: per junction that is a part of a roundabout, the one that stands for it.
    """

    def __init__(self, model: OpenDrive, map_file: str, digest: str | None) -> None:
        stem = PurePath(map_file).stem
        super().__init__(stem, {})
        self.model = model
        self.known_types = frozenset(tbox().allowed["has_road_type"])
        self.known_lines = frozenset(tbox().allowed["has_marking_type"])
        self.known_colors = frozenset(tbox().allowed["has_marking_color"])
        ids = {junction.id for junction in model.junctions}
        self.whole = {
            junction.id: first
            for junction in model.junctions
            for first in said(junction.user_data, "part_of")[:1]
            if first in ids
        }
        self.kinds = {one.id: kind for one in model.junctions if (kind := _kind(one))}
        self.network = self.node("road_network", "RoadNetwork")
        self.put(self.network, "has_name", model.header.name or stem)
        self.put(self.network, "has_map_file", map_file)
        if digest is not None:
            self.put(self.network, "has_map_digest", digest)
        furniture = Furniture(self, self.network)
        for road in model.roads:
            node = self.map_road(road)
            furniture.add_objects(node, road)
            furniture.add_signals(node, road)
        for road in model.roads:
            furniture.add_references(road)
        furniture.add_controllers(model.controllers)
        for junction in model.junctions:
            if junction.id not in self.whole:
                self.junction(junction)

    def area(self, name: str, cls: str) -> ox.NamedNode:
        """Add an individual as an area of the network."""
        node = self.node(name, cls)
        self.put(self.network, "has_area", node)
        return node

    # -- roads -------------------------------------------------------------------------------------

    def map_road(self, road: Road) -> ox.NamedNode:
        """Add a road with its lanes, its lines and its course."""
        node = self.area(road_name(road.id), "Road")
        self.put(node, "has_road_id", road.id)
        if road.name:
            self.put(node, "has_name", road.name)
        self.put(node, "has_length", float(road.length))
        end = junction_end(road)
        self.put(node, "has_junction_end", end)
        limit = _speed_limit(road)
        if limit is not None:
            self.put(node, "has_speed_limit", limit)
        if road.types and road.types[0].type in self.known_types:
            self.put(node, "has_road_type", road.types[0].type)
        for name in _CLOSES:
            above = number(road.user_data, name)
            if above is not None:
                self.put(node, name, above)
        self.join(node, "has_predecessor", road.predecessor)
        self.join(node, "has_successor", road.successor)
        if end in ("start", "end"):
            outwards = heading(road, end)
            exactly = number(road.user_data, "has_heading")
            if exactly is not None and abs((exactly - outwards + 180.0) % 360.0 - 180.0) < 1e-6:
                outwards = exactly
            self.put(node, "has_heading", outwards)
        self.counts(node, road, end)
        for index, section in enumerate(road.sections):
            for lane in section.lanes:
                self.lane(node, road, index, lane, end)
        self.segments(node, road)
        self.lines(node, road)
        return node

    def join(self, node: ox.NamedNode, name: str, link: RoadLink | None) -> None:
        """Link a road to what it is joined to."""
        if link is not None and link.element_type == "road":
            self.put(node, name, self.iri(road_name(link.element_id)))
        elif link is not None:
            self.put(node, name, self.junction_iri(link.element_id))

    def junction_iri(self, junction_id: str) -> ox.NamedNode:
        """Return the junction of an id, or the roundabout that it is part of."""
        return self.iri(junction_name(self.whole.get(junction_id, junction_id)))

    def direction(self, road: Road, lane_id: int, end: str) -> str:
        """Return where a lane leads; a strip is like the lanes that it is beside."""
        along = road.direction(lane_id) > 0
        if end == "none" and not self.model.junctions:
            return "out" if along else "in"
        if end in ("start", "end"):
            return "in" if along == (end == "end") else "out"
        return "forward" if along else "backward"

    def counts(self, node: ox.NamedNode, road: Road, end: str) -> None:
        """State how many lanes lead in and out where a road meets its junction, and their width.

        Of a merge's carriageway those count that go on, not the acceleration lane.
        """
        sections: Sequence[int] = range(len(road.sections))
        link = road.link(end) if end in ("start", "end") else None
        if link is not None and self.kinds.get(link.element_id) == "Merge":
            sections = sections[-1:] if end == "start" else sections[:1]
        lanes = [
            [lane for lane in road.sections[k].lanes if lane.drivable] for k in sections
        ]  # fmt: skip
        widths = {
            _middle_width(road, k, lane)
            for k, some in zip(sections, lanes, strict=True)
            for lane in some
        }
        if len(widths) == 1 and (width := widths.pop()) > 0.0:
            self.put(node, "has_lane_width", width)
        if link is not None or (end == "none" and not self.model.junctions):
            near = lanes[-1 if end == "end" else 0]
            ways = [self.direction(road, lane.id, end) for lane in near]
            self.put(node, "has_inbound_lanes", ways.count("in"))
            self.put(node, "has_outbound_lanes", ways.count("out"))

    def lane(self, road_node: ox.NamedNode, road: Road, index: int, lane: Lane, end: str) -> None:
        """Add a lane of a section, or a strip beside the lanes."""
        section = road.sections[index]
        cls = "Lane" if lane.drivable else STRIPS.get(lane.type, "RoadStrip")
        node = self.node(lane_name(road.id, index, lane.id), cls)
        self.put(road_node, "has_lane" if lane.drivable else "has_strip", node)
        self.put(node, "has_lane_id", lane.id)
        self.put(node, "has_lane_type", lane.type)
        self.put(node, "has_section_start", float(section.s))
        self.put(node, "has_start_width", width_of(section, lane, section.s, section.s)[0])
        self.put(node, "has_direction", self.direction(road, lane.id, end))
        width = _middle_width(road, index, lane)
        if lane.drivable or width > 0.0:
            self.put(node, "has_width", width)
        for turn in said(lane.user_data, "allows_turn"):
            if turn in tbox().allowed["allows_turn"]:
                self.put(node, "allows_turn", turn)

    def segments(self, road_node: ox.NamedNode, road: Road) -> None:
        """Add the stretches of a road's reference line."""
        for index, geometry in enumerate(road.plan_view, start=1):
            node = self.node(part_name("segment", road.id, index), "GeometrySegment")
            self.put(road_node, "has_segment", node)
            self.put(node, "has_index", index)
            self.put(node, "has_length", float(geometry.length))
            shape = geometry.shape
            if isinstance(shape, Line):
                continue
            if isinstance(shape, Arc):
                ends = (shape.curvature, shape.curvature)
            elif isinstance(shape, Spiral):
                ends = (shape.curv_start, shape.curv_end)
            else:
                ends = (pose(geometry, 0.0)[3], pose(geometry, geometry.length)[3])
            for name, curvature in zip(("start", "end"), ends, strict=True):
                if curvature != 0.0:
                    self.put(node, f"has_{name}_curvature", float(curvature))

    def lines(self, road_node: ox.NamedNode, road: Road) -> None:
        """Add the lines between and beside the lanes of a road, one per kind."""
        found: dict[tuple[str, str, bool], list[str]] = {}
        for index, section in enumerate(road.sections):
            for lane in (*section.center, *section.lanes):
                for mark in lane.road_marks:
                    if mark.type in self.known_lines and mark.type != "none":
                        kind = (mark.type, mark.color, lane.id == 0)
                        name = lane_name(road.id, index, lane.id)
                        if name not in (marked := found.setdefault(kind, [])):
                            marked.append(name)
        for number_, ((style, color, centre), names) in enumerate(found.items()):
            node = self.node(part_name("line", road.id, number_), "LaneMarking")
            self.put(self.network, "has_facility", node)
            self.put(node, "on_road", road_node)
            self.put(node, "has_marking_type", style)
            if color in self.known_colors:
                self.put(node, "has_marking_color", color)
            if centre:
                self.put(node, "has_name", "centre line")
                continue
            for name in names:
                self.put(node, "marks_lane", self.iri(name))

    # -- junctions ---------------------------------------------------------------------------------

    def junction(self, junction: Junction) -> None:
        """Add a junction (or a roundabout, which is several) with the ways across."""
        parts = [
            one for one in self.model.junctions
            if self.whole.get(one.id, one.id) == junction.id
        ]  # fmt: skip
        ids = [one.id for one in parts]
        inner, legs = [], []
        for road in self.model.roads:
            touches = sum(len(contacts(road, one)) for one in ids)
            if road.junction in ids or (touches == 2 and len(ids) > 1):
                inner.append(road)
            elif touches:
                legs.append(road)
        kind = self.kinds.get(junction.id) or _BY_LEGS.get(len(legs), "Intersection")
        node = self.area(junction_name(junction.id), kind)
        self.put(node, "has_junction_id", junction.id)
        if junction.name and len(parts) == 1:
            self.put(node, "has_name", junction.name)
        for name in MEASURES:
            measure = number(junction.user_data, name)
            fits = tbox().domains[name] in ("Intersection", kind)
            if fits and measure is not None and measure > 0.0:
                self.put(node, name, measure)
        for name, roads in (("has_inner_road", inner), ("has_leg", legs)):
            for road in roads:
                self.put(node, name, self.iri(road_name(road.id)))
        for part in parts:
            for index, connection in enumerate(part.connections):
                self.connection(node, part, index, connection)

    def connection(
        self, junction_node: ox.NamedNode, junction: Junction, index: int, connection: Connection
    ) -> None:
        """Add a way into a junction, lane by lane."""
        node = self.node(part_name("connection", junction.id, index), "JunctionConnection")
        self.put(junction_node, "has_connection", node)
        self.put(node, "has_connection_id", connection.id)
        self.put(node, "has_incoming_road", self.iri(road_name(connection.incoming_road)))
        self.put(node, "has_connecting_road", self.iri(road_name(connection.connecting_road)))
        entered = self.model.road(connection.connecting_road)
        left = self.model.road(connection.incoming_road)
        start = 0 if connection.contact_point == "start" else len(entered.sections) - 1
        end = 0 if _leaves_at(left, junction, entered, connection) == "start" else -1
        for number_, lanes in enumerate(connection.lane_links):
            link = self.node(part_name("link", junction.id, index, number_), "LaneLink")
            self.put(node, "has_lane_link", link)
            last = end % len(left.sections)
            self.put(link, "from_lane", self.iri(lane_name(left.id, last, lanes.from_lane)))
            self.put(link, "to_lane", self.iri(lane_name(entered.id, start, lanes.to_lane)))


def _kind(junction: Junction) -> str | None:
    """Return the class that our ``userData`` gives a junction, with all that it needs."""
    for name in said(junction.user_data, "class")[:1]:
        needed = (number(junction.user_data, one) for one in _NEEDED.get(name, ()))
        if name in KINDS and all(value is not None and value > 0.0 for value in needed):
            return name
    return None


def _leaves_at(left: Road, junction: Junction, entered: Road, connection: Connection) -> str:
    """Return the end of the incoming road that a connection leaves it at."""
    link = entered.link(connection.contact_point)
    if link is not None and link.element_id == left.id and link.contact_point is not None:
        return link.contact_point
    return next(iter(contacts(left, junction.id)), "end")


def _middle_width(road: Road, index: int, lane: Lane) -> float:
    """Return the width of a lane halfway along its section [m]."""
    section = road.sections[index]
    middle = (section.s + section_end(road, index)) / 2.0
    return width_of(section, lane, middle, middle)[0]


def _speed_limit(road: Road) -> float | None:
    """Return the first speed limit of a road [m/s], where it has one above 0."""
    speeds = [one.speed.metres_per_second for one in road.types if one.speed is not None]
    return speeds[0] if speeds and speeds[0] else None
