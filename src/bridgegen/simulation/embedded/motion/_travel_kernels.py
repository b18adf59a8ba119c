"""Motion of bodies that the storyboard moves, from one instant to the next."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import shrinks
from bridgegen.simulation.embedded._codes import DIMENSION, DOES, KEEP_ASIDE, ROW, SHAPE
from bridgegen.simulation.embedded._motion_kernels import SAME_TIME, standing
from bridgegen.simulation.embedded.motion._across_kernels import CONTINUOUS
from bridgegen.simulation.embedded.motion._aside_kernels import keep_aside
from bridgegen.simulation.embedded.motion._lateral_kernels import glide
from bridgegen.simulation.embedded.motion._presence_kernels import keep_place, leave
from bridgegen.simulation.embedded.places._lane_kernels import continued
from bridgegen.simulation.embedded.places._place_kernels import (
    LANES,
    ask,
    body_pose,
    end_follow,
    put_in_world,
    way_along,
    way_from,
)

ENDS, ASKS, LANDS = -1, -2, -3
"""Values of ``roads.follows`` for a path without a following node: the road ends; the lanes of the
road network are to be searched; a trajectory ends, on any lane that is there."""


@kernel
def move_along_path(e, k, plan, roads, state, record):
    """Move an entity on from instant k at the commanded speed, along its path and across it."""
    dt, before = plan.dt, record.v[e, k]
    mean = state.mean[e] if state.mean[e] >= 0.0 else 0.5 * (before + state.command[e])
    # A teleport is seen at the next instant, without motion between, as in esmini.
    step = 0.0 if state.placed[e] else mean * dt
    state.placed[e] = False
    if (step < 0.0 or state.tail_first[e]) and is_on_trajectory(e, roads, state):
        step = way_along(e, step, state.station[e], state)
        state.turn[e] = math.pi if state.tail_first[e] else 0.0
    ahead, tilt, reached, aside = step, 0.0, False, state.aside[e]
    j = state.lateral_action[e]
    keeps_aside = j >= 0 and plan.actions[j, DOES] == KEEP_ASIDE
    if keeps_aside:
        ahead, tilt, reached = keep_aside(j, k, step, plan, roads, state, record)
    elif j >= 0:
        state.aside[e], ahead, state.lateral_passed[e], tilt = glide(
            plan.actions[j, SHAPE],
            plan.actions[j, DIMENSION],
            state.lateral_lasts[e],
            state.lateral_passed[e],
            state.lateral_origin[e],
            state.lateral_target[e],
            abs(step),
            dt,
            plan.bodies[e, 6],
        )
        if step < 0.0:
            ahead, tilt = -ahead, -tilt
        state.foot[e] += ahead
    p = state.on[e]
    if p >= 0:
        middle, across = state.station[e] + 0.5 * ahead, 0.5 * (aside + state.aside[e])
        # The speed is along the body's own line. Along the centre line its path was one per cent
        # longer or shorter per metre of offset in a bend of 100 m: 2 m after 7 s.
        ahead /= shrinks(roads.paths[p], roads.counts[p], roads.steps[p], middle, across)
    station = state.station[e] + ahead
    if p >= 0 and station >= (roads.counts[p] - 1) * roads.steps[p]:
        length = (roads.counts[p] - 1) * roads.steps[p]
        if pass_end(e, station - length, roads, state):
            station = state.station[e]
        # The standard leaves open what an entity does at the end of its road. To hold it there at
        # once, as esmini does, is −170 m/s² at 8.5 m/s; so it is absent from the next instant on.
        elif plan.leaves and e > 0 and ahead > 0.0 and roads.follows[p] == ENDS:
            record.a[e, k] = (state.command[e] - before) / dt
            leave(e, plan, roads, state)
            keep_place(e, k, record)
            return
        else:
            # It stands, so it has braked from ``before`` to 0 within the step.
            station, step = length, 0.5 * before * dt
            state.command[e] = state.target[e] = 0.0
    if p >= 0 and station < 0.0:  # backwards to where its way begins
        if is_on_trajectory(e, roads, state):
            station = leave_backwards(e, station, roads, state)
        else:
            station, step = 0.0, 0.5 * before * dt
            state.command[e] = state.target[e] = 0.0
    state.travelled[e] += abs(step)
    state.stood[e] = standing(state.stood[e], before, state.command[e], dt)
    record.a[e, k] = (state.command[e] - before) / dt
    state.station[e] = station
    over = state.lateral_passed[e] >= state.lateral_lasts[e] - SAME_TIME
    if not keeps_aside and j >= 0 and over:
        state.to[e] = -1
        # A continuous action does not end by itself, though nothing is left to do (1.2,
        # ``continuous``).
        reached = not plan.laterals[plan.actions[j, ROW], CONTINUOUS]
    if reached:
        state.action_ended[j] = True
        state.lateral_action[e] = -1
    if k == record.x.shape[1] - 1:
        return
    record.v[e, k + 1] = state.command[e]
    record.offset[e, k + 1] = 0.0
    record.x[e, k + 1], record.y[e, k + 1], h = body_pose(e, roads, state)
    record.h[e, k + 1] = continued(h + tilt, record.h[e, k])  # another path may count them anew


@kernel
def is_on_trajectory(e, roads, state):
    """Return whether a trajectory is the path that an entity is on."""
    p = state.on[e]
    return state.follow_action[e] >= 0 or (p >= 0 and roads.follows[p] == LANDS)


@kernel
def leave_backwards(e, station, roads, state):
    """Put an entity so far back over where its trajectory begins; return its station there."""
    beyond = math.copysign(station, state.command[e])
    state.station[e] = 0.0
    x, y, h = body_pose(e, roads, state)
    end_follow(e, state)
    put_in_world(e, x, y, h, roads, state)
    return state.station[e] + beyond


@kernel
def pass_end(e, beyond, roads, state):
    """Put an entity so far beyond the end of its path [m]; False: the road ends, or it waits."""
    follows = roads.follows[state.on[e]]
    if follows == ENDS:
        return False
    if roads.nodes.shape[0] == 0:
        ask(0, LANES, state)
        return False
    if follows == LANDS:
        end_follow(e, state)
        state.station[e] = (roads.counts[state.on[e]] - 1) * roads.steps[state.on[e]]
        x, y, h = body_pose(e, roads, state)
        put_in_world(e, x, y, h, roads, state)
        state.station[e] += beyond
        return True
    p = way_from(state.route[e], follows, roads, state)
    if p < 0:
        return False
    state.on[e], state.station[e] = p, beyond
    return True
