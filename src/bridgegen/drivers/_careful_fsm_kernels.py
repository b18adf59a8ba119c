"""The fuzzy safety model (FSM) extended to any road: a careful driver that sees all bodies.

It brakes by the model's two measures (``_fsm_kernels``), as that driver does, but it looks through
the vehicles ahead, keeps more room, and reacts to crossing bodies. What holds here:

- a body that comes onto the ego's way counts if it will be there before the ego is past it (their
  lateral check), a crossing one if the two bodies meet (``_conflict_kernels``): as a leader that
  stands where they do;
- the critical measure would stop the ego at contact: it counts from 1 m before that;
- without any risk the driver keeps the speed that its path allows.

The driver sees all bodies. ``attention`` has a row per body: where it is beside the ego's way
(``_conflict_kernels``); row 0 is the ego's: the instant since when there is a risk, counted from 1,
0 if there is none, and the acceleration asked for [m/s²].

Source: Mattas et al., Accident Analysis & Prevention 148 (2020) 105794 (PFS, CFS) and 174 (2022)
106743 (the driver); its parameters are those of UN Regulation 157, 01 series, annex 3.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._conflict_kernels import LEADER, NO_CONFLICT, foresee
from bridgegen.drivers._cruise_kernels import cruise
from bridgegen.drivers._following_kernels import COMFORT_ACCELERATION, COMFORT_DECELERATION
from bridgegen.drivers._fsm_kernels import (
    COMFORT_BRAKING,
    HORIZON,
    JERK,
    REACTION,
    SAFE_MARGIN,
    SHORT,
    SLACK,
    STANDSTILL,
    braking,
)
from bridgegen.drivers._route_follower_kernels import hold_speed, keep_to_route

RISK, ASKED = 0, 1


@kernel
def drive_careful_fsm(
    k, dt, paths, path_n, path_ds, station, on, to, planned, present, x, y, h, speed, bodies,
    attention,
):  # fmt: skip
    """Return the acceleration [m/s²] that the driver demands at instant k, ``dt`` [s] apart.

    The ego wants to go at ``planned`` [m/s]. Of all bodies, the ego first: the path that each is
    ``on`` (a row of ``paths``, ``path_n`` and ``path_ds``) and its ``station`` [m] there, the path
    that it changes ``to``, -1 if none; whether it is ``present``; ``x``, ``y``, ``h``, ``speed``
    ``(E, T)``, of which nothing after instant k is read; ``bodies`` ``(E, ·)``; and ``attention``
    ``(E, 3)``, zeros before the first instant, changed in place.
    """
    v, own = speed[0, k], on[0]
    wanted = min(max(hold_speed(v, planned), -2.0 * COMFORT_DECELERATION), COMFORT_ACCELERATION)
    reach = v * REACTION + v * v / (2.0 * COMFORT_BRAKING) + STANDSTILL + SAFE_MARGIN
    horizon = min(reach / max(v, 1.0), HORIZON)
    needed = 0.0
    for e in range(1, len(speed)):
        if not present[e]:
            continue
        p, w, turn = on[e], speed[e, k], 0.0
        if k > 0:
            turn = (h[e, k] - h[e, k - 1]) / dt
        what, _, gap, along, lateral = foresee(
            k, dt, paths[own], path_n[own], path_ds[own], station[0], v, bodies[0], to[e] < 0,
            paths[p], path_n[p], path_ds[p], station[e], x[e, k], y[e, k], h[e, k], w, turn,
            bodies[e], horizon, reach + 15.0, attention[e],
        )  # fmt: skip
        if what == NO_CONFLICT:
            continue
        if what == LEADER and lateral > 0.0:
            past = math.inf
            if v > along:
                past = (gap + bodies[0, 0] + bodies[e, 0]) / (v - along)
            if lateral > min(past + SLACK, HORIZON):
                continue
        given = max(attention[0, ASKED], -COMFORT_BRAKING)
        needed = max(needed, braking(gap, v, along, given, SHORT))
    asked = wanted
    if needed == 0.0:
        attention[0, RISK] = 0.0
    else:
        if attention[0, RISK] == 0.0:
            attention[0, RISK] = k + 1.0
        asked = min(attention[0, ASKED], 0.0)  # until it reacts, it holds its demand, without gas
        if (k + 1.0 - attention[0, RISK]) * dt + 1e-9 >= REACTION:
            asked = min(wanted, max(asked - JERK * dt, -needed))
    attention[0, ASKED] = asked
    return asked


@kernel
def drive(k, plan, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m]."""
    planned, asked = cruise(k, plan, roads, state, record)
    demanded = drive_careful_fsm(
        k, plan.dt, roads.paths, roads.counts, roads.steps, state.station, state.on, state.to,
        planned, state.heeded, record.x, record.y, record.h, record.v, plan.bodies,
        state.attention,
    )  # fmt: skip
    return min(demanded, asked), keep_to_route(k, roads, state, record)
