"""Evaluating a road's reference line: position, heading and curvature at any s.

Lines and arcs are closed formulas. A spiral is integrated by Gauss–Legendre quadrature, not by
Fresnel's functions, which divide by zero where both curvatures are equal; the error stays below
1e-12 of its length. Cubics are followed by arc length, because s is a length.

Source: ASAM OpenDRIVE 1.7, chapter 8 (geometry).
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.openx.opendrive.model import Road
from bridgegen.openx.opendrive.plan_view import Arc, Geometry, Line, ParamPoly3, Poly3, Spiral

TURN_LIMIT = 100.0
"""Largest change of heading within one geometry [rad]."""

STEEPEST = 10.0
"""Largest slope of a poly3 in its own frame."""

# Eight nodes, moved from [-1, 1] to [0, 1].
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2
_BLOCK = 4096


class Pose(NamedTuple):
    """Where a line is at one place.

    Attributes:
        x: [m].
        y: [m].
        h: heading [rad].
        curvature: [1/m], positive to the left.
    """

    x: float
    y: float
    h: float
    curvature: float


class Curve(NamedTuple):
    """A line at many places.

    Attributes:
        x: ``(P,)`` float64 [m].
        y: ``(P,)`` float64 [m].
        h: ``(P,)`` float64 [rad], continuous within one geometry.
        curvature: ``(P,)`` float64 [1/m].
        curvature_rate: ``(P,)`` float64 [1/m²], how the curvature changes along the line.
    """

    x: Float
    y: Float
    h: Float
    curvature: Float
    curvature_rate: Float


def pose(geometry: Geometry, u: float) -> Pose:
    """Return where a geometry is, ``u`` [m] after its start."""
    shape = geometry.shape
    if isinstance(shape, Line | Arc):
        curvature = shape.curvature if isinstance(shape, Arc) else 0.0
        x, y, h = along_arc(geometry.x, geometry.y, geometry.hdg, curvature, u)
        return Pose(x, y, h, curvature)
    curve = evaluate(geometry, np.array([u]))
    return Pose(float(curve.x[0]), float(curve.y[0]), float(curve.h[0]), float(curve.curvature[0]))


def along_arc(
    x: float, y: float, h: float, curvature: float, u: float
) -> tuple[float, float, float]:
    """Return x, y, h after ``u`` [m] along an arc from a pose; a line if ``curvature`` is 0."""
    half = 0.5 * curvature * u
    chord = u * elementary.sin(half) / half if half != 0.0 else u
    return (
        x + chord * elementary.cos(h + half),
        y + chord * elementary.sin(h + half),
        h + 2.0 * half,
    )


def evaluate(geometry: Geometry, u: Float) -> Curve:
    """Return a geometry at the distances ``u`` [m] from its start; ``(P,)`` float64."""
    shape = geometry.shape
    if isinstance(shape, Poly3 | ParamPoly3):
        return _cubic(geometry, u)
    zero = np.zeros_like(u)
    if isinstance(shape, Spiral):
        rate = (shape.curv_end - shape.curv_start) / geometry.length
        dx, dy = _spiral(shape.curv_start, rate, u)
        cos, sin = elementary.cos(geometry.hdg), elementary.sin(geometry.hdg)
        return Curve(
            geometry.x + cos * dx - sin * dy,
            geometry.y + sin * dx + cos * dy,
            geometry.hdg + u * (shape.curv_start + 0.5 * rate * u),
            shape.curv_start + rate * u,
            zero + rate,
        )
    curvature = shape.curvature if isinstance(shape, Arc) else 0.0
    half = 0.5 * curvature * u
    chord = u * np.sinc(half / math.pi)
    middle = geometry.hdg + half
    return Curve(
        geometry.x + chord * elementary.cos(middle),
        geometry.y + chord * elementary.sin(middle),
        middle + half,
        zero + curvature,
        zero,
    )


def geometry_index(road: Road, s: float) -> int:
    """Return which geometry of a road holds at ``s`` [m]: the last one that starts before it."""
    index = 0
    for index, geometry in enumerate(road.plan_view):
        if geometry.s > s:
            return max(index - 1, 0)
    return index


def reference_pose(road: Road, s: float) -> Pose:
    """Return where a road's reference line is at ``s`` [m]."""
    geometry = road.plan_view[geometry_index(road, s)]
    return pose(geometry, s - geometry.s)


