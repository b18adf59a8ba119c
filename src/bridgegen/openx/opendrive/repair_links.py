"""Repairs of links between roads and junctions: those that lead nowhere, and one-sided ones."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

from bridgegen.openx.opendrive.model import (
    CONTACTS,
    NO_JUNCTION,
    Connection,
    Junction,
    OpenDrive,
    Road,
    RoadLink,
)
from bridgegen.openx.opendrive.notes import Notes

Lines = dict[int, int]
"""Line numbers of roads, junctions and connections in the file, by ``id()`` of the record."""


def repair_links(model: OpenDrive, lines: Lines, notes: Notes) -> OpenDrive:
    """Return a road network without links to what is not there.

    A road's link to nothing, and a connection without an incoming or an entered road, or without
    a lane that exists, are left out. An incoming road that does not link to its junction at an
    end at which it has no link gets one. A missing contactPoint is taken from the other road.

    Args:
        model: as it was read.
        lines: where its roads, junctions and connections stand; those of repaired ones are added.
        notes: takes a sentence for each repair.
    """
    ids = (
        Counter(road.id for road in model.roads),
        Counter(junction.id for junction in model.junctions),
    )
    if any(count > 1 for some in ids for count in some.values()):
        # With ids that occur twice a link has two ends, and each repair would be a guess.
        return model  # the reader refuses ids that occur twice
    return _Links(model, lines, notes).repaired()


class _Links:
    def __init__(self, model: OpenDrive, lines: Lines, notes: Notes) -> None:
        self._model, self._lines, self._notes = model, lines, notes
        self._roads = dict(model.roads_by_id)
        self._junctions = {junction.id for junction in model.junctions}

    def repaired(self) -> OpenDrive:
        for road in self._model.roads:
            self._road(road)
        junctions = tuple(self._junction(junction) for junction in self._model.junctions)
        roads = tuple(self._roads[road.id] for road in self._model.roads)
        if (roads, junctions) == (self._model.roads, self._model.junctions):
            return self._model
        return replace(self._model, roads=roads, junctions=junctions)

    # -- roads -----------------------------------------------------------------------------------

    def _road(self, road: Road) -> None:
        now, line = road, self._lines[id(road)]
        if road.is_connecting and road.junction not in self._junctions:
            what = f"road {road.id}: junction '{road.junction}' is not in the file"
            self._notes.add("no junction", line, f"{what}: read as a road outside junctions")
            now = replace(now, junction=NO_JUNCTION)
        for contact, name in zip(CONTACTS, ("predecessor", "successor"), strict=True):
            link = road.link(contact)
            if link is None:
                continue
            repaired = self._link(road, line, name, link)
            if repaired is not link:
                now = (
                    replace(now, predecessor=repaired)
                    if contact == "start"
                    else replace(now, successor=repaired)
                )
        self._set(road, now)

    def _set(self, old: Road, new: Road) -> None:
        self._lines[id(new)] = self._lines[id(old)]
        self._roads[old.id] = new

    def _link(self, road: Road, line: int, name: str, link: RoadLink) -> RoadLink | None:
        known: Iterable[str] = self._junctions if link.element_type == "junction" else self._roads
        what = f"road {road.id}: its {name}, {link.element_type} '{link.element_id}',"
        if link.element_id not in known:
            self._notes.add(
                "no such link", line, f"{what} is not in the file: read as the road's end"
            )
            return None
        if link.element_type == "junction" or link.contact_point is not None:
            return link
        other = self._model.roads_by_id[link.element_id]
        # The contact point is only filled in where the other road says it by its own link. If both
        # of its ends link back, or none, either choice might invent a way to drive: the road ends
        # there.
        back = [
            end
            for end in CONTACTS
            if (there := other.link(end)) is not None
            and there.element_id in (road.id, road.junction)
        ]
        if len(back) != 1:
            self._notes.add("contact", line, f"{what} needs a contactPoint: read as the road's end")
            return None
        self._notes.add("contact", line, f"{what} needs a contactPoint: read as its {back[0]}")
        return replace(link, contact_point=back[0])

    # -- junctions -------------------------------------------------------------------------------

    def _junction(self, junction: Junction) -> Junction:
        kept = []
        for connection in junction.connections:
            line = self._lines[id(connection)]
            repaired = self._connection(junction, connection, line)
            if repaired is not None:
                self._lines[id(repaired)] = line
                kept.append(repaired)
        if tuple(kept) == junction.connections:
            return junction
        repaired_junction = replace(junction, connections=tuple(kept))
        self._lines[id(repaired_junction)] = self._lines[id(junction)]
        return repaired_junction

    def _connection(
        self, junction: Junction, connection: Connection, line: int
    ) -> Connection | None:
        name = f"junction {junction.id}, connection {connection.id}"
        key = "linkedRoad" if junction.is_direct else "connectingRoad"
        road_id = connection.linked_road if junction.is_direct else connection.connecting_road
        way = self._roads.get(road_id or "")
        incoming = self._roads.get(connection.incoming_road)
        problem = ""
        if way is None:
            problem = f"{key} '{road_id}' is not in the file" if road_id else f"it has no {key}"
        elif incoming is None:
            problem = f"incomingRoad '{connection.incoming_road}' is not in the file"
        elif not junction.is_direct and way.junction != junction.id:
            problem = (
                f"connectingRoad {way.id} must be of this junction, got junction '{way.junction}'"
            )
        if problem or way is None or incoming is None:
            return self._dropped(line, name, problem)
        entry = connection.contact_point or _entry(way, incoming)
        if not entry or (junction.is_direct and entry not in way.ends_at(junction.id)):
            return self._dropped(line, name, f"it needs the contactPoint of road {way.id}")
        if entry != connection.contact_point:
            self._notes.add("entry", line, f"{name}: contactPoint is missing, read as {entry}")
            connection = replace(connection, contact_point=entry)
        if not incoming.ends_at(junction.id):
            joined = self._joined(junction, connection, incoming, way)
            if joined is None:
                what = f"incomingRoad {incoming.id} has no link to this junction"
                return self._dropped(line, name, what)
            incoming = joined
        return self._with_lanes(connection, line, name, junction, incoming, way)

    def _joined(
        self, junction: Junction, connection: Connection, incoming: Road, way: Road
    ) -> Road | None:
        """Return an incoming road with the link to its junction that it lacks."""
        # The missing link is added only if the connecting road itself names that end of the
        # incoming road, and nothing else is there: the way was already in the file, said on one
        # side.
        link = way.link(connection.contact_point)
        if junction.is_direct or link is None or link.element_id != incoming.id:
            return None
        contact = link.contact_point
        if link.element_type != "road" or contact is None or incoming.link(contact) is not None:
            return None
        added = RoadLink("junction", junction.id)
        joined = (
            replace(incoming, predecessor=added)
            if contact == "start"
            else replace(incoming, successor=added)
        )
        what = f"road {incoming.id}: its {contact} has no link to junction {junction.id}"
        self._notes.add(
            "one-sided", self._lines[id(incoming)], f"{what}, which it leads into: read with it"
        )
        self._set(incoming, joined)
        return joined

    def _with_lanes(
        self,
        connection: Connection,
        line: int,
        name: str,
        junction: Junction,
        incoming: Road,
        way: Road,
    ) -> Connection | None:
        """Return a connection with the lane links whose lanes there are."""
        kept = []
        for link in connection.lane_links:
            missing = None
            if not any(
                incoming.section_at(end).lane(link.from_lane)
                for end in incoming.ends_at(junction.id)
            ):
                missing = incoming.id, link.from_lane
            elif not way.section_at(connection.contact_point).lane(link.to_lane):
                missing = way.id, link.to_lane
            if missing is None:
                kept.append(link)
                continue
            what = f"{name}: road {missing[0]} has no lane {missing[1]} there"
            self._notes.add("no such lane", line, f"{what}: the laneLink is left out")
        if len(kept) == len(connection.lane_links):
            return connection
        if not kept:
            return self._dropped(line, name, "none of its lanes exists")
        return replace(connection, lane_links=tuple(kept))

    def _dropped(self, line: int, name: str, problem: str) -> Connection | None:
        """Say that a connection is left out; return what takes its place: nothing."""
        self._notes.add("no connection", line, f"{name}: {problem}: it is left out")
        return None


def _entry(way: Road, incoming: Road) -> str:
    """Return the end of a connecting road at which it links to a road; empty if not one does."""
    ends = [
        end
        for end in CONTACTS
        if (link := way.link(end)) is not None
        and (link.element_type, link.element_id) == ("road", incoming.id)
    ]
    return ends[0] if len(ends) == 1 else ""
