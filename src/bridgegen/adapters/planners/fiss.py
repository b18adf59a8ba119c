"""FISS+, a sampling planner in Frenet frames, with its own predictions and its own controller.

It is set up as in its authors' closed loop in CARLA (``fiss_planner.carla.closed_loop``): it plans
every 0.1 s, its model predictive controller steers and accelerates every 0.05 s; vehicles are
predicted along their lanes, others at constant velocity; boxes are 0.2 m longer and wider than
seen; it ignores what follows it in its lane. Different is what we know of: the desired speed is the
scenario's target speed, the map is ours, the vehicle's limits are the planner's defaults or, where
that can do less, the ego's; and the latency between plan and motion is the planner's default, none
(with CARLA's 0.05 s, its acceleration would alternate by 0.6 m/s² on an empty road here, where what
it demands acts at once). Other participants are the confirmed and coasting tracks within 120 m.

The map is one lane for each lane of each section that vehicles may use. A stop line is active while
its light is red or yellow. The wheelbase is not known: the body's centre is taken for the middle
between the axles.

What `export` writes, for T instants of one scenario:

    time          ``(T,)`` [s]
    ego           ``(T, 6)``: x, y of the body's centre [m], heading [rad], speed [m/s],
                  acceleration [m/s²], curvature [1/m] of its path
    desired       ``(T,)`` [m/s]
    obstacles     ``(T, M, 8)``: 1 where it is told of the participant, 1 if that is a vehicle, x, y
                  of its centre [m], heading of its motion [rad], speed [m/s], length, width [m]
    active        ``(T, S)`` bool, the stop lines
    vehicle       ``(9,)``, see `VEHICLE`
    lanes         ``(L, 6)``: speed limit [m/s], the neighbour on the left (-1 for none), 1 if it
                  may change there, both for the right, how many points the lane has
    route         indices of the route's lanes, in its order
    centre        ``(K, 2)`` [m], of all lanes, one after the other; ``left`` and ``right`` likewise
    next          ``(J, 2)``: the second lane follows the first one
    stop_lines    ``(S, 3)``: the lane, the station along its centre [m], the light
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.drivers import kinds
from bridgegen.drivers.interface import Control, Lane, Observation, RoadMap, Scene
from bridgegen.drivers.planners import Planner

PLANNER = Planner(
    name="fiss",
    description="FISS+ (IROS 2023), a sampling planner in Frenet frames that changes lanes, with "
    "its own predictions and its own model predictive controller.",
    spec="bridgegen.adapters.planners.fiss:Fiss",
    requires=("fiss-planner>=1.0,<2",),
    licence="Apache-2.0",
    source="https://doi.org/10.1109/IROS55552.2023.10341498",
    # Its README: highways, lane changes by the markings, unprotected turns, red lights; its
    # adapter for CARLA takes walkers.
    domain=frozenset({"motorway", "road", "junction", "oncoming", "vulnerable"}),
)

PLAN_EVERY, CONTROL_STEP = 2, 0.05
"""Number of instants between two plans, and time between two instants [s]; as in the authors'
loop."""

RANGE, ENLARGED = 120.0, 0.2
"""Range within which others are seen, and enlargement of their boxes [m]; as in the authors'
loop."""

BEYOND = 0.5
"""Time by which predictions are longer than plans [s]; as in the authors' closed loop."""

PREDICTION_STEP = 0.1
"""Time step of predictions [s]; as in the authors' closed loop."""

MOVING = 0.5
"""Speed from which on a heading is that of the velocity [m/s]; as in the authors' closed loop."""

CURVATURE_FROM = 1.0
"""Speed from which on the path's curvature is measured [m/s]; as in the authors' closed loop."""

SEEN = 2
"""The state of a track from which on it is an obstacle: confirmed."""

STOPS = (1, 2, 3)
"""States of a light at which its stop line is active: red, red and yellow, yellow."""

FOR_VEHICLES = frozenset(
    {"driving", "entry", "exit", "onRamp", "offRamp", "connectingRamp", "slipLane", "bidirectional"}
)
"""OpenDRIVE's types of the lanes that the planner gets."""

