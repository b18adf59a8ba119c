"""Conditions on values: times, parameters, lights, and the storyboard's own parts."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import PARAMETER, VARIABLE, Element, Range
from bridgegen.openx.openscenario.enumerations import (
    Rule,
    StoryboardElementState,
    StoryboardElementType,
)
from bridgegen.openx.openscenario.values import (
    AnyValue,
    DateTime,
    Double,
    LiteralString,
    ParameterRef,
    String,
)


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
