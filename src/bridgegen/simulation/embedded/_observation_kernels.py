"""What a driver in Python is told at an instant: the route ahead, and the others as tracks."""

import math

from bridgegen.compiled import kernel
from bridgegen.ego._path_kernels import CURVATURE, locate, pose
from bridgegen.simulation.embedded._memory_kernels import N_STEPS, record_of, roads_of, state_of

CONFIRMED = 2.0  # a track's state


@kernel
def observe_rows(k, plan, networks, rows, states, records, kinds, step, route, tracks):
    """Fill ``route (N, P, 4)`` and ``tracks (N, M, 12)`` of rows that run; see `Observation`."""
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] > 0:
            continue
        roads, state = roads_of(networks, rows[i]), state_of(states, i)
        record = record_of(records, i)
        path, n, ds = roads.paths[0], roads.counts[0], roads.steps[0]
        for p in range(route.shape[1]):
            s = state.station[0] + p * step
            route[i, p, 0], route[i, p, 1], route[i, p, 2] = pose(path, n, ds, s)
            at, share = locate(n, ds, s)
            route[i, p, 3] = 0.0
            if share <= 1.0:  # else it is beyond the end, straight on
                bend = path[at, CURVATURE]
                route[i, p, 3] = bend + share * (path[at + 1, CURVATURE] - bend)
        for e in range(1, record.x.shape[0]):
            x, y, h, v = record.x[e, k], record.y[e, k], record.h[e, k], record.v[e, k]
            track, centre = tracks[i, e - 1], plan.bodies[e, 2]
            track[0] = CONFIRMED
            track[1] = x + centre * math.cos(h)
            track[2] = y + centre * math.sin(h)
            track[3] = h
            track[4], track[5] = v * math.cos(h), v * math.sin(h)
            track[6], track[7] = plan.bodies[e, 0], plan.bodies[e, 1]
            track[8] = kinds[e]
            track[9] = 1.0
            track[10] = 0.0
            track[11] = k * plan.dt
