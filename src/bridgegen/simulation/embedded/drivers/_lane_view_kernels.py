"""Observations of a user's own driver that wants "lanes": the road along its route.

A view is a row of ``LANES`` numbers in the order of `bridgegen.drivers.compiled.LANES`.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import bundled_row, kernel
from bridgegen.drivers._path_kernels import H, X, Y
from bridgegen.drivers.interface import ROUTE_POINTS, ROUTE_STEP
from bridgegen.drivers.lane_tables import BESIDE, JUNCTION, LANE, LIMIT, WIDTH
from bridgegen.simulation.embedded._memory_kernels import N_STEPS

LIMITS, WIDTHS, JUNCTIONS, BESIDES = 0, ROUTE_POINTS, 2 * ROUTE_POINTS, 3 * ROUTE_POINTS
ENDS = BESIDES + (LANE - BESIDE) * ROUTE_POINTS
GOAL, STOP_SIGN, CROSSWALK = ENDS + 1, ENDS + 4, ENDS + 5
LANES = CROSSWALK + 4


@kernel
def see_lanes(body, roads, state, view):
    """Fill a view ``(LANES,)``; ``body`` is the ego's row of bodies."""
    on, s = state.on[0], state.station[0]
    path, n, ds = roads.paths[on], roads.counts[on], roads.steps[on]
    known = on == 0 and roads.lanes.shape[0] > 0
    for p in range(ROUTE_POINTS):
        row = min(int((s + p * ROUTE_STEP) / ds), n - 1) if known else 0
        view[LIMITS + p] = roads.lanes[row, LIMIT] if known else math.inf
        view[WIDTHS + p] = roads.lanes[row, WIDTH] if known else 0.0
        view[JUNCTIONS + p] = roads.lanes[row, JUNCTION] if known else 0.0
        for i in range(LANE - BESIDE):
            view[BESIDES + (LANE - BESIDE) * p + i] = roads.lanes[row, BESIDE + i] if known else 0.0
    view[ENDS] = (n - 1) * ds - s
    view[GOAL], view[GOAL + 1] = path[n - 1, X], path[n - 1, Y]
    view[GOAL + 2] = path[n - 1, H]
    front, rear = s + body[2] + 0.5 * body[0], s + body[2] - 0.5 * body[0]
    view[STOP_SIGN] = math.inf
    for i in range(4):
        view[CROSSWALK + i] = math.inf
    if not known:
        return
    for i in range(roads.halts.shape[0]):
        ahead = roads.halts[i] - front
        if 0.0 <= ahead < view[STOP_SIGN]:
            view[STOP_SIGN] = ahead
    for i in range(roads.crosswalks.shape[0]):
        enter, leave, right, left = roads.crosswalks[i]
        if leave >= rear and enter - front < view[CROSSWALK]:
            view[CROSSWALK], view[CROSSWALK + 1] = enter - front, leave - rear
            view[CROSSWALK + 2], view[CROSSWALK + 3] = left, right


@kernel
def see_lanes_of_rows(body, networks, rows, states, views):
    """Fill the views ``(N, LANES)`` of rows that run."""
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            see_lanes(body, bundled_row(networks, rows[i]), bundled_row(states, i), views[i])
