"""Where the lanes of a road lie: cubics along s, lane offsets and widths added up.

t is the distance from the reference line, positive to the left.
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.geometry import geometry_index, pose, reference_line
from bridgegen.openx.opendrive.model import Lane, LaneSection, Road
from bridgegen.openx.opendrive.plan_view import Cubic

Coefficients = tuple[float, float, float, float]
ZERO: Coefficients = (0.0, 0.0, 0.0, 0.0)

SLACK = 1e-6
"""Largest distance of a place beyond its road's end [m]: the rounding of a file."""


class LanePose(NamedTuple):
    """Where a lane's centre is at one s; ``h`` [rad] is the direction of travel."""

    x: float
    y: float
    h: float
    width: float


def rebased(records: Sequence[Cubic], s: float, inside: float) -> Coefficients:
    """Return the cubic that holds at ``inside``, as coefficients over the distance from ``s``."""
    held: Cubic | None = None
    for record in records:
        if record.s > inside:
            break
        held = record
    if held is None:
        return ZERO
    return shifted((held.a, held.b, held.c, held.d), s - held.s)


def shifted(cubic: Coefficients, by: float) -> Coefficients:
    """Return a cubic over the distance from ``by`` instead of from 0."""
    a, b, c, d = cubic
    # The very numbers of the file where nothing changes, so that a constant width is not rounded.
    if b == c == d == 0.0 or by == 0.0:
        return cubic
    return (
        a + by * (b + by * (c + by * d)),
        b + by * (2.0 * c + by * 3.0 * d),
        c + 3.0 * by * d,
        d,
    )


def section_index(road: Road, s: float) -> int:
    """Return which lane section of a road holds at ``s`` [m]."""
    index = 0
    for index, section in enumerate(road.sections):
        if section.s > s:
            return max(index - 1, 0)
    return index


def section_end(road: Road, index: int) -> float:
    """Return where a lane section ends [m along the road]."""
    return road.sections[index + 1].s if index + 1 < len(road.sections) else road.length


def inner_lanes(section: LaneSection, lane_id: int) -> list[Lane]:
    """Return the lanes between the centre and a lane, that lane left out."""
    side = section.left if lane_id > 0 else section.right
    return [lane for lane in side if abs(lane.id) < abs(lane_id)]


def lane_at(road: Road, lane_id: int, s: float) -> Lane:
    """Return a lane of a road at ``s`` [m].

    Raises:
        InputError: the road is shorter, or has no such lane there.
    """
    _check_station(road, s)
    section = road.sections[section_index(road, s)]
    lane = section.lane(lane_id)
    if lane is None:
        known = ", ".join(str(lane.id) for lane in section.lanes)
        raise InputError(f"road {road.id} has lanes {known} at s={s:g} m, got lane {lane_id}")
    return lane


def lane_along(road: Road, lane_id: int, s: float, way: int) -> int:
    """Return the lane of a position on a route, at ``s`` [m].

    Where the route runs against the reference line, files state either the road's lane id, or one
    that counts from the route: -1 is then the first to its right. The lane is the one of both that
    leads along the route.

    Args:
        road: the road.
        lane_id: as the file states it.
        s: along the road [m].
        way: of the route there: 1 along the reference line, or -1.

    Raises:
        InputError: the road is shorter, or has no such lane there.
    """
    _check_station(road, s)
    section = road.sections[section_index(road, s)]
    # esmini's files state the road's lane, Vector's Euro NCAP files count from the route. Read as
    # the road's, the parked cars of CBNA stood behind the bicyclist whom they are to hide.
    if way < 0 < road.direction(lane_id) and section.lane(-lane_id) is not None:
        return -lane_id
    return lane_at(road, lane_id, s).id


def _check_station(road: Road, s: float) -> None:
    if not -SLACK <= s <= road.length + SLACK:
        raise InputError(
            f"0 <= s [m] <= {road.length:.9g} must hold on road {road.id}, got s={s:.9g}"
        )


