"""The ways of a compiled storyboard on one road network: planned beforehand, or on demand."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.drivers.drivers import STORYBOARD
from bridgegen.drivers.kinds import IS_CYCLE, IS_VEHICLE
from bridgegen.drivers.right_of_way import is_off_road
from bridgegen.drivers.scene import speed_limits
from bridgegen.openx.opendrive.lane_changes import (
    USUAL,
    Turning,
    coming,
    leads_round,
    passings,
    plan_with_changes,
    turnings,
)
from bridgegen.openx.opendrive.lane_graph import LaneGraph, Node
from bridgegen.openx.opendrive.lanes import lane_pose, section_index
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.routes import (
    Place,
    Route,
    Step,
    Stretch,
    leg,
    next_stretches,
    plan_route,
)
from bridgegen.openx.openscenario.values import Expr, ParameterRef, Value
from bridgegen.simulation.embedded.compiler import curves as clothoids
from bridgegen.simulation.embedded.compiler.trajectories import (
    Corner,
    begun,
    filled,
    polyline,
    timetable,
)
from bridgegen.simulation.embedded.places.lanes import Lanes, Path, sampled
from bridgegen.simulation.embedded.places.slopes import slopes
from bridgegen.simulation.embedded.program import (
    AlongLanes,
    AlongTrajectory,
    LaneCheck,
    LanePoint,
    Nowhere,
    Point,
    Program,
)

UNKNOWN, NONE = -1, -2  # in Ways.numbers: not asked for yet; there is no such way
ENDS, ASKS, LANDS = -1, -2, -3  # in Path.follows, see ``_travel_kernels``
LANES, GROUND = -1, -2  # asked for instead of a node, see ``_place_kernels``

CHANGE_TIME = 4.6
"""Duration of a lane change at the speed limit [s]; source: Toledo and Zohar, Transportation
Research Record 1999 (2007) 71-78, the mean."""

PASSES = 6
"""Number of waypoints of a route that passes something, see `leads_round`."""

SEES_BACK = 250.0
"""Length of the lane that a driver who wants to change to it looks back along [m]; ours."""

_MOST_STRETCHES = 1000
_NO_SPANS = np.empty((0, 11))
_NO_TIMES = np.empty((0, 10))


class Ways:
    """The paths of a storyboard on one road network.

    Attributes:
        paths: first those that the entities start on, then those that were asked for.
        routes: per entity the lanes that its first path leads along; None off the lanes.
        station: per entity a, b: who starts at s on the first road starts a + b·s along its path.
        uneven: entities of whom this holds only where the file places them, and whose place may be
            varied; with the road.
        sides: per entity 1 where its path leads along its first road, -1 against it; 0 on a
            trajectory.
        off_road: ``(E,)``: 1 of who drives and is beside the road at the start.
        timetables: per trajectory ``trajectories.timetable``, without rows if it has no times.
        spots: ``(C, 5)`` per position of the file: number of its road, lane, s, left of its centre,
            the way from which headings count; see `Lanes.locate`.
        lanes: the lanes of the road network, None while nobody has asked for them.
        has_ground: whether somebody has asked where all of them are.
        numbers: ``(R + 1, S)`` int64, the path of a route from a node on; route 0 is no route.
        turnings: where the ego's route changes lanes in a stated stretch, its ways by where it
            begins to, by the numbers of their paths; the first is its first path.
        changes: ``(V, 8)`` the same as kernels read it, see ``_gap_kernels``.

    Raises:
        InputError: a position that is not on a road, or a way that no lane leads along.
    """

    def __init__(self, program: Program, model: OpenDrive) -> None:
        self._program, self._model = program, model
        self.routes: list[Route | None] = []
        self.paths: list[Path] = []
        self.station: list[tuple[float, float]] = []
        self.uneven: dict[int, str] = {}
        self.sides: list[int] = []
        self.timetables: list[Float] = []
        self.off_road: Int = np.array([*map(self._comes_from_off_road, range(len(program.names)))])
        self.lanes: Lanes | None = None
        self.has_ground = False
        self.numbers: Int = np.empty((len(program.waypoints) + 1, 0), dtype=np.int64)
        self.turnings: dict[int, Turning] = {}
        self._turnings: list[Turning] = []
        self.changes = np.empty((0, 8))
        for number, spec in enumerate(program.paths):
            try:
                if isinstance(spec, AlongTrajectory):
                    self._add_trajectory(spec)
                elif isinstance(spec, Nowhere):
                    self._add_line(polyline([(0.0, 0.0, 0.0)], may_stand=True), ENDS)
                else:
                    self._add_lanes(number, spec)
            except InputError as error:
                who = f"trajectory {number - len(program.names)}"
                if number < len(program.names):
                    who = f"route of '{program.names[number]}'"
                raise InputError(f"{program.place}: {who}: {error}") from None
        self._add_turnings()
        self.spots = np.full((len(program.spots), 5), np.nan)
        if len(program.laterals) or len(program.spots) or program.looks_at_lanes:
            self.plan(0, LANES)
            self._check_lane_changes()
            self._find_spots()

    def plan(self, route: int, node: int) -> None:
        """Plan what a row has asked for; see ``ask`` in ``_place_kernels``."""
        if node < 0:
            self._learn_lanes()
            self.has_ground = self.has_ground or node == GROUND
            return
        assert self.lanes is not None
        if self.numbers[route, node] == UNKNOWN:
            path = self.lanes.plan(route, node)
            self.numbers[route, node] = NONE if path is None else len(self.paths)
            if path is not None:
                self.paths.append(path)

    def _comes_from_off_road(self, entity: int) -> bool:
        spec, kind = self._program.paths[entity], self._program.kinds[entity]
        if not isinstance(spec, AlongLanes) or not (IS_VEHICLE[kind] or IS_CYCLE[kind]):
            return False
        road_id, s = _known(self._program, spec.start)
        road = self._model.road(road_id)
        aside = _declared(self._program, spec.aside)
        return is_off_road(road, spec.start.lane, min(max(s, 0.0), road.length), aside)

    def is_in_junction(self, road_id: str) -> bool:
        """Return whether a road of the network is part of a junction."""
        return self._model.road(road_id).is_connecting

    def _learn_lanes(self) -> None:
        """Make the tables of all lanes, and tell which ones the known paths lead along."""
        if self.lanes is not None:
            return
        program = self._program
        self.lanes = lanes = Lanes(self._model)
        for spots in program.waypoints:
            lanes.add_route(spots)
        self.numbers = np.full((len(lanes.ways), len(lanes.nodes)), UNKNOWN)
        turnings = ((i, turning.route) for i, turning in self.turnings.items())
        for i, route in (*enumerate(self.routes), *turnings):
            if route is not None:
                chain = [lanes.graph.numbers[_node(self._model, step)] for step in route.steps]
                follows = int(lanes.graph.straight[chain[-1]])
                spans = lanes.spans(route, chain)
                self.paths[i] = self.paths[i]._replace(spans=spans, follows=follows)

    def _check_lane_changes(self) -> None:
        """Refuse what can be seen not to work: a lane that is nowhere beside an entity's way."""
        assert self.lanes is not None
        graph = self.lanes.graph
        reached: dict[int, list[int]] = {}
        for check in self._program.lane_checks:
            spans = self.paths[check.entity].spans
            known = spans[:, 4].astype(int).tolist()
            there = reached.setdefault(check.entity, list(dict.fromkeys(known)))
            targets = [
                target for number in there if (target := _target(graph, number, check)) is not None
            ]
            if there and not targets:
                which = str(check.lane)
                if check.lanes is not None:
                    which = f"{abs(check.lanes)} to the {'left' if check.lanes > 0 else 'right'}"
                line = f" (line {check.line})" if check.line else ""
                who = f"lane change of '{self._program.names[check.entity]}'"
                raise InputError(
                    f"{self._program.place}: {who}: there is no lane {which} to change to{line}"
                )
            onward = (node for target in targets for node in graph.onward(target))
            reached[check.entity] = list(dict.fromkeys([*there, *onward]))

    def _add_turnings(self) -> None:
        """Add the ways of an ego whose route changes lanes in a stated stretch, and the lane's."""
        found, program = self._turnings, self._program
        if not found:
            return
        for number, turning in enumerate(found):
            at = len(self.paths) if number else 0
            self.turnings[at] = turning
            if number:
                table, step = sampled(turning.route)
                rises = slopes(self._model, turning.route, step, len(table))
                self.paths.append(Path(table, step, _NO_SPANS, self.paths[0].follows, rises))
        spec = program.paths[0]
        assert isinstance(spec, AlongLanes)
        by = Place(*_place(program, spec.via[2]))
        last = by if len(spec.via) == PASSES else Place(*_place(program, spec.via[3]))
        end = Place(*_end(self._model, last.road_id, last.lane_id, entry=False))
        target = len(self.paths)
        self._add_line(sampled(coming(self._model, by, end, SEES_BACK)), ENDS)
        for kept in (self.routes, self.station, self.sides):
            kept.pop()  # of entities and trajectories alone
        self.changes = np.array(
            [
                (
                    *(at, turning.begins, turning.length, turning.across, target),
                    *(turning.returns, turning.back, turning.against),
                )
                for at, turning in self.turnings.items()
            ]
        )

    def _add_lanes(self, number: int, spec: AlongLanes) -> None:
        if number == 0:
            self._turnings = self._find_turnings(spec)
        turns = number == 0 and len(self._turnings)
        route = self._turnings[0].route if turns else self._along(spec)
        side = self._model.road(spec.start.road).direction(spec.start.lane)
        table, step = sampled(route)
        # the ego's driver keeps to a path beside the lane's; the others' offsets are added as
        # they are run, whether rows vary them or not
        if number == 0 and self._program.aside_slots[0] < 0 and isinstance(spec.aside, float):
            table = _shifted(table, spec.aside * side)
        self.routes.append(route)
        last = _stretch(self._model, route.steps[-1])
        goes_on = next(next_stretches(self._model, last), None) is not None
        rises = slopes(self._model, route, step, len(table))
        self.paths.append(Path(table, step, _NO_SPANS, ASKS if goes_on else ENDS, rises))
        self.station.append(route.station(*_known(self._program, spec.start)))
        varies = isinstance(spec.start.s, ParameterRef | Expr)
        if varies and number < len(self._program.names) and not route.is_even(spec.start.road):
            self.uneven[number] = spec.start.road
        self.sides.append(side)

    def _find_turnings(self, spec: AlongLanes) -> list[Turning]:
        """Return where the ego's route may change lanes between two waypoints that are no ends."""
        if len(spec.via) not in (4, PASSES) or self._program.driver == STORYBOARD:
            return []
        _, *via, last = (Place(*_place(self._program, point)) for point in spec.via)
        begin, by = via[:2]
        passes = leads_round(self._model, [begin, *via, last])
        if not passes and (len(spec.via) == PASSES or self._leads(begin, by)):
            return []
        start = Place(*_end(self._model, spec.start.road, spec.start.lane, entry=True))
        end = Place(*_end(self._model, last.road_id, last.lane_id, entry=False))
        road = self._model.road(by.road_id)
        number = section_index(road, by.s)
        limit = float(speed_limits(road, number, by.lane_id, np.array([by.s]))[0])
        usual = USUAL if math.isinf(limit) else CHANGE_TIME * limit
        return (passings if passes else turnings)(self._model, [start, *via, end], usual)

    def _leads(self, start: Place, end: Place) -> bool:
        """Return whether lanes lead from one place to another."""
        try:
            leg(self._model, start, end)
        except InputError:
            return False
        return True

    def _along(self, spec: AlongLanes) -> Route:
        """Plan from where the start's road is entered to where the last waypoint's road is left.

        Without a route, an entity goes straight on.
        """
        start, waypoints = spec.start, list(spec.via)
        places = [Place(*_place(self._program, point)) for point in waypoints]
        if leads_round(self._model, places):
            ends = (Place(*_end(self._model, *places[i][:2], entry=i == 0)) for i in (0, -1))
            return plan_with_changes(self._model, [next(ends), *places[1:-1], next(ends)])
        if not waypoints:
            return self._onward(start.road, start.lane, _known(self._program, start)[1])
        while waypoints and (waypoints[0].road, waypoints[0].lane) == (start.road, start.lane):
            del waypoints[0]
        last = waypoints[-1] if waypoints else start
        via = [_place(self._program, point) for point in waypoints[:-1]]
        first = _end(self._model, start.road, start.lane, entry=True)
        end = _end(self._model, last.road, last.lane, entry=False)
        try:
            return plan_route(self._model, first, via, end)
        except InputError:
            # One changes lane after the start, and before the places that are passed.
            points = [_place(self._program, waypoint) for waypoint in (start, *waypoints)]
            return plan_with_changes(self._model, [first, *points, end])

    def _onward(self, road_id: str, lane_id: int, s: float) -> Route:
        """Return the way from the start of a road along a lane, up to the first fork or the end."""
        model = self._model
        road = model.road(road_id)
        stretch = Stretch(road_id, section_index(road, min(max(s, 0.0), road.length)), lane_id)
        last = stretch
        for _ in range(_MOST_STRETCHES):
            following = list(next_stretches(model, last))
            if len(following) != 1 or following[0] == stretch:
                break
            last = following[0]
        first = _end(model, road_id, lane_id, entry=True)
        if stretch.section not in (0, len(road.sections) - 1) or len(road.sections) > 1:
            first = (road_id, lane_id, s)  # its lane may not reach back to the road's end
        end = model.road(last.road_id)
        forward = end.direction(last.lane_id) > 0
        low, high = end.sections[last.section].s, end.length
        if last.section + 1 < len(end.sections):  # the lane ends on the road: its last place
            high = math.nextafter(end.sections[last.section + 1].s, low)
        return plan_route(model, first, [], (last.road_id, last.lane_id, high if forward else low))

    def _add_trajectory(self, spec: AlongTrajectory) -> None:
        corners = [_corner(self._program, self._model, point) for point in spec.points]
        if spec.bends:
            x, y, h = corners[0]
            line = clothoids.sampled(x, y, h or 0.0, spec.bends)
            corners = [(x, y, h) for x, y, h in line[0][:, :3].tolist()]
        else:
            line = polyline(corners, may_stand=bool(spec.times))
        times: Sequence[float] = spec.times
        if times:
            ahead = [bend.length for bend in spec.bends] or [
                elementary.hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(corners)
            ]
            knots = np.cumsum([0.0, *ahead])
            try:
                times = filled(times, knots)
            except InputError as error:
                raise InputError(f"line {spec.line}: {error}") from None
        if spec.bends and times:
            times = np.interp(np.arange(len(corners)) * line[1], knots, times).tolist()
        if times and spec.start:
            corners, times = begun(corners, times, spec.start)
        self.timetables.append(timetable(corners, times, spec.start) if times else _NO_TIMES)
        self._add_line(line, LANDS, spec.start)

    def _add_line(self, line: tuple[Float, float], follows: int, start: float = 0.0) -> None:
        self.routes.append(None)
        self.paths.append(Path(*line, _NO_SPANS, follows))
        table, step = line
        self.station.append((min(start, (len(table) - 1) * step), 0.0))
        self.sides.append(0)

    def _find_spots(self) -> None:
        """Find the positions of the file that do not depend on where entities are."""
        assert self.lanes is not None
        for row, spot in zip(self.spots, self._program.spots, strict=True):
            if spot is not None:
                try:
                    row[:] = self.lanes.locate(spot)
                except InputError as error:
                    place = f"{self._program.place}, line {spot.line}"
                    raise InputError(f"{place}: {error}") from None


