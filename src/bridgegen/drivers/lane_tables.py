"""The road along the ego's route as tables: for drivers that want "lanes", and its corridor."""

from collections.abc import Iterator

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.right_of_way import inner
from bridgegen.drivers.scene import NARROW, lane_of, speed_limits
from bridgegen.openx.opendrive.geometry import reference_line
from bridgegen.openx.opendrive.lane_changes import (
    allows_change,
    between,
    marked_stretches,
    marking,
    neighbour,
)
from bridgegen.openx.opendrive.lanes import borders, section_end, section_index
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.routes import Route

LIMIT, WIDTH, JUNCTION, BESIDE = range(4)
OFFSET, BESIDE_WIDTH, DIRECTION, MAY_CHANGE = range(4)
LANE = BESIDE + 2 * 4
"""Number of columns of the lane table, with those of what is beside, left and then right."""

PLACE, HEADING, LANES, EDGES, TOWN = slice(0, 2), 2, slice(3, 5), slice(5, 7), 7
CORRIDOR = 8
"""Number of columns of a corridor; see `corridor_along`."""

STRAYS = 0.2
"""Distance beside its route up to which a body is in its lane, of whatever width [m]. Ours."""

PAVED = frozenset(("shoulder", "stop", "parking", "biking"))
"""Types of lanes beside the driving lanes on which a car has left its lane, but not the road."""


def lanes_along(model: OpenDrive, route: Route | None, path: Float, step: float) -> Float:
    """Return what `Lanes` holds, at every sample of the ego's path.

    Args:
        model: the road network.
        route: the lanes along which the path leads; None off the lanes.
        path: ``(L, ≥2)``: x, y [m].
        step: between two samples [m].

    Returns:
        ``(L, LANE)``.
    """
    found = np.zeros((len(path), LANE))
    found[:, LIMIT] = np.inf
    if route is None:
        return found
    for at, road, number, lane_id, s in _places(model, route, len(path), step):
        found[at] = _along(road, number, lane_id, s, path[at, :2])
    return found


def corridor_along(model: OpenDrive, route: Route, path: Float, step: float, fast: float) -> Float:
    """Return the room beside a route, at every sample of it.

    Args:
        model: the road network.
        route: the lanes along which the path leads.
        path: ``(L, ≥3)``: x, y [m], heading [rad].
        step: between two samples [m].
        fast: [m/s], the speed limit above which a road is not in town.

    Returns:
        ``(L, CORRIDOR)``: x, y, heading; how far from there to the left and to the right [m] the
        lanes reach that go the same way; and the road, up to the edges of what is paved, +inf where
        that is unknown, as within a junction; 1 in town.
    """
    found = np.full((len(path), CORRIDOR), np.inf)
    found[:, :3] = path[:, :3]
    beside = np.full((len(path), 2), -np.inf)
    for at, road, number, lane_id, s in _places(model, route, len(path), step):
        t, way = borders(road, number, s), road.direction(lane_id)
        own = _across(road, s, path[at, :2])
        for i, towards in enumerate((way, -way)):
            lane, last = _reach(road, number, lane_id, towards)
            found[at, LANES.start + i] = towards * (_border(t, lane, towards) - own)
            aside = np.abs(own - 0.5 * (t[lane_id] + t[inner(lane_id)])) > STRAYS
            beside[at, i] = np.where(aside, 0.5 * np.abs(t[lane_id] - t[inner(lane_id)]), -np.inf)
            if not road.is_connecting:
                found[at, EDGES.start + i] = towards * (_border(t, last, towards) - own)
        found[at, TOWN] = speed_limits(road, number, lane_id, s) <= fast
    if (found[:, LANES] < 0.0).any():
        # A route that leads over the lane of oncoming traffic, to pass something, is no departure.
        found[:, LANES] = np.maximum(found[:, LANES], beside)
    return found


def _places(
    model: OpenDrive, route: Route, count: int, step: float
) -> Iterator[tuple[Int, Road, int, int, Float]]:
    """Yield which samples of a route lie on a section: road, section, lane, s [m] of each."""
    stations = np.arange(count) * step
    starts = np.array([piece.station for piece in route.pieces])
    which = np.maximum(np.searchsorted(starts, stations, side="right") - 1, 0)
    for index, piece in enumerate(route.pieces):
        at = np.flatnonzero(which == index)
        if not len(at):
            continue
        road = model.road(piece.road_id)
        number = section_index(road, 0.5 * (piece.s + piece.s_end))
        low, high = road.sections[number].s, section_end(road, number)
        s = np.clip(piece.s + piece.rate * (stations[at] - piece.station), low, high)
        yield at, road, number, lane_of(route.steps, piece.road_id, piece.s, piece.s_end), s


def _reach(road: Road, number: int, lane_id: int, towards: int) -> tuple[int, int]:
    """Return the last lane beside one that goes the same way, and the last that is paved.

    ``towards``: 1 along t, to the left of the reference line; -1 against it.
    """
    section, way = road.sections[number], road.direction(lane_id)
    same = last = lane_id
    while True:
        other = last + towards or towards
        lane = section.lane(other)
        if lane is None or not (lane.drivable or lane.type in PAVED):
            return same, last
        if same == last and lane.drivable and road.direction(other) == way:
            same = other
        last = other


def _border(t: dict[int, Float], lane_id: int, towards: int) -> Float:
    """Return the t [m] of the border of a lane towards one side."""
    return t[lane_id if lane_id * towards > 0 else inner(lane_id)]


def _across(road: Road, s: Float, points: Float) -> Float:
    """Return the t [m] of points at places s of a road."""
    line = reference_line(road, s)
    return (points[:, 1] - line.y) * elementary.cos(line.h) - (
        points[:, 0] - line.x
    ) * elementary.sin(line.h)


def _along(road: Road, number: int, lane_id: int, s: Float, points: Float) -> Float:
    """Return the rows of the table on one section of a road."""
    found = np.zeros((len(s), LANE))
    section, way, t = road.sections[number], road.direction(lane_id), borders(road, number, s)
    own = _across(road, s, points)
    found[:, LIMIT] = speed_limits(road, number, lane_id, s)
    found[:, WIDTH] = np.abs(t[lane_id] - t[inner(lane_id)])
    found[:, JUNCTION] = road.is_connecting
    for i, side in enumerate((1, -1)):
        other = neighbour(road, lane_id, side)
        lane = section.lane(other)
        if lane is None or not lane.drivable:
            continue
        width = np.abs(t[other] - t[inner(other)])
        columns = found[:, BESIDE + 4 * i : BESIDE + 4 * i + 4]
        columns[:, OFFSET] = way * (0.5 * (t[other] + t[inner(other)]) - own)
        columns[:, BESIDE_WIDTH] = width
        columns[:, DIRECTION] = way * road.direction(other)
        columns[:, MAY_CHANGE] = _allowed(road, number, lane_id, other, s)
        columns[width < NARROW] = 0.0
    return found


def _allowed(road: Road, number: int, lane_id: int, other: int, s: Float) -> Float:
    """Return 1 where the marking allows to change from a lane to the one beside it, else 0."""
    found = np.zeros(len(s))
    section, border = road.sections[number], between(lane_id, other)
    for low, high in marked_stretches(road, number):
        mark = marking(section, border, low - section.s)
        found[(s >= low) & (s <= high)] = allows_change(mark, border, lane_id, other)
    return found
