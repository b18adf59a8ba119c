"""From the paths of a compiled storyboard to the roads: which lanes, and where they run."""

import math
from collections.abc import Sequence

import numpy as np

from bridgegen.arrays import Float
from bridgegen.errors import InputError
from bridgegen.openx.opendrive.lanes import lane_pose, section_index
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.routes import Route, Stretch, next_stretches, plan_route
from bridgegen.openx.openscenario.values import Expr, ParameterRef, Value
from bridgegen.simulation.embedded.program import (
    AlongLanes,
    AlongTrajectory,
    BesideLanes,
    LanePoint,
    Point,
    Program,
)
from bridgegen.simulation.embedded.trajectories import STEP, Corner, polyline, timetable

_MOST_STRETCHES = 1000


class Ways:
    """The paths of a storyboard on one road network.

    Attributes:
        tables: per path its samples: x, y [m], heading [rad], its cosine and sine, curvature
            [1/m].
        steps: per path the distance between two samples [m].
        station: per path a, b: who starts at s on the first road starts a + b·s along it.
        tracks: per entity with a timetable its ``(T, 6)`` states (``trajectories.timetable``).
        sides: per path 1 where it leads along its first road, -1 against it; 0 on a trajectory.

    Raises:
        InputError: a position that is not on a road, or a way that no lane leads along.
    """

    def __init__(self, program: Program, model: OpenDrive) -> None:
        self._program, self._model = program, model
        self._routes: list[Route | None] = []
        self.tables: list[Float] = []
        self.steps: list[float] = []
        self.station: list[tuple[float, float]] = []
        self.sides: list[int] = []
        self.tracks: list[Float] = []
        for number, spec in enumerate(program.paths):
            who = f"route of '{program.owner(number)}'"
            if isinstance(spec, BesideLanes):
                who = f"lane change of '{program.owner(number)}'"
            try:
                if isinstance(spec, AlongTrajectory):
                    self._add_trajectory(spec)
                elif isinstance(spec, AlongLanes):
                    route = self._along(spec)
                    start = _known(program, spec.start)
                    self.sides.append(model.road(spec.start.road).direction(spec.start.lane))
                    # the ego's driver keeps to a path beside the lane's; the others' offsets are
                    # added as they are run, whether rows vary them or not
                    own = spec.aside if number == 0 and isinstance(spec.aside, float) else 0.0
                    self._add(route, route.station(*start), own * self.sides[-1])
                else:
                    self.sides.append(0)
                    self._add(self._beside(spec), (0.0, 0.0), 0.0)
            except InputError as error:
                raise InputError(f"{program.place}: {who}: {error}") from None

    def _add(self, route: Route, station: tuple[float, float], aside: float) -> None:
        table, step = _sampled(route)
        if aside != 0.0:
            table = _shifted(table, aside)
        self._routes.append(route)
        self.tables.append(table)
        self.steps.append(step)
        self.station.append(station)

    def _along(self, spec: AlongLanes) -> Route:
        """Plan from where the start's road is entered to where the last waypoint's road is left.

        Without a route, an entity goes on along its lane as long as there is one way only.
        """
        start, waypoints = spec.start, list(spec.via)
        if not waypoints:
            return self._onward(start.road, start.lane, _known(self._program, start)[1])
        while waypoints and (waypoints[0].road, waypoints[0].lane) == (start.road, start.lane):
            del waypoints[0]
        last = waypoints[-1] if waypoints else start
        via = [_place(self._program, point) for point in waypoints[:-1]]
        first = _end(self._model, start.road, start.lane, entry=True)
        return plan_route(
            self._model, first, via, _end(self._model, last.road, last.lane, entry=False)
        )

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

    def _beside(self, spec: BesideLanes) -> Route:
        """Return the way along the lane beside another path's, from where there is one."""
        base = self._routes[spec.of]
        if base is None:
            raise InputError("a lane change starts from a lane, not from a trajectory")
        for step in base.steps:
            road = self._model.road(step.road_id)
            section = road.sections[section_index(road, 0.5 * (step.s + step.s_end))]
            forward = road.direction(step.lane_id) > 0
            wanted = spec.lane
            if spec.lanes is not None:
                wanted = step.lane_id + (spec.lanes if forward else -spec.lanes)
            lane = section.lane(wanted) if wanted else None
            if lane is None or not lane.drivable or lane.id == step.lane_id:
                continue
            if (road.direction(lane.id) > 0) == forward:
                return self._onward(step.road_id, lane.id, step.s)
        which = str(spec.lane)
        if spec.lanes is not None:
            which = f"{abs(spec.lanes)} to the {'left' if spec.lanes > 0 else 'right'}"
        line = f" (line {spec.line})" if spec.line else ""
        raise InputError(f"there is no lane {which} to change to{line}")

    def _add_trajectory(self, spec: AlongTrajectory) -> None:
        corners = [_corner(self._program, self._model, point) for point in spec.points]
        table, step = polyline(corners, may_stand=bool(spec.times))
        self._routes.append(None)
        self.tables.append(table)
        self.steps.append(step)
        self.station.append((0.0, 0.0))
        self.sides.append(0)
        if spec.times:
            instants = np.arange(self._program.n_steps, dtype=np.float64) * self._program.time_step
            self.tracks.append(timetable(corners, spec.times, instants))


def position(program: Program, model: OpenDrive, point: LanePoint) -> tuple[float, float]:
    """Return where a condition's point is [m].

    Raises:
        InputError: it is not on a road.
    """
    road, s = _known(program, point)
    pose = lane_pose(model.road(road), point.lane, s)
    return pose.x, pose.y


def _corner(program: Program, model: OpenDrive, point: Point) -> Corner:
    if not isinstance(point, LanePoint):
        return point.x, point.y, point.h
    road_id, s = _known(program, point)
    road = model.road(road_id)
    pose = lane_pose(road, point.lane, s)
    aside = point.aside * road.direction(point.lane)  # its sign is the road's, the pose the lane's
    return pose.x - aside * math.sin(pose.h), pose.y + aside * math.cos(pose.h), None


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


def _sampled(route: Route) -> tuple[Float, float]:
    step = route.length / math.ceil(route.length / STEP)
    path = route.sample(step)
    columns = (path.x, path.y, path.h, np.cos(path.h), np.sin(path.h), path.curvature)
    return np.stack(columns, axis=1), step


def _shifted(table: Float, aside: float) -> Float:
    """Return a path that runs beside another one; its samples are where the other's are."""
    moved = table.copy()
    moved[:, 0] -= aside * table[:, 4]
    moved[:, 1] += aside * table[:, 3]
    return moved


def padded(tables: Sequence[Float], shape: tuple[int, int]) -> Float:
    """Return paths of several road networks as one array, ``(P, K, L, 6)``."""
    paths = np.zeros((*shape, max(len(table) for table in tables), 6))
    for index, table in enumerate(tables):
        paths[index // shape[1], index % shape[1], : len(table)] = table
    return paths
