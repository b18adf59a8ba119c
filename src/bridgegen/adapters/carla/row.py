"""One row: BridgeGen's storyboard and driver in CARLA's world, step by step."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from bridgegen.adapters.carla.lights import Lights
from bridgegen.adapters.carla.pedals import Car, Pedals
from bridgegen.adapters.carla.server import Server
from bridgegen.adapters.carla.stage import Stage, friction_of
from bridgegen.adapters.carla.weather import Sky, Weather
from bridgegen.simulation.embedded.co_simulation import CoSimulation

if TYPE_CHECKING:
    import carla


class Stopped(Exception):
    """The simulator has been asked to stop."""


class EgoController(Protocol):
    """Controls the ego in CARLA."""

    def begin(self, server: Server) -> None:
        """Take control at the first instant; ticks may pass if the ego is then put back."""

    def end(self) -> None:
        """Release control; the server may have ended."""

    def control(self, k: int) -> "carla.VehicleControl | None":
        """Return the control at an instant; None if CARLA gets it from another source."""


class RowObserver(Protocol):
    """Observes the progress of a row."""

    def begin(self, frame: int) -> None:
        """Receive the number of CARLA's frame at instant 0."""

    def reached(self, k: int, snapshot: "carla.WorldSnapshot") -> None:
        """Receive the snapshot of an instant; the scenario has its states."""


class BridgeGenDriver:
    """A driver of BridgeGen; its demands are converted to pedals and steering.

    Args:
        joint: the scenario with the driver.
        car: the ego.
    """

    def __init__(self, joint: CoSimulation, car: Car) -> None:
        self._joint = joint
        self._pedals = Pedals(car, float(joint.states(0)[0, 3]))

    def begin(self, server: Server) -> None:
        """See `EgoController`."""

    def end(self) -> None:
        """See `EgoController`."""

    def control(self, k: int) -> "carla.VehicleControl":
        """See `EgoController`."""
        acceleration, curvature = self._joint.demand(k)
        return self._pedals.control(acceleration, curvature, float(self._joint.states(k)[0, 3]))


@dataclass(frozen=True)
class CarlaRow:
    """The parts of one row.

    Attributes:
        joint: the scenario, at its first instant.
        stage: its actors.
        weather: its weather.
        lights: its traffic lights.
        controller: of the ego; None if it is moved as the embedded simulator moves it.
        observers: of its progress.
        is_stopped: returns whether to stop.
    """

    joint: CoSimulation
    stage: Stage
    weather: Weather
    lights: Lights
    controller: EgoController | None
    observers: Sequence[RowObserver]
    is_stopped: Callable[[], bool]

    def run(self, server: Server) -> None:
        """Run it to its end.

        Raises:
            RuntimeError: raised by CARLA.
            ServerError: an actor no longer exists.
            DriverError: the user's driver failed.
            Stopped: the simulator has been asked to stop.
        """
        joint, stage = self.joint, self.stage
        sky: Sky | None = None
        dry: list[float] = []
        k = 0
        while True:
            if self.is_stopped():
                raise Stopped
            # The order of an instant is the embedded simulator's: triggers, driver, motion. With a
            # kinematic ego the rollout then equals the embedded one to the bit.
            joint.decide(k)
            sky = self._environment(server, k, sky, dry)
            if k == 0:
                stage.settle(joint.states(0), joint.present(0))
                if self.controller is not None:
                    self.controller.begin(server)
                for observer in self.observers:
                    observer.begin(server.world.get_snapshot().frame)
            control: Any = None
            if self.controller is not None:
                control = self.controller.control(k)
                # The ego's own motion here does not count: `impose` replaces it by CARLA's after
                # the tick.
                joint.move(k, 0.0, 0.0)
            else:
                joint.move(k, *joint.demand(k))
            if not joint.runs:
                return
            k += 1
            moves = stage.moves(joint.states(k), joint.present(k), ego=self.controller is None)
            # All commands of an instant in one call, before its tick: one by one, each would be a
            # round trip.
            stage.do([*moves, *stage.drives(control)])
            snapshot = server.tick()
            stage.check(snapshot)
            if self.controller is not None:
                joint.impose(k, [0], stage.ego_state(snapshot))
            for observer in self.observers:
                observer.reached(k, snapshot)

    def _environment(self, server: Server, k: int, last: Sky | None, dry: list[float]) -> Sky:
        """Set the weather and the lights of an instant, if they have changed."""
        joint = self.joint
        sky = self.weather.at(k, joint.weather, joint.events)
        if last is None or sky.fields != last.fields:
            server.world.set_weather(sky.parameters())
        # The wheels' friction is scaled, where CARLA has friction triggers: a trigger is a box that
        # changes the tyres of every vehicle in it, and would have to cover the map.
        if self.controller is not None and (last is None or sky.friction != last.friction):
            friction_of(self.stage.ego, sky.friction, dry)
        self.lights.show(joint.lights)
        return sky
