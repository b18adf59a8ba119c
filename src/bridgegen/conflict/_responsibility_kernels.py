"""Compiled rules of responsibility; ``types.RULES`` has their words and sources.

One question recurs: could a careful driver, from some instant on, have avoided the other by braking
on its own path? It is the driver of UN Regulation 157, Annex 3, whatever the road. Where the
question is whether somebody was forced to brake, comfortable braking takes its place, after the
same reaction time. Of a near miss the careful driver must avoid the near miss, not the contact.
"""

import math

from bridgegen.compiled import kernel
from bridgegen.conflict._codes import (
    ASSUMED_RIGHT_BEFORE_LEFT,
    BRAKED_HARD_AHEAD,
    BRAKED_WITHOUT_REASON,
    COULD_HAVE_STOPPED,
    CROSSWALK,
    CUT_IN,
    CUT_IN_PREVENTABLE,
    DECIDED,
    EGO,
    EGO_STANDING,
    HEAD_ON,
    INTO_THE_SIDE,
    JUNCTION_OCCUPIED,
    LEFT_ITS_LANE,
    LEFT_TO_ACT,
    MAP_PRIORITY,
    NOBODY,
    OBJECT,
    OTHER,
    PREVENTABLE,
    REAR_DISTANCE,
    REAR_END_STRIKING,
    REAR_END_STRUCK,
    RED_LIGHT,
    RESPONSIBLE,
    REVEALED_LATE,
    RULE,
    SHARED,
    SIDE_SWIPE,
    STANDING_AHEAD,
    STEPPED_OUT,
    STOOD_EGO,
    STOOD_OTHER,
    STRUCK_STANDING,
    TTC,
    TURNING_GIVES_WAY,
    UNSAFE_START,
    VRU_BY_FRONT,
    VRU_INTO_SIDE,
)
from bridgegen.conflict._geometry_kernels import entered, pose_on, turned, visible_from
from bridgegen.conflict._limits import (
    AHEAD,
    AHEAD_BY,
    AHEAD_TIME,
    ALIKE,
    ASIDE,
    BRAKES_FOR,
    BRAKING,
    COMFORT,
    CROSSWALK_MARGIN,
    HARD,
    HEADWAY,
    HEADWAY_RISE,
    HORIZON,
    JERK,
    JUNCTION,
    JUST_NOW,
    KERB,
    LATELY,
    LINE_REACH,
    LOOKED_BACK,
    MARGIN,
    MARGIN_ON_FOOT,
    MOST_HEADWAY,
    MOVES,
    OPENING,
    OPENS_TO,
    REACTION,
    SAME_WAY,
    SERIOUS_DECELERATION,
    SERIOUS_TTC,
    SIGHT,
    STANDS,
    STOOD,
    TURN_TIME,
)
from bridgegen.conflict._type_kernels import is_vulnerable, strikes_with_front, turns
from bridgegen.ego.kinds import ANIMAL, BICYCLE, PEDESTRIAN
from bridgegen.metrics._pet_kernels import separation
from bridgegen.metrics._ttc_kernels import STANDSTILL, time_to_contact

RED, RED_AND_YELLOW = 1, 2
"""States of a light, as ``Rollout.lights`` has them."""

CLEAR, COMES_NEAR, COLLIDES = range(3)
"""What becomes of a body that brakes."""


@kernel
def gains(speed, other, ca, sa, cb, sb):
    """Return by how much a body is faster than another, along its own heading [m/s].

    It must lose so much not to meet the other. One that comes across or towards it counts as if it
    stood: braking ends at standstill.
    """
    return max(speed - max(other * (cb * ca + sb * sa), 0.0), 0.0)


@kernel
def gives(scene, a, i, speed):
    """Return how hard body a can brake at instant i of its track at a speed [m/s²].

    What the tyres need to hold it in the bend is not left to brake (the friction circle).
    """
    gone = scene.gone[a]
    length = gone[i + 1] - gone[i] if i + 1 < scene.n else 0.0
    if length <= 0.0 or scene.friction == math.inf:
        return scene.friction
    c, s = scene.c[a], scene.s[a]
    bend = (c[i] * s[i + 1] - s[i] * c[i + 1]) / length
    across = speed * speed * bend
    return math.sqrt(max(scene.friction * scene.friction - across * across, 0.0))


@kernel
def follows(gap, speed, its):
    """Return by how much a driver slows down who opens the gap to somebody ahead [m/s²].

    It does so while the gap is shorter than UN R157 asks for, and it is not much slower already.
    """
    headway = min(HEADWAY + speed * HEADWAY_RISE, MOST_HEADWAY)
    return OPENING if gap < headway * speed and speed > OPENS_TO * its else 0.0


