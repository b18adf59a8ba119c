"""highway-env's IDMVehicle as a driver: IDM along the lane, MOBIL to change it, its own steering.

Its road is built of the lanes along the ego's route: a chain of edges between the nodes "0", "1" …,
the lanes of each numbered from left to right, as the authors' own roads are; straight ones are its
StraightLane, arcs its CircularLane, others its PolyLaneFixedWidth. Where a lane ends and the road
goes on, its Obstacle stands, as in the authors' merging road. The other participants are its
ControlledVehicle at the speed that they have, so that MOBIL can foresee how a follower brakes. They
and the ego have the 5 m of all vehicles of highway-env: its IDM measures from centre to centre.

The command is the acceleration of the body's centre and a steering angle δ. By highway-env's
kinematics the centre moves at the slip angle β = atan(tan(δ)/2) and turns by v·sin(β)/2.5 m; the
ego's centre follows the same curvature.

`export` makes these arrays of one row, over T instants, L lanes, M other participants:

- ``time_step`` [s];
- ``lane_edge`` ``(L,)`` int64, the edge of each lane; ``lane_kind`` ``(L,)`` int64: 0 straight,
  1 arc, 2 by points; ``lane_width`` ``(L,)`` [m]; ``lane_ends`` ``(L,)`` bool, whether an obstacle
  stands at its end;
- ``lane_arc`` ``(L, 6)``: centre's x and y, radius [m], first and last angle [rad], 1 if it grows;
- ``points`` ``(K, 2)`` [m] of all lanes, ``points_of`` ``(K,)`` int64, whose they are;
- ``speed_limit`` ``(T, L)`` [m/s], +inf for none; ``forbidden`` ``(T, L)`` bool, no change to it;
- ``ego`` ``(T, 5)``: the centre's x and y [m], heading [rad], speed and desired speed [m/s];
- ``others`` ``(T, M, 5)``: 1 if it is there, x, y [m], heading [rad], speed [m/s].

Source: E. Leurent, An Environment for Autonomous Driving Decision-Making, 2018,
github.com/Farama-Foundation/HighwayEnv; Treiber, Hennecke, Helbing, Phys. Rev. E 62 (2000) 1805;
Kesting, Treiber, Helbing, Transp. Res. Rec. 1999 (2007) 86.
"""

from collections.abc import Mapping, Sequence
from importlib import import_module
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from bridgegen.adapters.planners._corridor import Corridor, CorridorLane
from bridgegen.base.arrays import Bool, Float
from bridgegen.drivers.interface import Control, Observation, Scene
from bridgegen.drivers.planners import Planner, require

# --- The script that repeats a row with highway-env alone, for `highway_env` ---


SCRIPT = '''"""Prints what highway-env 1.12.1's IDMVehicle commands, by highway-env alone.

pip install highway-env==1.12.1
One line for each instant: acceleration [m/s2], steering angle [rad].
"""

import numpy as np
from highway_env.road.lane import CircularLane, PolyLaneFixedWidth, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.objects import Obstacle

data = dict(np.load(OBSERVATIONS))

network, lanes = RoadNetwork(), []
for i, edge in enumerate(data["lane_edge"]):
    points, width = data["points"][data["points_of"] == i], float(data["lane_width"][i])
    if data["lane_kind"][i] == 0:
        lane = StraightLane(points[0], points[1], width)
    elif data["lane_kind"][i] == 1:
        x, y, radius, first, last, grows = data["lane_arc"][i]
        lane = CircularLane([x, y], radius, first, last, bool(grows), width)
    else:
        lane = PolyLaneFixedWidth(points, width)
    network.add_lane(str(edge), str(edge + 1), lane)
    lanes.append(lane)
road = Road(network, neighbour_vehicles_connected_lanes=True)
for lane, ends in zip(lanes, data["lane_ends"]):
    if ends:
        road.objects.append(Obstacle(road, lane.position(lane.length, 0)))


def place(vehicle, state):
    vehicle.position, vehicle.heading, vehicle.speed = state[:2], state[2], state[3]
    vehicle.on_state_update()


ego, others = None, {}
for t, state in enumerate(data["ego"]):
    for lane, limit, forbidden in zip(lanes, data["speed_limit"][t], data["forbidden"][t]):
        lane.speed_limit, lane.forbidden = (limit if np.isfinite(limit) else None), forbidden
    if ego is None:
        ego = IDMVehicle(road, state[:2], state[2], state[3])
    road.vehicles = [ego]
    for j, (there, *of) in enumerate(data["others"][t]):
        if there:
            if j not in others:
                others[j] = ControlledVehicle(road, of[:2], of[2], of[3])
            place(others[j], np.array(of))
            others[j].target_speed = of[3]
            others[j].target_lane_index = others[j].lane_index
            road.vehicles.append(others[j])
    place(ego, state)
    ego.target_speed = state[4]
    ego.act()
    ego.timer += float(data["time_step"])
    print(repr(float(ego.action["acceleration"])), repr(float(ego.action["steering"])))
'''


