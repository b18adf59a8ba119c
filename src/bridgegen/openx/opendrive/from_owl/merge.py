"""A merge as a road network: a carriageway, a ramp, and an acceleration lane that ends.

The carriageway runs along +x, its reference line on its left edge. The ramp comes from the right
at a shallow angle and becomes the acceleration lane in one bend.
"""

import math
from dataclasses import replace

from bridgegen.base import elementary
from bridgegen.base.errors import OntologyError
from bridgegen.openx.opendrive.from_owl.arms import (
    EDGE,
    LEVEL,
    Arm,
    Ray,
    along,
    centre,
    joining,
    lanes_of,
    road_of,
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
from bridgegen.openx.opendrive.plan_view import Cubic
from bridgegen.openx.opendrive.user_data import UserData

NOSE = 60.0
"""Length of the junction, from where the ramp's bend begins to where it is beside [m]; ours."""


def build(
    name: str,
    junction_id: str,
    main: Arm,
    ramp: Arm,
    after: Arm,
    merge: float,
    taper: float,
    user_data: tuple[UserData, ...] = (),
) -> OpenDrive:
    """Return the road network of a merge; the junction ends at the origin's right, at x = NOSE.

    Args:
        name: of the road network.
        junction_id: differs from every arm's id.
        main: the carriageway before.
        ramp: has one lane.
        after: the carriageway beyond, without the acceleration lane.
        merge: length of the acceleration lane [m].
        taper: length over which it narrows [m].
        user_data: further values of the junction.

    Raises:
        OntologyError: numbers of lanes that do not continue, or too short a carriageway.
    """
    problems = []
    if len(main.inbound) != len(after.outbound) or not main.inbound:
        problems.append(
            f"legs main and after must have as many lanes, got {len(main.inbound)} in and "
            f"{len(after.outbound)} out"
        )
    if len(ramp.inbound) != 1:
        problems.append(f"leg ramp must have one lane in, got {len(ramp.inbound)}")
    if main.outbound or ramp.outbound or after.inbound:
        problems.append("a merge is one way: main and ramp lead in, after leads out")
    if after.length <= merge + taper:
        problems.append(
            f"leg after must be longer than has_merge_length and has_taper_length together, "
            f"{merge + taper:g} m, got {after.length:g} m"
        )
    angle = math.remainder(ramp.heading_deg - 180.0, 360.0)
    if not 1.0 <= angle <= 30.0:
        problems.append(
            "has_heading of leg ramp must be 181 to 210 deg: it joins at a shallow angle from the "
            f"right, got {ramp.heading_deg:g}"
        )
    if problems:
        raise OntologyError(*problems)
    count, width = len(after.outbound), ramp.inbound[0]
    edge = sum(after.outbound)
    end = Ray(NOSE, -edge - 0.5 * width, 0.0)
    turn = math.radians(angle)
    radius = NOSE / elementary.sin(turn)
    start = Ray(0.0, end.y - radius * (1.0 - elementary.cos(turn)), turn)
    line = (along(0.0, -main.length, 0.0, 0.0, main.length, 0.0),)
    roads = [road_of(main, line, junction_id)]
    # The ramp's reference line is its left edge.
    x, y = (
        start.x - 0.5 * width * elementary.sin(turn),
        start.y + 0.5 * width * elementary.cos(turn),
    )
    x, y = x - ramp.length * elementary.cos(turn), y - ramp.length * elementary.sin(turn)
    ramp_line = (along(0.0, x, y, turn, ramp.length, 0.0),)
    roads.append(road_of(ramp, ramp_line, junction_id))
    beyond = (along(0.0, NOSE, 0.0, 0.0, after.length, 0.0),)
    sections = _sections(after, width, merge, taper)
    roads.append(road_of(after, beyond, junction_id, sections))
    connections = []
    free = max(int(junction_id), *(int(arm.road_id) for arm in (main, ramp, after))) + 1
    for k in range(count + 1):
        arm, lane = (main, k) if k < count else (ramp, 0)
        if k < count:
            y = -after.offset(k, inbound=False)
            ray, other = Ray(0.0, -main.offset(k, inbound=True), 0.0), Ray(NOSE, y, 0.0)
            to_width = after.outbound[k]
        else:
            ray, other, to_width = start, end, width
        road = _connecting(arm, lane, after, k, to_width, ray, other, str(free + k), junction_id)
        roads.append(road)
        connections.append(
            Connection(str(k), arm.road_id, road.id, "start", (LaneLink(-lane - 1, -1),))
        )
    header = Header(1, 7, name=name, version="1.00", vendor="BridgeGen")
    junction = Junction(junction_id, name, tuple(connections), user_data=user_data)
    return OpenDrive(header, tuple(roads), (), (junction,))


def _connecting(
    arm: Arm,
    lane: int,
    after: Arm,
    to_lane: int,
    to_width: float,
    start: Ray,
    end: Ray,
    road_id: str,
    junction_id: str,
) -> Road:
    geometries = joining(start, end, f"the way from leg {arm.name} to leg {after.name}")
    length = geometries[-1].s + geometries[-1].length
    width = arm.inbound[lane]
    widening = (to_width - width) / length
    return Road(
        id=road_id,
        length=length,
        junction=junction_id,
        name=f"{arm.name}{lane + 1} {after.name}{to_lane + 1}",
        predecessor=RoadLink("road", arm.road_id, "end"),
        successor=RoadLink("road", after.road_id, "start"),
        types=types_of(arm.speed_limit, arm.road_type),
        plan_view=geometries,
        elevations=LEVEL,
        lane_offsets=(Cubic(0.0, 0.5 * width, 0.5 * widening, 0.0, 0.0),),
        sections=connecting_sections(-lane - 1, -to_lane - 1, width, widening),
    )


def _sections(after: Arm, width: float, merge: float, taper: float) -> tuple[LaneSection, ...]:
    """Return the carriageway with the acceleration lane, the taper, and the lanes beyond."""
    count = len(after.outbound)
    found = []
    for s, extra in ((0.0, width), (merge, width), (merge + taper, 0.0)):
        last = s == merge + taper
        widths = (*after.outbound, extra) if extra else after.outbound
        lanes = list(lanes_of(-1, widths, after.strips_out))
        if s == merge:
            # The cubic from the full width to 0 that is level at both ends, so that the edge has no
            # kink.
            narrowing = (Width(0.0, width, 0.0, -3.0 * width / taper**2, 2.0 * width / taper**3),)
            lanes[count] = replace(lanes[count], widths=narrowing, road_marks=EDGE)
        right = tuple(
            replace(
                lane,
                predecessors=() if s == 0.0 else _before(lane, count, last),
                successors=() if last else _after(lane, count, s == merge),
            )
            for lane in lanes
        )
        found.append(LaneSection(s, center=(centre((), after.outbound),), right=right))
    return tuple(found)


def _after(lane: Lane, count: int, narrows: bool) -> tuple[int, ...]:
    """Return the lane of the next section: the acceleration lane ends with the taper."""
    if not narrows or -lane.id <= count:
        return (lane.id,)
    return () if -lane.id == count + 1 else (lane.id + 1,)


def _before(lane: Lane, count: int, last: bool) -> tuple[int, ...]:
    """Return the lane of the section before: beyond the taper, strips lie one lane farther in."""
    if not last or -lane.id <= count:
        return (lane.id,)
    return (lane.id - 1,)
