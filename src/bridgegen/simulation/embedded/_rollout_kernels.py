"""N rows, each from its first instant to its last; or all of them by one instant, in lock-step.

Both ways run the same functions on the same arrays, so they give the same bits.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.compiled import kernel
from bridgegen.simulation.embedded._instant_kernels import after_driver, before_driver
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
    plan_of,
    record_of,
    roads_of,
    state_of,
)
from bridgegen.simulation.embedded.drivers import demand
from bridgegen.simulation.embedded.storyboard import start


@kernel
def simulate_rows(plan, networks, rows, states, records):
    """Roll out N rows, one after the other; ``rows`` is the road network of each."""
    plan = plan_of(plan)
    for i in range(len(rows)):
        roads = roads_of(networks, rows[i])
        state, record = state_of(states, i), record_of(records, i)
        start(plan, roads, state, record)
        for k in range(record.x.shape[1]):
            if state.ending[N_STEPS] > 0:
                break
            before_driver(k, plan, roads, state, record)
            demanded, curvature = demand(k, plan, roads, state, record)
            after_driver(k, demanded, curvature, plan, roads, state, record)


@kernel
def start_rows(plan, networks, rows, states, records):
    """Set the first instant of N rows."""
    plan = plan_of(plan)
    for i in range(len(rows)):
        start(plan, roads_of(networks, rows[i]), state_of(states, i), record_of(records, i))


@kernel
def before_drivers(k, plan, networks, rows, states, records):
    """Do the first half of instant k of the rows that still run."""
    plan = plan_of(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = roads_of(networks, rows[i])
            before_driver(k, plan, roads, state_of(states, i), record_of(records, i))


@kernel
def demand_rows(k, plan, networks, rows, states, records, demanded, curvature):
    """Ask the compiled driver of the rows that still run; fill ``(N,)`` arrays."""
    plan = plan_of(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = roads_of(networks, rows[i])
            demanded[i], curvature[i] = demand(
                k, plan, roads, state_of(states, i), record_of(records, i)
            )


@kernel
def after_drivers(k, demanded, curvature, plan, networks, rows, states, records):
    """Do the second half of instant k of the rows that still run."""
    plan = plan_of(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = roads_of(networks, rows[i])
            state, record = state_of(states, i), record_of(records, i)
            after_driver(k, demanded[i], curvature[i], plan, roads, state, record)
