"""Where the storyboard leads entities: how a lane change begins, and how a body moves on."""

import math

from bridgegen.compiled import inlined_kernel
from bridgegen.ego._path_kernels import pose, project
from bridgegen.simulation.embedded._memory_kernels import NO_LANE, STATUS, STOPS
from bridgegen.simulation.embedded._motion_kernels import DISTANCE, between, nearest, shifted

REACH = 8.0  # m, a lane that is farther from a body than this is not the one beside its own


@inlined_kernel
def begin_lane_change(j, k, plan, roads, state, record):
    """Begin action j, a LaneChangeAction.

    Whoever was changing lanes goes on from where it is, on the way to the other lane.
    """
    e, q = plan.actions[j, 0], plan.actions[j, 6]
    x, y = record.x[e, k], record.y[e, k]
    if state.to[e] >= 0:
        state.action_ended[state.lane_action[e]] = True
        state.on[e], state.station[e], state.aside[e] = state.to[e], state.foot[e], 0.0
    state.to[e] = q
    state.foot[e] = nearest(roads.paths[q], roads.counts[q], roads.steps[q], x, y)
    fx, fy, _ = pose(roads.paths[q], roads.counts[q], roads.steps[q], state.foot[e])
    if math.hypot(fx - x, fy - y) > REACH:
        state.ending[STATUS], state.ending[STOPS] = NO_LANE, 1
    state.lane_action[e] = j
    state.lane_lasts[e] = max(state.slots[plan.actions[j, 5]], 1e-9)
    state.lane_began[e], state.lane_from[e] = k * plan.dt, state.travelled[e]


@inlined_kernel
def stop_lane_change(j, k, plan, roads, state, record):
    """Stop action j, a LaneChangeAction: it goes on beside the lane that it was to reach."""
    e, q = plan.actions[j, 0], state.to[plan.actions[j, 0]]
    if q < 0 or state.lane_action[e] != j:
        return
    state.station[e], state.aside[e] = project(
        roads.paths[q], roads.counts[q], roads.steps[q], state.foot[e],
        record.x[e, k], record.y[e, k],
    )  # fmt: skip
    state.on[e], state.to[e] = q, -1


@inlined_kernel
def move_along_timetable(e, k, plan, roads, state, record):
    """Move an entity on whose states are recorded beforehand."""
    if k == record.x.shape[1] - 1:
        return
    m = plan.timed[e]
    state.station[e] = roads.tracks[m, k + 1, 5]
    state.travelled[e] = state.station[e] - roads.tracks[m, 0, 5]
    state.stood[e] = state.stood[e] + plan.dt if record.v[e, k + 1] == 0.0 else 0.0


@inlined_kernel
def move_along_path(e, k, plan, roads, state, record):
    """Move an entity on from instant k, on its path or between two, at the commanded speed."""
    dt = plan.dt
    p, before = state.on[e], record.v[e, k]
    length = (roads.counts[p] - 1) * roads.steps[p]
    ahead = state.station[e] + 0.5 * (before + state.command[e]) * dt
    if ahead >= length:
        ahead = length
        state.command[e] = state.target[e] = 0.0
    step = 0.5 * (before + state.command[e]) * dt
    state.travelled[e] += step
    state.stood[e] = state.stood[e] + dt if state.command[e] == 0.0 else 0.0
    record.a[e, k] = (state.command[e] - before) / dt
    if k == record.x.shape[1] - 1:
        return
    state.station[e] = ahead
    record.v[e, k + 1] = state.command[e]
    record.offset[e, k + 1] = 0.0
    q = state.to[e]
    if q < 0:
        x, y, h = pose(roads.paths[p], roads.counts[p], roads.steps[p], ahead)
        record.x[e, k + 1], record.y[e, k + 1] = shifted(x, y, h, state.aside[e])
        record.h[e, k + 1] = h
        return
    j, lasts = state.lane_action[e], state.lane_lasts[e]
    if plan.actions[j, 3] == DISTANCE:
        u = (state.travelled[e] - state.lane_from[e]) / lasts
        per_metre = 1.0 / lasts
    else:
        u = (k * dt + dt - state.lane_began[e]) / lasts
        per_metre = 1.0 / (lasts * state.command[e]) if state.command[e] > 0.1 else 0.0
    record.x[e, k + 1], record.y[e, k + 1], record.h[e, k + 1], state.foot[e] = between(
        roads.paths[p], roads.counts[p], roads.steps[p], ahead,
        roads.paths[q], roads.counts[q], roads.steps[q], state.foot[e] + step,
        plan.actions[j, 2], u, per_metre, state.aside[e],
    )  # fmt: skip
    if u >= 1.0:
        state.on[e], state.station[e], state.to[e], state.aside[e] = q, state.foot[e], -1, 0.0
        state.action_ended[j] = True
