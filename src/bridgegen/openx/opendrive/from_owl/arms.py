"""The legs of a road network that is to be built: lanes, strips, what stands on them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal

from bridgegen.openx.opendrive.from_owl.turns import Ray, along
from bridgegen.openx.opendrive.furniture import Object, Signal
from bridgegen.openx.opendrive.model import (
    Lane,
    LaneSection,
    Road,
    RoadLink,
    RoadMark,
    RoadType,
    Speed,
    Width,
)
from bridgegen.openx.opendrive.plan_view import Cubic, Geometry
from bridgegen.openx.opendrive.user_data import UserData, user_datum

_QUARTERS = {0: (1.0, 0.0), 90: (0.0, 1.0), 180: (-1.0, 0.0), 270: (0.0, -1.0)}

LEVEL = (Cubic(0.0, 0.0, 0.0, 0.0, 0.0),)
LINE_WIDTH = 0.12
NONE = (RoadMark(0.0, "none", "standard", lane_change="none"),)
MIDDLE = (RoadMark(0.0, "solid", "yellow", width=LINE_WIDTH, lane_change="none"),)
BETWEEN = (RoadMark(0.0, "broken", "standard", width=LINE_WIDTH, lane_change="both"),)
EDGE = (RoadMark(0.0, "solid", "standard", width=LINE_WIDTH, lane_change="none"),)

Strips = tuple[tuple[str, float], ...]
"""Type and width [m] of what lies outside the driving lanes, inside to outside."""


@dataclass(frozen=True, slots=True)
class Arm:
    """A leg to be built.

    Attributes:
        name: for messages and the road's name.
        road_id: OpenDRIVE's id.
        heading_deg: outwards, counter-clockwise from +x.
        length: [m].
        junction_end: the end of the reference line that touches the junction.
        speed_limit: [m/s], None for none.
        inbound: widths [m] of the lanes to the junction, innermost first.
        outbound: widths [m] of the lanes away from it, innermost first.
        strips_in: beside the lanes to the junction.
        strips_out: beside the lanes away from it.
        turns: where each inbound lane leads, innermost first; empty: by rule.
        road_type: OpenDRIVE's.
        grade: its rise along the reference line, by its length.
        objects: what lies on it.
        signals: what stands beside it.
        user_data: its further values.
    """

    name: str
    road_id: str
    heading_deg: float
    length: float
    junction_end: Literal["start", "end", "none"]
    speed_limit: float | None
    inbound: tuple[float, ...]
    outbound: tuple[float, ...]
    strips_in: Strips = ()
    strips_out: Strips = ()
    turns: tuple[frozenset[str], ...] = ()
    road_type: str = "town"
    grade: float = 0.0
    objects: tuple[Object, ...] = field(default=())
    signals: tuple[Signal, ...] = field(default=())
    user_data: tuple[UserData, ...] = ()

    def lane_id(self, index: int, *, inbound: bool) -> int:
        """Return the id of the ``index``-th lane from the centre line."""
        left = inbound == (self.junction_end != "end")
        return index + 1 if left else -index - 1

    def offset(self, index: int, *, inbound: bool) -> float:
        """Return how far a lane's centre is beside the centre line [m]."""
        widths = self.inbound if inbound else self.outbound
        return sum(widths[:index]) + 0.5 * widths[index]

    def ray(self, size: float, index: int, *, inbound: bool) -> Ray:
        """Return where a lane's centre meets the junction, and its direction of travel there."""
        widths = self.inbound if inbound else self.outbound
        t = sum(widths[:index]) + 0.5 * widths[index]
        t = t if inbound else -t
        dx, dy = outward(self.heading_deg)
        heading = wrapped(self.heading_deg + (180.0 if inbound else 0.0))
        return Ray(0.5 * size * dx - t * dy, 0.5 * size * dy + t * dx, heading)

    def sides(self) -> tuple[tuple[float, ...], Strips, tuple[float, ...], Strips]:
        """Return lanes and strips left of the reference line, then those right of it."""
        if self.junction_end == "end":
            return self.outbound, self.strips_out, self.inbound, self.strips_in
        return self.inbound, self.strips_in, self.outbound, self.strips_out


def outward(degrees: float) -> tuple[float, float]:
    """Return the unit vector of a heading, exact for right angles."""
    exact = _QUARTERS.get(int(degrees) % 360) if degrees == int(degrees) else None
    return exact or (math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))


