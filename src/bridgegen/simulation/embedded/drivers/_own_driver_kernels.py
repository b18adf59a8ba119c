"""The user's own compiled driver in the rollout: called by the address of its code."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import bundled, bundled_row, call_at, kernel
from bridgegen.drivers._gap_kernels import led_aside
from bridgegen.drivers.interface import ROUTE_STEP
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
    NO_CONTROL,
    RAISED,
    STATUS,
    STOPS,
)
from bridgegen.simulation.embedded.drivers._conflict_view_kernels import remember, see_conflicts
from bridgegen.simulation.embedded.drivers._lane_view_kernels import see_lanes
from bridgegen.simulation.embedded.drivers._map_view_kernels import see_map
from bridgegen.simulation.embedded.drivers._observation_kernels import observe

EGO, SCENE = 10, 9  # inputs on the ego, and after them on the scene
N_INPUTS = EGO + SCENE  # as `bridgegen.drivers.compiled` names them
ACCELERATION, CURVATURE, RETURNED = 0, 1, 2
ANSWER = 3


@kernel
def fill_inputs(k, plan, roads, state, record):
    """Fill its inputs at instant k."""
    inputs = state.inputs
    inputs[0] = k * plan.dt
    inputs[1], inputs[2] = record.x[0, k], record.y[0, k]
    inputs[3], inputs[4] = record.h[0, k], record.v[0, k]
    inputs[5] = record.a[0, k - 1] if k > 0 else 0.0
    inputs[6], inputs[7] = state.command[0], record.offset[0, k]
    if roads.changes.shape[0] > 0:
        inputs[7] -= led_aside(roads.changes, state.on[0], state.station[0])
    inputs[8], inputs[9] = observe(
        k, plan, roads, state, record, ROUTE_STEP, state.ahead, state.others
    )
    for i in range(SCENE):
        inputs[EGO + i] = plan.scene[i]
    if state.lanes.shape[0] > 0:
        see_lanes(plan.bodies[0], roads, state, state.lanes)
    if state.place.shape[0] > 0:
        see_map(k, roads, record, state.nearby, state.place)
        for i in range(state.signals.shape[0]):
            state.signals[i] = state.lights[i]
    if state.conflicts.shape[0] > 0:
        see_conflicts(k, plan, roads, state, record, state.conflicts)
    if state.past.shape[0] > 0:
        remember(k, plan.dt, state.others, state.past, state.tracked)


@kernel
def ask(k, plan, roads, state, record):
    """Return the acceleration [m/s²] and curvature [1/m] that it demands at instant k.

    If it raises an error or its demand is not finite, the row ends.
    """
    inputs, answer = state.inputs, state.answer
    fill_inputs(k, plan, roads, state, record)
    # A C callback cannot raise: it prints the error and returns, before it has set this.
    answer[RETURNED] = 0.0
    call_at(
        plan.own_code,
        (
            inputs[EGO:],
            inputs[:EGO],
            state.ahead,
            state.others,
            state.mind,
            answer,
            state.lanes,
            roads.pieces,
            state.place,
            state.signals,
            state.conflicts,
            state.tracked,
        ),
    )
    if answer[RETURNED] == 0.0:
        state.ending[STATUS], state.ending[STOPS] = RAISED, 1
        return 0.0, 0.0
    if not (math.isfinite(answer[ACCELERATION]) and math.isfinite(answer[CURVATURE])):
        state.ending[STATUS], state.ending[STOPS] = NO_CONTROL, 1
        return 0.0, 0.0
    return answer[ACCELERATION], answer[CURVATURE]


@kernel
def fill_input_rows(k, plan, networks, rows, states, records):
    """Fill its inputs at instant k for the running rows."""
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = bundled_row(networks, rows[i])
            fill_inputs(k, plan, roads, bundled_row(states, i), bundled_row(records, i))
