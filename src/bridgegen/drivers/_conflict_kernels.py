"""What a careful driver foresees: which bodies are on its way, which cross it, and when.

All bodies are expected to keep their speed: the ego along its path, another along its own (as if
indicators showed where it turns), one that changes lane on a circle of its turn rate, once it has
come nearer from the side. A body is one of

- a leader: it stands, or goes the ego's way, and is on it or coming onto it from the side;
- crossing: both bodies will meet if both go on;
- no conflict; so is a body that would run into the ego's rear half while its front is past: the
  way out is forward.

Bodies are rows (length, width, centre ahead of the reference point) [m]. ``beside`` is a row that
the caller keeps of each: how far its centre is to the side of the ego's way now, and the farthest
that it has been [m]; zeros before the first instant.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import COS, SIN, X, Y, pose, project

NO_CONFLICT, LEADER, CROSSING = 0, 1, 2
ASIDE, FARTHEST = 0, 1

WANDERING = 0.375  # m to the side that are no change of lane; UN R157, 01 series, annex 3
SAME_WAY = 0.7  # cosine of the angle between two headings below which one crosses the other's way
STANDS = 0.1  # m/s, below which a heading means nothing
SIDE_MARGIN = 0.5  # m, kept to the side of a body that is passed …
END_MARGIN = 2.0  # … and to its front and rear; the FSM's distance at standstill
LEAST_PACE = 3.0  # m/s, the least speed at which the ego checks whether its way is clear
STEP = 0.1  # s, between two instants that are foreseen
AFTER = 3.0  # s after bodies meet, in which the other still covers a part of the ego's way
SAMPLES = 24  # of the ego's way, among which the one nearest to a body is searched
BEHIND = 10.0  # m of the ego's way behind it that count as beside it


@kernel
def foot_on_way(path, n, ds, s, reach, x, y):
    """Return (station, offset to the left) of a point's foot on the way; an offset of +inf: none.

    The way is the path from somewhat behind station s to ``reach`` [m] ahead of it.
    """
    stride = max(int((reach + BEHIND) / (SAMPLES * ds)), 1)
    first = min(max(int((s - BEHIND) / ds), 0), n - 1)
    last = min(n - 1, int((s + reach) / ds))
    nearest, at = math.inf, first
    for i in range(first, last + 1, stride):
        gap = (path[i, X] - x) ** 2 + (path[i, Y] - y) ** 2
        if gap < nearest:
            nearest, at = gap, i
    beyond = (x - path[at, X]) * path[at, COS] + (y - path[at, Y]) * path[at, SIN]
    if (at == first and beyond < 0.0) or (at + stride > last and beyond > stride * ds):
        return s, math.inf
    return project(path, n, ds, at * ds, x, y)


@kernel
def boxes_meet(x, y, turned, length, width, other_length, other_width):
    """Return whether two boxes overlap, by their separating axes.

    (x, y) is the second one's centre in the frame of the first, ``turned`` its heading there
    [rad]; lengths and widths are halves.
    """
    c, s = elementary.cos(turned), elementary.sin(turned)
    along, across = abs(c), abs(s)
    return (
        abs(x) <= length + other_length * along + other_width * across
        and abs(y) <= width + other_length * across + other_width * along
        and abs(x * c + y * s) <= other_length + length * along + width * across
        and abs(y * c - x * s) <= other_width + length * across + width * along
    )


@kernel
def later(known, path, n, ds, q, left, x, y, h, w, turn, t):
    """Return the pose (x, y, heading) of a body in t seconds, if it goes on.

    Now it is at (x, y, h), at speed w [m/s]: if its path is ``known``, at station q of that, so far
    to the ``left`` of it [m]; else on a circle of ``turn`` [rad/s].
    """
    if known:
        px, py, ph = pose(path, n, ds, q + w * t)
        return px - left * elementary.sin(ph), py + left * elementary.cos(ph), ph
    chord = h + 0.5 * turn * t  # of the arc, and of its length but for 2 % at 40°
    return x + w * t * elementary.cos(chord), y + w * t * elementary.sin(chord), h + turn * t


@kernel
def meet(
    path, n, ds, s, pace, own, known, other_path, other_n, other_ds, q, x, y, h, w, turn, other,
    horizon,
):  # fmt: skip
    """Return (when two bodies meet, margins included, if both go on [s], the room until there [m]).

    Both +inf if they do not meet within the horizon. The room is the distance from the ego's front
    to the part of its way that the other's body covers before or after they meet; < 0 where its
    front is already in that part, and the other would meet its rear half. The ego goes along its
    path at ``pace`` [m/s] from station s; for the other see ``later``.
    """
    length, width = 0.5 * own[0] + END_MARGIN, 0.5 * own[1] + SIDE_MARGIN
    other_length, other_width = 0.5 * other[0], 0.5 * other[1]
    reach = elementary.hypot(length, width) + elementary.hypot(other_length, other_width)
    closing = pace + w
    left = 0.0
    if known:
        px, py, ph = pose(other_path, other_n, other_ds, q)
        left = (y - py) * elementary.cos(ph) - (x - px) * elementary.sin(ph)
    t, met, ahead = 0.0, False, 0.0
    while t <= horizon and not met:
        ex, ey, eh = pose(path, n, ds, s + pace * t)
        c, r = elementary.cos(eh), elementary.sin(eh)
        px, py, ph = later(known, other_path, other_n, other_ds, q, left, x, y, h, w, turn, t)
        dx = px + other[2] * elementary.cos(ph) - ex - own[2] * c
        dy = py + other[2] * elementary.sin(ph) - ey - own[2] * r
        apart = elementary.hypot(dx, dy) - reach
        if apart <= 0.0:
            ahead, aside = dx * c + dy * r, dy * c - dx * r
            met = boxes_meet(ahead, aside, ph - eh, length, width, other_length, other_width)
        if not met:
            t += max(STEP, 0.9 * apart / closing)
    if not met:
        return math.inf, math.inf
    # To the strip that the other covers, not to where both meet: there the ego blocked a vehicle
    # that turned left in 8 % of the random rows of crossroads-s2, now in none.
    room = pace * t
    for way in (-1.0, 1.0):  # before they meet, and after
        foot, moment = s + pace * t, t
        while 0.0 <= moment <= t + AFTER:
            px, py, ph = later(
                known, other_path, other_n, other_ds, q, left, x, y, h, w, turn, moment
            )
            cx, cy = px + other[2] * elementary.cos(ph), py + other[2] * elementary.sin(ph)
            foot, offset = project(path, n, ds, foot, cx, cy)
            i = min(int(foot / ds), n - 1)
            along = abs(elementary.cos(ph) * path[i, COS] + elementary.sin(ph) * path[i, SIN])
            across = math.sqrt(max(1.0 - along * along, 0.0))
            if abs(offset) > width + other_length * across + other_width * along:
                break
            ends = 0.5 * own[0] + other_length * along + other_width * across
            room = min(room, foot - s - own[2] - ends)
            moment += way * 2.0 * STEP
    # Less than 0: only the ego's rear half could be hit, and the way out is forward.
    return t, room if ahead <= 0.0 else max(room, 0.0)


@kernel
def foresee(
    k, dt, path, n, ds, s, v, own, known, other_path, other_n, other_ds, q, x, y, h, w, turn,
    other, horizon, reach, beside,
):  # fmt: skip
    """Return what a body means to the ego at instant k, instants being ``dt`` [s] apart.

    The ego, body ``own``, is at station ``s`` [m] of its path, ``n`` rows ``ds`` [m] apart, at
    speed ``v`` [m/s]. The other's reference point is at (``x``, ``y``, ``h``) [m, rad]; it goes at
    speed ``w`` and turns by ``turn`` [rad/s]; it is at station ``q`` of its path, which it follows
    if that is ``known``. Leaders matter up to ``reach`` [m] ahead, crossing bodies within the next
    ``horizon`` [s]. The other's row ``beside`` is changed in place.

    Returns (what, ttc, gap, along, lateral): NO_CONFLICT, LEADER or CROSSING; time to collision
    [s]; distance from the ego's front to the leader's rear, or to where the other crosses [m]; a
    leader's speed along the ego's way, 0 of a crossing body [m/s]; when a leader will be on the way
    [s], 0 if it is.
    """
    cx, cy = x + other[2] * elementary.cos(h), y + other[2] * elementary.sin(h)
    station, offset = foot_on_way(path, n, ds, s, reach, cx, cy)
    before, aside = beside[ASIDE], abs(offset)
    beside[ASIDE] = aside
    beside[FARTHEST] = max(beside[FARTHEST], aside) if aside < math.inf else 0.0
    stands = w < STANDS
    if aside < math.inf:
        i = min(int(station / ds), n - 1)
        along = elementary.cos(h) * path[i, COS] + elementary.sin(h) * path[i, SIN]
        across = math.sqrt(max(1.0 - along * along, 0.0))
        length = other[0] * abs(along) + other[1] * across  # as the way sees it
        width = other[0] * across + other[1] * abs(along)
        gap = station - s - own[2] - 0.5 * (own[0] + length)
        if (stands or along > SAME_WAY) and gap > 0.0:
            beyond = aside - 0.5 * (own[1] + width) - SIDE_MARGIN
            nearing = (before - aside) / dt if k > 0 and before < math.inf else 0.0
            lateral = math.inf
            if beyond <= 0.0:
                lateral = 0.0
            elif nearing > 0.0:
                lateral = beyond / nearing
            if lateral < math.inf:
                speed = 0.0 if stands else w * along
                ttc = gap / (v - speed) if v > speed else math.inf
                return LEADER, ttc, gap, speed, lateral
    if stands or not (known or beside[FARTHEST] - aside > WANDERING):
        return NO_CONFLICT, math.inf, math.inf, 0.0, math.inf
    t, room = meet(
        path, n, ds, s, max(v, LEAST_PACE), own, known, other_path, other_n, other_ds, q, x, y, h,
        w, turn, other, horizon,
    )  # fmt: skip
    if t == math.inf or room < 0.0:
        return NO_CONFLICT, math.inf, math.inf, 0.0, math.inf
    return CROSSING, t, room, 0.0, 0.0
