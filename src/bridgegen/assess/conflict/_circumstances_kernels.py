"""Compiled circumstances of a conflict: lights, crosswalks, braking and steering."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.assess.conflict._careful_driver_kernels import bend_at
from bridgegen.assess.conflict._geometry_kernels import beside, pose_before, turned
from bridgegen.assess.conflict._limits import (
    AHEAD,
    ALIKE,
    ASIDE,
    BRAKING,
    CROSSWALK_MARGIN,
    EVIDENT_EVERY,
    HALVINGS,
    HARD,
    HORIZON,
    JUNCTION,
    JUST_NOW,
    KERB,
    LATELY,
    LINE_REACH,
    LOOKED_BACK,
    MARGIN,
    MARGIN_ON_FOOT,
    REACTION,
    SAME_WAY,
    SIGHT,
    STANDS,
    TURN_TIME,
)
from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import BRAKE_LIGHTS_FROM, IS_ANIMAL, IS_PEDESTRIAN, IS_VULNERABLE
from bridgegen.drivers.right_of_way import PASSES

RED, RED_AND_YELLOW = 1, 2
"""States of a light, as ``Rollout.lights`` has them."""


@kernel
def is_red(scene, j, k):
    """Return whether stop line j must not be passed at instant k; see `Rollout.stop_lights`."""
    light = scene.stop_lights[j]
    if light < 0:  # a crosswalk's kerb: its own light is not on the map, so the traffic's counts
        return scene.lights[~light, k] > RED
    state = scene.lights[light, k]
    return state in (RED, RED_AND_YELLOW)


@kernel
def passes_line(scene, e, j, since, last):
    """Return at which instants body e passes stop line j: the last at red, and the last; -1: none.

    ``since`` and ``last`` limit the instants.
    """
    lines, x, y, c, s = scene.stop_lines, scene.x, scene.y, scene.c, scene.s
    lc, ls = elementary.cos(lines[j, 2]), elementary.sin(lines[j, 2])
    reach, before, at_red, at_all = scene.half[e, 0], math.inf, -1, -1
    for i in range(since, last + 1):
        px = x[e, i] + reach * c[e, i] - lines[j, 0]
        py = y[e, i] + reach * s[e, i] - lines[j, 1]
        past = px * lc + py * ls
        if before <= 0.0 < past and abs(py * lc - px * ls) <= LINE_REACH:
            at_all = i
            if is_red(scene, j, i - 1):
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
    """Return whether body e heads for a red light at instant k and does not pass it afterwards."""
    for j in range(len(scene.stop_entities)):
        if scene.stop_entities[j] != e or not math.isfinite(scene.stop_lines[j, 0]):
            continue
        line = scene.stop_lines[j]
        lc, ls = elementary.cos(line[2]), elementary.sin(line[2])
        px = scene.x[e, k] + scene.half[e, 0] * scene.c[e, k] - line[0]
        py = scene.y[e, k] + scene.half[e, 0] * scene.s[e, k] - line[1]
        before = -SIGHT <= px * lc + py * ls <= 0.0 and abs(py * lc - px * ls) <= LINE_REACH
        if before and is_red(scene, j, k):
            _, passes = passes_line(scene, e, j, k, ahead_until(scene, k, time))
            if passes < 0:
                return True
    return False


@kernel
def on_crosswalk(scene, e, k, early):
    """Return whether body e's centre is on a crosswalk of the ego's route, at k less ``early``."""
    walks = scene.crosswalks
    x, y, _, _ = pose_before(scene, e, k, early)
    for j in range(len(walks)):
        if not math.isfinite(walks[j, 0]):
            continue
        c, s = elementary.cos(walks[j, 2]), elementary.sin(walks[j, 2])
        dx, dy = x - walks[j, 0], y - walks[j, 1]
        along, across = abs(dx * c + dy * s), abs(dy * c - dx * s)
        if along <= walks[j, 3] + CROSSWALK_MARGIN and across <= walks[j, 4] + KERB:
            return True
    return False


@kernel
def on_crosswalk_since(scene, e, k):
    """Return the instant since which body e is on a crosswalk; k + 1 if it is not at k.

    The second number is how much earlier it stepped on it, in steps, below 1.
    """
    i = k
    while i >= scene.first and on_crosswalk(scene, e, i, 0.0):
        i -= 1
    if i < scene.first or i == k:
        return i + 1, 0.0
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if on_crosswalk(scene, e, i + 1, middle):
            low = middle
        else:
            high = middle
    return i + 1, low


@kernel
def slowing_since(v, first, k, dt):
    """Return the last instant before k at which a body began to slow down.

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
    """Return the instant since which a body stands at instant k; k + 1 if it moves."""
    while k >= first and v[k] <= STANDS:
        k -= 1
    return k + 1


