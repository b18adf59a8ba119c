"""The parameters of a scenario: their values, and whether what refers to them fits.

Source: ASAM OpenSCENARIO XML 1.2, section 9.1. The standard does not say which types may stand
for which; ours: a number for a number (not a double for a whole one), a boolean for a boolean,
anything for a text, a text for an enumeration or a date if its value is one.
"""

import re
from collections.abc import Iterator, Mapping
from operator import eq, ge, gt, le, lt, ne
from typing import Any

from bridgegen.errors import FileFormatError
from bridgegen.odd.parameters import slack
from bridgegen.openx.openscenario.declarations import ParameterDeclaration, ValueConstraint
from bridgegen.openx.openscenario.element import Attribute, values_of, walk
from bridgegen.openx.openscenario.enumerations import ParameterType, Rule
from bridgegen.openx.openscenario.storyboard import OpenScenario
from bridgegen.openx.openscenario.values import Expr, Kind, Literal, ParameterRef, parse_literal

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_COMPARE = {
    Rule.EQUAL_TO: eq,
    Rule.NOT_EQUAL_TO: ne,
    Rule.GREATER_THAN: gt,
    Rule.LESS_THAN: lt,
    Rule.GREATER_OR_EQUAL: ge,
    Rule.LESS_OR_EQUAL: le,
}


def kind_of(parameter_type: ParameterType) -> Kind:
    """Return the data type that a parameter's type stands for."""
    return Kind.INT if parameter_type is ParameterType.INTEGER else Kind(parameter_type.value)


def value_of(declaration: ParameterDeclaration) -> Literal:
    """Return a parameter's value by its type.

    Raises:
        FileFormatError: the value is not of that type.
    """
    return parse_literal(kind_of(declaration.parameter_type), declaration.value)


def values(scenario: OpenScenario) -> dict[str, Literal]:
    """Return every declared parameter's value by name, in the order of the file.

    Raises:
        FileFormatError: a value is not of its parameter's type; `bridgegen.openx.openscenario.
            read` has made sure that it is.
    """
    return {one.name: value_of(one) for one in _declarations(scenario)}


def numbers(scenario: OpenScenario) -> dict[str, float]:
    """Return the values of the parameters that take part in arithmetic."""
    kinds = {one.name: kind_of(one.parameter_type) for one in _declarations(scenario)}
    return {name: float(value) for name, value in values(scenario).items() if kinds[name].is_number}


def problems(scenario: OpenScenario) -> list[str]:
    """Return what is wrong with the parameters, one sentence each, with the line."""
    found: list[tuple[int, str]] = []
    declared: dict[str, tuple[Kind, Literal]] = {}
    for one in _declarations(scenario):
        name = one.name
        if not _NAME.fullmatch(name):
            found.append((one.line, f"a parameter's name must be an identifier, got '{name}'"))
            continue
        if name in declared:
            found.append((one.line, f"parameter {name} is declared twice"))
            continue
        kind = kind_of(one.parameter_type)
        try:
            value = value_of(one)
        except FileFormatError as error:
            found.append((one.line, f"the value of parameter {name} {error}"))
            value = one.value
        else:
            found += [(one.line, f"parameter {name} {text}") for text in broken(one, value)]
        declared[name] = kind, value
    for element in walk(scenario):
        for attribute, value in values_of(element):
            for text in _misfits(attribute, value, declared):
                tag = type(element).__name__
                found.append((element.line, f"{attribute.name} of {tag} {text}"))
    return [f"{text} (line {line})" for line, text in sorted(found, key=lambda item: item[0])]


def _declarations(scenario: OpenScenario) -> tuple[ParameterDeclaration, ...]:
    declarations = scenario.parameter_declarations
    return () if declarations is None else declarations.parameters


def _misfits(
    attribute: Attribute, value: Any, declared: Mapping[str, tuple[Kind, Literal]]
) -> Iterator[str]:
    """Yield why the references of one attribute do not fit."""
    if not isinstance(value, ParameterRef | Expr):
        return
    for name in sorted(value.names):
        if name not in declared:
            yield f"refers to ${name}, which is not declared"
            continue
        kind, current = declared[name]
        if isinstance(value, Expr):
            if not kind.is_number:
                yield f"computes with ${name}, which is a {kind.value}"
        elif attribute.enum is not None:
            if kind is not Kind.STRING:
                yield f"must be a string parameter, ${name} is a {kind.value}"
            elif current not in list(attribute.enum):
                known = ", ".join(attribute.enum)
                yield f"must be one of {known}, got ${name} = '{current}'"
        elif not _fits(attribute.kind, kind, current):
            yield f"must be of type {attribute.kind.value}, ${name} is a {kind.value}"


def _fits(want: Kind, have: Kind, value: Literal) -> bool:
    if want is Kind.STRING or want is have:
        return True
    if want is Kind.DATE_TIME and have is Kind.STRING:
        try:
            parse_literal(want, str(value))
        except FileFormatError:
            return False
        return True
    return have.is_integer if want.is_integer else want.is_number and have.is_number


def broken(declaration: ParameterDeclaration, value: Literal) -> list[str]:
    """Return why a value breaks its constraints: none of the groups holds."""
    reasons: list[str] = []
    for group in declaration.constraint_groups:
        broken = [text for one in group.constraints for text in _violates(declaration, one, value)]
        if not broken:
            return []
        reasons += broken
    return reasons


def _violates(
    declaration: ParameterDeclaration, constraint: ValueConstraint, value: Literal
) -> list[str]:
    rule, text = constraint.rule, constraint.value
    kind = kind_of(declaration.parameter_type)
    try:
        limit = parse_literal(kind, text)
    except FileFormatError as error:
        return [f"has a constraint that {error}"]
    ordered = kind.is_number or rule in (Rule.EQUAL_TO, Rule.NOT_EQUAL_TO)
    if not ordered:
        return [f"has the constraint {rule}, which {kind.value} does not know"]
    if _COMPARE[rule](value, limit) or _nearly(rule, value, limit):
        return []
    return [f"must be {rule} {text}, got {value}"]


def _nearly(rule: Rule, value: Literal, limit: Literal) -> bool:
    """Say whether a number misses a limit by no more than rounding (``odd.parameters.slack``)."""
    inclusive = rule in (Rule.GREATER_OR_EQUAL, Rule.LESS_OR_EQUAL, Rule.EQUAL_TO)
    if not inclusive or not isinstance(value, float) or not isinstance(limit, float):
        return False
    return abs(value - limit) <= float(slack(limit))
