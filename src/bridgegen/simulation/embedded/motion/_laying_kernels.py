"""Trajectories that are laid when they begin: their vertices depend on the row, or on entities.

A body on one is on no path: its line is where it is now. The rows of ``state.laid`` are segments as
of a timetable (``_follow_kernels``), for those without times, too.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.simulation.embedded._codes import (
    ALONG,
    DETAIL,
    FIRST_ANCHOR,
    FIRST_SAMPLE,
    IS_TIMED,
    LAYOUT,
    LAYOUT_OFFSET,
    LAYOUT_SCALE,
    LAYOUT_SHAPE,
    PAST_ANCHOR,
    PAST_SAMPLE,
    RIGID,
    ROW,
    TARGET,
    THROUGH,
    WEIGHTED,
    WHOM,
)
from bridgegen.simulation.embedded._memory_kernels import BAD_TIMES, NO_PLACE, STOPS
from bridgegen.simulation.embedded._motion_kernels import standing
from bridgegen.simulation.embedded.motion._follow_kernels import (
    BEGINS,
    ENDS_AT,
    H_END,
    PASSED,
    PASSED_END,
    X_END,
    Y_END,
    H,
    X,
    Y,
    at_time,
    end_quest,
)
from bridgegen.simulation.embedded.places._lane_kernels import continued, turned
from bridgegen.simulation.embedded.places._place_kernels import (
    body_pose,
    end_follow,
    end_lateral,
    fail,
    pose_of,
    put_in_world,
    way_along,
)

PLACE, TIME, STATES = 0, 1, 2
"""Columns of ``plan.anchors``: a position, the slot of a time, whether it states a heading."""

ANCHOR = 4
"""Column of ``plan.shapes`` in a rigid layout: the anchor in whose frame a vertex is."""

SHORTEST = 1e-9  # m, a shorter segment has no direction
ABREAST = 5.0  # m, a place is passed so far aside at most


@kernel
def begin_laid(j, k, plan, roads, state, record):
    """Begin action j, a FollowTrajectoryAction whose trajectory is laid now."""
    e, q = plan.actions[j, WHOM], plan.actions[j, ROW]
    end_lateral(e, state)
    end_follow(e, state)
    end_quest(e, state)
    lay(q, e, k, plan, roads, state, record)
    if state.ending[STOPS]:
        return
    state.follow_action[e] = j
    state.follow[e] = 0 if plan.layouts[q, IS_TIMED] else -1
    state.follow_began[e] = k * plan.dt if plan.actions[j, DETAIL] else 0.0
    state.passed[e] = state.slots[plan.actions[j, TARGET]]
    stand_at(e, record.x[e, k], record.y[e, k], record.h[e, k], state)
    for i in range(plan.initial.shape[0]):
        if plan.initial[i] == j:
            start_on_laid(e, state, record)


@kernel
def stand_at(e, x, y, h, state):
    """Take an entity off all paths: it is at a pose."""
    state.on[e], state.to[e] = -1, -1
    state.station[e] = state.aside[e] = state.turn[e] = 0.0
    state.line[e, 0], state.line[e, 1], state.line[e, 2] = x, y, h


@kernel
def lay(q, e, k, plan, roads, state, record):
    """Write the segments of a trajectory for an entity, by where all are at instant k."""
    row, table = plan.layouts[q], state.laid[e]
    first, past = row[FIRST_ANCHOR], row[PAST_ANCHOR]
    samples, n = row[FIRST_SAMPLE], row[PAST_SAMPLE] - row[FIRST_SAMPLE]
    scale, offset = state.slots[row[LAYOUT_SCALE]], state.slots[row[LAYOUT_OFFSET]]
    if row[LAYOUT_SHAPE] == THROUGH:
        n = past - first
    for i in range(n):  # the vertices, into the columns of where segments end
        table[i, X_END] = table[i, Y_END] = 0.0
        table[i, H_END], table[i, ENDS_AT] = math.nan, 0.0
    for i in range(first, past):
        x, y, h = pose_of(plan.anchors[i, PLACE], k, plan, roads, state, record)
        if math.isnan(x):
            fail(NO_PLACE, state)
            return
        if row[LAYOUT_SHAPE] == THROUGH:
            table[i - first, X_END], table[i - first, Y_END] = x, y
            if plan.anchors[i, STATES]:
                table[i - first, H_END] = h
            if row[IS_TIMED]:
                table[i - first, ENDS_AT] = scale * state.slots[plan.anchors[i, TIME]] + offset
        elif row[LAYOUT_SHAPE] == RIGID:
            c, s = elementary.cos(h), elementary.sin(h)
            for m in range(n):
                if plan.shapes[samples + m, ANCHOR] != i - first:
                    continue
                u, w = plan.shapes[samples + m, 0], plan.shapes[samples + m, 1]
                table[m, X_END], table[m, Y_END] = x + c * u - s * w, y + s * u + c * w
                table[m, H_END] = h + plan.shapes[samples + m, 2]
                table[m, ENDS_AT] = scale * plan.shapes[samples + m, 3] + offset
        else:
            for m in range(n):
                weight = plan.shapes[samples + m, i - first]
                table[m, X_END] += weight * x
                table[m, Y_END] += weight * y
                if row[IS_TIMED]:
                    time = scale * state.slots[plan.anchors[i, TIME]] + offset
                    table[m, ENDS_AT] += weight * time
    for m in range(n if row[LAYOUT_SHAPE] == WEIGHTED else 0):  # of a curve, its tangent
        i, following = max(m - 1, 0), min(m + 1, n - 1)
        dx = table[following, X_END] - table[i, X_END]
        table[m, H_END] = elementary.atan2(table[following, Y_END] - table[i, Y_END], dx)
    _join(e, n, row[IS_TIMED], state)


@kernel
def _join(e, n, is_timed, state):
    """Make segments of n vertices: row i is then the segment from vertex i to vertex i + 1."""
    table, passed = state.laid[e], 0.0
    direction = table[0, H_END] if not math.isnan(table[0, H_END]) else 0.0
    for i in range(n - 1):
        x, y, h = table[i, X_END], table[i, Y_END], table[i, H_END]
        x_end, y_end, h_end = table[i + 1, X_END], table[i + 1, Y_END], table[i + 1, H_END]
        length = elementary.hypot(x_end - x, y_end - y)
        if length > SHORTEST:
            direction = elementary.atan2(y_end - y, x_end - x)
        if math.isnan(h) or math.isnan(h_end):
            h = h_end = direction
        if is_timed and not table[i + 1, ENDS_AT] > table[i, ENDS_AT]:
            fail(BAD_TIMES, state)
            return
        table[i, BEGINS], table[i, X], table[i, Y], table[i, H] = table[i, ENDS_AT], x, y, h
        table[i, PASSED], table[i, PASSED_END] = passed, passed + length
        passed += length
    for i in range(n - 1):  # what ends a segment stood a row before
        table[i, ENDS_AT] = table[i + 1, ENDS_AT]
        table[i, X_END], table[i, Y_END] = table[i + 1, X_END], table[i + 1, Y_END]
        h_end = table[i + 1, H_END]
        h = table[i, H]
        stated = not (math.isnan(table[i, H_END]) or math.isnan(h_end))
        table[i, H_END] = h + turned(h_end, h) if stated else h
    state.laid_count[e] = n - 1


@kernel
def at_distance(table, n, s):
    """Return (x, y, heading) so far along n segments [m]."""
    i = 0
    while i < n - 1 and table[i, PASSED_END] < s:
        i += 1
    row = table[i]
    length = row[PASSED_END] - row[PASSED]
    u = min(max((s - row[PASSED]) / length, 0.0), 1.0) if length > 0.0 else 1.0
    return (
        row[X] + u * (row[X_END] - row[X]),
        row[Y] + u * (row[Y_END] - row[Y]),
        row[H] + u * (row[H_END] - row[H]),
    )


@kernel
def start_on_laid(e, state, record):
    """Put an entity that follows a laid trajectory from the start on where it begins."""
    table, n = state.laid[e], state.laid_count[e]
    if n == 0:
        return
    if state.follow[e] >= 0:
        x, y, h, v, passed = at_time(table, n, -state.follow_began[e])
        record.v[e, 0] = state.command[e] = state.target[e] = v
        state.passed[e] = passed
    else:
        x, y, h = at_distance(table, n, state.passed[e])
        if record.v[e, 0] < 0.0 and state.passed[e] <= 0.0:
            state.tail_first[e] = True
            h += math.pi
    stand_at(e, x, y, h, state)
    record.x[e, 0], record.y[e, 0], record.h[e, 0] = x, y, h


@kernel
def move_laid(e, k, plan, roads, state, record):
    """Move an entity on from instant k along a laid trajectory: by its times, or at its speed.

    After the end it continues along the lane that is there, at its speed.
    """
    table, n, dt, before = state.laid[e], state.laid_count[e], plan.dt, record.v[e, k]
    t, length = (k + 1) * dt - state.follow_began[e], table[n - 1, PASSED_END]
    if state.follow[e] >= 0:
        x, y, h, v, passed = at_time(table, n, t)
        beyond = max(t - table[n - 1, ENDS_AT], 0.0) * v
        step = passed - state.passed[e] + beyond
        if state.speed_action[e] < 0:
            state.command[e] = state.target[e] = v
        ends = t - table[n - 1, ENDS_AT] > 1e-9
    else:
        v = state.command[e]
        mean = state.mean[e] if state.mean[e] >= 0.0 else 0.5 * (before + v)
        step = 0.0 if state.placed[e] else way_along(e, mean * dt, state.passed[e], state)
        state.placed[e] = False
        passed = state.passed[e] + step
        beyond = math.copysign(max(passed - length, -passed, 0.0), v)
        ends = passed >= length or passed < 0.0
        x, y, h = at_distance(table, n, passed)
        if state.tail_first[e]:
            h += math.pi
    state.travelled[e] += abs(step)
    state.passed[e] = passed
    state.stood[e] = standing(state.stood[e], before, v, dt)
    record.a[e, k] = (v - before) / dt
    over = k == record.x.shape[1] - 1 or state.ending[STOPS] != 0
    if ends and over:  # the file does not define what follows
        record.a[e, k] = record.a[e, k - 1] if k > 0 else 0.0
        return
    stand_at(e, x, y, h, state)
    # It goes on at its speed: no body stops within a step. In esmini it stands at once, from 20
    # m/s.
    if ends:
        end_follow(e, state)
        put_in_world(e, x, y, h, roads, state)
        state.station[e] += beyond
        x, y, h = body_pose(e, roads, state)
    if over:
        return
    record.x[e, k + 1], record.y[e, k + 1], record.v[e, k + 1] = x, y, v
    record.h[e, k + 1] = continued(h, record.h[e, k])
    record.offset[e, k + 1] = 0.0


@kernel
def pose_along(c, k, plan, roads, state, record):
    """Write the pose so far along a trajectory to ``state.pose``; at its end if it is shorter.

    NaN where one of its vertices is no place.
    """
    row, s = plan.layouts[plan.places[c, LAYOUT]], state.slots[plan.places[c, ALONG]]
    first, past = row[FIRST_ANCHOR], row[PAST_ANCHOR]
    x, y, h = pose_of(plan.anchors[first, PLACE], k, plan, roads, state, record)
    rigid = row[LAYOUT_SHAPE] == RIGID
    count = row[PAST_SAMPLE] - row[FIRST_SAMPLE] if rigid else past - first
    passed, at_x, at_y, turn = 0.0, x, y, h
    sine, cosine = elementary.sin(h), elementary.cos(h)
    for i in range(1, count):
        if rigid:
            u, w = plan.shapes[row[FIRST_SAMPLE] + i, 0], plan.shapes[row[FIRST_SAMPLE] + i, 1]
            x_end, y_end = x + cosine * u - sine * w, y + sine * u + cosine * w
        else:
            x_end, y_end, _ = pose_of(plan.anchors[first + i, PLACE], k, plan, roads, state, record)
        length = elementary.hypot(x_end - at_x, y_end - at_y)
        if length > SHORTEST:
            turn = elementary.atan2(y_end - at_y, x_end - at_x)
        if passed + length >= s and length > SHORTEST:
            share = max(s - passed, 0.0) / length
            at_x, at_y = at_x + share * (x_end - at_x), at_y + share * (y_end - at_y)
            break
        passed, at_x, at_y = passed + length, x_end, y_end
    state.pose[0], state.pose[1], state.pose[2] = at_x, at_y, turn


@kernel
def left_on_laid(e, k, x, y, state, record):
    """Return how far it is to a place along an entity's laid trajectory [m]; NaN: it is aside."""
    table, n = state.laid[e], state.laid_count[e]
    best, foot, own, nearest = ABREAST, math.nan, math.nan, math.inf
    for i in range(n):
        length = table[i, PASSED_END] - table[i, PASSED]
        if length <= SHORTEST:
            continue
        c, s = (table[i, X_END] - table[i, X]) / length, (table[i, Y_END] - table[i, Y]) / length
        along = min(max((x - table[i, X]) * c + (y - table[i, Y]) * s, 0.0), length)
        gap = elementary.hypot(x - table[i, X] - along * c, y - table[i, Y] - along * s)
        if gap < best:
            best, foot = gap, table[i, PASSED] + along
        px, py = record.x[e, k] - table[i, X], record.y[e, k] - table[i, Y]
        along = min(max(px * c + py * s, 0.0), length)
        gap = elementary.hypot(px - along * c, py - along * s)
        if gap < nearest:
            nearest, own = gap, table[i, PASSED] + along
    return foot - own
