"""Entities: vehicles with their boxes and limits, their drivers and controllers."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.declarations import CATALOG, ParameterDeclarations, Properties
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
    AutomaticGearType,
    ControllerType,
    MiscObjectCategory,
    ObjectType,
    PedestrianCategory,
    Role,
    TriggeringEntitiesRule,
    VehicleCategory,
)
from bridgegen.openx.openscenario.values import Boolean, Double, Int, ParameterRef, String

_NOT_NEGATIVE = Range(0.0)
_EXTENT = Range(0.0, FINITE)


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
    height: Annotated[Double, _EXTENT]


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


# --- Controllers: assigned, switched on and off, and overridden at their pedals ---


_SHARE = Range(0.0, 1.0)


@dataclass(frozen=True)
class AssignControllerAction(Element):
    """Getting a controller, and which of what it does is switched on."""

    controller: Annotated[Controller | ObjectController, CATALOG]
    activate_lateral: Boolean | None = None
    activate_longitudinal: Boolean | None = None
    activate_animation: Boolean | None = None
    activate_lighting: Boolean | None = None


@dataclass(frozen=True)
class ActivateControllerAction(Element):
    """Switching on or off what a controller does; what is missing stays as it is.

    ``controller_ref`` is 1.2's name of ``object_controller_ref``.
    """

    lateral: Boolean | None = None
    longitudinal: Boolean | None = None
    animation: Boolean | None = None
    lighting: Boolean | None = None
    object_controller_ref: String | None = None
    controller_ref: String | None = None


@dataclass(frozen=True)
class OverrideThrottleAction(Element):
    """The throttle's position, 0 to 1."""

    active: Boolean
    value: Annotated[Double, _SHARE]
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class BrakePercent(Element):
    """A brake's position, 0 to 1, and how fast it gets there [1/s]."""

    value: Annotated[Double, _SHARE]
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class BrakeForce(Element):
    """A brake's force [N], and how fast it gets there [N/s]."""

    value: Annotated[Double, _NOT_NEGATIVE]
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class OverrideBrakeAction(Element):
    """The service brake, or the parking brake; ``value`` (0 to 1) is up to 1.1."""

    active: Boolean
    brake: BrakePercent | BrakeForce | None = None
    value: Annotated[Double | None, _SHARE] = None


@dataclass(frozen=True)
class OverrideClutchAction(Element):
    """The clutch's position, 0 to 1."""

    active: Boolean
    value: Annotated[Double, _SHARE]
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class OverrideSteeringWheelAction(Element):
    """The steering wheel's angle [rad]."""

    active: Boolean
    value: Double
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None
    max_torque: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class ManualGear(Element):
    """A gear by its number; negative ones lead back."""

    number: Int


@dataclass(frozen=True)
class AutomaticGear(Element):
    """A position of an automatic gearbox."""

    gear: AutomaticGearType | ParameterRef


@dataclass(frozen=True)
class OverrideGearAction(Element):
    """The gear; ``number`` is up to 1.1."""

    active: Boolean
    gear: ManualGear | AutomaticGear | None = None
    number: Double | None = None


@dataclass(frozen=True)
class OverrideControllerValueAction(Element):
    """Holding controls, whatever the controller does; what is missing stays as it is."""

    throttle: Annotated[OverrideThrottleAction | None, Tag("Throttle")] = None
    brake: Annotated[OverrideBrakeAction | None, Tag("Brake")] = None
    clutch: Annotated[OverrideClutchAction | None, Tag("Clutch")] = None
    parking_brake: Annotated[OverrideBrakeAction | None, Tag("ParkingBrake")] = None
    steering_wheel: Annotated[OverrideSteeringWheelAction | None, Tag("SteeringWheel")] = None
    gear: Annotated[OverrideGearAction | None, Tag("Gear")] = None


@dataclass(frozen=True)
class ControllerAction(Element):
    """What is done to a controller: 1.0 has the first two, 1.3 one of the three."""

    assign_controller_action: AssignControllerAction | None = None
    override_controller_value_action: OverrideControllerValueAction | None = None
    activate_controller_action: ActivateControllerAction | None = None
