"""Compiled: the outcome if a careful driver had braked on its own path.

It is the driver of UN Regulation 157, Annex 3, on any road. Where the question is whether another
actor was forced to brake, it brakes comfortably, after the same reaction time. In a near miss the
careful driver must avoid the near miss, not the contact.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.assess.conflict._geometry_kernels import pose_on
from bridgegen.assess.conflict._limits import (
    AHEAD_BY,
    BEND_SHARE,
    BRAKES_FOR,
    BRISK_FAST,
    BRISK_SLOW,
    CLOSE_CALL,
    HEADWAY,
    HEADWAY_RISE,
    JERK,
    MOST_HEADWAY,
    MOVES,
    OPENING,
    OPENS_TO,
    REACTION,
    SAME_WAY,
    SERIOUS_DECELERATION,
    SERIOUS_TTC,
)
from bridgegen.assess.metrics._time_kernels import STANDSTILL, separation, time_to_contact
from bridgegen.base.compiled import kernel

CLEAR, COMES_NEAR, COLLIDES = range(3)
"""Outcomes of braking: no conflict, a near miss, a collision."""


@kernel
def gains(speed, other, ca, sa, cb, sb):
    """Return by how much a body is faster than another, along its own heading [m/s].

    It must lose this much speed to avoid the other. A crossing or oncoming one counts as standing:
    braking ends at standstill.
    """
    return max(speed - max(other * (cb * ca + sb * sa), 0.0), 0.0)


@kernel
def is_emergency(needed, speed):
    """Return whether a body of this speed needs more deceleration than a comfort function has."""
    slow, most = BRISK_SLOW
    fast, least = BRISK_FAST
    share = min(max((speed - slow) / (fast - slow), 0.0), 1.0)
    return needed > most + share * (least - most)


@kernel
def bend_at(scene, a, i):
    """Return the curvature of body a's track at instant i [1/m]."""
    gone = scene.gone[a]
    length = gone[i + 1] - gone[i] if i + 1 < scene.n else 0.0
    if length <= 0.0:
        return 0.0
    c, s = scene.c[a], scene.s[a]
    return (c[i] * s[i + 1] - s[i] * c[i + 1]) / length


@kernel
def careful_speed(scene, i, speed):
    """Return a careful driver's speed at instant i of the ego's track, ``speed`` at most [m/s].

    It drives no faster than the ego did there (which had slowed down before the bend, or given
    way), and takes a bend with `BEND_SHARE` of the grip.
    """
    recorded, bend = scene.v[0, i], abs(bend_at(scene, 0, i))
    if MOVES < recorded < speed:
        speed = recorded
    if bend > 0.0 and speed * speed * bend > BEND_SHARE * scene.friction:
        speed = math.sqrt(BEND_SHARE * scene.friction / bend)
    return speed


@kernel
def gives(scene, a, i, speed):
    """Return the greatest deceleration of body a at instant i of its track at a speed [m/s²].

    The friction circle applies: grip used in a bend is not available for braking.
    """
    if scene.friction == math.inf:
        return scene.friction
    across = speed * speed * bend_at(scene, a, i)
    return math.sqrt(max(scene.friction * scene.friction - across * across, 0.0))


@kernel
def follows(gap, speed, its):
    """Return the deceleration by which a driver increases the gap to a vehicle ahead [m/s²].

    It does so while the gap is shorter than UN R157 requires, and it is not much slower already.
    """
    headway = min(HEADWAY + speed * HEADWAY_RISE, MOST_HEADWAY)
    return OPENING if gap < headway * speed and speed > OPENS_TO * its else 0.0


@kernel
def braked(scene, a, b, k, start, braking):
    """Return the outcome for body a if it brakes: of `braked_and_stood`, up to where it stands."""
    return braked_and_stood(scene, a, b, k, start, braking, False)


