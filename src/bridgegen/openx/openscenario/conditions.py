"""When it happens: triggers, and their conditions on values and on the state of entities."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import (
    ENTITY,
    PARAMETER,
    VARIABLE,
    AtLeast,
    Element,
    Range,
    Tag,
)
from bridgegen.openx.openscenario.entities import EntityRef, TriggeringEntities
from bridgegen.openx.openscenario.enumerations import (
    AngleType,
    ConditionEdge,
    CoordinateSystem,
    DirectionalDimension,
    ObjectType,
    RelativeDistanceType,
    RoutingAlgorithm,
    Rule,
    StoryboardElementState,
    StoryboardElementType,
)
from bridgegen.openx.openscenario.positions import Position
from bridgegen.openx.openscenario.values import (
    AnyValue,
    Boolean,
    DateTime,
    Double,
    Int,
    LiteralString,
    ParameterRef,
    String,
)

# --- Conditions on values: times, parameters, lights, and the storyboard's own parts ---


@dataclass(frozen=True)
class ParameterCondition(Element):
    """Compares a parameter with a value of its type."""

    parameter_ref: Annotated[LiteralString, PARAMETER]
    value: AnyValue
    rule: Rule | ParameterRef


@dataclass(frozen=True)
class VariableCondition(Element):
    """Compares a variable with a value of its type."""

    variable_ref: Annotated[LiteralString, VARIABLE]
    value: AnyValue
    rule: Rule | ParameterRef


@dataclass(frozen=True)
class UserDefinedValueCondition(Element):
    """Compares something that only its own simulator knows."""

    name: String
    value: String
    rule: Rule | ParameterRef


@dataclass(frozen=True)
class TimeOfDayCondition(Element):
    """Compares the date and time in the scenario."""

    date_time: DateTime
    rule: Rule | ParameterRef


@dataclass(frozen=True)
class SimulationTimeCondition(Element):
    """Compares the time since the scenario's start [s]."""

    value: Double
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
class TrafficSignalControllerCondition(Element):
    """True while a controller of traffic lights is in a phase."""

    traffic_signal_controller_ref: String
    phase: String


@dataclass(frozen=True)
class ByValueCondition(Element):
    """One of the conditions on a value."""

    condition: (
        ParameterCondition
        | TimeOfDayCondition
        | SimulationTimeCondition
        | StoryboardElementStateCondition
        | UserDefinedValueCondition
        | TrafficSignalCondition
        | TrafficSignalControllerCondition
        | VariableCondition
    )


# --- Conditions on the state of entities ---


@dataclass(frozen=True)
class DistanceCondition(Element):
    """Compares the distance to a position [m], from the box if ``freespace``.

    ``along_route`` is 1.0's ``relative_distance_type``: longitudinal if true, else euclidian.
    """

    value: Double
    freespace: Boolean
    rule: Rule | ParameterRef
    position: Position
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    relative_distance_type: RelativeDistanceType | ParameterRef | None = None
    routing_algorithm: RoutingAlgorithm | ParameterRef | None = None
    along_route: Boolean | None = None


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
    """Compares the time [s] that the entity needs to where another one is now.

    ``along_route`` is as in `DistanceCondition`.
    """

    entity_ref: Annotated[String, ENTITY]
    freespace: Boolean
    rule: Rule | ParameterRef
    value: Double
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    relative_distance_type: RelativeDistanceType | ParameterRef | None = None
    routing_algorithm: RoutingAlgorithm | ParameterRef | None = None
    along_route: Boolean | None = None


@dataclass(frozen=True)
class TimeToCollisionConditionTarget(Element):
    """The other entity, or a position."""

    target: EntityRef | Position


@dataclass(frozen=True)
class TimeToCollisionCondition(Element):
    """Compares the time [s] until a contact at present speeds.

    ``along_route`` is as in `DistanceCondition`.
    """

    target: TimeToCollisionConditionTarget
    freespace: Boolean
    rule: Rule | ParameterRef
    value: Double
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    relative_distance_type: RelativeDistanceType | ParameterRef | None = None
    routing_algorithm: RoutingAlgorithm | ParameterRef | None = None
    along_route: Boolean | None = None


@dataclass(frozen=True)
class SpeedCondition(Element):
    """Compares the entity's speed [m/s], or its part along one of its axes."""

    rule: Rule | ParameterRef
    value: Double
    direction: DirectionalDimension | ParameterRef | None = None


