"""Walking the lane graph: from place to place along lanes, and to the lane beside.

Nodes are `LaneGraph`'s: a lane of a lane section with a direction of travel; a node and the same
lane travelled the other way round differ in the last bit of their numbers. ``nodes`` is ``(S, 7)``
int64 with the columns below, ``ends`` ``(S, 2)`` float64: where each is entered and left [m along
its road].
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel

ROAD, FIRST, PAST, LANE, WAY, STRAIGHT, TRAFFIC = 0, 1, 2, 3, 4, 5, 6
"""Columns of a node: number of its road; first and past-the-last node of its section; lane id; its
direction of travel along the reference line, 1 or -1; the node straight on, -1 if none; the
traffic's way."""

STATION, LEAVE, S, S_LEAVE, NODE, T, T_LEAVE, LEFT, LEFT_LEAVE, RIGHT, RIGHT_LEAVE = range(11)
"""Columns of a span of a path: station and s where it is entered and left [m], its node, and in
both places t of the lane's centre and how far left and right of it the carriageway goes [m]."""

SLACK = 1e-6  # m, by which a place may lie beyond its road's end: the rounding of a file
MARGIN = 1.0  # m, up to which an entity beside a lane still counts as on it
MOST_TURN = math.pi / 3  # rad, an entity turned more from a lane's direction is not on it
AGAINST = 2.0  # m, by which a lane against whose traffic one is turned counts as farther
PER_RADIAN = 1.0  # m, by which a lane counts as farther per radian of turn from it
BEFORE = 10.0  # m, by which a lane counts as farther whose start is still ahead


@kernel
def turned(h, other):
    """Return by how much a heading is turned from another one, within half a turn [rad]."""
    turn = h - other
    return turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))


@kernel
def continued(h, before):
    """Return a heading by the whole turns that lead on from an earlier one, else to the bit."""
    return h - 2.0 * math.pi * round((h - before) / (2.0 * math.pi))


@kernel
def beside(lane, lanes):
    """Return the id of the lane so many to the left in road direction; there is no lane 0."""
    target = lane + lanes
    if lane < 0 <= target:
        return target + 1
    if target <= 0 < lane:
        return target - 1
    return target


@kernel
def find_lane(nodes, node, lane, way):
    """Return the node of a lane of a node's section in a direction, -1 if there is none."""
    for i in range(nodes[node, FIRST], nodes[node, PAST]):
        if nodes[i, LANE] == lane and nodes[i, WAY] == way:
            return i
    return -1


@kernel
def find_node(nodes, ends, road, lane, s):
    """Return the node of a place on a lane, -1 if there is none; where sections meet, the later."""
    found = -1
    for i in range(nodes.shape[0]):
        if nodes[i, ROAD] != road or nodes[i, LANE] != lane:
            continue
        if min(ends[i, 0], ends[i, 1]) - SLACK <= s <= max(ends[i, 0], ends[i, 1]) + SLACK:
            found = i
    return found


@kernel
def facing(nodes, node, way):
    """Return the node of the same lane that leads so along the reference line: 1, or -1."""
    return node if nodes[node, WAY] == way else node ^ 1


@kernel
def walk(nodes, ends, node, s, metres):
    """Return (node, s) so many metres on in a node's direction, straight on where lanes fork.

    Metres count along the roads' reference lines. Backwards they count down, and the node found
    is one from which the way leads on to the first. Beyond the end of the road: node -1.
    """
    back = metres < 0.0
    at = node ^ 1 if back else node
    left = abs(metres)
    while True:
        rest = abs(ends[at, 1] - s)
        if left <= rest:
            s += left if ends[at, 1] >= ends[at, 0] else -left
            return (at ^ 1 if back else at), s
        left -= rest
        at = nodes[at, STRAIGHT]
        if at < 0:
            return -1, s
        s = ends[at, 0]


@kernel
def span_at(spans, n, station):
    """Return the number of the span that holds a station; the first or last beyond the ends."""
    low, high = 0, n - 1
    while low < high:
        middle = (low + high + 1) // 2
        if spans[middle, STATION] <= station:
            low = middle
        else:
            high = middle - 1
    return low


@kernel
def along(spans, i, station, entered, left):
    """Return one of a span's values at a station, by its columns at entry and at exit."""
    length = spans[i, LEAVE] - spans[i, STATION]
    share = (station - spans[i, STATION]) / length if length > 0.0 else 0.0
    return spans[i, entered] + share * (spans[i, left] - spans[i, entered])


@kernel
def station_of(spans, n, node, s):
    """Return the station of a place on a path, NaN where its node is not on the path."""
    found = math.nan
    for i in range(n):
        if spans[i, NODE] != node:
            continue
        span = spans[i, S_LEAVE] - spans[i, S]
        share = (s - spans[i, S]) / span if span != 0.0 else 0.0
        found = spans[i, STATION] + share * (spans[i, LEAVE] - spans[i, STATION])
        if share <= 1.0:
            return found
    return found


@kernel
def _begins(points, point_nodes, i, c, s):
    """Return whether point i is where its lane begins for one that travels towards (c, s)."""
    inner = i + 1
    if point_nodes[i - 1] == point_nodes[i]:
        if inner < points.shape[0] and point_nodes[inner] == point_nodes[i]:
            return False
        inner = i - 1
    return (points[inner, 0] - points[i, 0]) * c + (points[inner, 1] - points[i, 1]) * s > 0.0


@kernel
def nearest_lane(points, point_nodes, x, y, h):
    """Return the node of the lane that a body is on by its place and heading, -1 if on none.

    ``points`` is ``(G, 4)``: x, y, heading, half width of points on lanes at most a metre apart.
    The nearest counts; being turned from its direction counts as being farther away. A lane that
    begins within the next metre counts only where no other lane is: a body on it would be moved to
    its start.
    """
    best, found = math.inf, -1
    for i in range(points.shape[0]):
        if point_nodes[i] < 0:
            continue
        dx, dy = x - points[i, 0], y - points[i, 1]
        if abs(dx) > 20.0 or abs(dy) > 20.0:
            continue
        reach = points[i, 3] + MARGIN
        if dx * dx + dy * dy > 1.000001 * (1.0 + reach * reach):  # it is beyond one of them
            continue
        c, s = elementary.cos(points[i, 2]), elementary.sin(points[i, 2])
        along = dx * c + dy * s
        if abs(along) > 1.0:
            continue
        aside = abs(dy * c - dx * s)
        if aside > reach:
            continue
        turn = abs(turned(h, points[i, 2]))
        cost, node = aside, point_nodes[i]
        if turn > 0.5 * math.pi:
            turn, cost, node = math.pi - turn, cost + AGAINST, node ^ 1
            c, s, along = -c, -s, -along
        cost += PER_RADIAN * turn
        # A body less than 1 m before a lane's start was moved to the start, 0.77 m in Vector's
        # CBNAO; now it is on the lane that is there, that of the junction.
        if along < -SLACK and _begins(points, point_nodes, i, c, s):
            cost += BEFORE
        # The first of two alike: rounding must not choose.
        if turn <= MOST_TURN and cost < best - 1e-9:
            best, found = cost, node
    return found
