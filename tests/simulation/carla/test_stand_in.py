"""The stand-in takes what the wheel says that CARLA takes."""

import inspect
import re

import carla
import numpy as np
import pytest
from tests.approval import refuses

from . import stand_in, stand_in_actors, stand_in_sensors
from .stand_in import DEFAULT_MAP, MACHINES, Client, Misuse

OURS = {
    "Client": stand_in.Client,
    "World": stand_in.World,
    "WorldSnapshot": stand_in.WorldSnapshot,
    "ActorSnapshot": stand_in.ActorSnapshot,
    "ActorList": stand_in.ActorList,
    "BlueprintLibrary": stand_in.BlueprintLibrary,
    "ActorBlueprint": stand_in_actors.ActorBlueprint,
    "ActorAttribute": stand_in_actors.ActorAttribute,
    "Actor": stand_in_actors.Actor,
    "Vehicle": stand_in_actors.Vehicle,
    "Walker": stand_in_actors.Walker,
    "TrafficLight": stand_in_actors.TrafficLight,
    "Sensor": stand_in_actors.Sensor,
    "TrafficManager": stand_in_actors.TrafficManager,
    "Image": stand_in_sensors.Image,
    "LidarMeasurement": stand_in_sensors.LidarMeasurement,
    "SensorData": stand_in_sensors.SensorData,
}
INSIDE = {"make", "step", "sense", "data", "walk_to", "drive", "append", "extend", "insert"}
"""Methods of the stand-in's own, which our adapter never sees."""

LISTS = set(dir(list))


def methods():
    return [
        (name, method)
        for name, cls in OURS.items()
        for method, what in vars(cls).items()
        if not method.startswith("_") and inspect.isfunction(what) and method not in INSIDE
    ]


@pytest.mark.parametrize(("name", "method"), methods())
def test_it_has_the_methods_and_arguments_of_the_wheel(name, method):
    theirs = getattr(carla, name)
    assert hasattr(theirs, method), f"carla.{name} has no {method}"
    told = [
        names
        for line in (getattr(theirs, method).__doc__ or "").splitlines()
        if line.startswith(f"{method}(")
        and (names := re.findall(r"\(\w+\)(\w+)", line.split(") ->")[0]))
    ]
    ours = list(inspect.signature(getattr(OURS[name], method)).parameters)
    assert told
    assert any(
        len(names) == len(ours)
        and all(a == b or a.startswith("arg") for a, b in zip(names[1:], ours[1:], strict=True))
        for names in told
    ), f"{name}.{method}{ours}, and the wheel has {told}"


def test_the_adapter_uses_nothing_else():
    """What the wheel's objects have and the stand-in's have not would fail in its tests."""
    assert not hasattr(stand_in.World, "wait_for_tick")
    assert hasattr(carla.World, "wait_for_tick")


def test_a_tick_needs_synchronous_mode(machine):
    world = Client(port=machine.port).get_world()
    with refuses(Misuse):
        world.tick()


def test_who_is_destroyed_does_nothing(machine):
    world = Client(port=machine.port).get_world()
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    actor = world.spawn_actor(blueprint, carla.Transform())
    with refuses(RuntimeError):
        world.spawn_actor(blueprint, carla.Transform())
    actor.destroy()
    with pytest.raises(RuntimeError, match="already destroyed"):
        actor.set_target_velocity(carla.Vector3D())
    (answer,) = Client(port=machine.port).apply_batch_sync(
        [carla.command.DestroyActor(actor.id)], False
    )
    assert answer.has_error()


def test_an_old_world_is_no_more(machine):
    client = Client(port=machine.port)
    world = client.get_world()
    client.load_world(DEFAULT_MAP.rpartition("/")[2])
    with refuses(RuntimeError):
        world.get_settings()


def test_a_car_without_pedals_rolls_out(machine):
    client = Client(port=machine.port)
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, 0.05
    world.apply_settings(settings)
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    actor = world.spawn_actor(blueprint, carla.Transform())
    actor.set_target_velocity(carla.Vector3D(x=1.0))
    for _ in range(300):
        world.tick()
    assert actor.get_velocity().x == 0.0
    assert 2.0 < actor.get_transform().location.x < 4.0
    assert MACHINES[machine.port] is machine
    assert np.isfinite(actor.get_transform().location.y)
