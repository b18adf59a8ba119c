"""The reference ego: slows for bends, follows, yields and brakes by predicted conflict.

Perception is perfect; every other body is predicted at constant velocity. The driver is a function
of the present state alone.
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
SAME_WAY = 0.7  # cosine of the heading difference above which two bodies go the same way


@kernel
def scan_length(v):  # type: ignore[no-untyped-def]
    """Return how far ahead [m] the driver looks: to stop comfortably, and a reaction more."""
    return 12.0 + 1.5 * v + v * v / (2.0 * COMFORT_DECELERATION)


@kernel
def plan_speed(path, n, ds, s, v, target, friction_limit):  # type: ignore[no-untyped-def]
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
def follow(gap, v, leader_speed):  # type: ignore[no-untyped-def]
    """Return the interaction part of the IDM's acceleration [m/s²] for a leader at a gap [m]."""
    desired = STANDSTILL_GAP + max(
        0.0,
        v * HEADWAY
        + v
        * (v - leader_speed)
        / (2.0 * math.sqrt(COMFORT_ACCELERATION * COMFORT_DECELERATION)),
    )
    ratio = desired / max(gap, 0.1)
    return COMFORT_ACCELERATION * (1.0 - ratio * ratio)


@kernel
def react(path, n, ds, s, v, own, qx, qy, qh, w, other):  # type: ignore[no-untyped-def]
    """Return the acceleration [m/s²] that one other body asks for; +inf where it asks nothing.

    ``own`` and ``other`` are rows (length, width, centre ahead of the reference point) [m];
    (qx, qy), qh, w are the other's reference point, heading and speed.
    """
    nothing = math.inf
    front, rear = own[2] + 0.5 * own[0], 0.5 * own[0] - own[2]
    c, t = math.cos(qh), math.sin(qh)
    cx, cy = qx + other[2] * c, qy + other[2] * t
    half = 0.5 * other[0]
    side = 0.5 * (own[1] + other[1]) + SIDE_MARGIN
    first = int(s / ds)
    # Somebody who follows in our own lane is not ours to yield to.
    i = min(first, n - 1)
    dx, dy = path[i, X] - cx, path[i, Y] - cy
    same_way = c * path[i, COS] + t * path[i, SIN] > SAME_WAY
    if same_way and dx * c + dy * t > 0.0 and abs(-dx * t + dy * c) < side:
        return nothing
    stride = max(int(SCAN_STEP / ds), 1)
    last = min(n - 1, first + int(scan_length(v) / ds))
    pace = max(v, 1.0)
    conflict = -1.0
    for i in range(first, last, stride):
        d = i * ds - s
        if d < front:
            continue
        dx, dy = path[i, X] - cx, path[i, Y] - cy
        along = dx * c + dy * t
        across = abs(-dx * t + dy * c)
        if across > side:
            continue
        if abs(along) < half + 0.5 * own[1]:
            # It stands on our route now: a leader, or an obstacle.
            speed = max(w * (c * path[i, COS] + t * path[i, SIN]), 0.0)
            asked = follow(d - front, v, speed)
            if conflict >= 0.0:
                asked = min(asked, stop_for(conflict - front, v))
            return asked
        if conflict < 0.0 and w > 0.1:
            enters = (along - half - 0.5 * own[1]) / w
            leaves = (along + half + 0.5 * own[1]) / w
            if leaves > 0.0 and enters < HORIZON:
                arrives, clears = (d - front) / pace, (d + rear) / pace
                if arrives < leaves + TIME_MARGIN and clears > enters - TIME_MARGIN:
                    conflict = d
    if conflict >= 0.0:
        return stop_for(conflict - front, v)
    return nothing


@kernel
def stop_for(distance, v):  # type: ignore[no-untyped-def]
    """Return the acceleration [m/s²] that stops before a point; +inf while that is not urgent."""
    needed = v * v / (2.0 * max(distance - STOP_MARGIN, 0.1))
    if needed >= BRAKE_FROM or distance < STOP_MARGIN + 0.5:
        return -max(needed, BRAKE_FROM)
    return math.inf


@kernel
def drive(path, n, ds, s, v, target, friction_limit, boxes, x, y, h, speed, k):  # type: ignore[no-untyped-def]
    """Return the acceleration [m/s²] demanded at instant k among all bodies (rows 1.. of x, y …)."""
    planned = plan_speed(path, n, ds, s, v, target, friction_limit)
    demanded = min(max(hold_speed(v, planned), -2.0 * COMFORT_DECELERATION), COMFORT_ACCELERATION)
    for e in range(1, x.shape[0]):
        asked = react(
            path, n, ds, s, v, boxes[0], x[e, k], y[e, k], h[e, k], speed[e, k], boxes[e]
        )
        demanded = min(demanded, asked)
    return demanded
