"""The storyboard: stories, acts, groups, maneuvers, events and actions, each in one of four phases.

Elements are in the order of the file, each before its children. In an instant, what is over ends
first (``finish``, children before parents), then triggers are looked at (``decide``, parents
before children). Source: ASAM OpenSCENARIO XML 1.3.1, 8.4, storyboard element execution.
"""

from bridgegen.base.compiled import inlined_kernel, kernel
from bridgegen.simulation.embedded._codes import (
    ACT,
    ACTION,
    ADD_ENTITY,
    COMPLETE,
    CONTROL,
    COUNT,
    DOES,
    END,
    ENDED,
    EVENT,
    EVENT_NUMBER,
    FIRST,
    GROUP,
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
    STANDBY,
    START,
    STARTED,
    STOP,
    STOPPED,
    STORY,
    WHOM,
)
from bridgegen.simulation.embedded._memory_kernels import STOPS, TICKS
from bridgegen.simulation.embedded.conditions import fires, select
from bridgegen.simulation.embedded.drivers import ego_is_through
from bridgegen.simulation.embedded.motion import stop_motion
from bridgegen.simulation.embedded.storyboard._start_kernels import begin

# --- Events that are triggered, and elements that are stopped: rare, and functions of their own ---


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


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
            # A skipped event counts as an execution (8.4.2.1); esmini has it wait.
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
        # A stopTransition, after which it does not run again (8.4.2); in esmini an overridden event
        # has an endTransition, and may.
        state.phase[y] = COMPLETE
        enter(y, STOPPED, state)


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@inlined_kernel
def finish(k, plan, state):
    """End what is complete at instant k: an action by its own state, an element by its children's.

    An event or a group that may run again goes back to standby.
    """
    # Backwards, for children stand after their parents: an element can end in the same instant as
    # its last child.
    for x in range(plan.elements.shape[0] - 1, -1, -1):
        if state.phase[x] != RUNNING:
            continue
        kind, over = plan.elements[x, KIND], True
        if kind == ACTION:
            for j in range(plan.elements[x, FIRST], plan.elements[x, LAST]):
                over = over and state.action_ended[j]
        else:
            child = x + 1
            while over and child < plan.elements[x, END]:
                over = state.phase[child] == COMPLETE
                child = plan.elements[child, END]
        if over:
            again = state.executions[x] < plan.elements[x, COUNT]
            state.phase[x] = STANDBY if again else COMPLETE
            enter(x, ENDED, state)


@inlined_kernel
def decide(k, plan, roads, state, record):
    """Stop the scenario, start and stop elements, by the triggers at instant k."""
    if fires(0, k, plan, state) or ego_is_through(plan, roads, state):
        state.ending[STOPS] = 1
    for x in range(plan.elements.shape[0]):
        phase, kind = state.phase[x], plan.elements[x, KIND]
        if phase == COMPLETE or kind == ACTION:
            continue
        if kind != STORY and state.phase[plan.elements[x, PARENT]] != RUNNING:
            continue
        if phase == OFF:
            state.phase[x] = STANDBY
        trigger = plan.elements[x, STOP]
        if kind == ACT and trigger >= 0 and fires(trigger, k, plan, state):
            stop_element(x, k, plan, roads, state, record)
            continue
        if phase == RUNNING:
            continue
        # A group's first start is its act's; to start again, it needs the act's trigger again.
        waits = kind in (ACT, EVENT) or (kind == GROUP and state.executions[x] > 0)
        if waits and not fires(plan.elements[x, START], k, plan, state):
            continue
        if kind == EVENT:
            trigger_event(x, k, plan, roads, state, record)
            continue
        state.phase[x] = RUNNING
        enter(x, STARTED, state)
        state.executions[x] += 1
        if kind == GROUP:
            for child in range(x + 1, plan.elements[x, END]):
                state.phase[child], state.executions[child] = OFF, 0
