"""Commanded positions and paths of entities: teleports, routes, and timed trajectories.

A trajectory's timetable is ``(V, 10)`` float64, a row per segment with the columns below.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import inlined_kernel, kernel
from bridgegen.simulation.embedded._codes import ACQUIRE, DETAIL, DOES, ROW, TARGET, WHOM
from bridgegen.simulation.embedded._memory_kernels import NO_WAY, STOPS
from bridgegen.simulation.embedded._motion_kernels import standing
from bridgegen.simulation.embedded.places._lane_kernels import continued, station_of
from bridgegen.simulation.embedded.places._place_kernels import (
    LANES,
    ask,
    body_pose,
    end_follow,
    end_lateral,
    fail,
    node_under,
    pose_of,
    put,
    put_in_world,
    way_from,
)

BEGINS, ENDS_AT, X, Y, X_END, Y_END, H, H_END, PASSED, PASSED_END = range(10)
"""Columns of a segment: begin and end [s]; x, y [m] of both; the headings [rad]; metres
travelled."""

# The way to a position may lead along a lane beside it. esmini's action is over at once.
ABREAST = 5.0  # m, a position is passed so far aside at most
NEAR = 0.1  # m, within which an entity has reached a position
SAME_TIME = 1e-9  # s, an instant this close to a vertex's is the vertex's


@kernel
def begin_teleport(j, k, plan, roads, state, record):
    """Begin, and end, action j, a TeleportAction: the entity is there at the next instant."""
    e = plan.actions[j, WHOM]
    end_lateral(e, state)
    end_follow(e, state)
    put(e, plan.actions[j, ROW], k, plan, roads, state, record)
    state.placed[e] = True
    for w in range(plan.tows.shape[0]):  # its trailers go with it
        t, towed = plan.tows[w, 0], plan.tows[w, 1]
        if state.tower[towed] == t and (t == e or state.straight[t]):
            state.straight[towed] = True
    state.action_ended[j] = True


@kernel
def begin_route(j, k, plan, roads, state, record):
    """Begin action j: the entity follows a route from where it is.

    An AssignRouteAction is over at once, an AcquirePositionAction when it is there.
    """
    e, route = plan.actions[j, WHOM], plan.actions[j, ROW]
    if roads.nodes.shape[0] == 0:
        ask(0, LANES, state)
        return
    node, s, _ = node_under(e, roads, state)
    if node >= 0:
        p = roads.ways[route, node]
        if p == -2:
            fail(NO_WAY, state)
            return
        p = way_from(route, node, roads, state)
        if p < 0:
            return
        state.on[e] = p
        state.station[e] = station_of(roads.spans[p], roads.span_counts[p], node, s)
    state.route[e] = route
    end_quest(e, state)
    if plan.actions[j, DOES] == ACQUIRE:
        state.goal[e, 0], state.goal[e, 1], _ = pose_of(
            plan.actions[j, DETAIL], k, plan, roads, state, record
        )
        state.goal_action[e] = j
    else:
        state.action_ended[j] = True


@kernel
def end_quest(e, state):
    """End the action that sends an entity to a position, if any."""
    if state.goal_action[e] >= 0:
        state.action_ended[state.goal_action[e]] = True
    state.goal_action[e] = -1


@kernel
def stop_route(j, plan, state):
    """Stop action j, an AcquirePositionAction: the entity keeps its route."""
    if state.goal_action[plan.actions[j, WHOM]] == j:
        state.goal_action[plan.actions[j, WHOM]] = -1


@inlined_kernel
def arrive(k, plan, state, record):
    """End the actions that send entities to positions which they pass, or stand at, at instant k.

    Also to one abreast of them: the way there may lead along a lane beside it.
    """
    for e in range(record.x.shape[0]):
        if state.goal_action[e] < 0:
            continue
        c, s = elementary.cos(record.h[e, k]), elementary.sin(record.h[e, k])
        dx, dy = state.goal[e, 0] - record.x[e, k], state.goal[e, 1] - record.y[e, k]
        ahead, aside = c * dx + s * dy, c * dy - s * dx
        if abs(aside) <= ABREAST and -record.v[e, k] * plan.dt - NEAR <= ahead <= NEAR:
            end_quest(e, state)


@kernel
def begin_follow(j, k, plan, roads, state, record):
    """Begin action j, a FollowTrajectoryAction."""
    e, m = plan.actions[j, WHOM], plan.actions[j, ROW]
    end_lateral(e, state)
    end_follow(e, state)
    end_quest(e, state)
    state.on[e], state.aside[e], state.turn[e] = plan.trajectories[m], 0.0, 0.0
    state.station[e] = state.slots[plan.actions[j, TARGET]]
    state.follow_action[e] = j
    state.follow[e] = m if roads.timetable_counts[m] > 0 else -1
    state.follow_began[e] = k * plan.dt if plan.actions[j, DETAIL] else 0.0


@kernel
def stop_follow(j, k, plan, roads, state, record):
    """Stop action j, a FollowTrajectoryAction: the entity continues along the lane where it is."""
    e = plan.actions[j, WHOM]
    if state.follow_action[e] == j:
        state.follow_action[e] = state.follow[e] = -1
        state.laid_count[e] = 0
        state.tail_first[e] = False
        put_in_world(e, record.x[e, k], record.y[e, k], record.h[e, k], roads, state)


@kernel
def at_time(table, n, t):
    """Return (x, y, heading, speed, metres travelled) by a timetable at a time."""
    i = 0
    # An instant is k·dt, which in binary is not the decimal time that a vertex states.
    while i < n - 1 and table[i, ENDS_AT] < t - SAME_TIME:
        i += 1
    row = table[i]
    span = row[ENDS_AT] - row[BEGINS]
    u = min(max((t - row[BEGINS]) / span, 0.0), 1.0)
    metres = row[PASSED_END] - row[PASSED]
    if abs(t - row[ENDS_AT]) <= SAME_TIME or u == 1.0:  # start + 1·way may miss the end by a bit
        return row[X_END], row[Y_END], row[H_END], metres / span, row[PASSED_END]
    v = metres / span if t >= row[BEGINS] - SAME_TIME else 0.0
    return (
        row[X] + u * (row[X_END] - row[X]),
        row[Y] + u * (row[Y_END] - row[Y]),
        row[H] + u * (row[H_END] - row[H]),
        v,
        row[PASSED] + u * metres,
    )


@kernel
def move_by_timetable(e, k, plan, roads, state, record):
    """Move an entity from instant k to its trajectory's next position.

    After the end it continues along the lane where it is, at its speed.
    """
    m, t = state.follow[e], (k + 1) * plan.dt - state.follow_began[e]
    table, n = roads.timetables[m], roads.timetable_counts[m]
    x, y, h, v, station = at_time(table, n, t)
    state.travelled[e] += station - state.station[e]
    state.station[e] = station
    state.stood[e] = standing(state.stood[e], record.v[e, k], v, plan.dt)
    # Where a speed action meets a timetable, the timetable moves the entity; the action's speed
    # counts from its end on.
    if state.speed_action[e] < 0:
        state.command[e] = state.target[e] = v
    record.a[e, k] = (v - record.v[e, k]) / plan.dt
    beyond = t - table[n - 1, ENDS_AT]
    over = k == record.x.shape[1] - 1 or state.ending[STOPS] != 0
    if beyond > SAME_TIME and over:  # the file does not define what follows
        record.a[e, k] = record.a[e, k - 1] if k > 0 else 0.0
        return
    if beyond > SAME_TIME:
        end_follow(e, state)
        put_in_world(e, x, y, h, roads, state)
        state.station[e] += v * beyond
        state.travelled[e] += v * beyond
        x, y, h = body_pose(e, roads, state)
    if over:
        return
    record.x[e, k + 1], record.y[e, k + 1], record.v[e, k + 1] = x, y, v
    record.h[e, k + 1] = continued(h, record.h[e, k])
    record.offset[e, k + 1] = 0.0
