"""Trajectories that are laid when they begin: some vertex depends on the row, or on entities.

What the same file and road network always give is a path instead (`trajectories`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.drivers._weather_columns import WEATHER
from bridgegen.drivers.kinds import NAMES
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import object_class_of
from bridgegen.openx.openscenario.declarations import ODD, SIREN
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Value
from bridgegen.scenario.weather import OF_THE_ROAD, column, read_limits
from bridgegen.simulation.embedded._codes import LAYOUT_WIDTH, RIGID, THROUGH, WEIGHTED
from bridgegen.simulation.embedded.compiler.curves import basis, bends, sampled
from bridgegen.simulation.embedded.compiler.positions import Positions, is_fixed
from bridgegen.simulation.embedded.compiler.tables import TRAILERS, Tables, table
from bridgegen.simulation.embedded.compiler.trajectories import check_times, filled, usable_times

UNTIMED = -1
SAMPLE = 1.0  # m, between the vertices of a clothoid that is laid: 1 mm off in a bend of 125 m
LEAST_SAMPLES, SAMPLES_PER_POINT = 64, 32  # vertices of a spline that is laid
MOST_VERTICES, MOST_POINTS, MOST_ORDER = 5_000, 500, 20
"""Largest numbers of vertices of a trajectory that is laid and of control points of a spline, and
the spline's largest order: they bound what rows keep, and how long the weights take."""


def is_laid(action: osc.FollowTrajectoryAction) -> bool:
    """Return whether a trajectory is known only when an entity begins to follow it."""
    line = action.trajectory_ref.trajectory.shape.shape
    if isinstance(line, osc.Nurbs):
        return True
    if isinstance(line, osc.Clothoid):
        return not is_fixed(line.position)
    if isinstance(line, osc.ClothoidSpline):
        first, *others = (segment.position_start for segment in line.segments)
        return first is None or not is_fixed(first) or any(others)
    timed = any(vertex.time is not None for vertex in line.vertices)
    return any(
        not is_fixed(vertex.position)
        or not _is_literal(vertex.time)
        or (not timed and _states_heading(vertex.position))
        for vertex in line.vertices
    )


@dataclass(frozen=True)
class _Drawn:
    """How a trajectory follows from places: rows of ``Program.anchors`` and of ``.shapes``."""

    kind: int
    anchors: list[tuple[int, int, int]]
    shape: Float | None = None


def gives_path(action: osc.FollowTrajectoryAction) -> bool:
    """Return whether a trajectory is a path on the road network once its numbers are known."""
    line = action.trajectory_ref.trajectory.shape.shape
    places: list[osc.Position | None]
    if isinstance(line, osc.Polyline):
        places = [vertex.position for vertex in line.vertices]
    elif isinstance(line, osc.Clothoid):
        places = [line.position]
    elif isinstance(line, osc.ClothoidSpline):
        if any(segment.position_start for segment in line.segments[1:]):
            return False
        places = [line.segments[0].position_start]
    else:
        return False
    return all(
        place is not None
        and isinstance(place.position, osc.WorldPosition | osc.LanePosition)
        and getattr(place.position, "orientation", None) is None
        for place in places
    )


