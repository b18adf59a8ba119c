"""CARLA as a simulator: BridgeGen's storyboard and drivers in its world."""

import csv
import threading
import weakref
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from bridgegen.adapters.carla.carla_drivers import CONTROLLERS
from bridgegen.adapters.carla.lights import Lights
from bridgegen.adapters.carla.pedals import Car
from bridgegen.adapters.carla.row import BridgeGenDriver, CarlaRow, EgoController, Stopped
from bridgegen.adapters.carla.sensors import Eyes
from bridgegen.adapters.carla.server import ERROR, Server, ServerError
from bridgegen.adapters.carla.settings import TIME_STEP, Access, CarlaSettings
from bridgegen.adapters.carla.stage import Stage
from bridgegen.adapters.carla.weather import Weather
from bridgegen.adapters.carla.worlds import Generated, Town, check, loader
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.drivers import STORYBOARD, Driver
from bridgegen.drivers.detector import load
from bridgegen.drivers.driver_process import DriverError
from bridgegen.drivers.drivers import ROUTE_FOLLOWER
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.program import Program
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.rollout import FAILURES, Incident, Rollout, joined
from bridgegen.simulation.trace import write_trace

if TYPE_CHECKING:
    import carla

    from bridgegen.simulation.embedded.co_simulation import CoSimulation

# --- What CARLA itself notices: contacts of the ego, lane markings that it crosses; and red lights


LASTING = 20
"""Number of instants (1 s) within which contacts with the same actor are one contact."""

ASIDE = 2.0
"""Largest distance of a stop line's point from a vehicle's path at which it applies to the vehicle
[m]."""

COLLISION, LANE_INVASION, RED_LIGHT = "collision", "lane invasion", "red light"
RED, RED_AND_YELLOW = 1, 2  # of Rollout.lights


class Incidents:
    """Records the events of the ego's collision sensor and lane detector in one row.

    Args:
        stage: with the ego; the sensors are attached to it.
        names: of the entities.
    """

    def __init__(self, stage: Stage, names: tuple[str, ...]) -> None:
        import carla

        self._who = {body.id: name for body, name in zip(stage.bodies, names, strict=True)}
        self._told: list[tuple[int, str, str]] = []
        self._first = 0
        here = carla.Transform()
        stage.attach("sensor.other.collision", here).listen(self._collided)
        stage.attach("sensor.other.lane_invasion", here).listen(self._invaded)

    def begin(self, frame: int) -> None:
        """Have instant 0 be that of a frame of CARLA's."""
        self._first = frame

    def reached(self, k: int, snapshot: "carla.WorldSnapshot") -> None:
        """See `RowObserver`: the sensors report by themselves."""

    def _collided(self, event: Any) -> None:
        other = event.other_actor
        self._told.append((event.frame, COLLISION, self._who.get(other.id, other.type_id)))

    def _invaded(self, event: Any) -> None:
        kinds = {str(marking.type) for marking in event.crossed_lane_markings}
        self._told.append((event.frame, LANE_INVASION, ", ".join(sorted(kinds))))

    def all(self, rollout: Rollout) -> tuple[Incident, ...]:
        """Return them in the order in which they took place; a lasting incident is listed once.

        Args:
            rollout: of this row, N = 1.
        """
        found = red_lights(rollout)
        last: dict[str, int] = {}
        # Sensors report on other threads, in any order; what is told twice is one.
        for frame, kind, what in sorted(set(self._told)):
            k = frame - self._first
            if k < 0:  # when it settled
                continue
            if kind != COLLISION or k - last.get(what, -LASTING - 1) > LASTING:
                found.append(Incident(k, kind, what))
            if kind == COLLISION:
                last[what] = k
        return tuple(sorted(found, key=lambda incident: incident.step))


def red_lights(rollout: Rollout) -> list[Incident]:
    """Return where the ego's front crosses the stop line of a light that is red; N = 1."""
    n, front = int(rollout.n_steps[0]), rollout.box[0, 2] + 0.5 * rollout.box[0, 0]
    h = rollout.h[0, 0, :n]
    x = rollout.x[0, 0, :n] + front * np.cos(h)
    y = rollout.y[0, 0, :n] + front * np.sin(h)
    found = []
    for j in np.flatnonzero(rollout.stop_entities == 0).tolist():
        line_x, line_y, line_h = rollout.stop_lines[0, j]
        c, s = np.cos(line_h), np.sin(line_h)
        past = (x - line_x) * c + (y - line_y) * s
        beside = np.abs((y - line_y) * c - (x - line_x) * s) <= ASIDE
        light = int(rollout.stop_lights[j])
        for k in (np.flatnonzero((past[:-1] <= 0.0) & (past[1:] > 0.0) & beside[1:]) + 1).tolist():
            if rollout.lights[0, light, k - 1] in (RED, RED_AND_YELLOW):
                found.append(Incident(k, RED_LIGHT, rollout.light_names[light]))
    return found


