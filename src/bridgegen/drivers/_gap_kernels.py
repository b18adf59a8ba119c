"""A lane change of the ego's route: when its driver makes it, and what waiting for a gap asks for.

The route says in which stretch it changes to the lane beside, and there are ways that begin to at
several places of it. Until a driver that looks has decided it is on the last of these ways, so that
its own lane is what lies ahead; it decides at each place in turn, and then is on that way. It
indicates first. The gap must do for both who will be behind the other: the one that closes in can
brake comfortably, and a second of the slower one's speed remains between them. While there is none,
it follows the vehicle ahead on that lane, too, and brakes to stop before the last place.

Ways are rows of ``changes`` ``(V, 8)``, the first place first: the path that changes there, where
on it the change begins and how long it is [m], how far left it leads [m], and the path along which
traffic comes on the other lane; where on it the way returns to its first lane (+inf: it does not)
and over which length [m], and 1 where traffic on the other lane is oncoming.

Oncoming traffic goes first: the ego leaves its lane only if it is back `CLEARS` before it meets
whoever comes, who keeps its speed or what it gains in a second. The ego reckons that it accelerates
comfortably, up to what the bend of its way back allows. As long as it can stop on its lane, it goes
back when somebody comes whom it has not seen.

Sources: UN Regulation 79, 5.6.4.7 (a change is critical if the one behind must brake by more than
3 m/s² after 0.4 s, so as to keep the distance that the vehicle travels in 1 s) and 5.6.4.6 (the
indicator flashes for 3 s before). That the same is kept to who is ahead is ours. Of oncoming
traffic: StVO § 6; Vienna Convention, Art. 12 (1).
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers import _tracking_kernels as tracking
from bridgegen.drivers._following_kernels import (
    COMFORT_DECELERATION,
    COMING_IN,
    DRIFT,
    SIDE_GAP,
    STANDSTILL_GAP,
    follow,
    stop_for,
)
from bridgegen.drivers._lane_change_kernels import FAR_BEHIND, LAST, pace_of
from bridgegen.drivers._path_kernels import project
from bridgegen.drivers._perception_kernels import know_body
from bridgegen.drivers._route_follower_kernels import SPEED_TIME
from bridgegen.drivers._speed_kernels import LATERAL_COMFORT
from bridgegen.drivers._surroundings_kernels import (
    ACROSS,
    ASIDE,
    AT,
    COSINE,
    GAINING,
    HALF_LENGTH,
    HALF_WIDTH,
    NEAR,
    QUICKENING,
    surround,
)
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.drivers._yielding_kernels import ACROSS as CROSSES
from bridgegen.drivers._yielding_kernels import ENTER, ENTITY, HOW, MOST_GAIN, SAME_WAY, time_to
from bridgegen.drivers.kinds import LEFT, RIGHT

PATH, BEGINS, LENGTH, LEADS, TARGET, RETURNS, BACK, AGAINST = range(8)

SIGNALS, ABREAST, WAS_FREE = range(LAST + 1, LAST + 4)
"""Slots of ``mind``: for how long it has indicated [s], the station on the other lane that it is
abreast of [m], for how long it has seen a gap [s]."""

INDICATES = 3.0  # s, before a change; source: UN R79, 5.6.4.6
FOLLOWER_BRAKES = 3.0  # m/s², by no more than this, …
FOLLOWER_DELAY = 0.4  # s, … after this, …
FOLLOWER_HEADWAY = 1.0  # s, … to keep this; source: UN R79, 5.6.4.7
# With a second to the last, it and one who let it in braked together down to walking speed, in one
# of ten random rows of merge-ego.
LAST_HEADWAY = 0.5  # s, instead, once it brakes for the end of the stretch; ours
KEEPS_TO = (
    1.0  # m, towards the ego from the middle of the other lane, up to which a body keeps to it
)
GOES_ON = 3.0  # m/s²; from a gap that it needs more to stop before, it goes on
AHEAD = 200.0  # m, how far ahead it looks on the other lane
CLEARS = 2.0  # s, left to oncoming traffic when it is back; ours
SETTLED = 2.0  # s, for which it must have seen one that comes to know its speed; ours
GAINS_FOR = 1.0  # s, for which it expects who comes to go on to speed up
EDGE = 1.2  # m aside, beyond which it does not go back; a car's side is 0.4 m over the line then
LOOKS = 1.0  # s, for which it must have seen the lane free: sensors lose one that is far away
IS_BACK = 0.65  # of the way back, after which two cars have 0.6 m between them
PASSES_AT = 8.0  # m/s, by no more than which it reckons beside what stands in its lane; ours
FALLS_BACK = 2.0  # m/s, slower than the vehicle beside or ahead that it lets get away


@kernel
def leads_on(changes, p):
    """Return whether path p is the ego's first, or one on which its route changes lanes."""
    for j in range(changes.shape[0]):
        if changes[j, PATH] == p:
            return True
    return p == 0