class Layouts:
    """The trajectories that are laid when they begin.

    Args:
        tables: the compiler's; takes down what cannot be run.
        positions: takes the places that they name.
    """

    def __init__(self, tables: Tables, positions: Positions) -> None:
        self._tables, self._positions = tables, positions
        positions.layouts = self
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
        width = max((shape.shape[1] for shape in self._shapes), default=0)
        padded = [np.pad(shape, ((0, 0), (0, width - shape.shape[1]))) for shape in self._shapes]
        return np.concatenate(padded) if padded else np.empty((0, 0))

    def add(self, action: osc.FollowTrajectoryAction, entity: int) -> int:
        """Return the number of a trajectory's layout; what cannot be run is taken down."""
        trajectory = action.trajectory_ref.trajectory
        if trajectory.closed is not False:
            self._tables.unsupported(trajectory, 'a Trajectory with closed="true"')
        line, stated = trajectory.shape.shape, action.time_reference.reference
        timing = stated if isinstance(stated, osc.Timing) else None
        times: tuple[float, ...] = ()
        if isinstance(line, osc.Clothoid | osc.ClothoidSpline):
            if timing is not None:
                times = usable_times(self._tables, line, bends(self._tables, line)[2])
                timing = timing if times else None
        elif timing is not None and not _has_times(line):
            self._tables.note(line, "it states no times: followed at the entity's own speed")
            timing = None
        start = action.initial_distance_offset
        if timing is not None and start not in (None, 0.0):
            what = f'initialDistanceOffset="{start}" in a trajectory with times that is laid'
            self._tables.unsupported(action, what)
        return self._append(self._drawn(line, timing, entity, times), timing)

    def add_line(self, where: osc.TrajectoryPosition) -> int:
        """Return the number of the trajectory along which a position is; it is not followed."""
        line = where.trajectory_ref.trajectory.shape.shape
        lacks = ""
        if isinstance(line, osc.ClothoidSpline):
            first, *others = (segment.position_start for segment in line.segments)
            lacks = " with several starts" if any(others) else "" if first else " without a start"
        if isinstance(line, osc.Nurbs) or lacks:
            what = f"a TrajectoryPosition on a {type(line).__name__}{lacks}"
            self._tables.unsupported(where, what)
            return 0
        return self._append(self._drawn(line, None, 0), None)

    def _append(self, drawn: "_Drawn", timing: osc.Timing | None) -> int:
        """Add a row; lines along which its own places are have been added before."""
        first, begins = len(self._anchors), sum(map(len, self._shapes))
        self._anchors += drawn.anchors
        if drawn.shape is not None:
            self._shapes.append(drawn.shape)
        past = sum(map(len, self._shapes))
        slots = (
            self._tables.slot(1.0 if timing is None else timing.scale),
            self._tables.slot(0.0 if timing is None else timing.offset),
        )
        ends = (first, len(self._anchors), begins, past)
        self._rows.append((*ends, drawn.kind, int(timing is not None), *slots))
        return len(self._rows) - 1

    @property
    def most_vertices(self) -> int:
        """How many vertices the longest has."""
        return max((max(row[1] - row[0], row[3] - row[2]) for row in self._rows), default=0)

    def _drawn(
        self,
        line: osc.Polyline | osc.Clothoid | osc.ClothoidSpline | osc.Nurbs,
        timing: osc.Timing | None,
        entity: int,
        times: Sequence[float] = (),
    ) -> "_Drawn":
        if isinstance(line, osc.Polyline):
            return self._through(line, timing)
        if isinstance(line, osc.Nurbs):
            return self._weighted(line, timing)
        return self._rigid(line, times, entity)

    def _through(self, line: osc.Polyline, timing: osc.Timing | None) -> "_Drawn":
        """Return the vertices of straight lines."""
        if len(line.vertices) > MOST_VERTICES:
            what = f"a Polyline of {len(line.vertices)} vertices (at most {MOST_VERTICES})"
            self._tables.unsupported(line, what)
            return _Drawn(THROUGH, [])
        stated = [vertex.time for vertex in line.vertices]
        for vertex in line.vertices if timing is not None else ():
            if vertex.time is None:  # where it is, and so how far, is known when it begins
                what = "a Vertex without a time in a trajectory with times that depends on the row"
                self._tables.unsupported(vertex, what)
        if timing is not None and all(map(_is_literal, (*stated, timing.scale, timing.offset))):
            known = [math.nan if time is None else self._tables.declared(time) for time in stated]
            check_times(self._tables, timing, known, line.vertices)
        anchors = [
            (
                self._positions.add(vertex.position),
                UNTIMED if vertex.time is None else self._tables.slot(vertex.time),
                int(_states_heading(vertex.position)),
            )
            for vertex in line.vertices
        ]
        return _Drawn(THROUGH, anchors)

    def _rigid(
        self, line: osc.Clothoid | osc.ClothoidSpline, times: Sequence[float], entity: int
    ) -> "_Drawn":
        """Return bends from a start, the entity's own place where they state none."""
        origin, curve, _ = bends(self._tables, line)
        place = self._positions.add_own(entity) if origin is None else self._positions.add(origin)
        anchors = [(place, UNTIMED, 1)]
        if isinstance(line, osc.ClothoidSpline):
            others = (segment.position_start for segment in line.segments[1:])
            anchors += [(self._positions.add(other), UNTIMED, 1) for other in others if other]
        drawn = _Drawn(RIGID, anchors)
        length = sum(bend.length for bend in curve)
        if not 0.0 < length <= SAMPLE * (MOST_VERTICES - 1):
            self._tables.unsupported(line, f"a clothoid {length:g} m long")
            return drawn
        knots = np.cumsum([0.0, *(bend.length for bend in curve)])
        try:
            known = filled(times, knots) if times else []
        except InputError as error:
            self._tables.unsupported(line, str(error))
            return drawn
        begins = [0, *(k for k, bend in enumerate(curve) if bend.starts), len(curve)]
        parts: list[Float] = []
        for number, (first, past) in enumerate(pairwise(begins)):
            try:
                samples, step = sampled(0.0, 0.0, 0.0, curve[first:past], SAMPLE)
            except InputError as error:
                self._tables.unsupported(line, str(error))
                return drawn
            clock = np.zeros(len(samples))
            if times:
                clock = np.interp(knots[first] + np.arange(len(samples)) * step, knots, known)
            part = np.column_stack((samples[:, :3], clock, np.full(len(samples), float(number))))
            if times and past < len(curve):
                part = part[:-1]  # the next one starts then
            parts.append(part)
        return replace(drawn, shape=np.concatenate(parts))

    def _weighted(self, line: osc.Nurbs, timing: osc.Timing | None) -> "_Drawn":
        """Return a spline: its points are weighted means of its control points."""
        points = line.control_points
        if len(points) > MOST_POINTS:
            what = f"a Nurbs of {len(points)} control points (at most {MOST_POINTS})"
            self._tables.unsupported(line, what)
            return _Drawn(WEIGHTED, [])
        anchors = []
        for point in points:
            if timing is not None and point.time is None:
                self._tables.unsupported(point, "a ControlPoint without a time among such with")
            time = UNTIMED if point.time is None else self._tables.slot(point.time)
            anchors.append((self._positions.add(point.position), time, 0))
        literal = self._tables.literal
        order = int(literal(line, "order", line.order))
        weights = [
            literal(control_point, "weight", _or(control_point.weight, 1.0))
            for control_point in points
        ]
        knots = [literal(knot, "value", knot.value) for knot in line.knots]
        if problem := _knot_problem(order, len(points), knots, weights):
            self._tables.unsupported(line, f"a Nurbs {problem}")
            return _Drawn(WEIGHTED, anchors)
        count = min(max(LEAST_SAMPLES, SAMPLES_PER_POINT * len(points)), MOST_VERTICES)
        shares = basis(order, knots, weights, count)
        if not np.isfinite(shares).all():
            self._tables.unsupported(line, "a Nurbs whose knots leave a gap")
            return _Drawn(WEIGHTED, anchors)
        return _Drawn(WEIGHTED, anchors, shares)


