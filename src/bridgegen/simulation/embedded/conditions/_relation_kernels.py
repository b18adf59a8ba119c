"""What conditions measure: distances, relations, whether the lanes around an entity are clear."""

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import COS, SIN, X, Y, pose, project
from bridgegen.simulation._box_kernels import box_gap
from bridgegen.simulation.embedded._codes import (
    ACCELERATING,
    ANGLE,
    AT_MARK,
    BOXES,
    CLEARANCE,
    CLOSELY,
    COLLISION,
    COLLISION_WITH_TYPE,
    COUNTS,
    DISTANCE,
    END_OF_ROAD,
    ENTITY_SYSTEM,
    EQUAL,
    EUCLIDIAN,
    GREATER,
    GREATER_EQUAL,
    LATERAL,
    LESS,
    LESS_EQUAL,
    LIGHT_PHASE,
    LIGHT_STATE,
    LIMIT,
    LONGITUDINAL,
    MEASURE,
    OFFROAD,
    OPPOSITE,
    OTHER,
    PATH_SYSTEM,
    PLACE,
    PROBE,
    RANGES,
    RANGES_END,
    RELATIVE_ANGLE,
    ROAD_SYSTEM,
    RULE,
    SPEED_DIFFERENCE,
    SYSTEM,
    TIME_HEADWAY,
    TIME_OF_DAY,
    TOTAL,
    VALUE,
    WHO,
    WITHIN,
)
from bridgegen.simulation.embedded._motion_kernels import nearest
from bridgegen.simulation.embedded.places._lane_kernels import (
    FIRST,
    LANE,
    LEAVE,
    NODE,
    PAST,
    ROAD,
    STATION,
    T_LEAVE,
    TRAFFIC,
    WAY,
    T,
    span_at,
    turned,
)
from bridgegen.simulation.embedded.world import time_of_day

# --- Distances between entities, and between an entity and a place, as conditions measure them ---


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@kernel
def look_ahead(p, k, plan, roads, state, record):
    """Return (whether it is defined, the distance [m], time to collision [s] or headway [s]).

    Distances are absolute. A headway is defined for an entity that moves towards a target not
    behind it, a time to collision for one that approaches it.
    """
    kind, e, other = plan.probes[p, PROBE], plan.probes[p, WHO], plan.probes[p, OTHER]
    measure, free = plan.probes[p, MEASURE], plan.probes[p, BOXES] == 1
    x, y, h, v = record.x[e, k], record.y[e, k], record.h[e, k], record.v[e, k]
    own = plan.bodies[e]
    if other >= 0:
        ox, oy, oh, w = (
            record.x[other, k],
            record.y[other, k],
            record.h[other, k],
            record.v[other, k],
        )
        length, width, ahead = (
            plan.bodies[other, 0],
            plan.bodies[other, 1],
            plan.bodies[other, 2],
        )
    else:
        at = state.marks if other == AT_MARK else roads.points
        ox, oy = at[plan.probes[p, PLACE], 0], at[plan.probes[p, PLACE], 1]
        if math.isnan(ox):  # there is no such place
            return False, 0.0
        oh = w = length = width = ahead = 0.0
    if measure == EUCLIDIAN:
        gap, closing = as_the_crow_flies(ox - x, oy - y, v, h, w, oh)
        if free:
            gap = apart(own, length, width, ahead, ox - x, oy - y, h, oh)
    else:
        turn, other_turn = 0.0, oh - h
        along, aside = in_frame(ox - x, oy - y, h)
        path = state.on[e]
        if plan.probes[p, SYSTEM] != ENTITY_SYSTEM and path >= 0:
            along, aside, turn, other_turn = along_path(
                roads.paths[path],
                roads.counts[path],
                roads.steps[path],
                state.station[e],
                x,
                y,
                h,
                ox,
                oy,
                oh,
            )
        gap = aside if measure == LATERAL else along
        closing = v * elementary.cos(turn) - w * elementary.cos(other_turn)
        if measure == LATERAL:
            closing = v * elementary.sin(turn) - w * elementary.sin(other_turn)
        if free:
            gap = between_boxes(gap, own, length, width, ahead, turn, other_turn, measure)
    if kind == DISTANCE:
        return True, abs(gap)
    # Where a headway or a time to collision is not defined, the condition is false, whatever its
    # rule: "greater than" is, too.
    if kind == TIME_HEADWAY:
        is_ahead = gap >= 0.0 and (measure != EUCLIDIAN or in_frame(ox - x, oy - y, h)[0] >= 0.0)
        return v > 0.0 and is_ahead, gap / max(v, 1e-9)
    if gap == 0.0:
        return True, 0.0
    closes = closing > 0.0 if gap > 0.0 else closing < 0.0
    return closes, gap / closing if closes else 0.0


