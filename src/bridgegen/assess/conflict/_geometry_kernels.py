"""Compiled geometry of a pair of bodies: contact, its place, and overlap of their paths."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math
from typing import NamedTuple

from bridgegen.assess.conflict._codes import (
    FRONT,
    FRONT_LEFT,
    FRONT_RIGHT,
    LEFT,
    REAR,
    REAR_LEFT,
    REAR_RIGHT,
    RIGHT,
)
from bridgegen.assess.conflict._limits import FINEST, FLUSH, HALVINGS, JUMPS
from bridgegen.assess.metrics._time_kernels import separation, sweep
from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel


class Scene(NamedTuple):
    """One row for the rules of responsibility, while one other participant is present.

    Attributes:
        half: ``(E, 2)`` half lengths and widths [m].
        kinds: ``(E,)`` of `bridgegen.drivers.kinds`.
        x, y: ``(E, T)`` centres [m].
        c, s: ``(E, T)`` cosine and sine of the headings.
        v: ``(E, T)`` speeds [m/s].
        a: ``(E, T)`` accelerations [m/s²].
        offset: ``(E, T)`` distances from the routes [m].
        distance: ``(E, T)`` from the ego's body [m], +inf where a body is absent.
        gone: ``(E, T)`` lengths of the tracks [m].
        claims: ``(E,)`` of the ego's route against each other's, see `right_of_way.claim`.
        crosswalks: ``(C, 5)``, as in a rollout; so are the next five.
        friction: [m/s²]; +inf where unknown.
        stop_entities: ``(L,)``.
        stop_lights: ``(L,)``.
        stop_lines: ``(L, 3)``.
        lights: ``(S, T)``.
        lamps: ``(E, T)``, or ``(0, 0)`` where no scenario switches any.
        routed: whether offsets are known.
        first: the instant since which the other is present.
        n: the instant until which it is.
        dt: time step [s].
        until: the instant up to which the other's motion counts as recorded; then it keeps its
            speed.
        at: the instant of the contact, or of the near miss.
        near: whether the conflict is a near miss.
    """

    half: Float
    kinds: Int
    x: Float
    y: Float
    c: Float
    s: Float
    v: Float
    a: Float
    offset: Float
    distance: Float
    gone: Float
    claims: Int
    crosswalks: Float
    friction: float
    stop_entities: Int
    stop_lights: Int
    stop_lines: Float
    lights: Int
    lamps: Int
    routed: bool
    first: int
    n: int
    dt: float
    until: int
    at: int
    near: bool


@kernel
def falls_below(values, first, end, limit):
    """Return whether one of the values from ``first`` to before ``end`` is below a limit."""
    while first < end and not values[first] < limit:
        first += 1
    return first < end


@kernel
def meeting(dx, dy, wx, wy, ca, sa, cb, sb, la, wa, lb, wb, still):
    """Return when boxes A and B first touch, ≥ 0, and which axis closes last.

    As `time_to_contact`; the axis is 0 along A, 1 across A, 2 along B, 3 across B. The time is +inf
    if they never touch. A rate of approach below ``still`` [m/s] is rounding.
    """
    c, s = abs(ca * cb + sa * sb), abs(ca * sb - sa * cb)
    last, end, axis = -math.inf, math.inf, 0
    for i in range(4):
        if i == 0:
            begin, stop = sweep(dx * ca + dy * sa, wx * ca + wy * sa, la + (c * lb + s * wb), still)
        elif i == 1:
            begin, stop = sweep(dy * ca - dx * sa, wy * ca - wx * sa, wa + (s * lb + c * wb), still)
        elif i == 2:
            begin, stop = sweep(dx * cb + dy * sb, wx * cb + wy * sb, lb + (c * la + s * wa), still)
        else:
            begin, stop = sweep(dy * cb - dx * sb, wy * cb - wx * sb, wb + (s * la + c * wa), still)
        if begin > last:
            last, axis = begin, i
        end = min(end, stop)
    if last > end or end < 0.0:
        return math.inf, axis
    return max(last, 0.0), axis


@kernel
def shallow_axis(dx, dy, ca, sa, cb, sb, la, wa, lb, wb):
    """Return the axis of least penetration of two overlapping boxes."""
    c, s = abs(ca * cb + sa * sb), abs(ca * sb - sa * cb)
    depths = (
        la + (c * lb + s * wb) - abs(dx * ca + dy * sa),
        wa + (s * lb + c * wb) - abs(dy * ca - dx * sa),
        lb + (c * la + s * wa) - abs(dx * cb + dy * sb),
        wb + (s * la + c * wa) - abs(dy * cb - dx * sb),
    )
    axis = 0
    for i in range(1, 4):
        if depths[i] < depths[axis]:
            axis = i
    return axis


@kernel
def normal_of(axis, dx, dy, ca, sa, cb, sb):
    """Return the unit normal of an axis that points from A to B."""
    if axis == 0:
        nx, ny = ca, sa
    elif axis == 1:
        nx, ny = -sa, ca
    elif axis == 2:
        nx, ny = cb, sb
    else:
        nx, ny = -sb, cb
    if nx * dx + ny * dy < 0.0:
        return -nx, -ny
    return nx, ny


@kernel
def edge_towards(nx, ny, c, s):
    """Return the edge of a box that faces a direction most: front, left, rear or right."""
    along, across = nx * c + ny * s, ny * c - nx * s
    if abs(along) >= abs(across):
        return FRONT if along > 0.0 else REAR
    return LEFT if across > 0.0 else RIGHT


@kernel
def corner_towards(nx, ny, c, s):
    """Return the corner of a box that lies farthest in a direction."""
    along, across = nx * c + ny * s, ny * c - nx * s
    if along >= 0.0:
        return FRONT_LEFT if across >= 0.0 else FRONT_RIGHT
    return REAR_LEFT if across >= 0.0 else REAR_RIGHT


@kernel
def zones(axis, nx, ny, ca, sa, cb, sb):
    """Return the edges or corners of A and B that meet, for a normal from A to B."""
    flush = min(abs(ca * sb - sa * cb), abs(ca * cb + sa * sb)) <= FLUSH
    if flush:
        return edge_towards(nx, ny, ca, sa), edge_towards(-nx, -ny, cb, sb)
    if axis < 2:
        return edge_towards(nx, ny, ca, sa), corner_towards(-nx, -ny, cb, sb)
    return corner_towards(nx, ny, ca, sa), edge_towards(-nx, -ny, cb, sb)


@kernel
def meets_at(nx, ny, dx, dy, ca, sa, cb, sb, la, lb, wb):
    """Return where along A, from its centre, B meets it: B's corner, or the middle of its edge."""
    towards, aside = nx * cb + ny * sb, ny * cb - nx * sb
    along, across = ca * cb + sa * sb, sa * cb - ca * sb
    middle, spread = dx * ca + dy * sa, 0.0
    if abs(towards) <= FLUSH:
        spread = lb * abs(along)
    else:
        middle -= math.copysign(lb, towards) * along
    if abs(aside) <= FLUSH:
        spread = wb * abs(across)
    else:
        middle -= math.copysign(wb, aside) * across
    return 0.5 * (max(middle - spread, -la) + min(middle + spread, la))