WALKS = (kinds.PEDESTRIAN, kinds.ANIMAL)
"""Kinds that are predicted at constant velocity wherever they are."""

VEHICLE = (
    "length",
    "width",
    "wheelbase",
    "rear_axle_to_center",
    "max_speed",
    "max_accel",
    "max_decel",
    "max_steer",
    "max_lat_accel",
)
"""The planner's names of the vehicle's values [SI units, radians]."""

Inputs = dict[str, npt.NDArray[Any]]


class Fiss:
    """The driver, see `BatchDriver`; one planner and one controller for each scenario.

    Raises:
        InputError: the planner is not installed.
    """

    wants = ("map",)

    def __init__(self) -> None:
        self._fiss = _imported()

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`.

        Raises:
            InputError: the time step is not that of its controller.
        """
        if not math.isclose(scene.time_step, CONTROL_STEP):
            raise InputError(
                f"the time step [s] must be {CONTROL_STEP:g} for the controller of the planner "
                f"'fiss', got {scene.time_step:g}"
            )
        self._scene = scene
        self._vehicle = vehicle(scene, self._fiss.VehicleParams())
        self._tables = [map_tables(map_) for map_ in scene.maps]
        self._roads = [_road(self._fiss, table) for table in self._tables]
        self._rows: list[_Row | None] = [None] * n
        self._before = np.full(n, np.nan)

    def act(self, observation: Observation) -> Control:
        """See `BatchDriver`."""
        o = observation
        told = inputs(o, self._scene, self._before)
        self._before = np.where(o.running, o.h, np.nan)
        acceleration, curvature = np.zeros(len(o.x)), np.zeros(len(o.x))
        for i in np.flatnonzero(o.running):
            row, which = self._rows[i], self._scene.map_of[i]
            tables = self._tables[which]
            if row is None:
                # One planner for each scenario, made when it first drives: planners keep what they
                # planned last.
                row = self._rows[i] = _Row(
                    self._fiss, self._vehicle, self._roads[which], tables["route"].tolist()
                )
            active = stop_lines_active(o, int(i), tables)
            record = {name: values[i] for name, values in told.items()}
            acceleration[i], curvature[i] = row.drive(o.time, record, active)
        return Control(acceleration, curvature)


def _imported() -> Any:
    try:
        import fiss_planner
    except ImportError as error:
        raise InputError(
            f"the planner 'fiss' needs fiss-planner ({error}): pip install 'fiss-planner>=1.0,<2'"
        ) from error
    return fiss_planner


# --- What it is told ------------------------------------------------------------------------------


def vehicle(scene: Scene, usual: Any) -> Float:
    """Return the values named by `VEHICLE`.

    Args:
        scene: the ego's body.
        usual: the planner's defaults of them, as attributes.
    """
    wheelbase = 2.0 * scene.centre
    return np.array(
        [
            scene.length,
            scene.width,
            wheelbase,
            scene.centre,
            scene.max_speed,
            min(usual.max_accel, scene.max_acceleration),
            min(usual.max_decel, scene.max_deceleration),
            math.atan(scene.max_curvature * wheelbase),
            usual.max_lat_accel,
        ]
    )


def inputs(observation: Observation, scene: Scene, before: Float) -> Inputs:
    """Return what the planner is told of N scenarios: ``ego``, ``desired`` and ``obstacles``.

    Args:
        observation: of them.
        scene: of them.
        before: ``(N,)`` [rad], the ego's heading an instant ago; NaN at the first one.
    """
    o, tracks = observation, observation.tracks
    # By the unit circle: headings may jump by a whole turn between two instants.
    turned = np.angle(np.exp(1j * (o.h - before))) / scene.time_step
    is_measured = (o.v > CURVATURE_FROM) & np.isfinite(before)
    with np.errstate(invalid="ignore", divide="ignore"):
        curvature = np.where(is_measured, turned / o.v, 0.0)
    x, y = o.x + scene.centre * np.cos(o.h), o.y + scene.centre * np.sin(o.h)
    distance = np.hypot(tracks[:, :, 1] - x[:, None], tracks[:, :, 2] - y[:, None])
    speed = np.hypot(tracks[:, :, 4], tracks[:, :, 5])
    heading = np.where(
        speed > MOVING, np.arctan2(tracks[:, :, 5], tracks[:, :, 4]), tracks[:, :, 3]
    )
    obstacles = np.stack(
        [
            (tracks[:, :, 0] >= SEEN) & (distance <= RANGE),
            ~np.isin(tracks[:, :, 8], WALKS),
            tracks[:, :, 1],
            tracks[:, :, 2],
            heading,
            speed,
            tracks[:, :, 6] + ENLARGED,
            tracks[:, :, 7] + ENLARGED,
        ],
        axis=2,
    )
    ego = np.stack([x, y, o.h, o.v, o.a, curvature], axis=1)
    return {"ego": ego, "desired": o.target_speed, "obstacles": obstacles}


def stop_lines_active(observation: Observation, row: int, tables: Inputs) -> npt.NDArray[np.bool_]:
    """Return which of `map_tables`' stop lines are active in a row of an observation, ``(S,)``."""
    assert observation.map is not None  # it is wanted
    return np.isin(observation.map.lights[row, tables["stop_lines"][:, 2].astype(np.intp)], STOPS)


def map_tables(road: RoadMap) -> Inputs:
    """Return a road network as the arrays that `export` writes of it."""
    lanes = [item for item in road.lanes if item.kind in FOR_VEHICLES and len(item.centre) > 1]
    numbers = {lane.id: i for i, lane in enumerate(lanes)}

    def neighbour(lane: Lane, side: str) -> tuple[int, bool]:
        same_way = getattr(lane, f"{side}_is_same_way")
        found = numbers.get(getattr(lane, f"{side}_lane"), -1) if same_way else -1
        return found, found >= 0 and getattr(lane, f"may_change_{side}")

    def known(ids: Sequence[str]) -> list[int]:
        return [numbers[name] for name in ids if name in numbers]

    rows = []
    for lane in lanes:
        to_left, to_right = neighbour(lane, "left"), neighbour(lane, "right")
        rows.append((lane.speed_limit.min(), *to_left, *to_right, len(lane.centre)))
    stops = [
        (i, _station(lanes[i].centre[:, :2], light.stop.mean(axis=0)), k)
        for k, light in enumerate(road.lights)
        for i in known(light.lanes)
    ]
    follow = [(i, j) for i, lane in enumerate(lanes) for j in known(lane.next)]
    return {
        "lanes": np.array(rows).reshape(-1, 6),
        "route": np.array(known(road.route), dtype=np.int64),
        "centre": _joined([lane.centre[:, :2] for lane in lanes]),
        "left": _joined([lane.left for lane in lanes]),
        "right": _joined([lane.right for lane in lanes]),
        "next": np.array(follow, dtype=np.int64).reshape(-1, 2),
        "stop_lines": np.array(stops).reshape(-1, 3),
    }


def _joined(parts: list[Float]) -> Float:
    return np.concatenate([np.zeros((0, 2)), *parts])


def _station(line: Float, point: Float) -> float:
    """Return the station [m] of a line's vertex that is nearest to a point."""
    steps = np.hypot(*np.diff(line, axis=0).T)
    nearest = int(np.argmin(np.hypot(*(line - point).T)))
    return float(steps[:nearest].sum())


# --- The planner ----------------------------------------------------------------------------------


def _road(fiss: Any, tables: Inputs) -> Any:
    """Return the planner's road map; lane i of the tables has the id i + 1."""
    road, at = fiss.RoadMap(), 0
    for i, (limit, left, to_left, right, to_right, n) in enumerate(tables["lanes"].tolist()):
        lane, points = fiss.MapLane(), slice(at, at + int(n))
        lane.id, lane.speed_limit = i + 1, limit
        lane.centerline = tables["centre"][points]
        lane.left, lane.right = tables["left"][points], tables["right"][points]
        if left >= 0:
            lane.left_neighbor, lane.can_change_left = int(left) + 1, bool(to_left)
        if right >= 0:
            lane.right_neighbor, lane.can_change_right = int(right) + 1, bool(to_right)
        lane.successors = (tables["next"][tables["next"][:, 0] == i, 1] + 1).tolist()
        lane.predecessors = (tables["next"][tables["next"][:, 1] == i, 0] + 1).tolist()
        road.add_lane(lane)
        at += int(n)
    for i, (number, station, _) in enumerate(tables["stop_lines"].tolist()):
        road.add_stop_line(fiss.StopLine(i, int(number) + 1, station, False))
    road.finalize()
    return road


class _Row:
    """One scenario's planner, controller and plan."""

    def __init__(self, fiss: Any, values: Float, road: Any, route: list[int]) -> None:
        self._fiss, self._road = fiss, road
        body = fiss.VehicleParams()
        for name, value in zip(VEHICLE, values.tolist(), strict=True):
            setattr(body, name, value)
        config = fiss.LocalPlannerConfig()
        config.planner.type = fiss.planner_type_from_string("fiss_plus")
        config.planner.collision.ignore_rear_in_lane = True
        self._horizon = config.planner.sampling.max_t + BEYOND
        self._wheelbase = body.wheelbase
        self._planner = fiss.LocalPlanner(config, body)
        self._planner.set_map(road, [number + 1 for number in route])
        self._controller = fiss.make_controller("mpc", body)
        self._calls, self._plan, self._planned_at = 0, None, 0.0

    def drive(
        self, time: float, told: Inputs, active: npt.NDArray[np.bool_]
    ) -> tuple[float, float]:
        """Return the acceleration [m/s²] and curvature [1/m] demanded now; 0 without a plan."""
        ego = self._fiss.EgoState(*told["ego"].tolist())
        if self._calls % PLAN_EVERY == 0:
            for line, is_active in enumerate(active.tolist()):
                self._planner.set_stop_line_active(line, is_active)
            obstacles = self._obstacles(told["obstacles"])
            plan = self._planner.step(time, ego, obstacles, float(told["desired"])).trajectory
            # Without a new plan the last one is followed.
            if len(plan) >= 2:
                self._plan, self._planned_at = plan, time
        self._calls += 1
        if self._plan is None:
            return 0.0, 0.0
        command = self._controller.compute(ego, self._plan, time - self._planned_at)
        return command.accel, math.tan(command.steer) / self._wheelbase

    def _obstacles(self, told: Float) -> list[Any]:
        found = []
        for i, (there, is_vehicle, *state) in enumerate(told.tolist()):
            if not there:
                continue
            of = (i, *state, self._horizon, PREDICTION_STEP)
            if is_vehicle:
                found.append(self._fiss.predict_lane_following(self._road, *of))
            else:
                found.append(self._fiss.predict_constant_velocity(*of))
        return found


# --- A failure with the planner alone -------------------------------------------------------------


def export(observations: Sequence[Observation], scene: Scene) -> Inputs:
    """Return what the planner was told of one scenario, instant by instant.

    Args:
        observations: of one row each, one for each call of ``act``.
        scene: of them.

    Returns:
        Arrays by name, see the module.

    Raises:
        InputError: the planner is not installed: the vehicle's values are its defaults.
    """
    headings = [np.full(1, np.nan), *(observation.h for observation in observations)]
    told = [
        inputs(observation, scene, h)
        for observation, h in zip(observations, headings, strict=False)
    ]
    road = scene.maps[int(scene.map_of[0])]
    tables = map_tables(road)
    joined = {name: np.concatenate([record[name] for record in told]) for name in told[0]}
    return (
        tables
        | joined
        | {
            "time": np.array([observation.time for observation in observations]),
            "active": np.stack(
                [stop_lines_active(observation, 0, tables) for observation in observations]
            ),
            "vehicle": vehicle(scene, _imported().VehicleParams()),
        }
    )


def reproduction(observations_path: str) -> str:
    """Return the text of a script that prints the planner's commands, by the planner alone.

    Args:
        observations_path: of an ``.npz`` with what `export` returns.
    """
    from bridgegen.adapters.planners._fiss_alone import SCRIPT

    return SCRIPT.format(path=observations_path)
