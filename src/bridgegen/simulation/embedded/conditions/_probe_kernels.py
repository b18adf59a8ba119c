"""What a probe sees: an entity, two of them, a value, or an element of the storyboard.

A condition has a probe per triggering entity. Another kind of condition is a branch in ``look_one``
of ``_relation_kernels``, where all is that is seldom asked for.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import inlined_kernel, kernel
from bridgegen.simulation.embedded._codes import (
    COMPLETE,
    DISTANCE,
    ELEMENT_STATE,
    LIMIT,
    NEVER_TRUE,
    OTHER,
    PROBE,
    RULE,
    SIMULATION_TIME,
    SPEED,
    TIME_HEADWAY,
    TRAVELED_DISTANCE,
    WHO,
)
from bridgegen.simulation.embedded._motion_kernels import STANDS
from bridgegen.simulation.embedded.conditions._relation_kernels import (
    SAME_VALUE,
    compare,
    compare_times,
)


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
            kind, rule, limit, record.x[other, k] - record.x[e, k],
            record.y[other, k] - record.y[e, k], record.v[e, k], record.h[e, k],
            record.v[other, k], record.h[other, k],
        )  # fmt: skip
    if kind == SPEED:
        return compare(record.v[e, k], rule, limit)
    if kind == TRAVELED_DISTANCE:
        return state.travelled[e] >= limit - SAME_VALUE
    return abs(record.v[e, k]) <= STANDS and state.stood[e] >= limit - SAME_VALUE  # STAND_STILL


@kernel
def look_at_pair(kind, rule, limit, dx, dy, v, h, other_v, other_h):
    """Return whether a condition on two entities holds; the other one is at (dx, dy) from it."""
    gap = math.hypot(dx, dy)
    if kind == DISTANCE:
        return compare(gap, rule, limit)
    if kind == TIME_HEADWAY:
        is_ahead = dx * math.cos(h) + dy * math.sin(h) >= 0.0
        return v > 0.0 and is_ahead and compare(gap / v, rule, limit)
    closing = dx * (v * math.cos(h) - other_v * math.cos(other_h)) + dy * (
        v * math.sin(h) - other_v * math.sin(other_h)
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
