"""Egos that CARLA's own world drives: its autopilot, an agent of its Python package, a client."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from bridgegen.arrays import Float
from bridgegen.errors import InputError
from bridgegen.simulation.carla import frame
from bridgegen.simulation.carla.server import HUNG, Server, ServerError
from bridgegen.simulation.carla.settings import TIME_STEP, CarlaSettings
from bridgegen.simulation.carla.stage import HERO, Stage
from bridgegen.simulation.embedded.co_simulation import CoSimulation

if TYPE_CHECKING:
    import carla

TRAFFIC_MANAGER = 6000
"""How far the Traffic Manager's port is from the server's: 8000 beside 2000, as CARLA has it."""

SPACING = 2.0
"""Between two points of the route that a guest is told [m]."""

WAIT_SECONDS = 60.0
"""How long a client may take to take over the ego."""


class AskedSpeed:
    """What the storyboard asks of the ego, told whenever it changes.

    Args:
        joint: the scenario.
        tell: takes it [km/h].
    """

    def __init__(self, joint: CoSimulation, tell: Callable[[float], None]) -> None:
        self._joint, self._tell, self._last = joint, tell, math.nan

    def pass_on(self) -> None:
        """Tell it, if it is new."""
        asked = self._joint.target_speed
        if asked != self._last:
            self._last = asked
            self._tell(3.6 * asked)


class Autopilot:
    """CARLA's Traffic Manager, told the route and the speed that the storyboard asks for.

    Args:
        server: whose it is.
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
        self._ego, self._asked = stage.ego, AskedSpeed(joint, self._tell)
        self._path = [frame.location(x, y) for x, y in spaced(way)]
        self._port = server.access.port + TRAFFIC_MANAGER
        self._manager: Any = server.client.get_trafficmanager(self._port)
        self._manager.set_synchronous_mode(True)
        self._manager.set_random_device_seed(settings.seed)

    def begin(self, server: Server) -> None:
        """See `AtTheWheel`."""
        self._ego.set_autopilot(True, self._port)
        self._manager.auto_lane_change(self._ego, False)
        self._manager.set_path(self._ego, self._path)

    def control(self, k: int) -> None:
        """See `AtTheWheel`: only the speed is told."""
        self._asked.pass_on()

    def _tell(self, kmh: float) -> None:
        if hasattr(self._manager, "set_desired_speed"):
            self._manager.set_desired_speed(self._ego, kmh)
        else:  # 0.9.13 knows shares of the speed limit alone
            limit = max(self._ego.get_speed_limit(), 1.0)
            self._manager.vehicle_percentage_speed_difference(
                self._ego, 100.0 * (1.0 - kmh / limit)
            )

    def end(self) -> None:
        """See `AtTheWheel`."""
        self._ego.set_autopilot(False, self._port)
        self._manager.set_synchronous_mode(False)


class Agent:
    """An agent of the package ``agents``, which comes with the user's CARLA and not with its wheel.

    Args:
        server: whose world it is.
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
        self._asked = AskedSpeed(joint, self._agent.set_target_speed)
        found = (server.worlds.map.get_waypoint(frame.location(x, y)) for x, y in spaced(way))
        self._plan = [(one, RoadOption.LANEFOLLOW) for one in found if one is not None]

    def begin(self, server: Server) -> None:
        """See `AtTheWheel`."""
        self._agent.set_global_plan(self._plan)

    def control(self, k: int) -> "carla.VehicleControl":
        """See `AtTheWheel`."""
        self._asked.pass_on()
        control: carla.VehicleControl = self._agent.run_step()
        return control

    def end(self) -> None:
        """See `AtTheWheel`."""


class External:
    """A client of the user's, which finds the ego by its role and controls it.

    It may take its time before it begins; then ticks come no faster than in reality.

    Args:
        server: whose world it is.
        stage: with the ego.
        joint: the scenario.
        way: not told.
        settings: not told.
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
        """See `AtTheWheel`: wait until somebody controls the ego.

        Raises:
            ServerError: nobody does.
        """
        import carla

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
        """See `AtTheWheel`: the client does."""
        self._pace()

    def end(self) -> None:
        """See `AtTheWheel`."""

    def _pace(self) -> None:
        """Leave the client the time that passes."""
        rest = self._last + TIME_STEP - time.monotonic()
        if rest > 0.0:
            time.sleep(rest)
        self._last = time.monotonic()


GUESTS: Mapping[str, Callable[..., Any]] = {
    "carla-autopilot": Autopilot,
    "carla-agent": Agent,
    "carla-external": External,
}
"""By the name of the driver."""


def spaced(way: Float) -> Sequence[tuple[float, float]]:
    """Return points of a route, ``(n, 2)`` x, y [m], about `SPACING` apart, its end among them."""
    points: list[tuple[float, float]] = []
    for x, y in way.tolist():
        if not points or math.dist(points[-1], (x, y)) >= SPACING:
            points.append((x, y))
    end = (float(way[-1, 0]), float(way[-1, 1]))
    return points if points[-1] == end else [*points, end]


def _alike(one: "carla.VehicleControl", other: "carla.VehicleControl") -> bool:
    return (one.throttle, one.brake, one.steer, one.hand_brake) == (
        other.throttle, other.brake, other.steer, other.hand_brake
    )  # fmt: skip