@kernel
def braked(scene, a, b, k, start, braking):
    """Return what becomes of body a on its own track if it brakes from instant ``start`` on.

    From instant k to ``start`` it opens its gap to b as drivers do, see `follows`.

    It keeps its speed for ``REACTION``; then its deceleration rises by ``JERK`` up to ``braking``
    [m/s²], or as far as the tyres allow. b moves as recorded up to ``scene.until``, then keeps its
    speed on its track. A body that stands when b runs into it has done all that braking can do: it
    counts as clear. One that crosses b's way and is ahead of its recorded place when they meet does
    not: it has escaped by not braking.
    """
    half, x, y, c, s, v, gone = (
        scene.half, scene.x, scene.y, scene.c, scene.s, scene.v, scene.gone
    )  # fmt: skip
    dt, n, until = scene.dt, scene.n, scene.until
    la, wa, lb, wb = half[a, 0], half[a, 1], half[b, 0], half[b, 1]
    worst = CLEAR
    k_meet = scene.at
    crosses = c[a, k_meet] * c[b, k_meet] + s[a, k_meet] * s[b, k_meet] < SAME_WAY
    at, speed, slowed, i, j = gone[a, k], v[a, k], 0.0, k, min(k, until)
    apart = math.inf
    for m in range(k, start + int(BRAKES_FOR / dt)):
        if m > k:
            harder = slowed
            if m <= start:
                harder = follows(apart, speed, v[b, min(m - 1, until)])
            elif (m - start) * dt > REACTION + 1e-9:
                harder = min(slowed + JERK * dt, braking, gives(scene, a, i, speed))
            after = max(speed - 0.5 * (slowed + harder) * dt, 0.0)
            slowed = harder
            at += 0.5 * (speed + after) * dt
            speed = after
        i, xa, ya = pose_on(x[a], y[a], c[a], s[a], gone[a], n, i, at)
        way = gone[b, m] if m <= until else gone[b, until] + v[b, until] * (m - until) * dt
        j, xb, yb = pose_on(x[b], y[b], c[b], s[b], gone[b], n, j, way)
        if m <= until:  # a body that moves without a way of its own: sideways, or on the spot
            j, xb, yb = m, x[b, m], y[b, m]
        dx, dy = xb - xa, yb - ya
        apart = separation(dx, dy, c[a, i], s[a, i], c[b, j], s[b, j], la, wa, lb, wb)
        its = v[b, min(m, until)]
        if apart <= 0.0:
            return worst if speed <= 0.0 and its > 0.0 else COLLIDES
        meets = crosses and (speed <= 0.0 or m == k_meet)
        if meets and at > gone[a, k_meet] + AHEAD_BY:
            return COLLIDES
        if speed <= 0.0:
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
                worst = COMES_NEAR
    return worst


@kernel
def passes_line(scene, e, j, since, last):
    """Return at which instants body e passes stop line j: the last at red, and the last; -1: none.

    ``since`` and ``last`` limit the instants.
    """
    lines, x, y, c, s = scene.stop_lines, scene.x, scene.y, scene.c, scene.s
    lc, ls = math.cos(lines[j, 2]), math.sin(lines[j, 2])
    reach, before, at_red, at_all = scene.half[e, 0], math.inf, -1, -1
    for i in range(since, last + 1):
        px = x[e, i] + reach * c[e, i] - lines[j, 0]
        py = y[e, i] + reach * s[e, i] - lines[j, 1]
        past = px * lc + py * ls
        if before <= 0.0 < past and abs(py * lc - px * ls) <= LINE_REACH:
            at_all = i
            state = scene.lights[scene.stop_lights[j], i - 1]
            if state in (RED, RED_AND_YELLOW):
                at_red = i
        before = past
    return at_red, at_all


@kernel
def ran_red(scene, e, k, last):
    """Return the instant up to ``last`` at which body e passed a red light just before k; or -1."""
    found = -1
    since = max(k - int(LOOKED_BACK / scene.dt), scene.first if e > 0 else 0)
    for j in range(len(scene.stop_entities)):
        if scene.stop_entities[j] != e or not math.isfinite(scene.stop_lines[j, 0]):
            continue
        at_red, _ = passes_line(scene, e, j, since, last)
        if at_red >= 0 and scene.gone[e, k] - scene.gone[e, at_red] <= JUNCTION:
            found = max(found, at_red)
    return found


