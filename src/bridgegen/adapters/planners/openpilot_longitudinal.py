"""openpilot's longitudinal planner, as it runs in cars; the steering is ours.

The planner (``LongitudinalPlanner`` with its model predictive controller), the radar's tracks and
the choice of the lead (``radard``) are openpilot's own, imported from the user's checkout. Ours is
what its camera would give, and it is perfect: the lead is the nearest participant ahead whose body
is over the strip that the ego's body sweeps along its route, 300 m of it, then straight on; the
second lead, that of two seconds from now (``LEAD_T_OFFSETS``), the nearest one of the ego's
direction that will be there at its present velocity. Every confirmed or coasting track is a point
of the radar. The set speed is the scenario's target speed, at most openpilot's 145 km/h. The
personality is "standard", experimental mode is off, the car's parameters are opendbc's defaults.
Demands to stop are braking at 0.5 m/s² at least, as in openpilot's own plant
(``selfdrive/test/longitudinal_maneuvers/plant.py``).

The steering is the route follower's: pure pursuit of the route. openpilot's camera steers by a
neural network, which needs pictures.

What `export` writes, for T instants of one scenario with M other participants:

    v             ``(T,)`` [m/s]
    a             ``(T,)`` [m/s²]
    set_speed     ``(T,)`` [m/s]
    curvature     ``(T,)`` [1/m], that is steered
    points        ``(T, M, 4)``: 1 where the radar has the participant, the distance from the ego's
                  front to its rear [m], how far to the left it is [m], its speed along the road
                  [m/s]
    leads         ``(T, 2)``: which of them is the lead now and in two seconds, -1 for none
"""

import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.adapters.planners._corridor import Corridor
from bridgegen.adapters.planners._openpilot_checkout import (
    HOW_TO_GET,
    STEP,
    VARIABLE,
    Openpilot,
    load,
)
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import ROUTE_POINTS, ROUTE_STEP, Control, Observation, Scene
from bridgegen.drivers.planners import Planner

PLANNER = Planner(
    name="openpilot-longitudinal",
    description="openpilot's longitudinal planner (model predictive control), with perfect lead "
    "detection; it steers by our pure pursuit of the route.",
    spec="bridgegen.adapters.planners.openpilot_longitudinal:OpenpilotLongitudinal",
    requires=("comma-deps-acados>=0.2.2,<0.3", "cython>=3"),
    licence="MIT",
    source="https://github.com/commaai/openpilot",
    how_to_get=HOW_TO_GET,
    # docs/LIMITATIONS.md: not for traffic lights, pedestrians, cyclists
    domain=frozenset({"motorway", "road"}),
    variables=(VARIABLE,),
)

AHEAD = 2.0
"""Time from now to the second lead [s]; openpilot's ``LEAD_T_OFFSETS[1]``."""

BEYOND = 110
"""Number of points appended to the observation's route, along the map's lanes."""

ON_THE_ROAD = 0.5
"""Distance from the map's path below which the route's last point is on it [m]."""

SAME_WAY = math.pi / 4
"""Largest difference of a second lead's heading from the road's [rad]."""

SEEN = 2
"""The state of a track from which on it is a point of the radar: confirmed."""

LEAST_TO_STOP = -0.5
"""Largest acceleration when the planner wants to stop [m/s²]; as in openpilot's own plant."""

STANDSTILL = 0.01
"""Speed below which the car stands [m/s]; as in openpilot's own plant."""

CAR = {"openpilotLongitudinalControl": True, "longitudinalActuatorDelay": 0.15, "vEgoStopping": 0.5}
"""opendbc's defaults of the car parameters that the planner reads (``car/interfaces.py``)."""

Inputs = dict[str, npt.NDArray[Any]]


