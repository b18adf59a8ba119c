"""Events that are triggered, and elements that are stopped: rare, and functions of their own."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import inlined_kernel, kernel
from bridgegen.simulation.embedded._codes import (
    ACTION,
    ADD_ENTITY,
    COMPLETE,
    CONTROL,
    COUNT,
    DOES,
    END,
    EVENT_NUMBER,
    FIRST,
    KIND,
    LAST,
    OFF,
    OVERRIDE,
    PARENT,
    PRIORITY,
    RUNNING,
    SELECTS,
    SKIP,
    SKIPPED,
    START,
    STARTED,
    STOPPED,
    WHOM,
)
from bridgegen.simulation.embedded._memory_kernels import TICKS
from bridgegen.simulation.embedded.conditions import select
from bridgegen.simulation.embedded.motion import stop_motion
from bridgegen.simulation.embedded.storyboard._action_kernels import begin


@inlined_kernel
def enter(x, transition, state):
    """Take down that an element passes a transition, and in which order."""
    state.ending[TICKS] += 1
    state.stamps[x, transition] = state.ending[TICKS]


@kernel
def trigger_event(x, k, plan, roads, state, record):
    """Start event x at instant k, or skip it, as its priority says in its maneuver."""
    maneuver = plan.elements[x, PARENT]
    priority = plan.elements[x, PRIORITY]
    other = maneuver + 1
    while other < plan.elements[maneuver, END]:
        if other != x and state.phase[other] == RUNNING:
            if priority == OVERRIDE:
                stop_element(other, k, plan, roads, state, record)
            elif priority == SKIP:
                enter(x, SKIPPED, state)
                state.executions[x] += 1
                if state.executions[x] >= plan.elements[x, COUNT]:
                    state.phase[x] = COMPLETE
                return
        other = plan.elements[other, END]
    state.executions[x] += 1
    number = plan.elements[x, EVENT_NUMBER]
    if record.began[number] < 0:
        record.began[number] = k
    for y in range(x, plan.elements[x, END]):
        state.phase[y] = RUNNING
        enter(y, STARTED, state)
    select(plan.elements[x, START], k, plan, state)
    # All begin at once: who is there, and who drives, is clear before anybody is told what to do.
    for turn in range(2):
        for j in range(plan.elements[x, FIRST], plan.elements[x, LAST]):
            if (plan.actions[j, DOES] in (ADD_ENTITY, CONTROL)) != (turn == 0):
                continue
            state.action_ended[j] = False
            if plan.actions[j, SELECTS] and not state.selected[plan.actions[j, WHOM]]:
                state.action_ended[j] = True
            else:
                begin(j, k, plan, roads, state, record)


@kernel
def stop_element(x, k, plan, roads, state, record):
    """Stop an element and all that is in it, at instant k; it will not run again."""
    for y in range(x, plan.elements[x, END]):
        if state.phase[y] == OFF or state.phase[y] == COMPLETE:
            continue
        if plan.elements[y, KIND] == ACTION:
            for j in range(plan.elements[y, FIRST], plan.elements[y, LAST]):
                if not state.action_ended[j]:
                    stop_motion(j, k, plan, roads, state, record)
                    state.action_ended[j] = True
        state.phase[y] = COMPLETE
        enter(y, STOPPED, state)