def width_of(section: LaneSection, lane: Lane, s: float, inside: float) -> Coefficients:
    """Return a lane's width [m] around ``inside``, over the distance from ``s``."""
    return rebased(lane.widths, s - section.s, inside - section.s)


def centre_of(
    road: Road, section: LaneSection, lane: Lane, s: float, inside: float
) -> Coefficients:
    """Return the t [m] of a lane's centre around ``inside``, over the distance from ``s``.

    ``inside`` lies between two `breaks`, away from both by more than rounding.
    """
    side = 1.0 if lane.id > 0 else -1.0
    a, b, c, d = rebased(road.lane_offsets, s, inside)
    parts = [(side, item) for item in inner_lanes(section, lane.id)]
    for share, part in (*parts, (0.5 * side, lane)):
        wa, wb, wc, wd = width_of(section, part, s, inside)
        a, b, c, d = a + share * wa, b + share * wb, c + share * wc, d + share * wd
    return a, b, c, d


def breaks(road: Road, section: LaneSection, lane: Lane) -> Iterable[float]:
    """Yield every s [m] at which the formula of a lane's centre may change."""
    yield from (geometry.s for geometry in road.plan_view)
    yield from (offset.s for offset in road.lane_offsets)
    for each in (lane, *inner_lanes(section, lane.id)):
        yield from (section.s + width.s for width in each.widths)


def lane_pose(road: Road, lane_id: int, s: float) -> LanePose:
    """Return the centre of a lane at ``s`` [m] of its road; lane 0 is the line between both sides.

    Raises:
        InputError: the road is shorter, or has no such lane there.
    """
    section, width = road.sections[section_index(road, s)], 0.0
    if lane_id == 0:
        _check_station(road, s)
        t, slope = rebased(road.lane_offsets, s, s)[:2]
    else:
        lane = lane_at(road, lane_id, s)
        t, slope = centre_of(road, section, lane, s, s)[:2]
        width = width_of(section, lane, s, s)[0]
    geometry = road.plan_view[geometry_index(road, s)]
    x, y, h, curvature = pose(geometry, s - geometry.s)
    # In a taper, or beside a changing lane offset, a lane does not run parallel to the reference
    # line.
    tilt = elementary.atan2(slope, 1.0 - curvature * t)
    turned = 0.0 if lane_id == 0 or road.direction(lane_id) > 0 else math.pi
    return LanePose(
        x - t * elementary.sin(h),
        y + t * elementary.cos(h),
        h + tilt + turned,
        width,
    )


def values(records: Sequence[Cubic], s: Float) -> Float:
    """Return the values of a list of cubics at many s; 0 before the first; ``(P,)`` float64."""
    if not records:
        return np.zeros_like(s)
    table = np.array([(record.s, record.a, record.b, record.c, record.d) for record in records])
    which = np.searchsorted(table[:, 0], s, side="right") - 1
    start, a, b, c, d = table[np.maximum(which, 0)].T
    ds = s - start
    found = a + ds * (b + ds * (c + ds * d))
    return np.where(which < 0, 0.0, found)


def borders(road: Road, index: int, s: Float) -> dict[int, Float]:
    """Return the t [m] of the outer border of every lane of a section, and of 0, the centre.

    Args:
        road: the road.
        index: of its lane section.
        s: ``(P,)`` float64 [m along the road], within the section.
    """
    section = road.sections[index]
    # At the section's very end its own records hold, not those that begin there.
    s = np.minimum(s, np.nextafter(section_end(road, index), 0.0))
    offset = values(road.lane_offsets, s)
    found = {0: offset}
    for side, lanes in ((1.0, section.left), (-1.0, section.right)):
        t = offset
        for lane in sorted(lanes, key=lambda item: abs(item.id)):
            t = t + side * values(lane.widths, s - section.s)
            found[lane.id] = t
    return found


def points(road: Road, s: Float, t: Float) -> Float:
    """Return road coordinates as points in the plane; ``(P, 2)`` float64 [m]."""
    line = reference_line(road, s)
    return np.stack(
        (line.x - t * elementary.sin(line.h), line.y + t * elementary.cos(line.h)), axis=1
    )