def _has_times(line: osc.Polyline | osc.Nurbs) -> bool:
    """Return whether a line states any time."""
    points = line.vertices if isinstance(line, osc.Polyline) else line.control_points
    return any(point.time is not None for point in points)


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


# --- The bodies of entities: how large they are, what they can do, who tows whom ---


Body = osc.Vehicle | osc.Pedestrian | osc.MiscObject | osc.ExternalObjectReference

_STEEPEST = 1.5  # rad, a steering angle that is as good as a right angle

THINNEST = 0.001
"""The least length and width of a body [m]: files may state 0."""

WHEELBASE_SHARE = 0.61
"""Distance between the axles by a vehicle's length [1], where they state none: as that of the cars
in `bridgegen.scenario.named_models`."""


def kind(body: Body) -> int:
    """Return what an entity is, see `bridgegen.drivers.kinds`."""
    return NAMES.index(object_class_of(body).name)


def has_siren(body: Body) -> bool:
    """Return whether a body is an emergency vehicle whose blue light and siren are on."""
    if not isinstance(body, osc.Vehicle) or body.properties is None:
        return False
    return str(body.properties.get(SIREN)).lower() in ("on", "true", "1")


def limits_of(body: Body, place: str) -> Float:
    """Return the ``Program.limits`` that a vehicle states.

    Raises:
        InputError: they cannot be read.
    """
    properties = body.properties if isinstance(body, osc.Vehicle) else None
    text = properties.get(ODD) if properties else None
    rows: list[tuple[float, float, float, float]] = []
    if text is not None:
        try:
            limits = read_limits(str(text))
        except InputError as error:
            raise InputError(f"{place}: property {ODD} of the ego: {error}") from None
        for number, group in enumerate(limits):
            for each in group:
                is_road = each.name in OF_THE_ROAD
                at = WEATHER + OF_THE_ROAD.index(each.name) if is_road else column(each.name)
                rows.append((at, each.low, each.high, number))
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def wheelbase(tables: Tables, body: osc.Vehicle) -> float:
    """Return the distance between the axles [m]; 0 of a trailer with one axle.

    Of another vehicle that states none, the usual share of its length.
    """
    found = _apart(tables, body)
    if found > 0.0 or body.vehicle_category in TRAILERS:
        return found
    return WHEELBASE_SHARE * _extent(tables, body.bounding_box.dimensions, "length")


