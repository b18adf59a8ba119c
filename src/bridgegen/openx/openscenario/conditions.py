"""When it happens: triggers and their conditions."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import AtLeast, Element, Range
from bridgegen.openx.openscenario.entities import TriggeringEntities
from bridgegen.openx.openscenario.entity_conditions import EntityCondition
from bridgegen.openx.openscenario.enumerations import ConditionEdge
from bridgegen.openx.openscenario.value_conditions import ByValueCondition, ParameterCondition
from bridgegen.openx.openscenario.values import Double, ParameterRef, String

CRITERIA = "criteria_"
"""What the names of ScenarioRunner's criteria begin with."""


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
