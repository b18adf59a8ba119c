"""The fuzzy safety model (FSM) of Mattas et al., made to drive.

Two fuzzy measures say how unsafe the distance to somebody ahead is, 0 not at all, 1 wholly: the
proactive one (PFS) if that one stopped at once, the critical one (CFS) if both went on as they do.
The driver brakes comfortably by the first and up to its full force by the second, after a reaction
time, and so avoids emergencies that a driver who waits for them would be in.

What the publications leave open, and what holds here:

- who comes onto the ego's way counts if it will be there before the ego is past it (their lateral
  check), of who crosses, if the two bodies meet (``_conflict_kernels``): a leader that stands where
  they do;
- the critical measure would have it stop when it touches: it counts from 1 m before that;
- without any risk the driver keeps the speed that its path allows.

The driver sees everybody. ``attention`` has a row per body: where it is beside the ego's way
(``_conflict_kernels``); row 0 is the ego's: the instant since when there is a risk, counted from 1,
0 if there is none, and the acceleration asked for [m/s²].

Source: Mattas et al., Accident Analysis & Prevention 148 (2020) 105794 (PFS, CFS) and 174 (2022)
106743 (the driver); its parameters are those of UN Regulation 157, 01 series, annex 3.
"""

import math

from bridgegen.compiled import kernel
from bridgegen.ego._conflict_kernels import LEADER, NOBODY, foresee
from bridgegen.ego._following_kernels import COMFORT_ACCELERATION, COMFORT_DECELERATION
from bridgegen.ego._route_follower_kernels import hold_speed

REACTION = 0.75  # s
COMFORT_BRAKING = 4.0  # m/s²
BRAKING = 6.0  # m/s²
LEADER_BRAKING = 7.0  # m/s², the hardest that is expected of somebody ahead
STANDSTILL = 2.0  # m, kept to who stands
SAFE_MARGIN = 2.0  # m, more at the distance that is quite safe
JERK = 12.65  # m/s³
SHORT = 1.0  # m before the other's rear, up to which the critical measure lets the gap go
SLACK = 0.1  # s, in the lateral check
HORIZON = 6.0  # s, beyond which nobody's coming from the side is foreseen

RISK, ASKED = 0, 1


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
    """Return the PFS of a gap [m] at speed v behind somebody at speed w [m/s]."""
    leader_stops = w * w / (2.0 * LEADER_BRAKING)
    safe = v * REACTION + v * v / (2.0 * COMFORT_BRAKING) - leader_stops + SAFE_MARGIN
    unsafe = v * REACTION + v * v / (2.0 * BRAKING) - leader_stops
    return share(gap - STANDSTILL, safe, unsafe)


@kernel
def critical(gap, v, w, a):
    """Return the CFS of a gap [m] at speed v and acceleration a [m/s²] behind somebody at w."""
    if v <= w:
        return 0.0
    a = max(a, -COMFORT_BRAKING)
    after = v + a * REACTION
    if after < w:
        return 1.0 if gap < (v - w) ** 2 / (2.0 * abs(a)) else 0.0
    lost = (0.5 * (v + after) - w) * REACTION
    closing = (after - w) ** 2
    return share(gap, lost + closing / (2.0 * COMFORT_BRAKING), lost + closing / (2.0 * BRAKING))


@kernel
def braking(gap, v, w, a):
    """Return the deceleration [m/s²] that a gap asks for."""
    urgent = critical(gap - SHORT, v, w, a)
    if urgent > 0.0:
        return COMFORT_BRAKING + urgent * (BRAKING - COMFORT_BRAKING)
    return proactive(gap, v, w) * COMFORT_BRAKING


@kernel
def drive_fsm(
    k, dt, paths, path_n, path_ds, station, on, to, planned, present, x, y, h, speed, bodies,
    attention,
):  # fmt: skip
    """Return the acceleration [m/s²] that the driver asks for at instant k, ``dt`` [s] apart.

    The ego wants to go at ``planned`` [m/s]. Of all bodies, the ego first: the path that each is
    ``on`` (a row of ``paths``, ``path_n`` and ``path_ds``) and its ``station`` [m] there, the path
    that it changes ``to``, -1 if none; who is ``present``; ``x``, ``y``, ``h``, ``speed``
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
        if what == NOBODY:
            continue
        if what == LEADER and lateral > 0.0:
            past = math.inf
            if v > along:
                past = (gap + bodies[0, 0] + bodies[e, 0]) / (v - along)
            if lateral > min(past + SLACK, HORIZON):
                continue
        needed = max(needed, braking(gap, v, along, attention[0, ASKED]))
    asked = wanted
    if needed == 0.0:
        attention[0, RISK] = 0.0
    else:
        if attention[0, RISK] == 0.0:
            attention[0, RISK] = k + 1.0
        asked = min(attention[0, ASKED], 0.0)  # until it reacts, it does what it did, without gas
        if (k + 1.0 - attention[0, RISK]) * dt + 1e-9 >= REACTION:
            asked = min(wanted, max(asked - JERK * dt, -needed))
    attention[0, ASKED] = asked
    return asked
