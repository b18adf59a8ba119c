"""Clothoids and NURBS as lines to follow."""

import math
from collections.abc import Sequence

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.geometry import TURN_LIMIT, evaluate
from bridgegen.openx.opendrive.plan_view import Arc, Geometry, Line, Spiral
from bridgegen.openx.openscenario import model as osc
from bridgegen.simulation.embedded.compiler.tables import Tables
from bridgegen.simulation.embedded.program import Bend

# --- Clothoids: curvature that changes evenly along an arc ---
# Source: ASAM OpenSCENARIO XML 1.3, Clothoid and ClothoidSpline.


STEP = 0.2  # m, between two samples at most
SHORTEST = 1e-9  # m, a shorter bend is left out
LONGEST = 100_000.0  # m, a chain of clothoids


def bends(
    tables: Tables, line: osc.Clothoid | osc.ClothoidSpline
) -> tuple[osc.Position | None, tuple[Bend, ...], tuple[float | None, ...]]:
    """Return where a clothoid, or a chain of them, starts, its bends, and when to be at their ends.

    A chain may state no start: it starts where the entity is.

    Unsupported elements are reported to ``tables``. Rows may not vary it.
    """

    def number(element: osc.Clothoid | osc.ClothoidSplineSegment, name: str) -> float:
        words = name.split("_")
        shown = words[0] + "".join(word.capitalize() for word in words[1:])
        return tables.literal(element, shown, getattr(element, name) or 0.0)

    def time(value: object) -> float | None:
        return None if value is None else tables.declared(value)  # type: ignore[arg-type]

    if isinstance(line, osc.Clothoid):
        rate = "curvature_dot" if line.curvature_prime is None else "curvature_prime"
        length, first = number(line, "length"), number(line, "curvature")
        bend = Bend(first, first + number(line, rate) * length, length)
        return line.position, (bend,), (time(line.start_time), time(line.stop_time))
    found: list[Bend] = []
    times: list[float | None] = []
    for segment in line.segments:
        found.append(
            Bend(
                number(segment, "curvature_start"),
                number(segment, "curvature_end"),
                number(segment, "length"),
                number(segment, "h_offset"),
                starts=bool(found) and segment.position_start is not None,
            )
        )
        times.append(time(segment.time_start))
    return line.segments[0].position_start, tuple(found), (*times, time(line.time_end))


def sampled(
    x: float, y: float, h: float, line: Sequence[Bend], step: float = STEP
) -> tuple[Float, float]:
    """Return a chain of bends from a pose as a path, and its step [m], at most as long as asked.

    Returns:
        ``(L, 6)``: x, y [m], heading [rad], its cosine and sine, curvature [1/m].

    Raises:
        InputError: it has no length, or turns without end.
    """
    length = sum(bend.length for bend in line)
    if not 0.0 < length <= LONGEST:
        raise InputError(f"a clothoid must be 0 to {LONGEST:g} m long, got {length:g} m")
    step = length / math.ceil(length / step)
    s = np.arange(round(length / step) + 1) * step
    table = np.empty((len(s), 6))
    station = 0.0
    for bend in line:
        if bend.length <= SHORTEST:
            continue
        turn = bend.length * max(abs(bend.first), abs(bend.last))
        if not turn <= TURN_LIMIT:
            raise InputError(f"a clothoid must turn by at most {TURN_LIMIT:g} rad, got {turn:g}")
        geometry = Geometry(0.0, x, y, h + bend.kink, bend.length, _shape(bend))
        here = (s >= station - SHORTEST) & (s <= station + bend.length + SHORTEST)
        curve = evaluate(geometry, np.append(s[here] - station, bend.length))
        for column, values in enumerate((curve.x, curve.y, curve.h)):
            table[here, column] = values[:-1]
        table[here, 5] = curve.curvature[:-1]
        x, y, h = float(curve.x[-1]), float(curve.y[-1]), float(curve.h[-1])
        station += bend.length
    table[:, 3], table[:, 4] = elementary.cos(table[:, 2]), elementary.sin(table[:, 2])
    return table, step


def _shape(bend: Bend) -> Line | Arc | Spiral:
    if bend.first != bend.last:
        return Spiral(bend.first, bend.last)
    return Arc(bend.first) if bend.first else Line()


# --- NURBS: the weights by which control points give the points of a curve ---
# Source: Piegl, Tiller, The NURBS Book (2nd edition, Springer 1997), equations 2.5 and 4.1.


def basis(order: int, knots: Sequence[float], weights: Sequence[float], count: int) -> Float:
    """Return by which weights control points give points that are spread evenly over the knots.

    Args:
        order: degree plus 1.
        knots: as many as control points and the order together, not decreasing.
        weights: of the control points, > 0.
        count: of points, the two ends among them.

    Returns:
        ``(count, control points)`` float64; each row adds up to 1, or is NaN where the knots leave
        a gap.
    """
    knot, degree, n = np.asarray(knots, dtype=np.float64), order - 1, len(weights)
    u = np.linspace(knot[degree], knot[n], count)
    span = np.clip(np.searchsorted(knot, u, side="right") - 1, degree, n - 1)
    functions = np.zeros((count, len(knot) - 1))
    functions[np.arange(count), span] = 1.0
    for p in range(1, order):
        for i in range(len(knot) - 1 - p):
            rising, falling = knot[i + p] - knot[i], knot[i + p + 1] - knot[i + 1]
            left = (u - knot[i]) / rising * functions[:, i] if rising > 0.0 else 0.0
            right = (knot[i + p + 1] - u) / falling * functions[:, i + 1] if falling > 0.0 else 0.0
            functions[:, i] = left + right
    rational = functions[:, :n] * np.asarray(weights)
    with np.errstate(invalid="ignore"):
        made: Float = rational / rational.sum(axis=1, keepdims=True)
    return made
