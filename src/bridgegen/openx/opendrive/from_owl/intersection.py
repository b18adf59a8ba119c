"""An intersection as a road network: arms, one-way connecting roads, one junction.

Every pair of lanes has a connecting road of its own. Its reference line runs along the lane's
centre (a lane offset of half a width puts it there), so a turn's geometry is its lane's.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from bridgegen.openx.opendrive.from_owl.arms import LEVEL, NONE, Arm, arm_road, joining, types_of
from bridgegen.openx.opendrive.furniture import Controller
from bridgegen.openx.opendrive.model import (
    Connection,
    Header,
    Junction,
    JunctionController,
    Lane,
    LaneLink,
    LaneSection,
    OpenDrive,
    Road,
    RoadLink,
    Width,
)
from bridgegen.openx.opendrive.plan_view import Cubic
from bridgegen.openx.opendrive.user_data import UserData

Turn = Literal["left", "straight", "right"]
TURNS: tuple[Turn, ...] = ("right", "straight", "left")
"""Turns from a leg of four to the next ones, counter-clockwise: traffic keeps right."""

_STRAIGHT = 30.0
"""Turn angle below which a path goes straight on, at junctions of other than four legs [deg]."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """A way across from lane to lane; lanes count from the centre line, from 0."""

    arm: Arm
    to_arm: Arm
    lane: int
    to_lane: int
    turn: Turn


def crossings(arms: tuple[Arm, ...]) -> Iterator[Crossing]:
    """Yield the ways across, leg by leg, lane by lane from the centre line, left before right.

    Straight on, lane k leads to lane k; left turns lead from the innermost lane to the innermost,
    right turns from the outermost to the outermost. A lane that none of this leads across (there
    are fewer lanes opposite) goes straight on to the outermost. Where a lane says which turns it
    allows, these are its ways: the k-th lane of a turn leads to the k-th lane, from the inside in
    a left turn, from the outside in a right one, and straight on to the lane ahead if it can.
    """
    for arm in arms:
        ways = _ways(arm, arms)
        last = len(arm.inbound) - 1
        for lane in range(last + 1):
            if arm.turns and arm.turns[lane]:
                yield from _allowed(arm, lane, ways)
                continue
            left = lane == 0 and bool(ways["left"])
            right = lane == last and bool(ways["right"])
            if left:
                for to in ways["left"]:
                    yield Crossing(arm, to, 0, 0, "left")
            ahead = max((len(to.outbound) - 1 for to in ways["straight"]), default=-1)
            if lane <= ahead or (ahead >= 0 and not left and not right):
                for to in ways["straight"]:
                    yield Crossing(arm, to, lane, min(lane, len(to.outbound) - 1), "straight")
            elif not left and not right:  # nothing lies ahead: the lane goes with its neighbours
                turn: Turn = "left" if ways["left"] else "right"
                for to in ways[turn]:
                    place = min(lane, len(to.outbound) - 1)
                    if turn == "right":
                        place = max(len(to.outbound) - 1 - (last - lane), 0)
                    yield Crossing(arm, to, lane, place, turn)
            if right:
                for to in ways["right"]:
                    yield Crossing(arm, to, last, len(to.outbound) - 1, "right")


def _ways(arm: Arm, arms: tuple[Arm, ...]) -> dict[Turn, list[Arm]]:
    """Return the legs that a leg leads to, by turn, of those that have a lane out."""
    ways: dict[Turn, list[Arm]] = {"left": [], "straight": [], "right": []}
    if len(arms) == len(TURNS) + 1:
        around = sorted(arms, key=lambda arm: arm.heading_deg % 360.0)
        first = around.index(arm)
        for k, turn in enumerate(TURNS, start=1):
            ways[turn].append(around[(first + k) % len(around)])
    else:
        for to in arms:
            if to is not arm:
                angle = math.remainder(to.heading_deg - arm.heading_deg - 180.0, 360.0)
                bends: Turn = "left" if angle > 0.0 else "right"
                ways["straight" if abs(angle) < _STRAIGHT else bends].append(to)
    return {turn: [to for to in legs if to.outbound] for turn, legs in ways.items()}


def _allowed(arm: Arm, lane: int, ways: dict[Turn, list[Arm]]) -> Iterator[Crossing]:
    """Yield the ways of a lane that states its allowed turns."""
    turns: tuple[Turn, ...] = ("left", "straight", "right")
    for turn in turns:
        if turn not in arm.turns[lane]:
            continue
        such = [k for k, allowed in enumerate(arm.turns) if turn in allowed]
        for to in ways[turn]:
            most = len(to.outbound) - 1
            order = such.index(lane)
            if turn == "left":
                place = min(order, most)
            elif turn == "right":
                place = max(most - such[::-1].index(lane), 0)
            else:  # as near to its own place as leaves room for the lanes outside it
                place = min(max(min(such[0], most + 1 - len(such)), 0) + order, most)
            yield Crossing(arm, to, lane, place, turn)


def dead_ends(arms: tuple[Arm, ...]) -> Iterator[tuple[Arm, int]]:
    """Yield the lanes that lead nowhere: the arm, and the lane's number from the centre line."""
    served = {(crossing.arm.road_id, crossing.lane) for crossing in crossings(arms)}
    for arm in arms:
        for lane in range(len(arm.inbound)):
            if (arm.road_id, lane) not in served:
                yield arm, lane + 1


