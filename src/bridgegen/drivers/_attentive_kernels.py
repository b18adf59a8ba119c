"""The attentive driver of other participants: it follows its script unless traffic is in its way.

The storyboard gives the path and the speed that the participant is to have. This driver never
exceeds that speed. It goes slower

- to keep its distance from those ahead of it (`_following_kernels`: the intelligent driver model);
- to give way where its path meets another one (`_yielding_kernels`), by the map's rules where these
  decide, else in order of arrival; always to pedestrians;
- to stop at a red light and at a stop sign (`_lights_kernels`);
- to let in who indicates a change to its lane, within a comfortable deceleration.

A deceleration up to `EMERGENCY_FROM` is anticipated, and applied at once. A stronger one is an
emergency: the driver reacts `CAREFUL_REACTION` after it begins, and then brakes as hard as the
careful driver of UN Regulation 157 until the danger is over.

Participants on foot, animals and bicycles react only to what is ahead of them; those who are
lawful also to the rest. Off the lanes they wait at the kerb: see `wait_at_kerb`.

A lane change is not begun into an occupied gap, see `gap_is_free`.

The driver sees all participants, and decides by the states at one instant. ``mind`` is a row of
`MIND` numbers per participant, zeros before the first instant, changed in place.

Sources: UN Regulation 157, 01 series of amendments, annex 3 (reaction, braking, jerk) and 5.2.5.2
(cut-in); those of the kernels named above.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.base.physics import CAREFUL_BRAKING, CAREFUL_JERK, CAREFUL_REACTION
from bridgegen.drivers._careful_kernels import EASY_TO_STOP
from bridgegen.drivers._control_kernels import EMERGENCY_FROM
from bridgegen.drivers._following_kernels import (
    COMFORT_ACCELERATION,
    COMFORT_DECELERATION,
    COMING_IN,
    DRIFT,
    HEAD_ON,
    HEADWAY,
    LET_IN,
    SAME_WAY,
    SIDE_GAP,
    SIDE_GAP_ON_FOOT,
    STANDS,
    STANDSTILL_GAP,
    STOP_MARGIN,
    follow,
    let_in,
    stop_for,
)
from bridgegen.drivers._lights_kernels import RED, stop_at_lights, stop_at_signs
from bridgegen.drivers._path_kernels import COS, SIN, H, X, Y, locate, project
from bridgegen.drivers._yielding_kernels import (
    COMMITTED,
    ENTER,
    HORIZON,
    LEAST_GAIN,
    LEAVE,
    MOST_GAIN,
    OTHER_ENTERS,
    OTHER_LEAVES,
    STANDING,
    coming,
    give_way,
)
from bridgegen.drivers.kinds import (
    HAZARD,
    IS_ON_FOOT,
    IS_PEDESTRIAN,
    NEEDS_ROOM,
    USES_LANES,
)

MIND = 8
RISK, GIVEN, BRAKES, STOPS_FOR, HALTED, ASKED, STRAIGHT_TO, STRAIGHT_ON = range(MIND)
"""The instant since when there is an emergency, counted from 1, 0: none; the acceleration that the
driver gave last [m/s²]; 1 while it brakes for an emergency; the light that it stops for, counted
from 1; the station of the stop sign at which it halted last [m]; what its last look asked for;
up to which station its path is straight [m], and which path that is, counted from 1."""

SEEN = 9
CX, CY, C, S, W, GAIN, LENGTH, WIDTH, LAMPS = range(SEEN)
"""Rows of ``seen``, the bodies as all drivers see them: the centre [m], cosine and sine of the
heading, the speed [m/s], its rate of change [m/s²], length and width [m], and the indicators that
it shows, see `bridgegen.drivers.kinds`."""

# A look at every instant would cost four times as much.
LOOK = 0.2  # s, between two looks around; the acceleration of one holds until the next
CONCERNS = 0.75 * COMFORT_ACCELERATION  # m/s²; a leader that allows more (its gap is twice the
# desired one) is no concern
STRAIGHT = 0.002  # rad; a path that turns by less is as good as straight: 0.1 m in 50 m
STRAIGHT_STEP, STRAIGHT_REACH = 5.0, 400.0  # m, step and length of that test
ON_FOOT_GAP = 0.5  # m, that a pedestrian keeps to what stands ahead
START_UP = 3.0  # s, besides the time to cross, in the gap that one waits for; source: Highway
# Capacity Manual 2010, eq. 19-69: critical headway = length / walking speed + start-up and end
# clearance time, 3 s
LEAST_WALK = 0.5  # m/s; who crosses is expected to be as fast at least
LEAST_REACH = 3.0  # m besides bodies and gaps, for what comes in from the side
CALM = 2.0 * math.sqrt(COMFORT_ACCELERATION * COMFORT_DECELERATION)  # m/s²

# The most that the vehicle behind may need to avoid the one that changes lane; UN R157, 5.2.5.2.
# The German AFGBV, annex 1, has the same form, and scales it where the road allows less
# deceleration.
# The larger gap of UN R79's lane-change systems (3 m/s² after 0.4 s, then 1 s of headway) needs 26
# m at 25 m/s: no cut-in that tests an ego would begin.
CUT_IN_DECELERATION = 6.0  # m/s²
CUT_IN_DELAY = 0.35  # s
FARTHEST = 300.0  # m; vehicles farther along the other lane are ignored: at a closing speed of
# 40 m/s over a change of 4 s, 226 m suffice
LEAST_LANE_GAP = STANDSTILL_GAP  # m, to those ahead and behind on the other lane


@kernel
def see(k, dt, x, y, h, speed, bodies, lamps, seen):
    """Fill ``seen`` ``(SEEN, E)`` with all bodies at instant k."""
    for o in range(len(speed)):
        cosine, sine = elementary.cos(h[o, k]), elementary.sin(h[o, k])
        seen[CX, o], seen[CY, o] = x[o, k] + bodies[o, 2] * cosine, y[o, k] + bodies[o, 2] * sine
        seen[C, o], seen[S, o], seen[W, o] = cosine, sine, speed[o, k]
        seen[GAIN, o] = (speed[o, k] - speed[o, k - 1]) / dt if k > 0 else 0.0
        seen[LENGTH, o], seen[WIDTH, o] = bodies[o, 0], bodies[o, 1]
        seen[LAMPS, o] = lamps[o] & HAZARD


@kernel
def straight_to(path, n, ds, s):
    """Return up to which station [m] a path is straight from station s on."""
    i, _ = locate(n, ds, s)
    stride = max(int(STRAIGHT_STEP / ds), 1)
    last = min(n - 1, i + int(STRAIGHT_REACH / ds))
    j = i + stride
    while j <= last and abs(path[j, H] - path[i, H]) < STRAIGHT:
        j += stride
    # On the way there it may have turned and turned back by less than can matter.
    return math.inf if j > last and last == n - 1 else (j - stride) * ds


@kernel
def keep_to_leaders(e, path, n, ds, p, s, v, right, left, present, seen, far, bodies, kinds, mind):
    """Return the acceleration [m/s²] that traffic ahead on its strip requires; +inf if none does.

    The strip is from ``right`` to ``left`` of the path [m], widened by half of its body.
    """
    if mind[STRAIGHT_ON] != p + 1.0 or s > mind[STRAIGHT_TO]:
        mind[STRAIGHT_ON], mind[STRAIGHT_TO] = p + 1.0, straight_to(path, n, ds, s)
    i, f = locate(n, ds, s)
    c, t = path[i, COS], path[i, SIN]
    px = path[i, X] + f * (path[i + 1, X] - path[i, X])
    py = path[i, Y] + f * (path[i + 1, Y] - path[i, Y])
    half = 0.5 * bodies[e, 1]
    front = bodies[e, 2] + 0.5 * bodies[e, 0]
    cx, cy, cosines, sines = seen[CX], seen[CY], seen[C], seen[S]
    speeds, lengths, widths, lamps = seen[W], seen[LENGTH], seen[WIDTH], seen[LAMPS]
    straight = mind[STRAIGHT_TO] - s
    for o in range(len(far)):  # without a branch, so that it is done for several at a time
        # Ignored are participants farther away than `CONCERNS` allows, those behind, and, where the
        # path is straight, those that stay beside the strip.
        dx, dy = cx[o] - px, cy[o] - py
        along, aside = dx * c + dy * t, dy * c - dx * t
        turned = abs(sines[o] * c - cosines[o] * t)
        closing = v - speeds[o] * (cosines[o] * c + sines[o] * t)
        wants = STANDSTILL_GAP + v * max(HEADWAY + closing * (1.0 / CALM), 0.0)
        reach = front + 0.5 * lengths[o] + LEAST_REACH + 2.0 * wants
        wide = half + 0.5 * (widths[o] + lengths[o] * turned) + COMING_IN * speeds[o] * turned
        wide += LET_IN * min(lamps[o], 1.0)
        beside = max(aside - left, right - aside) - wide - SIDE_GAP_ON_FOOT
        away = beside if along < straight else -1.0
        far[o] = max(max(dx * dx + dy * dy - reach * reach, front - lengths[o] - along), away)
    walks = IS_ON_FOOT[kinds[e]]
    asked = math.inf
    for o in range(len(far)):
        if far[o] > 0.0 or o == e or not present[o]:
            continue
        dx, dy = seen[CX, o] - px, seen[CY, o] - py
        q, d, w = s + dx * c + dy * t, dy * c - dx * t, seen[W, o]
        parallel = seen[C, o] * c + seen[S, o] * t
        across = seen[S, o] * c - seen[C, o] * t
        if q > mind[STRAIGHT_TO]:
            q, d = project(path, n, ds, min(q, (n - 1) * ds), seen[CX, o], seen[CY, o])
            j, _ = locate(n, ds, q)
            parallel = seen[C, o] * path[j, COS] + seen[S, o] * path[j, SIN]
            across = seen[S, o] * path[j, COS] - seen[C, o] * path[j, SIN]
        moves = w > STANDS
        if moves and HEAD_ON < parallel < SAME_WAY:
            continue  # it crosses: that is a matter of giving way
        least = SIDE_GAP_ON_FOOT if NEEDS_ROOM[kinds[o]] else SIDE_GAP
        half_width = 0.5 * (bodies[o, 0] * abs(across) + bodies[o, 1] * abs(parallel))
        beside = d - left if d > left else min(d - right, 0.0)
        space = abs(beside) - half_width - half
        nearing = -w * across if beside > 0.0 else w * across
        half_length = 0.5 * (bodies[o, 0] * abs(parallel) + bodies[o, 1] * abs(across))
        gap = q - half_length - s - front
        if space > least and (nearing < DRIFT or space - nearing * COMING_IN > least):
            if lamps[o] > 0.0 and parallel >= SAME_WAY and not walks:
                allowed = let_in(lamps[o], beside, space, gap, v, w * parallel, seen[GAIN, o])
                if allowed < CONCERNS:
                    asked = min(asked, allowed)
            continue
        if gap < -half_length:
            continue  # beside: braking would not separate them
        if not walks:
            gain = seen[GAIN, o] if moves and parallel > 0.0 else 0.0
            item = follow(gap, v, w * parallel if moves else 0.0, gain)
            if item < CONCERNS:
                asked = min(asked, item)
        elif not moves:
            asked = min(asked, stop_for(gap + STOP_MARGIN - ON_FOOT_GAP, v))
    return asked


@kernel
def wait_at_kerb(
    e, s, pace, front, rear, station, on, present, seen, bodies, kinds, zones, kerbs, lines, lights
):
    """Return the station [m] of the kerb at which e, off the lanes at s, must wait; +inf: nowhere.

    It waits while a light of ``lines`` lets the traffic go that it would cross; and at the kerbs
    from which it has no priority, until each vehicle takes longer to its path than it takes itself
    to be across that one's, at ``pace`` [m/s], and `START_UP`. For the rest see `look`.
    """
    stop = math.inf
    for i in range(len(lines)):
        if lights[i] > RED and s + front <= lines[i]:
            stop = min(stop, lines[i])
    here = beyond = math.inf  # the next two kerbs
    for i in range(len(kerbs)):
        if s + front <= kerbs[i]:
            beyond = min(beyond, max(here, kerbs[i]))
            here = min(here, kerbs[i])
    if here >= stop:
        return stop
    for o in range(len(zones)):
        zone, w = zones[o], seen[W, o]
        if not here < zone[LEAVE] or not zone[ENTER] < beyond or not present[o] or on[o] != o:
            continue
        other_front = bodies[o, 2] + 0.5 * bodies[o, 0]
        is_past = station[o] - (bodies[o, 0] - other_front) > zone[OTHER_LEAVES]
        if not USES_LANES[kinds[o]] or w < STANDING or is_past:
            continue
        gain = min(seen[GAIN, o], MOST_GAIN) if seen[GAIN, o] > LEAST_GAIN else 0.0
        needed = (zone[LEAVE] + rear - s) / max(pace, LEAST_WALK) + START_UP
        if coming(zone[OTHER_ENTERS] - other_front - station[o], w, gain) < needed:
            return here
    return stop


@kernel
def look(
    e, pace, stop, grip, rules, paths, path_n, path_ds, station, on, aside, target, present, seen,
    far, bodies, kinds, meets, zones, claims, stops, halts, lights, mind,
):  # fmt: skip
    """Return the acceleration [m/s²] that participant e's surroundings require; +inf: none.

    It would go at ``pace`` [m/s] and must stop before station ``stop`` of its path anyway (+inf:
    nowhere). ``rules``: 0 it is no vehicle and heeds none; 1 those of traffic on lanes; 2 those of
    one off the lanes. Of all participants: the path that each is ``on`` (a row of ``paths``,
    ``path_n`` and ``path_ds``), its ``station`` there, how far it is ``aside`` of it, and will
    be (``target``) [m]; whether it is ``present``;
    what is ``seen`` of it; ``bodies`` ``(E, ·)`` and ``kinds``.
    ``far`` ``(E,)`` is scratch space. ``zones`` ``(E, ZONE)`` is where its first path meets the
    others' first ones, if it ``meets`` any, ``claims`` ``(E,)`` > 0 where the other waits, < 0
    where it does (``right_of_way.claim``); ``stops`` and ``halts`` are the stations of lights and
    of stop signs on its first path.
    """
    p, s, v = on[e], station[e], seen[W, e]
    path, n, ds = paths[p], path_n[p], path_ds[p]
    front = bodies[e, 2] + 0.5 * bodies[e, 0]
    asked = keep_to_leaders(
        e, path, n, ds, p, s, v, min(aside[e], target), max(aside[e], target), present, seen, far,
        bodies, kinds, mind,
    )  # fmt: skip
    if rules == 0:
        return asked
    rear = bodies[e, 0] - front
    if rules == 2:
        if p == e:
            stop = wait_at_kerb(
                e, s, pace, front, rear, station, on, present, seen, bodies, kinds, zones, halts,
                stops, lights,
            )  # fmt: skip
            if stop < math.inf:
                asked = min(asked, stop_for(stop - front - s + STOP_MARGIN - ON_FOOT_GAP, v))
        return asked
    if p == e:
        for o in range(len(zones) if meets else 0):
            zone = zones[o]
            if zone[0] == math.inf or not present[o] or on[o] != o:
                continue
            if s - rear > zone[1] or zone[0] - front - s > max(v, pace) * HORIZON:
                continue
            # Pedestrians always go first, whatever the map says of vehicles.
            rank = -1 if IS_PEDESTRIAN[kinds[o]] else min(max(claims[o], -1), 1)
            other_front = bodies[o, 2] + 0.5 * bodies[o, 0]
            follows, stops_at = give_way(
                s,
                v,
                pace,
                front,
                rear,
                zone,
                station[o],
                seen[W, o],
                seen[GAIN, o],
                rank,
                other_front,
                bodies[o, 0] - other_front,
            )
            if follows < CONCERNS:
                asked = min(asked, follows)
            # Who would need nearly all of the grip to stop goes on, for it would stop in the
            # other's way.
            if v * v <= 2.0 * COMMITTED * grip * (stops_at - front - s):
                stop = min(stop, stops_at)
        item, light = stop_at_lights(stops, lights, s, front, v, math.inf, int(mind[STOPS_FOR]) - 1)
        mind[STOPS_FOR] = light + 1.0
        asked = min(asked, item)
        item, mind[HALTED] = stop_at_signs(halts, s, front, v, mind[HALTED])
        asked = min(asked, item)
    if stop < math.inf:
        asked = min(asked, stop_for(stop - front - s, v))
    return asked


@kernel
def react(k, dt, asked, mind):
    """Return the driver's acceleration [m/s²] at instant k; +inf: the script's.

    ``asked`` is what its surroundings require. See the module for when it reacts.
    """
    if mind[BRAKES] > 0.0 and asked > -EASY_TO_STOP:
        mind[BRAKES] = mind[RISK] = 0.0
    given = asked
    # Braking for a yellow light takes 4 m/s² at most, which stays below an emergency: with the
    # reaction time of one the car would pass the line.
    if mind[BRAKES] > 0.0 or asked < -EMERGENCY_FROM:
        if mind[RISK] == 0.0:
            mind[RISK] = k + 1.0
        given = min(mind[GIVEN], 0.0)  # until it reacts, it does what it did, without gas
        if (k + 1.0 - mind[RISK]) * dt + 1e-9 >= CAREFUL_REACTION:
            mind[BRAKES] = 1.0
            given = max(given - CAREFUL_JERK * dt, -CAREFUL_BRAKING)
    else:
        mind[RISK] = 0.0
    mind[GIVEN] = given if given < math.inf else 0.0
    return given


@kernel
def is_safe(gap, closing, lasts, grip):
    """Return whether a gap [m] on the other lane suffices when a change of lane begins.

    When the line is crossed, after half of the time that the change ``lasts`` [s], the vehicle that
    closes in at ``closing`` [m/s] must still be able to brake (see `CUT_IN_DECELERATION`), on a
    road that allows ``grip`` [m/s²].
    """
    if gap < LEAST_LANE_GAP:
        return False
    if closing <= 0.0:
        return True
    needed = closing * (closing / (2.0 * min(CUT_IN_DECELERATION, grip)) + CUT_IN_DELAY)
    return gap - 0.5 * lasts * closing >= needed


@kernel
def gap_is_free(e, k, path, n, ds, s, target, lasts, grip, present, x, y, h, speed, bodies):
    """Return whether participant e may begin to change lane at instant k.

    It is abreast of station ``s`` of the other lane's path and will be ``target`` [m] left of that
    after ``lasts`` [s]. Participants on that lane must be far enough ahead or behind, see
    `is_safe`. The tyres give ``grip`` [m/s²].

    Source: UN Regulation 157, 01 series, 5.2.5.2: the cut-in that an automated vehicle must not
    collide with; a driver who leaves that much forces no other to brake harder.
    """
    v = speed[e, k]
    front = bodies[e, 2] + 0.5 * bodies[e, 0]
    rear = bodies[e, 0] - front
    for o in range(len(speed)):
        if o == e or not present[o]:
            continue
        cosine, sine = elementary.cos(h[o, k]), elementary.sin(h[o, k])
        cx, cy = x[o, k] + bodies[o, 2] * cosine, y[o, k] + bodies[o, 2] * sine
        i, _ = locate(n, ds, s)
        guess = s + (cx - path[i, X]) * path[i, COS] + (cy - path[i, Y]) * path[i, SIN]
        if abs(guess - s) > FARTHEST:
            continue
        q, d = project(path, n, ds, min(max(guess, 0.0), (n - 1) * ds), cx, cy)
        i, _ = locate(n, ds, q)
        parallel = cosine * path[i, COS] + sine * path[i, SIN]
        across = abs(sine * path[i, COS] - cosine * path[i, SIN])
        half_width = 0.5 * (bodies[o, 0] * across + bodies[o, 1] * abs(parallel))
        if abs(d - target) > half_width + 0.5 * bodies[e, 1] + SIDE_GAP:
            continue
        half_length = 0.5 * (bodies[o, 0] * abs(parallel) + bodies[o, 1] * across)
        along = speed[o, k] * parallel
        if q >= s + bodies[e, 2]:
            if not is_safe(q - half_length - s - front, v - along, lasts, grip):
                return False
        elif not is_safe(s - rear - q - half_length, along - v, lasts, grip):
            return False
    return True
