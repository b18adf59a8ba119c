"""A stand-in for a CARLA server, in this process: what of it cannot be had without one.

Client, World, actors, sensors and the Traffic Manager are ours; what they take and give (Map,
Transform, WeatherParameters, VehicleControl, commands, snapshots' times …) is the wheel's. It is
stricter than CARLA: what is undefined there (a tick without synchronous mode, a destroyed actor's
method) is an error here. `test_stand_in.py` holds it to the wheel's signatures.
"""

import fnmatch
import socket

import carla
from shapely import affinity
from shapely.geometry import box as rectangle

from .stand_in_actors import (
    DEAD,
    Actor,
    ActorBlueprint,
    Sensor,
    TrafficLight,
    TrafficManager,
    blueprints,
)

LIGHT_TYPE = "1000001"
DEFAULT_MAP = "Carla/Maps/Town10HD_Opt"


class Misuse(AssertionError):
    """What CARLA may let pass, and nobody should do."""


class Machine:
    """Where a server may run: a port that listens, faults to come, and what it has been asked.

    Attributes:
        maps: OpenDRIVE texts by name.
        faults: what happens at the beginning of the tick of that number, counted over all worlds.
        calls: names of the calls, in order.
    """

    def __init__(self, maps):
        self.maps, self.faults, self.calls, self.ticks = maps, {}, [], 0
        self.version, self.loads = "0.9.16", []
        self.listener, self.port, self.hangs, self.refuses = None, 0, False, ""
        self.start()

    def start(self):
        """Start a server anew, at the same port, with nobody in its world."""
        if self.listener is not None:
            return
        self.listener = socket.socket()
        self.listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.listener.bind(("127.0.0.1", self.port))
        self.listener.listen(256)
        self.port = self.listener.getsockname()[1]
        self.hangs, self.refuses = False, ""
        self.settings, self.next_id, self.worlds = carla.WorldSettings(), 24, 0
        self.managers = {}
        self.load(DEFAULT_MAP, self.maps[DEFAULT_MAP])

    def die(self):
        """End, as a process does: nothing listens any more."""
        self.listener.close()
        self.listener = None

    def load(self, name, text):
        """Load a world."""
        self.map, self.worlds, self.actors = carla.Map(name, text), self.worlds + 1, {}
        self.frame, self.weather = 100, carla.WeatherParameters.ClearNoon
        self.loads.append(name)
        for landmark in self.map.get_all_landmarks_of_type(LIGHT_TYPE):
            self.add(TrafficLight(self, landmark))

    def add(self, actor):
        """Take an actor into the world."""
        actor.id, self.next_id = self.next_id, self.next_id + 1
        self.actors[actor.id] = actor
        return actor

    def rpc(self, name):
        """Take down a call; fail as the server does."""
        self.calls.append(name)
        if self.listener is None or self.hangs:
            raise RuntimeError(
                "time-out of 20000ms while waiting for the simulator, make sure the simulator is "
                f"ready and connected to localhost:{self.port}"
            )
        if self.refuses:
            raise RuntimeError(self.refuses)

    def tick(self):
        """Let a step pass."""
        self.ticks += 1
        if self.ticks in self.faults:
            self.faults.pop(self.ticks)(self)
        self.rpc("tick")
        if not self.settings.synchronous_mode:
            raise Misuse("a tick without synchronous mode")
        self.frame += 1
        for manager in self.managers.values():
            manager.drive()
        moving = list(self.actors.values())
        for actor in moving:
            actor.step(self.settings.fixed_delta_seconds)
        for actor in moving:
            if isinstance(actor, Sensor) and actor.id in self.actors:
                actor.sense()
        return self.frame

    def lose(self, role):
        """Lose an actor, as when it falls out of the world."""
        for actor in list(self.actors.values()):
            if actor.attributes.get("role_name") == role:
                del self.actors[actor.id]


def shape(actor):
    """Return an actor's box in CARLA's plane, as shapely has it."""
    box, at = actor.bounding_box, actor.transform
    flat = rectangle(-box.extent.x, -box.extent.y, box.extent.x, box.extent.y)
    flat = affinity.translate(flat, box.location.x, box.location.y)
    turned = affinity.rotate(flat, at.rotation.yaw, origin=(0, 0))
    return affinity.translate(turned, at.location.x, at.location.y)


MACHINES: dict[int, Machine] = {}


class Client:
    """See `carla.Client`."""

    def __init__(self, host="127.0.0.1", port=2000, worker_threads=0):
        self._machine, self.timeout = MACHINES.get(port), 5.0

    def _rpc(self, name):
        if self._machine is None:
            raise RuntimeError("time-out of 1000ms while waiting for the simulator")
        self._machine.rpc(name)
        return self._machine

    def set_timeout(self, seconds):
        self.timeout = seconds

    def get_client_version(self):
        return "0.9.16"

    def get_server_version(self):
        return self._rpc("get_server_version").version

    def get_world(self):
        machine = self._rpc("get_world")
        return World(machine)

    def get_available_maps(self):
        return [f"/Game/{name}" for name in self._rpc("get_available_maps").maps]

    def load_world(self, map_name, reset_settings=True, map_layers=carla.MapLayer.All):
        machine = self._rpc("load_world")
        (found,) = [one for one in machine.maps if one.rpartition("/")[2] == map_name]
        self._reset(machine, reset_settings)
        machine.load(found, machine.maps[found])
        return World(machine)

    def generate_opendrive_world(self, opendrive, parameters=None, reset_settings=True):
        assert isinstance(parameters, carla.OpendriveGenerationParameters)
        assert parameters.wall_height == 0.0
        machine = self._rpc("generate_opendrive_world")
        self._reset(machine, reset_settings)
        machine.load("Carla/Maps/OpenDriveMap", opendrive)
        return World(machine)

    def apply_batch_sync(self, commands, do_tick=False):
        machine = self._rpc("apply_batch_sync")
        responses = [_carry_out(machine, one) for one in commands]
        if do_tick:
            machine.tick()
        return responses

    def get_trafficmanager(self, port=8000):
        machine = self._rpc("get_trafficmanager")
        return machine.managers.setdefault(port, TrafficManager(machine, port))

    @staticmethod
    def _reset(machine, reset_settings):
        if machine.settings.synchronous_mode:
            raise Misuse("a world is loaded in synchronous mode: nobody would tick it")
        if reset_settings:
            machine.settings = carla.WorldSettings()