@kernel
def ahead_until(scene, k, time):
    """Return the instant up to which motion after a near miss at k belongs to it."""
    return min(k + int((time + REACTION) / scene.dt) + 1, scene.n - 1)


@kernel
def stops_at_red(scene, e, k, time):
    """Say whether body e heads for a red light at instant k and does not pass it afterwards."""
    for j in range(len(scene.stop_entities)):
        if scene.stop_entities[j] != e or not math.isfinite(scene.stop_lines[j, 0]):
            continue
        line = scene.stop_lines[j]
        lc, ls = math.cos(line[2]), math.sin(line[2])
        px = scene.x[e, k] + scene.half[e, 0] * scene.c[e, k] - line[0]
        py = scene.y[e, k] + scene.half[e, 0] * scene.s[e, k] - line[1]
        state = scene.lights[scene.stop_lights[j], k]
        before = -SIGHT <= px * lc + py * ls <= 0.0 and abs(py * lc - px * ls) <= LINE_REACH
        if before and (state in (RED, RED_AND_YELLOW)):
            _, passes = passes_line(scene, e, j, k, ahead_until(scene, k, time))
            if passes < 0:
                return True
    return False


@kernel
def on_crosswalk(scene, e, k):
    """Say whether the centre of body e is on a crosswalk of the ego's route at instant k."""
    walks = scene.crosswalks
    for j in range(len(walks)):
        if not math.isfinite(walks[j, 0]):
            continue
        c, s = math.cos(walks[j, 2]), math.sin(walks[j, 2])
        dx, dy = scene.x[e, k] - walks[j, 0], scene.y[e, k] - walks[j, 1]
        along, across = abs(dx * c + dy * s), abs(dy * c - dx * s)
        if along <= walks[j, 3] + CROSSWALK_MARGIN and across <= walks[j, 4] + KERB:
            return True
    return False


@kernel
def on_crosswalk_since(scene, e, k):
    """Return since which instant body e has been on a crosswalk; k + 1 if it is not at k."""
    while k >= scene.first and on_crosswalk(scene, e, k):
        k -= 1
    return k + 1


@kernel
def slowing_since(v, first, k, dt):
    """Return when a body began to slow down, the last time before instant k.

    -1 if it has not slowed down within ``JUST_NOW`` before.
    """
    j = k
    while j > first and (k - j) * dt < JUST_NOW and v[j - 1] <= v[j] + 1e-9:
        j -= 1
    if j <= first or v[j - 1] <= v[j] + 1e-9:
        return -1
    while j > first and v[j - 1] > v[j] + 1e-9:
        j -= 1
    return j


@kernel
def still_since(v, first, k):
    """Return since which instant a body has been standing up to instant k; k + 1 if it moves."""
    while k >= first and v[k] <= STANDS:
        k -= 1
    return k + 1


@kernel
def ego_moved(scene, k, way):
    """Say whether the ego has moved across its route just before instant k.

    Only to the left for ``way`` 1, to the right for -1, to either side for 0. An ego that turns off
    meanwhile has not: its offset may be that from the road that it leaves.
    """
    offset, c, s = scene.offset, scene.c, scene.s
    begin = max(k - int(JUST_NOW / scene.dt), 0)
    if c[0, k] * c[0, begin] + s[0, k] * s[0, begin] < SAME_WAY:
        return False
    for i in range(begin, k):
        moved = offset[0, k] - offset[0, i]
        if (abs(moved) if way == 0 else way * moved) > ASIDE:
            return True
    return False


@kernel
def ego_came_over(scene, e, k, way):
    """Say whether it is the ego that has changed its course when it and body e meet at instant k.

    It has moved, see `ego_moved`; and body e has not steered more ``LATELY``: who has arrived on a
    lane has the right to go straight on there.
    """
    if not ego_moved(scene, k, way):
        return False
    mine, its = steering(scene, e, k, LATELY)
    return mine >= its