def write_incidents(folder: Path, incidents: Sequence[Incident], time_step: float) -> None:
    """Write a row's incidents into its folder, as ``incidents.csv``."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "incidents.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("frame", "time", "kind", "what"))
        writer.writerows(
            (incident.step, round(incident.step * time_step, 6), incident.kind, incident.what)
            for incident in incidents
        )


# --- What there is of a row beside its motion: incidents, detections, what was recorded ---


@dataclass(frozen=True)
class Found:
    """What there is of a row beside its motion.

    Attributes:
        incidents: what CARLA noticed.
        eyes: whose detections are the row's; None: the driver's sensors' are.
        folder: where it is recorded; None: it is not.
    """

    incidents: Incidents
    eyes: Eyes | None
    folder: Path | None

    def added(self, rollout: Rollout) -> Rollout:
        """Return the row's rollout, N = 1, with it."""
        incidents = self.incidents.all(rollout)
        if incidents:
            rollout = replace(rollout, incidents={0: incidents})
        if self.folder is not None:
            write_incidents(self.folder, incidents, rollout.time_step)
            write_trace(self.folder / "trace.csv", rollout)
        if self.eyes is not None:
            detections = self.eyes.detections
            n = int(rollout.n_steps[0])
            # As all states of a rollout: behind its end, the last instant's are repeated.
            detections[:, n:] = detections[:, n - 1 : n]
            rollout = replace(rollout, detections=detections[np.newaxis])
        return rollout


