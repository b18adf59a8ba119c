"""A crossroads as a road network: arms, one-way connecting roads, one junction.

Every pair of lanes has a connecting road of its own. Its reference line runs along the lane's
centre (a lane offset of half a width puts it there), so a turn's geometry is its lane's.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from bridgegen.openx.opendrive.model import (
    Connection,
    Header,
    Junction,
    Lane,
    LaneLink,
    LaneSection,
    OpenDrive,
    Road,
    RoadLink,
    RoadMark,
    RoadType,
    Speed,
    Width,
)
from bridgegen.openx.opendrive.plan_view import Cubic
from bridgegen.openx.opendrive.turns import Ray, along, joining

Turn = Literal["left", "straight", "right"]
TURNS: tuple[Turn, ...] = ("right", "straight", "left")
"""From a leg to the next ones, counter-clockwise: traffic keeps right."""

_QUARTERS = {0: (1.0, 0.0), 90: (0.0, 1.0), 180: (-1.0, 0.0), 270: (0.0, -1.0)}


@dataclass(frozen=True, slots=True)
class Arm:
    """A leg of a crossroads to be built.

    Attributes:
        name: for messages and the road's name.
        road_id: OpenDRIVE's id.
        heading_deg: outwards, counter-clockwise from +x.
        length: [m].
        junction_end: the end of the reference line that touches the junction.
        speed_limit: [m/s], None for none.
        inbound: widths [m] of the lanes to the junction, innermost first.
        outbound: widths [m] of the lanes away from it, innermost first.
    """

    name: str
    road_id: str
    heading_deg: float
    length: float
    junction_end: Literal["start", "end"]
    speed_limit: float | None
    inbound: tuple[float, ...]
    outbound: tuple[float, ...]

    def lane_id(self, index: int, *, inbound: bool) -> int:
        """Return the id of the ``index``-th lane from the centre line."""
        left = inbound == (self.junction_end == "start")
        return index + 1 if left else -index - 1

    def ray(self, size: float, index: int, *, inbound: bool) -> Ray:
        """Return where a lane's centre meets the junction, and its direction of travel there."""
        widths = self.inbound if inbound else self.outbound
        t = sum(widths[:index]) + 0.5 * widths[index]
        t = t if inbound else -t
        dx, dy = outward(self.heading_deg)
        heading = wrapped(self.heading_deg + (180.0 if inbound else 0.0))
        return Ray(0.5 * size * dx - t * dy, 0.5 * size * dy + t * dx, heading)


@dataclass(frozen=True, slots=True)
class Crossing:
    """A way across from lane to lane; lanes count from the centre line, from 0."""

    arm: Arm
    to_arm: Arm
    lane: int
    to_lane: int
    turn: Turn


def outward(degrees: float) -> tuple[float, float]:
    """Return the unit vector of a heading, exact for right angles."""
    exact = _QUARTERS.get(int(degrees) % 360) if degrees == int(degrees) else None
    return exact or (math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))


def wrapped(degrees: float) -> float:
    """Return a heading in radians, in (-π, π]."""
    turn = math.remainder(degrees, 360.0)
    return math.radians(180.0 if turn == -180.0 else turn)


def crossings(arms: tuple[Arm, ...]) -> Iterator[Crossing]:
    """Yield the ways across, leg by leg, lane by lane from the centre line, left before right.

    Straight on, lane k leads to lane k; left turns lead from the innermost lane to the innermost,
    right turns from the outermost to the outermost. A lane that none of this leads across (there
    are fewer lanes opposite) goes straight on to the outermost.
    """
    around = sorted(arms, key=lambda arm: arm.heading_deg % 360.0)
    for arm in arms:
        first = around.index(arm)
        to = {turn: around[(first + k) % len(around)] for k, turn in enumerate(TURNS, start=1)}
        ahead, last = len(to["straight"].outbound) - 1, len(arm.inbound) - 1
        for lane in range(last + 1):
            left = lane == 0 and bool(to["left"].outbound)
            right = lane == last and bool(to["right"].outbound)
            if left:
                yield Crossing(arm, to["left"], 0, 0, "left")
            if lane <= ahead or (ahead >= 0 and not left and not right):
                yield Crossing(arm, to["straight"], lane, min(lane, ahead), "straight")
            if right:
                yield Crossing(arm, to["right"], last, len(to["right"].outbound) - 1, "right")


def dead_ends(arms: tuple[Arm, ...]) -> Iterator[tuple[Arm, int]]:
    """Yield the lanes that lead nowhere: the arm, and the lane's number from the centre line."""
    served = {(crossing.arm.road_id, crossing.lane) for crossing in crossings(arms)}
    for arm in arms:
        for lane in range(len(arm.inbound)):
            if (arm.road_id, lane) not in served:
                yield arm, lane + 1