def build(
    name: str,
    junction_id: str,
    size: float,
    arms: tuple[Arm, ...],
    controllers: tuple[Controller, ...] = (),
    user_data: tuple[UserData, ...] = (),
) -> OpenDrive:
    """Return the road network of an intersection around the origin.

    Args:
        name: of the road network.
        junction_id: differs from every arm's id.
        size: from one leg's end to the opposite one's [m].
        arms: two or more; their ids and the junction's are whole numbers.
        controllers: of the arms' traffic lights.
        user_data: further values of the junction.

    Raises:
        OntologyError: two lanes cannot be joined by a curve that a car can drive.
    """
    roads = [arm_road(arm, 0.5 * size, junction_id) for arm in arms]
    connections: list[Connection] = []
    # Above the junction's id, too: CARLA finds no way into a junction whose id a road has.
    free = max(int(junction_id), *(int(arm.road_id) for arm in arms)) + 1
    for number, crossing in enumerate(crossings(arms)):
        # One-way, and one for each pair of lanes: only such connecting roads are read alike by
        # esmini, CARLA, netconvert and CommonRoad.
        road = _connecting(crossing, str(free + number), size, junction_id)
        roads.append(road)
        incoming = crossing.arm.lane_id(crossing.lane, inbound=True)
        connections.append(
            # Lane links stand in the connecting road and in the junction: readers look in either.
            Connection(
                str(number), crossing.arm.road_id, road.id, "start", (LaneLink(incoming, -1),)
            )
        )
    # No date and no offset: the same network gives the same bytes, and not all readers apply an
    # offset.
    header = Header(1, 7, name=name, version="1.00", vendor="BridgeGen")
    junction = Junction(
        junction_id,
        name,
        tuple(connections),
        controllers=tuple(
            JunctionController(controller.id, type="0") for controller in controllers
        ),
        user_data=user_data,
    )
    return OpenDrive(header, tuple(roads), controllers, (junction,))


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
        types=types_of(arm.speed_limit, arm.road_type),
        plan_view=geometries,
        elevations=LEVEL,
        lane_offsets=(Cubic(0.0, 0.5 * width, 0.5 * widening, 0.0, 0.0),),
        sections=connecting_sections(lane_id, to_lane_id, width, widening),
    )


def connecting_sections(
    lane_id: int, to_lane_id: int, width: float, widening: float
) -> tuple[LaneSection, ...]:
    """Return the one lane of a connecting road, which may widen [m per m]."""
    lane = Lane(
        -1,
        "driving",
        predecessors=(lane_id,),
        successors=(to_lane_id,),
        widths=(Width(0.0, width, widening, 0.0, 0.0),),
        road_marks=NONE,
    )
    return (LaneSection(0.0, center=_CENTRE, right=(lane,)),)


_CENTRE = (Lane(0, "none", road_marks=NONE),)