@kernel
def extent(nx, ny, c, s, half_length, half_width):
    """Return how far a box reaches from its centre in a direction [m]."""
    return abs(nx * c + ny * s) * half_length + abs(ny * c - nx * s) * half_width


@kernel
def overlap(tx, ty, dx, dy, ca, sa, cb, sb, la, wa, lb, wb):
    """Return the share of A's extent along a direction that B covers, 0 to 1."""
    a, b = extent(tx, ty, ca, sa, la, wa), extent(tx, ty, cb, sb, lb, wb)
    middle = dx * tx + dy * ty
    covered = min(a, middle + b) - max(-a, middle - b)
    return min(max(covered / (2.0 * a), 0.0), 1.0)


@kernel
def lengths(x, y, n, out):
    """Write the length of a track up to each instant [m]."""
    out[0] = 0.0
    for k in range(1, n):
        out[k] = out[k - 1] + elementary.hypot(x[k] - x[k - 1], y[k] - y[k - 1])


@kernel
def pose_on(x, y, c, s, gone, n, j, at):
    """Return (j, x, y) of the point of a track at a length, from instant j on.

    Beyond its end the track goes straight on.
    """
    while j < n - 1 and gone[j + 1] <= at:
        j += 1
    if j == n - 1:
        return j, x[j] + (at - gone[j]) * c[j], y[j] + (at - gone[j]) * s[j]
    u = (at - gone[j]) / (gone[j + 1] - gone[j])
    return j, x[j] + u * (x[j + 1] - x[j]), y[j] + u * (y[j + 1] - y[j])


