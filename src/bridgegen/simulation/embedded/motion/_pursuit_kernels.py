"""Speeds relative to another entity, or by a profile: their start and next command.

The formulas are in ``_course_kernels``. An entity refers to those that are moved before it as they
will be at the next instant, to all others as they are now.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import pose, project
from bridgegen.simulation.embedded._codes import (
    ACCELERATION,
    BY_BODY,
    CONTINUOUS,
    DIMENSION,
    DOES,
    EITHER_SIDE,
    FINAL,
    FINAL_DELTA,
    FINAL_SPEED,
    FINAL_VALUE,
    FIRST_ENTRY,
    FOLLOWS,
    FOOT,
    FOOT_PATH,
    FREESPACE,
    IS_FACTOR,
    IS_TIME_GAP,
    KEEP_DISTANCE,
    LASTS,
    LEFT,
    MASTER_LEFT,
    MASTER_PLACE,
    MASTER_TOLERANCE,
    MASTER_X,
    MASTER_Y,
    MOST,
    NO_FINAL,
    OWN_PLACE,
    OWN_X,
    OWN_Y,
    PAST_ENTRY,
    REF,
    RELATIVE_SPEED,
    ROW,
    SHAPE,
    SIDE,
    SIDE_TAKEN,
    SPEED_PROFILE,
    STEADY,
    STEADY_TIME,
    STEADY_VALUE,
    TARGET,
    TOLERANCE,
    UNLIMITED,
    WHOM,
)
from bridgegen.simulation.embedded._memory_kernels import OK, STATUS
from bridgegen.simulation.embedded._motion_kernels import (
    SAME_SPEED,
    SAME_TIME,
    STEP,
    nearest,
    ramped,
)
from bridgegen.simulation.embedded.motion._course_kernels import (
    change_time,
    changed,
    lay_out,
    meeting_speed,
    profile_speed,
    spring,
)
from bridgegen.simulation.embedded.motion._laying_kernels import left_on_laid
from bridgegen.simulation.embedded.places._place_kernels import body_pose, place_at, put_along

NEAR = 0.1  # m, a distance that is missed by less is reached
ASIDE = 10.0  # m, a place that is farther from a path does not lie on it
SLOW = 1e-6  # m/s, a master that is slower is not on its way


@kernel
def begin_course(j, k, plan, roads, state, record):
    """Begin action j, whose kind is one of those of ``_codes``."""
    e, kind = plan.actions[j, WHOM], plan.actions[j, DOES]
    row = plan.courses[plan.actions[j, ROW]]
    state.origin[e], state.speed_began[e] = state.command[e], k * plan.dt
    if kind == RELATIVE_SPEED:
        before, after = state.command[e], _wanted(j, e, record.v[row[REF], k], plan, state)
        most = plan.bodies[e, 4] if after > before else plan.bodies[e, 5]
        value = state.slots[plan.actions[j, LASTS]]
        state.speed_lasts[e] = change_time(
            plan.actions[j, SHAPE], plan.actions[j, DIMENSION], value, before, after, most
        )
    elif kind == SPEED_PROFILE:
        # The other's speed as the profile begins; the standard leaves that open.
        base = record.v[row[REF], k] if row[REF] >= 0 else 0.0
        n = row[PAST_ENTRY] - row[FIRST_ENTRY]
        speeds, times = np.empty(n), np.empty(n)
        for i in range(n):
            speed, time = plan.entries[row[FIRST_ENTRY] + i]
            speeds[i] = base + state.slots[speed]
            times[i] = state.slots[time] if time >= 0 else math.nan
        before = record.v[e, k]
        acceleration = (before - record.v[e, k - 1]) / plan.dt if k > 0 else 0.0
        state.profile_rows[e] = lay_out(
            before,
            acceleration,
            speeds,
            times,
            n,
            row[FOLLOWS],
            _limits(row, e, plan, state),
            state.profile[e],
        )
    elif kind == KEEP_DISTANCE:
        if not row[BY_BODY] and state.on[e] < 0:  # it is carried along the other's lane
            x, y, h = record.x[e, k], record.y[e, k], record.h[e, k]
            put_along(e, x, y, h, record.h[row[REF], k], roads, state)
        state.course[e, FOOT_PATH] = -1.0
        side = row[SIDE]
        if side == EITHER_SIDE:
            side = 1 if _ahead(e, row, k, k, plan, roads, state, record) >= 0.0 else -1
        state.course[e, SIDE_TAKEN] = side
        state.course[e, ACCELERATION] = 0.0
    else:
        state.course[e, OWN_X], state.course[e, OWN_Y] = place_at(
            row[OWN_PLACE], k, plan, roads, state, record
        )
        state.course[e, MASTER_X], state.course[e, MASTER_Y] = place_at(
            row[MASTER_PLACE], k, plan, roads, state, record
        )
        state.course[e, LEFT] = state.course[e, MASTER_LEFT] = math.inf


@kernel
def start_at_speed(j, plan, state, record):
    """Let an entity start at the speed that action j, a SpeedAction, sets at once by another's."""
    e = plan.actions[j, WHOM]
    v = _wanted(j, e, record.v[plan.courses[plan.actions[j, ROW], REF], 0], plan, state)
    state.command[e] = state.target[e] = record.v[e, 0] = v