@kernel
def has_set_off(scene, e, k):
    """Return whether body e, which moves at instant k, stood within `HORIZON` before."""
    for i in range(max(k - int(HORIZON / scene.dt), scene.first), k + 1):
        if scene.v[e, i] <= STANDS:
            return True
    return False


@kernel
def ego_moved(scene, k, way):
    """Return whether the ego has moved across its route just before instant k.

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
    """Return whether it is the ego that has changed course when it and body e meet at instant k.

    It has moved, see `ego_moved`; and body e has not steered more ``LATELY``: a vehicle that has
    arrived on a lane has the right to go straight on there.
    """
    if not ego_moved(scene, k, way):
        return False
    mine, its = steering(scene, e, k, LATELY)
    return mine >= its - 1e-9  # m: rounding does not decide between two that go straight


@kernel
def ego_will_come_over(scene, e, k, side):
    """Return whether body e is in the ego's way since instant k because the ego changes course.

    Where the other is then, on the ego's ``side`` (1 left, -1 right), the ego will have moved
    across its route, while the other has kept its course `LATELY`.
    """
    x, y, c, s, offset = scene.x, scene.y, scene.c, scene.s, scene.offset
    j, _ = beside(x[0], y[0], c[0], s[0], scene.first, scene.n, k, x[e, k], y[e, k])
    begin = max(k - int(JUST_NOW / scene.dt), 0)
    if c[0, begin] * c[0, j] + s[0, begin] * s[0, j] < SAME_WAY or offset[0, j] == offset[0, k]:
        return False
    for i in range(begin, k + 1):
        if side * (offset[0, j] - offset[0, i]) > ASIDE:
            _, its = steering(scene, e, k, LATELY)
            return its < ASIDE
    return False


@kernel
def passes_against(scene, e, k):
    """Return whether the ego meets body e on the lane of oncoming traffic, to pass something.

    Its route leads there, see `bridgegen.drivers.right_of_way.PASSES`.
    """
    c, s, kind = scene.c, scene.s, scene.kinds[e]
    if not scene.claims[0] & PASSES or abs(scene.offset[0, k]) <= ASIDE:
        return False
    return c[0, k] * c[e, k] + s[0, k] * s[e, k] < -ALIKE and not (
        IS_PEDESTRIAN[kind] or IS_ANIMAL[kind]
    )


@kernel
def could_wait_since(scene, k):
    """Return the last instant at which the ego, off its lane at k, could still stop on its lane."""
    left = k
    while left > scene.first and abs(scene.offset[0, left - 1]) > ASIDE:
        left -= 1
    i, braking = left, min(BRAKING, scene.friction)
    while i > scene.first:
        v = scene.v[0, i]
        if v * REACTION + v * v / (2.0 * braking) <= scene.gone[0, left] - scene.gone[0, i]:
            break
        i -= 1
    return i


@kernel
def going_over(scene, k):
    """Return how far the ego has moved to the left across its route `LATELY` before instant k [m].

    0 where it turns off.
    """
    begin = max(k - int(LATELY / scene.dt), scene.first)
    if scene.c[0, k] * scene.c[0, begin] + scene.s[0, k] * scene.s[0, begin] < SAME_WAY:
        return 0.0
    return scene.offset[0, k] - scene.offset[0, begin]


@kernel
def ego_goes_over(scene, e, k, side):
    """Return whether the ego moves across its route to body e, beside it, more than that to it.

    Body e is at its ``side``: 1 left, -1 right. Both are compared `LATELY`; where the route leads
    is where the ego has gone, less what it has moved across.
    """
    across = going_over(scene, k)
    x, y, begin = scene.x, scene.y, max(k - int(LATELY / scene.dt), scene.first)
    dx, dy = x[0, k] - x[0, begin], y[0, k] - y[0, begin]
    length = math.sqrt(dx * dx + dy * dy)
    if side * across <= 0.0 or length <= abs(across) or not ego_moved(scene, k, side):
        return False
    sine = across / length
    cosine = math.sqrt(1.0 - sine * sine)
    ux, uy = (dx * cosine + dy * sine) / length, (dy * cosine - dx * sine) / length
    its = ux * (y[e, k] - y[e, begin]) - uy * (x[e, k] - x[e, begin])
    return side * across > -side * its


@kernel
def ego_comes_before(scene, e, k):
    """Return whether the ego moves across its route into the way of body e, behind it.

    It does so more than that body steers.
    """
    if not ego_moved(scene, k, 0):
        return False
    _, its = steering(scene, e, k, LATELY)
    return abs(going_over(scene, k)) > its


@kernel
def steering(scene, e, k, within):
    """Return how much the ego and body e have steered beyond their common bend [m].

    Both are compared over the same length of path before instant k, that of the slower one
    ``within`` so many seconds. A constant bend over a length L that turns a body by phi moves it
    aside by L phi / 2. The lesser bend, if both go the same way, is taken for that of the road.
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
def side_of(scene, e, k):
    """Return on which side of the ego body e is: 1 left, -1 right."""
    dx, dy = scene.x[e, k] - scene.x[0, k], scene.y[e, k] - scene.y[0, k]
    return 1 if dy * scene.c[0, k] - dx * scene.s[0, k] > 0.0 else -1


