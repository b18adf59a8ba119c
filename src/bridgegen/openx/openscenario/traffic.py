"""Traffic that is there in numbers: sources, sinks, swarms and areas."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.declarations import CATALOG, Properties
from bridgegen.openx.openscenario.element import (
    ENTITY,
    ROAD,
    AtLeast,
    Element,
    Range,
    Tag,
)
from bridgegen.openx.openscenario.entities import (
    Controller,
    ExternalObjectReference,
    MiscObject,
    ObjectController,
    Pedestrian,
    Vehicle,
)
from bridgegen.openx.openscenario.enumerations import Role, VehicleCategory
from bridgegen.openx.openscenario.positions import Position
from bridgegen.openx.openscenario.values import (
    Boolean,
    Double,
    Int,
    ParameterRef,
    String,
    UnsignedInt,
)

_NOT_NEGATIVE = Range(0.0)


@dataclass(frozen=True)
class VehicleCategoryDistributionEntry(Element):
    """A kind of vehicle and its weight."""

    category: VehicleCategory | ParameterRef
    weight: Annotated[Double, _NOT_NEGATIVE]


@dataclass(frozen=True)
class VehicleCategoryDistribution(Element):
    """The kinds of vehicles."""

    entries: Annotated[tuple[VehicleCategoryDistributionEntry, ...], AtLeast(1)]


@dataclass(frozen=True)
class VehicleRoleDistributionEntry(Element):
    """A role of vehicles and its weight."""

    role: Role | ParameterRef
    weight: Annotated[Double, _NOT_NEGATIVE]


@dataclass(frozen=True)
class VehicleRoleDistribution(Element):
    """The roles of vehicles."""

    entries: Annotated[tuple[VehicleRoleDistributionEntry, ...], AtLeast(1)]


@dataclass(frozen=True)
class ControllerDistributionEntry(Element):
    """A controller and its weight."""

    controller: Annotated[Controller, CATALOG]
    weight: Annotated[Double, _NOT_NEGATIVE]


@dataclass(frozen=True)
class ControllerDistribution(Element):
    """The vehicles' drivers."""

    entries: Annotated[tuple[ControllerDistributionEntry, ...], AtLeast(1)]


@dataclass(frozen=True)
class TrafficDefinition(Element):
    """What traffic is made of; 1.3's `TrafficDistribution` takes its place."""

    name: String
    vehicle_category_distribution: VehicleCategoryDistribution
    vehicle_role_distribution: VehicleRoleDistribution | None = field(default=None, kw_only=True)
    controller_distribution: ControllerDistribution


@dataclass(frozen=True)
class ScenarioObjectTemplate(Element):
    """An entity without a name, to be made many times."""

    entity_object: Annotated[Vehicle | Pedestrian | MiscObject | ExternalObjectReference, CATALOG]
    object_controllers: tuple[ObjectController, ...] = ()


@dataclass(frozen=True)
class EntityDistributionEntry(Element):
    """An entity and its weight."""

    template: Annotated[ScenarioObjectTemplate, Tag("ScenarioObjectTemplate")]
    weight: Annotated[Double, _NOT_NEGATIVE]


@dataclass(frozen=True)
class EntityDistribution(Element):
    """The entities of which traffic is made."""

    entries: Annotated[tuple[EntityDistributionEntry, ...], AtLeast(1)]


@dataclass(frozen=True)
class TrafficDistributionEntry(Element):
    """A make-up of traffic and its weight."""

    entity_distribution: EntityDistribution
    weight: Annotated[Double, _NOT_NEGATIVE]
    properties: Properties | None = None


@dataclass(frozen=True)
class TrafficDistribution(Element):
    """What traffic is made of."""

    entries: Annotated[tuple[TrafficDistributionEntry, ...], AtLeast(1)]


@dataclass(frozen=True)
class TrafficSourceAction(Element):
    """Vehicles come, so many a second, within a radius [m], at a speed [m/s].

    ``velocity`` is the name of ``speed`` up to 1.1.
    """

    radius: Annotated[Double, _NOT_NEGATIVE]
    rate: Annotated[Double, _NOT_NEGATIVE]
    position: Position
    traffic_definition: TrafficDefinition | None = None
    traffic_distribution: TrafficDistribution | None = None
    speed: Double | None = None
    velocity: Double | None = None


@dataclass(frozen=True)
class TrafficSinkAction(Element):
    """Vehicles go, so many a second, within a radius [m]."""

    radius: Annotated[Double, _NOT_NEGATIVE]
    position: Position
    traffic_definition: TrafficDefinition | None = None
    rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class CentralSwarmObject(Element):
    """Whom a swarm surrounds."""

    entity_ref: Annotated[String, ENTITY]


@dataclass(frozen=True)
class SpeedRange(Element):
    """From which speed to which [m/s]."""

    lower_limit: Double
    upper_limit: Double


@dataclass(frozen=True)
class DirectionOfTravelDistribution(Element):
    """The weights of going the same way and the other way."""

    same: Annotated[Double, _NOT_NEGATIVE]
    opposite: Annotated[Double, _NOT_NEGATIVE]


@dataclass(frozen=True)
class TrafficSwarmAction(Element):
    """Vehicles around an entity, between a circle and an ellipse [m]."""

    inner_radius: Annotated[Double, _NOT_NEGATIVE]
    number_of_vehicles: UnsignedInt
    offset: Double
    semi_major_axis: Annotated[Double, _NOT_NEGATIVE]
    semi_minor_axis: Annotated[Double, _NOT_NEGATIVE]
    central_object: Annotated[CentralSwarmObject, Tag("CentralObject")]
    traffic_definition: TrafficDefinition | None = None
    traffic_distribution: TrafficDistribution | None = None
    initial_speed_range: Annotated[SpeedRange | None, Tag("InitialSpeedRange")] = None
    direction_of_travel_distribution: DirectionOfTravelDistribution | None = None
    velocity: Double | None = None


@dataclass(frozen=True)
class Polygon(Element):
    """An area by its corners."""

    positions: Annotated[tuple[Position, ...], AtLeast(3)]


@dataclass(frozen=True)
class Lane(Element):
    """A lane by its id."""

    id: Int


@dataclass(frozen=True)
class RoadCursor(Element):
    """A place on a road [m], and on which lanes."""

    road_id: Annotated[String, ROAD]
    s: Annotated[Double | None, _NOT_NEGATIVE] = None
    lanes: tuple[Lane, ...] = ()


@dataclass(frozen=True)
class RoadRange(Element):
    """Roads from place to place [m]."""

    cursors: Annotated[tuple[RoadCursor, ...], AtLeast(2)]
    length: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class TrafficArea(Element):
    """Where traffic is: in a polygon, or on stretches of road."""

    areas: Annotated[tuple[Polygon | RoadRange, ...], AtLeast(1)]


@dataclass(frozen=True)
class TrafficAreaAction(Element):
    """So many entities in an area, once or kept so."""

    number_of_entities: UnsignedInt
    continuous: Boolean
    traffic_distribution: TrafficDistribution
    traffic_area: TrafficArea


@dataclass(frozen=True)
class TrafficStopAction(Element):
    """The end of a traffic action."""


@dataclass(frozen=True)
class TrafficAction(Element):
    """One of the actions on traffic."""

    action: (
        TrafficSourceAction
        | TrafficSinkAction
        | TrafficSwarmAction
        | TrafficAreaAction
        | TrafficStopAction
    )
    traffic_name: String | None = None
