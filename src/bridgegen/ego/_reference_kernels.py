"""The reference ego: slows for bends, follows, yields and brakes by predicted conflict.

Perception is perfect, and so is knowledge of where the others are going (as if their indicators
told): each is predicted along its route at its present speed. Where two routes come closer than
two cars abreast lies their conflict zone; the ego enters it only if it will be clear of the other.
The driver is a function of the present state alone.

A conflict zone is a row of five: where the ego's route enters and leaves it [m], where the other's
does [m], and 1 if the routes go on together from there (a merge), else 0. No zone: infinity.
"""

import math

from bridgegen.compiled import kernel
from bridgegen.ego._path_kernels import COS, CURVATURE, SIN, X, Y
from bridgegen.ego._route_follower_kernels import hold_speed

# Intelligent driver model; source: Treiber, Hennecke, Helbing, Phys. Rev. E 62 (2000) 1805, with
# their city values rounded.
COMFORT_ACCELERATION = 1.5  # m/s²
COMFORT_DECELERATION = 2.0  # m/s²
HEADWAY = 1.2  # s
STANDSTILL_GAP = 2.0  # m

LATERAL_COMFORT = 3.0  # m/s², in bends; drivers keep below 4 (UN R79 annex 3 allows 3)
FRICTION_SHARE = 0.6  # of the friction limit that it plans to use in a bend
SIDE_MARGIN = 0.6  # m, kept to another body's side
TIME_MARGIN = 1.0  # s, kept between two bodies' turns at one point
STOP_MARGIN = 1.5  # m, between the front bumper and the point of conflict
HORIZON = 6.0  # s, how far it predicts
BRAKE_FROM = 1.5  # m/s², it acts on a conflict once stopping for it needs this much
SCAN_STEP = 1.0  # m, between the points of its route that it looks at
SAME_WAY = 0.9  # cosine of the heading difference above which two routes go on together


@kernel
def scan_length(v):
    """Return how far ahead [m] the driver looks: to stop comfortably, and a reaction more."""
    return 12.0 + 1.5 * v + v * v / (2.0 * COMFORT_DECELERATION)


@kernel
def plan_speed(path, n, ds, s, v, target, friction_limit):
    """Return the speed [m/s] that the bends ahead allow, at most ``target``."""
    lateral = min(LATERAL_COMFORT, FRICTION_SHARE * friction_limit)
    stride = max(int(SCAN_STEP / ds), 1)
    first = int(s / ds)
    last = min(n - 1, first + int(scan_length(v) / ds))
    best = target * target
    for i in range(first, last, stride):
        bend = abs(path[i, CURVATURE])
        if bend > 1e-4:
            allowed = lateral / bend + 2.0 * COMFORT_DECELERATION * max(i * ds - s, 0.0)
            best = min(best, allowed)
    return math.sqrt(best)


@kernel
def follow(gap, v, leader_speed):
    """Return the interaction part of the IDM's acceleration [m/s²] for a leader at a gap [m]."""
    desired = STANDSTILL_GAP + max(
        0.0,
        v * HEADWAY
        + v * (v - leader_speed) / (2.0 * math.sqrt(COMFORT_ACCELERATION * COMFORT_DECELERATION)),
    )
    ratio = desired / max(gap, 0.1)
    return COMFORT_ACCELERATION * (1.0 - ratio * ratio)


@kernel
def find_zone(path, n, ds, body, other_path, other_n, other_ds, other_body, zone):
    """Fill ``zone`` with the first conflict zone of two routes."""
    side = 0.5 * (body[1] + other_body[1]) + SIDE_MARGIN
    zone[:] = (math.inf, math.inf, math.inf, math.inf, 0.0)
    stride = max(int(0.5 * SCAN_STEP / ds), 1)
    other_stride = max(int(0.5 * SCAN_STEP / other_ds), 1)
    last_i, last_j = -1, -1
    for i in range(0, n, stride):
        nearest, at = math.inf, -1
        for j in range(0, other_n, other_stride):
            dx, dy = path[i, X] - other_path[j, X], path[i, Y] - other_path[j, Y]
            gap = dx * dx + dy * dy
            if gap < nearest:
                nearest, at = gap, j
        if nearest < side * side:
            q = at * other_ds
            if last_i < 0:
                zone[0], zone[2], zone[3] = i * ds, q, q
            zone[1], zone[2], zone[3] = i * ds, min(zone[2], q), max(zone[3], q)
            last_i, last_j = i, at
        elif last_i >= 0:
            break
    if last_i >= 0:
        along = (
            path[last_i, COS] * other_path[last_j, COS]
            + path[last_i, SIN] * other_path[last_j, SIN]
        )
        zone[4] = 1.0 if along > SAME_WAY else 0.0