@kernel
def start_at_distance(j, plan, roads, state, record):
    """Let an entity start at the distance that action j keeps without limits, and at that speed."""
    e, row = plan.actions[j, WHOM], plan.courses[plan.actions[j, ROW]]
    if row[UNLIMITED] and e > 0 and state.ending[STATUS] == OK:
        way = _behind_its_place(j, e, 0, 0, plan, roads, state, record)
        state.station[e] = max(state.station[e] + way, 0.0)
        v = min(record.v[row[REF], 0], plan.bodies[e, 3])
        state.command[e] = state.target[e] = record.v[e, 0] = v
        record.x[e, 0], record.y[e, 0], record.h[e, 0] = body_pose(e, roads, state)


@kernel
def follow_course(j, k, plan, roads, state, record):
    """Set the speed that action j commands for the instant after k; return whether it is over."""
    if state.ending[STATUS] != OK:  # its places are not known: the row ends, or begins again
        return
    e, kind = plan.actions[j, WHOM], plan.actions[j, DOES]
    passed = (k + 1) * plan.dt - state.speed_began[e]
    if kind == RELATIVE_SPEED:
        over = _follow_speed(j, e, k, passed, plan, state, record)
    elif kind == SPEED_PROFILE:
        n = state.profile_rows[e]
        state.command[e] = max(profile_speed(state.profile[e], n, passed), 0.0)
        over = passed >= state.profile[e, n - 1, 0] - SAME_TIME
    elif kind == KEEP_DISTANCE:
        over = _keep_distance(j, e, k, plan, roads, state, record)
    else:
        over = _synchronise(j, e, k, plan, roads, state, record)
    state.target[e] = state.command[e]
    if over:
        state.action_ended[j] = True
        state.speed_action[e] = -1


@kernel
def seen_at(e, other, k, plan, state, record):
    """Return the instant at which an entity sees another one: the next, if that is known."""
    first = e == 0 and plan.is_driven
    # A cycle of references has no first one: there the present state counts.
    known = not first and (state.timed[other] or plan.order[1, other] < plan.order[1, e])
    return min(k + 1, record.v.shape[1] - 1) if known else k


@kernel
def _mean_seen(e, other, k, plan, state, record):
    """Return the mean speed [m/s] at which an entity sees another one until the next instant."""
    seen = seen_at(e, other, k, plan, state, record)
    if seen > k and state.mean[other] >= 0.0:
        return state.mean[other]
    return 0.5 * (record.v[other, k] + record.v[other, seen])


@kernel
def _wanted(j, e, v, plan, state):
    """Return the speed that a relative one is, by the other's."""
    value = state.slots[plan.actions[j, TARGET]]
    is_factor = plan.courses[plan.actions[j, ROW], IS_FACTOR]
    return min(max(v * value if is_factor else v + value, 0.0), plan.bodies[e, 3])