@kernel
def steering(scene, e, k, within):
    """Return how much the ego and body e have steered besides what they have in common [m].

    Both are looked at over the same length of way before instant k, that of the slower one within
    so many seconds. A constant bend over a length L that turns a body by phi moves it aside by
    L phi / 2. The lesser bend, if both go the same way, is taken for that of the road.
    """
    x, y, c, s, gone = scene.x, scene.y, scene.c, scene.s, scene.gone
    begin = max(k - int(within / scene.dt), scene.first)
    length = min(gone[0, k] - gone[0, begin], gone[e, k] - gone[e, begin])
    aside_ego, bend_ego, aside_other, bend_other = 0.0, 0.0, 0.0, 0.0
    for b in (0, e):
        j = k
        while j > begin and gone[b, k] - gone[b, j] < length - 1e-9:
            j -= 1
        dx, dy = x[b, k] - x[b, j], y[b, k] - y[b, j]
        aside = dy * c[b, j] - dx * s[b, j]
        bend = 0.5 * length * turned(c[b], s[b], j, k, k - j)
        if b == 0:
            aside_ego, bend_ego = aside, bend
        else:
            aside_other, bend_other = aside, bend
    if c[0, k] * c[e, k] + s[0, k] * s[e, k] < 0.0:  # they drive through the bend the other way
        aside_other, bend_other = -aside_other, -bend_other
    road = 0.0
    if bend_ego * bend_other > 0.0:
        road = bend_ego if abs(bend_ego) < abs(bend_other) else bend_other
    mine = abs(aside_ego - road) + abs(bend_ego - road)
    return mine, abs(aside_other - road) + abs(bend_other - road)


@kernel
def judge(scene, e, k, at, kind, own, own_part, appears, whole, real):
    """Decide who is responsible for the conflict of the ego and body e, which meet after k.

    ``at`` is the instant of the contact, or k itself; ``own`` the ego's zone, ``own_part`` [m/s]
    its share of the closing speed; ``appears``: one of the two is put into the other.
    """
    on_foot = is_vulnerable(scene.kinds[e])
    entry, side = entered(scene, 0, e, k, MARGIN_ON_FOOT if on_foot else MARGIN)
    risk = visible_from(scene, e, entry, k)
    since = risk
    if real[STOOD_OTHER] < STOOD:  # who moves is a risk only once the two are near in time
        since = max(risk, k - int(HORIZON / scene.dt))
    level = braked(scene, 0, e, since, since, BRAKING)
    avoidable = real[STOOD_EGO] <= 0.0 and level == CLEAR and not appears
    if kind == HEAD_ON and not scene.near and avoidable:  # to stand when the other comes is no help
        avoidable = scene.v[e, k] <= STANDS
    whole[DECIDED], whole[PREVENTABLE] = since, avoidable
    if appears:
        whole[RESPONSIBLE], whole[RULE] = NOBODY, UNSAFE_START
    else:
        whole[RESPONSIBLE], whole[RULE] = decide(
            scene, e, k, kind, own, own_part, risk, since, side, risk > entry, avoidable, whole,
            real,
        )
    real[LEFT_TO_ACT] = max(at - whole[DECIDED], 0) * scene.dt + real[TTC]


@kernel
def decide(
    scene, e, k, kind, own, own_part, risk, since, side, late, avoidable, whole, real
):  # fmt: skip
    """Return who is responsible, and by which rule."""
    if kind == EGO_STANDING:
        return OTHER, STRUCK_STANDING
    if kind != REAR_END_STRIKING and kind != REAR_END_STRUCK:
        last = ahead_until(scene, k, real[TTC]) if scene.near else k
        mine, its = ran_red(scene, 0, k, last), ran_red(scene, e, k, last)
        if mine >= 0 or its >= 0:
            whole[DECIDED] = min(max(mine, its), k)
            if mine >= 0 and its >= 0:
                return SHARED, RED_LIGHT
            return (EGO if mine >= 0 else OTHER), RED_LIGHT
    if kind in (VRU_BY_FRONT, VRU_INTO_SIDE):
        return of_vulnerable(scene, e, k, kind, avoidable, whole)
    if kind == REAR_END_STRUCK:
        return of_struck(scene, e, k, whole)
    if kind == OBJECT and scene.v[e, k] > STANDS and not strikes_with_front(own, own_part):
        return OTHER, LEFT_ITS_LANE
    if kind in (REAR_END_STRIKING, OBJECT):
        return of_striking(scene, e, k, risk, side, late, avoidable, whole)
    if real[STOOD_OTHER] >= STOOD and avoidable:
        return EGO, STANDING_AHEAD
    if kind in (SIDE_SWIPE, HEAD_ON):
        return of_leaving(scene, e, k, kind, own, own_part, avoidable)
    return of_crossing(scene, e, k, since, whole)


@kernel
def rule_of(claim):
    """Return the rule of a claim that is not 0."""
    return MAP_PRIORITY + abs(claim) - 1


