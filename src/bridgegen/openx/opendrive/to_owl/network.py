"""OpenDRIVE2OWL: a whole map as the static part of an ontology (Algorithm 1, step 3).

Every road, lane, junction, crosswalk, traffic light, sign, line and lamp becomes an individual,
linked as the map links them. What the ontology cannot express stays in the map's own file, which
the road network names; `bridgegen.openx.opendrive.to_owl.network` lists it.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import PurePath

import pyoxigraph as ox

from bridgegen.openx.opendrive.from_owl.network import KINDS, MEASURES
from bridgegen.openx.opendrive.geometry import pose
from bridgegen.openx.opendrive.lanes import section_end, width_of
from bridgegen.openx.opendrive.legs import heading, junction_end
from bridgegen.openx.opendrive.map_names import junction_name, lane_name, part_name, road_name
from bridgegen.openx.opendrive.model import Connection, Junction, Lane, OpenDrive, Road, RoadLink
from bridgegen.openx.opendrive.plan_view import Arc, Line, ParamPoly3, Poly3, Spiral
from bridgegen.openx.opendrive.to_owl.furniture import Furniture, class_of
from bridgegen.openx.opendrive.user_data import number, values_of
from bridgegen.scenario.ontology.builder import Builder
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import tbox
from bridgegen.scenario.weather import ROAD_TYPES

# --- OpenDRIVE2OWL, its junctions: what they are, which roads meet there, and the ways across ---


_BY_LEGS = {3: "TJunction", 4: "Crossroads"}
_NEEDED = {"Roundabout": ("has_radius",), "Merge": ("has_merge_length", "has_taper_length")}


class Junctions:
    """Adds the junctions of a map.

    A roundabout that OWL2OpenDRIVE made is several junctions there, and one here. Roundabouts and
    merges of other people's maps are junctions by their numbers of legs, like all others.

    Attributes:
        kinds: per junction that our ``userData`` gives a class, that.
    """

    def __init__(self, builder: Builder, network: ox.NamedNode, model: OpenDrive) -> None:
        self._builder, self._network, self._model = builder, network, model
        self.kinds = {item.id: kind for item in model.junctions if (kind := _kind(item))}
        self._whole = {
            junction.id: first
            for junction in model.junctions
            for first in values_of(junction.user_data, "part_of")[:1]
            if self.kinds.get(first) == "Roundabout" and first != junction.id
        }

    def iri(self, junction_id: str) -> ox.NamedNode:
        """Return the junction of an id, or the roundabout that it is part of."""
        return self._builder.iri(junction_name(self._whole.get(junction_id, junction_id)))

    def add(self) -> None:
        """Add all of them."""
        for junction in self._model.junctions:
            if junction.id not in self._whole:
                self._add(junction)

    def _add(self, junction: Junction) -> None:
        put = self._builder.put
        parts = [
            item
            for item in self._model.junctions
            if self._whole.get(item.id, item.id) == junction.id
        ]
        ids = [item.id for item in parts]
        inner, legs = [], []
        for road in self._model.roads:
            touches = sum(len(road.ends_at(item)) for item in ids)
            if road.junction in ids or (touches == 2 and len(ids) > 1):
                inner.append(road)
            elif touches:
                legs.append(road)
        if not legs:  # roads lead from one junction into another
            legs = [road for road in inner if any(road.ends_at(name) for name in ids)]
        if not legs:
            return  # no road leads there
        kind = self.kinds.get(junction.id) or _BY_LEGS.get(len(legs), "Intersection")
        if junction.is_direct:
            kind = "DirectJunction"
        node = self._builder.node(junction_name(junction.id), kind)
        put(self._network, "has_area", node)
        put(node, "has_junction_id", junction.id)
        if junction.name and len(parts) == 1:
            put(node, "has_name", junction.name)
        for name in MEASURES:
            measure = number(junction.user_data, name)
            fits = tbox().domains[name] in ("Intersection", kind)
            if fits and measure is not None and measure > 0.0:
                put(node, name, measure)
        for name, roads in (("has_inner_road", inner), ("has_leg", legs)):
            for road in roads:
                put(node, name, self._builder.iri(road_name(road.id)))
        for part in parts:
            for index, connection in enumerate(part.connections):
                self._connection(node, part, index, connection)

    def _connection(
        self, junction_node: ox.NamedNode, junction: Junction, index: int, connection: Connection
    ) -> None:
        """Add a way into a junction, lane by lane."""
        put, iri = self._builder.put, self._builder.iri
        name = part_name("connection", junction.id, index)
        node = self._builder.node(name, "JunctionConnection")
        put(junction_node, "has_connection", node)
        put(node, "has_connection_id", connection.id)
        put(node, "has_incoming_road", iri(road_name(connection.incoming_road)))
        put(node, "has_connecting_road", iri(road_name(connection.entered_road)))
        entered = self._model.road(connection.entered_road)
        left = self._model.road(connection.incoming_road)
        start = 0 if connection.contact_point == "start" else len(entered.sections) - 1
        end = 0 if _leaves_at(left, junction, entered, connection) == "start" else -1
        for place, lanes in enumerate(connection.lane_links):
            link = self._builder.node(part_name("link", junction.id, index, place), "LaneLink")
            put(node, "has_lane_link", link)
            last = end % len(left.sections)
            put(link, "from_lane", iri(lane_name(left.id, last, lanes.from_lane)))
            put(link, "to_lane", iri(lane_name(entered.id, start, lanes.to_lane)))


def _kind(junction: Junction) -> str | None:
    """Return the class that our ``userData`` gives a junction, with all that it needs."""
    for name in values_of(junction.user_data, "class")[:1]:
        needed = (number(junction.user_data, item) for item in _NEEDED.get(name, ()))
        if name in KINDS and all(value is not None and value > 0.0 for value in needed):
            return name
    return None


def _leaves_at(left: Road, junction: Junction, entered: Road, connection: Connection) -> str:
    """Return the end of the incoming road that a connection leaves it at."""
    link = entered.link(connection.contact_point)
    if link is not None and link.element_id == left.id and link.contact_point is not None:
        return link.contact_point
    return next(iter(left.ends_at(junction.id)), "end")


STRIPS = {"shoulder": "Shoulder", "sidewalk": "Sidewalk", "walking": "Sidewalk"}
"""The class of a lane that cars do not travel on, by its type; of all others, ``RoadStrip``."""

_CLOSES = ("closes_above_fog_density", "closes_above_precipitation")


def individuals_from_opendrive(
    model: OpenDrive,
    map_file: str,
    digest: str | None = None,
    name: str | None = None,
    controllers: bool = True,
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
        name: of the ontology that they become part of; the map's by default.
        controllers: whether to add the lights' controllers; a scenario file may define them better.
    """
    return Individuals(_Map(model, map_file, digest, name, controllers).quads)