def position(program: Program, model: OpenDrive, point: Point) -> tuple[float, float]:
    """Return where a condition's point is [m].

    Raises:
        InputError: it is not on a road.
    """
    return _corner(program, model, point)[:2]


def _target(graph: LaneGraph, node: int, check: LaneCheck) -> int | None:
    """Return the lane beside a node that a lane change leads to, if it is there."""
    own = graph.nodes[node]
    lane = check.lane
    if lane is None:
        assert check.lanes is not None
        lane = own.lane_id + check.lanes * own.way
        if lane == 0 or (lane > 0) != (own.lane_id > 0):  # there is no lane 0
            lane += int(math.copysign(1, check.lanes * own.way))
    return graph.in_section(node, lane)


def _corner(program: Program, model: OpenDrive, point: Point) -> Corner:
    if not isinstance(point, LanePoint):
        return point.x, point.y, point.h
    road_id, s = _known(program, point)
    road = model.road(road_id)
    pose = lane_pose(road, point.lane, s)
    side = road.direction(point.lane) if point.lane else 1
    aside = point.aside * side  # its sign is the road's, the pose the lane's
    return pose.x - aside * elementary.sin(pose.h), pose.y + aside * elementary.cos(pose.h), None


def _stretch(model: OpenDrive, step: Step) -> Stretch:
    road = model.road(step.road_id)
    return Stretch(step.road_id, section_index(road, 0.5 * (step.s + step.s_end)), step.lane_id)


