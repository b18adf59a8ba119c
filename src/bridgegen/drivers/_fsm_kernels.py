"""The fuzzy safety model (FSM) of Mattas et al. as a driver.

Two fuzzy measures rate how unsafe the distance to a body ahead is, from 0 (safe) to 1: the
proactive one (PFS) if the body stopped at once, the critical one (CFS) if both keep their motion.
The driver brakes comfortably by the first and up to its full force by the second, after a reaction
time, and so avoids emergencies that a driver without anticipation would get into.

In a cut-in, a cut-out, and behind a vehicle that brakes, it is the driver of the European
Commission's code (JRC-FSM): a vehicle that comes in from beside counts if it will be on the strip
that the ego sweeps before the ego is past it (their lateral check); one within 0.375 m of the
middle of the ego's way hides those beyond it; once it has reacted, the driver waits no more before
it brakes again, and keeps its speed where it is safe, for as long as it closes on a body ahead.

What the publications leave open, and what holds here:

- a crossing body counts if the two bodies meet (``_conflict_kernels``): as a leader that stands
  where they do; so does a body that stands less than 0.5 m beside the strip;
- for these, and for a vehicle that stands in sight from the start, the critical measure counts
  from 1 m before it would have the driver stop;
- without any risk the driver keeps the speed that its path allows.

The driver sees all bodies but those hidden so. ``attention`` has a row per body: where it is
beside the ego's way (``_conflict_kernels``), and 1 once it has driven or been hidden; row 0 is
the ego's: the instant since when there is a risk, counted from 1, 0 if there is none, the
acceleration asked for [m/s²], and, while it reacts to a vehicle that drives or stands on its way,
the deceleration at its brake pedal [m/s²] plus 1.

Source: Mattas et al., Accident Analysis & Prevention 148 (2020) 105794 (PFS, CFS) and 174 (2022)
106743 (the driver); its parameters are those of UN Regulation 157, 01 series, annex 3;
European Commission, JRC-FSM.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._ahead_kernels import place_on_way
from bridgegen.drivers._conflict_kernels import (
    ASIDE,
    FARTHEST,
    LEADER,
    NO_CONFLICT,
    STANDS,
    WANDERING,
    foresee,
)
from bridgegen.drivers._cruise_kernels import cruise
from bridgegen.drivers._following_kernels import COMFORT_ACCELERATION, COMFORT_DECELERATION
from bridgegen.drivers._route_follower_kernels import hold_speed, keep_to_route
from bridgegen.drivers.kinds import USES_LANES

REACTION = 0.75  # s
COMFORT_BRAKING = 4.0  # m/s²
BRAKING = 6.0  # m/s²
LEADER_BRAKING = 7.0  # m/s², the hardest that is expected of a leader
STANDSTILL = 2.0  # m, kept at standstill
SAFE_MARGIN = 2.0  # m, added to the distance that is fully safe
JERK = 12.65  # m/s³
SHORT = 1.0  # m before the other, up to which the critical measure lets the gap go, if it may
SLACK = 0.1  # s, in the lateral check
ROUNDING = 1e-6  # m/s², what is less is rounding
FARTHER = 15.0  # m beyond the safe distance, up to which bodies are considered
HORIZON = 6.0  # s, up to which entering from the side is foreseen

RISK, ASKED, PRESSED = 0, 1, 2
IN_TRAFFIC = 2


@kernel
def share(gap, safe, unsafe):
    """Return how unsafe a gap is: 0 from ``safe`` on, 1 up to ``unsafe``, linear between [m]."""
    if gap >= safe:
        return 0.0
    if gap <= unsafe:
        return 1.0
    return (gap - safe) / (unsafe - safe)


@kernel
def proactive(gap, v, w):
    """Return the PFS of a gap [m] at speed v behind a body at speed w [m/s]."""
    leader_stops = w * w / (2.0 * LEADER_BRAKING)
    safe = v * REACTION + v * v / (2.0 * COMFORT_BRAKING) - leader_stops + SAFE_MARGIN
    unsafe = v * REACTION + v * v / (2.0 * BRAKING) - leader_stops
    return share(gap - STANDSTILL, safe, unsafe)


@kernel
def critical(gap, v, w, a):
    """Return the CFS of a gap [m] at speed v and acceleration a [m/s²] behind a body at w."""
    if v <= w:
        return 0.0
    after = v + max(a, -COMFORT_BRAKING) * REACTION
    if after < w:
        return 1.0 if gap < (v - w) ** 2 / (2.0 * abs(a)) else 0.0
    lost = (0.5 * (v + after) - w) * REACTION
    closing = (after - w) ** 2
    return share(gap, lost + closing / (2.0 * COMFORT_BRAKING), lost + closing / (2.0 * BRAKING))


@kernel
def braking(gap, v, w, a, short):
    """Return the deceleration [m/s²] that a gap requires, ``short`` [m] of which must remain."""
    urgent = critical(gap - short, v, w, a)
    if urgent > 0.0:
        return COMFORT_BRAKING + urgent * (BRAKING - COMFORT_BRAKING)
    return proactive(gap, v, w) * COMFORT_BRAKING


@kernel
def drive_fsm(
    k, dt, paths, path_n, path_ds, station, on, to, planned, present, x, y, h, speed, bodies,
    kinds, attention,
):  # fmt: skip
    """Return the acceleration [m/s²] that the driver demands at instant k, ``dt`` [s] apart.

    The ego wants to go at ``planned`` [m/s]. Of all bodies, the ego first: the path that each is
    ``on`` (a row of ``paths``, ``path_n`` and ``path_ds``) and its ``station`` [m] there, the path
    that it changes ``to``, -1 if none; whether it is ``present``; ``x``, ``y``, ``h``, ``speed``
    ``(E, T)``, of which nothing after instant k is read; ``bodies`` ``(E, ·)``; their ``kinds``
    ``(E,)``; and ``attention`` ``(E, 3)``, zeros before the first instant, changed in place.
    """
    v, own = speed[0, k], on[0]
    wanted = min(max(hold_speed(v, planned), -2.0 * COMFORT_DECELERATION), COMFORT_ACCELERATION)
    reach = v * REACTION + v * v / (2.0 * COMFORT_BRAKING) + STANDSTILL + SAFE_MARGIN
    horizon = min(reach / max(v, 1.0), HORIZON)
    # As in the Commission's code; `careful-fsm` sees through vehicles.
    hides = math.inf  # how far ahead the vehicle is that hides those beyond
    for e in range(1, len(speed) if len(speed) > 2 else 1):
        if present[e] and USES_LANES[kinds[e]]:
            ahead, _, aside, _, _ = place_on_way(
                paths[own],
                path_n[own],
                path_ds[own],
                station[0],
                reach + FARTHER,
                bodies[0],
                x[e, k],
                y[e, k],
                h[e, k],
                speed[e, k],
                bodies[e],
            )
            if ahead >= 0.0 and aside <= WANDERING:
                hides = min(hides, ahead)
    needed, on_way, closing = 0.0, 0.0, False
    for e in range(1, len(speed)):
        if not present[e]:
            continue
        p, w, turn = on[e], speed[e, k], 0.0
        drives, side = False, math.inf
        if k > 0:
            turn = (h[e, k] - h[e, k - 1]) / dt
        if USES_LANES[kinds[e]]:
            ahead, gap, aside, side, along = place_on_way(
                paths[own],
                path_n[own],
                path_ds[own],
                station[0],
                reach + FARTHER,
                bodies[0],
                x[e, k],
                y[e, k],
                h[e, k],
                w,
                bodies[e],
            )
            if w >= STANDS or (ahead > hides and side <= 0.0):
                attention[e, IN_TRAFFIC] = 1.0
            has_driven = attention[e, IN_TRAFFIC] > 0.0
            drives = ahead < math.inf and has_driven and (side <= 0.0 or w >= STANDS)
            if drives and 0.0 <= ahead <= hides:
                before, nearing = attention[e, ASIDE], 0.0
                if k > 0 and before < math.inf:
                    nearing = (before - aside) / dt
                past = math.inf
                if v != along:  # < 0 if the other is faster: the ego never passes it
                    past = (gap + bodies[0, 0] + bodies[e, 0]) / (v - along)
                slows = k > 0 and speed[e, k - 1] > w >= STANDS
                closing = closing or (side <= 0.0 and (v > along or slows))
                closing = closing or (side > 0.0 and nearing > 0.0)
                if side <= 0.0 or (nearing > 0.0 and side / nearing <= past + SLACK):
                    asks = braking(gap, v, along, attention[0, ASKED], 0.0)
                    on_way = max(on_way, asks if asks > ROUNDING else 0.0)
        if drives and to[e] >= 0:
            attention[e, ASIDE], attention[e, FARTHEST] = aside, max(attention[e, FARTHEST], aside)
            continue
        what, _, gap, along, lateral = foresee(
            k, dt, paths[own], path_n[own], path_ds[own], station[0], v, bodies[0], to[e] < 0,
            paths[p], path_n[p], path_ds[p], station[e], x[e, k], y[e, k], h[e, k], w, turn,
            bodies[e], horizon, reach + FARTHER, attention[e],
        )  # fmt: skip
        if what == NO_CONFLICT or (what == LEADER and drives and side <= 0.0):
            continue
        if what == LEADER and lateral > 0.0:
            past = math.inf
            if v > along:
                past = (gap + bodies[0, 0] + bodies[e, 0]) / (v - along)
            if lateral > min(past + SLACK, HORIZON):
                continue
        needed = max(needed, braking(gap, v, along, attention[0, ASKED], SHORT))
    asked, pressed = wanted, attention[0, PRESSED]
    needed = max(needed, on_way)
    if on_way > 0.0:
        pressed = max(pressed, 1.0)
    if needed == 0.0 and not (pressed > 0.0 and closing):
        attention[0, RISK], pressed = 0.0, 0.0
    elif needed == 0.0:
        asked = min(wanted, 0.0)
        if (k + 1.0 - attention[0, RISK]) * dt + 1e-9 < REACTION:
            attention[0, RISK] += 1.0  # what is safe again takes no time to react to
    else:
        if attention[0, RISK] == 0.0:
            attention[0, RISK] = k + 1.0
        asked = min(attention[0, ASKED], 0.0)  # until it reacts, it holds its demand, without gas
        if (k + 1.0 - attention[0, RISK]) * dt + 1e-9 >= REACTION:
            at_foot = min(asked, 1.0 - pressed) if pressed > 0.0 else asked
            asked = min(wanted, max(at_foot - JERK * dt, -needed))
            if pressed > 0.0:
                pressed = 1.0 - min(asked, 0.0)
    attention[0, ASKED], attention[0, PRESSED] = asked, pressed
    return asked


@kernel
def drive(k, plan, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m]."""
    planned, asked = cruise(k, plan, roads, state, record)
    demanded = drive_fsm(
        k, plan.dt, roads.paths, roads.counts, roads.steps, state.station, state.on, state.to,
        planned, state.heeded, record.x, record.y, record.h, record.v, plan.bodies, plan.kinds,
        state.attention,
    )  # fmt: skip
    return min(demanded, asked), keep_to_route(k, roads, state, record)
