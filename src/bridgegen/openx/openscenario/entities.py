"""Who takes part: vehicles with their boxes and limits, and who drives them."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.declarations import Properties
from bridgegen.openx.openscenario.element import ENTITY, AtLeast, Element, Range, Tag
from bridgegen.openx.openscenario.enumerations import (
    ControllerType,
    MiscObjectCategory,
    PedestrianCategory,
    Role,
    TriggeringEntitiesRule,
    VehicleCategory,
)
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String

_NOT_NEGATIVE = Range(0.0)


@dataclass(frozen=True)
class Center(Element):
    """The middle of a bounding box from the reference point [m], x ahead, y left, z up."""

    x: Double
    y: Double
    z: Double


@dataclass(frozen=True)
class Dimensions(Element):
    """The size of a bounding box [m]."""

    width: Annotated[Double, _NOT_NEGATIVE]
    length: Annotated[Double, _NOT_NEGATIVE]
    height: Annotated[Double, _NOT_NEGATIVE]


@dataclass(frozen=True)
class BoundingBox(Element):
    """The box around an entity."""

    center: Center
    dimensions: Dimensions


@dataclass(frozen=True)
class Performance(Element):
    """The limits of a vehicle [m/s, m/s², m/s³]."""

    max_speed: Annotated[Double, _NOT_NEGATIVE]
    max_acceleration: Annotated[Double, _NOT_NEGATIVE]
    max_deceleration: Annotated[Double, _NOT_NEGATIVE]
    max_acceleration_rate: Annotated[Double | None, _NOT_NEGATIVE] = None
    max_deceleration_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class Axle(Element):
    """An axle; its place is from the reference point [m], its steering in [rad]."""

    max_steering: Annotated[Double, _NOT_NEGATIVE]
    wheel_diameter: Annotated[Double, _NOT_NEGATIVE]
    track_width: Annotated[Double, _NOT_NEGATIVE]
    position_x: Double
    position_z: Double


@dataclass(frozen=True)
class Axles(Element):
    """The axles of a vehicle."""

    front: Annotated[Axle | None, Tag("FrontAxle")]
    rear: Annotated[Axle, Tag("RearAxle")]
    additional: Annotated[tuple[Axle, ...], Tag("AdditionalAxle")] = ()


@dataclass(frozen=True)
class Vehicle(Element):
    """A vehicle; its reference point is the rear axle's middle on the ground."""

    name: String
    vehicle_category: VehicleCategory | ParameterRef
    bounding_box: BoundingBox
    performance: Performance
    axles: Axles
    properties: Properties | None = None
    role: Role | ParameterRef | None = None
    mass: Annotated[Double | None, _NOT_NEGATIVE] = None
    model3d: String | None = None


@dataclass(frozen=True)
class Pedestrian(Element):
    """Somebody on foot, or an animal; the reference point is the middle, on the ground."""

    name: String
    pedestrian_category: PedestrianCategory | ParameterRef
    mass: Annotated[Double, _NOT_NEGATIVE]
    bounding_box: BoundingBox
    properties: Properties | None = None
    model: String | None = None
    model3d: String | None = None


@dataclass(frozen=True)
class MiscObject(Element):
    """Anything else that stands somewhere."""

    name: String
    misc_object_category: MiscObjectCategory | ParameterRef
    mass: Annotated[Double, _NOT_NEGATIVE]
    bounding_box: BoundingBox
    properties: Properties | None = None
    model3d: String | None = None


@dataclass(frozen=True)
class Controller(Element):
    """Who drives; the properties say how."""

    name: String
    properties: Properties | None = None
    controller_type: ControllerType | ParameterRef | None = None


@dataclass(frozen=True)
class ObjectController(Element):
    """The controller that an entity starts with."""

    controller: Controller
    name: String | None = None


@dataclass(frozen=True)
class ScenarioObject(Element):
    """A participant by its name."""

    name: String
    entity_object: Vehicle | Pedestrian | MiscObject
    object_controllers: tuple[ObjectController, ...] = ()


@dataclass(frozen=True)
class Entities(Element):
    """All participants."""

    scenario_objects: tuple[ScenarioObject, ...] = ()


@dataclass(frozen=True)
class EntityRef(Element):
    """A participant that is meant."""

    entity_ref: Annotated[String, ENTITY]


@dataclass(frozen=True)
class Actors(Element):
    """Whose private actions a maneuver group holds."""

    select_triggering_entities: Boolean
    entity_refs: tuple[EntityRef, ...] = ()


@dataclass(frozen=True)
class TriggeringEntities(Element):
    """Whose state a condition looks at."""

    triggering_entities_rule: TriggeringEntitiesRule | ParameterRef
    entity_refs: Annotated[tuple[EntityRef, ...], AtLeast(1)]
