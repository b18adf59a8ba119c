"""One instant of one scenario, in two halves: what comes before the ego's driver, and after it."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import inlined_kernel, kernel, run_kernel_at
from bridgegen.drivers._odd_kernels import heed_domain
from bridgegen.drivers.drivers import SCRIPTED
from bridgegen.simulation.embedded._codes import LATERALLY, LONGITUDINALLY
from bridgegen.simulation.embedded._collision_kernels import collides
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
    NOT_FINITE,
    OFF_LANES,
    STATUS,
    STOPS,
)
from bridgegen.simulation.embedded.conditions import observe
from bridgegen.simulation.embedded.drivers import (
    is_steered,
    move_heeding,
    move_paced,
    move_steered,
)
from bridgegen.simulation.embedded.motion import (
    arrive,
    command_by_pedals,
    command_speed,
    move_along_path,
    move_by_timetable,
    move_pedals,
    note_presence,
    pressed,
    show_lamps,
    stay_away,
    steered,
)
from bridgegen.simulation.embedded.places._place_kernels import fail
from bridgegen.simulation.embedded.storyboard import decide, finish
from bridgegen.simulation.embedded.world import run_controllers


@inlined_kernel
def before_driver(k, plan, roads, state, record):
    """Execute the storyboard at instant k, up to its commands for the ego."""
    run_controllers(
        k * plan.dt,
        plan.controllers,
        plan.phases,
        plan.changes,
        state.slots,
        state.phase_now,
        state.phase_until,
        state.lights,
    )
    # The order of an instant: what is over ends, conditions are looked at, then triggers start and
    # stop elements. An action that ends here can so be what a trigger waits for.
    arrive(k, plan, state, record)
    finish(k, plan, state)
    observe(k, plan, roads, state, record)
    decide(k, plan, roads, state, record)
    show_lamps(k, plan, state, record)
    if plan.attends:
        run_kernel_at(plan.begins_waiting, (k, plan, roads, state, record))
    # The driver is asked between the halves, and its target speed is this command.
    if plan.is_driven:  # else its turn comes with the others'
        command_speed(0, k, plan, roads, state, record)
    drives = state.drives[LATERALLY] == 1 or state.drives[LONGITUDINALLY] == 1
    if plan.is_driven and drives and state.on[0] < 0:  # drivers keep to lanes
        fail(OFF_LANES, state)
    for i in range(state.lights.shape[0]):
        record.lights[i, k] = state.lights[i]


@inlined_kernel
def after_driver(k, demanded, curvature, plan, roads, state, record):
    """Move all entities to instant k + 1, or end the row; see ``_ego_kernels.demand``."""
    x, y, h = move_driven(k, demanded, curvature, plan, roads, state, record)
    move_others(k, x, y, h, plan, roads, state, record)


@inlined_kernel
def move_driven(k, demanded, curvature, plan, roads, state, record):
    """Move the ego on from instant k if its driver does; return its new x, y [m] and heading."""
    x, y, h = record.x[0, k], record.y[0, k], record.h[0, k]
    if plan.limits.shape[0] > 0:
        demanded = heed_domain(k, demanded, plan, roads, state, record)
    if plan.has_pedals:
        move_pedals(plan, state)
        if state.holds[0] and plan.is_driven:
            if state.drives[LONGITUDINALLY] == 0:
                demanded = (state.command[0] - record.v[0, k]) / plan.dt
            demanded = pressed(0, demanded, plan, state)
            curvature = steered(curvature, state)
    # All drivers of others decide by the states at instant k, before any entity moves: so their
    # order does not matter.
    if plan.attends:
        run_kernel_at(plan.heeds, (k, plan, roads, state, record))
    if is_steered(plan, state):
        x, y, h = move_steered(k, demanded, curvature, plan, roads, state, record)
    elif plan.is_driven and state.drives[LONGITUDINALLY] == 1:
        move_paced(k, demanded, plan, roads, state, record)
    return x, y, h


@inlined_kernel
def move_others(k, x, y, h, plan, roads, state, record):
    """Move all that no driver has moved, or end the row; x, y and h are the ego's new pose."""
    drives = state.drives[LATERALLY] == 1 or state.drives[LONGITUDINALLY] == 1
    first = 1 if plan.is_driven and drives else 0
    for e in range(first, record.x.shape[0]):  # entities that depend on no other come first
        state.timed[e] = state.present[e] and state.follow[e] >= 0
        if plan.moves_laid and state.timed[e] and state.laid_count[e] > 0:
            run_kernel_at(plan.moves_laid, (e, k, plan, roads, state, record))
        elif state.timed[e]:
            move_by_timetable(e, k, plan, roads, state, record)
    # Who refers to another entity is moved after it, and uses its state at the next instant: so a
    # distance is kept to 1e-6 m while the other brakes.
    for i in range(record.x.shape[0]):
        e = plan.order[0, i]
        if e < first or state.timed[e]:
            continue
        if not state.present[e]:
            stay_away(e, k, record)
            continue
        before = state.command[e]
        if e > 0 or not plan.is_driven:
            command_speed(e, k, plan, roads, state, record)
        if plan.has_pedals and state.holds[e]:
            command_by_pedals(e, k, plan, roads, state, record)
        if state.given[e]:  # its driver has moved it, in a rollout of which it is the ego
            continue
        if plan.moves_laid and state.laid_count[e] > 0:
            run_kernel_at(plan.moves_laid, (e, k, plan, roads, state, record))
        elif plan.attends and plan.others[e] != SCRIPTED:
            move_heeding(e, before, k, plan, roads, state, record)
        else:
            move_along_path(e, k, plan, roads, state, record)
    # Trailers come last: their hitch is where what tows them is by then.
    if record.present.shape[0] > 0:
        note_presence(k, plan, roads, state, record)
    if plan.until_collision and collides(k, plan, record):
        state.ending[STOPS] = 1
    # A driver may demand what overflows, and kernels do not raise: the row ends with a status.
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(h)):
        state.ending[STATUS], state.ending[STOPS] = NOT_FINITE, 1
    if state.ending[STOPS]:
        _repeat(k, record)
    if state.ending[STOPS] or k == record.x.shape[1] - 1:
        state.ending[N_STEPS] = k + 1


@kernel
def _repeat(k, record):
    """Repeat instant k up to the end of the record."""
    for array in (record.x, record.y, record.h, record.v, record.a, record.offset):
        for e in range(array.shape[0]):
            array[e, k + 1 :] = array[e, k]
    for e in range(record.present.shape[0]):
        record.present[e, k + 1 :] = record.present[e, k]
    for e in range(record.lamps.shape[0]):
        record.lamps[e, k + 1 :] = record.lamps[e, k]
    for i in range(record.lights.shape[0]):
        record.lights[i, k + 1 :] = record.lights[i, k]
