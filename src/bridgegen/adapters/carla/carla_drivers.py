"""Egos that are driven in CARLA: by its autopilot, by an agent of its package, by a client."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from bridgegen.adapters.carla import frame
from bridgegen.adapters.carla.server import HUNG, Server, ServerError
from bridgegen.adapters.carla.settings import TIME_STEP, CarlaSettings
from bridgegen.adapters.carla.stage import HERO, Stage
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.simulation.embedded.co_simulation import CoSimulation

if TYPE_CHECKING:
    import carla

TRAFFIC_MANAGER = 6000
"""Offset of the Traffic Manager's port from the server's: 8000 for 2000, as in CARLA."""

SPACING = 2.0
"""Distance between two points of the route that a controller gets [m]."""

WAIT_SECONDS = 60.0
"""Time limit for a client to take control of the ego [s]."""


class TargetSpeed:
    """Forwards the storyboard's target speed of the ego whenever it changes.

    Args:
        joint: the scenario.
        set_speed: receives it [km/h].
    """

    def __init__(self, joint: CoSimulation, set_speed: Callable[[float], None]) -> None:
        self._joint, self._set_speed, self._last = joint, set_speed, math.nan

    def forward(self) -> None:
        """Forward it, if it has changed."""
        asked = self._joint.target_speed
        # NaN at first, which differs from everything, so that the first speed is forwarded, too.
        if asked != self._last:
            self._last = asked
            self._set_speed(3.6 * asked)


class Autopilot:
    """CARLA's Traffic Manager, with the route and the storyboard's target speed.

    Args:
        server: that runs it.
        stage: with the ego.
        joint: the scenario.
        way: ``(n, 2)`` x, y [m] of the route.
        settings: with its seed.
    """

    def __init__(
        self,
        server: Server,
        stage: Stage,
        joint: CoSimulation,
        way: Float,
        settings: CarlaSettings,
    ) -> None:
        self._ego, self._asked = stage.ego, TargetSpeed(joint, self._set_speed)
        self._path = [frame.location(x, y) for x, y in spaced(way)]
        self._port = server.access.port + TRAFFIC_MANAGER
        self._manager: Any = server.client.get_trafficmanager(self._port)
        self._manager.set_synchronous_mode(True)
        self._manager.set_random_device_seed(settings.seed)

    def begin(self, server: Server) -> None:
        """See `EgoController`."""
        self._ego.set_autopilot(True, self._port)
        # The route is the scenario's: a lane change of the Traffic Manager's own would be another
        # test.
        self._manager.auto_lane_change(self._ego, False)
        self._manager.set_path(self._ego, self._path)

    def control(self, k: int) -> None:
        """See `EgoController`: it sets the speed only."""
        self._asked.forward()

    def _set_speed(self, kmh: float) -> None:
        if hasattr(self._manager, "set_desired_speed"):
            self._manager.set_desired_speed(self._ego, kmh)
        else:  # 0.9.13 accepts only shares of the speed limit
            limit = max(self._ego.get_speed_limit(), 1.0)
            self._manager.vehicle_percentage_speed_difference(
                self._ego, 100.0 * (1.0 - kmh / limit)
            )

    def end(self) -> None:
        """See `EgoController`."""
        self._ego.set_autopilot(False, self._port)
        self._manager.set_synchronous_mode(False)


class Agent:
    """An agent of the package ``agents``, which is part of CARLA but not of its wheel on PyPI.

    Args:
        server: with the world.
        stage: with the ego.
        joint: the scenario.
        way: ``(n, 2)`` x, y [m] of the route.
        settings: which agent.

    Raises:
        InputError: the package is not found.
    """

    def __init__(
        self,
        server: Server,
        stage: Stage,
        joint: CoSimulation,
        way: Float,
        settings: CarlaSettings,
    ) -> None:
        try:
            from agents.navigation.basic_agent import BasicAgent
            from agents.navigation.behavior_agent import BehaviorAgent
            from agents.navigation.local_planner import RoadOption
        except ImportError as error:
            raise InputError(
                "carla-agent: the package 'agents' of your CARLA (PythonAPI/carla) must be on "
                f"PYTHONPATH, with what it needs; {error}"
            ) from None
        if settings.agent == "basic":
            self._agent: Any = BasicAgent(stage.ego)
        else:
            self._agent = BehaviorAgent(stage.ego, behavior=settings.agent)
        self._asked = TargetSpeed(joint, self._agent.set_target_speed)
        found = (server.worlds.map.get_waypoint(frame.location(x, y)) for x, y in spaced(way))
        self._plan = [(item, RoadOption.LANEFOLLOW) for item in found if item is not None]

    def begin(self, server: Server) -> None:
        """See `EgoController`."""
        self._agent.set_global_plan(self._plan)

    def control(self, k: int) -> "carla.VehicleControl":
        """See `EgoController`."""
        self._asked.forward()
        control: carla.VehicleControl = self._agent.run_step()
        return control

    def end(self) -> None:
        """See `EgoController`."""


class External:
    """A client of the user, which finds the ego by its role name and controls it.

    It may start late; from then on ticks are not faster than real time.

    Args:
        server: with the world.
        stage: with the ego.
        joint: the scenario.
        way: not used.
        settings: not used.
    """

    def __init__(
        self,
        server: Server,
        stage: Stage,
        joint: CoSimulation,
        way: Float,
        settings: CarlaSettings,
    ) -> None:
        self._stage, self._joint, self._last = stage, joint, -math.inf

    def begin(self, server: Server) -> None:
        """See `EgoController`: wait until a client controls the ego.

        Raises:
            ServerError: no client does in time.
        """
        import carla

        # CARLA does not tell whether a client controls an actor. The ego is held by a control of
        # ours, and the first that differs from it is the client's.
        hold = carla.VehicleControl(brake=1.0, hand_brake=True)
        self._stage.do(self._stage.drives(hold))
        until = time.monotonic() + WAIT_SECONDS
        server.tick()
        while (now := self._stage.ego.get_control()) is not None and _alike(now, hold):
            if time.monotonic() > until:
                raise ServerError(
                    HUNG, f"no client controls the actor '{HERO}' within {WAIT_SECONDS:g} s"
                )
            self._pace()
            server.tick()
        self._stage.start(self._joint.states(0))

    def control(self, k: int) -> None:
        """See `EgoController`: the client does."""
        self._pace()

    def end(self) -> None:
        """See `EgoController`."""

    def _pace(self) -> None:
        """Wait for real time."""
        rest = self._last + TIME_STEP - time.monotonic()
        if rest > 0.0:
            time.sleep(rest)
        self._last = time.monotonic()


CONTROLLERS: Mapping[str, Callable[..., Any]] = {
    "carla-autopilot": Autopilot,
    "carla-agent": Agent,
    "carla-external": External,
}
"""Controllers by the name of the driver."""


def spaced(way: Float) -> Sequence[tuple[float, float]]:
    """Return points of a route, ``(n, 2)`` x, y [m], about `SPACING` apart, its end among them."""
    points: list[tuple[float, float]] = []
    for x, y in way.tolist():
        if not points or math.dist(points[-1], (x, y)) >= SPACING:
            points.append((x, y))
    end = (float(way[-1, 0]), float(way[-1, 1]))
    return points if points[-1] == end else [*points, end]


def _alike(vehicle_control: "carla.VehicleControl", other: "carla.VehicleControl") -> bool:
    return (
        vehicle_control.throttle,
        vehicle_control.brake,
        vehicle_control.steer,
        vehicle_control.hand_brake,
    ) == (other.throttle, other.brake, other.steer, other.hand_brake)
