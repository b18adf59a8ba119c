"""What careful drivers do where no other actor is in their way: bends, red lights, lane changes."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._gap_kernels import await_gap, is_other_lanes, leads_on
from bridgegen.drivers._lights_kernels import stop_at_lights
from bridgegen.drivers._reference_kernels import STOPS_FOR
from bridgegen.drivers._speed_kernels import bend_speed
from bridgegen.drivers._weather_columns import FRICTION


@kernel
def cruise(k, plan, roads, state, record):
    """Return the speed that bends allow [m/s], and the acceleration that lights ask for [m/s²].

    So does waiting for a gap where the route changes lanes. ``state.heeded`` becomes the bodies
    that the driver reacts to besides.
    """
    waits = math.inf
    front = plan.bodies[0, 2] + 0.5 * plan.bodies[0, 0]
    for e in range(len(state.heeded)):
        state.heeded[e] = state.visible[e]
    if roads.changes.shape[0] > 0:
        waits = await_gap(k, plan.dt, False, plan, roads, state, record)
        for e in range(1, len(state.heeded)):
            state.heeded[e] &= not is_other_lanes(e, record.v[0, k], front, roads, state)
    p, s, v = state.on[0], state.station[0], record.v[0, k]
    lines = roads.stops if leads_on(roads.changes, p) else roads.stops[:0]
    stopping = int(state.mind[STOPS_FOR]) - 1
    asked, stops_for = stop_at_lights(lines, state.lights, s, front, v, math.inf, stopping)
    state.mind[STOPS_FOR] = stops_for + 1.0
    planned = bend_speed(
        roads.paths[p],
        roads.bends[p],
        roads.counts[p],
        roads.steps[p],
        s,
        v,
        state.command[0],
        state.weather[FRICTION],
    )
    return planned, min(asked, waits)
