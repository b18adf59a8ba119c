"""A careful driver: the human driver of UN Regulation 157 (ALKS), annex 3, extended to any road.

The regulation defines how a competent and careful human driver reacts to three disturbances on a
motorway: a vehicle cuts in, cuts out, or brakes (`_un_r157_kernels` is that driver). This one also
brakes for vehicles and pedestrians that cross its way or stand on it. The risk is perceived 0.4 s
after the other has come 0.375 m nearer to the ego's lane, or when it brakes by more than 5 m/s²
(0.4 s as well); the driver reacts if the time to collision is below 2 s; braking begins 0.75 s
later, and grows by 12.65 m/s³ up to 0.774 g. A body that a cut-out reveals is treated as any other.

Its extensions:

- for a crossing body, the time to collision is that until the two bodies meet
  (``_conflict_kernels``);
- a known leader, or a crossing body, is a risk, too, once avoiding it takes more than comfortable
  braking;
- the driver brakes until no meeting is predicted within 4 s;
- without a risk, it keeps the speed that its path allows, and follows known leaders by the
  intelligent driver model; where comfortable braking would not do, also because the leader brakes,
  as hard as needed.

The driver sees all bodies. ``attention`` has a row of three per body: where it is beside the ego's
way (``_conflict_kernels``), and the instant since when it is known, counted from 1, 0 if it is not;
row 0 is the ego's: the instant since when there is a risk, likewise, the acceleration asked for
[m/s²], and 1 while it brakes for the risk.

Source: UN Regulation 157, 01 series of amendments, annex 3; Mattas et al., Accident Analysis &
Prevention 174 (2022) 106743, where it is called the CC human driver.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel
from bridgegen.base.physics import CAREFUL_BRAKING, CAREFUL_JERK, CAREFUL_REACTION
from bridgegen.drivers._conflict_kernels import (
    ASIDE,
    CROSSING,
    FARTHEST,
    LEADER,
    NO_CONFLICT,
    WANDERING,
    foresee,
)
from bridgegen.drivers._cruise_kernels import cruise
from bridgegen.drivers._following_kernels import COMFORT_ACCELERATION, COMFORT_DECELERATION
from bridgegen.drivers._route_follower_kernels import hold_speed, keep_to_route
from bridgegen.drivers._un_r157_kernels import follow

EVALUATION = 0.4  # s, until the risk is perceived
BRAKES_HARD = 5.0  # m/s², of the vehicle ahead
CRITICAL_TTC = 2.0  # s

# The regulation's 2 s are too late for a car that stands, above 52 km/h.
HARD_TO_STOP = 3.0  # m/s² that avoiding a body takes, after the reaction: a risk from here …
EASY_TO_STOP = 1.0  # … until down to here
CLEAR = 4.0  # s, within which no meeting may be predicted when the brake is released
ALWAYS = -1e9  # the instant since when bodies are known that are present from the start
KNOWN = 2
RISK, ASKED, BRAKES = 0, 1, 2


@kernel
def drive_careful(
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
    reach = 15.0 + (EVALUATION + CAREFUL_REACTION) * v + v * v / (2.0 * COMFORT_DECELERATION)
    risk, brakes = False, attention[0, BRAKES] > 0.0
    limit, hard = (CLEAR, EASY_TO_STOP) if brakes else (CRITICAL_TTC, HARD_TO_STOP)
    for e in range(1, len(speed)):
        if not present[e]:
            continue
        p, w, turn, slowing = on[e], speed[e, k], 0.0, 0.0
        if k > 0:
            turn, slowing = (h[e, k] - h[e, k - 1]) / dt, (speed[e, k - 1] - w) / dt
        what, ttc, gap, along, lateral = foresee(
            k, dt, paths[own], path_n[own], path_ds[own], station[0], v, bodies[0], to[e] < 0,
            paths[p], path_n[p], path_ds[p], station[e], x[e, k], y[e, k], h[e, k], w, turn,
            bodies[e], CLEAR, reach, attention[e],
        )  # fmt: skip
        # A lane change counts once the centre has come 0.375 m nearer: less is wandering in its
        # lane.
        wanders = lateral > 0.0 and attention[e, FARTHEST] - attention[e, ASIDE] <= WANDERING
        if what == NO_CONFLICT or (what == LEADER and wanders):
            attention[e, KNOWN] = 0.0
            continue
        if attention[e, KNOWN] == 0.0:
            attention[e, KNOWN] = k + 1.0 if k > 0 else ALWAYS
        # Instants are counted, and rounding must not add one to a reaction.
        known_for = (k + 1.0 - attention[e, KNOWN]) * dt + 1e-9
        if known_for < EVALUATION:
            continue
        risk = risk or ttc < limit or (what == LEADER and slowing > BRAKES_HARD)
        if what == CROSSING or known_for >= EVALUATION + CAREFUL_REACTION:
            closing = max(v - along, 0.0)
            left = max(gap - (0.0 if brakes else closing * CAREFUL_REACTION), 0.1)
            risk = risk or closing * closing / (2.0 * left) > hard
        if what == LEADER and known_for >= EVALUATION + CAREFUL_REACTION:
            wanted = min(wanted, follow(gap, v, along, slowing))
    if not risk:
        if wanted < -COMFORT_DECELERATION:  # beyond comfort, the brake takes time to build up
            held = attention[0, ASKED] - CAREFUL_JERK * dt
            wanted = max(wanted, min(held, -COMFORT_DECELERATION))
        attention[0, RISK], attention[0, BRAKES], attention[0, ASKED] = 0.0, 0.0, wanted
        return wanted
    if attention[0, RISK] == 0.0:
        attention[0, RISK] = k + 1.0
    asked = min(attention[0, ASKED], 0.0)  # until it reacts, it holds its demand, without gas
    if (k + 1.0 - attention[0, RISK]) * dt + 1e-9 >= CAREFUL_REACTION:
        attention[0, BRAKES] = 1.0
        asked = max(asked - CAREFUL_JERK * dt, -CAREFUL_BRAKING)
    attention[0, ASKED] = asked
    return asked


@kernel
def drive(k, plan, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m]."""
    planned, asked = cruise(k, plan, roads, state, record)
    # The driver's part alone; lights are the reference's rule, in ``cruise``, so that a
    # counterfactual neither runs a red light nor is saved by that.
    demanded = drive_careful(
        k, plan.dt, roads.paths, roads.counts, roads.steps, state.station, state.on, state.to,
        planned, state.heeded, record.x, record.y, record.h, record.v, plan.bodies,
        state.attention,
    )  # fmt: skip
    return min(demanded, asked), keep_to_route(k, roads, state, record)