def _apart(tables: Tables, body: osc.Vehicle) -> float:
    """Return how far the front axle is ahead of the rear one as it is stated [m]."""
    rear, front = body.axles.rear, body.axles.front or body.axles.rear
    ahead = tables.literal(front, "positionX", front.position_x)
    return ahead - tables.literal(rear, "positionX", rear.position_x)


def _extent(tables: Tables, size: osc.Dimensions, name: str) -> float:
    """Return the length or the width of a box [m]; not 0, which has no distance to others."""
    return max(tables.literal(size, name, getattr(size, name)), THINNEST)


def measures(tables: Tables, body: Body) -> tuple[float, ...]:
    """Return a row of ``Program.bodies``; missing limits are infinite."""
    if isinstance(body, osc.ExternalObjectReference):
        tables.unsupported(body, "ExternalObjectReference")
        return (0.0,) * 8
    box = body.bounding_box
    height = tables.literal(box.dimensions, "height", box.dimensions.height)
    size = (
        _extent(tables, box.dimensions, "length"),
        _extent(tables, box.dimensions, "width"),
        tables.literal(box.center, "x", box.center.x),
    )
    if not isinstance(body, osc.Vehicle):
        return (*size, math.inf, math.inf, math.inf, math.inf, height)
    limits, axles = body.performance, body.axles
    front, distance = axles.front or axles.rear, wheelbase(tables, body)
    lock = tables.literal(front, "maxSteering", front.max_steering)
    bend = elementary.tan(min(lock, _STEEPEST)) / max(distance, 0.1)
    if distance <= 0.0 and body.vehicle_category in TRAILERS:
        bend = math.inf  # it has nothing to steer with, and goes where it is led
    elif _apart(tables, body) <= 0.0:
        tables.note(axles, f"no FrontAxle ahead of the RearAxle: taken as {distance:g} m ahead")
    return (
        *size,
        tables.literal(limits, "maxSpeed", limits.max_speed),
        tables.literal(limits, "maxAcceleration", limits.max_acceleration),
        tables.literal(limits, "maxDeceleration", limits.max_deceleration),
        bend,
        height,
    )


