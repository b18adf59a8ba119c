"""Compiled placing of states on lanes; public wrapper: ``placing.place``."""

import math

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import inlined_kernel, kernel

MOST = 8
"""Largest number of lanes that a state may be on at once, where they overlap."""
ASIDE, AGAINST = math.radians(50.0), math.radians(130.0)
"""Differences of heading between which a vehicle crosses a lane and is not on it [rad]."""
OVERHANG = 0.5  # m, beyond the ends of a lane
TURN = 0.3  # rad, a difference of heading that weighs as much as half a lane's width
COST_AGAINST, COST_BACK, COST_OTHER, COST_BEYOND = 8.0, 5.0, 20.0, 2.0
ROUNDING = 1e-9


@inlined_kernel
def _wrapped(angle: float) -> float:
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@inlined_kernel
def _step_cost(a: int, b: int, left: Int, right: Int, succ_first: Int, succ: Int) -> float:
    """Return what going from lane a to lane b costs."""
    if a == b or left[a] == b or right[a] == b:
        return 0.0
    for k in range(succ_first[a], succ_first[a + 1]):
        to = succ[k]
        if to == b or left[to] == b or right[to] == b:
            return 0.0
    for k in range(succ_first[b], succ_first[b + 1]):
        if succ[k] == a:
            return COST_BACK
    return COST_OTHER


@inlined_kernel
def _cell_of(keys: Int, key: int) -> int:
    low, high = 0, len(keys)
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low if low < len(keys) and keys[low] == key else -1