@kernel
def apart_at(half, x, y, c, s, v, gone, e, k, n, until, i, j, t):
    """Return (i, j, gap): how far the ego and e are apart after t seconds at their speeds of k.

    They drive on their own tracks; i and j are the instants of the tracks that they have reached.
    """
    i, xa, ya = pose_on(x[0], y[0], c[0], s[0], gone[0], n, i, gone[0, k] + v[0, k] * t)
    j, xb, yb = pose_on(x[e], y[e], c[e], s[e], gone[e], until, j, gone[e, k] + v[e, k] * t)
    apart = separation(
        xb - xa,
        yb - ya,
        c[0, i],
        s[0, i],
        c[e, j],
        s[e, j],
        half[0, 0],
        half[0, 1],
        half[e, 0],
        half[e, 1],
    )
    return i, j, apart


@kernel
def time_along_paths(half, x, y, c, s, v, gone, e, k, n, until, horizon):
    """Return when the ego and e touch if both keep their speeds of instant k on their own tracks.

    A track is a body's path in the rollout, straight on beyond its end: instant n of the ego's,
    ``until`` of e's. +inf beyond the horizon [s]. Steps are as long as the gap allows; the last one
    is halved until it is short.
    """
    speeds = v[0, k] + v[e, k]
    if speeds <= 0.0:
        return math.inf
    i, j, t, before = k, k, 0.0, 0.0
    while t <= horizon:
        later_i, later_j, apart = apart_at(half, x, y, c, s, v, gone, e, k, n, until, i, j, t)
        if apart <= 0.0:
            for _ in range(HALVINGS):
                middle = 0.5 * (before + t)
                _, _, apart = apart_at(half, x, y, c, s, v, gone, e, k, n, until, i, j, middle)
                if apart <= 0.0:
                    t = middle
                else:
                    before = middle
            return t
        i, j, before = later_i, later_j, t
        t += max(apart / speeds, FINEST)
    return math.inf


@kernel
def presence(distance, k, n):
    """Return (first, end) of the instants around k at which a body is present without a break."""
    first, end = k, k + 1
    while first > 0 and distance[first - 1] < math.inf:
        first -= 1
    while end < n and distance[end] < math.inf:
        end += 1
    return first, end


@kernel
def displaced(x, y, v, e, k, dt):
    """Return whether body e is teleported from instant k to the next, not driven."""
    moved = elementary.hypot(x[e, k + 1] - x[e, k], y[e, k + 1] - y[e, k])
    return moved > (max(abs(v[e, k]), abs(v[e, k + 1])) + JUMPS) * dt


@kernel
def velocity(x, y, c, s, v, e, k, dt):
    """Return the velocity of body e from instant k to the next: that of its positions [m/s]."""
    if displaced(x, y, v, e, k, dt):
        return v[e, k] * c[e, k], v[e, k] * s[e, k]
    return (x[e, k + 1] - x[e, k]) / dt, (y[e, k + 1] - y[e, k]) / dt


@kernel
def beside(x, y, c, s, first, n, j, px, py):
    """Return (j, aside) of a point by a track's nearest instant, found from j on both ways.

    ``aside`` [m] is its distance from the line through that instant's heading, to the left.
    """
    best = (px - x[j]) ** 2 + (py - y[j]) ** 2
    for way in (1, -1):
        i = j + way
        while first <= i < n:
            d = (px - x[i]) ** 2 + (py - y[i]) ** 2
            if d > best:
                break
            best, j = d, i
            i += way
    return j, (py - y[j]) * c[j] - (px - x[j]) * s[j]