def reference_line(road: Road, s: Float) -> Curve:
    """Return a road's reference line at many s [m], ascending or not; ``(P,)`` float64."""
    starts = np.array([geometry.s for geometry in road.plan_view])
    which = np.maximum(np.searchsorted(starts, s, side="right") - 1, 0)
    out = Curve(*(np.empty_like(s) for _ in Curve._fields))
    for index in np.unique(which):
        at = which == index
        item = road.plan_view[index]
        for target, values in zip(out, evaluate(item, s[at] - item.s), strict=True):
            target[at] = values
    return out


def stretch(geometry: Geometry) -> float:
    """Return the metres of line per metre of s: 1, but for a paramPoly3 of inexact length."""
    return _table(geometry).scale if isinstance(geometry.shape, ParamPoly3) else 1.0


def impossible_shape(geometry: Geometry) -> str | None:
    """Return what makes a geometry's shape impossible to follow, or None."""
    shape, length = geometry.shape, geometry.length
    if isinstance(shape, Poly3):
        table = _table(geometry)
        within = np.concatenate(([True], table.length[:-1] < length))
        steepest = float(np.max(_speed(table.u, table.v, table.p)[within]))
        if steepest > STEEPEST:
            return f"the poly3 must rise by ≤ {STEEPEST:g} m per metre, got {steepest:.6g}"
        return None
    if isinstance(shape, ParamPoly3):
        table = _table(geometry)
        true = float(table.length[-1])
        # The length may be inexact, and `scale` makes up for it; but twice or half as much is
        # another curve than the one that was meant.
        if not 0.5 * length < true < 2.0 * length:
            return f"length [m] must be the length of the paramPoly3, {true:.6g}, got {length:.6g}"
        slowest = float(np.min(_speed(table.u, table.v, table.p))) * float(table.p[-1]) / true
        if slowest < 1.0 / STEEPEST**2:
            return "the paramPoly3 must have a direction everywhere, got one that stops"
        return None
    if isinstance(shape, Spiral):
        turn = length * max(abs(shape.curv_start), abs(shape.curv_end))
    else:
        turn = length * abs(shape.curvature) if isinstance(shape, Arc) else 0.0
    # The panels of `_spiral` grow with the turn: without a limit a spiral of a stranger's file
    # costs any amount of time and memory.
    if turn > TURN_LIMIT:
        return f"length · curvature must be ≤ {TURN_LIMIT:g} rad, got {turn:.6g}"
    return None


# -- spirals -------------------------------------------------------------------------------------


