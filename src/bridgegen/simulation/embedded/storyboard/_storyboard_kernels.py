"""The storyboard: stories, acts, groups, maneuvers, events and actions, each in one of four phases.

Elements are in the order of the file, each before its children. In an instant, what is over ends
first (``finish``, children before parents), then triggers are looked at (``decide``, parents
before children). Source: ASAM OpenSCENARIO XML 1.3.1, 8.4, storyboard element execution.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import inlined_kernel
from bridgegen.simulation.embedded._codes import (
    ACT,
    ACTION,
    COMPLETE,
    COUNT,
    END,
    ENDED,
    EVENT,
    FIRST,
    GROUP,
    KIND,
    LAST,
    OFF,
    PARENT,
    RUNNING,
    STANDBY,
    START,
    STARTED,
    STOP,
    STORY,
)
from bridgegen.simulation.embedded._memory_kernels import STOPS
from bridgegen.simulation.embedded.conditions import fires
from bridgegen.simulation.embedded.drivers import ego_is_through
from bridgegen.simulation.embedded.storyboard._event_kernels import (
    enter,
    stop_element,
    trigger_event,
)


@inlined_kernel
def finish(k, plan, state):
    """End what is complete at instant k: an action by its own state, an element by its children's.

    An event or a group that may run again goes back to standby.
    """
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
