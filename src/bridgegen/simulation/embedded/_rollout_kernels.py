"""The rollout of one scenario: triggers, speed commands, the ego's driver and its bicycle.

One instant: record, stop trigger, acts, events, drivers, then integrate to the next. All numbers
that may vary by row are read from ``slots``; the integer tables are the compiled storyboard
(``program.py`` tells their columns).
"""

import math

import numpy as np

from bridgegen.compiled import kernel
from bridgegen.ego._path_kernels import pose, project
from bridgegen.ego._reference_kernels import drive
from bridgegen.ego._route_follower_kernels import hold_speed, steer

GRAVITY = 9.81  # m/s²
DRY_FRICTION = 0.85  # tyre on dry asphalt, peak; source: Wong, Theory of Ground Vehicles, table 1.3

OK, NOT_FINITE, OFF_ROUTE = 0, 1, 2
SIMULATION_TIME, RELATIVE_DISTANCE, REACH_POSITION = 0, 1, 2
GREATER, LESS, EQUAL, GREATER_EQUAL, LESS_EQUAL, NOT_EQUAL = 0, 1, 2, 3, 4, 5
NONE, RISING, FALLING, RISING_OR_FALLING = 0, 1, 2, 3
STEP, LINEAR_RATE, LINEAR_TIME = 0, 1, 2


@kernel
def compare(value, rule, limit):
    """Apply an OpenSCENARIO Rule."""
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
def observe(c, conditions, points, slots, now, x, y, k):
    """Return whether the condition's rule holds at instant k, before edge and delay."""
    kind, a, b, rule = conditions[c, 0], conditions[c, 1], conditions[c, 2], conditions[c, 3]
    limit = slots[conditions[c, 4]]
    if kind == SIMULATION_TIME:
        return compare(now, rule, limit)
    if kind == RELATIVE_DISTANCE:
        gap = math.hypot(x[a, k] - x[b, k], y[a, k] - y[b, k])
        return compare(gap, rule, limit)
    return math.hypot(x[a, k] - points[c, 0], y[a, k] - points[c, 1]) <= limit


@kernel
def holds(c, conditions, history, k):
    """Return whether the condition, with its edge and delay, is met at instant k.

    An edge needs an earlier observation, so none is seen at the first instant.
    """
    edge, j = conditions[c, 5], k - conditions[c, 6]
    if j < 0:
        return False
    if edge == NONE:
        return history[c, j]
    if j == 0:
        return False
    rises = history[c, j] and not history[c, j - 1]
    falls = history[c, j - 1] and not history[c, j]
    return (edge != FALLING and rises) or (edge != RISING and falls)


@kernel
def fires(trigger, triggers, groups, conditions, history, k):
    """Return whether any condition group of a trigger is met as a whole."""
    for g in range(triggers[trigger, 0], triggers[trigger, 1]):
        met = groups[g, 1] > groups[g, 0]
        for c in range(groups[g, 0], groups[g, 1]):
            if not holds(c, conditions, history, k):
                met = False
                break
        if met:
            return True
    return False


@kernel
def bicycle(x, y, h, v, demanded, curvature, limits, friction_limit, dt):
    """Return (x, y, h, v, a) one step on, and the acceleration that the tyres gave.

    Kinematic bicycle at the rear axle. ``limits`` are those of speed, acceleration, deceleration,
    and curvature (full lock). Inside the friction circle the demand is met; outside, both its
    parts shrink to the circle.
    """
    a = min(max(demanded, -limits[2]), limits[1])
    bend = min(max(curvature, -limits[3]), limits[3])
    total = math.hypot(a, v * v * bend)
    if total > friction_limit:
        a *= friction_limit / total
        bend *= friction_limit / total
    end = min(max(v + a * dt, 0.0), limits[0])
    a = (end - v) / dt
    travelled = 0.5 * (v + end) * dt
    middle = h + 0.5 * travelled * bend
    return (
        x + travelled * math.cos(middle),
        y + travelled * math.sin(middle),
        h + travelled * bend,
        end,
        a,
    )


