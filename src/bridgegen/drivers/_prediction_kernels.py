"""Predictions: each track's passages over the ego's route, by the ways that the map offers.

A passage is a row of `PASSAGE` numbers: a conflict zone (see ``_yielding_kernels``), then the
track's station on its way [m], its speed along it [m/s], how far its body reaches ahead of and
behind that station [m], the track's entity, how its speed changes [m/s²], and which of the two
gives way (``right_of_way``). The planner reads the passages of either prediction.

- A vehicle is expected on every way that the map offers from its start, as long as it is on that
  way, at the measured speed, whose measured rate of change continues for a while.
- A track on no such way (on foot, on a bicycle, off the lanes) is expected straight ahead.
- The ideal prediction knows the true way of each actor, and the one that a lane change leads to.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import COS, SIN, X, Y, project
from bridgegen.drivers._surroundings_kernels import BEHIND, QUICKENING
from bridgegen.drivers._tracking_kernels import CONFIRMED, KIND, LENGTH, STATE, VX, VY, WIDTH, H
from bridgegen.drivers._tracking_kernels import X as TRACK_X
from bridgegen.drivers._tracking_kernels import Y as TRACK_Y
from bridgegen.drivers._yielding_kernels import (
    ACROSS,
    ENTITY,
    FRONT,
    GAIN,
    RANK,
    REAR,
    SIDE_MARGIN,
    SPEED,
    STANDING,
    STATION,
    ZONE,
)
from bridgegen.drivers.kinds import IS_VULNERABLE

PASSAGE = ZONE + 7

OFF_WAY = 2.0  # m beside a way's centre, or …
TURNED = 0.6  # rad off its heading, a vehicle is not on it
LOST = -1.0  # a station on a way that is to be searched; less: it is searched so many plans later
PATIENCE = 10.0  # plans until a way that a track is not on is searched again
SEARCH_STEP = 4.0  # m, between the points of a way at which a track is first looked for
STRAIGHT_STEP = 2.0  # m, between the points of the ego's route that a straight line may cross
GRAZING = 0.25  # sine of the angle below which two lines run beside each other, not across
ON_FOOT_MARGIN = 0.4  # m, kept besides `SIDE_MARGIN` to vulnerable road users


@kernel
def locate_on_way(way, n, ds, guess, x, y, h):
    """Return the station of a track on a way, or `LOST` if it is not on it."""
    if guess < 0.0:
        stride = max(int(SEARCH_STEP / ds), 1)
        nearest, at = math.inf, 0
        for i in range(0, n, stride):
            gap = (way[i, X] - x) ** 2 + (way[i, Y] - y) ** 2
            if gap < nearest:
                nearest, at = gap, i
        if nearest > (OFF_WAY + SEARCH_STEP) ** 2:
            return LOST
        guess = at * ds
    q, d = project(way, n, ds, guess, x, y)
    if abs(d) > OFF_WAY or q >= (n - 1) * ds:
        return LOST
    i = int(q / ds)
    if elementary.cos(h) * way[i, COS] + elementary.sin(h) * way[i, SIN] < elementary.cos(TURNED):
        return LOST
    return q


@kernel
def add_passage(passages, count, zone, q, w, half, e, gain, rank):
    """Append a passage; return their number."""
    if count == passages.shape[0]:
        return count
    for i in range(ZONE):
        passages[count, i] = zone[i]
    passages[count, STATION], passages[count, SPEED] = q, w
    passages[count, FRONT] = passages[count, REAR] = half
    passages[count, ENTITY] = e
    passages[count, GAIN], passages[count, RANK] = gain, rank
    return count + 1


@kernel
def add_straight(path, n, ds, s, ahead, own_width, track, e, gain, passages, count):
    """Append the passage of a track straight ahead, if that crosses the ego's route."""
    w = elementary.hypot(track[VX], track[VY])
    if w < 3.0 * STANDING or count == passages.shape[0]:
        return count
    ux, uy = track[VX] / w, track[VY] / w
    px, py = track[TRACK_X], track[TRACK_Y]
    stride = max(int(STRAIGHT_STEP / ds), 1)
    first = max(int((s - BEHIND) / ds), 0)
    before = ux * (path[first, Y] - py) - uy * (path[first, X] - px)
    for i in range(first + stride, min(int((s + ahead) / ds), n - 1), stride):
        dx, dy = path[i, X] - px, path[i, Y] - py
        side = ux * dy - uy * dx
        if before * side < 0.0 and ux * dx + uy * dy > -track[LENGTH] - own_width:
            sine = abs(ux * path[i, SIN] - uy * path[i, COS])
            if sine > GRAZING:
                share = before / (before - side)
                at = (i - stride + share * stride) * ds
                r = ux * dx + uy * dy
                r -= (1.0 - share) * stride * ds * (ux * path[i, COS] + uy * path[i, SIN])
                cosine = math.sqrt(max(1.0 - sine * sine, 0.0))
                margin = SIDE_MARGIN + ON_FOOT_MARGIN
                own = 0.5 * (track[WIDTH] + own_width * cosine) / sine + margin
                other = 0.5 * (own_width + track[WIDTH] * cosine) / sine + margin
                edge = at - own + margin
                zone = (at - own, at + own, r - other, r + other, ACROSS, edge)
                return add_passage(passages, count, zone, 0.0, w, 0.5 * track[LENGTH], e, gain, 0)
        before = side
    return count


