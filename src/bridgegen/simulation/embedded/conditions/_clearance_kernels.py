"""Which lanes a place is on, and whether the lanes around an entity are clear of others.

Lanes are cut into cells, ``(Q, 8)`` float64: x, y [m] of four corners, one after the other around
it. A cell's node leads along its lane's traffic.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import project
from bridgegen.simulation.embedded._codes import (
    BOXES,
    COUNTS,
    LIMIT,
    OPPOSITE,
    OTHER,
    RANGES,
    RANGES_END,
    WHO,
    WITHIN,
)
from bridgegen.simulation.embedded._motion_kernels import nearest
from bridgegen.simulation.embedded.conditions._distance_kernels import along_path
from bridgegen.simulation.embedded.places._lane_kernels import (
    FIRST,
    LANE,
    NODE,
    PAST,
    ROAD,
    TRAFFIC,
    WAY,
    span_at,
)

FAR = 50.0  # m, no cell is so large
SLACK = 1e-6  # m², twice the area by which a place may lie outside: the rounding of a corner
SAMPLE = 0.5  # m, between two places of a body that are looked at


@kernel
def find_cell(cells, first, x, y):
    """Return the number of the first cell, from one on, that a place is in; -1 if there is none."""
    for i in range(first, cells.shape[0]):
        cell = cells[i]
        if abs(cell[0] - x) > FAR or abs(cell[1] - y) > FAR:
            continue
        left = right = True
        for a in range(4):
            b = (a + 1) % 4
            side = (cell[2 * b] - cell[2 * a]) * (y - cell[2 * a + 1]) - (
                cell[2 * b + 1] - cell[2 * a + 1]
            ) * (x - cell[2 * a])
            left, right = left and side >= -SLACK, right and side <= SLACK
        if left != right:  # both: a cell without an inside
            return i
    return -1


@kernel
def lanes_left(lane, other, way):
    """Return how many lanes to the left another one lies, as one goes; there is no lane 0."""
    count = other - lane
    if (other > 0) != (lane > 0):
        count -= 1 if count > 0 else -1
    return count * way


@kernel
def is_in_ranges(count, first, last, ranges):
    """Return whether so many lanes to the left lies within one of some ranges; none: it does."""
    for i in range(first, last):
        if ranges[i, 0] <= count <= ranges[i, 1]:
            return True
    return first == last


@kernel
def node_at(path, station, plan, roads, state, record):
    """Return the node that a path leads along at a station."""
    spans = roads.spans[path]
    return int(spans[span_at(spans, roads.span_counts[path], station), NODE])


@kernel
def lane_at(node, x, y, plan, roads, state, record):
    """Return the id of the lane of a node's road that a place is on; the node's own if on none."""
    i = find_cell(roads.cells, 0, x, y)
    while i >= 0:
        if roads.nodes[roads.cell_nodes[i], ROAD] == roads.nodes[node, ROAD]:
            return roads.nodes[roads.cell_nodes[i], LANE]
        i = find_cell(roads.cells, i + 1, x, y)
    return roads.nodes[node, LANE]


@kernel
def is_clear(p, k, plan, roads, state, record):
    """Return whether none of probe p's entities is near its own entity, on the lanes that it names.

    Near is within its distances ahead and behind, along the entity's path. Without such a lane, or
    for an entity on no lane, there is no clearance.
    """
    e = plan.probes[p, WHO]
    row, path = plan.clearances[plan.probes[p, OTHER]], state.along[p]
    if path < 0:
        return False
    x, y = record.x[e, k], record.y[e, k]
    table, n, ds = roads.paths[path], roads.counts[path], roads.steps[path]
    s, _ = project(table, n, ds, nearest(table, n, ds, x, y), x, y)
    node = node_at(path, s, plan, roads, state, record)
    way, lane = roads.nodes[node, WAY], lane_at(node, x, y, plan, roads, state, record)
    traffic, exists = roads.nodes[node, TRAFFIC], False
    for i in range(roads.nodes[node, FIRST], roads.nodes[node, PAST]):
        if roads.nodes[i, LANE] == lane:
            traffic = roads.nodes[i, TRAFFIC]
    for i in range(roads.nodes[node, FIRST], roads.nodes[node, PAST]):
        count = lanes_left(lane, roads.nodes[i, LANE], way)
        counts = row[OPPOSITE] == 1 or roads.nodes[i, TRAFFIC] == traffic
        exists = exists or (
            counts and is_in_ranges(count, row[RANGES], row[RANGES_END], plan.ranges)
        )
    if not exists:
        return False
    shift = lanes_left(roads.nodes[node, LANE], lane, way)
    with_traffic = way == traffic
    for other in range(record.x.shape[0]):
        if (
            other != e
            and state.present[other]
            and row[COUNTS + other] == 1
            and is_near(p, k, other, s, plan, roads, state, record)
            and is_on_lanes(p, k, other, path, shift, with_traffic, plan, roads, state, record)
        ):
            return False
    return True


@kernel
def is_near(p, k, other, station, plan, roads, state, record):
    """Return whether a body, or its reference point, is as near along the way as probe p asks."""
    e, path = plan.probes[p, WHO], state.along[p]
    along, _, _, turn = along_path(
        roads.paths[path], roads.counts[path], roads.steps[path], station, record.x[e, k],
        record.y[e, k], record.h[e, k], record.x[other, k], record.y[other, k], record.h[other, k],
    )  # fmt: skip
    reach = 0.0
    if plan.probes[p, BOXES] == 1:
        c, sine, body = math.cos(turn), math.sin(turn), plan.bodies[other]
        along += body[2] * c
        reach = 0.5 * (abs(c) * body[0] + abs(sine) * body[1])
    forward = state.slots[plan.probes[p, LIMIT]]
    backward = state.slots[plan.probes[p, WITHIN]]
    return along - reach <= forward and along + reach >= -backward


@kernel
def is_on_lanes(p, k, other, path, shift, with_traffic, plan, roads, state, record):
    """Return whether a body touches, or its reference point is on, the lanes that probe p names."""
    x, y, h, body = record.x[other, k], record.y[other, k], record.h[other, k], plan.bodies[other]
    if plan.probes[p, BOXES] == 0:
        return is_on_lane(p, x, y, path, shift, with_traffic, plan, roads, state, record)
    c, s = math.cos(h), math.sin(h)
    n, m = max(math.ceil(body[0] / SAMPLE), 1), max(math.ceil(body[1] / SAMPLE), 1)
    for i in range(n + 1):
        u = body[2] + body[0] * (i / n - 0.5)
        for j in range(m + 1):
            w = body[1] * (j / m - 0.5)
            at_x, at_y = x + u * c - w * s, y + u * s + w * c
            if is_on_lane(p, at_x, at_y, path, shift, with_traffic, plan, roads, state, record):
                return True
    return False


@kernel
def is_on_lane(p, x, y, path, shift, with_traffic, plan, roads, state, record):
    """Return whether a place is on one of the lanes that probe p names, along a path.

    ``shift`` is how many lanes to the left of the path's the entity itself is.
    """
    row = plan.clearances[plan.probes[p, OTHER]]
    table, n, ds = roads.paths[path], roads.counts[path], roads.steps[path]
    node = node_at(path, nearest(table, n, ds, x, y), plan, roads, state, record)
    way = roads.nodes[node, WAY]
    i = find_cell(roads.cells, 0, x, y)
    while i >= 0:
        there = roads.cell_nodes[i]
        if roads.nodes[there, ROAD] == roads.nodes[node, ROAD]:
            count = lanes_left(roads.nodes[node, LANE], roads.nodes[there, LANE], way) - shift
            counts = row[OPPOSITE] == 1 or (roads.nodes[there, TRAFFIC] == way) == with_traffic
            if counts and is_in_ranges(count, row[RANGES], row[RANGES_END], plan.ranges):
                return True
        i = find_cell(roads.cells, i + 1, x, y)
    return False