@kernel
def of_vulnerable(scene, e, k, kind, avoidable, whole):
    """Decide where the ego and a pedestrian, a cyclist or an animal meet."""
    what = scene.kinds[e]
    if what == PEDESTRIAN:
        since = on_crosswalk_since(scene, e, k)
        if since <= k:
            since = visible_from(scene, e, since, k)
            could = braked(scene, 0, e, since, since, BRAKING) == CLEAR
            whole[DECIDED], whole[PREVENTABLE] = since, could
            return (EGO, CROSSWALK) if could else (NOBODY, STEPPED_OUT)
    if what == BICYCLE:
        claim = scene.claims[e]
        if claim < 0:
            return EGO, rule_of(claim)
        mine, its = turns(scene.c, scene.s, e, scene.first, scene.n, k, scene.dt)
        if mine and not its and claim == 0 and same_road(scene, e, k):
            return EGO, TURNING_GIVES_WAY
        one, other = steering(scene, e, k, JUST_NOW)
        if kind == VRU_INTO_SIDE and claim == 0 and one > ASIDE and one > other:
            return EGO, LEFT_ITS_LANE
        if claim > 0 and not avoidable:
            return OTHER, rule_of(claim)
    if what == PEDESTRIAN and avoidable:
        mine, _ = turns(scene.c, scene.s, e, scene.first, scene.n, k, scene.dt)
        if mine:
            return EGO, TURNING_GIVES_WAY
    if kind == VRU_INTO_SIDE:
        if what != ANIMAL and ego_moved(scene, k, side_of(scene, e, k)):
            return EGO, LEFT_ITS_LANE
        return (NOBODY if what == ANIMAL else OTHER), INTO_THE_SIDE
    if avoidable:
        return EGO, COULD_HAVE_STOPPED
    return (NOBODY if what == ANIMAL else OTHER), STEPPED_OUT


@kernel
def side_of(scene, e, k):
    """Return on which side of the ego body e is: 1 left, -1 right."""
    dx, dy = scene.x[e, k] - scene.x[0, k], scene.y[e, k] - scene.y[0, k]
    return 1 if dy * scene.c[0, k] - dx * scene.s[0, k] > 0.0 else -1


@kernel
def same_road(scene, e, k):
    """Say whether both came along one road, in the same or in opposite directions."""
    j = max(k - int(TURN_TIME / scene.dt), scene.first)
    c, s = scene.c, scene.s
    return abs(c[0, j] * c[e, j] + s[0, j] * s[e, j]) > ALIKE


@kernel
def of_struck(scene, e, k, whole):
    """Decide where the other drives into the rear of the ego."""
    since, side = entered(scene, e, 0, k, MARGIN)
    mine, _ = turns(scene.c, scene.s, e, scene.first, scene.n, k, scene.dt)
    moved = ego_came_over(scene, e, since, 0)
    if side != 0 and (mine or moved):
        whole[DECIDED] = since
        if braked(scene, e, 0, since, since, COMFORT) == CLEAR:
            return OTHER, REAR_DISTANCE
        claim = scene.claims[e]
        if claim < 0:
            return EGO, rule_of(claim)
        if claim == 0:
            return EGO, (CUT_IN if moved else TURNING_GIVES_WAY)
        return OTHER, rule_of(claim)
    for i in range(max(k - int(JUST_NOW / scene.dt), 0), k):
        if scene.a[0, i] <= -HARD and scene.v[0, i] > STANDS and not has_reason(scene, i):
            whole[DECIDED] = i
            return SHARED, BRAKED_WITHOUT_REASON
    return OTHER, REAR_DISTANCE


@kernel
def has_reason(scene, k):
    """Say whether the ego has a reason to brake hard at instant k: somebody ahead, or a light."""
    x, y, c, s = scene.x, scene.y, scene.c, scene.s
    reach = AHEAD_TIME * scene.v[0, k] + AHEAD
    for o in range(1, x.shape[0]):
        if not scene.distance[o, k] < reach:
            continue
        if (x[o, k] - x[0, k]) * c[0, k] + (y[o, k] - y[0, k]) * s[0, k] > 0.0:
            return True
    for j in range(len(scene.stop_entities)):
        if scene.stop_entities[j] != 0 or not math.isfinite(scene.stop_lines[j, 0]):
            continue
        state = scene.lights[scene.stop_lights[j], k]
        dx, dy = scene.stop_lines[j, 0] - x[0, k], scene.stop_lines[j, 1] - y[0, k]
        if RED <= state <= RED_AND_YELLOW + 1 and 0.0 < dx * c[0, k] + dy * s[0, k] < SIGHT:
            return True
    return False