@kernel
def place_track(
    x: Float,
    y: Float,
    heading: Float,
    speed_x: Float,
    speed_y: Float,
    begin: int,
    end: int,
    any_heading: bool,
    points: Float,
    segments: Int,
    left: Int,
    right: Int,
    succ_first: Int,
    succ: Int,
    keys: Int,
    cell_first: Int,
    cell_segments: Int,
    grid: Float,
    out_lane: Int,
    out_station: Float,
    out: Float,
) -> None:
    """Place one track: of all sequences of lanes that hold its states, the one of least cost.

    ``points``: ``(V, 5)`` x, y, heading, width, station; ``segments``: ``(G, 3)`` first point,
    lane, and 1, 2 or 3 where it is the lane's first, last, or only one; ``grid``: x and y of its
    corner, edge of a square and number of rows; ``out``: ``(4, S)`` offset, heading on the lane,
    speed along, speed across.
    """
    n = end - begin
    count = np.zeros(n, np.int64)
    lanes = np.zeros((n, MOST), np.int64)
    found = np.zeros((n, MOST, 3))
    cost = np.zeros((n, MOST))
    back = np.zeros((n, MOST), np.int64)
    corner_x, corner_y, edge, columns = grid[0], grid[1], grid[2], int(grid[3])
    for i in range(n):
        px, py = x[begin + i], y[begin + i]
        cx, cy = math.floor((px - corner_x) / edge), math.floor((py - corner_y) / edge)
        if cx < 0 or cy < 0 or cy >= columns:
            continue
        cell = _cell_of(keys, int(cx) * columns + int(cy))
        if cell < 0:
            continue
        m = 0
        for k in range(cell_first[cell], cell_first[cell + 1]):
            g = cell_segments[k]
            v, lane, ends = segments[g, 0], segments[g, 1], segments[g, 2]
            x0, y0 = points[v, 0], points[v, 1]
            ex, ey = points[v + 1, 0] - x0, points[v + 1, 1] - y0
            wx, wy = px - x0, py - y0
            length = math.sqrt(ex * ex + ey * ey)
            reach = 0.5 * max(points[v, 3], points[v + 1, 3]) + length
            if wx * wx + wy * wy > (reach + OVERHANG) ** 2:
                continue
            h0 = points[v, 2]
            turn = _wrapped(points[v + 1, 2] - h0)
            # u with (p - c(u)) at a right angle to the direction at u; c, direction linear in u
            tx, ty = elementary.cos(h0), elementary.sin(h0)
            bx, by = elementary.cos(h0 + turn) - tx, elementary.sin(h0 + turn) - ty
            u = (wx * ex + wy * ey) / (length * length)
            for _ in range(4):
                rx, ry = wx - u * ex, wy - u * ey
                dx, dy = tx + u * bx, ty + u * by
                slope = rx * bx + ry * by - ex * dx - ey * dy
                if slope > -ROUNDING:
                    break
                u -= (rx * dx + ry * dy) / slope
            low = -OVERHANG / length if ends & 1 else -ROUNDING
            high = 1.0 + (OVERHANG / length if ends & 2 else ROUNDING)
            if not low <= u <= high:
                continue
            inside = min(max(u, 0.0), 1.0)
            h = h0 + turn * inside
            d = (wy - u * ey) * elementary.cos(h) - (wx - u * ex) * elementary.sin(h)
            half = 0.5 * (points[v, 3] + inside * (points[v + 1, 3] - points[v, 3]))
            if abs(d) > half or half <= 0.0:
                continue
            aside = _wrapped(heading[begin + i] - h)
            emission = (d / half) ** 2
            if not -ROUNDING <= u <= 1.0 + ROUNDING:
                emission += COST_BEYOND
            if not any_heading:
                if ASIDE < abs(aside) < AGAINST:
                    continue
                if abs(aside) > AGAINST:
                    emission += COST_AGAINST
                    emission += ((math.pi - abs(aside)) / TURN) ** 2
                else:
                    emission += (aside / TURN) ** 2
            slot = m
            for j in range(m):
                if lanes[i, j] == lane:
                    slot = j
            if slot == MOST or (slot < m and cost[i, slot] <= emission):
                continue
            m = max(m, slot + 1)
            lanes[i, slot], cost[i, slot] = lane, emission
            found[i, slot, 0] = points[v, 4] + u * (points[v + 1, 4] - points[v, 4])
            found[i, slot, 1], found[i, slot, 2] = d, h
        count[i] = m
        if i == 0 or count[i - 1] == 0:
            continue
        for j in range(m):
            least, at = math.inf, 0
            for a in range(count[i - 1]):
                total = cost[i - 1, a] + _step_cost(
                    lanes[i - 1, a], lanes[i, j], left, right, succ_first, succ
                )
                if total < least:
                    least, at = total, a
            cost[i, j] += least
            back[i, j] = at
    chosen = -1
    for i in range(n - 1, -1, -1):
        if count[i] == 0:
            chosen = -1
            continue
        if chosen < 0:
            chosen = 0
            for j in range(1, count[i]):
                if cost[i, j] < cost[i, chosen]:
                    chosen = j
        s, h = begin + i, found[i, chosen, 2]
        out_lane[s] = lanes[i, chosen]
        out_station[s] = found[i, chosen, 0]
        out[0, s] = found[i, chosen, 1]
        out[1, s] = _wrapped(heading[s] - h)
        out[2, s] = speed_x[s] * elementary.cos(h) + speed_y[s] * elementary.sin(h)
        out[3, s] = speed_y[s] * elementary.cos(h) - speed_x[s] * elementary.sin(h)
        chosen = back[i, chosen]


@kernel
def place_tracks(
    x: Float,
    y: Float,
    heading: Float,
    speed_x: Float,
    speed_y: Float,
    first: Int,
    any_heading: Bool,
    points: Float,
    segments: Int,
    left: Int,
    right: Int,
    succ_first: Int,
    succ: Int,
    keys: Int,
    cell_first: Int,
    cell_segments: Int,
    grid: Float,
    out_lane: Int,
    out_station: Float,
    out: Float,
) -> None:
    """Place all tracks, each by itself."""
    for p in range(len(first) - 1):
        place_track(
            x, y, heading, speed_x, speed_y, first[p], first[p + 1], any_heading[p], points,
            segments, left, right, succ_first, succ, keys, cell_first, cell_segments, grid,
            out_lane, out_station, out,
        )  # fmt: skip
