"""The road along the ego's route as tables, for drivers that want "lanes"."""

import numpy as np

from bridgegen.arrays import Float
from bridgegen.ego.right_of_way import inner
from bridgegen.ego.scene import NARROW, lane_of, speed_limits
from bridgegen.openx.opendrive.geometry import reference_line
from bridgegen.openx.opendrive.lanes import borders, section_end, section_index
from bridgegen.openx.opendrive.markings import (
    allows_change,
    between,
    marked_stretches,
    marking,
    neighbour,
)
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.routes import Route

LIMIT, WIDTH, JUNCTION, BESIDE = range(4)
OFFSET, BESIDE_WIDTH, DIRECTION, MAY_CHANGE = range(4)
LANE = BESIDE + 2 * 4
"""Columns of the table; of what is beside, left and then right; and how many there are."""


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
    stations = np.arange(len(path)) * step
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
        lane_id = lane_of(route.steps, piece.road_id, piece.s, piece.s_end)
        found[at] = _along(road, number, lane_id, s, path[at, :2])
    return found


def _along(road: Road, number: int, lane_id: int, s: Float, points: Float) -> Float:
    """Return the rows of the table on one section of a road."""
    found = np.zeros((len(s), LANE))
    section, way, t = road.sections[number], road.direction(lane_id), borders(road, number, s)
    line = reference_line(road, s)
    own = (points[:, 1] - line.y) * np.cos(line.h) - (points[:, 0] - line.x) * np.sin(line.h)
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
