"""Trajectories that are laid when they begin: some vertex depends on the row, or on entities.

What the same file and road network always give is a path instead (`trajectories`).
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bridgegen.arrays import Float, Int
from bridgegen.errors import InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.values import Value
from bridgegen.simulation.embedded._codes import LAYOUT_WIDTH, RIGID, THROUGH, WEIGHTED
from bridgegen.simulation.embedded.compiler.clothoids import bends, sampled
from bridgegen.simulation.embedded.compiler.positions import Positions, is_fixed
from bridgegen.simulation.embedded.compiler.splines import basis
from bridgegen.simulation.embedded.compiler.tables import Tables, table
from bridgegen.simulation.embedded.compiler.trajectories import check_times

UNTIMED = -1
SAMPLE = 1.0  # m, between the vertices of a clothoid that is laid: 1 mm off in a bend of 125 m
LEAST_SAMPLES, SAMPLES_PER_POINT = 64, 32  # vertices of a spline that is laid
MOST_VERTICES, MOST_POINTS, MOST_ORDER = 5_000, 500, 20
"""How many vertices a trajectory that is laid may have, how many control points a spline, and its
order: what rows keep, and how long the weights take, is bounded."""


def is_laid(action: osc.FollowTrajectoryAction) -> bool:
    """Return whether a trajectory is known only when an entity begins to follow it."""
    line = action.trajectory_ref.trajectory.shape.shape
    if isinstance(line, osc.Nurbs):
        return True
    if isinstance(line, osc.Clothoid):
        return not is_fixed(line.position)
    if isinstance(line, osc.ClothoidSpline):
        start = line.segments[0].position_start
        return start is None or not is_fixed(start)
    timed = any(vertex.time is not None for vertex in line.vertices)
    return any(
        not is_fixed(vertex.position)
        or not _is_literal(vertex.time)
        or (not timed and _states_heading(vertex.position))
        for vertex in line.vertices
    )


class Layouts:
    """The trajectories that are laid when they begin.

    Args:
        tables: the compiler's; takes down what cannot be run.
        positions: takes the places that they name.
    """

    def __init__(self, tables: Tables, positions: Positions) -> None:
        self._tables, self._positions = tables, positions
        self._rows: list[tuple[int, ...]] = []
        self._anchors: list[tuple[int, int, int]] = []
        self._shapes: list[Float] = []

    @property
    def rows(self) -> Int:
        """As ``Program.layouts`` has them."""
        return table(self._rows, LAYOUT_WIDTH)

    @property
    def anchors(self) -> Int:
        """As ``Program.anchors`` has them."""
        return table(self._anchors, 3)

    @property
    def shapes(self) -> Float:
        """As ``Program.shapes`` has them."""
        width = max((one.shape[1] for one in self._shapes), default=0)
        padded = [np.pad(one, ((0, 0), (0, width - one.shape[1]))) for one in self._shapes]
        return np.concatenate(padded) if padded else np.empty((0, 0))

    def add(self, action: osc.FollowTrajectoryAction, entity: int) -> int:
        """Return the number of a trajectory's layout; what cannot be run is taken down."""
        trajectory = action.trajectory_ref.trajectory
        if trajectory.closed is not False:
            self._tables.unsupported(trajectory, 'a Trajectory with closed="true"')
        line, stated = trajectory.shape.shape, action.time_reference.reference
        timing = stated if isinstance(stated, osc.Timing) else None
        first, begins = len(self._anchors), sum(len(one) for one in self._shapes)
        if isinstance(line, osc.Polyline):
            kind = THROUGH
            timing = self._through(line, timing)
        elif isinstance(line, osc.Nurbs):
            kind = WEIGHTED
            timing = self._weighted(line, timing)
        else:
            kind = RIGID
            timing = self._rigid(line, timing, entity)
        past = sum(len(one) for one in self._shapes)
        scale: Value = 1.0 if timing is None else timing.scale
        offset: Value = 0.0 if timing is None else timing.offset
        start = action.initial_distance_offset
        if timing is not None and start not in (None, 0.0):
            what = f'initialDistanceOffset="{start}" in a trajectory with times'
            self._tables.unsupported(action, what)
        slots = (self._tables.slot(scale), self._tables.slot(offset))
        row = (first, len(self._anchors), begins, past, kind, int(timing is not None), *slots)
        self._rows.append(row)
        return len(self._rows) - 1

    @property
    def most_vertices(self) -> int:
        """How many vertices the longest has."""
        return max((max(row[1] - row[0], row[3] - row[2]) for row in self._rows), default=0)

    def _through(self, line: osc.Polyline, timing: osc.Timing | None) -> osc.Timing | None:
        """Add the vertices of straight lines; return their timing, None where none has a time."""
        if timing is not None and all(vertex.time is None for vertex in line.vertices):
            self._tables.note(line, "no vertex states a time: followed at the entity's own speed")
            timing = None
        if len(line.vertices) > MOST_VERTICES:
            what = f"a Polyline of {len(line.vertices)} vertices (at most {MOST_VERTICES})"
            self._tables.unsupported(line, what)
            return None
        stated = [vertex.time for vertex in line.vertices]
        if timing is not None and all(map(_is_literal, (*stated, timing.scale, timing.offset))):
            known = [None if time is None else self._tables.declared(time) for time in stated]
            check_times(self._tables, timing, known, line.vertices)
        for vertex in line.vertices:
            time = UNTIMED if vertex.time is None else self._tables.slot(vertex.time)
            place = self._positions.add(vertex.position)
            self._anchors.append((place, time, int(_states_heading(vertex.position))))
        return timing

    def _rigid(
        self, line: osc.Clothoid | osc.ClothoidSpline, timing: osc.Timing | None, entity: int
    ) -> osc.Timing | None:
        """Add bends from a start, the entity's own place where they state none."""
        origin, curve, ends = bends(self._tables, line)
        place = self._positions.add_own(entity) if origin is None else self._positions.add(origin)
        self._anchors.append((place, UNTIMED, 1))
        length = sum(bend.length for bend in curve)
        if not 0.0 < length <= SAMPLE * (MOST_VERTICES - 1):
            self._tables.unsupported(line, f"a clothoid {length:g} m long")
            return timing
        try:
            samples, step = sampled(0.0, 0.0, 0.0, curve, SAMPLE)
        except InputError as error:
            self._tables.unsupported(line, str(error))
            return timing
        knots = np.cumsum([0.0, *(bend.length for bend in curve)])
        times = np.zeros(len(samples))
        if timing is not None and all(time is None for time in ends):
            self._tables.note(line, "it states no times: followed at the entity's own speed")
            timing = None
        if timing is not None:
            if any(time is None for time in ends):
                self._tables.unsupported(line, "a clothoid with some of its times")
                return timing
            known = [time for time in ends if time is not None]
            times = np.interp(np.arange(len(samples)) * step, knots, known)
        self._shapes.append(np.column_stack((samples[:, :3], times)))
        return timing

    def _weighted(self, line: osc.Nurbs, timing: osc.Timing | None) -> osc.Timing | None:
        """Add a spline: its points are weighted means of its control points."""
        points = line.control_points
        if timing is not None and all(point.time is None for point in points):
            self._tables.note(line, "it states no times: followed at the entity's own speed")
            timing = None
        for point in points:
            if timing is not None and point.time is None:
                self._tables.unsupported(point, "a ControlPoint without a time among such with")
            time = UNTIMED if point.time is None else self._tables.slot(point.time)
            self._anchors.append((self._positions.add(point.position), time, 0))
        if len(points) > MOST_POINTS:
            what = f"a Nurbs of {len(points)} control points (at most {MOST_POINTS})"
            self._tables.unsupported(line, what)
            return None
        literal = self._tables.literal
        order = int(literal(line, "order", line.order))
        weights = [literal(one, "weight", _or(one.weight, 1.0)) for one in points]
        knots = [literal(one, "value", one.value) for one in line.knots]
        if problem := _knot_problem(order, len(points), knots, weights):
            self._tables.unsupported(line, f"a Nurbs {problem}")
            return None
        count = min(max(LEAST_SAMPLES, SAMPLES_PER_POINT * len(points)), MOST_VERTICES)
        self._shapes.append(basis(order, knots, weights, count))
        return timing


def _knot_problem(
    order: int, points: int, knots: Sequence[float], weights: Sequence[float]
) -> str | None:
    """Return what is wrong with a spline, if anything is."""
    if order > MOST_ORDER:
        return f"of order {order} (at most {MOST_ORDER})"
    if order > points:
        return f"of order {order} with {points} control points (order <= points must hold)"
    if len(knots) != points + order:
        return f"with {len(knots)} knots (it needs {points} control points + order {order})"
    if any(b < a for a, b in pairwise(knots)):
        return "whose knots decrease"
    if not knots[order - 1] < knots[points]:
        return "whose knots leave no curve"
    if not all(0.0 < weight < math.inf for weight in weights):
        return "whose weights are not all greater than 0"
    return None


def _or(value: Value | None, default: float) -> Value:
    return default if value is None else value


def _is_literal(value: Value | None) -> bool:
    return not isinstance(value, osc.ParameterRef | osc.Expr)


def _states_heading(position: osc.Position) -> bool:
    where = position.position
    if isinstance(where, osc.WorldPosition):
        return where.h is not None
    turned = getattr(where, "orientation", None)
    return turned is not None and turned.h is not None
