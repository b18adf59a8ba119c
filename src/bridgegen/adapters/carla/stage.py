"""The actors of one row: they are spawned, moved in one batch per instant, read, destroyed."""

from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from bridgegen.adapters.carla import frame
from bridgegen.adapters.carla.server import ERROR, MINE, Server, ServerError, destroy
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.drivers.kinds import NAMES
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.scenario_runner.blueprints import ranked
from bridgegen.scenario.participants import OBJECT_CLASSES
from bridgegen.simulation.embedded.program import Program

if TYPE_CHECKING:
    import carla

# --- Which of CARLA's models stands for which participant ---


def choose(
    body: object, kind: int, size: tuple[float, float, float], known: Collection[str]
) -> str:
    """Return the blueprint for a participant: the one that it is named by, or the nearest in size.

    Args:
        body: its entry in the storyboard.
        kind: what it is, see `bridgegen.drivers.kinds`.
        size: length, width and height [m].
        known: the blueprints that the server has.

    Raises:
        InputError: it has none that would do.
    """
    named = str(getattr(body, "name", ""))
    alike = (
        ranked(body, size)
        if isinstance(body, osc.Vehicle | osc.Pedestrian | osc.MiscObject)
        else []
    )
    spare = OBJECT_CLASSES[kind].carla
    for name in (named, *alike, *spare):
        if name in known:
            return name
    raise InputError(
        f"carla: the server must have a blueprint for a {NAMES[kind]}, and has none of "
        f"{', '.join(dict.fromkeys((*alike, *spare)))}"
    )


HERO = "hero"
"""The role of the ego, by which other clients find it."""

ALOFT, APART = 60.0, 12.0
"""Spawn height above the road [m], where no obstacles are; each actor is higher than the last."""

BELOW = -40.0
"""Height of absent actors: under the road [m]."""

SETTLING = 20
"""Ticks in which the ego settles on its suspension before the scenario starts."""


@dataclass(frozen=True)
class Body:
    """One actor.

    Attributes:
        id: its.
        type: its blueprint.
        box: its bounding box, in its own frame.
        centre: of the entity's box, ahead of its reference point [m].
    """

    id: int
    type: str
    box: "carla.BoundingBox"
    centre: float

    @property
    def walks(self) -> bool:
        """Whether it is on foot."""
        return self.type.startswith("walker.")

    @property
    def is_vehicle(self) -> bool:
        """Whether it has wheels."""
        return self.type.startswith("vehicle.")


