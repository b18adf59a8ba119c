"""Distances across the road that entities keep to others; see ``_codes`` for a course's columns.

State.lateral_target is how far left of the other the entity is to be [m], State.lateral_passed how
fast it moves to its left [m/s].
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import pose, project
from bridgegen.simulation.embedded._codes import (
    BY_BODY,
    CONTINUOUS,
    EITHER_SIDE,
    FREESPACE,
    IS_PRESENT,
    LEFT_SIDE,
    MOST,
    REF,
    RIGHT_SIDE,
    ROW,
    SIDE,
    TARGET,
    UNLIMITED,
    WHOM,
)
from bridgegen.simulation.embedded._motion_kernels import nearest
from bridgegen.simulation.embedded.motion._across_kernels import take_lane
from bridgegen.simulation.embedded.motion._lateral_kernels import SLOWEST, approach
from bridgegen.simulation.embedded.motion._pursuit_kernels import seen_at
from bridgegen.simulation.embedded.places._place_kernels import end_lateral

REACHED = 0.01  # m, a distance that is missed by less is reached
CROSSING = 0.1  # an entity turned from another by nearly a right angle is on no side of it
MOST_ACROSS = 0.999  # of a step: some of it is always ahead
MOST_ACROSS_ON_WHEELS = 0.5  # of a step: wheels turn a body by 30 degrees from its lane at most


@kernel
def begin_lateral_distance(j, k, plan, roads, state, record):
    """Begin action j, a LateralDistanceAction."""
    e, row = plan.actions[j, WHOM], plan.courses[plan.actions[j, ROW]]
    node, _, _ = take_lane(e, k, roads, state, record)
    if node < 0:
        return
    end_lateral(e, state)
    state.turn[e] = 0.0
    middle, way = _beside(e, row, state.station[e], k, roads, state, record)
    present = (state.aside[e] - middle) * way  # how far left of the other one
    # ``any`` keeps the side on which the entity is; esmini takes the left one.
    side = row[SIDE]
    if side == EITHER_SIDE:
        side = LEFT_SIDE if present >= 0.0 else RIGHT_SIDE
    distance = state.slots[plan.actions[j, TARGET]]
    if row[IS_PRESENT]:
        distance = abs(present)
    elif row[FREESPACE]:
        distance += 0.5 * (plan.bodies[e, 1] + plan.bodies[row[REF], 1])
    state.lateral_action[e] = j
    state.lateral_target[e], state.lateral_passed[e] = side * distance, 0.0


@kernel
def keep_aside(j, k, step, plan, roads, state, record):
    """Move an entity across by action j; return (way ahead [m], tilt [rad], whether it is over).

    Without limits it is there at once; else it never moves farther than its step.
    """
    e, row = plan.actions[j, WHOM], plan.courses[plan.actions[j, ROW]]
    # Where the other will be, if that is known; that it goes on moving across is not foreseen.
    seen = seen_at(e, row[REF], k, plan, state, record)
    middle, way = _beside(e, row, state.station[e] + step, seen, roads, state, record)
    left = middle + way * state.lateral_target[e] - state.aside[e]
    if row[UNLIMITED]:
        state.aside[e] += left
        return step, 0.0, not row[CONTINUOUS]
    if abs(step) <= SLOWEST:
        state.lateral_passed[e] = 0.0
        return 0.0, 0.0, abs(left) < REACHED and not row[CONTINUOUS]
    acceleration = _limit(row, 0, state)
    deceleration = _limit(row, 1, state)
    if deceleration == math.inf:
        deceleration = acceleration
    elif acceleration == math.inf:
        acceleration = deceleration
    across, speed = approach(
        left, state.lateral_passed[e], _limit(row, 2, state), acceleration, deceleration, plan.dt
    )
    on_wheels = plan.bodies[e, 6] < math.inf
    most = (MOST_ACROSS_ON_WHEELS if on_wheels else MOST_ACROSS) * abs(step)
    if abs(across) > most:
        across = math.copysign(most, across)
        speed = across / plan.dt
    state.lateral_passed[e] = speed
    state.aside[e] += across
    slow = abs(speed) <= deceleration * plan.dt
    over = slow and abs(left - across) < REACHED and not row[CONTINUOUS]
    ahead = math.sqrt(step * step - across * across)
    return math.copysign(ahead, step), elementary.asin(across / step), over


@kernel
def _limit(row, i, state):
    return state.slots[row[MOST + i]] if row[MOST + i] >= 0 else math.inf


@kernel
def _beside(e, row, station, seen, roads, state, record):
    """Return how far left of its path an entity is level with another one [m], and a factor.

    The factor is by how much it moves to its own left for each metre to the other's: -1 where they
    go in opposite directions. By the other's body, it is level on the line that the other's nose
    points along; along the lane, as far from the path as the other is.
    """
    ref, p = row[REF], state.on[e]
    path, n, ds = roads.paths[p], roads.counts[p], roads.steps[p]
    x, y, h = record.x[ref, seen], record.y[ref, seen], record.h[ref, seen]
    if row[BY_BODY]:
        px, py, ph = pose(path, n, ds, station)
        along = elementary.cos(ph - h)
        # The factor 1/along would throw the entity far across the road for the least turn of the
        # other.
        if abs(along) < CROSSING:
            return state.aside[e] - state.lateral_target[e], 1.0
        return ((x - px) * -elementary.sin(h) + (y - py) * elementary.cos(h)) / along, 1.0 / along
    foot, t = project(path, n, ds, nearest(path, n, ds, x, y), x, y)
    return t, 1.0 if elementary.cos(h - pose(path, n, ds, foot)[2]) >= 0.0 else -1.0
