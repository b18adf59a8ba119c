"""A scenario without parameters: every reference and expression is its value."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import Attribute, Element, rewritten, values_of
from bridgegen.openx.openscenario.values import Kind, Literal, format_double

E = TypeVar("E", bound=Element)


def resolved(scenario: osc.OpenScenario, place: str) -> osc.OpenScenario:
    """Return a scenario in which literals stand for all parameters, which are declared no more.

    Args:
        scenario: as read, so its references are known to fit.
        place: what to call it in messages.

    Raises:
        FileFormatError: an expression that has no finite value, or no whole one where one is
            needed; all of them at once.
    """
    return part_resolved(replace(scenario, parameter_declarations=None), scenario, place)


def part_resolved(part: E, scenario: osc.OpenScenario, place: str) -> E:
    """Return a part of a scenario in which literals stand for all parameters.

    Args:
        part: an element.
        scenario: that declares the parameters.
        place: as of `resolved`.

    Raises:
        FileFormatError: as of `resolved`.
    """
    declared = scenario.parameter_declarations
    texts = (
        {parameter.name: parameter.value for parameter in declared.parameters} if declared else {}
    )
    values, numbers = parameters.values(scenario), parameters.numbers(scenario)
    found: list[str] = []

    def change(element: Element) -> Element:
        changes: dict[str, Any] = {}
        for attribute, value in values_of(element):
            if isinstance(value, osc.ParameterRef):
                name = value.name
                changes[attribute.field] = _literal(attribute, values[name], texts[name])
            elif isinstance(value, osc.Expr):
                number = _number(value, numbers)
                whole = number.is_integer() or not attribute.kind.is_integer
                if not np.isfinite(number) or not whole:
                    what = "a whole number" if attribute.kind.is_integer else "finite"
                    tag = f"{attribute.name} of {type(element).__name__}"
                    found.append(
                        f"{place}: {tag} must be {what}, got {value} = {number:g} "
                        f"(line {element.line})"
                    )
                    continue
                is_text = attribute.kind is Kind.STRING  # a value of any type
                changes[attribute.field] = (
                    format_double(number) if is_text else _typed(attribute.kind, number)
                )
        return replace(element, **changes) if changes else element

    made = rewritten(part, change)
    if found:
        raise FileFormatError(*found)
    return made


def texts_resolved(scenario: osc.OpenScenario) -> tuple[osc.OpenScenario, dict[str, str]]:
    """Return a scenario in which literals stand for all that is no number.

    Its parameters stay declared, and numbers refer to them still; so do properties, which are
    texts to the standard but may be numbers to their readers.

    Args:
        scenario: as read, so its references are known to fit.

    Returns:
        The scenario; and the numeric parameters that a text refers to, such as a road's id, with
        what the first of these is.
    """
    declared = scenario.parameter_declarations
    texts = (
        {parameter.name: parameter.value for parameter in declared.parameters} if declared else {}
    )
    values, numbers = parameters.values(scenario), parameters.numbers(scenario)
    used: dict[str, str] = {}

    def change(element: Element) -> Element:
        changes: dict[str, Any] = {}
        for attribute, value in () if isinstance(element, osc.Property) else values_of(element):
            if isinstance(value, osc.ParameterRef) and not attribute.kind.is_number:
                name = value.name
                if attribute.takes_expressions and name in numbers:  # a value of any type
                    continue
                changes[attribute.field] = _literal(attribute, values[name], texts[name])
                if name in numbers:
                    line = f" (line {element.line})" if element.line else ""
                    used.setdefault(name, f'{attribute.name}="{value}"{line}')
        return replace(element, **changes) if changes else element

    return rewritten(scenario, change), used


def _number(expression: osc.Expr, numbers: Mapping[str, float]) -> float:
    with np.errstate(all="ignore"):  # missing values are reported with their place
        return float(expression.resolve(numbers))


def _literal(attribute: Attribute, value: Literal, text: str) -> Any:
    """Return what a parameter is as an attribute: a text verbatim, a number by its type."""
    if attribute.enum is not None:
        return attribute.enum(text)
    if isinstance(value, str) or attribute.kind in (Kind.STRING, Kind.DATE_TIME):
        return text
    return _typed(attribute.kind, value)


def _typed(kind: Kind, value: Literal) -> Literal:
    if kind is Kind.BOOLEAN:
        return bool(value)
    return int(value) if kind.is_integer else float(value)