def refuse_used(folder: Path) -> None:
    """Refuse to record where something is.

    Raises:
        InputError: it is a file, or not empty.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"--record: {folder} must be a new folder, or an empty one")


ROWS = 8
"""Number of rows between which the server is left stepping, and whose measures come together."""

TRIES = 2
"""Maximum number of attempts for a row that fails because of the server."""


@dataclass(frozen=True)
class CarlaRoads:
    """P road networks, ready for one storyboard.

    Attributes:
        network: for the storyboard.
        models: them.
        worlds: what loads each of them in CARLA.
    """

    network: Network
    models: tuple[OpenDrive, ...]
    worlds: tuple[Town | Generated, ...]


class CarlaSimulator:
    """A `Simulator` that a CARLA server runs, one row at a time.

    The storyboard moves the participants as in the embedded simulator; the driver controls the ego,
    which CARLA's physics moves.

    Args:
        embedded: the embedded one of the same storyboard and driver.
        storyboard: the scenario file, validated.
        settings: that affect results.
        access: address of the server, and outputs.

    Raises:
        InputError: the time step is not CARLA's, no server answers, the detector does not exist, or
            the folder for recordings is not empty.
    """

    def __init__(
        self,
        embedded: EmbeddedSimulator,
        storyboard: OpenScenario,
        *,
        settings: CarlaSettings | None = None,
        access: Access | None = None,
    ) -> None:
        self.embedded = embedded
        if self.embedded.time_step != TIME_STEP:
            raise InputError(
                f"{embedded.program.place}: time_step = {TIME_STEP:g} s must hold in carla, whose "
                f"physics needs it, got {self.embedded.time_step:g} s"
            )
        self._storyboard, self._settings = storyboard, settings or CarlaSettings()
        self._server = Server(access or Access())
        weakref.finalize(self, self._server.close)
        at = self._server.access
        self._detector = load(at.detector) if at.detector else None
        self._number = 0
        if at.record:
            refuse_used(Path(at.record))
        self._is_stopped = threading.Event()

    @property
    def rows_at_once(self) -> int:
        """See `Simulator`."""
        return ROWS

    @property
    def runs_at_once(self) -> int:
        """See `Simulator`: there is one server."""
        return 1

    def roads(
        self, models: Sequence[OpenDrive], courses: Sequence[Mapping[str, Float]] = ()
    ) -> CarlaRoads:
        """See `Simulator`; nothing is loaded yet."""
        network = self.embedded.roads(models, courses)
        file = self._storyboard.road_network.logic_file
        name = str(file.filepath) if file else ""
        wanted = self._settings.map
        worlds = tuple(loader(model, name, wanted, self._server.maps) for model in models)
        return CarlaRoads(network, tuple(models), worlds)

    def run(
        self,
        roads: CarlaRoads,
        rows: Int,
        values: Mapping[str, npt.ArrayLike],
        *,
        driver: Driver | None = None,
        dry: bool = False,
    ) -> Rollout:
        """See `Simulator`; one row after the other.

        A row that fails because of the server is tried once more, when the server is available
        again; then it has failed, with status 40, 41 or 42 and CARLA's message.

        Raises:
            InputError: see `Simulator`; or the server has no such map, light or model.
        """
        if not len(rows):
            return self.embedded.run(roads.network, rows, values, driver=ROUTE_FOLLOWER)
        columns = {name: np.broadcast_to(value, len(rows)) for name, value in values.items()}
        parts = []
        for i, p in enumerate(rows.tolist()):
            row = {name: float(column[i]) for name, column in columns.items()}
            # One row a turn, so that other searches on the machine get the server between two rows.
            with self._server.turn:
                self._number += 1
                parts.append((np.array([i]), self._row(roads, p, row, driver, dry)))
        return joined(parts)

    def stop(self) -> None:
        """See `Simulator`."""
        self._is_stopped.set()
        self.embedded.stop()

    def _row(
        self,
        roads: CarlaRoads,
        p: int,
        values: Mapping[str, float],
        driver: Driver | None,
        dry: bool,
    ) -> Rollout:
        found: Found | None = None
        # A row is tried again from its start, with a scenario and a driver of their own: half of
        # one has no meaning.
        for left in reversed(range(TRIES)):
            try:
                joint = self.embedded.co_simulation(
                    roads.network, p, values, driver=driver, dry=dry
                )
            except DriverError as error:
                return self.embedded.failed(
                    roads.network, p, values, FAILURES[error.kind], str(error)
                )
            try:
                if joint.runs:
                    found = self._attempt(roads, p, values, joint, driver)
                break
            except DriverError as error:
                joint.fail(FAILURES[error.kind], str(error))
                break
            except Stopped:
                joint.fail(ERROR, "it was stopped")
                break
            except (RuntimeError, ServerError) as error:
                problem = self._server.diagnosis(error)
            try:
                self._server.reconnect()
            except ServerError as error:
                problem, left = error, 0
            if not left:
                joint.fail(problem.status, str(problem))
                break
        rollout = joint.rollout()
        return rollout if found is None or rollout.status[0] else found.added(rollout)

    def _attempt(
        self,
        roads: CarlaRoads,
        p: int,
        values: Mapping[str, float],
        joint: "CoSimulation",
        driver: Driver | None,
    ) -> Found:
        """Run one row; return its incidents and detections.

        Raises:
            RuntimeError: raised by CARLA.
            ServerError: the server has failed.
            DriverError: the user's driver has failed.
            Stopped: the simulator has been asked to stop.
            InputError: the server has no such light or model, or another map.
        """
        server, program = self._server, self.embedded.program.changed(driver=driver)
        world, model, way = roads.worlds[p], roads.models[p], roads.network.way(p, 0)
        server.load(world, world.key)
        check(server.worlds.map, way, world.name)
        lights = Lights(server.world, model, program.lights)
        with ExitStack() as stack:
            stack.enter_context(server.stepped())
            lights.begin()
            stage = stack.enter_context(
                Stage(
                    server,
                    program,
                    self._storyboard,
                    ego_model=self._settings.ego_model,
                    ego_is_moved=self._moves_ego(program.driver),
                )
            )
            controller = self._make_controller(program.driver, stage, joint, way)
            if controller is not None:
                stack.callback(_end, controller)
            incidents = Incidents(stage, program.names)
            eyes = self._eyes(stage, program, joint)
            CarlaRow(
                joint,
                stage,
                Weather(self._storyboard, program, values),
                lights,
                controller,
                [incidents] if eyes is None else [incidents, eyes],
                self._is_stopped.is_set,
            ).run(server)
            if eyes is not None:
                eyes.finish()
        return Found(incidents, eyes if self._detector else None, self._folder())

    def _folder(self) -> Path | None:
        """Return the folder of the current row's recording, or None."""
        if not self._server.access.record:
            return None
        return Path(self._server.access.record) / f"{self._number:06}"

    def _eyes(self, stage: Stage, program: Program, joint: "CoSimulation") -> Eyes | None:
        folder = self._folder()
        if folder is None and self._detector is None:
            return None
        return Eyes(
            stage,
            program,
            joint,
            period=self._settings.sensor_period,
            detector=self._detector,
            folder=folder,
        )

    def _moves_ego(self, driver: Driver) -> bool:
        """Return whether the ego is moved as the embedded simulator moves it."""
        return driver == STORYBOARD or (not driver.home and self._settings.ego == "kinematic")

    def _make_controller(
        self, driver: Driver, stage: Stage, joint: "CoSimulation", way: Float
    ) -> EgoController | None:
        if driver.home:
            controller = CONTROLLERS[driver.name](self._server, stage, joint, way, self._settings)
            return cast(EgoController, controller)
        if self._moves_ego(driver):
            return None
        return BridgeGenDriver(joint, Car.of(stage.ego.get_physics_control()))


def _end(controller: EgoController) -> None:
    with suppress(RuntimeError):
        controller.end()