def _spiral(curvature: float, rate: float, u: Float) -> tuple[Float, Float]:
    """Integrate cos and sin of the heading from 0 to each u."""
    dx, dy = np.empty_like(u), np.empty_like(u)
    if not len(u):
        return dx, dy
    far = float(np.max(np.abs(u)))
    turn = far * max(abs(curvature), abs(curvature + rate * far))
    panels = 1 + int(turn)
    # Each panel turns by about 1 rad at most, where eight nodes are exact to rounding.
    nodes = ((np.arange(panels)[:, None] + NODES) / panels).ravel()
    weights = np.tile(WEIGHTS / panels, panels)
    # In blocks, since points times nodes would be one large array on long spirals.
    block = max(1, _BLOCK * 8 // len(nodes))
    for first in range(0, len(u), block):
        part = u[first : first + block]
        v = part[:, None] * nodes
        heading = v * (curvature + 0.5 * rate * v)
        dx[first : first + block] = part * (elementary.cos(heading) * weights).sum(axis=1)
        dy[first : first + block] = part * (elementary.sin(heading) * weights).sum(axis=1)
    return dx, dy


# -- cubics --------------------------------------------------------------------------------------


class _ArcLength(NamedTuple):
    """The arc length of a cubic over its parameter, at nodes."""

    u: tuple[float, float, float, float]
    v: tuple[float, float, float, float]
    p: Float
    length: Float
    scale: float  # true arc length per metre of s


@lru_cache(maxsize=4096)
def _table(geometry: Geometry) -> _ArcLength:
    shape = geometry.shape
    if isinstance(shape, Poly3):
        u, v = (0.0, 1.0, 0.0, 0.0), (shape.a, shape.b, shape.c, shape.d)
        end = geometry.length  # the curve is at least as long as its u
    else:
        assert isinstance(shape, ParamPoly3)
        u = (shape.a_u, shape.b_u, shape.c_u, shape.d_u)
        v = (shape.a_v, shape.b_v, shape.c_v, shape.d_v)
        end = 1.0 if shape.p_range == "normalized" else geometry.length
    cells = max(16, min(4096, math.ceil(geometry.length)))
    p = np.linspace(0.0, end, cells + 1)
    lengths = integrate(lambda q: _speed(u, v, q), p[:-1], p[1:])
    length = np.concatenate(([0.0], np.cumsum(lengths)))
    # s of a poly3 is its arc length; a paramPoly3 ends at the end of p, whatever its length says.
    scale = 1.0 if isinstance(shape, Poly3) else float(length[-1]) / geometry.length
    return _ArcLength(u, v, p, length, scale)


def _cubic(geometry: Geometry, distance: Float) -> Curve:
    table = _table(geometry)
    u, v = table.u, table.v
    p = invert(lambda q: _speed(u, v, q), table.p, table.length, distance * table.scale)
    (x, dx, ddx, dddx), (y, dy, ddy, dddy) = _derivatives(u, p), _derivatives(v, p)
    square = dx * dx + dy * dy
    speed = np.sqrt(square)
    turn = dx * ddy - dy * ddx
    curvature = turn / (square * speed)
    rate = (dx * dddy - dy * dddx) / square**2 - 3.0 * turn * (dx * ddx + dy * ddy) / square**3
    cos, sin = elementary.cos(geometry.hdg), elementary.sin(geometry.hdg)
    h = geometry.hdg + elementary.atan2(dy, dx)
    return Curve(
        geometry.x + cos * x - sin * y,
        geometry.y + sin * x + cos * y,
        np.unwrap(h) if np.all(np.diff(distance) >= 0) else h,
        curvature,
        rate,
    )


def _speed(u: tuple[float, ...], v: tuple[float, ...], p: Float) -> Float:
    dx = u[1] + p * (2 * u[2] + p * 3 * u[3])
    dy = v[1] + p * (2 * v[2] + p * 3 * v[3])
    return elementary.hypot(dx, dy)


def _derivatives(c: tuple[float, ...], p: Float) -> tuple[Float, Float, Float, Float]:
    return (
        c[0] + p * (c[1] + p * (c[2] + p * c[3])),
        c[1] + p * (2 * c[2] + p * 3 * c[3]),
        2 * c[2] + p * 6 * c[3],
        np.full_like(p, 6 * c[3]),
    )


def integrate(rate: Callable[[Float], Float], low: Float, high: Float) -> Float:
    """Return the integrals of ``rate`` from each ``low`` to each ``high``; ``(P,)`` float64."""
    width = high - low
    points = low[:, None] + width[:, None] * NODES
    return np.asarray(width * (rate(points) * WEIGHTS).sum(axis=1))


def invert(rate: Callable[[Float], Float], p: Float, total: Float, wanted: Float) -> Float:
    """Return where the integral of ``rate`` from ``p[0]`` reaches each wanted value.

    Args:
        rate: positive.
        p: ``(K,)`` float64 nodes, ascending.
        total: ``(K,)`` float64, the integral up to each node.
        wanted: ``(P,)`` float64; beyond the last node the curve is continued.
    """
    cell = np.clip(np.searchsorted(total, wanted, side="right") - 1, 0, len(p) - 2)
    slope = (p[1:] - p[:-1]) / np.maximum(total[1:] - total[:-1], 1e-300)
    found = np.asarray(p[cell] + (wanted - total[cell]) * slope[cell])
    # A fixed number of steps, not a tolerance: the bits then depend on the place alone, and not on
    # what else is asked in the same call.
    for _ in range(3):  # Newton, from an error that is already small
        missing = wanted - total[cell] - integrate(rate, p[cell], found)
        found = found + missing / np.maximum(rate(found), 1e-12)
    return found
