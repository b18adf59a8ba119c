"""When it happens: triggers and their conditions."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import AtLeast, Element, Range
from bridgegen.openx.openscenario.entities import TriggeringEntities
from bridgegen.openx.openscenario.entity_conditions import EntityCondition
from bridgegen.openx.openscenario.enumerations import ConditionEdge
from bridgegen.openx.openscenario.value_conditions import ByValueCondition
from bridgegen.openx.openscenario.values import Double, ParameterRef, String


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
