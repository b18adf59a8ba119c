"""Entities that come and go: who is not there is not moved, seen, met or looked at.

It is there, or not, from the instant on at which it is added or deleted; where its road ends, it is
not there any more from the next instant on, unless the scenario has bodies stand there. While it is
not, its states are those of its last instant, and its actions are over before they begin.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel, run_kernel_at
from bridgegen.drivers._prediction_kernels import LOST
from bridgegen.drivers._tracking_kernels import forget
from bridgegen.simulation.embedded._codes import (
    ADD_ENTITY,
    ALL,
    COLLISION,
    DISTANCE,
    DOES,
    FIRST_ACROSS,
    FIRST_BY_ENTITY,
    FIRST_GLOBAL,
    FROM_SENSORS,
    FROM_TRAFFIC,
    KEEP_ASIDE,
    OTHER,
    PROBE,
    PROBES,
    PROBES_END,
    QUANTITY,
    REF,
    RELATIVE_ANGLE,
    RELATIVE_SPEED,
    ROW,
    SPEED_DIFFERENCE,
    TELEPORT,
    TO_SENSORS,
    TO_TRAFFIC,
    WHO,
    WHOM,
)
from bridgegen.simulation.embedded._memory_kernels import OK, STATUS
from bridgegen.simulation.embedded.motion._across_kernels import OF, stop_lateral
from bridgegen.simulation.embedded.motion._follow_kernels import end_quest
from bridgegen.simulation.embedded.motion._speed_kernels import stop_longitudinal
from bridgegen.simulation.embedded.places._place_kernels import body_pose, end_follow, put


@kernel
def goes_by(j, plan):
    """Return the entity by which action j moves its own, -1 if none."""
    kind = plan.actions[j, DOES]
    if RELATIVE_SPEED <= kind < FIRST_ACROSS or kind == KEEP_ASIDE:
        return plan.courses[plan.actions[j, ROW], REF]
    if FIRST_ACROSS <= kind < FIRST_GLOBAL:
        return plan.laterals[plan.actions[j, ROW], OF]
    return -1


@kernel
def is_pointless(j, plan, state):
    """Return whether action j is of, or goes by, who is not there, or moves who is towed."""
    kind, other = plan.actions[j, DOES], goes_by(j, plan)
    if kind >= FIRST_GLOBAL or kind == ADD_ENTITY:
        return False
    e = plan.actions[j, WHOM]
    if other >= 0 and not state.present[other]:
        return True
    return not state.present[e] or (state.tower[e] >= 0 and kind >= TELEPORT)


@kernel
def begin_add(j, k, plan, roads, state, record):
    """Begin, and end, action j: its entity is there from instant k on, where it says.

    Its speed is what the storyboard asked of it last. Who is there already stays where it is.
    """
    e = plan.actions[j, WHOM]
    state.action_ended[j] = True
    if state.present[e]:
        return
    put(e, plan.actions[j, ROW], k, plan, roads, state, record)
    if state.ending[STATUS] != OK:
        return
    state.present[e] = record.present[e, k] = True
    look_round(state)
    record.x[e, k], record.y[e, k], record.h[e, k] = body_pose(e, roads, state)
    record.v[e, k] = state.command[e]


@kernel
def begin_delete(j, k, plan, roads, state, record):
    """Begin, and end, action j: its entity is not there from instant k on."""
    gone = plan.actions[j, WHOM]
    state.action_ended[j] = True
    if not state.present[gone]:
        return
    record.present[gone, k] = False
    leave(gone, plan, roads, state)


@kernel
def begin_show(j, k, plan, roads, state, record):
    """Begin, and end, action j: who sees its entity from instant k on."""
    e = plan.actions[j, WHOM]
    state.hidden[e, FROM_SENSORS] = plan.actions[j, TO_SENSORS] == 0
    state.hidden[e, FROM_TRAFFIC] = plan.actions[j, TO_TRAFFIC] == 0
    state.action_ended[j] = True
    look_round(state)


@kernel
def look_round(state):
    """Set whom drivers may see: who is there and not hidden; the ego's, none of its trailers."""
    for e in range(state.present.shape[0]):
        tower = state.tower[e]
        while tower > 0:
            tower = state.tower[tower]
        there = state.present[e]
        state.visible[e] = there and not state.hidden[e, FROM_SENSORS] and tower < 0
        state.minded[e] = there and not state.hidden[e, FROM_TRAFFIC]


@kernel
def leave(gone, plan, roads, state):
    """Let an entity be there no more: what it does is over, and nobody goes by it any more."""
    state.present[gone], state.tower[gone] = False, -1
    look_round(state)
    for e in range(state.present.shape[0]):
        running = state.speed_action[e]
        if running >= 0 and (e == gone or goes_by(running, plan) == gone):
            stop_longitudinal(running, plan, state)
            state.action_ended[running] = True
        running = state.lateral_action[e]
        if running >= 0 and (e == gone or goes_by(running, plan) == gone):
            stop_lateral(running, plan, state)
            state.action_ended[running] = True
    if state.waits[gone] >= 0:
        state.action_ended[state.waits[gone]] = True
        state.waits[gone] = -1
    end_follow(gone, state)
    end_quest(gone, state)
    state.stood[gone] = 0.0
    # Dropped, not coasted: the storyboard decides that it is gone, which no sensor could explain.
    forget(state.tracks, gone)
    for array in (state.sensors, state.around, state.attention):
        array[gone] = 0.0
    first = roads.hypothesis_first
    if gone + 1 < first.shape[0]:
        state.feet[first[gone] : first[gone + 1]] = LOST


@kernel
def note_presence(k, plan, roads, state, record):
    """Record who is there at the instant after k, where all but the trailers are already."""
    if plan.tows_trailers:
        run_kernel_at(plan.tows_trailers, (k, plan, roads, state, record))
    for e in range(record.present.shape[0] if k < record.x.shape[1] - 1 else 0):
        record.present[e, k + 1] = state.present[e]


@kernel
def stay_away(e, k, record):
    """Let an entity that is not there keep its states at the instant after k."""
    keep_place(e, k, record)
    record.a[e, k] = 0.0


@kernel
def keep_place(e, k, record):
    """Repeat an entity's place and speed at the instant after k."""
    if k < record.x.shape[1] - 1:
        for array in (record.x, record.y, record.h, record.v, record.offset):
            array[e, k + 1] = array[e, k]


@kernel
def leave_out_absent(conditions, probes, present, observed):
    """Correct what probes see: nobody who is not there meets a condition, or is met.

    Who is not there does not count among all that must meet one, but for one at least.
    """
    for c in range(conditions.shape[0]):
        first, last = conditions[c, PROBES], conditions[c, PROBES_END]
        if probes[first, PROBE] < FIRST_BY_ENTITY:
            continue
        # The standard is silent on who is absent. esmini lets those count that are there, and asks
        # for one at least.
        there = 0
        for p in range(first, last):
            there += present[probes[p, WHO]]
        for p in range(first, last):
            kind, other = probes[p, PROBE], probes[p, OTHER]
            if not present[probes[p, WHO]]:
                observed[p] = there > 0 and conditions[c, QUANTITY] == ALL
            elif kind >= DISTANCE or kind in (SPEED_DIFFERENCE, RELATIVE_ANGLE, COLLISION):
                observed[p] = observed[p] and (other < 0 or present[other])
