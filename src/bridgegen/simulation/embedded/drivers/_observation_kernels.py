"""Observations of a user's own driver: the route ahead, the next light, and tracks."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import bundled, bundled_row, kernel
from bridgegen.drivers._ghost_kernels import haunt
from bridgegen.drivers._path_kernels import CURVATURE, locate, pose
from bridgegen.drivers._perception_kernels import perceive
from bridgegen.drivers._tracking_kernels import settings
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
)


@kernel
def observe(k, plan, roads, state, record, step, route, tracks):
    """Let the sensors look, and fill the route ahead ``(P, 4)`` and the tracks ``(M, 13)``.

    Returns:
        the distance to the next stop line of a light [m], +inf if there is none; and its state.
    """
    # Also with ideal perception: a replay in which a user's driver kept its own sensors would never
    # put harm down to perception.
    perceive(
        k, plan.dt, state.key[0], plan.ideal_perception, state.visible, record.x, record.y,
        record.h, record.v, plan.bodies, plan.kinds, state.lamps, state.weather,
        settings(plan.tracker, state.slots), state.sensors, state.tracks, record.detections,
    )  # fmt: skip
    haunt(k, plan, roads, state, record)
    for e in range(tracks.shape[0]):
        for i in range(tracks.shape[1]):
            tracks[e, i] = state.tracks[e + 1, i]
    on, station = state.on[0], state.station[0]
    path, n, ds = roads.paths[on], roads.counts[on], roads.steps[on]
    for p in range(route.shape[0]):
        s = station + p * step
        route[p, 0], route[p, 1], route[p, 2] = pose(path, n, ds, s)
        at, share = locate(n, ds, s)
        route[p, 3] = 0.0
        if share <= 1.0:  # else it is beyond the end, straight on
            bend = path[at, CURVATURE]
            route[p, 3] = bend + share * (path[at + 1, CURVATURE] - bend)
    stop, light = math.inf, 0
    if on == 0:  # stop lines along other paths are unknown
        front = station + plan.bodies[0, 2] + 0.5 * plan.bodies[0, 0]
        for number in range(roads.stops.shape[0]):
            ahead = roads.stops[number] - front
            if 0.0 <= ahead < stop:
                stop, light = ahead, int(state.lights[number])
    return stop, light


@kernel
def observe_rows(k, plan, networks, rows, states, records, step, route, tracks, stop, light):
    """Fill what `Observation` has of rows that run.

    ``route (N, P, 4)``, ``tracks (N, M, 13)``, ``stop (N,)`` and ``light (N,)`` int8.
    """
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads, state = bundled_row(networks, rows[i]), bundled_row(states, i)
            stop[i], light[i] = observe(
                k, plan, roads, state, bundled_row(records, i), step, route[i], tracks[i]
            )