@kernel
def _follow_speed(j, e, k, passed, plan, state, record):
    row = plan.courses[plan.actions[j, ROW]]
    ref, shape = row[REF], plan.actions[j, SHAPE]
    target = _wanted(j, e, record.v[ref, seen_at(e, ref, k, plan, state, record)], plan, state)
    before = state.command[e]
    if shape == STEP and passed <= plan.dt + SAME_TIME:
        if record.v[e, k] == before:
            state.mean[e] = _wanted(j, e, _mean_seen(e, ref, k, plan, state, record), plan, state)
        state.command[e] = target
        return not row[CONTINUOUS]
    if shape != STEP and passed < state.speed_lasts[e]:
        share = passed / state.speed_lasts[e]
        after = changed(shape, state.origin[e], target, share)
    else:
        after = target
    # After a step, too, who keeps to another's speed is limited by its Performance: without, one
    # accelerated by 833 m/s².
    most = (plan.bodies[e, 4] if after > before else plan.bodies[e, 5]) * plan.dt
    is_within = shape == STEP and abs(after - before) <= most  # then to the bit
    state.command[e] = after if is_within else ramped(before, after, most)
    is_there = abs(state.command[e] - target) <= SAME_SPEED
    return passed >= state.speed_lasts[e] - SAME_TIME and is_there and not row[CONTINUOUS]


@kernel
def _limits(row, e, plan, state):
    """Return the limits of acceleration, deceleration, speed and jerk, of file and body."""
    limits = np.empty(5)
    for i in range(5):
        limits[i] = state.slots[row[MOST + i]] if row[MOST + i] >= 0 else math.inf
    limits[0] = min(limits[0], plan.bodies[e, 4])
    limits[1] = min(limits[1], plan.bodies[e, 5])
    limits[2] = min(limits[2], plan.bodies[e, 3])
    return limits


@kernel
def _ahead(e, row, k, seen, plan, roads, state, record):
    """Return how far another entity is ahead [m]: along the own path, or the way the nose points.

    The own place is that of instant k, the other's of ``seen``.
    """
    ref, p = row[REF], state.on[e]
    x, y = record.x[ref, seen], record.y[ref, seen]
    if row[BY_BODY] or p < 0:
        h = record.h[e, k]
        return (x - record.x[e, k]) * elementary.cos(h) + (y - record.y[e, k]) * elementary.sin(h)
    path, n, ds = roads.paths[p], roads.counts[p], roads.steps[p]
    if state.course[e, FOOT_PATH] != p:
        state.course[e, FOOT_PATH] = p
        state.course[e, FOOT] = nearest(path, n, ds, x, y)
    foot, _ = project(path, n, ds, state.course[e, FOOT], x, y)
    state.course[e, FOOT] = foot
    px, py, ph = pose(path, n, ds, foot)
    beyond = (x - px) * elementary.cos(ph) + (y - py) * elementary.sin(
        ph
    )  # the path's end, if it is there
    return foot + beyond - state.station[e]


@kernel
def _behind_its_place(j, e, k, seen, plan, roads, state, record):
    """Return how far it is to the place at the distance [m] that action j keeps."""
    row = plan.courses[plan.actions[j, ROW]]
    ref, side = row[REF], state.course[e, SIDE_TAKEN]
    gap = state.slots[plan.actions[j, TARGET]]
    if row[IS_TIME_GAP]:
        gap *= record.v[ref, seen]
    if row[FREESPACE]:  # from the front of the one behind to the rear of the one ahead
        centre, length = plan.bodies[e, 2], plan.bodies[e, 0]
        other, other_length = plan.bodies[ref, 2], plan.bodies[ref, 0]
        gap += 0.5 * (length + other_length) + side * (centre - other)
    return _ahead(e, row, k, seen, plan, roads, state, record) - side * gap


