"""The road network as OpenDRIVE describes it, in the standard's terms (ASAM OpenDRIVE 1.7).

Plain immutable values: two models are equal if their contents are. Angles are radians, lengths
metres. Each field declares its form in XML, which `read` and `write` follow.

What a file may hold besides is dropped by the reader: ``userData`` that is not ours, ``include``,
``dataQuality``, railroads and stations, junction groups, surfaces, a road's lateral shape, lane
access, height, material and rule, the parts of a road mark, an object's repeat, marking, border,
material, surface and parking space, tunnels, bridges, references to objects, a signal's physical
position.
"""

# ruff: noqa: RUF009  (fields are declared through functions that call dataclasses.field)

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.declaration import attribute, child, children, ids, only_child, text
from bridgegen.openx.opendrive.furniture import Controller, Object, Signal, SignalReference
from bridgegen.openx.opendrive.plan_view import LENGTH_LIMIT, Cubic, Geometry
from bridgegen.openx.opendrive.user_data import UserData

CONTACTS = ("start", "end")
JUNCTION_TYPES = ("default", "direct")
NO_JUNCTION = "-1"
"""The value of ``Road.junction`` for a road outside junctions."""

DRIVABLE = frozenset(
    ("driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane", "bidirectional")
)
"""Types of lane that cars travel on."""

SPEED_UNITS = {"m/s": 1.0, "km/h": 1 / 3.6, "mph": 0.44704}


# -- lanes ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Width(Cubic):
    """A lane's width [m]; ``s`` counts from the start of the lane section."""

    s: float = attribute("sOffset", unit="m", low=0.0)


@dataclass(frozen=True, slots=True)
class Border(Cubic):
    """A lane's outer border [m from the reference line]; ``s`` counts from the section's start.

    The reader turns borders into widths (`bridgegen.openx.opendrive.repair`).
    """

    s: float = attribute("sOffset", unit="m", low=0.0)


@dataclass(frozen=True, slots=True)
class RoadMark:
    """The marking of a lane's outer border; ``s`` counts from the start of the lane section."""

    DECORATION: ClassVar[bool] = True
    s: float = attribute("sOffset", unit="m", low=0.0)
    type: str = attribute("type")
    color: str = attribute("color", default="standard")
    weight: str | None = attribute("weight", default=None)
    material: str | None = attribute("material", default=None)
    width: float | None = attribute("width", default=None, unit="m", low=0.0)
    lane_change: str | None = attribute("laneChange", default=None)
    height: float | None = attribute("height", default=None, unit="m", low=0.0)


@dataclass(frozen=True, slots=True)
class LaneSpeed:
    """The speed limit of a lane, from ``s`` after the start of the lane section."""

    s: float = attribute("sOffset", unit="m", low=0.0)
    max: float = attribute("max", low=0.0)
    unit: str = attribute("unit", default="m/s", words=tuple(SPEED_UNITS))


@dataclass(frozen=True, slots=True)
class Lane:
    """A lane of a section; positive ids lie left of the reference line, negative right of it."""

    id: int = attribute("id", high=1000)
    type: str = attribute("type", default="none")
    level: bool = attribute("level", default=False)
    predecessors: tuple[int, ...] = ids("link/predecessor")
    successors: tuple[int, ...] = ids("link/successor")
    widths: tuple[Width, ...] = children("width")
    borders: tuple[Border, ...] = children("border")
    road_marks: tuple[RoadMark, ...] = children("roadMark")
    speeds: tuple[LaneSpeed, ...] = children("speed")
    user_data: tuple[UserData, ...] = children("userData")

    @property
    def drivable(self) -> bool:
        """Cars may travel on it."""
        return self.type in DRIVABLE


@dataclass(frozen=True, slots=True)
class LaneSection:
    """The lanes of a road from ``s`` until the next section."""

    s: float = attribute("s", unit="m", low=0.0)
    single_side: bool = attribute("singleSide", default=False)
    left: tuple[Lane, ...] = children("left/lane")
    center: tuple[Lane, ...] = children("center/lane", least=1)
    right: tuple[Lane, ...] = children("right/lane")

    @property
    def lanes(self) -> tuple[Lane, ...]:
        """All lanes but the centre's, which has no width."""
        return self.left + self.right

    def lane(self, lane_id: int) -> Lane | None:
        """Return a lane by its id, or None."""
        for lane in self.left if lane_id > 0 else self.right:
            if lane.id == lane_id:
                return lane
        return None


