"""What the storyboard does at an instant: conditions are looked at, acts run, events begin."""

import math

from bridgegen.compiled import inlined_kernel
from bridgegen.simulation.embedded._action_kernels import begin
from bridgegen.simulation.embedded._condition_kernels import (
    EVENT_ENDED,
    REACH_POSITION,
    SIMULATION_TIME,
    SPEED,
    fires,
    observe_one,
    observe_pair,
)
from bridgegen.simulation.embedded._memory_kernels import STOPS


@inlined_kernel
def observe(k, plan, roads, state, record):
    """Take down which conditions hold at instant k.

    Another kind of condition is a branch here, and its function in ``_condition_kernels``.
    """
    now, conditions = k * plan.dt, plan.conditions
    slot = k % state.history.shape[1]
    for c in range(conditions.shape[0]):
        kind, e, other = conditions[c, 0], conditions[c, 1], conditions[c, 2]
        rule, limit = conditions[c, 3], state.slots[conditions[c, 4]]
        x, y, v = record.x[e, k], record.y[e, k], record.v[e, k]
        if kind == REACH_POSITION:
            gap = math.hypot(x - roads.points[c, 0], y - roads.points[c, 1])
            state.history[c, slot] = gap <= limit
        elif kind < SPEED and kind != SIMULATION_TIME:
            state.history[c, slot] = observe_pair(
                kind, rule, limit, record.x[other, k] - x, record.y[other, k] - y,
                v, record.h[e, k], record.v[other, k], record.h[other, k],
            )  # fmt: skip
        else:
            ended = kind == EVENT_ENDED and state.event_ended[other]
            state.history[c, slot] = observe_one(
                kind, rule, limit, now, v, state.travelled[e], state.stood[e], ended
            )


@inlined_kernel
def decide(k, plan, roads, state, record):
    """Stop the scenario, start acts, end and begin events, as the triggers say at instant k."""
    ego_end = math.inf
    if plan.timed[0] < 0:
        ego_end = (roads.counts[0] - 1) * roads.steps[0]
    state.ending[STOPS] = _fires(0, k, plan, state) or state.station[0] >= ego_end
    for i in range(plan.acts.shape[0]):
        if not state.act_runs[i] and _fires(plan.acts[i], k, plan, state):
            state.act_runs[i] = True
    for i in range(plan.events.shape[0]):
        act, trigger, first, last = plan.events[i]
        if record.began[i] >= 0:
            if not state.event_ended[i]:
                ended = True
                for j in range(first, last):
                    ended = ended and state.action_ended[j]
                state.event_ended[i] = ended
            continue
        if not state.act_runs[act] or not _fires(trigger, k, plan, state):
            continue
        record.began[i] = k
        for j in range(first, last):
            begin(j, k, plan, roads, state, record)


@inlined_kernel
def _fires(trigger, k, plan, state):
    return fires(trigger, plan.triggers, plan.groups, plan.conditions, state.history, k)
