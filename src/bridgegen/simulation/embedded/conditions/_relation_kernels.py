"""What is asked for seldom: relative speeds, accelerations, angles, contacts, distances to places.

One function, for the code of all instants would grow by it.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import pose, project
from bridgegen.simulation.embedded._codes import (
    ACCELERATING,
    ANGLE,
    CLEARANCE,
    CLOSELY,
    COLLISION,
    COLLISION_WITH_TYPE,
    DISTANCE,
    END_OF_ROAD,
    ENTITY_SYSTEM,
    EQUAL,
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
    OTHER,
    PATH_SYSTEM,
    PROBE,
    RELATIVE_ANGLE,
    ROAD_SYSTEM,
    RULE,
    SPEED_DIFFERENCE,
    SYSTEM,
    TIME_OF_DAY,
    TOTAL,
    VALUE,
    WHO,
    WITHIN,
)
from bridgegen.simulation.embedded.conditions._clearance_kernels import find_cell, is_clear
from bridgegen.simulation.embedded.conditions._distance_kernels import (
    apart,
    look_ahead,
)
from bridgegen.simulation.embedded.places._lane_kernels import (
    LEAVE,
    NODE,
    STATION,
    T_LEAVE,
    WAY,
    T,
    span_at,
    turned,
)
from bridgegen.simulation.embedded.world import time_of_day

AT_END = 1e-6  # m
SAME_TIME = 1e-6  # s, the rounding of a date
SAME_VALUE = 1e-9  # of any unit, the rounding of what is summed up step by step
SAME_ANGLE = 1e-9  # rad, the rounding of a turn


@kernel
def compare(value, rule, limit):
    """Apply an OpenSCENARIO Rule; what is the limit up to rounding is the limit."""
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
        on_road = find_cell(roads.cells, 0, record.x[e, k], record.y[e, k]) >= 0
        return lasts(p, k, not on_road, limit, plan, roads, state, record)
    if kind == CLEARANCE:
        return is_clear(p, k, plan, roads, state, record)
    if kind == SPEED_DIFFERENCE:
        turn = record.h[other, k] - record.h[e, k]
        along, aside = record.v[other, k] * math.cos(turn), record.v[other, k] * math.sin(turn)
        if measure == TOTAL:
            return compare(record.v[e, k] - record.v[other, k], rule, limit)
        if measure == LONGITUDINAL:
            return compare(record.v[e, k] - along, rule, limit)
        return compare(-aside if measure == LATERAL else 0.0, rule, limit)
    if kind == ACCELERATING:
        along, aside = accelerations(e, k, plan, roads, state, record)
        if measure == TOTAL:
            return compare(math.hypot(along, aside), rule, limit)
        if measure == LONGITUDINAL:
            return compare(along, rule, limit)
        return compare(aside if measure == LATERAL else 0.0, rule, limit)
    return compare(record.v[e, k] if measure == LONGITUDINAL else 0.0, rule, limit)  # SPEED


@kernel
def touch(e, other, k, plan, roads, state, record):
    """Return whether the boxes of two entities touch."""
    return (
        apart(
            plan.bodies[e], plan.bodies[other, 0], plan.bodies[other, 1], plan.bodies[other, 2],
            record.x[other, k] - record.x[e, k], record.y[other, k] - record.y[e, k],
            record.h[e, k], record.h[other, k],
        )
        == 0.0
    )  # fmt: skip


@kernel
def lasts(p, k, seen, limit, plan, roads, state, record):
    """Return whether a probe has seen so long [s] what it sees now."""
    seen = seen and state.present[plan.probes[p, WHO]]
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
    return h - math.asin(min(max(slope, -1.0), 1.0)) - (0.0 if way > 0 else math.pi)


@kernel
def accelerations(e, k, plan, roads, state, record):
    """Return an entity's acceleration forward and to its left [m/s²], over the last step."""
    if k == 0:
        return 0.0, 0.0
    turn = (record.h[e, k] - record.h[e, k - 1]) / plan.dt
    return record.a[e, k - 1], record.v[e, k] * turn