# --- Who tows whom: the couplings of vehicles at the start, and those that actions make ---


SHORTEST = 0.1
"""The least distance from a trailer's coupler to its axle [m]: a shorter one has no direction."""


class Towing:
    """The vehicles that tow, and their trailers.

    Attributes:
        towers: ``(E,)`` which vehicle tows each entity at the start; -1: none.

    Args:
        tables: the compiler's; takes down couplings that cannot be.
    """

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self.towers: Int = np.full(len(tables.objects), -1, dtype=np.int64)
        self._pairs: dict[tuple[int, int], None] = {}

    def compile(self) -> None:
        """Take down who tows whom at the start."""
        for tower, obj in enumerate(self._tables.objects):
            vehicle = obj.entity_object
            if not isinstance(vehicle, osc.Vehicle) or vehicle.trailer is None:
                continue
            named = vehicle.trailer.trailer
            assert isinstance(named, osc.EntityRef)  # see `with_trailers_apart`
            towed = self._tables.entity(named.entity_ref)
            if self.towers[towed] >= 0:
                name = self._tables.names[towed]
                self._tables.unsupported(vehicle.trailer, f"a second vehicle that tows '{name}'")
            elif self.takes(vehicle.trailer, tower, towed):
                self.towers[towed] = tower

    def takes(self, element: Element, tower: int, towed: int) -> bool:
        """Return whether a vehicle can tow another one; it is noted that it may.

        Args:
            element: that says so.
            tower: the entity that tows.
            towed: the trailer.
        """
        names = self._tables.names
        front, rear = (self._tables.objects[e].entity_object for e in (tower, towed))
        problem = ""
        if not isinstance(front, osc.Vehicle) or front.trailer_hitch is None:
            problem = f"a trailer behind '{names[tower]}', which has no TrailerHitch,"
        elif not isinstance(rear, osc.Vehicle) or rear.trailer_coupler is None:
            problem = f"the trailer '{names[towed]}', which has no TrailerCoupler,"
        elif self._tables.literal(rear, "dx", rear.trailer_coupler.dx) < SHORTEST:
            problem = f"a TrailerCoupler less than {SHORTEST} m ahead of its axle"
        elif towed == 0:
            problem = "an ego that is towed"
        elif tower in self._behind(towed):
            problem = f"'{names[towed]}' as a trailer of itself"
        if problem:
            self._tables.unsupported(element, problem)
            return False
        self._pairs[tower, towed] = None
        return True

    def _behind(self, e: int) -> set[int]:
        """Return an entity, and all that it may tow."""
        found, left = {e}, [e]
        while left:
            now = left.pop()
            more = {towed for tower, towed in self._pairs if tower == now} - found
            found |= more
            left += sorted(more)
        return found

    def tows(self) -> Int:
        """Return who may tow whom, ``(W, 2)``: each vehicle behind what it is towed by."""
        left, found = list(self._pairs), list[tuple[int, int]]()
        while left:
            later = {towed for _, towed in left}
            ready = [pair for pair in left if pair[0] not in later]
            found += ready
            left = [pair for pair in left if pair not in ready]
        return table(found, 2)

    def couplings(self) -> Float:
        """Return where each entity tows and is towed, ``(E, 2)`` ahead of its reference [m]."""
        found = np.full((len(self._tables.objects), 2), math.nan)
        for e, obj in enumerate(self._tables.objects):
            vehicle = obj.entity_object
            if isinstance(vehicle, osc.Vehicle):
                for i, part in enumerate((vehicle.trailer_hitch, vehicle.trailer_coupler)):
                    if part is not None and self._pairs:
                        found[e, i] = self._tables.literal(part, "dx", part.dx)
        return found