def _node(model: OpenDrive, step: Step) -> Node:
    way = model.road(step.road_id).direction(step.lane_id)
    return Node(*_stretch(model, step), way)


def _end(model: OpenDrive, road_id: str, lane: int, *, entry: bool) -> tuple[str, int, float]:
    road = model.road(road_id)
    forward = road.direction(lane) > 0
    return road_id, lane, 0.0 if forward == entry else road.length


def _place(program: Program, point: LanePoint) -> tuple[str, int, float]:
    road, s = _known(program, point)
    return road, point.lane, s


def _known(program: Program, point: LanePoint) -> tuple[str, float]:
    """Return the point's road and its s by the declared values of the parameters."""
    return point.road, _declared(program, point.s)


def _declared(program: Program, value: Value) -> float:
    if isinstance(value, ParameterRef | Expr):
        return float(value.resolve(program.parameters))
    return float(value)


def _shifted(table: Float, aside: float) -> Float:
    """Return a path that runs beside another one; its samples are where the other's are."""
    moved = table.copy()
    moved[:, 0] -= aside * table[:, 4]
    moved[:, 1] += aside * table[:, 3]
    return moved


def padded(tables: Sequence[Sequence[Float]], width: int) -> Float:
    """Return K tables of each of P networks as one array, ``(P, K, L, width)``."""
    k = max(len(each) for each in tables)
    longest = max((len(table) for each in tables for table in each), default=0)
    whole = np.zeros((len(tables), k, longest, width))
    for p, each in enumerate(tables):
        for i, table in enumerate(each):
            whole[p, i, : len(table)] = table
    return whole
