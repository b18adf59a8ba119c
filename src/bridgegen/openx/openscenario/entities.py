"""Entities: vehicles with their boxes and limits, and their drivers."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.catalog_files import CATALOG
from bridgegen.openx.openscenario.declarations import ParameterDeclarations, Properties
from bridgegen.openx.openscenario.element import (
    ENTITY,
    FINITE,
    AtLeast,
    Element,
    FiniteDouble,
    Range,
    Tag,
)
from bridgegen.openx.openscenario.enumerations import (
    ControllerType,
    MiscObjectCategory,
    ObjectType,
    PedestrianCategory,
    Role,
    TriggeringEntitiesRule,
    VehicleCategory,
)
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String

_NOT_NEGATIVE = Range(0.0)
_EXTENT = Range(0.0, FINITE, above=True)  # a box without an area has no distance to others


@dataclass(frozen=True)
class Center(Element):
    """The middle of a bounding box from the reference point [m], x ahead, y left, z up."""

    x: FiniteDouble
    y: FiniteDouble
    z: FiniteDouble


@dataclass(frozen=True)
class Dimensions(Element):
    """The size of a bounding box [m]."""

    width: Annotated[Double, _EXTENT]
    length: Annotated[Double, _EXTENT]
    height: Annotated[Double, Range(0.0, FINITE)]


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
    position_x: FiniteDouble
    position_z: FiniteDouble


@dataclass(frozen=True)
class Axles(Element):
    """The axles of a vehicle."""

    front: Annotated[Axle | None, Tag("FrontAxle")]
    rear: Annotated[Axle, Tag("RearAxle")]
    additional: Annotated[tuple[Axle, ...], Tag("AdditionalAxle")] = ()


@dataclass(frozen=True)
class TrailerHitch(Element):
    """Where a trailer is coupled, from the reference point [m]."""

    dx: Double
    dz: Double | None = None


@dataclass(frozen=True)
class TrailerCoupler(Element):
    """Where a trailer couples itself, from the reference point [m]."""

    dx: Double
    dz: Double | None = None


@dataclass(frozen=True)
class Vehicle(Element):
    """A vehicle; its reference point is the rear axle's middle on the ground."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    vehicle_category: VehicleCategory | ParameterRef
    bounding_box: BoundingBox
    performance: Performance
    axles: Axles
    properties: Properties | None = None
    role: Role | ParameterRef | None = None
    mass: Annotated[Double | None, _NOT_NEGATIVE] = None
    model3d: String | None = None
    trailer_hitch: TrailerHitch | None = None
    trailer_coupler: TrailerCoupler | None = None
    trailer: "Trailer | None" = None


@dataclass(frozen=True)
class Pedestrian(Element):
    """A pedestrian, or an animal; the reference point is the middle, on the ground."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    pedestrian_category: PedestrianCategory | ParameterRef
    mass: Annotated[Double, _NOT_NEGATIVE]
    bounding_box: BoundingBox
    properties: Properties | None = None
    model: String | None = None
    model3d: String | None = None
    role: Role | ParameterRef | None = None


@dataclass(frozen=True)
class MiscObject(Element):
    """Anything else that stands somewhere."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    misc_object_category: MiscObjectCategory | ParameterRef
    mass: Annotated[Double, _NOT_NEGATIVE]
    bounding_box: BoundingBox
    properties: Properties | None = None
    model3d: String | None = None


@dataclass(frozen=True)
class Controller(Element):
    """A driver; the properties configure it."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    properties: Properties | None = None
    controller_type: ControllerType | ParameterRef | None = None


@dataclass(frozen=True)
class ObjectController(Element):
    """The controller that an entity starts with."""

    controller: Annotated[Controller, CATALOG]
    name: String | None = None


@dataclass(frozen=True)
class ExternalObjectReference(Element):
    """A body that another file describes."""

    name: String


@dataclass(frozen=True)
class ScenarioObject(Element):
    """A participant by its name."""

    name: String
    entity_object: Annotated[Vehicle | Pedestrian | MiscObject | ExternalObjectReference, CATALOG]
    object_controllers: tuple[ObjectController, ...] = ()


@dataclass(frozen=True)
class EntityRef(Element):
    """A participant that is meant."""

    entity_ref: Annotated[String, ENTITY]


@dataclass(frozen=True)
class Trailer(Element):
    """What a vehicle pulls at the start."""

    trailer: Annotated[ScenarioObject | EntityRef, Tag("Trailer"), Tag("TrailerRef")]


@dataclass(frozen=True)
class ByType(Element):
    """All participants of a kind."""

    object_type: ObjectType | ParameterRef


@dataclass(frozen=True)
class SelectedEntities(Element):
    """Some participants, by name or by kind."""

    members: Annotated[tuple[EntityRef | ByType, ...], AtLeast(1)]


@dataclass(frozen=True)
class EntitySelection(Element):
    """A name for several participants together."""

    name: String
    members: Annotated[SelectedEntities, Tag("Members")]


@dataclass(frozen=True)
class Entities(Element):
    """All participants."""

    scenario_objects: tuple[ScenarioObject, ...] = ()
    entity_selections: tuple[EntitySelection, ...] = ()


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