@kernel
def braked_and_stood(scene, a, b, k, start, braking, stands):
    """Return the outcome for body a on its own track if it brakes from instant ``start`` on.

    From instant k to ``start`` it increases its gap to b as drivers do, see `follows`. The ego is
    never faster than `careful_speed`.

    ``start`` may lie between two instants: a body that comes into sight within a step was once seen
    up to a step late, and in cut-out 5 of 402 failures were excused as revealed late at 0.05 s, and
    not at 0.025 s. It keeps its motion for ``REACTION``; then its deceleration rises by ``JERK`` up
    to ``braking`` [m/s²], or as far as the tyres allow. b moves as recorded up to ``scene.until``,
    then keeps its speed on its track. A body that stands when b runs into it counts as clear:
    braking cannot do more; unless it ``stands`` in the way of b, which must have stopped before it
    then. One that crosses b's way and is ahead of its recorded place when they meet is not clear:
    it has escaped by not braking.
    """
    half, x, y, c, s, v, gone = (
        scene.half,
        scene.x,
        scene.y,
        scene.c,
        scene.s,
        scene.v,
        scene.gone,
    )
    dt, n, until = scene.dt, scene.n, scene.until
    la, wa, lb, wb = half[a, 0], half[a, 1], half[b, 0], half[b, 1]
    worst = CLEAR
    k_meet = scene.at
    crosses = c[a, k_meet] * c[b, k_meet] + s[a, k_meet] * s[b, k_meet] < SAME_WAY
    at, speed, slowed, i, j = gone[a, k], v[a, k], 0.0, k, min(k, until)
    apart, urgent = math.inf, False
    for m in range(k, int(start) + int(BRAKES_FOR / dt)):
        if m > k:
            harder = slowed
            if m <= start:
                harder = follows(apart, speed, v[b, min(m - 1, until)])
            elif (m - start) * dt > REACTION + 1e-9:
                rises = min((m - start) * dt - REACTION, dt)
                # Not 0.774 g on every road: the tyres limit it, less what holds the car in its
                # bend.
                harder = min(slowed + JERK * rises, braking, gives(scene, a, i, speed))
            after = max(speed - 0.5 * (slowed + harder) * dt, 0.0)
            slowed = harder
            at += 0.5 * (speed + after) * dt
            speed = after
        i, xa, ya = pose_on(x[a], y[a], c[a], s[a], gone[a], n, i, at)
        if a == 0:  # another's speed may be its answer to the ego already
            speed = careful_speed(scene, i, speed)
        way = gone[b, m] if m <= until else gone[b, until] + v[b, until] * (m - until) * dt
        j, xb, yb = pose_on(x[b], y[b], c[b], s[b], gone[b], n, j, way)
        if m <= until:  # a body that moves without a path: sideways, or on the spot
            j, xb, yb = m, x[b, m], y[b, m]
        dx, dy = xb - xa, yb - ya
        apart = separation(dx, dy, c[a, i], s[a, i], c[b, j], s[b, j], la, wa, lb, wb)
        its = v[b, min(m, until)]
        if apart <= 0.0:
            return worst if speed <= 0.0 and its > 0.0 and not stands else COLLIDES
        if urgent and apart < CLOSE_CALL:
            worst = COMES_NEAR
        meets = crosses and (speed <= 0.0 or m == k_meet)
        if meets and at > gone[a, k_meet] + AHEAD_BY:
            return COLLIDES
        if speed <= 0.0:
            if stands and its > 0.0:
                continue
            return worst
        if scene.near and worst == CLEAR and speed >= MOVES:
            wx, wy = its * c[b, j] - speed * c[a, i], its * s[b, j] - speed * s[a, i]
            time = time_to_contact(
                dx, dy, wx, wy, c[a, i], s[a, i], c[b, j], s[b, j], la, wa, lb, wb,
                STANDSTILL * (speed + its),
            )  # fmt: skip
            faster = gains(speed, its, c[a, i], s[a, i], c[b, j], s[b, j])
            needed = faster / (2.0 * max(time, dt))
            if time <= SERIOUS_TTC and needed >= SERIOUS_DECELERATION and needed > slowed:
                urgent = True
                if is_emergency(needed, speed) or apart < CLOSE_CALL:
                    worst = COMES_NEAR
    return worst
