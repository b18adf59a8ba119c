"""CommonRoad's reactive planner: samples polynomials around the route, takes the cheapest free one.

Each 0.3 s (its ``replanning_frequency`` of 3 steps) it plans 2 s ahead from the ego's present state
and curvature (at first the route's, then the last plan's), and the house follows that plan.

What it is given: the lanes that cars use as lanelets, with borders, neighbours and successors; the
centre of the route's lanes as reference path; confirmed tracks, predicted at constant speed along
their lane (`bridgegen.adapters.planners._along_lanes`); the scenario's target speed as desired
speed; the ego's body, its braking (its limit of acceleration both ways, at most 11.5 m/s²) and its
full lock. Settings are the package's defaults, but for the horizon of 20 steps, which is that of
the authors' configurations (the default of 60 takes some seconds a plan), and processes, which are
off. It knows no lights, signs and right of way.

Where it finds no trajectory it returns none, and its documentation names nothing to do then: the
authors' example ends its run. Here the ego then brakes as hard as it can along the route, at its
present offset, and asks again after 0.3 s. Below 0.05 m/s the planner itself plans to stand.

`export` has the keys of a road (`bridgegen.adapters.planners._commonroad_alone`), ``body`` (5,),
``time`` (K,) [s], ``state`` (K, 6), ``target_speed`` (K,) [m/s] and ``others`` (K, M, 21, 5), one
row for each plan, as `Reactive` takes them; NaN where there is no other.
"""

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.adapters.planners import _commonroad_alone
from bridgegen.adapters.planners._along_lanes import AlongLanes
from bridgegen.adapters.planners._commonroad_alone import N_STEPS, STEP, Arrays, Reactive
from bridgegen.base.arrays import Float
from bridgegen.drivers.interface import ROUTE_STEP, Lane, Observation, RoadMap, Scene, Trajectory
from bridgegen.drivers.planners import Planner, require

PLANNER = Planner(
    name="commonroad-reactive",
    description="CommonRoad's reactive planner: samples trajectories in the Frenet frame of the "
    "route, and takes the cheapest that is feasible, on the road and free of collisions.",
    spec="bridgegen.adapters.planners.commonroad_reactive:CommonroadReactive",
    requires=(
        "commonroad-reactive-planner==2025.1",
        "commonroad-drivability-checker>=2025.1,<2026",
        "commonroad-clcs>=2025.1.1,<2026",
    ),
    licence="BSD-3-Clause; it requires Polygon3 and triangle, LGPL around libraries that are free "
    "for non-commercial use only",
    source="Werling et al. 2010, 2012; Würsching and Althoff, TU Munich, "
    "github.com/CommonRoad/commonroad-reactive-planner",
    how_to_get="in an environment of its own, since it requires an old protobuf; Python 3.11",
    domain=frozenset({"motorway", "road", "junction", "oncoming"}),
)

DRIVABLE = frozenset(
    {"driving", "bidirectional", "entry", "exit", "onRamp", "offRamp", "connectingRamp"}
)
"""Types of lanes that become lanelets."""

BEHIND, BEYOND = 30.0, 200.0  # m, by which the reference path is longer than the route
CLOSE = 0.5  # m; nearer points of it are left out
CONFIRMED = 2.0  # the least state of a track that counts


