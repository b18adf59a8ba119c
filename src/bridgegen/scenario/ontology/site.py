"""The road network of a scenario: the individuals' statements on layers 1 and 2.

The same description comes from a scenario's template (`bridgegen.scenario.ontology.templates`) or
from a map that was made elsewhere (`bridgegen.openx.opendrive.site.find_site`).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

Direction = Literal["in", "out"]
LaneType = Literal["driving", "shoulder", "sidewalk"]

JunctionEnd = Literal["start", "end", "none"]
"""The end of a road's reference line that is nearer to its junction, if it has one."""


class Searched(float):
    """A measure [unit of its parameter] that a parameter of the scenario gives."""

    parameter: str

    def __new__(cls, value: float, parameter: str) -> "Searched":
        """Return the value that a parameter has now."""
        made = super().__new__(cls, value)
        made.parameter = parameter
        return made

    # Copying and pickling a float call `__new__` with its value alone, which has no parameter then.
    def __getnewargs__(self) -> tuple[float, str]:  # type: ignore[override]
        """Return what a copy is made of."""
        return float(self), self.parameter


@dataclass(frozen=True, slots=True)
class SiteLane:
    """A lane of an arm, or a strip beside its lanes.

    Attributes:
        lane_id: OpenDRIVE's id, never 0.
        direction: ``"in"`` leads to the junction, ``"out"`` away from it; of a strip, its side.
        width: [m].
        type: OpenDRIVE's.
        turns: where it leads across the junction; empty: by rule.
    """

    lane_id: int
    direction: Direction
    width: float
    type: LaneType = "driving"
    turns: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SiteSegment:
    """A stretch of an arm's reference line [m, 1/m]: its curvature changes evenly."""

    length: float
    start_curvature: float
    end_curvature: float


@dataclass(frozen=True, slots=True)
class ArmRoad:
    """A road of a leg.

    Attributes:
        road_id: OpenDRIVE's id.
        length: [m].
        junction_end: the end of the reference line that is nearer to the junction; "none" of a
            road without one, which counts from its start.
        lanes: its lanes, strips among them.
        speed_limit: [m/s], where known.
        road_type: town, rural or motorway, where known.
        segments: of its reference line; empty: straight.
        counts: number of lanes in and out, where a parameter gives it.
        grade: its rise along the reference line by its length [1].
        change: of a road that meets no junction: where it is different from [m], its type and its
            markings from there on; "": as before.
        closes: weather parameters beyond which it is closed, with the limits [%].
        station: where on the reference line distances begin [m], if not at the road's end.
        bends: of a map: absolute curvature of its reference line [1/m] at even steps from its
            nearer end to its farther one.
    """

    road_id: str
    length: float
    junction_end: JunctionEnd
    lanes: tuple[SiteLane, ...]
    speed_limit: float | None = None
    road_type: str | None = None
    segments: tuple[SiteSegment, ...] = ()
    grade: float = 0.0
    change: tuple[float, str, str] | None = None
    counts: Mapping[Direction, float] = field(default_factory=lambda: MappingProxyType({}))
    closes: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    station: float | None = None
    bends: tuple[float, ...] = field(default=(), compare=False, repr=False)

    def along(self, direction: Direction) -> tuple[SiteLane, ...]:
        """Return the driving lanes of a direction, the innermost (nearest to the centre) first."""
        lanes = [
            site_lane
            for site_lane in self.lanes
            if site_lane.direction == direction and site_lane.type == "driving"
        ]
        return tuple(sorted(lanes, key=lambda lane: abs(lane.lane_id)))

    @property
    def near(self) -> float:
        """Where distances begin along its reference line [m]."""
        if self.station is not None:
            return self.station
        return self.length if self.junction_end == "end" else 0.0

    def distance(self, s: float) -> float | None:
        """Return how far from its nearer end a place along its reference line lies [m].

        None: not on the part that the leg has of it.
        """
        found = self.near - s if self.junction_end == "end" else s - self.near
        return min(max(found, 0.0), self.length) if -0.5 <= found <= self.length + 0.5 else None

    @property
    def strips(self) -> tuple[SiteLane, ...]:
        """What lies beside the driving lanes."""
        return tuple(lane for lane in self.lanes if lane.type != "driving")

    def width(self, direction: Direction) -> float:
        """Return how wide the road is on the side of a direction, strips included [m]."""
        return sum(lane.width for lane in self.lanes if lane.direction == direction)


