"""The first instant: where every entity is, and how fast."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel, run_kernel_at
from bridgegen.drivers._path_kernels import pose
from bridgegen.drivers._weather_kernels import change, set_clear
from bridgegen.simulation.embedded._memory_kernels import N_STEPS, OFF_ROUTE, STATUS, STOPS
from bridgegen.simulation.embedded._motion_kernels import shifted
from bridgegen.simulation.embedded.motion import LANDS, at_time, look_round
from bridgegen.simulation.embedded.places._place_kernels import body_pose, put
from bridgegen.simulation.embedded.storyboard._action_kernels import begin_initially
from bridgegen.simulation.embedded.world import (
    DURATION,
    enter_phase,
    set_clock,
    start_controllers,
)


@kernel
def start(plan, roads, state, record):
    """Set the state and the record's first instant."""
    set_clear(state.weather)
    change(state.weather, plan.weathers, 0, state.slots)
    start_globals(plan, state)
    for i in range(plan.drives.shape[0]):  # all at once would compile the text of an error
        state.drives[i] = plan.drives[i]
    for e in range(record.x.shape[0]):
        state.on[e], state.to[e], state.route[e] = e, -1, plan.routes[e]
        state.lateral_action[e] = state.speed_action[e] = state.follow_action[e] = -1
        state.goal_action[e] = state.waits[e] = -1
        state.rate[e], state.follow[e] = math.inf, plan.follows[e]
        state.present[e] = plan.absent[e] == 0
        state.tower[e] = plan.towers[e]
        if plan.comes_and_goes:
            record.present[e, 0] = state.present[e]
        most = plan.bodies[e, 3]
        record.v[e, 0] = min(max(state.slots[plan.init[e]], -most), most)
        record.offset[e, 0] = 0.0
        m = plan.follows[e]
        if m >= 0:
            record.x[e, 0], record.y[e, 0], record.h[e, 0], record.v[e, 0], state.station[e] = (
                at_time(roads.timetables[m], roads.timetable_counts[m], 0.0)
            )
        else:
            length = (roads.counts[e] - 1) * roads.steps[e]
            if not (0.0 <= state.station[e] <= length):
                _end(OFF_ROUTE, state, record)
                return
            x, y, h = pose(roads.paths[e], roads.counts[e], roads.steps[e], state.station[e])
            record.x[e, 0], record.y[e, 0] = shifted(x, y, h, state.aside[e])
            if record.v[e, 0] < 0.0 and roads.follows[e] == LANDS and state.station[e] <= 0.0:
                state.tail_first[e] = True
                h += math.pi
            record.h[e, 0] = h
        state.command[e] = state.target[e] = record.v[e, 0]
    look_round(state)
    for i in range(plan.starts.shape[0]):
        e = plan.starts[i, 0]
        put(e, plan.starts[i, 1], 0, plan, roads, state, record)
        if state.ending[STOPS]:
            _end(state.ending[STATUS], state, record)
            return
        record.x[e, 0], record.y[e, 0], record.h[e, 0] = body_pose(e, roads, state)
    begin_initially(plan, roads, state, record)
    if plan.starts_towed:
        run_kernel_at(plan.starts_towed, (plan, roads, state, record))


@kernel
def _end(status, state, record):
    """End a row at its first instant."""
    for array in (record.x, record.y, record.h, record.v, record.a, record.offset):
        array[:] = 0.0
    record.lights[:] = 0
    state.ending[N_STEPS], state.ending[STATUS] = 1, status


@kernel
def start_globals(plan, state):
    """Set values, time of day, controllers and lights; initial states of lights take precedence."""
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