class CommonroadReactive:
    """The reactive planner as a driver; plans one row after the other.

    Attributes:
        planned: what it planned from at the last call, by row: state ``(6,)`` and others
            ``(M, N_STEPS + 1, 5)``, see `Reactive`; only of rows that run.
        emergencies: ``(N,)`` bool, where it found no trajectory at the last call.

    Raises:
        InputError: a package is not installed, or of another version.
    """

    wants = ("map",)
    period = 0.3
    max_rows = 2  # a plan that fails takes some 2 s, and the time limit of a call is 10 s

    def __init__(self) -> None:
        require(PLANNER)
        import_module("commonroad_rp.reactive_planner")  # seconds that no call's limit has
        self.planned: dict[int, tuple[Float, Float]] = {}

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`."""
        self._scene = scene
        self._roads: dict[int, tuple[Reactive, AlongLanes]] = {}
        self._curvature = np.full(n, np.nan)
        self.emergencies = np.zeros(n, dtype=np.bool_)

    def act(self, observation: Observation) -> Trajectory:
        """See `BatchDriver`."""
        o, n = observation, len(observation.x)
        plans = np.empty((n, N_STEPS + 1, 6))
        self.planned = {}
        self.emergencies = np.zeros(n, dtype=np.bool_)
        for i in range(n):
            if o.running[i]:
                plans[i] = self._plan(o, i)
            else:
                plans[i] = (o.x[i], o.y[i], o.h[i], 0.0, 0.0, 0.0)
        self._curvature = plans[:, round(self.period / STEP), 5].copy()
        time = np.arange(N_STEPS + 1) * STEP
        return Trajectory(time, plans[:, :, 0], plans[:, :, 1], plans[:, :, 2], plans[:, :, 3])

    def _plan(self, o: Observation, i: int) -> Float:
        # The curvature of the plan that is driven: an observation has none. At the start it is the
        # route's.
        curvature = self._curvature[i]
        if not np.isfinite(curvature):
            curvature = o.route[i, 0, 3]
        state = np.array([o.x[i], o.y[i], o.h[i], o.v[i], o.a[i], curvature])
        planner, lanes = self._road(o, i)
        others = others_of(o.tracks[i], lanes)
        self.planned[i] = state, others
        plan = planner.plan(state, float(o.target_speed[i]), others)
        if plan is None:
            self.emergencies[i] = True
            return braking(o, i, self._scene.max_deceleration)
        return plan

    def _road(self, o: Observation, i: int) -> tuple[Reactive, AlongLanes]:
        number = int(self._scene.map_of[i])
        if number not in self._roads:
            road_map = self._scene.maps[number]
            planner = Reactive(road_of(road_map, o.route[i]), body_of(self._scene))
            self._roads[number] = planner, AlongLanes(road_map, DRIVABLE)
        return self._roads[number]


def body_of(scene: Scene) -> Float:
    """Return the ego's body and limits as `Reactive` takes them."""
    return np.array(
        [scene.length, scene.width, scene.centre, scene.max_deceleration, scene.max_curvature]
    )


def others_of(tracks: Float, lanes: AlongLanes) -> Float:
    """Return of tracks ``(M, 13)`` what `Reactive` takes; NaN where not confirmed."""
    poses = lanes.predict(tracks, np.arange(N_STEPS + 1, dtype=np.float64) * STEP)
    sizes = np.repeat(tracks[:, None, 6:8], N_STEPS + 1, axis=1)
    others = np.concatenate([poses, sizes], axis=2)
    # NaN and not left out: each participant keeps its row, so that exported observations can be
    # compared.
    others[tracks[:, 0] < CONFIRMED] = np.nan
    return others


def braking(o: Observation, i: int, deceleration: float) -> Float:
    """Return a plan that brakes along the route at the ego's offset, ``(N_STEPS + 1, 6)``."""
    t = np.arange(N_STEPS + 1) * STEP
    stops = o.v[i] / deceleration
    moving = np.minimum(t, stops)
    along = o.v[i] * moving - deceleration * moving**2 / 2
    ahead = np.arange(o.route.shape[1]) * ROUTE_STEP
    x, y, h, curvature = (
        np.interp(along, ahead, values)
        for values in (*o.route[i, :, :2].T, np.unwrap(o.route[i, :, 2]), o.route[i, :, 3])
    )
    x, y = x - o.offset[i] * np.sin(h), y + o.offset[i] * np.cos(h)
    v = np.maximum(o.v[i] - deceleration * t, 0.0)
    return np.stack([x, y, h, v, np.where(t < stops, -deceleration, 0.0), curvature], axis=1)


def road_of(road_map: RoadMap, route: Float) -> Arrays:
    """Return a road network as arrays, see `bridgegen.adapters.planners._commonroad_alone`.

    Args:
        road_map: the network.
        route: ``(P, 4)``, the route ahead, which is the reference path if no lane is on the route.
    """
    lanes = [lane for lane in road_map.lanes if lane.kind in DRIVABLE and len(lane.centre) > 1]
    at = {lane.id: k for k, lane in enumerate(lanes)}
    beside = [
        (
            at.get(lane.left_lane, -1),
            at.get(lane.right_lane, -1),
            lane.left_is_same_way,
            lane.right_is_same_way,
        )
        for lane in lanes
    ]
    follows = [(k, at[name]) for k, lane in enumerate(lanes) for name in lane.next if name in at]
    return {
        "lane_points": np.array([len(lane.centre) for lane in lanes], dtype=np.int64),
        "lane_centre": _joined([lane.centre[:, :2] for lane in lanes]),
        "lane_left": _joined([lane.left for lane in lanes]),
        "lane_right": _joined([lane.right for lane in lanes]),
        "lane_beside": np.array(beside, dtype=np.int64).reshape(-1, 4),
        "lane_next": np.array(follows, dtype=np.int64).reshape(-1, 2),
        "reference": reference(road_map, route),
    }


def reference(road_map: RoadMap, route: Float) -> Float:
    """Return the path to follow ``(R, 2)`` [m]: the centre of the route's lanes, longer both ways.

    Args:
        road_map: the network.
        route: ``(P, 4)``, used if no lane is on the route.
    """
    by_id: dict[str, Lane] = {lane.id: lane for lane in road_map.lanes}
    centres = [by_id[name].centre for name in road_map.route if name in by_id]
    points = np.concatenate(centres) if centres else route[:, :3]
    (x, y, h), (u, w, g) = points[0, :3], points[-1, :3]
    back, on = np.arange(-BEHIND, 0.0, 1.0), np.arange(1.0, BEYOND, 1.0)
    whole = np.concatenate(
        [
            np.stack([x + back * np.cos(h), y + back * np.sin(h)], axis=1),
            points[:, :2],
            np.stack([u + on * np.cos(g), w + on * np.sin(g)], axis=1),
        ]
    )
    kept = [whole[0]]
    for point in whole[1:]:
        # Points that coincide have no direction between them, which the planner's curvilinear frame
        # needs.
        if np.hypot(*(point - kept[-1])) >= CLOSE:
            kept.append(point)
    return np.array(kept)


def _joined(parts: list[Float]) -> Float:
    return np.concatenate(parts) if parts else np.zeros((0, 2))


def export(observations: Sequence[Observation], scene: Scene) -> dict[str, npt.NDArray[Any]]:
    """Return what the planner was given in one row, for each of its plans.

    Args:
        observations: of one row, one for each call of ``act``.
        scene: of that row, with its map.

    Raises:
        InputError: a package is not installed, or of another version.
    """
    driver = CommonroadReactive()
    driver.reset(1, scene)
    states, others, targets, times = [], [], [], []
    for observation in observations:
        driver.act(observation)
        if 0 in driver.planned:
            state, other = driver.planned[0]
            states.append(state)
            others.append(other)
            targets.append(observation.target_speed[0])
            times.append(observation.time)
    road = road_of(scene.maps[int(scene.map_of[0])], observations[0].route[0])
    return road | {
        "body": body_of(scene),
        "time": np.array(times),
        "state": np.array(states),
        "target_speed": np.array(targets),
        "others": np.array(others),
    }


def reproduction(observations_path: str) -> str:
    """Return a Python script that prints the planner's plans, without BridgeGen."""
    alone = Path(_commonroad_alone.__file__).read_text(encoding="utf-8")
    return (
        f"# pip install {PLANNER.requires[0]}\n{alone}\n\n{_CALLS.format(path=observations_path)}"
    )


_CALLS = """\
given = dict(np.load({path!r}))
planner = Reactive(given, given["body"])
for k, time in enumerate(given["time"]):
    plan = planner.plan(given["state"][k], float(given["target_speed"][k]), given["others"][k])
    print(f"{{time:.2f}} s:", "no trajectory" if plan is None else "")
    for x, y, h, v, a, curvature in () if plan is None else plan.tolist():
        print(f"  {{x:.12f}} {{y:.12f}} {{h:.12f}} {{v:.12f}} {{a:.12f}} {{curvature:.12f}}")
"""