@kernel
def entered(scene, a, b, end, margin):
    """Return the instant since which body b is in the way of body a, up to instant ``end``.

    It is in the way where it reaches into the strip that a's body sweeps in the rollout, widened
    by a margin [m] to each side. ``end`` if it is not in the way yet; the second number is the side
    on which it was before: 1 left, -1 right, 0 if it is in the way from the start. The third is how
    much earlier than that instant it has reached the strip, in steps, below 1.
    """
    x, y, c, s = scene.x, scene.y, scene.c, scene.s
    own_width, length, width = scene.half[a, 1], scene.half[b, 0], scene.half[b, 1]
    j, k = end, end
    side = 0
    before = after = 0.0
    while k >= scene.first:
        j, aside = beside(x[a], y[a], c[a], s[a], scene.first, scene.n, j, x[b, k], y[b, k])
        nx, ny = -s[a, j], c[a, j]
        before = abs(aside) - own_width - margin - extent(nx, ny, c[b, k], s[b, k], length, width)
        if before >= 0.0:
            side = 1 if aside > 0.0 else -1
            break
        after = before
        k -= 1
    early = after / (after - before) if side != 0 and k < end else 0.0
    return min(k + 1, end), side, early


@kernel
def hidden(scene, e, k):
    """Return whether another body is between the ego's front and the centre of e at instant k."""
    return hidden_before(scene, e, k, 0.0)


@kernel
def hidden_before(scene, e, k, early):
    """Return the same of a moment that is earlier than instant k, by less than a step."""
    half = scene.half
    xe, ye, c, s = pose_before(scene, 0, k, early)
    ax, ay = xe + half[0, 0] * c, ye + half[0, 0] * s
    bx, by, _, _ = pose_before(scene, e, k, early)
    for o in range(1, scene.x.shape[0]):
        if o == e or scene.distance[o, k] == math.inf:
            continue
        # the segment in o's frame, clipped to its box
        xo, yo, c, s = pose_before(scene, o, k, early)
        px, py = (ax - xo) * c + (ay - yo) * s, (ay - yo) * c - (ax - xo) * s
        qx, qy = (bx - xo) * c + (by - yo) * s, (by - yo) * c - (bx - xo) * s
        begin, end = sweep(px, qx - px, half[o, 0], 1e-12)
        start, stop = sweep(py, qy - py, half[o, 1], 1e-12)
        if max(begin, start, 0.0) <= min(end, stop, 1.0):
            return True
    return False


@kernel
def pose_before(scene, e, k, early):
    """Return place and direction of body e, earlier than instant k by a share of a step."""
    x, y, c, s = scene.x[e, k], scene.y[e, k], scene.c[e, k], scene.s[e, k]
    if early <= 0.0:
        return x, y, c, s
    x, y = x - early * (x - scene.x[e, k - 1]), y - early * (y - scene.y[e, k - 1])
    return x, y, c - early * (c - scene.c[e, k - 1]), s - early * (s - scene.s[e, k - 1])


@kernel
def visible_from(scene, e, since, early, k):
    """Return the first instant from ``since`` on at which the ego could see body e; k at most.

    The second number is how much earlier than that instant it came into sight, in steps, below 1,
    or ``early`` if it was in sight ``early`` steps before ``since``.
    """
    i, high = since, early
    while hidden(scene, e, i):
        if i >= k:
            return k, 0.0
        i, high = i + 1, 1.0
    if high <= 0.0 or not hidden_before(scene, e, i, high):
        return i, high
    low = 0.0  # in sight; hidden at ``high``
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if hidden_before(scene, e, i, middle):
            high = middle
        else:
            low = middle
    return i, low


@kernel
def turned(c, s, first, k, steps):
    """Return the change of a heading within some steps up to instant k [rad]."""
    j = max(k - steps, first)
    return elementary.atan2(s[k] * c[j] - c[k] * s[j], c[k] * c[j] + s[k] * s[j])
