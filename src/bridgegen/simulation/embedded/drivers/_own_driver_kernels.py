"""The user's own compiled driver in the rollout: it is called where its machine code lies."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.compiled import call_at, kernel
from bridgegen.ego.interface import ROUTE_STEP
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
    NO_CONTROL,
    RAISED,
    STATUS,
    STOPS,
    plan_of,
    record_of,
    roads_of,
    state_of,
)
from bridgegen.simulation.embedded.drivers._observation_kernels import observe

EGO, SCENE = 10, 9  # numbers that it is told of the ego, and after them of the scene
TOLD = EGO + SCENE  # as `bridgegen.ego.compiled` names them
ACCELERATION, CURVATURE, RETURNED = 0, 1, 2
ANSWER = 3


@kernel
def tell(k, plan, roads, state, record):
    """Fill what it is told at instant k."""
    told = state.told
    told[0] = k * plan.dt
    told[1], told[2] = record.x[0, k], record.y[0, k]
    told[3], told[4] = record.h[0, k], record.v[0, k]
    told[5] = record.a[0, k - 1] if k > 0 else 0.0
    told[6], told[7] = state.command[0], record.offset[0, k]
    told[8], told[9] = observe(k, plan, roads, state, record, ROUTE_STEP, state.ahead, state.others)
    for i in range(SCENE):
        told[EGO + i] = plan.scene[i]


@kernel
def ask(k, plan, roads, state, record):
    """Return the acceleration [m/s²] and curvature [1/m] that it demands at instant k.

    Where it raises an error or demands what is not finite, the row ends.
    """
    told, answer = state.told, state.answer
    tell(k, plan, roads, state, record)
    answer[RETURNED] = 0.0
    call_at(
        plan.own_code,
        (told[EGO:], told[:EGO], state.ahead, state.others, state.mind, answer),
    )
    if answer[RETURNED] == 0.0:
        state.ending[STATUS], state.ending[STOPS] = RAISED, 1
        return 0.0, 0.0
    if not (math.isfinite(answer[ACCELERATION]) and math.isfinite(answer[CURVATURE])):
        state.ending[STATUS], state.ending[STOPS] = NO_CONTROL, 1
        return 0.0, 0.0
    return answer[ACCELERATION], answer[CURVATURE]


@kernel
def tell_rows(k, plan, networks, rows, states, records):
    """Fill what it is told at instant k of rows that run."""
    plan = plan_of(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = roads_of(networks, rows[i])
            tell(k, plan, roads, state_of(states, i), record_of(records, i))
