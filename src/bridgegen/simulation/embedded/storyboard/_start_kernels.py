"""The first instant: where every entity is, and how fast."""

import math

from bridgegen.base.compiled import kernel, run_kernel_at
from bridgegen.drivers._path_kernels import pose
from bridgegen.drivers._weather_kernels import change, set_clear
from bridgegen.simulation.embedded._codes import (
    CONTROL,
    DOES,
    FIRST_GLOBAL,
    FIRST_MOTION,
    KEEP_DISTANCE,
    RELATIVE_SPEED,
    SHAPE,
    TELEPORT,
    WHOM,
)
from bridgegen.simulation.embedded._memory_kernels import N_STEPS, OFF_ROUTE, STATUS, STOPS
from bridgegen.simulation.embedded._motion_kernels import STEP, shifted
from bridgegen.simulation.embedded.drivers import begin_control, is_steered
from bridgegen.simulation.embedded.motion import (
    LANDS,
    at_time,
    begin_motion,
    is_pointless,
    look_round,
    start_at_distance,
    start_at_speed,
    steers,
)
from bridgegen.simulation.embedded.places._place_kernels import body_pose, put
from bridgegen.simulation.embedded.world import (
    DURATION,
    begin_global,
    enter_phase,
    set_clock,
    start_controllers,
)

# --- How actions begin: those of who drives, those that move an entity, those that concern all ---


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@kernel
def begin(j, k, plan, roads, state, record):
    """Begin action j at instant k; what is over at once says so."""
    kind = plan.actions[j, DOES]
    steers_ego = steers(j, plan) and plan.actions[j, WHOM] == 0
    in_vain = steers_ego and is_steered(plan, state)  # its driver does
    if in_vain or (plan.comes_and_goes and is_pointless(j, plan, state)):
        state.action_ended[j] = True
    elif kind == CONTROL:
        begin_control(j, k, plan, roads, state, record)
    elif FIRST_MOTION <= kind < FIRST_GLOBAL:
        begin_motion(j, k, plan, roads, state, record)
    else:
        begin_global(j, k, plan, state)


@kernel
def begin_initially(plan, roads, state, record):
    """Begin the actions that begin at the start: what they set at once is the first state."""
    for i in range(plan.initial.shape[0]):
        j = plan.initial[i]
        begin(j, 0, plan, roads, state, record)
        if plan.actions[j, DOES] == RELATIVE_SPEED and plan.actions[j, SHAPE] == STEP:
            start_at_speed(j, plan, state, record)
        elif plan.actions[j, DOES] == KEEP_DISTANCE:
            start_at_distance(j, plan, roads, state, record)
        # Later on a teleport is seen at the next instant; at the start there is no earlier one.
        elif plan.actions[j, DOES] == TELEPORT:
            e = plan.actions[j, WHOM]
            state.placed[e] = False
            record.x[e, 0], record.y[e, 0], record.h[e, 0] = body_pose(e, roads, state)


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


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
    # After all others are placed: such a start counts from where another entity is.
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
        plan.controllers,
        plan.phases,
        plan.changes,
        state.slots,
        state.phase_now,
        state.phase_until,
        state.lights,
    )
    for c in range(plan.first_phases.shape[0]):
        i = plan.first_phases[c]
        if i >= 0:
            until = max(state.slots[plan.phases[i, DURATION]], 0.0)
            enter_phase(
                c,
                i,
                until,
                plan.phases,
                plan.changes,
                state.phase_now,
                state.phase_until,
                state.lights,
            )
    for i in range(state.lights.shape[0]):
        # After the controllers: what the start says of a light goes before its first phase.
        if plan.first_states[i] >= 0:
            state.lights[i] = plan.first_states[i]