@kernel
def as_the_crow_flies(dx, dy, v, h, w, other_h):
    """Return (distance [m], how fast it shrinks [m/s]) of a body from another at (dx, dy)."""
    gap = elementary.hypot(dx, dy)
    closing = dx * (v * elementary.cos(h) - w * elementary.cos(other_h)) + dy * (
        v * elementary.sin(h) - w * elementary.sin(other_h)
    )
    return gap, closing / max(gap, 1e-9)


@kernel
def in_frame(dx, dy, h):
    """Return a vector's parts along a heading and to its left."""
    c, s = elementary.cos(h), elementary.sin(h)
    return c * dx + s * dy, c * dy - s * dx


@kernel
def along_path(path, n, ds, station, x, y, h, ox, oy, oh):
    """Return how far another body is ahead along a path and to its left, and both bodies' turns.

    A turn is by how much a body's heading differs from the path's direction at its foot. The body
    itself is near ``station``; the other's foot is looked for all along the path, and beyond its
    ends on the tangents.
    """
    s, d = project(path, n, ds, station, x, y)
    q = nearest(path, n, ds, ox, oy)
    q, t = project(path, n, ds, q, ox, oy)
    if q <= 0.0:
        q = min(path[0, COS] * (ox - path[0, X]) + path[0, SIN] * (oy - path[0, Y]), 0.0)
    elif q >= (n - 1) * ds:
        end = path[n - 1]
        q += max(end[COS] * (ox - end[X]) + end[SIN] * (oy - end[Y]), 0.0)
    return q - s, t - d, h - pose(path, n, ds, s)[2], oh - pose(path, n, ds, q)[2]


@kernel
def apart(own, length, width, ahead, dx, dy, h, other_h):
    """Return the distance of two boxes [m], 0 where they touch."""
    c, s, oc, os = (
        elementary.cos(h),
        elementary.sin(h),
        elementary.cos(other_h),
        elementary.sin(other_h),
    )
    return box_gap(own, (length, width, ahead), dx, dy, c, s, oc, os)


@kernel
def between_boxes(gap, own, length, width, ahead, turn, other_turn, measure):
    """Return the gap of two boxes along an axis [m], signed; 0 where they are side by side.

    ``gap`` is that of their reference points along the axis; turns are from the axis that is
    longitudinal.
    """
    c, s, oc, os = (
        elementary.cos(turn),
        elementary.sin(turn),
        elementary.cos(other_turn),
        elementary.sin(other_turn),
    )
    if measure == LATERAL:
        c, s, oc, os = s, c, os, oc
    middle = gap + ahead * oc - own[2] * c
    reach = 0.5 * (abs(c) * own[0] + abs(s) * own[1] + abs(oc) * length + abs(os) * width)
    return math.copysign(max(abs(middle) - reach, 0.0), middle)


# --- Which lanes a place is on, and whether the lanes around an entity are clear of others ---
# Lanes are cut into cells, ``(Q, 8)`` float64: x, y [m] of four corners, one after the other around
# it. A cell's node leads along its lane's traffic.


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


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
    # As esmini has it: a lane that is not there is not clear.
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
        roads.paths[path],
        roads.counts[path],
        roads.steps[path],
        station,
        record.x[e, k],
        record.y[e, k],
        record.h[e, k],
        record.x[other, k],
        record.y[other, k],
        record.h[other, k],
    )
    reach = 0.0
    if plan.probes[p, BOXES] == 1:
        c, sine, body = elementary.cos(turn), elementary.sin(turn), plan.bodies[other]
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
    c, s = elementary.cos(h), elementary.sin(h)
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


