"""One row: our storyboard and driver in CARLA's world, instant by instant."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from bridgegen.simulation.carla.lights import Lights
from bridgegen.simulation.carla.pedals import Car, Pedals
from bridgegen.simulation.carla.server import Server
from bridgegen.simulation.carla.stage import Stage, friction_of
from bridgegen.simulation.carla.weather import Sky, Weather
from bridgegen.simulation.embedded.co_simulation import CoSimulation

if TYPE_CHECKING:
    import carla


class Stopped(Exception):
    """The simulator is to stop."""


class AtTheWheel(Protocol):
    """Who drives the ego in CARLA."""

    def begin(self, server: Server) -> None:
        """Take over, at the first instant; ticks may pass, if the ego is put back then."""

    def end(self) -> None:
        """Let go; the server may be gone."""

    def control(self, k: int) -> "carla.VehicleControl | None":
        """Return what it does at an instant; None, if CARLA has it from elsewhere."""


class Watch(Protocol):
    """Who is told how a row goes on."""

    def begin(self, frame: int) -> None:
        """Take note of the frame of CARLA's in which instant 0 is."""

    def reached(self, k: int, snapshot: "carla.WorldSnapshot") -> None:
        """Take note of an instant that is reached; the scenario has its states."""


class Ours:
    """A driver of ours at the pedals: its demands as a car's driver would carry them out.

    Args:
        joint: the scenario, whose driver is asked.
        car: the ego.
    """

    def __init__(self, joint: CoSimulation, car: Car) -> None:
        self._joint = joint
        self._pedals = Pedals(car, float(joint.states(0)[0, 3]))

    def begin(self, server: Server) -> None:
        """See `AtTheWheel`."""

    def end(self) -> None:
        """See `AtTheWheel`."""

    def control(self, k: int) -> "carla.VehicleControl":
        """See `AtTheWheel`."""
        acceleration, curvature = self._joint.demand(k)
        return self._pedals.control(acceleration, curvature, float(self._joint.states(k)[0, 3]))


@dataclass(frozen=True)
class Row:
    """What one row needs.

    Attributes:
        joint: the scenario, at its first instant.
        stage: its actors, put up.
        weather: its weather.
        lights: its traffic lights.
        wheel: who drives the ego; None: it is moved as the embedded simulator moves it.
        watches: told how it goes on.
        is_stopped: whether to stop.
    """

    joint: CoSimulation
    stage: Stage
    weather: Weather
    lights: Lights
    wheel: AtTheWheel | None
    watches: Sequence[Watch]
    is_stopped: Callable[[], bool]

    def run(self, server: Server) -> None:
        """Run it to its end.

        Raises:
            RuntimeError: as CARLA raises them.
            ServerError: an actor is gone.
            DriverError: a driver of the user's own failed.
            Stopped: it was to.
        """
        joint, stage = self.joint, self.stage
        sky: Sky | None = None
        dry: list[float] = []
        k = 0
        while True:
            if self.is_stopped():
                raise Stopped
            joint.decide(k)
            sky = self._environment(server, k, sky, dry)
            if k == 0:
                stage.settle(joint.states(0), joint.present(0))
                if self.wheel is not None:
                    self.wheel.begin(server)
                for watch in self.watches:
                    watch.begin(server.world.get_snapshot().frame)
            control: Any = None
            if self.wheel is not None:
                control = self.wheel.control(k)
                joint.move(k, 0.0, 0.0)
            else:
                joint.move(k, *joint.demand(k))
            if not joint.runs:
                return
            k += 1
            moves = stage.moves(joint.states(k), joint.present(k), ego=self.wheel is None)
            stage.do([*moves, *stage.drives(control)])
            snapshot = server.tick()
            stage.check(snapshot)
            if self.wheel is not None:
                joint.impose(k, [0], stage.ego_state(snapshot))
            for watch in self.watches:
                watch.reached(k, snapshot)

    def _environment(self, server: Server, k: int, last: Sky | None, dry: list[float]) -> Sky:
        """Show weather and lights of an instant; what has not changed costs nothing."""
        joint = self.joint
        sky = self.weather.at(k, joint.weather, joint.events)
        if last is None or sky.fields != last.fields:
            server.world.set_weather(sky.parameters())
        if self.wheel is not None and (last is None or sky.friction != last.friction):
            friction_of(self.stage.ego, sky.friction, dry)
        self.lights.show(joint.lights)
        return sky