@dataclass(frozen=True)
class RelativeSpeedCondition(Element):
    """Compares the entity's speed less another one's [m/s], or its part along one of its axes."""

    entity_ref: Annotated[String, ENTITY]
    rule: Rule | ParameterRef
    value: Double
    direction: DirectionalDimension | ParameterRef | None = None


@dataclass(frozen=True)
class AccelerationCondition(Element):
    """Compares the entity's acceleration [m/s²], or its part along one of its axes."""

    rule: Rule | ParameterRef
    value: Double
    direction: DirectionalDimension | ParameterRef | None = None


@dataclass(frozen=True)
class TraveledDistanceCondition(Element):
    """True once the entity has travelled so far [m]."""

    value: Annotated[Double, Range(0.0)]


@dataclass(frozen=True)
class StandStillCondition(Element):
    """True once the entity has stood for so long [s]."""

    duration: Annotated[Double, Range(0.0)]


@dataclass(frozen=True)
class EndOfRoadCondition(Element):
    """True once the entity has been at the end of a road for so long [s]."""

    duration: Annotated[Double, Range(0.0)]


@dataclass(frozen=True)
class OffroadCondition(Element):
    """True once the entity has been off the road for so long [s]."""

    duration: Annotated[Double, Range(0.0)]


@dataclass(frozen=True)
class ByObjectType(Element):
    """Any entity of a kind."""

    type: ObjectType | ParameterRef


@dataclass(frozen=True)
class CollisionCondition(Element):
    """True while the entity touches another."""

    target: Annotated[EntityRef | ByObjectType, Tag("EntityRef"), Tag("ByType")]


@dataclass(frozen=True)
class RelativeLaneRange(Element):
    """Lanes from the entity's own, counted to the left; an end that is missing is open."""

    from_: Int | None = None
    to: Int | None = None


@dataclass(frozen=True)
class RelativeClearanceCondition(Element):
    """True while no entity is within these distances ahead or behind [m], on some lanes."""

    opposite_lanes: Boolean
    free_space: Boolean
    distance_forward: Annotated[Double | None, Range(0.0)] = None
    distance_backward: Annotated[Double | None, Range(0.0)] = None
    relative_lane_ranges: tuple[RelativeLaneRange, ...] = ()
    entity_refs: tuple[EntityRef, ...] = ()


@dataclass(frozen=True)
class AngleCondition(Element):
    """True while an angle of the entity is as given [rad]."""

    angle_type: AngleType | ParameterRef
    angle: Double
    angle_tolerance: Annotated[Double, Range(0.0)]
    coordinate_system: CoordinateSystem | ParameterRef | None = None


@dataclass(frozen=True)
class RelativeAngleCondition(Element):
    """True while an angle of the entity is so much more than another one's [rad]."""

    entity_ref: Annotated[String, ENTITY]
    angle_type: AngleType | ParameterRef
    angle: Double
    angle_tolerance: Annotated[Double, Range(0.0)]
    coordinate_system: CoordinateSystem | ParameterRef | None = None


@dataclass(frozen=True)
class EntityCondition(Element):
    """One of the conditions on an entity."""

    condition: (
        EndOfRoadCondition
        | CollisionCondition
        | OffroadCondition
        | TimeHeadwayCondition
        | TimeToCollisionCondition
        | AccelerationCondition
        | StandStillCondition
        | SpeedCondition
        | RelativeSpeedCondition
        | TraveledDistanceCondition
        | ReachPositionCondition
        | DistanceCondition
        | RelativeDistanceCondition
        | RelativeClearanceCondition
        | AngleCondition
        | RelativeAngleCondition
    )


# --- When it happens: triggers and their conditions ---


CRITERIA = "criteria_"
"""Prefix of the names of ScenarioRunner's criteria."""


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

    @property
    def is_criterion(self) -> bool:
        """Whether it is one of ScenarioRunner's: what a run is judged by, no reason to stop."""
        return (
            isinstance(self.name, str)
            and self.name.startswith(CRITERIA)
            and isinstance(self.condition, ByValueCondition)
            and isinstance(self.condition.condition, ParameterCondition)
        )


@dataclass(frozen=True)
class ConditionGroup(Element):
    """Conditions that must all be true at once."""

    conditions: Annotated[tuple[Condition, ...], AtLeast(1)]


@dataclass(frozen=True)
class Trigger(Element):
    """Condition groups of which one suffices; none is never true."""

    condition_groups: tuple[ConditionGroup, ...] = ()