# --- What is asked for seldom: relative speeds, accelerations, angles, contacts, distances to place
# One function, for the code of all instants would grow by it.


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


AT_END = 1e-6  # m
SAME_TIME = 1e-6  # s, the rounding of a date
SAME_VALUE = 1e-9  # of any unit, the rounding of what is summed up step by step
SAME_ANGLE = 1e-9  # rad, the rounding of a turn


@kernel
def compare(value, rule, limit):
    """Apply an OpenSCENARIO Rule; what is the limit up to rounding is the limit."""
    # Speeds and distances are sums of steps: 0.1 m/s added forty times are not 4.
    if abs(value - limit) <= SAME_VALUE:
        value = limit
    if rule == GREATER:
        return value > limit
    if rule == LESS:
        return value < limit
    if rule == GREATER_EQUAL:
        return value >= limit
    if rule == LESS_EQUAL:
        return value <= limit
    if rule == EQUAL:
        return value == limit
    return value != limit


@kernel
def compare_times(now, rule, limit):
    """Apply a Rule to a time [s], an instant being a multiple of the step up to rounding."""
    if not math.isfinite(now):
        return False
    return compare(limit if abs(now - limit) <= SAME_TIME else now, rule, limit)


@kernel
def look_closely(k, plan, roads, state, record):
    """Record the values of rarely used probes at instant k."""
    for p in range(plan.probes.shape[0]):
        if plan.probes[p, CLOSELY]:
            state.observed[p] = look_one(p, k, plan, roads, state, record)


@kernel
def look_one(p, k, plan, roads, state, record):
    """Return whether probe p sees at instant k what its condition asks for."""
    kind, e, other = plan.probes[p, PROBE], plan.probes[p, WHO], plan.probes[p, OTHER]
    rule, limit = plan.probes[p, RULE], state.slots[plan.probes[p, LIMIT]]
    measure = plan.probes[p, MEASURE]
    if kind == VALUE:
        return compare(state.values[other], rule, limit)
    if kind == TIME_OF_DAY:
        return compare_times(time_of_day(k * plan.dt, state.clock), rule, limit)
    if kind == LIGHT_STATE:
        return state.lights[other] == limit
    if kind == LIGHT_PHASE:
        return state.phase_now[other] == limit
    if kind >= DISTANCE:
        defined, value = look_ahead(p, k, plan, roads, state, record)
        return defined and compare(value, rule, limit)
    if kind == COLLISION:
        return touch(e, other, k, plan, roads, state, record)
    if kind == COLLISION_WITH_TYPE:
        for i in range(record.x.shape[0]):
            there = i != e and state.present[i]
            if there and plan.objects[i] == other and touch(e, i, k, plan, roads, state, record):
                return True
        return False
    if kind in (ANGLE, RELATIVE_ANGLE):
        defined, angle = angle_of(p, k, plan, roads, state, record)
        if not defined:
            return False
        off = abs(turned(angle, limit))
        return off <= state.slots[plan.probes[p, WITHIN]] + SAME_ANGLE
    if kind == END_OF_ROAD:
        path = state.on[e]
        length = (roads.counts[path] - 1) * roads.steps[path]
        return lasts(
            p,
            k,
            path >= 0 and state.station[e] >= length - AT_END,
            limit,
            plan,
            roads,
            state,
            record,
        )
    if kind == OFFROAD:
        # By the reference point, and on any type of lane but ``none``: on a sidewalk it is on the
        # road, as in esmini.
        on_road = find_cell(roads.cells, 0, record.x[e, k], record.y[e, k]) >= 0
        return lasts(p, k, not on_road, limit, plan, roads, state, record)
    if kind == CLEARANCE:
        return is_clear(p, k, plan, roads, state, record)
    if kind == SPEED_DIFFERENCE:
        # Along the axes of the triggering entity (1.2); esmini takes the other one's.
        turn = record.h[other, k] - record.h[e, k]
        along, aside = (
            record.v[other, k] * elementary.cos(turn),
            record.v[other, k] * elementary.sin(turn),
        )
        if measure == TOTAL:
            return compare(record.v[e, k] - record.v[other, k], rule, limit)
        if measure == LONGITUDINAL:
            return compare(record.v[e, k] - along, rule, limit)
        return compare(-aside if measure == LATERAL else 0.0, rule, limit)
    if kind == ACCELERATING:
        along, aside = accelerations(e, k, plan, roads, state, record)
        if measure == TOTAL:
            return compare(elementary.hypot(along, aside), rule, limit)
        if measure == LONGITUDINAL:
            return compare(along, rule, limit)
        return compare(aside if measure == LATERAL else 0.0, rule, limit)
    return compare(record.v[e, k] if measure == LONGITUDINAL else 0.0, rule, limit)  # SPEED


