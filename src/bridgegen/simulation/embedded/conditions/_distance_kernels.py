"""Distances between entities, and between an entity and a place, as conditions measure them."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import COS, SIN, X, Y, pose, project
from bridgegen.simulation._box_kernels import box_gap
from bridgegen.simulation.embedded._codes import (
    AT_MARK,
    BOXES,
    DISTANCE,
    ENTITY_SYSTEM,
    EUCLIDIAN,
    LATERAL,
    MEASURE,
    OTHER,
    PLACE,
    PROBE,
    SYSTEM,
    TIME_HEADWAY,
    WHO,
)
from bridgegen.simulation.embedded._motion_kernels import nearest


@kernel
def look_ahead(p, k, plan, roads, state, record):
    """Return (whether it is defined, the distance [m], time to collision [s] or headway [s]).

    Distances are absolute. A headway is defined for an entity that moves towards a target not
    behind it, a time to collision for one that approaches it.
    """
    kind, e, other = plan.probes[p, PROBE], plan.probes[p, WHO], plan.probes[p, OTHER]
    measure, free = plan.probes[p, MEASURE], plan.probes[p, BOXES] == 1
    x, y, h, v = record.x[e, k], record.y[e, k], record.h[e, k], record.v[e, k]
    own = plan.bodies[e]
    if other >= 0:
        ox, oy, oh, w = (
            record.x[other, k],
            record.y[other, k],
            record.h[other, k],
            record.v[other, k],
        )
        length, width, ahead = (
            plan.bodies[other, 0],
            plan.bodies[other, 1],
            plan.bodies[other, 2],
        )
    else:
        at = state.marks if other == AT_MARK else roads.points
        ox, oy = at[plan.probes[p, PLACE], 0], at[plan.probes[p, PLACE], 1]
        if math.isnan(ox):  # there is no such place
            return False, 0.0
        oh = w = length = width = ahead = 0.0
    if measure == EUCLIDIAN:
        gap, closing = as_the_crow_flies(ox - x, oy - y, v, h, w, oh)
        if free:
            gap = apart(own, length, width, ahead, ox - x, oy - y, h, oh)
    else:
        turn, other_turn = 0.0, oh - h
        along, aside = in_frame(ox - x, oy - y, h)
        path = state.on[e]
        if plan.probes[p, SYSTEM] != ENTITY_SYSTEM and path >= 0:
            along, aside, turn, other_turn = along_path(
                roads.paths[path], roads.counts[path], roads.steps[path], state.station[e],
                x, y, h, ox, oy, oh,
            )  # fmt: skip
        gap = aside if measure == LATERAL else along
        closing = v * math.cos(turn) - w * math.cos(other_turn)
        if measure == LATERAL:
            closing = v * math.sin(turn) - w * math.sin(other_turn)
        if free:
            gap = between_boxes(gap, own, length, width, ahead, turn, other_turn, measure)
    if kind == DISTANCE:
        return True, abs(gap)
    if kind == TIME_HEADWAY:
        is_ahead = gap >= 0.0 and (measure != EUCLIDIAN or in_frame(ox - x, oy - y, h)[0] >= 0.0)
        return v > 0.0 and is_ahead, gap / max(v, 1e-9)
    if gap == 0.0:
        return True, 0.0
    closes = closing > 0.0 if gap > 0.0 else closing < 0.0
    return closes, gap / closing if closes else 0.0


@kernel
def as_the_crow_flies(dx, dy, v, h, w, other_h):
    """Return (distance [m], how fast it shrinks [m/s]) of a body from another at (dx, dy)."""
    gap = math.hypot(dx, dy)
    closing = dx * (v * math.cos(h) - w * math.cos(other_h)) + dy * (
        v * math.sin(h) - w * math.sin(other_h)
    )
    return gap, closing / max(gap, 1e-9)


@kernel
def in_frame(dx, dy, h):
    """Return a vector's parts along a heading and to its left."""
    c, s = math.cos(h), math.sin(h)
    return c * dx + s * dy, c * dy - s * dx


@kernel
def along_path(path, n, ds, station, x, y, h, ox, oy, oh):
    """Return how far another body is ahead along a path and to its left, and both bodies' turns.

    A turn is by how much a body's heading differs from the path's direction at its foot. The body
    itself is near ``station``; the other's foot is looked for all along the path, and beyond its
    ends on the tangents.
    """
    s, d = project(path, n, ds, station, x, y)
    q = nearest(path, n, ds, ox, oy)
    q, t = project(path, n, ds, q, ox, oy)
    if q <= 0.0:
        q = min(path[0, COS] * (ox - path[0, X]) + path[0, SIN] * (oy - path[0, Y]), 0.0)
    elif q >= (n - 1) * ds:
        end = path[n - 1]
        q += max(end[COS] * (ox - end[X]) + end[SIN] * (oy - end[Y]), 0.0)
    return q - s, t - d, h - pose(path, n, ds, s)[2], oh - pose(path, n, ds, q)[2]


@kernel
def apart(own, length, width, ahead, dx, dy, h, other_h):
    """Return the distance of two boxes [m], 0 where they touch."""
    c, s, oc, os = math.cos(h), math.sin(h), math.cos(other_h), math.sin(other_h)
    return box_gap(own, (length, width, ahead), dx, dy, c, s, oc, os)


@kernel
def between_boxes(gap, own, length, width, ahead, turn, other_turn, measure):
    """Return the gap of two boxes along an axis [m], signed; 0 where they are side by side.

    ``gap`` is that of their reference points along the axis; turns are from the axis that is
    longitudinal.
    """
    c, s, oc, os = math.cos(turn), math.sin(turn), math.cos(other_turn), math.sin(other_turn)
    if measure == LATERAL:
        c, s, oc, os = s, c, os, oc
    middle = gap + ahead * oc - own[2] * c
    reach = 0.5 * (abs(c) * own[0] + abs(s) * own[1] + abs(oc) * length + abs(os) * width)
    return math.copysign(max(abs(middle) - reach, 0.0), middle)
