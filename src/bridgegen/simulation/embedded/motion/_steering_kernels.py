"""Motion along a path of a vehicle with commanded speeds and lateral positions.

Its state is ``(5,)`` float64, the columns below; its course ``(·, 4)``: time [s], x, y [m], heading
[rad] of the reference point.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import locate, pose
from bridgegen.simulation.embedded._motion_kernels import shifted

STATION, ASIDE, SPEED, SLIDE, TURN = range(5)
"""Columns of a motion along a path: metres along the path and to its left; speed [m/s], its part
across the lane; turn of the nose [rad] from the path's direction."""

REACH = 1.0  # s, in which it reaches its commanded position
SLOPE = 0.15  # most of its speed that leads across the lane: it turns its nose by 9 degrees at most
BEND = 0.15  # 1/m, of its way across the lane: a car turns tighter only to park
SLIDE_RATE = 1.0  # m/s², of the speed across: comfortable lane keeping has half, evasion four times
CURVATURE_COLUMN = 5


@kernel
def steer(path, n, ds, state, speed, place, rate, braking, dt, first, steps, course):
    """Drive on for some steps, and write where it is after each.

    Args:
        path: ``(L, 6)``, see ``ego._path_kernels``.
        n: how many samples of it count.
        ds: [m] between two.
        state: ``(5,)``, changed.
        speed: [m/s] that it makes for.
        place: [m] left of the path that it makes for.
        rate: of its acceleration at most [m/s²].
        braking: of its deceleration at most [m/s²].
        dt: [s].
        first: the row of ``course`` that holds where it is now.
        steps: how many to take, as far as ``course`` reaches.
        course: ``(T, 4)``, filled from ``first + 1`` on.
    """
    for k in range(first + 1, min(first + steps + 1, course.shape[0])):
        v, w = state[SPEED], state[SLIDE]
        faster = min(max(speed, v - braking * dt, 0.0), v + rate * dt)
        wanted = (place - state[ASIDE]) / REACH
        slide = w + min(max(wanted - w, -SLIDE_RATE * dt), SLIDE_RATE * dt)
        if faster > 1e-9:
            turn = elementary.asin(min(max(slide / faster, -SLOPE), SLOPE))
            most = BEND * 0.5 * (v + faster) * dt
            state[TURN] += min(max(turn - state[TURN], -most), most)
        slide = faster * elementary.sin(state[TURN])
        along = 0.5 * (math.sqrt(v * v - w * w) + math.sqrt(faster * faster - slide * slide)) * dt
        i, f = locate(n, ds, state[STATION])
        f = min(max(f, 0.0), 1.0)
        bend = path[i, CURVATURE_COLUMN] + f * (
            path[i + 1, CURVATURE_COLUMN] - path[i, CURVATURE_COLUMN]
        )
        # Its way is along its own line, which is longer or shorter than the path's in a bend.
        state[STATION] += along / (1.0 - bend * state[ASIDE])
        state[ASIDE] += 0.5 * (w + slide) * dt
        state[SPEED], state[SLIDE] = faster, slide
        note(path, n, ds, state, k, k * dt, course)


@kernel
def note(path, n, ds, state, k, t, course):
    """Write where it is into row k."""
    x, y, h = pose(path, n, ds, state[STATION])
    x, y = shifted(x, y, h, state[ASIDE])
    course[k, 0], course[k, 1], course[k, 2], course[k, 3] = t, x, y, h + state[TURN]