class Stage:
    """The actors of one row, while it lasts: a context.

    Args:
        server: whose world it is.
        program: the compiled storyboard with the participants.
        storyboard: the file, which names their models.
        ego_model: the ego's blueprint; empty: as the storyboard says.
        ego_is_moved: whether the ego is moved as everybody else is, instead of by CARLA's physics.

    Attributes:
        bodies: by entity, once it is entered.
        ego: the ego's actor, likewise.
    """

    def __init__(
        self,
        server: Server,
        program: Program,
        storyboard: osc.OpenScenario,
        *,
        ego_model: str = "",
        ego_is_moved: bool = False,
    ) -> None:
        self._server, self._program = server, program
        self._objects = {
            obj.name: obj.entity_object for obj in storyboard.entities.scenario_objects
        }
        self._ego_model = ego_model
        self._ego_is_moved = ego_is_moved
        self._rest = 0.0
        self._sensors: list[carla.Sensor] = []
        self.bodies: list[Body] = []

    def __enter__(self) -> Self:
        """Spawn all actors above the road.

        Raises:
            InputError: the server has no model for a participant.
            RuntimeError: as CARLA raises them.
        """
        try:
            self._put_up()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Destroy all actors, also after an error."""
        for sensor in self._sensors:
            with suppress(RuntimeError):
                sensor.stop()
        ids = [item.id for item in (*self._sensors, *self.bodies)]
        self._sensors, self.bodies = [], []
        with suppress(RuntimeError, ServerError):  # a server that is gone has no actors
            destroy(self._server.client, ids)

    def _put_up(self) -> None:
        import carla

        library = self._server.world.get_blueprint_library()
        known = {item.id for item in library}
        for e, name in enumerate(self._program.names):
            blueprint = library.find(self._model(e, name, known))
            dressed(blueprint, HERO if e == 0 else f"{MINE}.{name}")
            # CARLA refuses to spawn where something is. Above the road nothing is, and each actor
            # is higher than the last; the first instant puts them where they belong.
            spot = carla.Transform(frame.location(0.0, 0.0, ALOFT + APART * e))
            actor = self._server.world.spawn_actor(blueprint, spot)
            self.bodies.append(
                Body(actor.id, actor.type_id, actor.bounding_box, float(self._program.box[e, 2]))
            )
            if e == 0:
                self.ego: Any = actor
        moved = self.bodies if self._ego_is_moved else self.bodies[1:]
        # Whoever is moved by the storyboard has no physics: else CARLA would drop and push it
        # between two instants.
        self.do([carla.command.SetSimulatePhysics(body.id, False) for body in moved])

    def _model(self, e: int, name: str, known: set[str]) -> str:
        """Return the blueprint of an entity."""
        if e == 0 and self._ego_model:
            if self._ego_model not in known:
                vehicles = sorted(item for item in known if item.startswith("vehicle."))
                raise UnknownNameError(
                    "blueprint of the server (ego_model)", self._ego_model, vehicles
                )
            return self._ego_model
        length, width, height = self._program.bodies[e, [0, 1, 7]].tolist()
        kind = int(self._program.kinds[e])
        return choose(self._objects[name], kind, (length, width, height), known)

    def attach(self, kind: str, transform: "carla.Transform", **attributes: object) -> Any:
        """Attach a sensor to the ego; it is destroyed with the actors.

        Args:
            kind: its blueprint.
            transform: where, in the ego's frame.
            attributes: of the blueprint.
        """
        blueprint = self._server.world.get_blueprint_library().find(kind)
        for name, value in attributes.items():
            blueprint.set_attribute(name, str(value))
        dressed(blueprint, f"{MINE}.{kind}")
        sensor: Any = self._server.world.spawn_actor(blueprint, transform, attach_to=self.ego)
        self._sensors.append(sensor)
        return sensor

    def moves(self, states: Float, present: Bool, *, ego: bool) -> list[Any]:
        """Return the commands that set the transforms of entities.

        Args:
            states: ``(E, 4)``, see `CoSimulation.states`.
            present: ``(E,)``; absent actors are moved under the road.
            ego: whether the ego, too.
        """
        commands = []
        for e in range(0 if ego else 1, len(self.bodies)):
            commands += self._moves_of(self.bodies[e], states[e], bool(present[e]))
        return commands

    def _moves_of(self, body: Body, state: Float, is_there: bool) -> list[Any]:
        import carla

        height = self._ground(state) if is_there else BELOW
        spot = frame.placed(state, body.centre, body.box, height)
        if body.walks:
            spot.location.z = height  # the server lifts it by half of its height
            return [carla.command.ApplyWalkerState(body.id, spot, float(state[3]))]
        commands: list[Any] = [carla.command.ApplyTransform(body.id, spot)]
        if body.is_vehicle:
            velocity = frame.velocity(float(state[2]), float(state[3]) if is_there else 0.0)
            # The velocity, too, though the place is set: sensors and agents read it.
            commands.append(carla.command.ApplyTargetVelocity(body.id, velocity))
        return commands

    def _ground(self, state: Float) -> float:
        """Return the height of the road at a point [m]; 0 beside roads."""
        import carla

        spot = frame.location(float(state[0]), float(state[1]))
        waypoint = self._server.worlds.map.get_waypoint(spot, True, carla.LaneType.Any)
        return 0.0 if waypoint is None else float(waypoint.transform.location.z)

    def settle(self, states: Float, present: Bool) -> None:
        """Set the first instant: all actors at their start, the ego settled and rolling."""
        import carla

        if self._ego_is_moved:
            return self.do(self.moves(states, present, ego=True))
        ego, still = self.bodies[0], states.copy()
        still[0, 3] = 0.0
        brakes = carla.VehicleControl(brake=1.0, hand_brake=True)
        hold = carla.command.ApplyVehicleControl(ego.id, brakes)
        self.do([*self.moves(still, present, ego=True), hold])
        # A car that is put on its wheels sinks into its suspension; without this, each row would
        # begin with a jolt.
        for _ in range(SETTLING):
            snapshot = self._server.tick()
        self.check(snapshot)
        self._rest = snapshot.find(ego.id).get_transform().location.z
        self.start(states)

    def start(self, states: Float) -> None:
        """Put the ego, settled, at its first instant, rolling and with no pedal pressed."""
        import carla

        ego = self.bodies[0]
        spot = frame.placed(states[0], ego.centre, ego.box)
        spot.location.z = self._rest
        velocity = frame.velocity(float(states[0, 2]), float(states[0, 3]))
        self.do(
            [
                carla.command.ApplyTransform(ego.id, spot),
                carla.command.ApplyTargetVelocity(ego.id, velocity),
                carla.command.ApplyVehicleControl(ego.id, carla.VehicleControl()),
            ]
        )

    def drives(self, control: "carla.VehicleControl | None") -> list[Any]:
        """Return the command that applies the ego's control, if there is one."""
        import carla

        if control is None:
            return []
        return [carla.command.ApplyVehicleControl(self.bodies[0].id, control)]

    def do(self, commands: list[Any]) -> None:
        """Have the server execute commands in one call.

        Raises:
            ServerError: it cannot: an actor is gone.
        """
        if not commands:
            return
        responses = self._server.client.apply_batch_sync(commands, False)
        for response in responses:
            if response.has_error():
                raise ServerError(ERROR, response.error)

    def ego_state(self, snapshot: "carla.WorldSnapshot") -> Float:
        """Return the ego's state, ``(4,)``, see `CoSimulation.impose`.

        Raises:
            ServerError: it is gone.
        """
        body = self.bodies[0]
        there = snapshot.find(body.id)
        return frame.seen(there.get_transform(), there.get_velocity(), body.centre, body.box)

    def check(self, snapshot: "carla.WorldSnapshot") -> None:
        """Check that all actors exist.

        Raises:
            ServerError: an actor no longer exists.
        """
        for name, body in zip(self._program.names, self.bodies, strict=True):
            if not snapshot.has_actor(body.id):
                raise ServerError(ERROR, f"the actor of '{name}' ({body.type}) no longer exists")