@kernel
def simulate_one(
    paths, path_n, path_ds, zones, station0, points, slots, bodies, init, triggers, groups,
    conditions, acts, events, friction_slot, driver, dt, x, y, h, v, a, offset,
):  # fmt: skip
    """Fill one scenario's ``(E, T)`` arrays; return (n_steps, status)."""
    n_entities, n_steps = x.shape
    history = np.zeros((conditions.shape[0], n_steps), dtype=np.bool_)
    act_runs = np.zeros(acts.shape[0], dtype=np.bool_)
    event_done = np.zeros(events.shape[0], dtype=np.bool_)
    station = station0.copy()
    command = np.empty(n_entities)  # the speed that the storyboard asks for now …
    target = np.empty(n_entities)  # … the one it is on its way to …
    rate = np.full(n_entities, math.inf)  # … and how fast
    friction_limit = DRY_FRICTION * GRAVITY
    if friction_slot >= 0:
        friction_limit *= slots[friction_slot]
    for e in range(n_entities):
        length = (path_n[e] - 1) * path_ds[e]
        if not (0.0 <= station[e] <= length):
            x[:] = 0.0
            y[:] = 0.0
            h[:] = 0.0
            v[:] = 0.0
            a[:] = 0.0
            offset[:] = 0.0
            return 1, OFF_ROUTE
        x[e, 0], y[e, 0], h[e, 0] = pose(paths[e], path_n[e], path_ds[e], station[e])
        command[e] = target[e] = v[e, 0] = min(slots[init[e]], bodies[e, 3])
        offset[e, 0] = 0.0
    ego_end = (path_n[0] - 1) * path_ds[0]
    last = n_steps - 1
    status = OK
    for k in range(n_steps):
        now = k * dt
        for c in range(conditions.shape[0]):
            history[c, k] = observe(c, conditions, points, slots, now, x, y, k)
        stop = fires(0, triggers, groups, conditions, history, k) or station[0] >= ego_end
        for i in range(acts.shape[0]):
            if not act_runs[i] and fires(acts[i], triggers, groups, conditions, history, k):
                act_runs[i] = True
        for i in range(events.shape[0]):
            if event_done[i] or not act_runs[events[i, 0]]:
                continue
            if fires(events[i, 1], triggers, groups, conditions, history, k):
                event_done[i] = True
                e = events[i, 2]
                target[e] = min(slots[events[i, 4]], bodies[e, 3])
                if events[i, 3] == STEP:
                    rate[e] = math.inf
                elif events[i, 3] == LINEAR_RATE:
                    rate[e] = abs(slots[events[i, 5]])
                else:
                    rate[e] = abs(target[e] - command[e]) / slots[events[i, 5]]
        # The ego: its driver demands, its tyres give.
        s0, n0, ds0 = station[0], path_n[0], path_ds[0]
        ramp(command, target, rate, 0, dt)
        bend = steer(paths[0], n0, ds0, s0, x[0, k], y[0, k], h[0, k], v[0, k])
        if driver == 0:
            demanded = hold_speed(v[0, k], command[0])
        else:
            demanded = drive(
                paths[0], n0, ds0, v[0, k], command[0], friction_limit, bodies, station, v, k, zones
            )
        nx, ny, nh, nv, given = bicycle(
            x[0, k], y[0, k], h[0, k], v[0, k], demanded, bend, bodies[0, 3:7],
            friction_limit, dt,
        )  # fmt: skip
        a[0, k] = given
        if k < last:
            x[0, k + 1], y[0, k + 1], h[0, k + 1], v[0, k + 1] = nx, ny, nh, nv
            ahead = s0 + 0.5 * (v[0, k] + nv) * dt
            station[0], offset[0, k + 1] = project(paths[0], n0, ds0, ahead, nx, ny)
        # The others: on their route, at the speed the storyboard asks for.
        for e in range(1, n_entities):
            before = v[e, k]
            ramp(command, target, rate, e, dt)
            length = (path_n[e] - 1) * path_ds[e]
            ahead = station[e] + 0.5 * (before + command[e]) * dt
            if ahead >= length:
                ahead = length
                command[e] = target[e] = 0.0
            a[e, k] = (command[e] - before) / dt
            if k < last:
                station[e] = ahead
                v[e, k + 1] = command[e]
                x[e, k + 1], y[e, k + 1], h[e, k + 1] = pose(paths[e], path_n[e], path_ds[e], ahead)
                offset[e, k + 1] = 0.0
        if not (math.isfinite(nx) and math.isfinite(ny) and math.isfinite(nh)):
            status = NOT_FINITE
            stop = True
        if stop:
            for e in range(n_entities):
                for array in (x, y, h, v, a, offset):
                    value = array[e, k]
                    for j in range(k + 1, n_steps):
                        array[e, j] = value
            return k + 1, status
    return n_steps, status


@kernel
def ramp(command, target, rate, e, dt):
    """Move one entity's commanded speed towards its target by one step."""
    change = target[e] - command[e]
    most = rate[e] * dt
    command[e] += min(max(change, -most), most)


@kernel
def simulate_rows(
    network, paths, path_n, path_ds, zones, station0, points, slots, bodies, init, triggers, groups,
    conditions, acts, events, friction_slot, driver, dt, x, y, h, v, a, offset, n_steps, status,
):  # fmt: skip
    """Fill the batch's ``(N, E, T)`` arrays, row by row; ``network`` tells each row's roads."""
    for i in range(slots.shape[0]):
        p = network[i]
        n_steps[i], status[i] = simulate_one(
            paths[p], path_n[p], path_ds[p], zones[p], station0[i], points[p], slots[i], bodies,
            init, triggers, groups, conditions, acts, events, friction_slot, driver, dt,
            x[i], y[i], h[i], v[i], a[i], offset[i],
        )  # fmt: skip