@kernel
def touch(e, other, k, plan, roads, state, record):
    """Return whether the boxes of two entities touch."""
    return (
        apart(
            plan.bodies[e],
            plan.bodies[other, 0],
            plan.bodies[other, 1],
            plan.bodies[other, 2],
            record.x[other, k] - record.x[e, k],
            record.y[other, k] - record.y[e, k],
            record.h[e, k],
            record.h[other, k],
        )
        == 0.0
    )


@kernel
def lasts(p, k, seen, limit, plan, roads, state, record):
    """Return whether a probe has seen so long [s] what it sees now."""
    seen = seen and state.present[plan.probes[p, WHO]]
    # A duration of 0 is met at the first instant at which it is so.
    before = state.held[p] if k > 0 else -plan.dt
    state.held[p] = before + plan.dt if seen else -plan.dt
    return seen and state.held[p] >= limit - AT_END


@kernel
def angle_of(p, k, plan, roads, state, record):
    """Return (whether it is defined, the heading that a condition looks at [rad]).

    It is measured from the axis of its system; of one entity from another's, the one's by its axis
    from the other's by its own.
    """
    e, other, system = plan.probes[p, WHO], plan.probes[p, OTHER], plan.probes[p, SYSTEM]
    h, axis = record.h[e, k], axis_of(e, k, system, plan, roads, state, record)
    if plan.probes[p, PROBE] == ANGLE:
        if system == ENTITY_SYSTEM:
            return True, 0.0
        return not math.isnan(axis), h - axis
    other_axis = axis_of(other, k, system, plan, roads, state, record)
    defined = not (math.isnan(axis) or math.isnan(other_axis))
    return defined, (record.h[other, k] - other_axis) - (h - axis)


@kernel
def axis_of(e, k, system, plan, roads, state, record):
    """Return the heading of an entity's path, or of the reference line of its road [rad].

    0 in other systems; NaN where it has none: off the paths, or off the lanes.
    """
    path = state.on[e]
    if system not in (PATH_SYSTEM, ROAD_SYSTEM):
        return 0.0
    if path < 0 or (system == ROAD_SYSTEM and roads.span_counts[path] == 0):
        return math.nan
    table, n, ds = roads.paths[path], roads.counts[path], roads.steps[path]
    s, _ = project(table, n, ds, state.station[e], record.x[e, k], record.y[e, k])
    h = pose(table, n, ds, s)[2]
    if system == PATH_SYSTEM:
        return h
    spans = roads.spans[path]
    i = span_at(spans, roads.span_counts[path], s)
    way = roads.nodes[int(spans[i, NODE]), WAY]
    length = spans[i, LEAVE] - spans[i, STATION]
    slope = way * (spans[i, T_LEAVE] - spans[i, T]) / length if length > 0.0 else 0.0
    return h - elementary.asin(min(max(slope, -1.0), 1.0)) - (0.0 if way > 0 else math.pi)


@kernel
def accelerations(e, k, plan, roads, state, record):
    """Return an entity's acceleration forward and to its left [m/s²], over the last step."""
    if k == 0:
        return 0.0, 0.0
    turn = (record.h[e, k] - record.h[e, k - 1]) / plan.dt
    return record.a[e, k - 1], record.v[e, k] * turn