class _Map(Builder):
    """Adds the parts of a map."""

    def __init__(
        self,
        model: OpenDrive,
        map_file: str,
        digest: str | None,
        ontology: str | None,
        controllers: bool,
    ) -> None:
        stem = PurePath(map_file).stem
        super().__init__(ontology or stem, {})
        self.model = model
        self.known_types = frozenset(tbox().allowed["has_road_type"])
        self.known_lines = frozenset(tbox().allowed["has_marking_type"])
        self.known_colors = frozenset(tbox().allowed["has_marking_color"])
        self.network = self.node("road_network", "RoadNetwork")
        self.put(self.network, "has_name", model.header.name or stem)
        self.put(self.network, "has_map_file", map_file)
        if model.left_hand:
            self.put(self.network, "has_driving_side", "left")
        if digest is not None:
            self.put(self.network, "has_map_digest", digest)
        self.junctions = Junctions(self, self.network, model)
        furniture = Furniture(self, self.network)
        for road in model.roads:
            node = self.map_road(road)
            furniture.add_objects(node, road)
            furniture.add_signals(node, road)
        for road in model.roads:
            furniture.add_references(road)
        if controllers:
            furniture.add_controllers(model.controllers)
        self.junctions.add()

    # -- roads -------------------------------------------------------------------------------------

    def map_road(self, road: Road) -> ox.NamedNode:
        """Add a road with its lanes, its lines and its course."""
        node = self.node(road_name(road.id), "Road")
        self.put(self.network, "has_area", node)
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
        for name, later in _change(road):
            self.put(node, name, later)
        for name in _CLOSES:
            above = number(road.user_data, name)
            if above is not None:
                self.put(node, name, above)
        if len(road.elevations) == 1 and not (road.elevations[0].c or road.elevations[0].d):
            rise = road.elevations[0].b
            if rise:
                self.put(node, "has_grade", float(rise))
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
            self.put(node, name, self.junctions.iri(link.element_id))

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

        Of a merge's carriageway only lanes that continue count, not the acceleration lane.
        """
        sections: Sequence[int] = range(len(road.sections))
        link = road.link(end) if end in ("start", "end") else None
        if link is not None and self.junctions.kinds.get(link.element_id) == "Merge":
            sections = sections[-1:] if end == "start" else sections[:1]
        lanes = [[lane for lane in road.sections[k].lanes if lane.drivable] for k in sections]
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
        drivable = lane.drivable and has_width(road, index, lane)
        cls = "Lane" if drivable else STRIPS.get(lane.type, "RoadStrip")
        node = self.node(lane_name(road.id, index, lane.id), cls)
        self.put(road_node, "has_lane" if drivable else "has_strip", node)
        self.put(node, "has_lane_id", lane.id)
        self.put(node, "has_lane_type", lane.type)
        self.put(node, "has_section_start", float(section.s))
        self.put(node, "has_start_width", width_of(section, lane, section.s, section.s)[0])
        self.put(node, "has_direction", self.direction(road, lane.id, end))
        width = _middle_width(road, index, lane)
        if drivable or width > 0.0:
            self.put(node, "has_width", width)
        for turn in values_of(lane.user_data, "allows_turn"):
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


def _middle_width(road: Road, index: int, lane: Lane) -> float:
    """Return the width of a lane halfway along its section [m]."""
    section = road.sections[index]
    middle = (section.s + section_end(road, index)) / 2.0
    return width_of(section, lane, middle, middle)[0]


def has_width(road: Road, index: int, lane: Lane) -> bool:
    """Return whether a lane is wider than 0 m halfway along its section."""
    return _middle_width(road, index, lane) > 0.0


def _change(road: Road) -> list[tuple[str, float | str]]:
    """Return what is stated of the one place from which on a road has another type or no marks."""
    types = road.types[1:]
    lanes = [lane for section in road.sections for lane in (*section.center, *section.lanes)]
    marks = [mark for lane in lanes for mark in lane.road_marks if mark.s > 0.0]
    places = {kind.s for kind in types} | {mark.s for mark in marks}
    known = {kind.type for kind in types} <= {*ROAD_TYPES} and {m.type for m in marks} <= {"none"}
    if len(road.sections) > 1 or len(places) != 1 or not known:
        return []
    return [
        ("has_change_at", float(places.pop())),
        *(("has_later_road_type", kind.type) for kind in types),
        *(("has_later_marking_type", mark.type) for mark in marks[:1]),
    ]


def _speed_limit(road: Road) -> float | None:
    """Return the first speed limit of a road [m/s], where it has one above 0."""
    speeds = [kind.speed.metres_per_second for kind in road.types if kind.speed is not None]
    return speeds[0] if speeds and speeds[0] else None


# --- Contents of a map that its individuals lack: they stay in the map's own file ---


def losses(model: OpenDrive) -> Iterator[str]:
    """Yield a sentence for each kind of content of a map that its individuals lack in part.

    Left out of every import, and not reported here: elevations but an even grade, lateral profiles,
    lane offsets, widths but at the start and the middle of a lane section, where along a lane its
    lines begin, the shapes and heights of objects, and lane speed limits.

    Args:
        model: the road network.
    """
    known = {
        name: frozenset(tbox().allowed[name]) for name in ("has_road_type", "has_marking_type")
    }
    curves = sum(
        isinstance(geometry.shape, Poly3 | ParamPoly3)
        for road in model.roads
        for geometry in road.plan_view
    )
    if curves:
        yield (
            f"{curves} stretches of reference line are cubics: their lengths and their curvatures "
            "at both ends are kept, their course between is not"
        )
    objects = Counter(
        obj.type or "none" for road in model.roads for obj in road.objects if class_of(obj) is None
    )
    if objects:
        listed = ", ".join(f"{kind} ({count})" for kind, count in sorted(objects.items()))
        yield f"objects that the ontology has no class for are left out: {listed}"
    several = sum(len({(kind.type, kind.speed) for kind in road.types}) > 1 for road in model.roads)
    if several:
        yield f"{several} roads change their type or speed limit: the first is kept"
    lines = Counter(
        mark.type
        for road in model.roads
        for section in road.sections
        for lane in (*section.center, *section.lanes)
        for mark in lane.road_marks
        if mark.type not in known["has_marking_type"]
    )
    if lines:
        listed = ", ".join(f"{kind} ({count})" for kind, count in sorted(lines.items()))
        yield f"lines of unknown kinds are left out: {listed}"
    types = sorted(
        {type_.type for road in model.roads for type_ in road.types} - known["has_road_type"]
    )
    if types:
        yield f"road types that the standard does not have are left out: {', '.join(types)}"