@kernel
def predict(path, n, ds, s, ahead, own_width, tracks, around, known, ways, counts, steps, zones,
            ranks, first, feet, passages):  # fmt: skip
    """Fill ``passages`` by the map and the tracks; return their number.

    ``ways`` ``(W, L, 6)`` are those that the map offers, entity e's from ``first[e]`` to
    ``first[e + 1]``; ``zones`` ``(W, ZONE)`` is where each meets the ego's route, and ``ranks``
    ``(W,)`` which of the two gives way there; ``feet`` ``(W,)`` keeps the station of the entity on
    it. Unless the zones are for this route (``known``), all are expected straight ahead.
    """
    count = 0
    for e in range(1, tracks.shape[0]):
        if tracks[e, STATE] < CONFIRMED:
            continue
        x, y, h = tracks[e, TRACK_X], tracks[e, TRACK_Y], tracks[e, H]
        gain = around[e, QUICKENING]
        # Every way that the map offers is a hypothesis, as long as the track is on it. To predict
        # at constant velocity made the ego stop inside the path of a turning car: collisions in 25
        # % of the random rows of crossroads-s3, with ways 1.6 %.
        on_way, mapped = False, known and e + 1 < len(first)  # no map has ways of ghosts
        for j in range(first[e] if mapped else 0, first[e + 1] if mapped else 0):
            if feet[j] < LOST:
                feet[j] += 1.0
                continue
            q = locate_on_way(ways[j], counts[j], steps[j], feet[j], x, y, h)
            feet[j] = q if q != LOST else -PATIENCE
            if q == LOST:
                continue
            on_way = True
            if zones[j, 0] < math.inf:
                i = int(q / steps[j])
                w = tracks[e, VX] * ways[j, i, COS] + tracks[e, VY] * ways[j, i, SIN]
                half = 0.5 * tracks[e, LENGTH]
                count = add_passage(
                    passages, count, zones[j], q, max(w, 0.0), half, e, gain, ranks[j]
                )
        if not on_way or IS_VULNERABLE[int(tracks[e, KIND])]:
            count = add_straight(
                path, n, ds, s, ahead, own_width, tracks[e], e, gain, passages, count
            )
    return count


@kernel
def predict_truly(path, n, ds, s, ahead, own_width, tracks, around, paths, counts, steps, zones,
                  ranks, station, on, to, foot, passages):  # fmt: skip
    """Fill ``passages`` by the entities' true ways; return their number.

    ``station`` and ``foot`` are where the entities are on the paths ``on`` and ``to`` (-1: none);
    ``ranks`` are the rights of way of the first paths. Vulnerable road users are also expected
    straight ahead, with a larger margin.
    """
    count = 0
    for e in range(1, tracks.shape[0]):
        if tracks[e, STATE] < CONFIRMED:
            continue
        gain, is_ghost = around[e, QUICKENING], e >= len(on)
        for turn in range(0 if is_ghost else 2):
            j, near = (on[e], station[e]) if turn == 0 else (to[e], foot[e])
            if j < 0 or zones[j, 0] == math.inf:
                continue
            q, _ = project(
                paths[j], counts[j], steps[j], near, tracks[e, TRACK_X], tracks[e, TRACK_Y]
            )
            w = elementary.hypot(tracks[e, VX], tracks[e, VY])
            half, rank = 0.5 * tracks[e, LENGTH], ranks[j] if j < len(ranks) else 0
            count = add_passage(passages, count, zones[j], q, w, half, e, gain, rank)
        if is_ghost or IS_VULNERABLE[int(tracks[e, KIND])]:
            count = add_straight(
                path, n, ds, s, ahead, own_width, tracks[e], e, gain, passages, count
            )
    return count
