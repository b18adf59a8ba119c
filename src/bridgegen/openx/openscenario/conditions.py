"""When it happens: triggers and their conditions."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import ENTITY, AtLeast, Element, Range
from bridgegen.openx.openscenario.entities import EntityRef, TriggeringEntities
from bridgegen.openx.openscenario.enumerations import (
    ConditionEdge,
    CoordinateSystem,
    RelativeDistanceType,
    RoutingAlgorithm,
    Rule,
    StoryboardElementState,
    StoryboardElementType,
)
from bridgegen.openx.openscenario.positions import Position
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String


@dataclass(frozen=True)
class SimulationTimeCondition(Element):
    """Compares the time since the scenario's start [s]."""

    value: Annotated[Double, Range(0.0)]
    rule: Rule | ParameterRef


@dataclass(frozen=True)
class StoryboardElementStateCondition(Element):
    """True while (or at the instant when) a part of the storyboard is in a state."""

    storyboard_element_type: StoryboardElementType | ParameterRef
    storyboard_element_ref: String
    state: StoryboardElementState | ParameterRef


@dataclass(frozen=True)
class TrafficSignalCondition(Element):
    """True while a traffic light is in a state."""

    name: String
    state: String


@dataclass(frozen=True)
class ByValueCondition(Element):
    """One of the conditions on a value."""

    condition: SimulationTimeCondition | StoryboardElementStateCondition | TrafficSignalCondition


@dataclass(frozen=True)
class RelativeDistanceCondition(Element):
    """Compares the distance to an entity [m], between boxes if ``freespace``."""

    entity_ref: Annotated[String, ENTITY]
    relative_distance_type: RelativeDistanceType | ParameterRef
    value: Double
    freespace: Boolean
    rule: Rule | ParameterRef
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    routing_algorithm: RoutingAlgorithm | ParameterRef | None = None


@dataclass(frozen=True)
class ReachPositionCondition(Element):
    """True within ``tolerance`` [m] of a position."""

    tolerance: Annotated[Double, Range(0.0)]
    position: Position


@dataclass(frozen=True)
class TimeHeadwayCondition(Element):
    """Compares the time [s] that the entity needs to where another one is now."""

    entity_ref: Annotated[String, ENTITY]
    freespace: Boolean
    rule: Rule | ParameterRef
    value: Double
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    relative_distance_type: RelativeDistanceType | ParameterRef | None = None
    routing_algorithm: RoutingAlgorithm | ParameterRef | None = None


@dataclass(frozen=True)
class TimeToCollisionConditionTarget(Element):
    """With whom, or where."""

    target: EntityRef | Position


@dataclass(frozen=True)
class TimeToCollisionCondition(Element):
    """Compares the time [s] until a contact at present speeds."""

    target: TimeToCollisionConditionTarget
    freespace: Boolean
    rule: Rule | ParameterRef
    value: Double
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    relative_distance_type: RelativeDistanceType | ParameterRef | None = None
    routing_algorithm: RoutingAlgorithm | ParameterRef | None = None


@dataclass(frozen=True)
class SpeedCondition(Element):
    """Compares the entity's speed [m/s]."""

    rule: Rule | ParameterRef
    value: Double


@dataclass(frozen=True)
class TraveledDistanceCondition(Element):
    """True once the entity has travelled so far [m]."""

    value: Annotated[Double, Range(0.0)]


@dataclass(frozen=True)
class StandStillCondition(Element):
    """True once the entity has stood for so long [s]."""

    duration: Annotated[Double, Range(0.0)]


@dataclass(frozen=True)
class CollisionCondition(Element):
    """True while the entity touches another."""

    target: EntityRef


@dataclass(frozen=True)
class EntityCondition(Element):
    """One of the conditions on an entity."""

    condition: (
        TimeHeadwayCondition
        | TimeToCollisionCondition
        | SpeedCondition
        | TraveledDistanceCondition
        | StandStillCondition
        | CollisionCondition
        | RelativeDistanceCondition
        | ReachPositionCondition
    )


@dataclass(frozen=True)
class ByEntityCondition(Element):
    """A condition on the state of entities."""

    triggering_entities: TriggeringEntities
    entity_condition: EntityCondition


@dataclass(frozen=True)
class Condition(Element):
    """A condition, which change of it counts, and how much later [s]."""

    name: String
    delay: Annotated[Double, Range(0.0)]
    condition_edge: ConditionEdge | ParameterRef
    condition: ByEntityCondition | ByValueCondition


@dataclass(frozen=True)
class ConditionGroup(Element):
    """Conditions that must all be true at once."""

    conditions: Annotated[tuple[Condition, ...], AtLeast(1)]


@dataclass(frozen=True)
class Trigger(Element):
    """Condition groups of which one suffices; none is never true."""

    condition_groups: tuple[ConditionGroup, ...] = ()
