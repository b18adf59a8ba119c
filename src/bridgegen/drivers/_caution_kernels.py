"""Slowing for pedestrians who might step out, and for places that may hide one.

A pedestrian at the side, ``room`` [m] from the strip that the ego sweeps, reaches it after
room/`WALK` seconds. Up to the speed from which the ego stops in that time a collision is
impossible: if they step out late, it is past; if early, it stands.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._following_kernels import COMFORT_DECELERATION
from bridgegen.drivers._path_kernels import aside_at
from bridgegen.drivers._surroundings_kernels import (
    ACROSS,
    ALONG,
    ASIDE,
    AT,
    HALF_LENGTH,
    HALF_WIDTH,
    NEAR,
)
from bridgegen.drivers._tracking_kernels import KIND
from bridgegen.drivers.kinds import HIDES_PEOPLE, IS_ON_FOOT

ENTER, LEAVE, RIGHT_END, LEFT_END = 0, 1, 2, 3
"""Columns of a crosswalk: where the ego's route enters and leaves it, and how far it reaches to
the right (negative) and to the left of the route [m]."""

WALK = 1.5  # m/s; source: Euro NCAP AEB VRU, adult walking 5 km/h, rounded up
REACTION = 0.4  # s, from seeing a pedestrian move to full braking
BRAKING_SHARE = 0.7  # of the friction limit that it relies on
CREEP = 2.0  # m/s, always allowed
AT_SIDE = 3.5  # m from the ego's strip within which a standing pedestrian may step out
BY_CROSSWALK = 3.0  # m before and behind a crosswalk that still count as at it
HIDES = 25.0  # m before a crosswalk, within which a standing vehicle hides an end of it
PARKED_SPEED = 8.3  # m/s past parked vehicles; 30 km/h, as in residential streets (StVO § 45)
PARKED_ROOM = 1.5  # m; parked vehicles farther to the side need no slowing
STANDS = 0.3  # m/s, below which a track counts as standing


@kernel
def safe_speed(room, friction_limit):
    """Return the speed [m/s] that is safe if a pedestrian at ``room`` [m] steps out any time."""
    spare = max(room, 0.0) / WALK - REACTION
    return max(2.0 * BRAKING_SHARE * friction_limit * spare, CREEP)


@kernel
def slow_to(speed, distance):
    """Return the speed [m/s] now from which ``speed`` is reached comfortably in time."""
    return math.sqrt(speed * speed + 2.0 * COMFORT_DECELERATION * max(distance, 0.0))


@kernel
def careful_speed(around, tracks, crosswalks, s, front, half_width, shift, in_town, friction_limit):
    """Return the speed [m/s] that actors beside the route and what they hide allow; +inf: any."""
    best = math.inf
    for e in range(1, around.shape[0]):
        if around[e, NEAR] == 0.0 or around[e, AT] + around[e, HALF_LENGTH] < s:
            continue
        kind = int(tracks[e, KIND])
        distance = around[e, AT] - around[e, HALF_LENGTH] - s - front
        aside = aside_at(shift, s + max(distance, 0.0))
        room = abs(around[e, ASIDE] - aside) - around[e, HALF_WIDTH] - half_width
        if room < 0.0 or elementary.hypot(around[e, ALONG], around[e, ACROSS]) > STANDS:
            continue
        if IS_ON_FOOT[kind]:
            if room < AT_SIDE or at_crosswalk(crosswalks, around[e, AT]):
                best = min(best, slow_to(safe_speed(room, friction_limit), distance))
        elif in_town and HIDES_PEOPLE[kind] and room < PARKED_ROOM:
            best = min(best, slow_to(PARKED_SPEED, distance))
            hidden = hidden_speed(around, e, crosswalks, s, front, half_width, room, friction_limit)
            best = min(best, hidden)
    return best


@kernel
def at_crosswalk(crosswalks, at):
    """Return whether a station is at a crosswalk."""
    for i in range(crosswalks.shape[0]):
        if crosswalks[i, ENTER] - BY_CROSSWALK <= at <= crosswalks[i, LEAVE] + BY_CROSSWALK:
            return True
    return False


@kernel
def hidden_speed(around, e, crosswalks, s, front, half_width, room, friction_limit):
    """Return the speed [m/s] for pedestrians that a standing vehicle hides at a crosswalk."""
    best = math.inf
    end = around[e, AT] + around[e, HALF_LENGTH]
    for i in range(crosswalks.shape[0]):
        enter = crosswalks[i, ENTER]
        if not end - around[e, HALF_LENGTH] <= enter + BY_CROSSWALK <= end + HIDES:
            continue
        if s > crosswalks[i, LEAVE]:
            continue
        # The nearer the ego, the more of the crosswalk it sees past the vehicle's far corner.
        opened = (room + half_width) * (enter - s) / max(end - s, 0.5) - half_width
        speed = safe_speed(max(opened, room), friction_limit)
        best = min(best, slow_to(speed, enter - s - front))
    return best