@kernel
def _keep_distance(j, e, k, plan, roads, state, record):
    """Keep, or reach, a distance: at once if nothing limits it, else as by a spring."""
    row = plan.courses[plan.actions[j, ROW]]
    ref = row[REF]
    seen = seen_at(e, ref, k, plan, state, record) if row[UNLIMITED] and e > 0 else k
    error = _behind_its_place(j, e, k, seen, plan, roads, state, record)
    if row[UNLIMITED] and e > 0:
        before = record.v[e, k]
        state.command[e] = min(record.v[ref, seen], plan.bodies[e, 3])
        if abs(error) < 0.5 * state.command[e] * plan.dt:  # it cannot follow: it stands across
            state.command[e] = abs(error) / plan.dt
        state.station[e] += error - 0.5 * (before + state.command[e]) * plan.dt
        return not row[CONTINUOUS]
    limits = _limits(row, e, plan, state)
    v = record.v[e, k]
    a = spring(error, v - record.v[ref, k], state.course[e, ACCELERATION], limits, plan.dt)
    state.course[e, ACCELERATION] = a
    state.command[e] = min(max(v + a * plan.dt, 0.0), limits[2])
    return abs(error) < NEAR and not row[CONTINUOUS]


@kernel
def _way_left(e, k, x, y, plan, roads, state, record):
    """Return how far it is to a place [m] at instant k: along an entity's path, if it lies there.

    Else as the crow flies. Negative: the entity is past it.
    """
    p = state.on[e]
    if p >= 0:
        path, n, ds = roads.paths[p], roads.counts[p], roads.steps[p]
        foot = nearest(path, n, ds, x, y)
        px, py, _ = pose(path, n, ds, foot)
        if elementary.hypot(px - x, py - y) < ASIDE:
            # Its station may be the next instant's already.
            own, _ = project(path, n, ds, state.station[e], record.x[e, k], record.y[e, k])
            return foot - own
    elif state.laid_count[e] > 0:
        left = left_on_laid(e, k, x, y, state, record)
        if not math.isnan(left):
            return left
    return elementary.hypot(x - record.x[e, k], y - record.y[e, k])


@kernel
def _synchronise(j, e, k, plan, roads, state, record):
    """Go so as to be at a place when the master is at one of its own, by its present speed."""
    row, memory = plan.courses[plan.actions[j, ROW]], state.course[e]
    master = row[REF]
    left = _way_left(e, k, memory[OWN_X], memory[OWN_Y], plan, roads, state, record)
    other = _way_left(master, k, memory[MASTER_X], memory[MASTER_Y], plan, roads, state, record)
    speed = abs(record.v[master, k])
    final = 0.0
    if row[FINAL] != NO_FINAL:
        final = state.slots[row[FINAL_VALUE]]
        if row[FINAL] != FINAL_SPEED:
            final = final + speed if row[FINAL] == FINAL_DELTA else final * speed
        final = min(max(final, 0.0), plan.bodies[e, 3])
    near, master_near = _slot(row[TOLERANCE], state), _slot(row[MASTER_TOLERANCE], state)
    # Asked anew at every instant, by the master's present speed: the plan heals itself where the
    # master changes its speed.
    time = max(other - master_near, 0.0) / speed if speed > SLOW else math.inf
    over = left <= near or other <= master_near or time < plan.dt
    # Whoever gets farther away has passed its place, if between two instants.
    over = over or left > memory[LEFT] + 1e-9 or other > memory[MASTER_LEFT] + 1e-9
    memory[LEFT], memory[MASTER_LEFT] = left, other
    v = record.v[e, k]
    if over:
        state.command[e] = final if row[FINAL] != NO_FINAL else v
        return True
    left -= near
    if row[FINAL] != NO_FINAL and row[STEADY] != 0 and final > 0.0:
        steady = state.slots[row[STEADY_VALUE]]
        if row[STEADY] == STEADY_TIME:
            steady *= final
        if left <= steady or time <= steady / final:
            state.command[e] = final
            return False
        left, time = left - steady, time - steady / final
    after = meeting_speed(left, time, v, final, row[FINAL] != NO_FINAL, plan.dt)
    after = min(after, v + plan.bodies[e, 4] * plan.dt, plan.bodies[e, 3])
    state.command[e] = max(after, v - plan.bodies[e, 5] * plan.dt, 0.0)
    return False


@kernel
def _slot(slot, state):
    return state.slots[slot] if slot >= 0 else 0.0