@kernel
def same_road(scene, e, k):
    """Return whether both were on one road, in the same or in opposite directions."""
    j = max(k - int(TURN_TIME / scene.dt), scene.first)
    c, s = scene.c, scene.s
    return abs(c[0, j] * c[e, j] + s[0, j] * s[e, j]) > ALIKE


@kernel
def strip(scene, a, b, k):
    """Return how far ahead of body a another one is at instant k, and how far aside of its strip.

    Both in metres; aside is 0 within the strip that a sweeps, straight on or in the bend that it
    drives. A vehicle that stands or drives askew may be where the road bends: on an arc to its
    place and heading.
    """
    c, s = scene.c, scene.s
    dx, dy = scene.x[b, k] - scene.x[a, k], scene.y[b, k] - scene.y[a, k]
    along, aside = dx * c[a, k] + dy * s[a, k], dy * c[a, k] - dx * s[a, k]
    cosine = c[a, k] * c[b, k] + s[a, k] * s[b, k]
    sine = c[a, k] * s[b, k] - s[a, k] * c[b, k]
    room = scene.half[a, 1] + scene.half[b, 0] * abs(sine) + scene.half[b, 1] * abs(cosine)
    room += MARGIN_ON_FOOT if IS_VULNERABLE[scene.kinds[b]] else MARGIN
    least = min(abs(aside), abs(aside - 0.5 * bend_at(scene, a, k) * along * along))
    if abs(cosine) > SAME_WAY and aside * sine * cosine > 0.0:
        least = min(least, max(abs(aside) - abs(along * sine / cosine), 0.0))
    return along, max(least - room, 0.0)


@kernel
def asks(scene, o, k):
    """Return whether body o asks the ego to brake hard at instant k.

    It is ahead in the ego's way, or on its way there within `HORIZON`, and nearer than the ego
    comes to a stop by `HARD`, or to the speed of one that does not brake.
    """
    v, c, s = scene.v, scene.c, scene.s
    along, aside = strip(scene, 0, o, k)
    if along <= 0.0:
        return False
    its = max(v[o, k] * (c[0, k] * c[o, k] + s[0, k] * s[o, k]), 0.0)
    if scene.a[o, k] <= -BRAKE_LIGHTS_FROM:
        its = 0.0
    stops = v[0, k] * REACTION + max(v[0, k] * v[0, k] - its * its, 0.0) / (2.0 * HARD)
    if not scene.distance[o, k] <= stops + AHEAD:
        return False
    left = (scene.y[o, k] - scene.y[0, k]) * c[0, k] - (scene.x[o, k] - scene.x[0, k]) * s[0, k]
    across = v[o, k] * (c[0, k] * s[o, k] - s[0, k] * c[o, k])
    nears = -across if left > 0.0 else across
    return aside <= max(nears, 0.0) * HORIZON


@kernel
def unjustified(scene, begin, end):
    """Return the first of the instants at which the ego brakes hard without a reason; -1: none.

    A reason counts from `LATELY` before the braking began, `HORIZON` before at most, to `REACTION`
    after: harder braking than it asks for ends the need for it, and one may brake for what comes.
    """
    every = max(int(EVIDENT_EVERY / scene.dt + 0.5), 1)
    for i in range(max(begin, 0), end):
        if scene.a[0, i] > -HARD or scene.v[0, i] <= STANDS:
            continue
        first, earliest = i, max(i - int(HORIZON / scene.dt), 0)
        while first > earliest and scene.a[0, first - 1] <= -BRAKE_LIGHTS_FROM:
            first -= 1
        first = max(first - int(LATELY / scene.dt), 0)
        last = min(i + int(REACTION / scene.dt), scene.n - 1)
        reason = False
        for j in range(first, last + 1, every):
            reason = reason or has_reason(scene, j)
        if not reason:
            return i
    return -1


@kernel
def has_reason(scene, k):
    """Return whether the ego has a reason to brake hard at instant k: an actor ahead or a light."""
    x, y, c, s = scene.x, scene.y, scene.c, scene.s
    for o in range(1, x.shape[0]):
        if asks(scene, o, k):
            return True
    for j in range(len(scene.stop_entities)):
        if scene.stop_entities[j] != 0 or not math.isfinite(scene.stop_lines[j, 0]):
            continue
        state = scene.lights[scene.stop_lights[j], k]
        dx, dy = scene.stop_lines[j, 0] - x[0, k], scene.stop_lines[j, 1] - y[0, k]
        if RED <= state <= RED_AND_YELLOW + 1 and 0.0 < dx * c[0, k] + dy * s[0, k] < SIGHT:
            return True
    return False
