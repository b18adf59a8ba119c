"""When it happens: triggers and their conditions."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import ENTITY, AtLeast, Element, Range
from bridgegen.openx.openscenario.entities import TriggeringEntities
from bridgegen.openx.openscenario.enumerations import (
    ConditionEdge,
    CoordinateSystem,
    RelativeDistanceType,
    RoutingAlgorithm,
    Rule,
)
from bridgegen.openx.openscenario.positions import Position
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String


@dataclass(frozen=True)
class SimulationTimeCondition(Element):
    """Compares the time since the scenario's start [s]."""

    value: Annotated[Double, Range(0.0)]
    rule: Rule | ParameterRef


@dataclass(frozen=True)
class ByValueCondition(Element):
    """One of the conditions on a value."""

    condition: SimulationTimeCondition


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
class EntityCondition(Element):
    """One of the conditions on an entity."""

    condition: RelativeDistanceCondition | ReachPositionCondition


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
