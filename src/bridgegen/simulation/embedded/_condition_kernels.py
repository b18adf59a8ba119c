"""Triggers: which conditions hold at an instant, and what fires.

The integer tables are the compiled storyboard; ``program.py`` tells their columns.
"""

import math

from bridgegen.compiled import kernel

SIMULATION_TIME, RELATIVE_DISTANCE, REACH_POSITION = 0, 1, 2
TIME_TO_COLLISION, TIME_HEADWAY, SPEED = 3, 4, 5
TRAVELED_DISTANCE, STAND_STILL, EVENT_ENDED = 6, 7, 8

GREATER, LESS, EQUAL, GREATER_EQUAL, LESS_EQUAL, NOT_EQUAL = 0, 1, 2, 3, 4, 5
NONE, RISING, FALLING, RISING_OR_FALLING = 0, 1, 2, 3


@kernel
def compare(value, rule, limit):
    """Apply an OpenSCENARIO Rule."""
    if rule == GREATER:
        return value > limit
    if rule == LESS:
        return value < limit
    if rule == GREATER_EQUAL:
        return value >= limit
    if rule == LESS_EQUAL:
        return value <= limit
    if rule == EQUAL:
        return value == limit
    return value != limit


@kernel
def observe_one(kind, rule, limit, now, v, travelled, stood, ended):
    """Return whether a condition on one entity, the time or an event holds."""
    if kind == SIMULATION_TIME:
        return compare(now, rule, limit)
    if kind == SPEED:
        return compare(v, rule, limit)
    if kind == TRAVELED_DISTANCE:
        return travelled >= limit
    if kind == STAND_STILL:
        return stood >= limit
    return ended


@kernel
def observe_pair(kind, rule, limit, dx, dy, v, h, other_v, other_h):
    """Return whether a condition on two entities holds; the other one is at (dx, dy) from it."""
    gap = math.hypot(dx, dy)
    if kind == RELATIVE_DISTANCE:
        return compare(gap, rule, limit)
    if kind == TIME_HEADWAY:
        return v > 0.0 and compare(gap / v, rule, limit)
    closing = dx * (v * math.cos(h) - other_v * math.cos(other_h)) + dy * (
        v * math.sin(h) - other_v * math.sin(other_h)
    )  # times the gap
    return closing > 0.0 and compare(gap * gap / closing, rule, limit)


@kernel
def holds(c, conditions, history, k):
    """Return whether the condition, with its edge and delay, is met at instant k.

    An edge needs an earlier observation, so none is seen at the first instant.
    """
    edge, j = conditions[c, 5], k - conditions[c, 6]
    if j < 0:
        return False
    depth = history.shape[1]
    then = history[c, j % depth]
    if edge == NONE:
        return then
    if j == 0:
        return False
    before = history[c, (j - 1) % depth]
    rises = then and not before
    falls = before and not then
    return (edge != FALLING and rises) or (edge != RISING and falls)


@kernel
def fires(trigger, triggers, groups, conditions, history, k):
    """Return whether any condition group of a trigger is met as a whole."""
    for g in range(triggers[trigger, 0], triggers[trigger, 1]):
        met = groups[g, 1] > groups[g, 0]
        for c in range(groups[g, 0], groups[g, 1]):
            if not holds(c, conditions, history, k):
                met = False
                break
        if met:
            return True
    return False