@kernel
def led_aside(changes, p, s):
    """Return how far left of its first lane the ego's way leads at a station [m]."""
    for j in range(changes.shape[0]):
        if changes[j, PATH] == p:
            u = min(max((s - changes[j, BEGINS]) / changes[j, LENGTH], 0.0), 1.0)
            w = min(max((s - changes[j, RETURNS]) / changes[j, BACK], 0.0), 1.0)
            out = changes[j, LEADS] * u * u * (3.0 - 2.0 * u)
            return out - changes[j, LEADS] * w * w * (3.0 - 2.0 * w)
    return 0.0


@kernel
def is_pending(changes, p, s):
    """Return whether the ego, at a station of path p, has not changed lanes yet."""
    for j in range(changes.shape[0]):
        if changes[j, PATH] == p:
            return s < changes[j, BEGINS] + changes[j, LENGTH]
    return False


@kernel
def without_joining(passages, count, changes, beside):
    """Drop passages that join the ego's way where it changes lanes; return how many are left.

    They are those of the other lane, which is watched for a gap instead; so are those of who comes
    along it towards the ego.
    """
    kept = 0
    for i in range(count):
        enter, e = passages[i, ENTER], int(passages[i, ENTITY])
        joins = passages[i, HOW] != CROSSES
        joins = joins and changes[0, BEGINS] <= enter <= changes[0, BEGINS] + changes[0, LENGTH]
        comes = changes[0, AGAINST] > 0.0 and beside[e, NEAR] > 0.0 and beside[e, COSINE] > SAME_WAY
        if comes and changes[0, BEGINS] <= enter <= changes[0, RETURNS] + changes[0, BACK]:
            continue
        if not joins:
            for column in range(passages.shape[1]):
                passages[kept, column] = passages[i, column]
            kept += 1
    return kept


@kernel
def leaves_room(gap, ahead, behind, grip, headway):
    """Return whether a gap [m] does for the one behind, at their speeds [m/s]; see the module.

    A ``headway`` [s] of the slower one's speed is to remain.
    """
    closing = max(behind - ahead, 0.0)
    braking = closing * closing / (2.0 * min(FOLLOWER_BRAKES, grip))
    keeps = headway * min(ahead, behind)
    return gap >= max(STANDSTILL_GAP, closing * FOLLOWER_DELAY + braking + keeps)