class OpenpilotLongitudinal:
    """The driver, see `BatchDriver`; one planner and one radar for each scenario.

    Raises:
        InputError: openpilot or its solver cannot be had, see `_openpilot_checkout.load`.
    """

    wants = ("map",)

    def __init__(self) -> None:
        self._openpilot = load()

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`.

        Raises:
            InputError: the time step is not openpilot's.
        """
        if not math.isclose(scene.time_step, STEP):
            raise InputError(
                f"the time step [s] must be {STEP:g} for openpilot, which plans at 20 Hz, got "
                f"{scene.time_step:g}"
            )
        self._scene, self._roads = scene, roads_of(scene)
        self._rows: list[_Row | None] = [None] * n

    def act(self, observation: Observation) -> Control:
        """See `BatchDriver`."""
        told = inputs(observation, self._scene, self._roads)
        acceleration = np.zeros(len(observation.x))
        for i in np.flatnonzero(observation.running):
            record = {name: values[i] for name, values in told.items()}
            row = self._rows[i]
            if row is None:
                row = self._rows[i] = _Row(self._openpilot, float(record["v"]))
            acceleration[i] = row.accelerate(record)
        return Control(acceleration, told["curvature"])


# --- What it is told ------------------------------------------------------------------------------


def roads_of(scene: Scene) -> list[Corridor | None]:
    """Return the road along the ego's route on each map; None where that is on no lane."""
    found: list[Corridor | None] = []
    for map_ in scene.maps:
        try:
            found.append(Corridor(map_))
        except InputError:
            found.append(None)
    return found


def inputs(observation: Observation, scene: Scene, roads: Sequence[Corridor | None]) -> Inputs:
    """Return what openpilot is told of N scenarios: what `export` writes, with N in place of T.

    Args:
        observation: of them.
        scene: of them.
        roads: what `roads_of` returns of the scene.
    """
    o, tracks = observation, observation.tracks
    way = _way(o.route, scene, roads)
    s, left, at = _along(way, tracks[:, :, 1], tracks[:, :, 2])
    road = np.take_along_axis(way[:, :, 2], at, axis=1)
    cos, sin = np.cos(tracks[:, :, 3] - road), np.sin(tracks[:, :, 3] - road)
    length, width = tracks[:, :, 6], tracks[:, :, 7]
    half = 0.5 * (np.abs(cos) * length + np.abs(sin) * width)
    aside = 0.5 * (np.abs(sin) * length + np.abs(cos) * width + scene.width)
    front = scene.centre + 0.5 * scene.length
    speed = tracks[:, :, 4] * np.cos(road) + tracks[:, :, 5] * np.sin(road)
    drift = tracks[:, :, 5] * np.cos(road) - tracks[:, :, 4] * np.sin(road)
    dx, dy = tracks[:, :, 1] - o.x[:, None], tracks[:, :, 2] - o.y[:, None]
    beside = dy * np.cos(o.h)[:, None] - dx * np.sin(o.h)[:, None]
    there = tracks[:, :, 0] >= SEEN
    distance = s - half - front
    ahead = there & (s > scene.centre)
    now = ahead & (np.abs(left) < aside)
    soon = ahead & (np.abs(left + AHEAD * drift) < aside) & (cos > math.cos(SAME_WAY))
    return {
        "v": o.v,
        "a": o.a,
        "set_speed": o.target_speed,
        "curvature": _pursued(o),
        "points": np.stack([there.astype(np.float64), distance, beside, speed], axis=2),
        "leads": np.stack([_nearest(distance, now), _nearest(distance, soon)], axis=1),
    }


def _way(route: Float, scene: Scene, roads: Sequence[Corridor | None]) -> Float:
    """Return the routes as far as a camera sees, x, y, heading ``(N, P + BEYOND, 3)``.

    Beyond their last points they follow the map; straight on, where they have left its way.
    """
    on = ROUTE_STEP * np.arange(1, BEYOND + 1)
    x, y, h = (route[:, -1, k, None] for k in range(3))
    beyond = np.stack([x + on * np.cos(h), y + on * np.sin(h), h + 0.0 * on], axis=2)
    for i in range(len(route)):
        road = roads[scene.map_of[i]]
        if road is None:
            continue
        (s,), (d,), (along,) = road.places(route[i, -1:, 0], route[i, -1:, 1])
        if abs(d) <= ON_THE_ROAD and math.cos(along - route[i, -1, 2]) > math.cos(SAME_WAY):
            # The observation's route ends before a camera's sight does: straight on, a lead was
            # seen from 78 m only in a bend.
            beyond[i] = road.poses(s + on)
    return np.concatenate([route[:, :, :3], beyond], axis=1)


def _along(route: Float, x: Float, y: Float) -> tuple[Float, Float, npt.NDArray[np.intp]]:
    """Return where points are along the routes: station, offset [m], nearest point's index.

    Args:
        route: ``(N, P, 3)``, x, y, heading every `ROUTE_STEP`; straight on beyond both ends.
        x: ``(N, M)`` [m].
        y: ``(N, M)`` [m].
    """
    dx, dy = x[:, :, None] - route[:, None, :, 0], y[:, :, None] - route[:, None, :, 1]
    at = np.argmin(dx * dx + dy * dy, axis=2)
    chosen = at[:, :, None]
    dx, dy = (np.take_along_axis(array, chosen, axis=2)[:, :, 0] for array in (dx, dy))
    h = np.take_along_axis(route[:, :, 2], at, axis=1)
    along = dx * np.cos(h) + dy * np.sin(h)
    return ROUTE_STEP * at + along, dy * np.cos(h) - dx * np.sin(h), at


def _nearest(distance: Float, among: npt.NDArray[np.bool_]) -> npt.NDArray[np.intp]:
    """Return ``(N,)``, the index of the nearest of some participants; -1 where there is none."""
    if among.shape[1] == 0:
        return np.full(len(among), -1)
    found = np.argmin(np.where(among, distance, np.inf), axis=1)
    return np.where(among.any(axis=1), found, -1)


def _pursued(observation: Observation) -> Float:
    """Return the curvature [1/m] that the route follower steers, ``(N,)``."""
    from bridgegen.drivers._route_follower_kernels import steer

    o = observation
    rows = zip(o.route, o.x, o.y, o.h, o.v, strict=True)
    return np.array([steer(path, ROUTE_POINTS, ROUTE_STEP, 0.0, *ego) for path, *ego in rows])


# --- openpilot, in one scenario -------------------------------------------------------------------


class _Row:
    """One scenario's planner and radar."""

    def __init__(self, openpilot: Openpilot, v: float) -> None:
        self._openpilot = openpilot
        car = SimpleNamespace(**CAR, steerRatio=1.0, wheelbase=1.0)
        self._planner = openpilot.LongitudinalPlanner(car, init_v=v)
        self._kalman = openpilot.radard.KalmanParams(STEP)
        self._tracks: dict[int, Any] = {}

    def accelerate(self, told: Inputs) -> float:
        """Return the acceleration [m/s²] that is demanded now."""
        v = float(told["v"])
        leads = self._leads(v, told["points"], told["leads"])
        self._planner.update(self._messages(told, leads))
        demanded = float(self._planner.output_a_target)
        return min(LEAST_TO_STOP, demanded) if self._planner.output_should_stop else demanded

    def _leads(self, v: float, points: Float, leads: npt.NDArray[Any]) -> list[SimpleNamespace]:
        """Update the radar's tracks; return both leads, as ``radarState`` has them."""
        radard = self._openpilot.radard
        for j, (there, distance, left, speed) in enumerate(points.tolist()):
            if not there:
                # A participant that is lost comes back as a new track, as of a radar: its filter
                # must not go on from where it was.
                self._tracks.pop(j, None)
                continue
            if j not in self._tracks:
                self._tracks[j] = radard.Track(j, speed, self._kalman)
            self._tracks[j].update(distance, left, speed - v, speed, True)
        found = []
        for which, j in enumerate(leads.tolist()):
            seen = _camera(radard.RADAR_TO_CAMERA, points[j] if j >= 0 else None)
            lead = radard.get_lead(v, True, self._tracks, seen, v, seen.prob, which == 0)
            found.append(SimpleNamespace(**{"modelProb": 0.0} | lead))
        return found

    def _messages(self, told: Inputs, leads: list[SimpleNamespace]) -> dict[str, SimpleNamespace]:
        v, none = float(told["v"]), SimpleNamespace(x=[])
        return {
            "carState": SimpleNamespace(
                vEgo=v,
                aEgo=float(told["a"]),
                vCruise=float(told["set_speed"]) * 3.6,
                standstill=v < STANDSTILL,
                # With a steering ratio and a wheelbase of 1, this is the path's curvature.
                steeringAngleDeg=math.degrees(float(told["curvature"])),
            ),
            "carControl": SimpleNamespace(orientationNED=[]),
            "controlsState": SimpleNamespace(
                longControlState=self._openpilot.running, forceDecel=False
            ),
            "selfdriveState": SimpleNamespace(
                enabled=True, experimentalMode=False, personality=self._openpilot.standard
            ),
            "liveParameters": SimpleNamespace(angleOffsetDeg=0.0),
            "radarState": SimpleNamespace(leadOne=leads[0], leadTwo=leads[1]),
            "modelV2": SimpleNamespace(
                position=none,
                velocity=none,
                acceleration=none,
                meta=SimpleNamespace(disengagePredictions=SimpleNamespace(gasPressProbs=[])),
                action=SimpleNamespace(desiredAcceleration=0.0, shouldStop=False),
            ),
        }


def _camera(offset: float, point: Float | None) -> SimpleNamespace:
    """Return what a perfect camera says of a lead, as a ``leadsV3`` of ``modelV2``.

    Args:
        offset: from the camera to the radar [m].
        point: the radar's point of it; None without a lead.
    """
    if point is None:
        return SimpleNamespace(prob=0.0)
    _, distance, left, speed = (float(item) for item in point)
    return SimpleNamespace(
        prob=1.0,
        x=[distance + offset],
        y=[-left],
        v=[speed],
        a=[0.0],
        xStd=[1.0],
        yStd=[1.0],
        vStd=[1.0],
    )


# --- A failure with openpilot alone ---------------------------------------------------------------


def export(observations: Sequence[Observation], scene: Scene) -> Inputs:
    """Return what openpilot was told of one scenario, instant by instant.

    Args:
        observations: of one row each, one for each call of ``act``.
        scene: of them.

    Returns:
        Arrays by name, see the module.
    """
    roads = roads_of(scene)
    told = [inputs(observation, scene, roads) for observation in observations]
    return {name: np.concatenate([record[name] for record in told]) for name in told[0]}


def reproduction(observations_path: str) -> str:
    """Return the text of a script that prints openpilot's demands, by openpilot alone.

    Args:
        observations_path: of an ``.npz`` with what `export` returns.
    """
    from bridgegen.adapters.planners._openpilot_alone import SCRIPT

    return SCRIPT.format(path=observations_path)
