"""OpenDRIVE2OWL, its junctions: what they are, which roads meet there, and the ways across."""

import pyoxigraph as ox

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.opendrive.from_owl.network import KINDS, MEASURES
from bridgegen.openx.opendrive.map_names import junction_name, lane_name, part_name, road_name
from bridgegen.openx.opendrive.model import Connection, Junction, OpenDrive, Road
from bridgegen.openx.opendrive.user_data import number, values_of
from bridgegen.scenario.ontology.builder import Builder
from bridgegen.scenario.ontology.vocabulary import tbox

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
        self.kinds = {one.id: kind for one in model.junctions if (kind := _kind(one))}
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
        if junction.is_direct:
            what = f"junction {junction.id}: a direct junction"
            raise UnsupportedError(f"{what} cannot be said in the ontology")
        put = self._builder.put
        parts = [
            one for one in self._model.junctions
            if self._whole.get(one.id, one.id) == junction.id
        ]  # fmt: skip
        ids = [one.id for one in parts]
        inner, legs = [], []
        for road in self._model.roads:
            touches = sum(len(road.ends_at(one)) for one in ids)
            if road.junction in ids or (touches == 2 and len(ids) > 1):
                inner.append(road)
            elif touches:
                legs.append(road)
        if not legs:  # roads lead from one junction into another
            legs = [road for road in inner if any(road.ends_at(one) for one in ids)]
        if not legs:
            return  # no road leads there
        kind = self.kinds.get(junction.id) or _BY_LEGS.get(len(legs), "Intersection")
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
        needed = (number(junction.user_data, one) for one in _NEEDED.get(name, ()))
        if name in KINDS and all(value is not None and value > 0.0 for value in needed):
            return name
    return None


def _leaves_at(left: Road, junction: Junction, entered: Road, connection: Connection) -> str:
    """Return the end of the incoming road that a connection leaves it at."""
    link = entered.link(connection.contact_point)
    if link is not None and link.element_id == left.id and link.contact_point is not None:
        return link.contact_point
    return next(iter(left.ends_at(junction.id)), "end")
