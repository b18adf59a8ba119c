"""Triggers: which conditions hold at an instant, with their edges and delays, and what fires."""

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import inlined_kernel, kernel, run_kernel_at
from bridgegen.simulation.embedded._codes import (
    ALL,
    ANY,
    CLEARANCE,
    CLOSELY,
    COMPLETE,
    DELAY,
    DISTANCE,
    EDGE,
    ELEMENT_STATE,
    FALLING,
    FIRST_BY_ENTITY,
    LIMIT,
    NEVER_TRUE,
    NO_EDGE,
    OTHER,
    PROBE,
    PROBES,
    PROBES_END,
    QUANTITY,
    RISING,
    RULE,
    SIMULATION_TIME,
    SPEED,
    TIME_HEADWAY,
    TRAVELED_DISTANCE,
    WHO,
)
from bridgegen.simulation.embedded._memory_kernels import TICKS
from bridgegen.simulation.embedded._motion_kernels import STANDS
from bridgegen.simulation.embedded.conditions._relation_kernels import (
    SAME_VALUE,
    compare,
    compare_times,
)
from bridgegen.simulation.embedded.motion import leave_out_absent
from bridgegen.simulation.embedded.places._place_kernels import pose_of, way_ahead

# --- What a probe sees: an entity, two of them, a value, or an element of the storyboard ---
# A condition has a probe per triggering entity. Another kind of condition is a branch in
# ``look_one`` of ``_relation_kernels``, where all is that is seldom asked for.


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@inlined_kernel
def look(p, k, plan, state, record):
    """Return whether probe p sees at instant k what its condition asks for."""
    kind, e, other = plan.probes[p, PROBE], plan.probes[p, WHO], plan.probes[p, OTHER]
    rule, limit = plan.probes[p, RULE], state.slots[plan.probes[p, LIMIT]]
    if kind == SIMULATION_TIME:
        return compare_times(k * plan.dt, rule, limit)
    if kind == ELEMENT_STATE:
        return is_in_state(p, plan.probes, state.phase, state.stamps, state.looked)
    if kind == NEVER_TRUE:
        return False
    if kind >= DISTANCE:
        return look_at_pair(
            kind,
            rule,
            limit,
            record.x[other, k] - record.x[e, k],
            record.y[other, k] - record.y[e, k],
            record.v[e, k],
            record.h[e, k],
            record.v[other, k],
            record.h[other, k],
        )
    if kind == SPEED:
        return compare(record.v[e, k], rule, limit)
    if kind == TRAVELED_DISTANCE:
        return state.travelled[e] >= limit - SAME_VALUE
    return abs(record.v[e, k]) <= STANDS and state.stood[e] >= limit - SAME_VALUE  # STAND_STILL


@kernel
def look_at_pair(kind, rule, limit, dx, dy, v, h, other_v, other_h):
    """Return whether a condition on two entities holds; the other one is at (dx, dy) from it."""
    gap = elementary.hypot(dx, dy)
    if kind == DISTANCE:
        return compare(gap, rule, limit)
    if kind == TIME_HEADWAY:
        is_ahead = dx * elementary.cos(h) + dy * elementary.sin(h) >= 0.0
        return v > 0.0 and is_ahead and compare(gap / v, rule, limit)
    closing = dx * (v * elementary.cos(h) - other_v * elementary.cos(other_h)) + dy * (
        v * elementary.sin(h) - other_v * elementary.sin(other_h)
    )  # times the gap
    return closing > 0.0 and compare(gap * gap / closing, rule, limit)


@kernel
def is_in_state(p, probes, phase, stamps, looked):
    """Return whether an element of the storyboard is in a state, or has passed a transition.

    A transition is visible for one instant: the one in which it happens to conditions evaluated
    later in that instant, else the next one.
    """
    x, wanted = probes[p, WHO], probes[p, OTHER]
    if wanted <= COMPLETE:
        return phase[x] == wanted
    return stamps[x, wanted - COMPLETE - 1] > looked[p, 0]


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@inlined_kernel
def observe(k, plan, roads, state, record):
    """Record the values of all probes at instant k, and which conditions are true."""
    for i in range(plan.marks.shape[0]):
        state.marks[i, 0], state.marks[i, 1], state.marks[i, 2] = pose_of(
            plan.marks[i], k, plan, roads, state, record
        )
    if plan.looks_closely:
        for p in range(plan.probes.shape[0]):
            if plan.probes[p, PROBE] == CLEARANCE:
                state.along[p] = way_ahead(plan.probes[p, WHO], roads, state)
        run_kernel_at(plan.looks_closely, (k, plan, roads, state, record))
    for p in range(plan.probes.shape[0]):
        if plan.probes[p, CLOSELY] == 0:
            state.looked[p, 0] = state.looked[p, 1]
            state.observed[p] = look(p, k, plan, state, record)
            state.looked[p, 1] = state.ending[TICKS]
    if plan.comes_and_goes:
        leave_out_absent(plan.conditions, plan.probes, state.present, state.observed)
    for c in range(plan.conditions.shape[0]):
        conclude(c, k, plan.conditions, state.observed, state.history)


