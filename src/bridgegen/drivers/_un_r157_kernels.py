"""The competent and careful human driver of UN Regulation 157 (ALKS) as a driver.

The driver reacts to the regulation's three disturbances, and to nothing else in an emergency:

- *cut-in*: a vehicle from beside comes onto the strip that the ego sweeps, ahead of it, and the
  time to collision is at most 2 s at that instant;
- *cut-out*: the vehicle ahead, at a time headway of at most 2 s, leaves the middle of the ego's way
  by more than 0.375 m, and a slower vehicle is on the way beyond it;
- *deceleration*: the vehicle ahead, at a time headway of at most 2 s, brakes by more than 5 m/s².

It takes its foot off the accelerator (0.4 m/s²); 0.75 s later it brakes, by 12.65 m/s³ up to
0.774 g, until it is no faster than the vehicle that it reacts to.

Otherwise it follows its route and, as the regulation takes for granted, the vehicle ahead on its
way: by the intelligent driver model and, where a comfortable deceleration does not do, as hard as
needed, up to 0.774 g. It does not look beyond the vehicle ahead. It does not brake for crossing or
oncoming traffic, nor for pedestrians; `_careful_kernels` does.

The text of the regulation adds 0.4 s of perception to each disturbance, and lets it begin in a
cut-in at 0.375 m of lateral movement. The Commission's code, agreed upon with the model's authors,
has none of the 0.4 s, and lets the cut-in begin where the bodies overlap; so does this driver.

The driver sees every vehicle. ``attention`` has a row of three per body: how far its centre is
beside the ego's way [m], and 1 while it is on the strip that the ego sweeps; row 0 is the ego's:
the instant since when it reacts, counted from 1, 0 if it does not, the acceleration asked for
[m/s²], and the body that it reacts to.

Sources: UN Regulation 157, 01 series of amendments, annex 3 (00 series: annex 4, appendix 3), the
competent and careful human driver; European Commission, JRC-FSM, its "CC human driver"; Mattas et
al., Accident Analysis & Prevention 174 (2022) 106743.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.base.physics import CAREFUL_BRAKING, CAREFUL_JERK, CAREFUL_REACTION
from bridgegen.drivers._ahead_kernels import place_on_way
from bridgegen.drivers._cruise_kernels import cruise
from bridgegen.drivers._following_kernels import COMFORT_ACCELERATION, COMFORT_DECELERATION, idm
from bridgegen.drivers._route_follower_kernels import hold_speed, keep_to_route
from bridgegen.drivers.kinds import USES_LANES

CRITICAL_TTC = 2.0  # s, up to which a cut-in is dangerous
CRITICAL_HEADWAY = 2.0 + 1e-6  # s, up to which a cut-out or a deceleration is; and rounding
WANDERING = 0.375  # m, from the middle of the way, that are no change of lane
BRAKES_HARD = 5.0  # m/s², of the vehicle ahead
RELEASE = 0.4  # m/s², with the foot off the accelerator; source: JRC-FSM
SPARE = 1.0  # m, left to the vehicle ahead where following takes more than comfort

SEES = 100.0  # m beyond its stopping distance, up to which it considers bodies

ASIDE, ON_WAY = 0, 1
RISK, ASKED, THREAT = 0, 1, 2


@kernel
def follow(gap, v, w, slowing):
    """Return the acceleration [m/s²] behind a vehicle known for long, at speed w [m/s].

    It is ``gap`` [m] ahead and brakes by ``slowing`` [m/s²], or does not if that is <= 0.
    """
    room = max(gap - SPARE, 0.1)
    needed = 0.5 * max(v - w, 0.0) ** 2 / room
    if slowing > 0.0:
        needed = max(needed, 0.5 * v * v / (room + 0.5 * w * w / slowing))
    asked = max(idm(gap, v, w), -COMFORT_DECELERATION)
    return asked if needed <= COMFORT_DECELERATION else min(asked, -min(needed, CAREFUL_BRAKING))


@kernel
def drive_un_r157(
    k, dt, paths, path_n, path_ds, station, on, planned, present, x, y, h, speed, bodies, kinds,
    attention,
):  # fmt: skip
    """Return the acceleration [m/s²] that the driver demands at instant k, ``dt`` [s] apart.

    The ego wants to go at ``planned`` [m/s]. Of all bodies, the ego first: the path that each is
    ``on`` (a row of ``paths``, ``path_n`` and ``path_ds``) and its ``station`` [m] there, of both
    of which only the ego's is read; whether it is ``present``; ``x``, ``y``, ``h``, ``speed``
    ``(E, T)``, of which nothing after instant k is read; ``bodies`` ``(E, ·)``; their ``kinds``
    ``(E,)``; and ``attention`` ``(E, 3)``, zeros before the first instant, changed in place.
    """
    v, own = speed[0, k], on[0]
    wanted = min(max(hold_speed(v, planned), -2.0 * COMFORT_DECELERATION), COMFORT_ACCELERATION)
    reach = SEES + CRITICAL_HEADWAY * v + v * v / (2.0 * COMFORT_DECELERATION)
    threat, threatens, cut_in = int(attention[0, THREAT]), False, 0
    lead, lead_ahead, lead_gap, lead_along, lead_slowing = 0, math.inf, math.inf, 0.0, 0.0
    beyond, beyond_ahead, beyond_along = 0, math.inf, 0.0
    leaves = False
    for e in range(1, len(speed)):
        if not present[e] or not USES_LANES[kinds[e]]:
            continue
        w = speed[e, k]
        slowing = (speed[e, k - 1] - w) / dt if k > 0 else 0.0
        ahead, gap, aside, side, along = place_on_way(
            paths[own],
            path_n[own],
            path_ds[own],
            station[0],
            reach,
            bodies[0],
            x[e, k],
            y[e, k],
            h[e, k],
            w,
            bodies[e],
        )
        before, was_on_way = attention[e, ASIDE], attention[e, ON_WAY] > 0.0
        on_way = side <= 0.0
        attention[e, ASIDE], attention[e, ON_WAY] = aside, 1.0 if on_way else 0.0
        if not on_way or ahead < 0.0:
            continue
        if k > 0 and not was_on_way and max(gap, 0.0) <= CRITICAL_TTC * (v - along):
            cut_in = e
        if e == threat:
            threatens = v > along or slowing > BRAKES_HARD
        if ahead < lead_ahead:
            beyond, beyond_ahead, beyond_along = lead, lead_ahead, lead_along
            lead, lead_ahead, lead_gap, lead_along, lead_slowing = e, ahead, gap, along, slowing
            # Nobody beyond the vehicle ahead is seen until then, so a cut-out is noticed later than
            # by a driver that sees through cars.
            leaves = was_on_way and before <= WANDERING < aside
        elif ahead < beyond_ahead:
            beyond, beyond_ahead, beyond_along = e, ahead, along
    risky = 0
    if lead > 0 and lead_gap <= CRITICAL_HEADWAY * v:
        if leaves and beyond > 0 and v > beyond_along:
            risky = beyond
        # The text's 5 m/s² in front of an emergency. The Commission's code reacts to any
        # deceleration, or the regulation's own charts below 5 m/s² would have no reaction; here,
        # below that, ``follow`` brakes as hard as needed. No cell differs by it.
        elif lead_slowing > BRAKES_HARD:
            risky = lead
    if cut_in > 0:
        risky = cut_in
    if risky > 0:
        attention[0, THREAT] = risky
        if attention[0, RISK] == 0.0:
            attention[0, RISK] = k + 1.0
    elif threat > 0 and not threatens:
        attention[0, RISK], attention[0, THREAT] = 0.0, 0.0
    if attention[0, RISK] == 0.0:
        if lead > 0:
            wanted = min(wanted, follow(lead_gap, v, lead_along, lead_slowing))
        attention[0, ASKED] = wanted
        return wanted
    asked = min(attention[0, ASKED], -RELEASE)
    if (k + 1.0 - attention[0, RISK]) * dt + 1e-9 >= CAREFUL_REACTION:
        asked = max(asked - CAREFUL_JERK * dt, -CAREFUL_BRAKING)
    asked = min(asked, wanted)
    attention[0, ASKED] = asked
    return asked


@kernel
def drive(k, plan, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m]."""
    planned, asked = cruise(k, plan, roads, state, record)
    demanded = drive_un_r157(
        k, plan.dt, roads.paths, roads.counts, roads.steps, state.station, state.on, planned,
        state.heeded, record.x, record.y, record.h, record.v, plan.bodies, plan.kinds,
        state.attention,
    )  # fmt: skip
    return min(demanded, asked), keep_to_route(k, roads, state, record)