def dressed(blueprint: "carla.ActorBlueprint", role: str) -> None:
    """Set the role of a blueprint, and the first value of each of its attributes."""
    # The first value and not CARLA's random one: images of one scenario are then alike.
    first = dict.fromkeys(("color", "driver_id"), "")
    for attribute in blueprint:
        if attribute.id == "role_name":
            blueprint.set_attribute("role_name", role)
        elif attribute.id == "is_invincible":  # else a pedestrian that is run over is removed
            blueprint.set_attribute("is_invincible", "true")
        elif attribute.id in first and attribute.recommended_values:
            first[attribute.id] = attribute.recommended_values[0]
    for name, value in first.items():
        if value:
            blueprint.set_attribute(name, value)


def friction_of(ego: Any, scale: float, dry: list[float]) -> None:
    """Set the friction of the ego's tyres.

    Args:
        ego: its actor.
        scale: factor on that of a dry road.
        dry: each wheel's on a dry road; filled the first time.
    """
    control = ego.get_physics_control()
    wheels = control.wheels
    if not dry:
        dry += [wheel.tire_friction for wheel in wheels]
    wanted = np.asarray(dry) * scale
    if not np.allclose(wanted, [wheel.tire_friction for wheel in wheels], rtol=1e-6):
        for wheel, friction in zip(wheels, wanted.tolist(), strict=True):
            wheel.tire_friction = friction
        control.wheels = wheels
        ego.apply_physics_control(control)
