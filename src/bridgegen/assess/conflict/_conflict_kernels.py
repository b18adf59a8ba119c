"""Compiled conflict analysis of the ego with each other body; public wrapper: ``analysis.analyse``.

Each pair gets a row of whole numbers and one of floats; ``_codes`` names their columns. Only events
up to the ego's first contact with any body count.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.assess.conflict import severity as injury
from bridgegen.assess.conflict._careful_driver_kernels import gains, is_emergency
from bridgegen.assess.conflict._circumstances_kernels import stops_at_red
from bridgegen.assess.conflict._codes import (
    ACROSS,
    ALONG,
    ASSUMED_RIGHT_BEFORE_LEFT,
    CONTACT,
    COURSE,
    EGO,
    EGO_STANDING,
    FRONT,
    FRONT_LEFT,
    FRONT_RIGHT,
    HEAD_ON,
    INSTANT,
    KIND,
    LEADS_EGO,
    LEFT_ITS_LANE,
    NEAR_MISS,
    NEARNESS,
    NEEDED,
    NO_ZONE,
    OTHER,
    OVERLAP,
    PREVENTABLE,
    REAR_END_STRIKING,
    REAR_END_STRUCK,
    RESPONSIBLE,
    REVERSED,
    RULE,
    SHARED,
    SIDE_SWIPE,
    STOOD_EGO,
    STOOD_OTHER,
    TTC,
    TURNING_GIVES_WAY,
    TYPE,
    V_EGO,
    V_OTHER,
    VIOLATION,
    VRU_INTO_SIDE,
    WRONG_SIDE,
    ZONE_EGO,
    ZONE_OTHER,
)
from bridgegen.assess.conflict._geometry_kernels import (
    Scene,
    displaced,
    falls_below,
    lengths,
    meeting,
    meets_at,
    normal_of,
    overlap,
    presence,
    shallow_axis,
    time_along_paths,
    velocity,
    zones,
)
from bridgegen.assess.conflict._limits import (
    CLOSE_CALL,
    COMFORT,
    CREEPS,
    FRONT_PART,
    GUIDANCE,
    GUIDANCE_STEP,
    HARD,
    HORIZON,
    MOVES,
    NEAR,
    SERIOUS_DECELERATION,
    SERIOUS_TTC,
    SOON,
    STANDS,
)
from bridgegen.assess.conflict._responsibility_kernels import force, judge
from bridgegen.assess.conflict._severity_kernels import collision
from bridgegen.assess.conflict._type_kernels import type_of
from bridgegen.assess.metrics._time_kernels import STANDSTILL, time_to_contact
from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import IS_OBSTACLE

_SIDE, _FRONT, _REAR = injury.SIDE, injury.FRONT, injury.REAR
STRUCK = (_SIDE, _FRONT, _FRONT, _SIDE, _REAR, _REAR, _REAR, _SIDE, _FRONT)
"""The direction of the force by `Zone`; a corner counts as its end."""

BY_OTHERS = (REAR_END_STRUCK, SIDE_SWIPE, EGO_STANDING, VRU_INTO_SIDE)
"""Types in which the other drives, rides or walks into the ego."""


@kernel
def stood_for(v, first, k, dt):
    """Return how long a body has been standing at instant k [s]."""
    j = k
    while j >= first and v[j] <= STANDS:
        j -= 1
    return (k - j) * dt


@kernel
def first_contact(distance, n):
    """Return the first instant at which the ego touches a body, n if it never does."""
    first = n
    for e in range(1, distance.shape[0]):
        for k in range(min(n, first)):
            if distance[e, k] == 0.0:
                first = k
                break
    return first


@kernel
def nearness(half, x, y, c, s, v, distance, e, n):
    """Return how near two bodies come, at constant velocity from any instant on; in [0, 1].

    A smooth measure for rows without a conflict: the distance of the closest encounter within
    ``GUIDANCE`` and the time to it, in circles around the bodies.
    """
    radii = half[0, 1] + half[e, 1]
    best = math.inf
    for k in range(0, n, GUIDANCE_STEP):
        if distance[k] == math.inf:
            continue
        dx, dy = x[e, k] - x[0, k], y[e, k] - y[0, k]
        wx = v[e, k] * c[e, k] - v[0, k] * c[0, k]
        wy = v[e, k] * s[e, k] - v[0, k] * s[0, k]
        # Closest approach at constant velocity; with circles, not boxes: it only leads a search.
        square, t = wx * wx + wy * wy, 0.0
        if square > 0.0:
            t = min(max(-(dx * wx + dy * wy) / square, 0.0), GUIDANCE)
        gap = max(elementary.hypot(dx + t * wx, dy + t * wy) - radii, 0.0)
        best = min(best, gap / NEAR + t / SOON)
    return elementary.exp(-best)


@kernel
def urgency(time, needed):
    """Return how urgent a collision course is, 0 to 1; ``harm`` has the same formula."""
    return (1.0 - time / HORIZON) * (1.0 - elementary.exp(-needed / SERIOUS_DECELERATION))


@kernel
def most_urgent(half, x, y, c, s, v, gone, distance, e, n, end, dt):
    """Return (time to collision, deceleration needed, instant) of the worst collision course.

    Both predictions must lead to contact within ``HORIZON``: constant velocity, and constant speed
    along the tracks. The later of the two times counts. Of all instants before ``end``, that of the
    greatest `urgency` counts; near misses take precedence. The instant is -1 if there is none.
    """
    la, wa, lb, wb = half[0, 0], half[0, 1], half[e, 0], half[e, 1]
    circles = (math.sqrt(la * la + wa * wa) + math.sqrt(lb * lb + wb * wb)) ** 2 * (1.0 + 1e-9)
    best, best_time, best_needed, at, nearest = -1.0, HORIZON, 0.0, -1, 0
    always = True
    for k in range(end):
        if distance[k] < distance[nearest]:
            nearest = k
        always &= distance[k] < math.inf
    # From the instant of the least distance backwards, then on: a course that is found early lowers
    # `limit`, and later ones are skipped.
    limit, until = HORIZON, n
    for m in range(end):
        k = nearest - m if m <= nearest else m
        speeds = v[0, k] + v[e, k]
        if not distance[k] < limit * speeds:
            continue
        ca, sa, cb, sb = c[0, k], s[0, k], c[e, k], s[e, k]
        dx, dy = x[e, k] - x[0, k], y[e, k] - y[0, k]
        wx, wy = v[e, k] * cb - v[0, k] * ca, v[e, k] * sb - v[0, k] * sa
        if dx * dx + dy * dy > circles:
            across = dx * wy - dy * wx
            if dx * wx + dy * wy >= 0.0 or across * across > circles * (wx * wx + wy * wy):
                continue
        time = time_to_contact(dx, dy, wx, wy, ca, sa, cb, sb, la, wa, lb, wb, STANDSTILL * speeds)
        if time >= limit:
            continue
        faster = gains(v[0, k], v[e, k], ca, sa, cb, sb)
        # A near miss needs two predictions that agree, constant velocity and constant speed along
        # the paths: with one, or by distance, oncoming traffic in bends and passing on the next
        # lane would count.
        for prediction in range(2):
            if prediction == 1:
                if not always:
                    _, until = presence(distance, k, n)
                along = time_along_paths(half, x, y, c, s, v, gone, e, k, n, until, limit)
                time = max(time, along)
            if time >= limit:
                break
            needed = faster / (2.0 * max(time, dt))
            worth = urgency(time, needed)
            if is_serious(time, needed, v[0], distance, k, end, dt):
                worth += 1.0
            if worth < best or (worth == best and time >= best_time):
                break
            if prediction == 1:
                best, best_time, best_needed, at = worth, time, needed, k
                # more time than this cannot be more urgent
                if best < 1.0:
                    limit = max(HORIZON * (1.0 - best), SERIOUS_TTC)
                else:
                    limit = min(HORIZON * (2.0 - best), SERIOUS_TTC)
                limit = min(limit * (1.0 + 1e-9) + 1e-9, HORIZON)
    return best_time, best_needed, at


@kernel
def is_serious(time, needed, v, distance, k, end, dt):
    """Return whether a collision course at instant k is a near miss of an ego with speeds v.

    It is not if the ego already brakes as hard as needed; nor if comfortable braking suffices, and
    the two do not come as near as `CLOSE_CALL` before instant ``end``.
    """
    if time > SERIOUS_TTC or needed < SERIOUS_DECELERATION or v[k] < MOVES:
        return False
    # An ego that brakes as hard as it must has the conflict in hand.
    if k > 0 and needed <= (v[k - 1] - v[k]) / dt:
        return False
    # Braking within what a comfort function may is no near miss, unless the bodies come within 0.5
    # m: ACC's limit alone would drop egos that brake by 5 to 7.6 m/s² and stop 0.04 to 0.33 m from
    # a bus.
    return is_emergency(needed, v[k]) or falls_below(distance, k, end, CLOSE_CALL)


@kernel
def analyse_pair(
    e, n, dt, end, half, kinds, x, y, c, s, v, a, offset, distance, gone, claims, crosswalks,
    friction, stop_entities, stop_lights, stop_lines, lights, lamps, routed, whole, real,
):  # fmt: skip
    """Fill the rows of the ego and body e."""
    contact = end < n and distance[e, end] == 0.0
    at, time, needed = end, 0.0, 0.0
    if not contact:
        time, needed, at = most_urgent(half, x, y, c, s, v, gone, distance[e], e, n, end, dt)
        if at < 0:
            return
    first, until = presence(distance[e], at, n)
    # the bodies at contact: in the step before it, or at constant velocity
    steps = contact and at > first
    k = at - 1 if steps else at
    la, wa, lb, wb = half[0, 0], half[0, 1], half[e, 0], half[e, 1]
    ca, sa, cb, sb = c[0, k], s[0, k], c[e, k], s[e, k]
    dx, dy = x[e, k] - x[0, k], y[e, k] - y[0, k]
    ux, uy, wx, wy = v[0, k] * ca, v[0, k] * sa, v[e, k] * cb, v[e, k] * sb
    appears = contact and not steps
    if steps:
        ux, uy = velocity(x, y, c, s, v, 0, k, dt)
        wx, wy = velocity(x, y, c, s, v, e, k, dt)
        appears = displaced(x, y, v, 0, k, dt) or displaced(x, y, v, e, k, dt)
    wx, wy = wx - ux, wy - uy
    still = STANDSTILL * (v[0, k] + v[e, k])
    after, axis = meeting(dx, dy, wx, wy, ca, sa, cb, sb, la, wa, lb, wb, still)
    # Constant velocity does not lead to this contact: the bodies turn into each other, or one is
    # placed.
    if contact and (appears or after > 2.0 * dt):  # or they turn into each other
        ca, sa, cb, sb = c[0, at], s[0, at], c[e, at], s[e, at]
        dx, dy, after = x[e, at] - x[0, at], y[e, at] - y[0, at], 0.0
        axis = shallow_axis(dx, dy, ca, sa, cb, sb, la, wa, lb, wb)
    dx, dy = dx + after * wx, dy + after * wy
    nx, ny = normal_of(axis, dx, dy, ca, sa, cb, sb)
    own, its = zones(axis, nx, ny, ca, sa, cb, sb)
    own_part = max(ux * nx + uy * ny, 0.0)
    if contact:
        needed = gains(v[0, k], v[e, k], ca, sa, cb, sb) / (2.0 * dt)
    near = not contact and is_serious(time, needed, v[0], distance[e], k, end, dt)
    whole[KIND] = CONTACT if contact else NEAR_MISS if near else COURSE
    whole[INSTANT], whole[ZONE_EGO], whole[ZONE_OTHER] = at, own, its
    leads = (1.0 - 2.0 * FRONT_PART) * la
    whole[LEADS_EGO] = own in (FRONT, FRONT_LEFT, FRONT_RIGHT) or (
        meets_at(nx, ny, dx, dy, ca, sa, cb, sb, la, lb, wb) >= leads
    )
    real[TTC], real[NEEDED] = time, needed
    real[ACROSS], real[ALONG] = max(-(wx * nx + wy * ny), 0.0), abs(wx * ny - wy * nx)
    real[V_EGO], real[V_OTHER] = v[0, k], v[e, k]
    if not contact and not near:
        return
    stood = stood_for(v[0], 0, k, dt)
    if stood == 0.0 and v[0, k] <= CREEPS and a[0, k] <= -COMFORT:
        stood = dt
    along = routed and claims[e] == 0
    kind = type_of(e, first, until, k, dt, kinds, c, s, own, its, own_part, stood, along)
    scene = Scene(
        half, kinds, x, y, c, s, v, a, offset, distance, gone, claims, crosswalks, friction,
        stop_entities, stop_lights, stop_lines, lights, lamps, routed, first, until, dt,
        until - 1 if contact else at, at, near,
    )  # fmt: skip
    crosses = near and kind != REAR_END_STRIKING and kind != REAR_END_STRUCK
    if crosses and (stops_at_red(scene, 0, at, time) or stops_at_red(scene, e, at, time)):
        whole[KIND] = COURSE
        return
    whole[TYPE] = kind
    real[STOOD_EGO], real[STOOD_OTHER] = stood, stood_for(v[e], first, k, dt)
    real[OVERLAP] = overlap(-ny, nx, dx, dy, ca, sa, cb, sb, la, wa, lb, wb)
    judge(scene, e, k, at, kind, own, own_part, appears, whole, real)


@kernel
def analyse_row(
    half, kinds, x, y, c, s, v, a, offset, distance, n, dt, claims, crosswalks, friction,
    stop_entities, stop_lights, stop_lines, lights, lamps, routed, gone, whole, real,
):  # fmt: skip
    """Fill the rows of the ego and each other body; ``gone`` ``(E, T)`` is scratch."""
    n_entities = x.shape[0]
    end = first_contact(distance, n)
    for e in range(n_entities):
        lengths(x[e], y[e], n, gone[e])
    for e in range(1, n_entities):
        real[e, NEARNESS] = nearness(half, x, y, c, s, v, distance[e], e, min(end + 1, n))
        analyse_pair(
            e, n, dt, end, half, kinds, x, y, c, s, v, a, offset, distance, gone, claims[0],
            crosswalks, friction, stop_entities, stop_lights, stop_lines, lights, lamps, routed,
            whole[e], real[e],
        )  # fmt: skip
        if whole[e, KIND] < NEAR_MISS:
            scene = Scene(
                half, kinds, x, y, c, s, v, a, offset, distance, gone, claims[0], crosswalks,
                friction, stop_entities, stop_lights, stop_lines, lights, lamps, routed, 0, n, dt,
                n - 1, min(end, n - 1), False,
            )  # fmt: skip
            force(scene, e, whole[e], real[e])


@kernel
def turned_round(zone):
    """Return the zone of a body whose rear was taken for its front."""
    return zone if zone == NO_ZONE else (zone - FRONT + 4) % 8 + FRONT


@kernel
def name_zones(reverses, whole):
    """Name the zones of bodies that reverse, ``(E, T)``; none where it is empty.

    They were judged as if they drove ahead. One that backs towards the other is not oncoming, and
    who backs gives way, without a rule that says more.
    """
    for e in range(len(reverses)):
        instant = whole[e, INSTANT]
        mine, its = reverses[0, instant], reverses[e, instant]
        if mine:
            whole[e, ZONE_EGO] = turned_round(whole[e, ZONE_EGO])
        if its:
            whole[e, ZONE_OTHER] = turned_round(whole[e, ZONE_OTHER])
        if mine == its:
            continue
        if whole[e, TYPE] == HEAD_ON:
            whole[e, TYPE] = REAR_END_STRIKING if its else REAR_END_STRUCK
        party, rule = OTHER if its else EGO, whole[e, RULE]
        if rule in (WRONG_SIDE, TURNING_GIVES_WAY, ASSUMED_RIGHT_BEFORE_LEFT) or (
            rule == LEFT_ITS_LANE and whole[e, RESPONSIBLE] == party
        ):
            whole[e, RESPONSIBLE], whole[e, RULE] = party, REVERSED


@kernel
def never_moves(v):
    """Return whether a body never moves, like a barrier."""
    k = 0
    while k < len(v) and v[k] == 0.0:
        k += 1
    return k == len(v)


@kernel
def weigh(kinds, v, whole, real, potential, severity, changes, breach):
    """Fill the severity of a row's contacts, near misses and unjustified braking.

    ``potential``, ``severity`` and ``breach`` are ``(E,)``, ``changes`` of velocity ``(E, 2)``.
    """
    for e in range(1, len(kinds)):
        if whole[e, KIND] < NEAR_MISS:
            continue
        # What never moves in the whole scenario, like a barrier, counts as fixed to the ground.
        _, mine, its, _, _, potential[e] = collision(
            kinds[0], kinds[e], real[e, ACROSS], real[e, ALONG], STRUCK[whole[e, ZONE_EGO]],
            STRUCK[whole[e, ZONE_OTHER]], True, not (IS_OBSTACLE[kinds[e]] and never_moves(v[e])),
        )  # fmt: skip
        if whole[e, KIND] == VIOLATION:
            breach[e] = min((real[e, NEEDED] - COMFORT) / (HARD - COMFORT), 1.0)
        if whole[e, KIND] == CONTACT:
            severity[e], changes[e, 0], changes[e, 1] = potential[e], mine, its


@kernel
def analyse_rows(
    failed, half, kinds, x, y, c, s, v, a, offset, distance, n_steps, dt, claims, crosswalks,
    friction, stop_entities, stop_lights, stop_lines, lights, lamps, routed, reverses,
    gone, whole, real, potential, severity, changes, breach,
):  # fmt: skip
    """Analyse N rows; failed ones stay as they are.

    Fills ``whole`` ``(N, E, INTEGERS)``, ``real`` ``(N, E, FLOATS)`` and what `weigh` does.
    """
    for i in range(len(n_steps)):
        if failed[i]:
            continue
        analyse_row(
            half, kinds, x[i], y[i], c[i], s[i], v[i], a[i], offset[i], distance[i], n_steps[i],
            dt, claims[i], crosswalks[i], friction[i], stop_entities, stop_lights, stop_lines[i],
            lights[i], lamps[i], routed, gone, whole[i], real[i],
        )  # fmt: skip
        name_zones(reverses[i], whole[i])
        weigh(kinds, v[i], whole[i], real[i], potential[i], severity[i], changes[i], breach[i])


@kernel
def is_at_fault(kind, what, responsible, leads_ego, preventable):
    """Return whether the ego has failed in a conflict of a kind and type; see `Conflicts`."""
    by_front = leads_ego and what not in BY_OTHERS
    return responsible in (EGO, SHARED) or (kind == CONTACT and preventable and by_front)


@kernel
def fails(pair):
    """Return whether the ego has failed, by a pair's row of whole numbers."""
    return is_at_fault(
        pair[KIND], pair[TYPE], pair[RESPONSIBLE], pair[LEADS_EGO] > 0, pair[PREVENTABLE] > 0
    )


@kernel
def faults(kind, what, responsible, leads_ego, preventable, out):
    """Fill ``out`` ``(N,)`` with `is_at_fault`."""
    for i in range(len(out)):
        out[i] = is_at_fault(kind[i], what[i], responsible[i], leads_ego[i], preventable[i])
