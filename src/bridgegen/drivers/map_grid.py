"""A road map as the simulator looks at it: its pieces as rows of numbers, found by a grid."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.compiled import PIECE
from bridgegen.drivers.interface import CENTRE, PIECE_POINTS, RoadMap

CELL = 30.0
"""Least width of a cell [m]."""

COLUMNS = PIECE.itemsize // 8

LEFT, BOTTOM, WIDTH, ACROSS, UP, REACH = range(6)
GRID = 6
"""Columns of `Grid.box`, and how many there are."""


class Grid(NamedTuple):
    """P road maps; what is missing is padded.

    Attributes:
        pieces: ``(P, K, COLUMNS)`` as `bridgegen.drivers.compiled.PIECE` has them; kind -1: none.
        middles: ``(P, K, 2)`` [m], the middles of the boxes around them.
        box: ``(P, GRID)``: the grid's corner [m], the width of a cell [m], how many cells there are
            in x and in y, and how far any point of a piece, or of its lane, is from its middle [m].
        starts: ``(P, C + 1)`` int64, where each cell's pieces begin in `order`.
        order: ``(P, K)`` int64, the pieces by the cells of their middles.
    """

    pieces: Float
    middles: Float
    box: Float
    starts: Int
    order: Int


def no_grid(n: int) -> Grid:
    """Return n maps without pieces."""
    return Grid(
        np.empty((n, 0, COLUMNS)),
        np.empty((n, 0, 2)),
        np.empty((n, 0)),
        np.empty((n, 0), dtype=np.int64),
        np.empty((n, 0), dtype=np.int64),
    )


def grid_of(maps: Sequence[RoadMap]) -> Grid:
    """Return maps as one grid each."""
    grids = [_grid(map_) for map_ in maps]
    k = max(len(grid.pieces[0]) for grid in grids)
    c = max(grid.starts.shape[1] for grid in grids)
    found = Grid(
        np.zeros((len(maps), k, COLUMNS)),
        np.full((len(maps), k, 2), np.inf),
        np.concatenate([grid.box for grid in grids]),
        np.zeros((len(maps), c), dtype=np.int64),
        np.zeros((len(maps), k), dtype=np.int64),
    )
    found.pieces[:, :, 3 * PIECE_POINTS + PIECE_POINTS + 1] = -1.0
    for p, grid in enumerate(grids):
        for whole, part in zip(found, grid, strict=True):
            if whole is not found.box:
                whole[p, : part.shape[1]] = part[0]
    return found


def _grid(roads: RoadMap) -> Grid:
    n = len(roads.pieces)
    rows = np.zeros((n, 1), dtype=PIECE)
    rows["points"][:, 0] = roads.pieces
    names = ("count", "kind", "lane", "light", "marking")
    columns = (
        roads.piece_points,
        roads.piece_kind,
        roads.piece_lane,
        roads.piece_light,
        roads.piece_marking,
    )
    for name, column in zip(names, columns, strict=True):
        rows[name][:, 0] = column
    rows["speed_limit"] = np.inf
    _add_lanes(roads, rows)
    points = roads.pieces[:, :, :2]
    # Near is by the middle of a piece's box, as learned planners cull their maps.
    middles = 0.5 * (points.min(axis=1) + points.max(axis=1)) if n else np.zeros((0, 2))
    offset = points - middles[:, None]
    away = elementary.hypot(offset[..., 0], offset[..., 1])
    reach = float((away + rows["width"][:, 0]).max(initial=0.0))
    low = middles.min(axis=0, initial=0.0) if n == 0 else middles.min(axis=0)
    span = middles.max(axis=0) - low if n else np.zeros(2)
    # Cells grow with the map where there are few pieces: else a long road would be mostly empty
    # cells.
    width = max(CELL, math.sqrt(float(np.prod(span)) / (4 * n + 16)), float(span.max()) / (n + 16))
    cells = np.floor(span / width).astype(np.int64) + 1
    at = np.floor((middles - low) / width).astype(np.int64)
    cell = at[:, 1] * cells[0] + at[:, 0]
    order = np.argsort(cell, kind="stable")
    starts = np.searchsorted(cell[order], np.arange(int(np.prod(cells)) + 1))
    box = np.array([[*low, width, *cells, reach]])
    numbers = rows.view(np.float64).reshape(n, COLUMNS)
    return Grid(numbers[None], middles[None], box, starts[None], order[None])


def _add_lanes(roads: RoadMap, rows: np.ndarray) -> None:
    """Fill what pieces take from their lanes: widths, limits, and whether the route uses them."""
    owned = np.flatnonzero(roads.piece_lane >= 0)
    lane_of = roads.piece_lane[owned]
    route = set(roads.route)
    on_route = np.array([lane.id in route for lane in roads.lanes], dtype=np.float64)
    rows["on_route"][owned, 0] = on_route[lane_of] if len(owned) else 0.0
    order = np.argsort(lane_of, kind="stable")
    begins = np.searchsorted(lane_of[order], np.arange(len(roads.lanes) + 1))
    for number, lane in enumerate(roads.lanes):
        mine = owned[order[begins[number] : begins[number + 1]]]
        rows["speed_limit"][mine, 0] = lane.speed_limit[0]
        across = lane.left - lane.right
        width = elementary.hypot(across[:, 0], across[:, 1])
        at = 0
        for piece in mine:
            count = int(roads.piece_points[piece])
            if roads.piece_kind[piece] == CENTRE:
                rows["width"][piece, 0, :count] = width[at : at + count]
                rows["width"][piece, 0, count:] = width[at + count - 1]
                at += count - 1
