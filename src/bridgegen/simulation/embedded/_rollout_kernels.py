"""N rows, each from its first instant to its last; or all of them by one instant, in lock-step.

Both ways run the same functions on the same arrays, so they give the same bits.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from numba import float64, int64

from bridgegen.base.compiled import bundled, bundled_row, inlined_kernel, kernel, run_kernel_at
from bridgegen.simulation.embedded._instant_kernels import (
    after_driver,
    before_driver,
    move_driven,
    move_others,
)
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
)
from bridgegen.simulation.embedded.drivers import demand, take
from bridgegen.simulation.embedded.storyboard import start


@kernel
def simulate_rows(plan, networks, rows, states, records):
    """Roll out N rows, one after the other; ``rows`` is the road network of each."""
    plan = bundled(plan)
    for i in range(len(rows)):
        roads = bundled_row(networks, rows[i])
        simulate_row(plan, roads, bundled_row(states, i), bundled_row(records, i))


@kernel
def simulate_rows_at(address, plan, networks, rows, states, records):
    """Do as `simulate_rows` with ``simulate_row`` at an address; see `specialised`."""
    plan = bundled(plan)
    for i in range(len(rows)):
        roads = bundled_row(networks, rows[i])
        row = plan, roads, bundled_row(states, i), bundled_row(records, i)
        run_kernel_at(address, row)


@inlined_kernel
def simulate_row(plan, roads, state, record):
    """Roll out one row from its first instant to its last; all four are bundles."""
    start(plan, roads, state, record)
    # A ``for`` over a range, not a counter before a ``while``: that has two types for Numba, which
    # compiles the whole chain of an instant twice.
    for k in range(record.x.shape[1]):
        if state.ending[N_STEPS] > 0:
            break
        before_driver(k, plan, roads, state, record)
        demanded, curvature = demand(k, plan, roads, state, record)
        after_driver(k, demanded, curvature, plan, roads, state, record)


PARTS = ((after_driver, (int64, float64, float64)), (before_driver, (int64,)))
"""Parts of `simulate_rows`, the last first, with the types of what they take before bundles."""


@kernel
def start_rows(plan, networks, rows, states, records):
    """Set the first instant of N rows."""
    plan = bundled(plan)
    for i in range(len(rows)):
        start(plan, bundled_row(networks, rows[i]), bundled_row(states, i), bundled_row(records, i))


@kernel
def before_drivers(k, plan, networks, rows, states, records):
    """Do the first half of instant k of the rows that still run."""
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = bundled_row(networks, rows[i])
            before_driver(k, plan, roads, bundled_row(states, i), bundled_row(records, i))


@kernel
def demand_rows(k, plan, networks, rows, states, records, demanded, curvature):
    """Ask the compiled driver of the rows that still run; fill ``(N,)`` arrays."""
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = bundled_row(networks, rows[i])
            demanded[i], curvature[i] = demand(
                k, plan, roads, bundled_row(states, i), bundled_row(records, i)
            )


@kernel
def after_drivers(k, demanded, curvature, plan, networks, rows, states, records):
    """Do the second half of instant k of the rows that still run."""
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = bundled_row(networks, rows[i])
            state, record = bundled_row(states, i), bundled_row(records, i)
            after_driver(k, demanded[i], curvature[i], plan, roads, state, record)


@kernel
def move_driven_rows(k, demanded, curvature, plan, networks, rows, states, records):
    """Move the egos of the rows that still run on from instant k; see `together`."""
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = bundled_row(networks, rows[i])
            state, record = bundled_row(states, i), bundled_row(records, i)
            move_driven(k, demanded[i], curvature[i], plan, roads, state, record)


@kernel
def move_others_rows(k, driven, plan, networks, rows, states, records):
    """Move all but the egos of the rows that still run on from instant k, or end them.

    ``driven`` ``(N, B, 8)``: other vehicles with drivers as `take` has it, and their numbers.
    """
    plan = bundled(plan)
    after = min(k + 1, records.x.shape[2] - 1)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads = bundled_row(networks, rows[i])
            state, record = bundled_row(states, i), bundled_row(records, i)
            for b in range(driven.shape[1]):
                e = int(driven[i, b, 7])
                if state.given[e]:
                    take(e, k, driven[i, b], roads, state, record)
            x, y, h = record.x[0, after], record.y[0, after], record.h[0, after]
            move_others(k, x, y, h, plan, roads, state, record)