class World:
    """See `carla.World`."""

    def __init__(self, machine):
        self._machine, self.id = machine, machine.worlds

    def _rpc(self, name):
        self._machine.rpc(name)
        if self.id != self._machine.worlds:
            raise RuntimeError("trying to operate on a world that no longer exists")
        return self._machine

    def get_settings(self):
        return _copied(self._rpc("get_settings").settings)

    def apply_settings(self, settings, seconds=0.0):
        self._rpc("apply_settings").settings = _copied(settings)
        return self._machine.frame

    def get_weather(self):
        return self._rpc("get_weather").weather

    def set_weather(self, weather):
        assert isinstance(weather, carla.WeatherParameters)
        self._rpc("set_weather").weather = weather

    def get_map(self):
        return self._rpc("get_map").map

    def get_blueprint_library(self):
        self._rpc("get_blueprint_library")
        return BlueprintLibrary(blueprints())

    def get_actors(self, actor_ids=None):
        actors = self._rpc("get_actors").actors
        return ActorList([one for i, one in actors.items() if actor_ids is None or i in actor_ids])

    def get_snapshot(self):
        return WorldSnapshot(self._machine)

    def tick(self, seconds=10.0):
        if self.id != self._machine.worlds:
            raise RuntimeError("trying to operate on a world that no longer exists")
        return self._machine.tick()

    def freeze_all_traffic_lights(self, frozen):
        for one in self._rpc("freeze_all_traffic_lights").actors.values():
            if isinstance(one, TrafficLight):
                one.frozen = frozen

    def spawn_actor(
        self, blueprint, transform, attach_to=None,
        attachment_type=carla.AttachmentType.Rigid, bone="",
    ):  # fmt: skip
        assert isinstance(blueprint, ActorBlueprint)
        machine = self._rpc("spawn_actor")
        if attach_to is None:
            for one in machine.actors.values():
                if one.transform.location.distance(transform.location) < 2.0:
                    raise RuntimeError("Spawn failed because of collision at spawn position")
        return machine.add(blueprint.make(machine, transform, attach_to))


class WorldSnapshot:
    """See `carla.WorldSnapshot`."""

    def __init__(self, machine):
        self.frame = machine.frame
        self.timestamp = carla.Timestamp(machine.frame, 0.05 * machine.frame, 0.05, 0.0)
        self._found = {
            i: ActorSnapshot(i, one.get_transform(), one.velocity)
            for i, one in machine.actors.items()
            if not isinstance(one, Sensor)
        }

    def find(self, actor_id):
        return self._found.get(actor_id)

    def has_actor(self, actor_id):
        return actor_id in self._found

    def __len__(self):
        return len(self._found)


class ActorSnapshot:
    """See `carla.ActorSnapshot`."""

    def __init__(self, id, transform, velocity):
        self.id, self._transform, self._velocity = id, transform, velocity

    def get_transform(self):
        return self._transform

    def get_velocity(self):
        return self._velocity


class ActorList(list):
    """See `carla.ActorList`."""

    def filter(self, wildcard_pattern):
        return ActorList(one for one in self if fnmatch.fnmatch(one.type_id, wildcard_pattern))

    def find(self, id):
        return next((one for one in self if one.id == id), None)


class BlueprintLibrary(list):
    """See `carla.BlueprintLibrary`."""

    def find(self, id):
        for one in self:
            if one.id == id:
                return one
        raise IndexError(f"blueprint '{id}' not found")

    def filter(self, wildcard_pattern):
        return BlueprintLibrary(one for one in self if fnmatch.fnmatch(one.id, wildcard_pattern))


class Response:
    """See `carla.command.Response`."""

    def __init__(self, actor_id, error=""):
        self.actor_id, self.error = actor_id, error

    def has_error(self):
        return bool(self.error)


def _carry_out(machine, command):
    actor = machine.actors.get(command.actor_id)
    if actor is None:
        return Response(command.actor_id, f"unable to find actor {command.actor_id}: not found")
    match command:
        case carla.command.DestroyActor():
            actor.destroy()
        case carla.command.ApplyTransform():
            actor.set_transform(command.transform)
        case carla.command.ApplyTargetVelocity():
            actor.set_target_velocity(command.velocity)
        case carla.command.ApplyVehicleControl():
            actor.apply_control(command.control)
        case carla.command.ApplyWalkerState():
            actor.walk_to(command.transform, command.speed)
        case carla.command.SetSimulatePhysics():
            actor.set_simulate_physics(command.enabled)
        case _:
            raise Misuse(f"the stand-in knows no {command}")
    return Response(command.actor_id)


def _copied(settings):
    copy = carla.WorldSettings()
    for name in ("synchronous_mode", "no_rendering_mode", "fixed_delta_seconds"):
        setattr(copy, name, getattr(settings, name))
    return copy


__all__ = [
    "DEAD", "MACHINES", "Actor", "ActorList", "ActorSnapshot", "BlueprintLibrary", "Client",
    "Machine", "Misuse", "Response", "World", "WorldSnapshot", "shape",
]  # fmt: skip