# -- roads ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class RoadLink:
    """What a road is joined to at one end: a road's start or end, or a junction."""

    element_type: str = attribute("elementType", words=("road", "junction"))
    element_id: str = attribute("elementId")
    contact_point: str | None = attribute("contactPoint", default=None, words=CONTACTS)


@dataclass(frozen=True, slots=True)
class Speed:
    """A speed limit: a number in ``unit``, or "no limit", or "undefined"."""

    max: float | str = attribute("max", low=0.0, words=("no limit", "undefined"))
    unit: str = attribute("unit", default="m/s", words=tuple(SPEED_UNITS))

    @property
    def metres_per_second(self) -> float | None:
        """The limit [m/s], None where there is no number."""
        return None if isinstance(self.max, str) else self.max * SPEED_UNITS[self.unit]


@dataclass(frozen=True, slots=True)
class RoadType:
    """The kind of a road from ``s`` on, with the speed limit that goes with it."""

    s: float = attribute("s", unit="m", low=0.0)
    type: str = attribute("type")
    country: str | None = attribute("country", default=None)
    speed: Speed | None = child("speed")


@dataclass(frozen=True, slots=True)
class Road:
    """A road: a reference line, and lanes beside it.

    Attributes:
        rule: ``"RHT"`` (lanes with negative ids run along the reference line) or ``"LHT"``.
    """

    id: str = attribute("id")
    length: float = attribute("length", unit="m", above=0.0, high=LENGTH_LIMIT)
    junction: str = attribute("junction", default=NO_JUNCTION)
    name: str | None = attribute("name", default=None)
    rule: str = attribute("rule", default="RHT", words=("RHT", "LHT"))
    predecessor: RoadLink | None = child("link/predecessor")
    successor: RoadLink | None = child("link/successor")
    types: tuple[RoadType, ...] = children("type")
    plan_view: tuple[Geometry, ...] = children("planView/geometry", least=1)
    elevations: tuple[Cubic, ...] = children("elevationProfile/elevation", decoration=True)
    superelevations: tuple[Cubic, ...] = children("lateralProfile/superelevation", decoration=True)
    lane_offsets: tuple[Cubic, ...] = children("lanes/laneOffset")
    sections: tuple[LaneSection, ...] = children("lanes/laneSection", least=1)
    objects: tuple[Object, ...] = children("objects/object")
    signals: tuple[Signal, ...] = children("signals/signal")
    signal_references: tuple[SignalReference, ...] = children("signals/signalReference")
    user_data: tuple[UserData, ...] = children("userData")

    @property
    def is_connecting(self) -> bool:
        """It lies within a junction."""
        return self.junction != NO_JUNCTION

    def link(self, contact: str) -> RoadLink | None:
        """Return what the road is joined to at its ``"start"`` or its ``"end"``."""
        return self.predecessor if contact == "start" else self.successor

    def ends_at(self, junction_id: str) -> list[str]:
        """Return the ends of the road, ``"start"`` and ``"end"``, that touch a junction."""
        found = []
        for contact in CONTACTS:
            link = self.link(contact)
            if link and link.element_type == "junction" and link.element_id == junction_id:
                found.append(contact)
        return found

    def section_at(self, contact: str) -> LaneSection:
        """Return the lane section at the road's ``"start"`` or its ``"end"``."""
        return self.sections[0 if contact == "start" else -1]

    def direction(self, lane_id: int) -> int:
        """Return 1 where traffic on a lane runs along the reference line, -1 where against it."""
        return 1 if (lane_id < 0) == (self.rule == "RHT") else -1


# -- junctions, controllers, the whole -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class LaneLink:
    """From a lane of the incoming road to a lane of the connecting road."""

    from_lane: int = attribute("from")
    to_lane: int = attribute("to")


@dataclass(frozen=True, slots=True)
class Connection:
    """The way from an incoming road into another, whose ``contact_point`` it enters.

    That is a connecting road within the junction; in a direct junction the linked road beyond.
    A file must name the one or the other, and the contact point (`references` sees to it).
    """

    id: str = attribute("id")
    incoming_road: str = attribute("incomingRoad")
    connecting_road: str | None = attribute("connectingRoad", default=None)
    contact_point: str = attribute("contactPoint", words=CONTACTS, default="")
    lane_links: tuple[LaneLink, ...] = children("laneLink")
    linked_road: str | None = attribute("linkedRoad", default=None)

    @property
    def entered_road(self) -> str:
        """The id of the road that it leads into."""
        return self.connecting_road or self.linked_road or ""


@dataclass(frozen=True, slots=True)
class Priority:
    """Which of two connecting roads goes first."""

    high: str | None = attribute("high", default=None)
    low: str | None = attribute("low", default=None)


