"""A single-lane roundabout as a road network: a ring of one-way roads, a junction at each leg.

Traffic goes round counter-clockwise. At a leg the ring's road ends, and three connecting roads
lead on: out to the leg, on around the ring, and from the leg into the ring.
"""

import math
from itertools import pairwise

from bridgegen.base import elementary
from bridgegen.base.errors import OntologyError
from bridgegen.openx.opendrive.from_owl.arms import (
    EDGE,
    LEVEL,
    Arm,
    Ray,
    along,
    arm_road,
    joining,
    types_of,
)
from bridgegen.openx.opendrive.from_owl.intersection import connecting_sections
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
    Width,
)
from bridgegen.openx.opendrive.plan_view import Cubic, Geometry
from bridgegen.openx.opendrive.user_data import UserData, user_datum

APPROACH = 14.0
"""Distance from the ring's centre line to where a leg begins [m]: room for the curves in and out;
ours."""

_WIDEST = math.radians(35.0)
_SHARE = 0.36
"""Share of the angle between two legs that the junction of one takes up on each side."""


def build(
    name: str,
    junction_id: str,
    radius: float,
    ring_width: float,
    arms: tuple[Arm, ...],
    user_data: tuple[UserData, ...] = (),
) -> OpenDrive:
    """Return the road network of a roundabout around the origin.

    The junctions get the ids from ``junction_id`` on, which no arm may have.

    Args:
        name: of the road network.
        junction_id: of the first leg's junction.
        radius: of the ring lane's centre [m].
        ring_width: of the ring lane [m].
        arms: three to five, one lane in and one out each.
        user_data: its further values; the first junction carries them, the others name that.

    Raises:
        OntologyError: a leg with other lanes, or curves too tight for a car.
    """
    problems = [
        f"leg {arm.name} of a roundabout must have one lane in and one out, got "
        f"{len(arm.inbound)} and {len(arm.outbound)}"
        for arm in arms
        if (len(arm.inbound), len(arm.outbound)) != (1, 1)
    ]
    if problems:
        raise OntologyError(*problems)
    around = sorted(arms, key=lambda arm: arm.heading_deg % 360.0)
    angles = [math.radians(arm.heading_deg % 360.0) for arm in around]
    gaps = [b - a for a, b in pairwise([*angles, angles[0] + math.tau])]
    halves = [min(_WIDEST, _SHARE * min(gaps[k - 1], gaps[k])) for k in range(len(around))]
    ids = [str(int(junction_id) + k) for k in range(len(around))]
    free = max(int(ids[-1]), *(int(arm.road_id) for arm in arms)) + 1
    rings = [str(free + k) for k in range(len(around))]
    free += len(rings)
    roads = [arm_road(arm, radius + APPROACH, item) for arm, item in zip(around, ids, strict=True)]
    junctions: list[Junction] = []
    for k, arm in enumerate(around):
        following = (k + 1) % len(around)
        start, end = angles[k] + halves[k], angles[k] + gaps[k] - halves[following]
        roads.append(
            Road(
                id=rings[k],
                length=radius * (end - start),
                name=f"ring {arm.name} {around[following].name}",
                predecessor=RoadLink("junction", ids[k]),
                successor=RoadLink("junction", ids[following]),
                types=types_of(arm.speed_limit, arm.road_type),
                plan_view=(_arc(radius, start, end),),
                elevations=LEVEL,
                lane_offsets=(Cubic(0.0, 0.5 * ring_width, 0.0, 0.0, 0.0),),
                sections=_ring_sections(ring_width),
            )
        )
        before, beyond = rings[k - 1], rings[k]
        first, last = angles[k] - halves[k], angles[k] + halves[k]
        way_in = _ray(radius, last)
        way_out = _ray(radius, first)
        leg_in = arm.ray(2.0 * (radius + APPROACH), 0, inbound=True)
        leg_out = arm.ray(2.0 * (radius + APPROACH), 0, inbound=False)
        lane_in = arm.lane_id(0, inbound=True)
        lane_out = arm.lane_id(0, inbound=False)
        ring_lane = (ring_width, -1)
        ways = (
            (
                (_arc(radius, first, last),),
                (before, "end", *ring_lane),
                (beyond, "start", *ring_lane),
                "ring",
            ),
            (
                joining(way_out, leg_out, f"the way out to leg {arm.name}"),
                (before, "end", *ring_lane),
                (arm.road_id, arm.junction_end, arm.outbound[0], lane_out),
                "out",
            ),
            (
                joining(leg_in, way_in, f"the way in from leg {arm.name}"),
                (arm.road_id, arm.junction_end, arm.inbound[0], lane_in),
                (beyond, "start", *ring_lane),
                "in",
            ),
        )
        connections: list[Connection] = []
        for geometries, left, entered, what in ways:
            road_id = str(free)
            free += 1
            length = geometries[-1].s + geometries[-1].length
            widening = (entered[2] - left[2]) / length
            roads.append(
                Road(
                    id=road_id,
                    length=length,
                    junction=ids[k],
                    name=f"{what} {arm.name}",
                    predecessor=RoadLink("road", left[0], left[1]),
                    successor=RoadLink("road", entered[0], entered[1]),
                    types=types_of(arm.speed_limit, arm.road_type),
                    plan_view=geometries,
                    elevations=LEVEL,
                    lane_offsets=(Cubic(0.0, 0.5 * left[2], 0.5 * widening, 0.0, 0.0),),
                    sections=connecting_sections(left[3], entered[3], left[2], widening),
                )
            )
            links = (LaneLink(left[3], -1),)
            connections.append(Connection(str(len(connections)), left[0], road_id, "start", links))
        about = user_data if k == 0 else (user_datum("part_of", ids[0]),)
        junctions.append(
            Junction(ids[k], f"{name} {arm.name}", tuple(connections), user_data=about)
        )
    header = Header(1, 7, name=name, version="1.00", vendor="BridgeGen")
    return OpenDrive(header, tuple(roads), (), tuple(junctions))


def _ray(radius: float, angle: float) -> Ray:
    """Return a place of the ring and its direction of travel."""
    heading = math.remainder(angle + 0.5 * math.pi, math.tau)
    return Ray(radius * elementary.cos(angle), radius * elementary.sin(angle), heading)


def _arc(radius: float, start: float, end: float) -> Geometry:
    at = _ray(radius, start)
    return along(0.0, at.x, at.y, at.h, radius * (end - start), 1.0 / radius)


def _ring_sections(width: float) -> tuple[LaneSection, ...]:
    lane = Lane(-1, "driving", widths=(Width(0.0, width, 0.0, 0.0, 0.0),), road_marks=EDGE)
    return (LaneSection(0.0, center=(Lane(0, "none", road_marks=EDGE),), right=(lane,)),)