@inlined_kernel
def conclude(c, k, conditions, observed, history):
    """Record whether condition c is true at instant k, by any or all of its probes."""
    first, last, count = conditions[c, PROBES], conditions[c, PROBES_END], 0
    for p in range(first, last):
        count += observed[p]
    quantity = conditions[c, QUANTITY]
    if quantity == ANY:
        met = count > 0
    elif quantity == ALL:
        met = count == last - first
    else:
        met = count == 0
    history[c, k % history.shape[1]] = met


@kernel
def holds(c, k, conditions, history):
    """Return whether the condition, with its edge and delay, is met at instant k.

    An edge needs an earlier observation, so none is seen at the first instant.
    """
    edge, j = conditions[c, EDGE], k - conditions[c, DELAY]
    if j < 0:
        return False
    depth = history.shape[1]
    # A delay asks for the condition's value that long ago, also from before its element was in
    # standby (1.2, delay of a condition).
    then = history[c, j % depth]
    if edge == NO_EDGE:
        return then
    if j == 0:
        return False
    before = history[c, (j - 1) % depth]
    rises = then and not before
    falls = before and not then
    return (edge != FALLING and rises) or (edge != RISING and falls)


@kernel
def group_fires(g, k, plan, state):
    """Return whether a condition group is met as a whole.

    What it asks of the storyboard's elements is looked at anew: they may have changed since.
    """
    conditions, probes = plan.conditions, plan.probes
    for c in range(plan.groups[g, 0], plan.groups[g, 1]):
        first = conditions[c, PROBES]
        if probes[first, PROBE] == ELEMENT_STATE:
            for p in range(first, conditions[c, PROBES_END]):
                # Only of elements' states: a condition on what an action changes in the same
                # instant (values, lights, presence) sees it at the next one.
                state.observed[p] = is_in_state(p, probes, state.phase, state.stamps, state.looked)
                state.looked[p, 1] = state.ending[TICKS]
            conclude(c, k, conditions, state.observed, state.history)
        if not holds(c, k, conditions, state.history):
            return False
    return plan.groups[g, 1] > plan.groups[g, 0]


@kernel
def fires_by(trigger, k, plan, state):
    """Return whether any condition group of a trigger is met."""
    for g in range(plan.triggers[trigger, 0], plan.triggers[trigger, 1]):
        if group_fires(g, k, plan, state):
            return True
    return False


@kernel
def fires(trigger, k, plan, state):
    """Return whether a trigger fires at instant k; one that is missing (-1) always does."""
    return trigger < 0 or fires_by(trigger, k, plan, state)


@kernel
def select(trigger, k, plan, state):
    """Record which entities made a trigger fire, for actions that select them.

    They are those whose probes are true in a group that fires; if none is (the condition was true
    earlier, or is no longer), all entities that the condition names.
    """
    for e in range(state.selected.shape[0]):
        state.selected[e] = False
    if trigger >= 0:
        for g in range(plan.triggers[trigger, 0], plan.triggers[trigger, 1]):
            if group_fires(g, k, plan, state):
                for c in range(plan.groups[g, 0], plan.groups[g, 1]):
                    select_by(c, plan.conditions, plan.probes, state.observed, state.selected)


@kernel
def select_by(c, conditions, probes, observed, selected):
    """Add the entities that make condition c true."""
    first, last, seen = conditions[c, PROBES], conditions[c, PROBES_END], False
    if probes[first, PROBE] < FIRST_BY_ENTITY:
        return
    for p in range(first, last):
        seen = seen or observed[p]
    for p in range(first, last):
        if observed[p] or not seen:
            selected[probes[p, WHO]] = True
