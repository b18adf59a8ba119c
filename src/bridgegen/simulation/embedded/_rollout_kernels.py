"""The rollout of one scenario: triggers, the storyboard's changes, the ego's driver and bicycle.

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
from bridgegen.simulation.embedded._condition_kernels import (
    EVENT_ENDED,
    REACH_POSITION,
    SIMULATION_TIME,
    SPEED,
    fires,
    observe_one,
    observe_pair,
)
from bridgegen.simulation.embedded._motion_kernels import (
    DISTANCE,
    LINEAR,
    STEP,
    between,
    bicycle,
    duration,
    nearest,
    progress,
    ramped,
    shifted,
)

GRAVITY = 9.81  # m/s²
DRY_FRICTION = 0.85  # tyre on dry asphalt, peak; source: Wong, Theory of Ground Vehicles, table 1.3
REACH = 8.0  # m, a lane that is farther from a body than this is not the one beside its own

OK, NOT_FINITE, OFF_ROUTE, NO_LANE = 0, 1, 2, 3
SPEED_CHANGE, LANE_CHANGE, FRICTION, LIGHT = 0, 1, 2, 3


@kernel
def simulate_one(
    paths, path_n, path_ds, zones, station0, aside0, points, timed, tracks, slots, bodies, init,
    triggers, groups, conditions, acts, events, actions, first_states, friction_slot, driver, dt,
    x, y, h, v, a, offset, lights, began,
):  # fmt: skip
    """Fill one scenario's ``(E, T)`` arrays; return (n_steps, status)."""
    n_entities, n_steps = x.shape
    history = np.zeros((conditions.shape[0], n_steps), dtype=np.bool_)
    act_runs = np.zeros(acts.shape[0], dtype=np.bool_)
    event_ended = np.zeros(events.shape[0], dtype=np.bool_)
    action_ended = np.zeros(actions.shape[0], dtype=np.bool_)
    travelled = np.zeros(n_entities)
    stood = np.zeros(n_entities)
    station, aside = station0.copy(), aside0.copy()
    on = np.arange(n_entities)  # the path that a body is on …
    to = np.full(n_entities, -1)  # … the one that it changes to, if any …
    foot = np.zeros(n_entities)  # … and its station there
    command = np.empty(n_entities)  # the speed that the storyboard asks for now …
    target = np.empty(n_entities)  # … the one it is on its way to …
    rate = np.full(n_entities, math.inf)  # … and how fast
    speeding = np.full(n_entities, -1)  # the action that changes its speed, its start and time
    origin, speed_began, speed_lasts = np.zeros((3, n_entities))
    lane_began, lane_lasts, lane_from = np.zeros((3, n_entities))
    lane_action = np.full(n_entities, -1)
    states = first_states.copy()
    friction_limit = DRY_FRICTION * GRAVITY
    if friction_slot >= 0:
        friction_limit *= slots[friction_slot]
    for e in range(n_entities):
        m = timed[e]
        if m >= 0:  # its states are known beforehand
            for k in range(n_steps):
                x[e, k], y[e, k], h[e, k] = tracks[m, k, 0], tracks[m, k, 1], tracks[m, k, 2]
                v[e, k], a[e, k], offset[e, k] = tracks[m, k, 3], tracks[m, k, 4], 0.0
            command[e] = target[e] = v[e, 0]
            station[e] = tracks[m, 0, 5]
            continue
        length = (path_n[e] - 1) * path_ds[e]
        if not (0.0 <= station[e] <= length):
            x[:] = 0.0
            y[:] = 0.0
            h[:] = 0.0
            v[:] = 0.0
            a[:] = 0.0
            offset[:] = 0.0
            lights[:] = 0
            return 1, OFF_ROUTE
        x[e, 0], y[e, 0], h[e, 0] = pose(paths[e], path_n[e], path_ds[e], station[e])
        x[e, 0], y[e, 0] = shifted(x[e, 0], y[e, 0], h[e, 0], aside[e])
        command[e] = target[e] = v[e, 0] = min(slots[init[e]], bodies[e, 3])
        offset[e, 0] = 0.0
    ego_end = (path_n[0] - 1) * path_ds[0]
    driven = timed[0] < 0
    if not driven:
        ego_end = math.inf
    last = n_steps - 1
    status = OK
    for k in range(n_steps):
        now = k * dt
        for c in range(conditions.shape[0]):
            kind, e, other = conditions[c, 0], conditions[c, 1], conditions[c, 2]
            limit = slots[conditions[c, 4]]
            if kind == REACH_POSITION:
                gap = math.hypot(x[e, k] - points[c, 0], y[e, k] - points[c, 1])
                history[c, k] = gap <= limit
            elif kind < SPEED and kind != SIMULATION_TIME:
                history[c, k] = observe_pair(
                    kind, conditions[c, 3], limit, x[other, k] - x[e, k], y[other, k] - y[e, k],
                    v[e, k], h[e, k], v[other, k], h[other, k],
                )  # fmt: skip
            else:
                ended = kind == EVENT_ENDED and event_ended[other]
                history[c, k] = observe_one(
                    kind, conditions[c, 3], limit, now, v[e, k], travelled[e], stood[e], ended
                )
        stop = fires(0, triggers, groups, conditions, history, k) or station[0] >= ego_end
        for i in range(acts.shape[0]):
            if not act_runs[i] and fires(acts[i], triggers, groups, conditions, history, k):
                act_runs[i] = True
        for i in range(events.shape[0]):
            if began[i] >= 0:
                if not event_ended[i]:
                    ended = True
                    for j in range(events[i, 2], events[i, 3]):
                        ended = ended and action_ended[j]
                    event_ended[i] = ended
                continue
            if not act_runs[events[i, 0]]:
                continue
            if not fires(events[i, 1], triggers, groups, conditions, history, k):
                continue
            began[i] = k
            for j in range(events[i, 2], events[i, 3]):
                e, kind, shape, dimension = (
                    actions[j, 0], actions[j, 1], actions[j, 2], actions[j, 3],
                )  # fmt: skip
                value = slots[actions[j, 5]]
                if kind == LIGHT:
                    states[e] = np.int8(slots[actions[j, 4]])
                    action_ended[j] = True
                elif kind == FRICTION:
                    friction_limit = DRY_FRICTION * GRAVITY * slots[actions[j, 4]]
                    action_ended[j] = True
                elif kind == SPEED_CHANGE:
                    if speeding[e] >= 0:
                        action_ended[speeding[e]] = True
                    speeding[e] = j
                    target[e] = min(slots[actions[j, 4]], bodies[e, 3])
                    origin[e], speed_began[e] = command[e], now
                    rate[e] = math.inf
                    if shape == LINEAR and dimension == 0:
                        rate[e] = abs(value)
                    elif shape != STEP:
                        lasts = duration(shape, dimension, value, command[e], target[e])
                        speed_lasts[e] = max(lasts, 1e-9)
                        if shape == LINEAR:
                            rate[e] = abs(target[e] - command[e]) / speed_lasts[e]
                else:
                    q = actions[j, 6]
                    if to[e] >= 0:  # it goes on from where it is: on the way to the other lane
                        action_ended[lane_action[e]] = True
                        on[e], station[e], aside[e] = to[e], foot[e], 0.0
                    to[e] = q
                    foot[e] = nearest(paths[q], path_n[q], path_ds[q], x[e, k], y[e, k])
                    fx, fy, _ = pose(paths[q], path_n[q], path_ds[q], foot[e])
                    if math.hypot(fx - x[e, k], fy - y[e, k]) > REACH:
                        status = NO_LANE
                        stop = True
                    lane_action[e] = j
                    lane_lasts[e] = max(value, 1e-9)
                    lane_began[e], lane_from[e] = now, travelled[e]
        for e in range(n_entities):
            j = speeding[e]
            if j >= 0 and actions[j, 2] > LINEAR:
                share = progress(actions[j, 2], (now + dt - speed_began[e]) / speed_lasts[e])[0]
                command[e] = origin[e] + share * (target[e] - origin[e])
            else:
                command[e] = ramped(command[e], target[e], rate[e] * dt)
            if j >= 0 and command[e] == target[e]:
                action_ended[j] = True
                speeding[e] = -1
        for i in range(states.shape[0]):
            lights[i, k] = states[i]
        # The ego: its driver demands, its tyres give.
        nx, ny, nh = x[0, k], y[0, k], h[0, k]
        if driven:
            s0, n0, ds0 = station[0], path_n[0], path_ds[0]
            bend = steer(paths[0], n0, ds0, s0, x[0, k], y[0, k], h[0, k], v[0, k])
            if driver == 0:
                demanded = hold_speed(v[0, k], command[0])
            else:
                demanded = drive(
                    paths[0], n0, ds0, v[0, k], command[0], friction_limit, bodies, station, v, k,
                    zones, on, to, foot,
                )  # fmt: skip
            nx, ny, nh, nv, given = bicycle(
                x[0, k], y[0, k], h[0, k], v[0, k], demanded, bend, bodies[0, 3:7],
                friction_limit, dt,
            )  # fmt: skip
            a[0, k] = given
            travelled[0] += 0.5 * (v[0, k] + nv) * dt
            stood[0] = stood[0] + dt if nv == 0.0 else 0.0
            if k < last:
                x[0, k + 1], y[0, k + 1], h[0, k + 1], v[0, k + 1] = nx, ny, nh, nv
                ahead = s0 + 0.5 * (v[0, k] + nv) * dt
                station[0], offset[0, k + 1] = project(paths[0], n0, ds0, ahead, nx, ny)
        # The others: on their paths, at the speed the storyboard asks for.
        for e in range(1 if driven else 0, n_entities):
            if timed[e] >= 0:
                if k < last:
                    station[e] = tracks[timed[e], k + 1, 5]
                    travelled[e] = station[e] - tracks[timed[e], 0, 5]
                    stood[e] = stood[e] + dt if v[e, k + 1] == 0.0 else 0.0
                continue
            before = v[e, k]
            p = on[e]
            length = (path_n[p] - 1) * path_ds[p]
            ahead = station[e] + 0.5 * (before + command[e]) * dt
            if ahead >= length:
                ahead = length
                command[e] = target[e] = 0.0
            step = 0.5 * (before + command[e]) * dt
            travelled[e] += step
            stood[e] = stood[e] + dt if command[e] == 0.0 else 0.0
            a[e, k] = (command[e] - before) / dt
            if k == last:
                continue
            station[e] = ahead
            v[e, k + 1] = command[e]
            offset[e, k + 1] = 0.0
            q = to[e]
            if q < 0:
                px, py, ph = pose(paths[p], path_n[p], path_ds[p], ahead)
                x[e, k + 1], y[e, k + 1] = shifted(px, py, ph, aside[e])
                h[e, k + 1] = ph
                continue
            j = lane_action[e]
            if actions[j, 3] == DISTANCE:
                u = (travelled[e] - lane_from[e]) / lane_lasts[e]
                per_metre = 1.0 / lane_lasts[e]
            else:
                u = (now + dt - lane_began[e]) / lane_lasts[e]
                per_metre = 1.0 / (lane_lasts[e] * command[e]) if command[e] > 0.1 else 0.0
            x[e, k + 1], y[e, k + 1], h[e, k + 1], foot[e] = between(
                paths[p], path_n[p], path_ds[p], ahead, paths[q], path_n[q], path_ds[q],
                foot[e] + step, actions[j, 2], u, per_metre, aside[e],
            )  # fmt: skip
            if u >= 1.0:
                on[e], station[e], to[e], aside[e] = q, foot[e], -1, 0.0
                action_ended[j] = True
        if not (math.isfinite(nx) and math.isfinite(ny) and math.isfinite(nh)):
            status = NOT_FINITE
            stop = True
        if stop:
            for e in range(n_entities):
                for array in (x, y, h, v, a, offset):
                    value = array[e, k]
                    for j in range(k + 1, n_steps):
                        array[e, j] = value
            for i in range(states.shape[0]):
                for j in range(k + 1, n_steps):
                    lights[i, j] = states[i]
            return k + 1, status
    return n_steps, status


@kernel
def simulate_rows(
    network, paths, path_n, path_ds, zones, station0, aside0, points, timed, tracks, slots,
    bodies, init, triggers, groups, conditions, acts, events, actions, first_states,
    friction_slot, driver, dt, x, y, h, v, a, offset, lights, began, n_steps, status,
):  # fmt: skip
    """Fill the batch's ``(N, E, T)`` arrays, row by row; ``network`` tells each row's roads."""
    for i in range(slots.shape[0]):
        p = network[i]
        n_steps[i], status[i] = simulate_one(
            paths[p], path_n[p], path_ds[p], zones[p], station0[i], aside0[i], points[p], timed,
            tracks[p], slots[i], bodies, init, triggers, groups, conditions, acts, events, actions,
            first_states, friction_slot, driver, dt,
            x[i], y[i], h[i], v[i], a[i], offset[i], lights[i], began[i],
        )  # fmt: skip