@dataclass(frozen=True, slots=True)
class Leg:
    """One leg of the intersection.

    Attributes:
        name: ``"A"`` (south), ``"B"`` (west), ``"C"`` (north), ``"D"`` (east), …; or what the
            template calls it.
        heading_deg: direction in which it leaves the junction [deg], counter-clockwise from +x.
        roads: the road that touches the junction, then its continuations, outwards.
    """

    name: str
    heading_deg: float
    roads: tuple[ArmRoad, ...]

    @property
    def length(self) -> float:
        """Length of the whole leg [m]."""
        return sum(road.length for road in self.roads)

    def turning(self, first: float, last: float) -> float:
        """Return by how much it turns between two distances [m], bend by bend [rad]."""
        found, begin = 0.0, 0.0
        for road in self.roads:
            if len(road.bends) > 1:
                step = road.length / (len(road.bends) - 1)
                within = (first <= begin + k * step <= last for k in range(len(road.bends)))
                found += step * sum(k for k, there in zip(road.bends, within, strict=True) if there)
            begin += road.length
        return found

    def road_end(self, distance: float) -> float:
        """Return how far the road reaches [m along the leg] that lies at a distance."""
        return sum(road.length for road in self.roads[: self.road_at(distance) + 1])

    def road_at(self, distance: float) -> int:
        """Return the index of the road that lies ``distance`` [m] from the junction.

        A distance beyond the leg's end gives its last road.
        """
        end = 0.0
        for index, road in enumerate(self.roads):
            end += road.length
            if distance <= end:
                return index
        return len(self.roads) - 1


@dataclass(frozen=True, slots=True)
class Facility:
    """Something of layer 2 (or a crosswalk) on or beside the first road of a leg.

    Attributes:
        cls: its class in the ontology.
        leg: the leg's name.
        distance: [m] along the leg, from the junction's edge (or the road's start).
        t: [m] from the reference line, left of its direction positive; None where it lies across.
        width: [m] along the road, of a crosswalk.
        governs: directions whose lanes it governs (of a stop line: those that it marks).
        speed_limit: [m/s], of a speed limit sign.
        object_id: OpenDRIVE's id on a map; None: by its class and its road.
        number: which of its class on its leg it is.
        s: on a map, where along its road's reference line [m].
    """

    cls: str
    leg: str
    distance: float
    t: float | None = None
    width: float | None = None
    governs: tuple[Direction, ...] = ()
    speed_limit: float | None = None
    object_id: str | None = None
    number: int = 1
    s: float | None = None


@dataclass(frozen=True, slots=True)
class Phase:
    """A phase of traffic lights: its duration [s], and whose lights are green or yellow."""

    name: str
    duration: float
    green: tuple[str, ...] = ()
    yellow: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Site:
    """A road network with its legs.

    Attributes:
        name: of the road network.
        map_file: the OpenDRIVE file it is part of; None where it is generated.
        place_id: OpenDRIVE's id of the junction; of a stretch of road see
            `openx.opendrive.stretches`.
        size: from a leg's end to the opposite leg's [m], where it is one number.
        legs: in the order of their names.
        kind: the class of the area in which the legs meet; None of a road without one.
        measures_of: further data properties of that area.
        facilities: what stands and lies on the legs.
        phases: of the traffic lights, in their order; empty: none.
        signal_offset: time of the signals' cycle that has passed at time 0 [s].
        left_hand: whether traffic drives on the left: then this is its mirror image.
        country: by whose law priority is judged, see `RoadsSpec`.
    """

    name: str
    map_file: str | None
    place_id: str
    size: float | None
    legs: tuple[Leg, ...]
    kind: str | None = "Intersection"
    measures_of: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    facilities: tuple[Facility, ...] = ()
    phases: tuple[Phase, ...] = ()
    signal_offset: float = 0.0
    left_hand: bool = False
    country: str = ""

    def leg(self, name: str) -> Leg | None:
        """Return a leg by name, or None."""
        return next((leg for leg in self.legs if leg.name == name), None)

    @property
    def where(self) -> str:
        """Which place of its map it is, in words."""
        known = {None: "road", "Roundabout": "roundabout", "Merge": "merge"}
        kind = known.get(self.kind, "junction")
        return f"{kind} {self.place_id}"

    def measures(self, starts: Iterable[tuple[str, float]]) -> dict[str, float]:
        """Return the measures of a template as this site has them.

        Args:
            starts: the legs along which a start is searched, and where it usually is [m]: as
                ``arm_length`` (of a road: ``length``) counts where the nearest of these roads
                ends, for a start must not leave its road.
        """
        roads = {leg.name: leg.roads[0] for leg in self.legs}
        lanes = [lane for road in roads.values() for lane in road.lanes if lane.type == "driving"]
        ways: tuple[Direction, ...] = ("in", "out")
        counts = [len(road.along(way)) for road in roads.values() for way in ways]
        legs = {leg.name: leg for leg in self.legs}
        ends = [legs[name].road_end(at) for name, at in starts if name in legs]
        length = min(ends or [road.length for road in roads.values()])
        found = {"lane_width": min(lane.width for lane in lanes)}
        if self.kind is None:
            (road,) = roads.values()
            ahead, against = (float(len(road.along(way))) for way in ("out", "in"))
            return found | {"length": length, "lanes": ahead, "lanes_against": against}
        found |= {
            "lanes_per_direction": float(min(count for count in counts if count)),
            "arm_length": length,
        }
        return found if self.size is None else found | {"intersection_size": self.size}