@kernel
def look_aside(s, v, front, rear, half_width, grip, headway, decided, around):
    """Return (whether there is a gap on the other lane, what that lane asks for [m/s²]).

    It follows who is ahead there: in comfort, until it has ``decided`` to change.
    """
    free, asked = True, math.inf
    for e in range(1, around.shape[0]):
        if around[e, NEAR] == 0.0:
            continue
        beside = around[e, ASIDE]
        space = abs(beside) - around[e, HALF_WIDTH] - half_width
        nearing = -around[e, ACROSS] if beside > 0.0 else around[e, ACROSS]
        if space > SIDE_GAP and (nearing < DRIFT or space - nearing * COMING_IN > SIDE_GAP):
            continue
        w = pace_of(around, e)
        ahead = around[e, AT] - around[e, HALF_LENGTH] - s - front
        behind = s - rear - around[e, AT] - around[e, HALF_LENGTH]
        if behind > 0.0:
            free = free and leaves_room(behind, v, w, grip, headway)
            continue
        allowed = follow(ahead, v, w, around[e, GAINING]) if ahead > 0.0 else math.inf
        if decided:
            asked = min(asked, allowed)
            continue
        if ahead <= 0.0 or not leaves_room(ahead, w, v, grip, headway):
            free, allowed = False, min(allowed, (w - FALLS_BACK - v) / SPEED_TIME)
        asked = min(asked, max(allowed, -COMFORT_DECELERATION))
    return free, asked


@kernel
def is_free_of_oncoming(s, v, front, half_width, target, change, tracks, around, abreast):
    """Return whether the ego at station s may use the lane of oncoming traffic, see the module.

    ``change`` is its way, a row of ``changes``; ``abreast`` [m] its station on the other lane,
    along which ``around`` counts.
    """
    pace = min(
        target, PASSES_AT, change[BACK] * math.sqrt(LATERAL_COMFORT / (6.0 * abs(change[LEADS])))
    )
    left = change[RETURNS] + IS_BACK * change[BACK] - s
    needs = CLEARS + time_to(left, min(v, pace), pace)
    for e in range(1, around.shape[0]):
        if around[e, NEAR] == 0.0 or around[e, AT] - around[e, HALF_LENGTH] > abreast - front:
            continue
        beside = around[e, ASIDE]
        space = abs(beside) - around[e, HALF_WIDTH] - half_width
        nearing = -around[e, ACROSS] if beside > 0.0 else around[e, ACROSS]
        if space > SIDE_GAP and (nearing < DRIFT or space - nearing * COMING_IN > SIDE_GAP):
            continue
        gain = min(max(around[e, QUICKENING], 0.0), MOST_GAIN)
        comes = pace_of(around, e) + gain * GAINS_FOR
        if tracks[e, tracking.AGE] < SETTLED:
            comes = max(comes, target)  # its speed is not known yet
        comes *= needs
        if abreast - left - front - around[e, AT] - around[e, HALF_LENGTH] < comes:
            return False
    return True


@kernel
def has_decided(changes, p, s, v, front):
    """Return whether the ego, at station s of path p and ``v`` [m/s], stays with its change.

    To the lane of oncoming traffic, as long as it is not far aside and can stop, it goes back when
    somebody comes: one sees past what stands in one's lane only from its edge.
    """
    last = changes.shape[0] - 1
    if p == int(changes[last, PATH]) or changes[last, AGAINST] == 0.0:
        return p != int(changes[last, PATH]) or s >= changes[last, BEGINS]
    to_stop = max(changes[last, BEGINS] - s - front, 0.1)
    return abs(led_aside(changes, p, s)) > EDGE or v * v > 2.0 * GOES_ON * to_stop


