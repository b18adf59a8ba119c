"""Participants other than the ego that have a driver, which limits their script.

The storyboard commands a speed, and when a change of lane begins; the driver
(`bridgegen.drivers._attentive_kernels`) may slow them, and delay the change. All drivers decide by
the states at instant k, before any entity moves, so the order of the entities does not matter.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.base.physics import CAREFUL_JERK
from bridgegen.drivers._attentive_kernels import ASKED, LOOK, look, react, see
from bridgegen.drivers._following_kernels import COMFORT_ACCELERATION
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.drivers.drivers import SCRIPTED
from bridgegen.simulation.embedded._codes import DOES, KEEP_ASIDE
from bridgegen.simulation.embedded._memory_kernels import STOPS
from bridgegen.simulation.embedded._motion_kernels import SAME_SPEED
from bridgegen.simulation.embedded.motion import (
    ENDS,
    begin_lane_change,
    is_pointless,
    move_along_path,
)
from bridgegen.simulation.embedded.places._slope_kernels import slope

SETTLES = 2.0  # m/s³, with which it releases the accelerator as it catches up with its script; ours


@kernel
def heed(k, plan, roads, state, record):
    """Set ``allowed``: the acceleration [m/s²] that each driver allows from instant k on."""
    every = max(round(LOOK / plan.dt), 1)
    if k % every == 0:
        see(
            k, plan.dt, record.x, record.y, record.h, record.v, plan.bodies, state.lamps, state.seen
        )
    for e in range(1, record.x.shape[0]):
        state.allowed[e] = math.inf
        if plan.others[e] == SCRIPTED:
            continue
        p, mind = state.on[e], state.minds[e]
        if not state.present[e] or state.placed[e] or p < 0 or state.follow[e] >= 0:
            mind[:] = 0.0
            mind[ASKED] = math.inf
            continue
        if k % every == 0:
            stop, target = math.inf, state.aside[e]
            if state.waits[e] >= 0 and roads.follows[p] == ENDS:
                stop = (roads.counts[p] - 1) * roads.steps[p]
            j = state.lateral_action[e]
            if j >= 0 and plan.actions[j, DOES] != KEEP_ASIDE:
                target = state.lateral_target[e]
            mind[ASKED] = look(
                e, state.command[e], stop, state.weather[FRICTION], roads.paths, roads.counts,
                roads.steps, state.station, state.on, state.aside, target, state.minded,
                state.seen, state.far, plan.bodies, plan.kinds, roads.meets[e], roads.meetings[e],
                roads.claims[e], roads.lines[e], roads.signs[e], state.lights, mind,
            )  # fmt: skip
        state.allowed[e] = react(k, plan.dt, mind[ASKED], mind)


@kernel
def begin_waiting(k, plan, roads, state, record):
    """Begin at instant k the changes of lane that have waited for a gap which is free now."""
    for e in range(1, record.x.shape[0]):
        j = state.waits[e]
        if j < 0 or state.ending[STOPS]:
            continue
        if plan.comes_and_goes and is_pointless(j, plan, state):
            state.action_ended[j] = True
            state.waits[e] = -1
        else:
            begin_lane_change(j, k, plan, roads, state, record)


@kernel
def move_heeding(e, before, k, plan, roads, state, record):
    """Move an entity on from instant k as its driver allows; see ``_travel_kernels``.

    ``before`` [m/s] is the command of the instant before. An entity behind its script catches up at
    a comfortable acceleration at most, and never exceeds the commanded speed. Its acceleration
    changes by `CAREFUL_JERK` at most.
    """
    most, v, body = state.allowed[e], record.v[e, k], plan.bodies[e]
    if v < before - SAME_SPEED:
        most = min(most, COMFORT_ACCELERATION, math.sqrt(2.0 * SETTLES * (before - v)))
    asked = state.command[e]
    if most < math.inf:
        change = CAREFUL_JERK * plan.dt  # it builds up and releases pedals no faster
        now = (v - record.v[e, k - 1]) / plan.dt if k > 0 else 0.0
        now = min(max(now, -body[5]), body[4])  # it may have been put here just now
        most = min(max(most, now - change), now + change)
        uphill, _, press = slope(e, roads, state)
        most = max(most, -min(body[5], press * state.weather[FRICTION]) - uphill)
        state.command[e] = min(asked, max(v + most * plan.dt, 0.0))
        if state.command[e] < asked:
            state.mean[e] = math.nan
    given = state.command[e]
    move_along_path(e, k, plan, roads, state, record)
    if state.command[e] == given:  # its road continues
        state.command[e] = asked
