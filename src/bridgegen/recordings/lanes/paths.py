"""Carriageways in a recording's paths: which parts of the paths run together, and along what line.

Paths are cut into pieces of equal length. Pieces that are near each other and run in about the same
direction are of one carriageway, but for crossings: where paths cross at an angle, or curve
sharply, there are none.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.drivers.kinds import BUS, CAR, TRUCK
from bridgegen.recordings.lanes.model import STEP, along, headings_along
from bridgegen.recordings.readers.table import RecordedTraffic, wrap

PIECE = 5.0
"""Length of the pieces of paths, and distance between two points of a reference line [m]."""
CELL = PIECE
SECTORS = 24
CROSSING = math.radians(40.0)
"""Angle from which on paths within 8 m cross, up to its supplement [rad]."""
REACH = 20.0
"""Lateral distance from a reference line within which points are located along it [m]."""
MOST_PIECES = 200_000
LEAST_VEHICLES = 10


@dataclass(frozen=True, eq=False)
class Pieces:
    """Points on paths, `PIECE` apart at most, in their order; ``(n,)`` each."""

    participant: Int
    x: Float
    y: Float
    heading: Float

    def __len__(self) -> int:
        return len(self.x)

    def take(self, at: Int | Bool) -> "Pieces":
        """Return some of them."""
        return Pieces(self.participant[at], self.x[at], self.y[at], self.heading[at])


def pieces_of(traffic: RecordedTraffic) -> Pieces:
    """Return the pieces of the paths of cars, trucks and buses, of evenly chosen ones if many."""
    vehicles = np.flatnonzero(np.isin(traffic.kind, (CAR, TRUCK, BUS)))
    length = traffic.kilometres * 1000.0 / PIECE
    if length > MOST_PIECES and len(vehicles):
        keep = max(int(len(vehicles) * MOST_PIECES / length), 1)
        vehicles = vehicles[np.unique(np.linspace(0, len(vehicles) - 1, keep).astype(int))]
    found = [np.empty((0, 4))]
    for p in vehicles.tolist():
        states = slice(int(traffic.first[p]), int(traffic.first[p + 1]))
        points = np.column_stack([traffic.x[states], traffic.y[states]])
        station = along(points)
        at = np.linspace(0.0, station[-1], math.ceil(station[-1] / PIECE) + 1)
        if len(at) < 3:
            continue
        keep_at = np.append(True, np.diff(station) > 0.0)
        x, y = (np.interp(at, station[keep_at], points[keep_at, k]) for k in (0, 1))
        heading = headings_along(np.column_stack([x, y]))
        found.append(np.column_stack([np.full(len(at), float(p)), x, y, heading]))
    table = np.concatenate(found)
    return Pieces(table[:, 0].astype(np.int64), *table[:, 1:].T.copy())


def carriageways(pieces: Pieces) -> list[Pieces]:
    """Return the pieces of each carriageway, the one with most first."""
    if not len(pieces):
        return []
    sector = np.floor((pieces.heading + np.pi) / (2 * np.pi) * SECTORS).astype(np.int64) % SECTORS
    where = np.column_stack([np.floor(pieces.x / CELL), np.floor(pieces.y / CELL), sector])
    cells, of = np.unique(where.astype(np.int64), axis=0, return_inverse=True)
    of = of.reshape(-1)
    crossing = _crossings(pieces, cells, of)
    number = {tuple(cell): k for k, cell in enumerate(cells.tolist())}
    pairs = []
    for (x, y, h), k in number.items():
        if crossing[k]:
            continue
        for dx, dy, dh in itertools.product((-1, 0, 1), repeat=3):
            other = number.get((x + dx, y + dy, (h + dh) % SECTORS), -1)
            if other > k and not crossing[other]:
                pairs.append((k, other))
    a, b = np.array(pairs, np.int64).reshape(-1, 2).T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(cells), len(cells)))
    label = connected_components(graph, directed=False)[1][of]
    label[crossing[of]] = -1
    found = [pieces.take(label == item) for item in np.unique(label[label >= 0])]
    found = [item for item in found if len(np.unique(item.participant)) >= LEAST_VEHICLES]
    return sorted(found, key=len, reverse=True)


def _crossings(pieces: Pieces, cells: Int, of: Int) -> Bool:
    """Return the cells around which paths of two vehicles at least cross those of two others."""
    here = np.unique(np.column_stack([of, pieces.participant]), axis=0)[:, 0]
    vehicles = np.bincount(here, minlength=len(cells))
    squares: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for (x, y, h), count in zip(cells.tolist(), vehicles.tolist(), strict=True):
        squares.setdefault((x, y), []).append((h, count))
    crossed: dict[tuple[int, int], bool] = {}
    for x, y in squares:
        near = np.zeros(SECTORS)
        for dx, dy in itertools.product((-1, 0, 1), repeat=2):
            for h, count in squares.get((x + dx, y + dy), ()):
                near[h] += count
        courses = np.flatnonzero(near >= 2) * (2 * np.pi / SECTORS)
        angle = np.abs(wrap(courses[:, None] - courses[None, :]))
        crossed[x, y] = bool(((angle > CROSSING) & (angle < np.pi - CROSSING)).any())
    return np.array([crossed[x, y] for x, y, _ in cells.tolist()], np.bool_)


def reference_line(pieces: Pieces) -> Float | None:
    """Return a line that runs as a carriageway's traffic does; ``(n, 2)`` [m], or None.

    It follows the median direction of the paths around it, and is then moved sideways by what the
    paths' distances from it change on the median, so that it keeps its distance from the lanes.
    """
    tree = cKDTree(np.column_stack([pieces.x, pieces.y]))
    middle = _middle(pieces, tree)
    halves = [_stream(pieces, tree, middle, side) for side in (-1.0, 1.0)]
    line = np.concatenate([halves[0][::-1], middle[None], halves[1]])
    for _ in range(3):
        if len(line) < 4:
            return None
        line = _straightened(pieces, line)
    if len(line) < 4:
        return None
    station = along(line)
    at = np.linspace(0.0, station[-1], math.ceil(station[-1] / STEP) + 1)
    return np.asarray(CubicSpline(station, line)(at))


def _middle(pieces: Pieces, tree: "cKDTree[None]") -> Float:
    """Return the piece with most others around it: where to begin."""
    at = np.linspace(0, len(pieces) - 1, min(len(pieces), 500)).astype(int)
    near = tree.query_ball_point(tree.data[at], REACH, return_length=True)
    best = at[int(np.argmax(near))]
    return np.array([pieces.x[best], pieces.y[best]])


def _stream(pieces: Pieces, tree: "cKDTree[None]", start: Float, side: float) -> Float:
    """Return the points of the line on from a point, along (1) or against (-1) the traffic."""
    found: list[Float] = []
    at, course = start, None
    while len(found) < MOST_PIECES:
        near = np.array(tree.query_ball_point(at, REACH), np.int64)
        if course is not None and len(near):
            ahead = (pieces.x[near] - at[0]) * math.cos(course)
            ahead += (pieces.y[near] - at[1]) * math.sin(course)
            near = near[np.abs(ahead) <= 2 * PIECE]
            if not (side * ahead[np.abs(ahead) <= 2 * PIECE] > 0.0).any():
                break
        if not len(near):
            break
        around = pieces.heading[near[0]] if course is None else course
        course = float(around + np.median(wrap(pieces.heading[near] - around)))
        at = at + side * PIECE * np.array([math.cos(course), math.sin(course)])
        if len(found) > 4 and np.hypot(*(np.array(found[:-4]) - at).T).min() < PIECE / 2:
            break  # a ring
        found.append(at)
    return np.array(found).reshape(-1, 2)


def _straightened(pieces: Pieces, line: Float) -> Float:
    """Return a line moved sideways so that the median path keeps its distance from it."""
    s, t = coordinates(line, np.column_stack([pieces.x, pieces.y]))
    station = along(line)
    same = pieces.participant[1:] == pieces.participant[:-1]
    forward = np.diff(s)
    use = same & np.isfinite(t[1:] + t[:-1]) & (forward > 0.5 * PIECE) & (forward < 2 * PIECE)
    slope, middle = (np.diff(t) / np.where(use, forward, 1.0))[use], 0.5 * (s[1:] + s[:-1])[use]
    cell = np.clip(np.round(middle / PIECE).astype(np.int64), 0, len(line) - 1)
    order = np.argsort(cell, kind="stable")
    bounds = np.searchsorted(cell[order], np.arange(len(line) + 1))
    drift = np.array(
        [
            np.median(slope[order[a:b]]) if b - a >= 3 else np.nan
            for a, b in itertools.pairwise(bounds.tolist())
        ]
    )
    known = np.flatnonzero(np.isfinite(drift))
    if len(known) < 2:
        return line
    drift = np.interp(np.arange(len(line)), known, drift[known])
    move = gaussian_filter1d(
        np.concatenate([[0.0], np.cumsum(0.5 * (drift[1:] + drift[:-1]) * np.diff(station))]),
        1.0,
        mode="nearest",
    )
    h = headings_along(line)
    moved = line + move[:, None] * np.column_stack([-np.sin(h), np.cos(h)])
    return _respaced(moved)


def _respaced(line: Float) -> Float:
    station = along(line)
    at = np.linspace(0.0, station[-1], max(round(station[-1] / PIECE), 1) + 1)
    return np.column_stack([np.interp(at, station, line[:, k]) for k in (0, 1)])


def coordinates(line: Float, points: Float) -> tuple[Float, Float]:
    """Return where points are along and beside a line [m], NaN beyond its ends or `REACH`.

    Between two of the line's points its direction changes linearly.
    """
    h, station = np.unwrap(headings_along(line)), along(line)
    near = cKDTree(line).query(points)[1]
    s, t = np.full(len(points), np.nan), np.full(len(points), np.nan)
    for step in (-1, 0):
        k = np.clip(near + step, 0, len(line) - 2)
        e, w = line[k + 1] - line[k], points - line[k]
        length = station[k + 1] - station[k]
        turn = h[k + 1] - h[k]
        u = (w * e).sum(axis=1) / length**2
        for _ in range(4):
            rest = w - u[:, None] * e
            course = h[k] + turn * u
            c, d = np.cos(course), np.sin(course)
            across = rest[:, 1] * c - rest[:, 0] * d
            slope = turn * across - e[:, 0] * c - e[:, 1] * d
            slope = np.where(slope > -1e-9, np.inf, slope)
            u = u - (rest[:, 0] * c + rest[:, 1] * d) / slope
        rest = w - u[:, None] * e
        course = h[k] + turn * u
        across = rest[:, 1] * np.cos(course) - rest[:, 0] * np.sin(course)
        good = (u >= -1e-6) & (u <= 1 + 1e-6) & (np.abs(across) <= REACH)
        s[good], t[good] = (station[k] + u * length)[good], across[good]
    return s, t
