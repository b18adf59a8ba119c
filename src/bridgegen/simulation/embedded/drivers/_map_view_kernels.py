"""Observations of a user's own driver that wants "map": the nearest pieces, and the ego's lane.

The distance of a piece is that of its middle, of two alike the first one is nearer. Pieces that
may be among the nearest until the ego has moved by ``SLACK`` are kept in a memory ``(MEMORY,)``;
they are searched in the cells of a grid, see `bridgegen.drivers.map_grid`.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import bundled_row, kernel
from bridgegen.drivers.interface import CENTRE, NEAR_PIECES, PIECE_POINTS
from bridgegen.drivers.map_grid import ACROSS, BOTTOM, LEFT, REACH, UP, WIDTH
from bridgegen.simulation.embedded._memory_kernels import N_STEPS

# The grid is searched when the ego has moved so far; what may be among the nearest until then is
# sorted at every instant. So these are exactly the nearest, at a cost that does not grow with the
# map.
SLACK = 8.0  # m
MOST = 512  # candidates that are kept
HALVINGS = 6  # of the radius in which they lie

AT_X, AT_Y, STAYS, COUNT, CANDIDATES = range(5)
KEYS = CANDIDATES + MOST
MEMORY = KEYS + MOST

WIDTHS = 3 * PIECE_POINTS
HOW_MANY = WIDTHS + PIECE_POINTS
KIND, OF_LANE, ON_ROUTE = HOW_MANY + 1, HOW_MANY + 2, HOW_MANY + 6


@kernel
def cell_of(box, x, y):
    """Return the column and row of the cell that a place is in, also outside of the grid."""
    return (
        math.floor((x - box[LEFT]) / box[WIDTH]),
        math.floor((y - box[BOTTOM]) / box[WIDTH]),
    )


@kernel
def count_within(roads, x, y, ring, radius):
    """Return how many pieces lie within a radius, all in the cells up to a ring around a place."""
    box, found = roads.grid_box, 0
    i, j = cell_of(box, x, y)
    across, up = int(box[ACROSS]), int(box[UP])
    for row in range(max(j - ring, 0), min(j + ring, up - 1) + 1):
        for column in range(max(i - ring, 0), min(i + ring, across - 1) + 1):
            cell = row * across + column
            for at in range(roads.grid_starts[cell], roads.grid_starts[cell + 1]):
                piece = roads.grid_order[at]
                dx, dy = roads.middles[piece, 0] - x, roads.middles[piece, 1] - y
                found += dx * dx + dy * dy <= radius * radius
    return found


@kernel
def search(roads, x, y, memory):
    """Keep all pieces in the memory that may be among the nearest soon."""
    box = roads.grid_box
    across, up = int(box[ACROSS]), int(box[UP])
    i, j = cell_of(box, x, y)
    all_ = max(max(i, across - 1 - i), max(j, up - 1 - j))  # the ring that reaches all cells
    ring = max(max(max(-i, i - across + 1), max(-j, j - up + 1)), 0)
    least, slack = box[REACH] + SLACK, SLACK
    while ring < all_:
        radius = ring * box[WIDTH]
        if radius >= least and count_within(roads, x, y, ring, radius - 2.0 * SLACK) >= NEAR_PIECES:
            break
        ring += 1
    low, high = least, ring * box[WIDTH]
    if ring >= all_:
        high = elementary.hypot(
            max(abs(x - box[LEFT]), abs(x - box[LEFT] - across * box[WIDTH])),
            max(abs(y - box[BOTTOM]), abs(y - box[BOTTOM] - up * box[WIDTH])),
        )
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if middle > least and count_within(roads, x, y, ring, middle - 2.0 * SLACK) >= NEAR_PIECES:
            high = middle
        else:
            low = middle
    if count_within(roads, x, y, ring, high) > MOST:
        low, slack = 0.0, 0.0  # it is crowded: search at every instant
        for _ in range(HALVINGS + HALVINGS):
            middle = 0.5 * (low + high)
            if count_within(roads, x, y, ring, middle) >= NEAR_PIECES:
                high = middle
            else:
                low = middle
    count = 0
    for row in range(max(j - ring, 0), min(j + ring, up - 1) + 1):
        for column in range(max(i - ring, 0), min(i + ring, across - 1) + 1):
            cell = row * across + column
            for at in range(roads.grid_starts[cell], roads.grid_starts[cell + 1]):
                piece = roads.grid_order[at]
                dx, dy = roads.middles[piece, 0] - x, roads.middles[piece, 1] - y
                if dx * dx + dy * dy <= high * high and count < MOST:
                    memory[CANDIDATES + count] = piece
                    count += 1
    memory[AT_X], memory[AT_Y], memory[STAYS], memory[COUNT] = x, y, slack, count


@kernel
def sort(roads, x, y, memory):
    """Sort the pieces in the memory by their distance."""
    for n in range(int(memory[COUNT])):
        piece = memory[CANDIDATES + n]
        dx, dy = roads.middles[int(piece), 0] - x, roads.middles[int(piece), 1] - y
        key = dx * dx + dy * dy
        at = n
        while at > 0 and (
            memory[KEYS + at - 1] > key
            or (memory[KEYS + at - 1] == key and memory[CANDIDATES + at - 1] > piece)
        ):
            memory[KEYS + at], memory[CANDIDATES + at] = (
                memory[KEYS + at - 1],
                memory[CANDIDATES + at - 1],
            )
            at -= 1
        memory[KEYS + at], memory[CANDIDATES + at] = key, piece


@kernel
def lane_of(roads, x, y, h, memory):
    """Return the lane that a place is on, -1 for none.

    Where lanes overlap: one of the route first, then the one whose direction is nearest to h.
    """
    found, best, reach = -1, -math.inf, roads.grid_box[REACH]
    for n in range(int(memory[COUNT])):
        if memory[KEYS + n] > reach * reach:
            break
        row = roads.pieces[int(memory[CANDIDATES + n])]
        if row[KIND] != CENTRE:
            continue
        for i in range(int(row[HOW_MANY]) - 1):
            ax, ay = row[3 * i], row[3 * i + 1]
            bx, by = row[3 * i + 3] - ax, row[3 * i + 4] - ay
            long = bx * bx + by * by
            if long == 0.0:
                continue
            share = ((x - ax) * bx + (y - ay) * by) / long
            if not 0.0 <= share <= 1.0:
                continue
            aside = abs((y - ay) * bx - (x - ax) * by) / math.sqrt(long)
            half = 0.5 * (row[WIDTHS + i] + share * (row[WIDTHS + i + 1] - row[WIDTHS + i]))
            if aside > half:
                continue
            fits = 4.0 * row[ON_ROUTE] + elementary.cos(h - elementary.atan2(by, bx)) - 1e-3 * aside
            if fits > best:
                found, best = int(row[OF_LANE]), fits
    return found


@kernel
def see_map(k, roads, record, memory, place):
    """Fill ``place`` ``(1 + Q,)``: the ego's lane, and the nearest pieces."""
    x, y, h = record.x[0, k], record.y[0, k], record.h[0, k]
    moved = elementary.hypot(x - memory[AT_X], y - memory[AT_Y])
    if memory[COUNT] == 0.0 or not moved <= memory[STAYS]:
        search(roads, x, y, memory)
    sort(roads, x, y, memory)
    place[0] = lane_of(roads, x, y, h, memory)
    for n in range(NEAR_PIECES):
        place[1 + n] = int(memory[CANDIDATES + n]) if n < memory[COUNT] else -1


@kernel
def see_map_of_rows(k, networks, rows, states, records, memories, places):
    """Fill the places ``(N, 1 + Q)`` of rows that run."""
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads, record = bundled_row(networks, rows[i]), bundled_row(records, i)
            see_map(k, roads, record, memories[i], places[i])
