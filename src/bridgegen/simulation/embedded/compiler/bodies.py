"""The bodies of entities: how large they are, what they can do, and what they are."""

import math

from bridgegen.drivers.kinds import NAMES
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import SIREN
from bridgegen.openx.openscenario.participant_kinds import object_class_of
from bridgegen.simulation.embedded.compiler.tables import TRAILERS, Tables

Body = osc.Vehicle | osc.Pedestrian | osc.MiscObject | osc.ExternalObjectReference

_STEEPEST = 1.5  # rad, a steering angle that is as good as a right angle


def kind(body: Body) -> int:
    """Return what an entity is, see `bridgegen.drivers.kinds`."""
    return NAMES.index(object_class_of(body).name)


def has_siren(body: Body) -> bool:
    """Return whether a body is an emergency vehicle whose blue light and siren are on."""
    if not isinstance(body, osc.Vehicle) or body.properties is None:
        return False
    return str(body.properties.get(SIREN)).lower() in ("on", "true", "1")


def wheelbase(tables: Tables, body: osc.Vehicle) -> float:
    """Return the distance between the axles [m]; 0 of a vehicle with one axle."""
    rear, front = body.axles.rear, body.axles.front or body.axles.rear
    ahead = tables.literal(front, "positionX", front.position_x)
    return ahead - tables.literal(rear, "positionX", rear.position_x)


def measures(tables: Tables, body: Body) -> tuple[float, ...]:
    """Return a row of ``Program.bodies``; missing limits are infinite."""
    if isinstance(body, osc.ExternalObjectReference):
        tables.unsupported(body, "ExternalObjectReference")
        return (0.0,) * 8
    box = body.bounding_box
    height = tables.literal(box.dimensions, "height", box.dimensions.height)
    size = (
        tables.literal(box.dimensions, "length", box.dimensions.length),
        tables.literal(box.dimensions, "width", box.dimensions.width),
        tables.literal(box.center, "x", box.center.x),
    )
    if not isinstance(body, osc.Vehicle):
        return (*size, math.inf, math.inf, math.inf, math.inf, height)
    limits, axles = body.performance, body.axles
    front, distance = axles.front or axles.rear, wheelbase(tables, body)
    lock = tables.literal(front, "maxSteering", front.max_steering)
    bend = math.tan(min(lock, _STEEPEST)) / max(distance, 0.1)
    if distance <= 0.0 and body.vehicle_category in TRAILERS:
        bend = math.inf  # it has nothing to steer with, and goes where it is led
    elif distance <= 0.0:
        tables.unsupported(axles, "a Vehicle without a FrontAxle ahead of its RearAxle")
    return (
        *size,
        tables.literal(limits, "maxSpeed", limits.max_speed),
        tables.literal(limits, "maxAcceleration", limits.max_acceleration),
        tables.literal(limits, "maxDeceleration", limits.max_deceleration),
        bend,
        height,
    )
