"""The first instant: where every entity is, and how fast."""

import math

from bridgegen.compiled import inlined_kernel
from bridgegen.ego._path_kernels import pose
from bridgegen.ego._weather_kernels import change, set_clear
from bridgegen.simulation.embedded._action_kernels import begin_initially
from bridgegen.simulation.embedded._global_kernels import set_clock
from bridgegen.simulation.embedded._memory_kernels import N_STEPS, OFF_ROUTE, STATUS
from bridgegen.simulation.embedded._motion_kernels import shifted
from bridgegen.simulation.embedded._signal_kernels import (
    DURATION,
    enter_phase,
    start_controllers,
)


@inlined_kernel
def start(plan, roads, state, record):
    """Set the state and the record's first instant; who moves by a timetable is recorded whole."""
    n_entities, n_steps = record.x.shape
    set_clear(state.weather)
    change(state.weather, plan.weathers, 0, state.slots)
    start_globals(plan, state)
    for e in range(n_entities):
        state.on[e], state.to[e], state.route[e] = e, -1, plan.routes[e]
        state.lateral_action[e] = state.speed_action[e] = -1
        state.rate[e] = math.inf
        state.present[e] = plan.absent[e] == 0
        if plan.comes_and_goes:
            record.present[e, 0] = state.present[e]
        m = plan.timed[e]
        if m >= 0:
            for k in range(n_steps):
                record.x[e, k] = roads.tracks[m, k, 0]
                record.y[e, k] = roads.tracks[m, k, 1]
                record.h[e, k] = roads.tracks[m, k, 2]
                record.v[e, k] = roads.tracks[m, k, 3]
                record.a[e, k] = roads.tracks[m, k, 4]
                record.offset[e, k] = 0.0
            state.command[e] = state.target[e] = record.v[e, 0]
            state.station[e] = roads.tracks[m, 0, 5]
            continue
        length = (roads.counts[e] - 1) * roads.steps[e]
        if not (0.0 <= state.station[e] <= length):
            for array in (record.x, record.y, record.h, record.v, record.a, record.offset):
                array[:] = 0.0
            record.lights[:] = 0
            state.ending[N_STEPS], state.ending[STATUS] = 1, OFF_ROUTE
            return
        x, y, h = pose(roads.paths[e], roads.counts[e], roads.steps[e], state.station[e])
        record.x[e, 0], record.y[e, 0] = shifted(x, y, h, state.aside[e])
        record.h[e, 0] = h
        record.v[e, 0] = min(state.slots[plan.init[e]], plan.bodies[e, 3])
        record.offset[e, 0] = 0.0
        state.command[e] = state.target[e] = record.v[e, 0]
    begin_initially(plan, roads, state, record)


@inlined_kernel
def start_globals(plan, state):
    """Set values, time of day, controllers and lights; what the start says of a light goes last."""
    for i in range(state.values.shape[0]):
        state.values[i] = state.slots[plan.values[i]]
    state.clock[0] = math.nan
    if plan.first_time >= 0:
        set_clock(state.slots[plan.first_time], plan.time_passes, 0.0, state.clock)
    start_controllers(
        plan.controllers, plan.phases, plan.changes, state.slots, state.phase_now,
        state.phase_until, state.lights,
    )  # fmt: skip
    for c in range(plan.first_phases.shape[0]):
        i = plan.first_phases[c]
        if i >= 0:
            until = max(state.slots[plan.phases[i, DURATION]], 0.0)
            enter_phase(
                c, i, until, plan.phases, plan.changes, state.phase_now, state.phase_until,
                state.lights,
            )  # fmt: skip
    for i in range(state.lights.shape[0]):
        if plan.first_states[i] >= 0:
            state.lights[i] = plan.first_states[i]
