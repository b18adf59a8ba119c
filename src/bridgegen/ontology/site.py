"""The intersection that a scenario takes place at: what a storyboard needs to know of the roads.

The same description comes from the static parameters (`Site.generated`) or from a map that was
made elsewhere (`bridgegen.openx.opendrive.site.find_site`).
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from bridgegen.errors import OntologyError
from bridgegen.odd.parameters import TOLERANCE

SPEED_LIMIT = 13.9
"""Speed limit of generated legs [m/s]: 50 km/h, the usual limit in towns."""

HEADINGS = {"A": 270.0, "B": 180.0, "C": 90.0, "D": 0.0}
"""Outward heading [deg] of the legs of the paper's crossroads, counter-clockwise from +x (east)."""

JUNCTION_ID = "100"


@dataclass(frozen=True, slots=True)
class SiteLane:
    """A driving lane of an arm.

    Attributes:
        lane_id: OpenDRIVE's id, never 0.
        direction: ``"in"`` leads to the junction, ``"out"`` away from it.
        width: [m].
    """

    lane_id: int
    direction: Literal["in", "out"]
    width: float


@dataclass(frozen=True, slots=True)
class ArmRoad:
    """A road of a leg.

    Attributes:
        road_id: OpenDRIVE's id.
        length: [m].
        junction_end: the end of the reference line that is nearer to the junction.
        lanes: its driving lanes.
        speed_limit: [m/s], where known.
    """

    road_id: str
    length: float
    junction_end: Literal["start", "end"]
    lanes: tuple[SiteLane, ...]
    speed_limit: float | None = None

    def along(self, direction: Literal["in", "out"]) -> tuple[SiteLane, ...]:
        """Return the lanes of one direction, the innermost (nearest to the centre line) first."""
        lanes = [lane for lane in self.lanes if lane.direction == direction]
        return tuple(sorted(lanes, key=lambda lane: abs(lane.lane_id)))


@dataclass(frozen=True, slots=True)
class Leg:
    """One leg of the intersection.

    Attributes:
        name: ``"A"`` (south), ``"B"`` (west), ``"C"`` (north), ``"D"`` (east).
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
class Site:
    """An intersection with its legs.

    Attributes:
        name: of the road network.
        map_file: the OpenDRIVE file it is part of; None where it is generated.
        junction_id: OpenDRIVE's id.
        size: stop line to the opposite stop line [m], where it is one number.
        legs: in the order of their names.
    """

    name: str
    map_file: str | None
    junction_id: str
    size: float | None
    legs: tuple[Leg, ...]

    def measures(self, legs: Iterable[str]) -> dict[str, float]:
        """Return the static parameters as this site has them.

        Args:
            legs: names of the legs along which a start is searched: as ``arm_length`` counts the
                shortest of their roads at the junction, for a start must not leave its road.
        """
        roads = {leg.name: leg.roads[0] for leg in self.legs}
        lanes = [lane for road in roads.values() for lane in road.lanes]
        counts = [len(road.along(way)) for road in roads.values() for way in ("in", "out")]
        starts = [roads[name] for name in legs if name in roads] or list(roads.values())
        found = {
            "lane_width": min(lane.width for lane in lanes),
            "lanes_per_direction": float(min(counts)),
            "arm_length": min(road.length for road in starts),
        }
        return found if self.size is None else found | {"intersection_size": self.size}

    @classmethod
    def generated(cls, values: Mapping[str, float], name: str = "crossroads") -> "Site":
        """Return the crossroads of four equal legs at right angles.

        Each leg's reference line runs outwards, so inbound lanes have positive ids.

        Args:
            values: ``lane_width`` [m], ``lanes_per_direction``, ``arm_length`` [m],
                ``intersection_size`` [m]; others are ignored.
            name: of the road network.

        Raises:
            OntologyError: ``lanes_per_direction`` is no whole number.
        """
        width = float(values["lane_width"])
        lanes_each_way = float(values["lanes_per_direction"])
        count = round(lanes_each_way) if math.isfinite(lanes_each_way) else 0
        if not abs(lanes_each_way - count) <= TOLERANCE:
            raise OntologyError(f"lanes_per_direction must be a whole number, got {lanes_each_way}")
        lanes = tuple(SiteLane(k, "in", width) for k in range(1, count + 1)) + tuple(
            SiteLane(-k, "out", width) for k in range(1, count + 1)
        )
        length = float(values["arm_length"])
        return cls(
            name=name,
            map_file=None,
            junction_id=JUNCTION_ID,
            size=float(values["intersection_size"]),
            legs=tuple(
                Leg(leg, heading, (ArmRoad(str(number), length, "start", lanes, SPEED_LIMIT),))
                for number, (leg, heading) in enumerate(HEADINGS.items(), start=1)
            ),
        )