@dataclass(frozen=True, slots=True)
class JunctionController:
    """A controller that works at a junction."""

    id: str = attribute("id")
    type: str | None = attribute("type", default=None)
    sequence: int | None = attribute("sequence", default=None, low=0)


@dataclass(frozen=True, slots=True)
class Junction:
    """Where roads meet, and the ways across.

    In a ``direct`` one the roads themselves meet, with no connecting roads between them.
    """

    id: str = attribute("id")
    name: str | None = attribute("name", default=None)
    connections: tuple[Connection, ...] = children("connection")
    priorities: tuple[Priority, ...] = children("priority")
    controllers: tuple[JunctionController, ...] = children("controller")
    user_data: tuple[UserData, ...] = children("userData")
    type: str | None = attribute("type", default=None, words=JUNCTION_TYPES)

    @property
    def is_direct(self) -> bool:
        """Whether its roads meet without connecting roads."""
        return self.type == "direct"


@dataclass(frozen=True, slots=True)
class Offset:
    """Where the map's origin lies in its geographical projection; coordinates do not include it."""

    DECORATION: ClassVar[bool] = True
    x: float = attribute("x", unit="m")
    y: float = attribute("y", unit="m")
    z: float = attribute("z", unit="m")
    hdg: float = attribute("hdg", unit="rad")


@dataclass(frozen=True, slots=True)
class Header:
    """Whence the map comes."""

    DECORATION: ClassVar[bool] = True
    rev_major: int = attribute("revMajor", low=1, fallback=1)
    rev_minor: int = attribute("revMinor", low=0, fallback=4)
    name: str | None = attribute("name", default=None)
    version: str | None = attribute("version", default=None)
    date: str | None = attribute("date", default=None)
    north: float | None = attribute("north", default=None, unit="m")
    south: float | None = attribute("south", default=None, unit="m")
    east: float | None = attribute("east", default=None, unit="m")
    west: float | None = attribute("west", default=None, unit="m")
    vendor: str | None = attribute("vendor", default=None)
    geo_reference: str | None = text("geoReference")
    offset: Offset | None = child("offset")


@dataclass(frozen=True)
class OpenDrive:
    """A road network.

    Attributes:
        left_hand: whether it is the mirror image of one with left-hand traffic, which is written:
            see `bridgegen.openx.opendrive.mirror`.
    """

    header: Header = only_child("header", fallback=Header(1, 4))
    roads: tuple[Road, ...] = children("road")
    controllers: tuple[Controller, ...] = children("controller")
    junctions: tuple[Junction, ...] = children("junction")
    left_hand: bool = False

    def road(self, road_id: str) -> Road:
        """Return a road by its id.

        Raises:
            InputError: there is none.
        """
        try:
            return self.roads_by_id[road_id]
        except KeyError:
            raise InputError(f"road '{road_id}' is not in the road network") from None

    def junction(self, junction_id: str) -> Junction:
        """Return a junction by its id.

        Raises:
            InputError: there is none.
        """
        for junction in self.junctions:
            if junction.id == junction_id:
                return junction
        raise InputError(
            f"junction '{junction_id}' is not in the road network; it has "
            + (", ".join(junction.id for junction in self.junctions) or "none")
        )

    @cached_property
    def roads_by_id(self) -> dict[str, Road]:
        """The roads, by id."""
        return {road.id: road for road in self.roads}

    @cached_property
    def connections_from(self) -> dict[tuple[str, str], list[Connection]]:
        """The ways into junctions, by (junction, incoming road)."""
        found: dict[tuple[str, str], list[Connection]] = {}
        for junction in self.junctions:
            for connection in junction.connections:
                key = (junction.id, connection.incoming_road)
                found.setdefault(key, []).append(connection)
                if junction.is_direct:
                    back = self._back(junction.id, connection)
                    found.setdefault((junction.id, back.incoming_road), []).append(back)
        return found

    def _back(self, junction_id: str, connection: Connection) -> Connection:
        """Return the same link of two roads, seen from the other one."""
        touching = self.roads_by_id[connection.incoming_road].ends_at(junction_id)
        links = tuple(LaneLink(link.to_lane, link.from_lane) for link in connection.lane_links)
        return Connection(
            connection.id,
            connection.entered_road,
            None,
            touching[0],
            links,
            connection.incoming_road,
        )

    def connecting_roads(self, junction_id: str) -> Iterator[Road]:
        """Yield the roads within a junction."""
        return (road for road in self.roads if road.junction == junction_id)
