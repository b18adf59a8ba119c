"""Pedals, wheel and gear that the storyboard holds, whatever driver or script do.

A vehicle accelerates by its throttle's share of what it can at most, and decelerates by its
brake's, which cuts the engine off unless the throttle is held as well; the parking brake gives
``PARKED``. What is not held is as driver or script have it, each speed of a script being what
engine or brakes make of it. The wheel turns the front wheels by its angle over ``RATIO``.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.simulation.embedded._codes import (
    BRAKE,
    COLUMN,
    IDLE,
    IS_HELD,
    LASTS,
    PARKING_BRAKE,
    PEDALS,
    ROW,
    STEERING,
    TARGET,
    THROTTLE,
    WHOM,
)
from bridgegen.simulation.embedded._motion_kernels import ramped
from bridgegen.simulation.embedded.places._slope_kernels import slope

PARKED = 1.5  # m/s², of a parking brake that is pulled; UN R13-H, annex 3, 2.3.6, while it moves
RATIO = 16.0  # of angles at wheel and front wheels; Reimpell, Automotive Chassis: 14 to 20

NOW, THEN, RATE, BASE = range(4)  # of a pedal: where it is, is to be, how fast [1/s]; wheelbase [m]


@kernel
def begin_press(j, k, plan, roads, state, record):
    """Begin, and end, action j, which holds a pedal, or lets go of it."""
    e, column = plan.actions[j, WHOM], plan.actions[j, COLUMN]
    pedal = state.pedals[e, column]
    bit = 1 << column
    if plan.actions[j, IS_HELD] == 0:
        state.holds[e] &= ~bit
    else:
        if state.holds[e] & bit == 0:
            pedal[NOW] = 0.0
        state.holds[e] |= bit
        pedal[THEN] = state.slots[plan.actions[j, TARGET]]
        pedal[RATE] = state.slots[plan.actions[j, LASTS]]
        pedal[BASE] = state.slots[plan.actions[j, ROW]]
    state.action_ended[j] = True


@kernel
def move_pedals(plan, state):
    """Move all pedals that are held to where they are by the end of a step."""
    for e in range(state.holds.shape[0]):
        for column in range(PEDALS):
            if state.holds[e] >> column & 1:
                pedal = state.pedals[e, column]
                pedal[NOW] = ramped(pedal[NOW], pedal[THEN], pedal[RATE] * plan.dt)


@kernel
def pressed(e, demanded, plan, state):
    """Return the acceleration [m/s²] that pedals give where a driver demands one."""
    held, pedals = state.holds[e], state.pedals[e]
    drive, brake = max(demanded, 0.0), max(-demanded, 0.0)
    if held >> THROTTLE & 1:
        drive = min(max(pedals[THROTTLE, NOW], 0.0), 1.0) * plan.bodies[e, 4]
    if held >> IDLE & 1:
        drive = 0.0
    if held >> BRAKE & 1:
        brake = min(max(pedals[BRAKE, NOW], 0.0), 1.0) * plan.bodies[e, 5]
        # As brake-throttle overrides of cars do.
        if brake > 0.0 and held >> THROTTLE & 1 == 0:
            drive = 0.0
    if held >> PARKING_BRAKE & 1:
        brake += min(max(pedals[PARKING_BRAKE, NOW], 0.0), 1.0) * PARKED
    return drive - brake


@kernel
def steered(curvature, state):
    """Return the curvature [1/m] of the ego's path, where its wheel may be held."""
    if state.holds[0] >> STEERING & 1 == 0:
        return curvature
    wheel = state.pedals[0, STEERING]
    return elementary.tan(wheel[NOW] / RATIO) / wheel[BASE]


@kernel
def command_by_pedals(e, k, plan, roads, state, record):
    """Set ``command`` of an entity that the storyboard moves to what its pedals make of it."""
    v, body = record.v[e, k], plan.bodies[e]
    uphill, _, press = slope(e, roads, state)
    most = press * state.weather[FRICTION]
    a = pressed(e, (state.command[e] - v) / plan.dt, plan, state)
    a = min(max(a, -min(body[5], most) - uphill), min(body[4], most) - uphill)
    state.command[e] = min(max(v + a * plan.dt, 0.0), body[3])
    state.target[e] = state.command[e]  # let go of, it rolls on at the speed that it has
    state.rate[e], state.mean[e] = math.inf, math.nan
    if state.speed_action[e] >= 0:
        state.action_ended[state.speed_action[e]] = True
        state.speed_action[e] = -1
