"""The roads of a compiled storyboard: each entity's route as a path, on P road networks."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from bridgegen.arrays import Float, Int
from bridgegen.errors import InputError
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.routes import Route, plan_route
from bridgegen.openx.openscenario.values import Expr, ParameterRef
from bridgegen.simulation.embedded.program import LanePoint, Program

STEP = 0.2  # m, between two samples of a path: 0.6 mm from the arc in a bend of 8 m radius


@dataclass(frozen=True)
class Network:
    """P road networks as the rollout reads them.

    Attributes:
        paths: ``(P, E, L, 6)`` float64: x, y [m], heading [rad], its cosine and sine, curvature
            [1/m]; rows from ``counts`` on are padding.
        counts: ``(P, E)`` int64, samples of each path.
        steps: ``(P, E)`` float64 [m], between two samples.
        zones: ``(P, E, 5)`` float64: where the route of the ego meets that of each other; see
            ``bridgegen.ego._reference_kernels``.
        station: ``(P, E, 2)`` float64: an entity that starts at s on its road starts a + b·s along
            its path.
        points: ``(P, C, 2)`` float64 [m], the position that a condition names; 0 where none.
    """

    paths: Float
    counts: Int
    steps: Float
    zones: Float
    station: Float
    points: Float

    @property
    def n_networks(self) -> int:
        """P."""
        return len(self.paths)


def compile_network(program: Program, models: Sequence[OpenDrive]) -> Network:
    """Plan and sample every entity's route on every road network.

    Args:
        program: the storyboard.
        models: P road networks.

    Raises:
        InputError: a position that is not on a road, or a route that no lane leads along.
    """
    from bridgegen.ego._reference_kernels import find_zone  # numba is slow to import

    shape = (len(models), len(program.names))
    tables: list[Float] = []
    counts, steps = np.empty(shape, dtype=np.int64), np.empty(shape)
    station = np.empty((*shape, 2))
    points = np.zeros((len(models), len(program.conditions), 2))
    for p, model in enumerate(models):
        for e, name in enumerate(program.names):
            try:
                route = _route(program, model, e)
                station[p, e] = route.station(*_known(program, program.starts[e]))
            except InputError as error:
                raise InputError(f"{program.place}: route of '{name}': {error}") from None
            table, steps[p, e] = _sampled(route)
            counts[p, e] = len(table)
            tables.append(table)
        for c, point in enumerate(program.points):
            if point is not None:
                road, s = _known(program, point)
                pose = lane_pose(model.road(road), point.lane, s)
                points[p, c] = pose.x, pose.y
    paths = np.zeros((*shape, int(counts.max()), 6))
    for index, table in enumerate(tables):
        paths[index // shape[1], index % shape[1], : len(table)] = table
    zones = np.full((*shape, 5), np.inf)
    for p, e in product(range(shape[0]), range(1, shape[1])):
        find_zone(
            paths[p, 0], counts[p, 0], steps[p, 0], program.bodies[0],
            paths[p, e], counts[p, e], steps[p, e], program.bodies[e], zones[p, e],
        )  # fmt: skip
    return Network(paths, counts, steps, zones, station, points)


def _route(program: Program, model: OpenDrive, e: int) -> Route:
    """Plan from where the start's road is entered to where the last waypoint's road is left.

    Without a route, an entity has its own lane to the road's end.
    """
    start, waypoints = program.starts[e], list(program.routes[e])
    while waypoints and (waypoints[0].road, waypoints[0].lane) == (start.road, start.lane):
        del waypoints[0]
    last = waypoints[-1] if waypoints else start
    via = [_place(program, point) for point in waypoints[:-1]]
    return plan_route(model, _end(model, start, entry=True), via, _end(model, last, entry=False))


def _end(model: OpenDrive, point: LanePoint, *, entry: bool) -> tuple[str, int, float]:
    road = model.road(point.road)
    forward = road.direction(point.lane) > 0
    return point.road, point.lane, 0.0 if forward == entry else road.length


def _place(program: Program, point: LanePoint) -> tuple[str, int, float]:
    road, s = _known(program, point)
    return road, point.lane, s


def _known(program: Program, point: LanePoint) -> tuple[str, float]:
    """Return the point's road and its s by the declared values of the parameters."""
    if isinstance(point.s, ParameterRef | Expr):
        return point.road, float(point.s.resolve(program.parameters))
    return point.road, float(point.s)


def _sampled(route: Route) -> tuple[Float, float]:
    step = route.length / math.ceil(route.length / STEP)
    path = route.sample(step)
    columns = (path.x, path.y, path.h, np.cos(path.h), np.sin(path.h), path.curvature)
    return np.stack(columns, axis=1), step
