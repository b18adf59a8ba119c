"""How actions across the road begin: to which lane, or how far aside of it.

``plan.laterals`` has a row per such action with the columns below.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel
from bridgegen.drivers._attentive_kernels import gap_is_free
from bridgegen.drivers._conflict_kernels import LEAST_PACE
from bridgegen.drivers._path_kernels import project
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.drivers.drivers import SCRIPTED
from bridgegen.simulation.embedded._codes import DIMENSION, LASTS, ROW, SHAPE, TARGET, WHOM
from bridgegen.simulation.embedded._memory_kernels import NO_LANE
from bridgegen.simulation.embedded._motion_kernels import DISTANCE, nearest
from bridgegen.simulation.embedded.motion._lateral_kernels import (
    lane_change_lasts,
    least_length,
    offset_lasts,
)
from bridgegen.simulation.embedded.places._lane_kernels import (
    LANE,
    T_LEAVE,
    WAY,
    T,
    along,
    beside,
    find_lane,
    nearest_lane,
    span_at,
    station_of,
)
from bridgegen.simulation.embedded.places._place_kernels import (
    GROUND,
    LANES,
    ask,
    end_follow,
    end_lateral,
    fail,
    node_under,
    put_in_world,
    way_from,
)

OF, COUNT, CONTINUOUS = 0, 1, 2
"""The entity whose lane or offset counts, -1: none; the lane's id, or how many lanes it lies to
the left; whether the offset is kept until another action moves the entity across."""


@kernel
def stop_lateral(j, plan, state):
    """Stop action j, which moves an entity laterally: it keeps its offset."""
    e = plan.actions[j, WHOM]
    if state.lateral_action[e] == j:
        state.lateral_action[e] = state.to[e] = -1
    if state.waits[e] == j:
        state.waits[e] = -1


@kernel
def take_lane(e, k, roads, state, record):
    """Return (node, s, t) of the lane that an entity is on; it follows no trajectory any more.

    Node -1: it is on none, or the lanes are not known yet; the row ends.
    """
    if roads.nodes.shape[0] == 0:
        ask(0, LANES, state)
        return -1, 0.0, 0.0
    end_follow(e, state)
    if state.on[e] < 0 or roads.span_counts[state.on[e]] == 0:
        put_in_world(e, record.x[e, k], record.y[e, k], record.h[e, k], roads, state)
    node, s, t = node_under(e, roads, state)
    if node < 0:
        fail(NO_LANE, state)
    return node, s, t


@kernel
def _lane_of(e, k, roads, state, record):
    """Return (node, t) of the lane that another entity is on, as ``take_lane``."""
    node, _, t = node_under(e, roads, state)
    if node >= 0:
        return node, t
    x, y = record.x[e, k], record.y[e, k]
    if roads.ground.shape[0] == 0:
        ask(0, GROUND, state)
        return -1, 0.0
    node = nearest_lane(roads.ground, roads.ground_nodes, x, y, record.h[e, k])
    if node < 0:
        fail(NO_LANE, state)
        return -1, 0.0
    p = way_from(0, node, roads, state)
    if p < 0:
        return -1, 0.0
    path, n, ds = roads.paths[p], roads.counts[p], roads.steps[p]
    station, aside = project(path, n, ds, nearest(path, n, ds, x, y), x, y)
    i = span_at(roads.spans[p], roads.span_counts[p], station)
    return node, along(roads.spans[p], i, station, T, T_LEAVE) + roads.nodes[node, WAY] * aside


@kernel
def begin_lane_change(j, k, plan, roads, state, record):
    """Begin action j, a LaneChangeAction: onto the other lane's way, still aside of it.

    An attentive driver waits until the gap there is free.
    """
    e, row = plan.actions[j, WHOM], plan.laterals[plan.actions[j, ROW]]
    node, s, _ = take_lane(e, k, roads, state, record)
    if node < 0:
        return
    lane = row[COUNT]
    if row[OF] >= 0:
        other = node
        if row[OF] != e:
            other, _ = _lane_of(row[OF], k, roads, state, record)
            if other < 0:
                return
        lane = beside(roads.nodes[other, LANE], row[COUNT] * roads.nodes[other, WAY])
    way = roads.nodes[node, WAY]
    target = find_lane(roads.nodes, node, lane, way)
    if target < 0:
        fail(NO_LANE, state)
        return
    p = way_from(state.route[e], target, roads, state)
    if p < 0:
        return
    station = station_of(roads.spans[p], roads.span_counts[p], target, s)
    if plan.attends and plan.others[e] != SCRIPTED:
        if _waits(j, k, p, station, way, plan, roads, state, record):
            return
        state.waits[e] = -1
    left, left_at = state.on[e], state.station[e]
    end_lateral(e, state)
    state.on[e], state.turn[e] = p, 0.0
    state.station[e], state.aside[e] = project(
        roads.paths[p], roads.counts[p], roads.steps[p], station, record.x[e, k], record.y[e, k]
    )
    # While it changes, both ways are known to those who predict it: the one that it is on, and the
    # one that it leaves.
    if target != node:
        state.to[e], state.foot[e] = left, left_at
    offset = way * state.slots[plan.actions[j, TARGET]]
    value = state.slots[plan.actions[j, LASTS]]
    metres = offset - state.aside[e]
    state.lateral_action[e] = j
    state.lateral_lasts[e] = lane_change_lasts(
        plan.actions[j, SHAPE], plan.actions[j, DIMENSION], value, metres
    )
    if plan.actions[j, DIMENSION] == DISTANCE and state.lateral_lasts[e] > 0.0:
        least = least_length(plan.actions[j, SHAPE], plan.bodies[e, 6], metres)
        state.lateral_lasts[e] = max(state.lateral_lasts[e], least)
    state.lateral_passed[e] = 0.0
    state.lateral_origin[e], state.lateral_target[e] = state.aside[e], offset


@kernel
def _waits(j, k, p, station, way, plan, roads, state, record):
    """Return whether action j, a change to the lane of path p, waits for a gap; then it is noted.

    The entity is about abreast of ``station`` of that path, whose lane goes ``way`` along its road.
    """
    e, path, n, ds = plan.actions[j, WHOM], roads.paths[p], roads.counts[p], roads.steps[p]
    s, aside = project(path, n, ds, station, record.x[e, k], record.y[e, k])
    target = way * state.slots[plan.actions[j, TARGET]]
    lasts = lane_change_lasts(
        plan.actions[j, SHAPE],
        plan.actions[j, DIMENSION],
        state.slots[plan.actions[j, LASTS]],
        target - aside,
    )
    if plan.actions[j, DIMENSION] == DISTANCE:
        lasts /= max(record.v[e, k], LEAST_PACE)
    if gap_is_free(
        e, k, path, n, ds, s, target, lasts, state.weather[FRICTION], state.minded, record.x,
        record.y, record.h, record.v, plan.bodies,
    ):  # fmt: skip
        return False
    if state.waits[e] >= 0 and state.waits[e] != j:
        state.action_ended[state.waits[e]] = True
    state.waits[e] = j
    return True


@kernel
def begin_lane_offset(j, k, plan, roads, state, record):
    """Begin action j, a LaneOffsetAction; an offset counts to the left of the reference line."""
    e, row = plan.actions[j, WHOM], plan.laterals[plan.actions[j, ROW]]
    node, _, t = take_lane(e, k, roads, state, record)
    if node < 0:
        return
    way, value = roads.nodes[node, WAY], state.slots[plan.actions[j, TARGET]]
    target = way * value
    if row[OF] >= 0:  # relative to another entity
        other, its_t = _lane_of(row[OF], k, roads, state, record)
        if other < 0:
            return
        centre = t - way * state.aside[e]
        target = way * (its_t + roads.nodes[other, WAY] * value - centre)
    end_lateral(e, state)
    state.turn[e] = 0.0
    state.lateral_action[e] = j
    most = state.slots[plan.actions[j, LASTS]]
    state.lateral_lasts[e] = offset_lasts(plan.actions[j, SHAPE], most, target - state.aside[e])
    state.lateral_passed[e] = 0.0
    state.lateral_origin[e], state.lateral_target[e] = state.aside[e], target