def build(name: str, junction_id: str, size: float, arms: tuple[Arm, ...]) -> OpenDrive:
    """Return the road network of a crossroads of four arms around the origin.

    Args:
        name: of the road network.
        junction_id: differs from every arm's id.
        size: stop line to opposite stop line [m].
        arms: their ids and the junction's are whole numbers.

    Raises:
        OntologyError: two lanes cannot be joined by a curve that a car can drive.
    """
    roads = [_arm(arm, size, junction_id) for arm in arms]
    connections: list[Connection] = []
    free = max(int(junction_id), *(int(arm.road_id) for arm in arms)) + 1
    for number, crossing in enumerate(crossings(arms)):
        road = _connecting(crossing, str(free + number), size, junction_id)
        roads.append(road)
        incoming = crossing.arm.lane_id(crossing.lane, inbound=True)
        connections.append(
            Connection(
                str(number), crossing.arm.road_id, road.id, "start", (LaneLink(incoming, -1),)
            )
        )
    header = Header(1, 7, name=name, version="1.00", vendor="BridgeGen")
    return OpenDrive(header, tuple(roads), (), (Junction(junction_id, name, tuple(connections)),))


def _arm(arm: Arm, size: float, junction_id: str) -> Road:
    dx, dy = outward(arm.heading_deg)
    starts = arm.junction_end == "start"
    far = 0.5 * size if starts else 0.5 * size + arm.length
    hdg = wrapped(arm.heading_deg + (0.0 if starts else 180.0))
    link = RoadLink("junction", junction_id)
    left, right = (arm.inbound, arm.outbound) if starts else (arm.outbound, arm.inbound)
    return Road(
        id=arm.road_id,
        length=arm.length,
        name=arm.name,
        predecessor=link if starts else None,
        successor=None if starts else link,
        types=_types(arm.speed_limit),
        plan_view=(along(0.0, far * dx, far * dy, hdg, arm.length, 0.0),),
        elevations=_LEVEL,
        lane_offsets=_LEVEL,
        sections=_arm_sections(left, right),
    )


def _connecting(crossing: Crossing, road_id: str, size: float, junction_id: str) -> Road:
    arm, to_arm = crossing.arm, crossing.to_arm
    start = arm.ray(size, crossing.lane, inbound=True)
    end = to_arm.ray(size, crossing.to_lane, inbound=False)
    what = f"the {crossing.turn} turn" if crossing.turn != "straight" else "the way straight on"
    geometries = joining(start, end, f"{what} from leg {arm.name} to leg {to_arm.name}")
    length = geometries[-1].s + geometries[-1].length
    width, to_width = arm.inbound[crossing.lane], to_arm.outbound[crossing.to_lane]
    widening = (to_width - width) / length
    lane_id = arm.lane_id(crossing.lane, inbound=True)
    to_lane_id = to_arm.lane_id(crossing.to_lane, inbound=False)
    return Road(
        id=road_id,
        length=length,
        junction=junction_id,
        name=f"{arm.name}{crossing.lane + 1} {crossing.turn} {to_arm.name}{crossing.to_lane + 1}",
        predecessor=RoadLink("road", arm.road_id, arm.junction_end),
        successor=RoadLink("road", to_arm.road_id, to_arm.junction_end),
        types=_types(arm.speed_limit),
        plan_view=geometries,
        elevations=_LEVEL,
        lane_offsets=(Cubic(0.0, 0.5 * width, 0.5 * widening, 0.0, 0.0),),
        sections=_connecting_sections(lane_id, to_lane_id, width, widening),
    )


_LEVEL = (Cubic(0.0, 0.0, 0.0, 0.0, 0.0),)
_LINE_WIDTH = 0.12
_NONE = (RoadMark(0.0, "none", "standard", lane_change="none"),)
_MIDDLE = (RoadMark(0.0, "solid", "yellow", width=_LINE_WIDTH, lane_change="none"),)
_BETWEEN = (RoadMark(0.0, "broken", "standard", width=_LINE_WIDTH, lane_change="both"),)
_EDGE = (RoadMark(0.0, "solid", "standard", width=_LINE_WIDTH, lane_change="none"),)


@lru_cache(maxsize=64)
def _types(speed_limit: float | None) -> tuple[RoadType, ...]:
    if speed_limit is None:
        return (RoadType(0.0, "town"),)
    return (RoadType(0.0, "town", speed=Speed(speed_limit, "m/s")),)


@lru_cache(maxsize=64)
def _arm_sections(left: tuple[float, ...], right: tuple[float, ...]) -> tuple[LaneSection, ...]:
    def lane(side: int, index: int, widths: tuple[float, ...]) -> Lane:
        mark = _EDGE if index == len(widths) - 1 else _BETWEEN
        width = (Width(0.0, widths[index], 0.0, 0.0, 0.0),)
        return Lane(side * (index + 1), "driving", widths=width, road_marks=mark)

    return (
        LaneSection(
            0.0,
            left=tuple(lane(1, index, left) for index in reversed(range(len(left)))),
            center=(Lane(0, "none", road_marks=_MIDDLE),),
            right=tuple(lane(-1, index, right) for index in range(len(right))),
        ),
    )


def _connecting_sections(
    lane_id: int, to_lane_id: int, width: float, widening: float
) -> tuple[LaneSection, ...]:
    lane = Lane(
        -1,
        "driving",
        predecessors=(lane_id,),
        successors=(to_lane_id,),
        widths=(Width(0.0, width, widening, 0.0, 0.0),),
        road_marks=_NONE,
    )
    return (LaneSection(0.0, center=_CENTRE, right=(lane,)),)


_CENTRE = (Lane(0, "none", road_marks=_NONE),)