@kernel
def of_striking(scene, e, k, risk, side, late, avoidable, whole):
    """Decide where the ego drives into the rear of the other, or into an object."""
    if late and not avoidable:
        return NOBODY, REVEALED_LATE
    v = scene.v
    mine, its = turns(scene.c, scene.s, e, scene.first, scene.n, k, scene.dt)
    moved = ego_came_over(scene, e, min(risk + 1, k), 0)
    claim = scene.claims[e]
    if mine and not its and claim < 0:  # the ego turned into the way of one that had priority
        return EGO, rule_of(claim)
    stands = still_since(v[e], scene.first, k)
    if stands <= risk + 1 and stands <= k:  # it stood when it came into the way
        if avoidable or moved:
            return EGO, STANDING_AHEAD
        return NOBODY, UNSAFE_START
    if side != 0 and not moved and not mine:
        begins, _ = entered(scene, 0, e, k, 0.0)  # UN R157: the bodies overlap across the way
        begins = visible_from(scene, e, begins, k)
        could = braked(scene, 0, e, begins, begins, BRAKING) == CLEAR
        whole[DECIDED], whole[PREVENTABLE] = begins, could
        if could:
            return EGO, CUT_IN_PREVENTABLE
        return OTHER, (rule_of(claim) if its and claim > 0 else CUT_IN)
    start = max(slowing_since(v[e], scene.first, min(stands, k), scene.dt), risk)
    level = braked(scene, 0, e, start, start, BRAKING)
    if level == CLEAR:
        whole[DECIDED], whole[PREVENTABLE] = start, True
        return EGO, REAR_DISTANCE
    if level == COMES_NEAR and scene.near and not moved:
        whole[DECIDED], whole[PREVENTABLE] = start, False
        return NOBODY, BRAKED_HARD_AHEAD
    # had it time to open the gap before the other braked, since that was ahead of it?
    kept = braked(scene, 0, e, risk, start, BRAKING) == CLEAR
    whole[DECIDED], whole[PREVENTABLE] = start, kept
    if kept or moved:
        return EGO, REAR_DISTANCE
    return NOBODY, UNSAFE_START


@kernel
def of_leaving(scene, e, k, kind, own, own_part, avoidable):
    """Decide where two meet side by side, or head on: who has left its lane?"""
    v, c, s = scene.v, scene.c, scene.s
    if ego_came_over(scene, e, k, side_of(scene, e, k)):
        return EGO, LEFT_ITS_LANE
    claim = scene.claims[e]
    if claim != 0:
        return (OTHER if claim > 0 else EGO), rule_of(claim)
    if not scene.routed:
        mine, its = steering(scene, e, k, JUST_NOW)
        if max(mine, its) < ASIDE:
            return NOBODY, LEFT_ITS_LANE
        if mine > its:
            return EGO, LEFT_ITS_LANE
    along = v[e, k] * (c[e, k] * c[0, k] + s[e, k] * s[0, k])
    if kind == SIDE_SWIPE and strikes_with_front(own, own_part) and v[0, k] > along and avoidable:
        return EGO, CUT_IN_PREVENTABLE
    return OTHER, LEFT_ITS_LANE


@kernel
def of_crossing(scene, e, k, risk, whole):
    """Decide where two ways cross, or one turns into the other's."""
    since, _ = entered(scene, e, 0, k, 0.0)
    it_could = braked(scene, e, 0, since, since, COMFORT) != COLLIDES
    ego_could = braked(scene, 0, e, risk, risk, COMFORT) != COLLIDES
    if it_could and not ego_could:
        whole[DECIDED] = since
        return OTHER, JUNCTION_OCCUPIED
    if ego_could and not it_could:
        return EGO, JUNCTION_OCCUPIED
    claim = scene.claims[e]
    if claim != 0:
        return (OTHER if claim > 0 else EGO), rule_of(claim)
    mine, its = turns(scene.c, scene.s, e, scene.first, scene.n, k, scene.dt)
    if same_road(scene, e, k):
        if mine != its:
            return (EGO if mine else OTHER), TURNING_GIVES_WAY
        return SHARED, TURNING_GIVES_WAY
    j = max(k - int(TURN_TIME / scene.dt), scene.first)
    from_right = scene.c[0, j] * scene.s[e, j] - scene.s[0, j] * scene.c[e, j] > 0.0
    return (EGO if from_right else OTHER), ASSUMED_RIGHT_BEFORE_LEFT