@kernel
def react(s, v, own, q, w, other, zone):
    """Return the acceleration [m/s²] that one other body asks for; +inf where it asks nothing.

    The ego is at station s of its route at speed v, the other at q of its own at w; ``own`` and
    ``other`` are rows (length, width, centre ahead of the reference point) [m].
    """
    front, rear = own[2] + 0.5 * own[0], 0.5 * own[0] - own[2]
    other_front, other_rear = other[2] + 0.5 * other[0], 0.5 * other[0] - other[2]
    merges = zone[4] > 0.0
    if s - rear > zone[1] or (q - other_rear > zone[3] and not merges):
        return math.inf
    to_enter = zone[0] - front - s  # what is left until our bumper is in
    inside = q + other_front > zone[2]
    if merges and inside:
        # It drives before us, or will: its place on our route, counted from the common end.
        ahead = zone[1] - (zone[3] - q)
        if ahead >= s:
            return follow(ahead - other_rear - front - s, v, w)
        return math.inf
    if to_enter <= 0.0:
        return math.inf  # we are in: the way out is forward
    if inside:
        if w < 0.1:
            return stop_for(to_enter, v)
        leaves = (zone[3] + other_rear - q) / w
        if to_enter / max(v, 1.0) < leaves + TIME_MARGIN:
            return stop_for(to_enter, v)
        return math.inf
    if w < 0.1:
        return math.inf
    pace = max(v, 1.0)
    enters = (zone[2] - other_front - q) / w
    width = 0.0 if merges else zone[3] - zone[2]
    leaves = enters + (width + other[0]) / w
    arrives = to_enter / pace
    clears = arrives + (own[0] + (0.0 if merges else zone[1] - zone[0])) / pace
    if enters < HORIZON and arrives < leaves + TIME_MARGIN and clears > enters - TIME_MARGIN:
        return stop_for(to_enter, v)
    return math.inf


@kernel
def stop_for(distance, v):
    """Return the acceleration [m/s²] that stops before a point; +inf while that is not urgent."""
    needed = v * v / (2.0 * max(distance - STOP_MARGIN, 0.1))
    if needed >= BRAKE_FROM or distance < STOP_MARGIN + 0.5:
        return -max(needed, BRAKE_FROM)
    return math.inf


@kernel
def drive(path, n, ds, v, target, friction_limit, bodies, station, speed, k, zones, on, to, foot):
    """Return the acceleration [m/s²] demanded at instant k.

    ``station`` ``(E,)`` [m] and ``speed`` ``(E, T)`` [m/s] are those of all, the ego's first;
    ``zones`` has a row per path. Who is between two paths (``to`` ≥ 0, at the station ``foot`` of
    the other one) counts on both.
    """
    s = station[0]
    planned = plan_speed(path, n, ds, s, v, target, friction_limit)
    demanded = min(max(hold_speed(v, planned), -2.0 * COMFORT_DECELERATION), COMFORT_ACCELERATION)
    for e in range(1, len(station)):
        p, q = on[e], to[e]
        if zones[p, 0] < math.inf:
            asked = react(s, v, bodies[0], station[e], speed[e, k], bodies[e], zones[p])
            demanded = min(demanded, asked)
        if q >= 0 and zones[q, 0] < math.inf:
            asked = react(s, v, bodies[0], foot[e], speed[e, k], bodies[e], zones[q])
            demanded = min(demanded, asked)
    return demanded