@kernel
def await_gap(k, step, perceives, plan, roads, state, record):
    """Change to a way that changes lanes if there is a gap; return what that asks for [m/s²].

    +inf if nothing. To be called every ``step`` [s] from instant 0 on. A driver that does not
    perceive sees everybody. ``state`` is changed in place: the path that the ego is on, its
    indicators, and its ``mind``.
    """
    changes, mind = roads.changes, state.mind
    last = changes.shape[0] - 1
    if k == 0:
        state.on[0] = int(changes[last, PATH])
    p, s, v = state.on[0], state.station[0], record.v[0, k]
    front = plan.bodies[0, 2] + 0.5 * plan.bodies[0, 0]
    if not is_pending(changes, p, s):
        state.switched[0] &= ~(LEFT | RIGHT)
        return math.inf
    target = int(changes[last, TARGET])
    way, n, ds = roads.paths[target], roads.counts[target], roads.steps[target]
    x, y = record.x[0, k], record.y[0, k]
    guess = nearest_station(way, n, ds, x, y) if k == 0 else mind[ABREAST]
    mind[ABREAST], _ = project(way, n, ds, guess, x, y)
    if not perceives:
        for e in range(1, record.x.shape[0]):
            state.tracks[e, tracking.STATE] = 0.0
            if state.visible[e]:
                know_body(
                    e, k, plan.dt, record.x, record.y, record.h, record.v, plan.bodies, plan.kinds,
                    state.lamps, state.tracks,
                )  # fmt: skip
    surround(way, n, ds, mind[ABREAST], FAR_BEHIND, AHEAD, step, state.tracks, state.beside)
    if s < changes[0, BEGINS] - INDICATES * v - front:
        return math.inf
    state.switched[0] |= LEFT if changes[last, LEADS] > 0.0 else RIGHT
    mind[SIGNALS] += step
    to_stop = max(changes[last, BEGINS] - s - front, 0.1)
    stops = stop_for(to_stop, v)
    looks = LOOKS if changes[last, AGAINST] > 0.0 else 0.0
    # A change that has begun is completed, and so is one that it would have to brake hard to leave.
    decided = has_decided(changes, p, s, v, front)
    decided = decided or (mind[WAS_FREE] > looks and v * v > 2.0 * GOES_ON * to_stop)
    if changes[last, AGAINST] > 0.0:
        asked = math.inf
        free = is_free_of_oncoming(
            s, v, front, 0.5 * plan.bodies[0, 1], state.command[0], changes[last], state.tracks,
            state.beside, mind[ABREAST],
        )  # fmt: skip
    else:
        free, asked = look_aside(
            mind[ABREAST], v, front, plan.bodies[0, 0] - front, 0.5 * plan.bodies[0, 1],
            state.weather[FRICTION], FOLLOWER_HEADWAY if stops == math.inf else LAST_HEADWAY,
            decided, state.beside,
        )  # fmt: skip
    if decided:
        return asked
    free = free and mind[SIGNALS] > INDICATES
    mind[WAS_FREE] = mind[WAS_FREE] + step if free else 0.0
    if mind[WAS_FREE] <= looks:
        state.on[0] = int(changes[last, PATH])
        return min(asked, stops)
    for j in range(last):
        # It looks when the place is reached, not up to 20 m before.
        if 0.0 <= changes[j, BEGINS] - s <= 1.5 * v * step + 0.1:
            state.on[0] = int(changes[j, PATH])
    return asked


@kernel
def is_other_lanes(e, v, front, roads, state):
    """Return whether body e keeps to the other lane, or beyond: then the gap is all that matters.

    Once the ego, at ``v`` [m/s] and with its bumper ``front`` [m] ahead, has decided, that is so of
    those behind it alone, who can brake for it; of nobody who comes towards it.
    """
    changes, beside = roads.changes, state.beside
    last = changes.shape[0] - 1
    p, s = state.on[0], state.station[0]
    if beside[e, NEAR] == 0.0 or not is_pending(changes, p, s):
        return False
    side = 1.0 if changes[last, LEADS] > 0.0 else -1.0
    if changes[last, AGAINST] > 0.0:
        side = -side  # the other lane's left is the ego's
    if side * beside[e, ASIDE] < -KEEPS_TO or side * beside[e, ACROSS] < -DRIFT:
        return False
    decided = has_decided(changes, p, s, v, front)
    behind = changes[last, AGAINST] == 0.0 and beside[e, AT] < state.mind[ABREAST] + front
    return not decided or behind


@kernel
def nearest_station(way, n, ds, x, y):
    """Return the station of the sample of a way that is nearest to a point."""
    nearest, at = math.inf, 0
    for i in range(n):
        gap = (way[i, 0] - x) ** 2 + (way[i, 1] - y) ** 2
        if gap < nearest:
            nearest, at = gap, i
    return at * ds