PLANNER = Planner(
    name="highway-env-idm-mobil",
    description="highway-env's IDMVehicle: IDM, MOBIL and its steering, all its own.",
    spec="bridgegen.adapters.planners.highway_env:HighwayEnvDriver",
    requires=("highway-env==1.12.1",),
    licence="MIT",
    source="https://github.com/Farama-Foundation/HighwayEnv",
    domain=frozenset({"motorway"}),
)

STRAIGHT, ARC, POINTS = range(3)
"""Geometries of a lane: straight line, circular arc, polyline."""

STRAIGHT_WITHIN, ARC_WITHIN = 1e-3, 1e-2
"""Largest deviation of a lane's points from a straight line, and from an arc [m]."""

SHORT = 2.0
"""Least distance between a lane's ends [m]; highway-env's lanes by points need a metre or more."""

HALF_LENGTH = 2.5
"""Distance from the centre of highway-env's vehicle to each axle [m]: its ``LENGTH / 2``."""

Arrays = dict[str, npt.NDArray[Any]]


class HighwayEnvDriver:
    """Drives each row by an IDMVehicle on a road of its own.

    Raises:
        InputError: highway-env is not installed, or in another version.
    """

    wants = ("map",)
    # Defaults are those of highway-env, which states no ranges: these are ours, and hold what
    # Treiber (2000) and Kesting (2007) use.
    tunable: ClassVar = {
        "TIME_WANTED": (1.5, 0.8, 3.0, "s"),
        "DISTANCE_WANTED": (10.0, 6.0, 20.0, "m"),
        "COMFORT_ACC_MAX": (3.0, 0.5, 4.0, "m/s²"),
        "COMFORT_ACC_MIN": (-5.0, -6.0, -1.0, "m/s²"),
        "POLITENESS": (0.0, 0.0, 1.0),
        "LANE_CHANGE_MIN_ACC_GAIN": (0.2, 0.1, 1.0, "m/s²"),
        "LANE_CHANGE_MAX_BRAKING_IMPOSED": (2.0, 0.5, 4.0, "m/s²"),
    }
    settings: Mapping[str, float] = MappingProxyType({})

    def __init__(self) -> None:
        require(PLANNER)
        import_module("highway_env.vehicle.behavior")  # seconds that no call's limit has

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`."""
        self._rows: list[_Row | None] = [None] * n
        self._inputs = [_Inputs(scene, Corridor(road)) for road in scene.maps]
        self._scene = scene

    def act(self, observation: Observation) -> Control:
        """See `BatchDriver`."""
        commands = np.zeros((len(observation.x), 2))
        for i in np.flatnonzero(observation.running):
            inputs = self._inputs[self._scene.map_of[i]]
            seen = inputs.of(observation, i)
            row = self._rows[i]
            if row is None:
                row = _Row(inputs.road, self._scene.time_step, self.settings)
                self._rows[i] = row
            commands[i] = row.act(*seen)
        return Control(commands[:, 0], rear_curvature(commands[:, 1], self._scene.centre))


def rear_curvature(steering: Float, centre: float) -> Float:
    """Return the curvature [1/m] of the rear axle's path for highway-env's steering angles [rad].

    Args:
        steering: at its front axle.
        centre: of our body, ahead of the rear axle [m]; there the paths' curvatures are equal.
    """
    of_centre = np.sin(np.arctan(0.5 * np.tan(steering))) / HALF_LENGTH
    return np.asarray(of_centre / np.sqrt(np.maximum(1.0 - (centre * of_centre) ** 2, 1e-6)))


def export(observations: Sequence[Observation], scene: Scene) -> Arrays:
    """Return the planner's inputs in one row, see above.

    Args:
        observations: of that row alone, one for each instant.
        scene: of the batch that they are of.
    """
    inputs = _Inputs(scene, Corridor(scene.maps[scene.map_of[0]]))
    limits, forbidden, egos, others = zip(
        *(inputs.of(observation, 0) for observation in observations), strict=True
    )
    return inputs.road | {
        "time_step": np.array(scene.time_step),
        "speed_limit": np.stack(limits),
        "forbidden": np.stack(forbidden),
        "ego": np.stack(egos),
        "others": np.stack(others),
    }


def reproduction(observations_path: str) -> str:
    """Return a script that prints the planner's commands in an exported row, by highway-env alone.

    One line for each instant: acceleration [m/s²] and steering angle [rad].
    """
    return SCRIPT.replace("OBSERVATIONS", repr(observations_path))


class _Inputs:
    """What the planner is told of one road and of what is on it.

    Attributes:
        road: the arrays of its lanes, see above.
    """

    def __init__(self, scene: Scene, corridor: Corridor) -> None:
        self.road = road_arrays(corridor)
        self._centre = scene.centre
        self._corridor = corridor
        self._lanes = [
            (k, i, lane)
            for k, section in enumerate(corridor.sections)
            for i, lane in enumerate(section.lanes)
        ]

    def of(self, o: Observation, i: int) -> tuple[Float, Bool, Float, Float]:
        """Return speed limits, forbidden lanes, the ego and the others of row i, see above."""
        x = o.x[i] + self._centre * np.cos(o.h[i])
        y = o.y[i] + self._centre * np.sin(o.h[i])
        s, d, _ = (float(place[0]) for place in self._corridor.places(np.array([x]), np.array([y])))
        section = int(self._corridor.section_at(np.array([s]))[0])
        on, _ = self._corridor.lane_at(section, s, d)
        mine = self._corridor.sections[section].lanes[on]
        limits = np.array([lane.at(s)[2] for _, _, lane in self._lanes])
        forbidden = np.array(
            [k == section and not _may_change(mine, on, j) for k, j, _ in self._lanes]
        )
        tracks = o.tracks[i]
        there = tracks[:, 0] >= 2.0
        speed = tracks[:, 4] * np.cos(tracks[:, 3]) + tracks[:, 5] * np.sin(tracks[:, 3])
        others = np.column_stack([there, tracks[:, 1:4], speed])
        ego = np.array([x, y, o.h[i], o.v[i], o.target_speed[i]])
        return limits, forbidden, ego, np.where(there[:, None], others, 0.0)


def _may_change(lane: CorridorLane, on: int, to: int) -> bool:
    """Return whether the marking allows to change from one lane to another beside it."""
    return (to != on - 1 or lane.may_change_left) and (to != on + 1 or lane.may_change_right)


def road_arrays(corridor: Corridor) -> Arrays:
    """Return the lanes of a corridor as highway-env's, see above."""
    edges, kinds, widths, ends, arcs, points = [], [], [], [], [], []
    last = len(corridor.sections) - 1
    for k, section in enumerate(corridor.sections):
        for lane in section.lanes:
            straight = _is_straight(lane.centre)
            arc = None if straight else _arc(lane.centre)
            edges.append(k)
            kinds.append(STRAIGHT if straight else POINTS if arc is None else ARC)
            widths.append(float(lane.width.mean()))
            ends.append(lane.next < 0 and k < last)
            arcs.append(np.zeros(6) if arc is None else arc)
            points.append(lane.centre[[0, -1]] if straight else lane.centre)
    return {
        "lane_edge": np.array(edges),
        "lane_kind": np.array(kinds),
        "lane_width": np.array(widths),
        "lane_ends": np.array(ends),
        "lane_arc": np.array(arcs),
        "points": np.concatenate(points),
        "points_of": np.repeat(np.arange(len(points)), [len(point) for point in points]),
    }


def _is_straight(points: Float) -> bool:
    """Return whether points are on a straight line, or too near for a lane by points."""
    along = points[-1] - points[0]
    if np.hypot(*along) < SHORT:
        return True
    relative = points - points[0]
    aside = relative[:, 1] * along[0] - relative[:, 0] * along[1]
    return bool(np.abs(aside).max() <= STRAIGHT_WITHIN * np.hypot(*along))


def _arc(points: Float) -> Float | None:
    """Return centre, radius, first and last angle, and sense of the arc through points, if any."""
    if len(points) < 3:
        return None
    (ax, ay), (bx, by) = points[len(points) // 2] - points[0], points[-1] - points[0]
    twice = 2.0 * (ax * by - ay * bx)
    if twice == 0.0:
        return None
    a, b = ax * ax + ay * ay, bx * bx + by * by
    centre = points[0] + np.array([by * a - ay * b, ax * b - bx * a]) / twice
    radius = float(np.hypot(*(points[0] - centre)))
    if np.abs(np.hypot(*(points - centre).T) - radius).max() > ARC_WITHIN:
        return None
    angle = np.unwrap(np.arctan2(*(points - centre).T[::-1]))
    grows = angle[-1] > angle[0]
    # highway-env's CircularLane knows angles within half a turn of the first one only.
    if abs(angle[-1] - angle[0]) > 0.9 * np.pi:
        return None
    return np.array([*centre, radius, angle[0], angle[-1], grows])


class _Row:
    """The planner in one scenario: its road, its vehicles, and what it remembers."""

    def __init__(self, arrays: Arrays, time_step: float, settings: Mapping[str, float]) -> None:
        from highway_env.road.road import Road
        from highway_env.vehicle.objects import Obstacle

        network, self._lanes = _network(arrays)
        self._road = Road(network, neighbour_vehicles_connected_lanes=True)
        for lane, ends in zip(self._lanes, arrays["lane_ends"], strict=True):
            if ends:
                self._road.objects.append(Obstacle(self._road, lane.position(lane.length, 0)))
        self._time_step, self._settings = time_step, settings
        self._ego: Any = None
        self._others: dict[int, Any] = {}

    def act(self, limits: Float, forbidden: Bool, ego: Float, others: Float) -> tuple[float, float]:
        """Return acceleration [m/s²] and steering angle [rad] of the next instant."""
        from highway_env.vehicle.behavior import IDMVehicle
        from highway_env.vehicle.controller import ControlledVehicle

        for lane, limit, no in zip(self._lanes, limits, forbidden, strict=True):
            lane.speed_limit, lane.forbidden = (float(limit) if np.isfinite(limit) else None), no
        if self._ego is None:
            self._ego = IDMVehicle(self._road, ego[:2], float(ego[2]), float(ego[3]))
            vars(self._ego).update(self._settings)  # before those of its class
        there = []
        for j in np.flatnonzero(others[:, 0]).tolist():
            _, x, y, h, v = others[j].tolist()
            if j not in self._others:
                self._others[j] = ControlledVehicle(self._road, [x, y], h, v)
            other = self._others[j]
            _place(other, x, y, h, v)
            other.target_speed, other.target_lane_index = v, other.lane_index
            there.append(other)
        self._road.vehicles = [self._ego, *there]
        _place(self._ego, *ego[:4].tolist())
        self._ego.target_speed = float(ego[4])
        self._ego.act()
        self._ego.timer += self._time_step
        return float(self._ego.action["acceleration"]), float(self._ego.action["steering"])


def _place(vehicle: Any, x: float, y: float, h: float, v: float) -> None:
    vehicle.position, vehicle.heading, vehicle.speed = np.array([x, y]), h, v
    vehicle.on_state_update()


def _network(arrays: Arrays) -> tuple[Any, list[Any]]:
    """Return a RoadNetwork, and its lanes in the order of the arrays."""
    from highway_env.road.lane import CircularLane, PolyLaneFixedWidth, StraightLane
    from highway_env.road.road import RoadNetwork

    network, lanes = RoadNetwork(), []
    for i, (edge, kind) in enumerate(zip(arrays["lane_edge"], arrays["lane_kind"], strict=True)):
        points, width = arrays["points"][arrays["points_of"] == i], float(arrays["lane_width"][i])
        if kind == STRAIGHT:
            lane = StraightLane(points[0], points[1], width)
        elif kind == ARC:
            *centre, radius, first, last, grows = arrays["lane_arc"][i]
            lane = CircularLane(centre, radius, first, last, bool(grows), width)
        else:
            lane = PolyLaneFixedWidth(points, width)
            lane.curve.cartesian_to_frenet = _frenet(lane.curve)
        network.add_lane(str(edge), str(edge + 1), lane)
        lanes.append(lane)
    return network, lanes


def _frenet(curve: Any) -> Any:
    """Return what a LinearSpline2D's ``cartesian_to_frenet`` returns, without its loop."""
    origins = np.array([pose.position for pose in curve.poses])
    normals = np.array([pose.normal for pose in curve.poses])
    stations = np.asarray(curve.s_samples, dtype=np.float64)

    def cartesian_to_frenet(position: Float) -> tuple[float, float]:
        relative = np.asarray(position) - origins
        along = (relative * normals).sum(axis=1)
        behind = np.flatnonzero(along[1:] >= 0.0)
        k = int(behind[-1]) + 1 if len(behind) else 0
        left = normals[k, 0] * relative[k, 1] - normals[k, 1] * relative[k, 0]
        return float(stations[k] + along[k]), float(left)

    return cartesian_to_frenet
