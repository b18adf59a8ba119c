"""Smooth curves from one ray to another: a line, line–arc–line, or two arcs.

Source of the two arcs: Bolton (1975), "Biarc curves", Computer-Aided Design 7(2), here with
equal tangent lengths at both ends.
"""

import math
from typing import NamedTuple

from bridgegen.base.errors import OntologyError
from bridgegen.openx.opendrive.geometry import along_arc
from bridgegen.openx.opendrive.plan_view import Arc, Geometry, Line

LEAST_RADIUS = 2.0
"""Tightest curve that is built [m]; below it even a small car must reverse."""

_SHORTEST = 1e-4
"""Lines shorter than this [m] are left out."""
_STRAIGHT = 1e-9
_ALMOST_PARALLEL = math.radians(1.0)
_LINE = Line()


class Ray(NamedTuple):
    """A point [m] and a heading [rad]."""

    x: float
    y: float
    h: float


def joining(start: Ray, end: Ray, what: str) -> tuple[Geometry, ...]:
    """Return the reference line that leaves along ``start`` and arrives along ``end``.

    Args:
        start: where and in which direction it begins.
        end: where and in which direction it ends.
        what: for the message.

    Raises:
        OntologyError: no such curve is wide enough for a car.
    """
    dx, dy = end.x - start.x, end.y - start.y
    cos, sin = math.cos(start.h), math.sin(start.h)
    ahead, aside = dx * cos + dy * sin, dy * cos - dx * sin
    turn = math.remainder(end.h - start.h, math.tau)
    bends = _bends(ahead, aside, turn)
    tightest = max(abs(curvature) for curvature, _ in bends)
    if tightest * LEAST_RADIUS > 1.0 or ahead <= 0.0:
        radius = f"a radius of {1.0 / tightest:.3g} m" if tightest else "none"
        raise OntologyError(
            f"{what} must have a radius ≥ {LEAST_RADIUS:g} m, got {radius}: "
            "has_size of the intersection [m] is too small for its legs"
        )
    found: list[Geometry] = []
    s, (x, y, h) = 0.0, start
    for curvature, length in bends:
        found.append(along(s, x, y, h, length, curvature))
        x, y, h = along_arc(x, y, h, curvature, length)
        s += length
    return tuple(found)


def along(s: float, x: float, y: float, h: float, length: float, curvature: float) -> Geometry:
    """Return a geometry: an arc, or a line where there is no curvature."""
    return Geometry(s, x, y, h, length, Arc(curvature) if curvature else _LINE)


def _bends(ahead: float, aside: float, turn: float) -> list[tuple[float, float]]:
    """Return (curvature [1/m], length [m]) of each part, in the frame of the start."""
    if abs(turn) < _STRAIGHT and abs(aside) < _STRAIGHT * max(1.0, abs(ahead)):
        return [(0.0, ahead)]
    if abs(turn) > _ALMOST_PARALLEL:
        # Both rays run through one corner, `before` ahead of the start, `after` behind the end.
        after = aside / math.sin(turn)
        before = ahead - after * math.cos(turn)
        tangent = min(before, after)
        if tangent > 0.0:
            radius = tangent / math.tan(0.5 * abs(turn))
            arc = (math.copysign(1.0 / radius, turn), radius * abs(turn))
            parts = [(0.0, before - tangent), arc, (0.0, after - tangent)]
            if radius >= LEAST_RADIUS:  # else the corner is next to one end of a slight bend
                return [part for part in parts if part[1] > _SHORTEST]
    return _two_arcs(ahead, aside, turn)


def _two_arcs(ahead: float, aside: float, turn: float) -> list[tuple[float, float]]:
    cos, sin = math.cos(turn), math.sin(turn)
    square = ahead * ahead + aside * aside
    along_both = ahead * (1.0 + cos) + aside * sin
    bend = 2.0 * (1.0 - cos)
    # The tangent length d solves bend·d² + 2·along_both·d = square; written so that bend may be 0.
    d = square / (along_both + math.sqrt(along_both * along_both + bend * square))
    joint = 0.5 * (ahead + d * (1.0 - cos)), 0.5 * (aside - d * sin)
    first = _arc_to(*joint)
    x, y = ahead - joint[0], aside - joint[1]
    heading = first[0] * first[1]
    cos, sin = math.cos(heading), math.sin(heading)
    return [first, _arc_to(x * cos + y * sin, y * cos - x * sin)]


def _arc_to(ahead: float, aside: float) -> tuple[float, float]:
    """Return the curvature and length of the arc that starts straight ahead and ends there."""
    chord = math.hypot(ahead, aside)
    half = math.atan2(aside, ahead)
    if abs(half) < _STRAIGHT:
        return 0.0, chord
    return 2.0 * math.sin(half) / chord, chord * half / math.sin(half)
