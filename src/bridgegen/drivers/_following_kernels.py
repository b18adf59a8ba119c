"""Keeping a distance: the intelligent driver model, calmed where it would overreact.

Sources: Treiber, Hennecke, Helbing, Phys. Rev. E 62 (2000) 1805 (IDM), with their city values
rounded; Kesting, Treiber, Helbing, Phil. Trans. R. Soc. A 368 (2010) 4585 (constant-acceleration
heuristic: a short gap to a leader that is not slower needs no hard braking).
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import aside_at
from bridgegen.drivers._surroundings_kernels import (
    ACROSS,
    ALONG,
    ASIDE,
    AT,
    COSINE,
    GAINING,
    HALF_LENGTH,
    HALF_WIDTH,
    NEAR,
)
from bridgegen.drivers._tracking_kernels import KIND, LAMPS
from bridgegen.drivers.kinds import HAZARD, LEFT, NEEDS_ROOM, RIGHT

COMFORT_ACCELERATION = 1.5  # m/s²
COMFORT_DECELERATION = 2.0  # m/s²
HEADWAY = 1.2  # s
STANDSTILL_GAP = 2.0  # m
COOLNESS = 0.99  # share of the heuristic; source: Kesting et al., table 1
LEAST_GAP = 0.1  # m, below which the model divides by this
STOP_MARGIN = 1.5  # m, between the front bumper and a point to stop at
BRAKE_FROM = 1.5  # m/s²; it brakes for a point to stop at once stopping needs this much

SIDE_GAP = 0.3  # m; an actor nearer to the strip that the ego will sweep is in its way …
SIDE_GAP_ON_FOOT = 0.8  # m; … nearer than this, if on foot or on a bicycle
COMING_IN = 1.2  # s; an actor whose lateral motion brings it there so soon counts as well …
DRIFT = 0.3  # m/s; … if that is faster than this, above the noise of tracking
SAME_WAY = 0.5  # cosine of the heading difference below which an actor goes another way …
HEAD_ON = -0.9  # … and below which it is oncoming
STANDS = 0.5  # m/s, below which an actor stands
LET_IN = 3.0  # m; who is no farther beside and indicates this way is let in, in comfort
LET_OUT = 5.6  # m/s; for one who stands, it slows to so much; StVO § 20: with special care


@kernel
def idm(gap, v, leader_speed):
    """Return the acceleration [m/s²] that a leader at a gap [m] allows, by the model alone."""
    desired = STANDSTILL_GAP + max(
        0.0,
        v * HEADWAY
        + v * (v - leader_speed) / (2.0 * math.sqrt(COMFORT_ACCELERATION * COMFORT_DECELERATION)),
    )
    ratio = desired / max(gap, LEAST_GAP)
    return COMFORT_ACCELERATION * (1.0 - ratio * ratio)


@kernel
def follow(gap, v, leader_speed, leader_acceleration):
    """Return the acceleration [m/s²] for a leader at a gap [m]; at most `COMFORT_ACCELERATION`."""
    # Avoids contact if both keep their acceleration, with half of the standstill gap to spare.
    free = max(gap - 0.5 * STANDSTILL_GAP, LEAST_GAP)
    w, slowing = max(leader_speed, 0.0), min(leader_acceleration, 0.0)
    closing = max(v - leader_speed, 0.0)
    if slowing < 0.0 and w * (v - w) <= -2.0 * free * slowing:
        needed = v * v * slowing / (w * w - 2.0 * free * slowing)
    else:
        needed = slowing - 0.5 * closing * closing / free
    model = idm(gap, v, leader_speed)
    if model >= needed:
        return model
    # IDM alone brakes at the friction limit for a short gap to a leader that is as fast. With the
    # heuristic the largest change of acceleration falls from 8.3 to 3.8 m/s² (cut-in), and from 8.4
    # to 2.1 (motorway-merge).
    calmed = needed + COMFORT_DECELERATION * elementary.tanh(
        (model - needed) / COMFORT_DECELERATION
    )
    return (1.0 - COOLNESS) * model + COOLNESS * calmed


@kernel
def let_in(lamps, beside, space, gap, v, speed, acceleration):
    """Return the acceleration [m/s²] by which an actor beside is let in; +inf if it is not.

    The actor shows ``lamps`` (`bridgegen.drivers.kinds`) ``beside`` the strip, left positive, at so
    much ``space``, and its rear end is ahead by a ``gap`` [m]. Whoever indicates has no right of
    way, so braking stays comfortable.
    """
    shown = int(lamps) & HAZARD
    if shown != (RIGHT if beside > 0.0 else LEFT) or space > LET_IN or gap < 0.0:
        return math.inf
    # It would wait for ever behind one that indicates and does not move, as a bus at its stop.
    if speed < STANDS and v <= LET_OUT:
        return math.inf
    # Who does not make room is at no fault (StVO § 7 (5)), so no emergency may arise from a lamp.
    return max(follow(gap, v, speed, acceleration), -COMFORT_DECELERATION)


@kernel
def stop_for(distance, v):
    """Return the acceleration [m/s²] that stops before a point; +inf while that is not urgent."""
    needed = v * v / (2.0 * max(distance - STOP_MARGIN, 0.1))
    if needed >= BRAKE_FROM or distance < STOP_MARGIN + 0.5:
        return -max(needed, BRAKE_FROM)
    return math.inf


@kernel
def keep_distance(around, tracks, s, front, rear, half_width, shift, v):
    """Return the acceleration [m/s²] that actors ahead on the ego's strip require; +inf if none.

    The ego's centre line leaves its route by a ``shift``; its future offset counts.
    """
    asked = math.inf
    for e in range(1, around.shape[0]):
        if around[e, NEAR] == 0.0 or around[e, AT] + around[e, HALF_LENGTH] < s - rear:
            continue
        rear_end = around[e, AT] - around[e, HALF_LENGTH]
        beside = around[e, ASIDE] - aside_at(shift, max(rear_end - front, s))
        space = abs(beside) - around[e, HALF_WIDTH] - half_width
        least = SIDE_GAP_ON_FOOT if NEEDS_ROOM[int(tracks[e, KIND])] else SIDE_GAP
        nearing = -around[e, ACROSS] if beside > 0.0 else around[e, ACROSS]
        moves = elementary.hypot(around[e, ALONG], around[e, ACROSS]) > STANDS
        if moves and HEAD_ON < around[e, COSINE] < SAME_WAY:
            continue  # it crosses: a matter of giving way, not of following
        gap = rear_end - s - front
        if space > least and (nearing < DRIFT or space - nearing * COMING_IN > least):
            if around[e, COSINE] >= SAME_WAY:
                allowed = let_in(
                    tracks[e, LAMPS],
                    beside,
                    space,
                    gap,
                    v,
                    max(around[e, ALONG], 0.0),
                    around[e, GAINING],
                )
                asked = min(asked, allowed)
            continue
        if gap < 0.0 and around[e, AT] < s + front:
            continue  # beside the ego: braking would not separate them
        speed = around[e, ALONG] if moves else 0.0
        asked = min(asked, follow(gap, v, speed, around[e, GAINING]))
    return asked
