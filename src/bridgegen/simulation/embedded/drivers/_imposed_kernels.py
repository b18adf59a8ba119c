"""The state of a body by another simulator at an instant, which replaces its own motion."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import bundled, bundled_row, kernel
from bridgegen.drivers._path_kernels import project
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
)
from bridgegen.simulation.embedded._motion_kernels import STANDS
from bridgegen.simulation.embedded.drivers._ego_kernels import ego_is_through


@kernel
def impose(e, k, x, y, h, v, plan, roads, state, record):
    """Put body e where it is at instant k, and take note of how it has moved since the last one.

    It stays on the path that it was on: its station and its offset are its foot's on that path.
    """
    moved_x, moved_y = x - record.x[e, k], y - record.y[e, k]
    if k > 0:
        last_x, last_y = record.x[e, k - 1], record.y[e, k - 1]
        here = math.hypot(record.x[e, k] - last_x, record.y[e, k] - last_y)
        state.travelled[e] += math.hypot(x - last_x, y - last_y) - here
        record.a[e, k - 1] = (v - record.v[e, k - 1]) / plan.dt
        stands = k
        if v <= STANDS:
            while stands > 0 and record.v[e, stands - 1] <= STANDS:
                stands -= 1
        state.stood[e] = (k - stands) * plan.dt
    before = record.h[e, k - 1] if k > 0 else record.h[e, k]
    turns = round((before - h) / (2.0 * math.pi))
    record.x[e, k], record.y[e, k], record.v[e, k] = x, y, v
    record.h[e, k] = h + 2.0 * math.pi * turns
    p = state.on[e]
    if p < 0:
        state.line[e, 0] += moved_x
        state.line[e, 1] += moved_y
        return
    state.station[e], state.aside[e] = project(
        roads.paths[p], roads.counts[p], roads.steps[p], state.station[e], x, y
    )
    if e == 0:
        record.offset[e, k] = state.aside[e]
    to = state.to[e]
    if to >= 0:
        state.foot[e], _ = project(
            roads.paths[to], roads.counts[to], roads.steps[to], state.foot[e], x, y
        )


@kernel
def impose_rows(k, bodies, imposed, plan, networks, rows, states, records):
    """Impose ``(N, B, 4)`` x, y [m], h [rad], v [m/s] of the bodies ``(B,)`` on rows that run."""
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads, state = bundled_row(networks, rows[i]), bundled_row(states, i)
            record = bundled_row(records, i)
            for b in range(len(bodies)):
                x, y, h, v = imposed[i, b]
                impose(bodies[b], k, x, y, h, v, plan, roads, state, record)


@kernel
def egos_are_through(plan, networks, rows, states, through):
    """Fill ``(N,)`` bool: whether a driven ego is at the end of its route, or of the road."""
    plan = bundled(plan)
    for i in range(len(rows)):
        through[i] = ego_is_through(plan, bundled_row(networks, rows[i]), bundled_row(states, i))