def wrapped(degrees: float) -> float:
    """Return a heading in radians, in (-π, π]."""
    turn = math.remainder(degrees, 360.0)
    return math.radians(180.0 if turn == -180.0 else turn)


def arm_road(arm: Arm, near: float, junction_id: str) -> Road:
    """Return the straight road of a leg that meets a junction.

    Args:
        arm: the leg.
        near: where it begins, from the junction's centre [m].
        junction_id: the junction.
    """
    dx, dy = outward(arm.heading_deg)
    starts = arm.junction_end == "start"
    far = near if starts else near + arm.length
    hdg = wrapped(arm.heading_deg + (0.0 if starts else 180.0))
    line = (along(0.0, far * dx, far * dy, hdg, arm.length, 0.0),)
    return road_of(arm, line, junction_id)


def road_of(
    arm: Arm,
    plan_view: tuple[Geometry, ...],
    junction_id: str | None,
    sections: tuple[LaneSection, ...] | None = None,
) -> Road:
    """Return a leg as a road with the given reference line.

    Args:
        arm: the leg.
        plan_view: its reference line.
        junction_id: what it meets at its junction's end, if anything.
        sections: its lanes, where they change along it.
    """
    link = None if junction_id is None else RoadLink("junction", junction_id)
    return Road(
        id=arm.road_id,
        length=arm.length,
        name=arm.name,
        predecessor=link if arm.junction_end == "start" else None,
        successor=link if arm.junction_end == "end" else None,
        types=types_of(arm.speed_limit, arm.road_type),
        plan_view=plan_view,
        elevations=(Cubic(0.0, 0.0, arm.grade, 0.0, 0.0),) if arm.grade else LEVEL,
        lane_offsets=LEVEL,
        sections=sections or _with_turns(arm, arm_sections(*arm.sides())),
        objects=arm.objects,
        signals=arm.signals,
        user_data=arm.user_data,
    )


def _with_turns(arm: Arm, sections: tuple[LaneSection, ...]) -> tuple[LaneSection, ...]:
    """Return the section of a leg whose inbound lanes state their allowed turns."""
    if not any(arm.turns):
        return sections
    (section,) = sections
    left = arm.lane_id(0, inbound=True) > 0
    lanes = tuple(
        replace(lane, user_data=tuple(user_datum("allows_turn", one) for one in sorted(turns)))
        for lane in (section.left if left else section.right)
        for turns in (arm.turns[abs(lane.id) - 1] if abs(lane.id) <= len(arm.turns) else (),)
    )
    return (replace(section, left=lanes) if left else replace(section, right=lanes),)


@lru_cache(maxsize=64)
def types_of(speed_limit: float | None, road_type: str = "town") -> tuple[RoadType, ...]:
    """Return a road's type with its speed limit [m/s]."""
    if speed_limit is None:
        return (RoadType(0.0, road_type),)
    return (RoadType(0.0, road_type, speed=Speed(speed_limit, "m/s")),)


@lru_cache(maxsize=64)
def arm_sections(
    left: tuple[float, ...],
    left_strips: Strips,
    right: tuple[float, ...],
    right_strips: Strips,
) -> tuple[LaneSection, ...]:
    """Return the one section of a road whose lanes do not change."""
    return (
        LaneSection(
            0.0,
            left=tuple(reversed(list(lanes_of(1, left, left_strips)))),
            center=(centre(left, right),),
            right=tuple(lanes_of(-1, right, right_strips)),
        ),
    )


def centre(left: tuple[float, ...], right: tuple[float, ...]) -> Lane:
    """Return the centre lane: yellow between two directions, a white edge beside one."""
    return Lane(0, "none", road_marks=MIDDLE if left and right else EDGE)


def lanes_of(side: int, widths: tuple[float, ...], strips: Strips) -> Iterator[Lane]:
    """Yield the lanes and strips of one side of a road, inside to outside."""
    for index, width in enumerate(widths):
        mark = EDGE if index == len(widths) - 1 else BETWEEN
        record = (Width(0.0, width, 0.0, 0.0, 0.0),)
        yield Lane(side * (index + 1), "driving", widths=record, road_marks=mark)
    for index, (kind, width) in enumerate(strips, start=len(widths)):
        record = (Width(0.0, width, 0.0, 0.0, 0.0),)
        yield Lane(side * (index + 1), kind, widths=record, road_marks=NONE)
