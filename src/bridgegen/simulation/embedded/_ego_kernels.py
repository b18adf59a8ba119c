"""The ego: what its driver demands, and what its tyres give."""

import math

from bridgegen.compiled import inlined_kernel
from bridgegen.ego._careful_fsm_kernels import drive_careful_fsm
from bridgegen.ego._careful_kernels import drive_careful
from bridgegen.ego._fsm_kernels import drive_fsm
from bridgegen.ego._lights_kernels import stop_at_lights
from bridgegen.ego._path_kernels import project
from bridgegen.ego._reference_kernels import STOPS_FOR, drive
from bridgegen.ego._route_follower_kernels import hold_speed, steer
from bridgegen.ego._speed_kernels import bend_speed
from bridgegen.ego._un_r157_kernels import drive_un_r157
from bridgegen.ego._weather_columns import FRICTION
from bridgegen.ego.drivers import NOBODY, OWN
from bridgegen.simulation.embedded._motion_kernels import bicycle, standing
from bridgegen.simulation.embedded._own_driver_kernels import ask
from bridgegen.simulation.embedded._travel_kernels import ENDS, pass_end


@inlined_kernel
def demand(k, plan, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m].

    A driver that is compiled is a branch here; one in Python gives the same two numbers.
    """
    if plan.driver == NOBODY:
        return 0.0, 0.0
    if plan.driver == OWN:
        return ask(k, plan, roads, state, record)
    p, s, v = state.on[0], state.station[0], record.v[0, k]
    path, n, ds = roads.paths[p], roads.counts[p], roads.steps[p]
    curvature = steer(path, n, ds, s, record.x[0, k], record.y[0, k], record.h[0, k], v)
    if plan.driver == 0:
        return hold_speed(v, state.command[0]), curvature
    if plan.driver == 1:
        return drive(k, curvature, state.weather[FRICTION], plan, roads, state, record)
    front = plan.bodies[0, 2] + 0.5 * plan.bodies[0, 0]
    lines = roads.stops if p == 0 else roads.stops[:0]
    stopping = int(state.mind[STOPS_FOR]) - 1
    asked, stops_for = stop_at_lights(lines, state.lights, s, front, v, math.inf, stopping)
    state.mind[STOPS_FOR] = stops_for + 1.0
    planned = bend_speed(path, n, ds, s, v, state.command[0], state.weather[FRICTION])
    if plan.driver == 2:
        demanded = drive_un_r157(
            k, plan.dt, roads.paths, roads.counts, roads.steps, state.station, state.on, planned,
            state.present, record.x, record.y, record.h, record.v, plan.bodies, plan.kinds,
            state.attention,
        )  # fmt: skip
        return min(demanded, asked), curvature
    if plan.driver == 4:
        demanded = drive_careful(
            k, plan.dt, roads.paths, roads.counts, roads.steps, state.station, state.on, state.to,
            planned, state.present, record.x, record.y, record.h, record.v, plan.bodies,
            state.attention,
        )  # fmt: skip
        return min(demanded, asked), curvature
    if plan.driver == 5:
        demanded = drive_careful_fsm(
            k, plan.dt, roads.paths, roads.counts, roads.steps, state.station, state.on, state.to,
            planned, state.present, record.x, record.y, record.h, record.v, plan.bodies,
            state.attention,
        )  # fmt: skip
        return min(demanded, asked), curvature
    demanded = drive_fsm(
        k, plan.dt, roads.paths, roads.counts, roads.steps, state.station, state.on, state.to,
        planned, state.present, record.x, record.y, record.h, record.v, plan.bodies, plan.kinds,
        state.attention,
    )  # fmt: skip
    return min(demanded, asked), curvature


@inlined_kernel
def ego_is_through(plan, roads, state):
    """Say whether an ego with a driver is at the end of its route, or of the road."""
    p = state.on[0]
    if plan.driver == NOBODY or state.station[0] < (roads.counts[p] - 1) * roads.steps[p]:
        return False
    return (p == 0 and state.route[0] > 0) or roads.follows[p] == ENDS


@inlined_kernel
def move_ego(k, demanded, curvature, plan, roads, state, record):
    """Move the ego on from instant k; return its new x, y [m] and heading [rad]."""
    v, dt, p = record.v[0, k], plan.dt, state.on[0]
    x, y, h, after, given = bicycle(
        record.x[0, k], record.y[0, k], record.h[0, k], v, demanded, curvature,
        plan.bodies[0, 3:7], state.weather[FRICTION], dt,
    )  # fmt: skip
    step = 0.5 * (v + after) * dt
    record.a[0, k] = given
    state.travelled[0] += step
    state.stood[0] = standing(state.stood[0], v, after, dt)
    if k < record.x.shape[1] - 1:
        record.x[0, k + 1], record.y[0, k + 1] = x, y
        record.h[0, k + 1], record.v[0, k + 1] = h, after
        state.station[0], record.offset[0, k + 1] = project(
            roads.paths[p], roads.counts[p], roads.steps[p], state.station[0] + step, x, y
        )
        state.aside[0] = record.offset[0, k + 1]
        at_end = state.station[0] >= (roads.counts[p] - 1) * roads.steps[p]
        if at_end and (p > 0 or state.route[0] == 0):
            pass_end(0, 0.0, roads, state)
    return x, y, h
