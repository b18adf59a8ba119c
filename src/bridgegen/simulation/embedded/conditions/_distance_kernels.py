"""Distances between entities, and between an entity and a place, as conditions measure them."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float, Int
from bridgegen.compiled import inlined_kernel, kernel
from bridgegen.ego._path_kernels import COS, SIN, X, Y, pose, project
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
from bridgegen.simulation.embedded._memory_kernels import view
from bridgegen.simulation.embedded._motion_kernels import nearest


class Scene(NamedTuple):
    """What the probes read that are seldom asked for, by a function of its own."""

    probes: Int
    slots: Float
    values: Float
    clock: Float
    held: Float
    lights: npt.NDArray[np.int8]
    phase_now: Int
    bodies: Float
    objects: Int
    on: Int
    station: Float
    paths: Float
    counts: Int
    steps: Float
    points: Float
    marks: Float
    along: Int
    spans: Float
    span_counts: Int
    nodes: Int
    cells: Float
    cell_nodes: Int
    clearances: Int
    ranges: Float
    x: Float
    y: Float
    h: Float
    v: Float
    a: Float
    observed: Bool
    present: Bool
    dt: float


borrow_scene = view(Scene)


@inlined_kernel
def scene_of(plan, roads, state, record):
    """Return what these probes read."""
    return Scene(
        plan.probes, state.slots, state.values, state.clock, state.held, state.lights,
        state.phase_now, plan.bodies, plan.objects, state.on, state.station, roads.paths,
        roads.counts, roads.steps, roads.points, state.marks, state.along, roads.spans,
        roads.span_counts, roads.nodes, roads.cells, roads.cell_nodes, plan.clearances,
        plan.ranges, record.x, record.y, record.h, record.v, record.a, state.observed,
        state.present, plan.dt,
    )  # fmt: skip


@kernel
def look_ahead(p, k, scene):
    """Return (whether it is defined, the distance [m], time to collision [s] or headway [s]).

    Distances are absolute. A headway is defined for an entity that moves towards a target not
    behind it, a time to collision for one that approaches it.
    """
    kind, e, other = scene.probes[p, PROBE], scene.probes[p, WHO], scene.probes[p, OTHER]
    measure, free = scene.probes[p, MEASURE], scene.probes[p, BOXES] == 1
    x, y, h, v = scene.x[e, k], scene.y[e, k], scene.h[e, k], scene.v[e, k]
    own = scene.bodies[e]
    if other >= 0:
        ox, oy, oh, w = (
            scene.x[other, k],
            scene.y[other, k],
            scene.h[other, k],
            scene.v[other, k],
        )
        length, width, ahead = (
            scene.bodies[other, 0],
            scene.bodies[other, 1],
            scene.bodies[other, 2],
        )
    else:
        at = scene.marks if other == AT_MARK else scene.points
        ox, oy = at[scene.probes[p, PLACE], 0], at[scene.probes[p, PLACE], 1]
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
        path = scene.on[e]
        if scene.probes[p, SYSTEM] != ENTITY_SYSTEM and path >= 0:
            along, aside, turn, other_turn = along_path(
                scene.paths[path], scene.counts[path], scene.steps[path], scene.station[e],
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
        return v > 0.0 and gap >= 0.0, gap / max(v, 1e-9)
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
