"""The legs of a road network that is to be built, and smooth curves between them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Literal, NamedTuple

from bridgegen.base import elementary
from bridgegen.base.errors import OntologyError
from bridgegen.openx.opendrive.furniture import Object, Signal
from bridgegen.openx.opendrive.geometry import along_arc
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
from bridgegen.openx.opendrive.plan_view import Arc, Cubic, Geometry, Line
from bridgegen.openx.opendrive.user_data import UserData, user_datum

# --- Smooth curves from one ray to another: a line, line–arc–line, or two arcs ---
# Source of the two arcs: Bolton (1975), "Biarc curves", Computer-Aided Design 7(2), here with
# equal tangent lengths at both ends.


LEAST_RADIUS = 2.0
"""Tightest curve that is built [m]; below it even a small car must reverse."""

_SHORTEST = 1e-4
"""Length below which lines are left out [m]."""
_STRAIGHT = 1e-9
_ASIDE = 1e-3
"""Lateral offset below which a path is straight [m]: it would be an arc of so large a radius that
CARLA, which computes in single precision, would put it up to 0.4 m aside."""
_ALMOST_PARALLEL = math.radians(1.0)
_LINE = Line()


class Ray(NamedTuple):
    """A point [m] and a heading [rad]."""

    x: float
    y: float
    h: float


def joining(start: Ray, end: Ray, what: str) -> tuple[Geometry, ...]:
    """Return the reference line that leaves along ``start`` and arrives along ``end``.

    Args:
        start: where and in which direction it begins.
        end: where and in which direction it ends.
        what: for the message.

    Raises:
        OntologyError: no such curve is wide enough for a car.
    """
    dx, dy = end.x - start.x, end.y - start.y
    cos, sin = elementary.cos(start.h), elementary.sin(start.h)
    ahead, aside = dx * cos + dy * sin, dy * cos - dx * sin
    turn = math.remainder(end.h - start.h, math.tau)
    bends = _bends(ahead, aside, turn)
    tightest = max(abs(curvature) for curvature, _ in bends)
    if tightest * LEAST_RADIUS > 1.0 or ahead <= 0.0:
        radius = f"a radius of {1.0 / tightest:.3g} m" if tightest else "none"
        raise OntologyError(
            f"{what} must have a radius ≥ {LEAST_RADIUS:g} m, got {radius}: "
            "has_size of the intersection [m] is too small for its legs"
        )
    found: list[Geometry] = []
    s, (x, y, h) = 0.0, start
    for curvature, length in bends:
        found.append(along(s, x, y, h, length, curvature))
        x, y, h = along_arc(x, y, h, curvature, length)
        s += length
    return tuple(found)


def along(s: float, x: float, y: float, h: float, length: float, curvature: float) -> Geometry:
    """Return a geometry: an arc, or a line where there is no curvature."""
    return Geometry(s, x, y, h, length, Arc(curvature) if curvature else _LINE)


def _bends(ahead: float, aside: float, turn: float) -> list[tuple[float, float]]:
    """Return (curvature [1/m], length [m]) of each part, in the frame of the start."""
    if abs(turn) < _STRAIGHT and abs(aside) < max(_STRAIGHT * max(1.0, abs(ahead)), _ASIDE):
        return [(0.0, ahead)]
    if abs(turn) > _ALMOST_PARALLEL:
        # Both rays run through one corner, `before` ahead of the start, `after` behind the end.
        after = aside / elementary.sin(turn)
        before = ahead - after * elementary.cos(turn)
        tangent = min(before, after)
        if tangent > 0.0:
            radius = tangent / elementary.tan(0.5 * abs(turn))
            arc = (math.copysign(1.0 / radius, turn), radius * abs(turn))
            parts = [(0.0, before - tangent), arc, (0.0, after - tangent)]
            if radius >= LEAST_RADIUS:  # else the corner is next to one end of a slight bend
                return [part for part in parts if part[1] > _SHORTEST]
    return _two_arcs(ahead, aside, turn)


def _two_arcs(ahead: float, aside: float, turn: float) -> list[tuple[float, float]]:
    cos, sin = elementary.cos(turn), elementary.sin(turn)
    square = ahead * ahead + aside * aside
    along_both = ahead * (1.0 + cos) + aside * sin
    bend = 2.0 * (1.0 - cos)
    # The tangent length d solves bend·d² + 2·along_both·d = square; written so that bend may be 0.
    d = square / (along_both + math.sqrt(along_both * along_both + bend * square))
    joint = 0.5 * (ahead + d * (1.0 - cos)), 0.5 * (aside - d * sin)
    first = _arc_to(*joint)
    x, y = ahead - joint[0], aside - joint[1]
    heading = first[0] * first[1]
    cos, sin = elementary.cos(heading), elementary.sin(heading)
    return [first, _arc_to(x * cos + y * sin, y * cos - x * sin)]


def _arc_to(ahead: float, aside: float) -> tuple[float, float]:
    """Return the curvature and length of the arc that starts straight ahead and ends there."""
    chord = elementary.hypot(ahead, aside)
    half = elementary.atan2(aside, ahead)
    if abs(half) < _STRAIGHT:
        return 0.0, chord
    return 2.0 * elementary.sin(half) / chord, chord * half / elementary.sin(half)


# cos(90°) is 6e-17 in doubles; a crossroads' coordinates are to be round numbers.
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
        change: from where on it is different [m], its type and its markings there; "": as before.
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
    change: tuple[float, str, str] | None = None
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
    return exact or (elementary.cos(math.radians(degrees)), elementary.sin(math.radians(degrees)))


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
    road = Road(
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
    return road if arm.change is None else _changing(road, *arm.change)


def _changing(road: Road, at: float, kind: str, marking: str) -> Road:
    """Return a road that has another type or other markings from ``at`` [m] on; "": as before."""
    if kind:
        road = replace(road, types=(*road.types, replace(road.types[0], s=at, type=kind)))
    if marking:
        more = (RoadMark(at, marking),)
        sides: dict[str, Any] = {
            side: tuple(
                lane
                if lane.road_marks == NONE
                else replace(lane, road_marks=lane.road_marks + more)
                for lane in getattr(road.sections[0], side)
            )
            for side in ("left", "center", "right")
        }
        road = replace(road, sections=(replace(road.sections[0], **sides),))
    return road


def _with_turns(arm: Arm, sections: tuple[LaneSection, ...]) -> tuple[LaneSection, ...]:
    """Return the section of a leg whose inbound lanes state their allowed turns."""
    if not any(arm.turns):
        return sections
    (section,) = sections
    left = arm.lane_id(0, inbound=True) > 0
    lanes = tuple(
        replace(lane, user_data=tuple(user_datum("allows_turn", turn) for turn in sorted(turns)))
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
