"""Actions that concern all: weather, presence, lights, parameters, variables, traffic."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.declarations import CATALOG
from bridgegen.openx.openscenario.element import (
    ENTITY,
    MONITOR,
    PARAMETER,
    VARIABLE,
    Element,
    Tag,
)
from bridgegen.openx.openscenario.environment import Environment
from bridgegen.openx.openscenario.positions import Position
from bridgegen.openx.openscenario.traffic import TrafficAction
from bridgegen.openx.openscenario.values import AnyValue, Boolean, Double, LiteralString, String


@dataclass(frozen=True)
class EnvironmentAction(Element):
    """A change of the environment."""

    environment: Annotated[Environment, CATALOG]


@dataclass(frozen=True)
class TrafficSignalStateAction(Element):
    """A traffic light takes up a state, one word for each lamp, top to bottom."""

    name: String
    state: String


@dataclass(frozen=True)
class TrafficSignalControllerAction(Element):
    """A controller of traffic lights takes up a phase."""

    traffic_signal_controller_ref: String
    phase: String


@dataclass(frozen=True)
class TrafficSignalAction(Element):
    """One of the actions of traffic lights."""

    action: TrafficSignalStateAction | TrafficSignalControllerAction


@dataclass(frozen=True)
class InfrastructureAction(Element):
    """One of the actions of what stands beside the road."""

    traffic_signal_action: TrafficSignalAction


@dataclass(frozen=True)
class AddEntityAction(Element):
    """An entity comes into the scenario, at a position."""

    position: Position


@dataclass(frozen=True)
class DeleteEntityAction(Element):
    """An entity leaves the scenario."""


@dataclass(frozen=True)
class EntityAction(Element):
    """One of the actions on the presence of an entity."""

    entity_ref: Annotated[String, ENTITY]
    action: AddEntityAction | DeleteEntityAction


@dataclass(frozen=True)
class ParameterSetAction(Element):
    """A parameter gets a value, which conditions on it see."""

    value: AnyValue


@dataclass(frozen=True)
class ParameterAddValueRule(Element):
    """So much is added."""

    value: Double


@dataclass(frozen=True)
class ParameterMultiplyByValueRule(Element):
    """So many times as much."""

    value: Double


@dataclass(frozen=True)
class ModifyRule(Element):
    """How a parameter's value changes."""

    rule: Annotated[
        ParameterAddValueRule | ParameterMultiplyByValueRule,
        Tag("AddValue"),
        Tag("MultiplyByValue"),
    ]


@dataclass(frozen=True)
class ParameterModifyAction(Element):
    """A parameter's value changes by a rule."""

    rule: Annotated[ModifyRule, Tag("Rule")]


@dataclass(frozen=True)
class ParameterAction(Element):
    """One of the actions on a parameter."""

    parameter_ref: Annotated[LiteralString, PARAMETER]
    action: Annotated[
        ParameterSetAction | ParameterModifyAction, Tag("SetAction"), Tag("ModifyAction")
    ]


@dataclass(frozen=True)
class VariableSetAction(Element):
    """A variable gets a value."""

    value: AnyValue


@dataclass(frozen=True)
class VariableAddValueRule(Element):
    """So much is added."""

    value: Double


@dataclass(frozen=True)
class VariableMultiplyByValueRule(Element):
    """So many times as much."""

    value: Double


@dataclass(frozen=True)
class VariableModifyRule(Element):
    """How a variable's value changes."""

    rule: Annotated[
        VariableAddValueRule | VariableMultiplyByValueRule,
        Tag("AddValue"),
        Tag("MultiplyByValue"),
    ]


@dataclass(frozen=True)
class VariableModifyAction(Element):
    """A variable's value changes by a rule."""

    rule: Annotated[VariableModifyRule, Tag("Rule")]


@dataclass(frozen=True)
class VariableAction(Element):
    """One of the actions on a variable."""

    variable_ref: Annotated[LiteralString, VARIABLE]
    action: Annotated[
        VariableSetAction | VariableModifyAction, Tag("SetAction"), Tag("ModifyAction")
    ]


@dataclass(frozen=True)
class SetMonitorAction(Element):
    """A monitor gets a value."""

    monitor_ref: Annotated[LiteralString, MONITOR]
    value: Boolean


@dataclass(frozen=True)
class GlobalAction(Element):
    """One of the actions that concern all."""

    action: (
        EnvironmentAction
        | EntityAction
        | InfrastructureAction
        | SetMonitorAction
        | ParameterAction
        | TrafficAction
        | VariableAction
    )
