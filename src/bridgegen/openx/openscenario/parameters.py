"""The parameters of a scenario: their values, and whether what refers to them fits.

Source: ASAM OpenSCENARIO XML 1.2, section 9.1. The standard does not say which types may stand
for which; ours: a number for a number (not a double for a whole one), a boolean for a boolean,
anything for a text, a text for an enumeration or a date if its value is one. In a file a text may
also stand for a number or a boolean if its value is one (see ``scopes``); it is no parameter then.
"""

import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import replace
from operator import eq, ge, gt, le, lt, ne
from typing import Any, TypeVar

import numpy as np

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import values as expression_types
from bridgegen.openx.openscenario.conditions import Condition
from bridgegen.openx.openscenario.declarations import ParameterDeclaration, ValueConstraint
from bridgegen.openx.openscenario.element import (
    Attribute,
    Element,
    Meaning,
    declaration,
    values_of,
    walk,
)
from bridgegen.openx.openscenario.enumerations import ParameterType, Rule
from bridgegen.openx.openscenario.storyboard import OpenScenario
from bridgegen.openx.openscenario.values import (
    Expr,
    Kind,
    Literal,
    ParameterRef,
    parse_literal,
    parse_value,
)
from bridgegen.scenario.language.kinds import slack

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
    return {
        parameter_declaration.name: value_of(parameter_declaration)
        for parameter_declaration in _declarations(scenario)
    }


def numbers(scenario: OpenScenario) -> dict[str, float]:
    """Return the values of the parameters that take part in arithmetic."""
    kinds = {
        parameter_declaration.name: kind_of(parameter_declaration.parameter_type)
        for parameter_declaration in _declarations(scenario)
    }
    return {name: float(value) for name, value in values(scenario).items() if kinds[name].is_number}


def text_of(known: Mapping[str, Literal], value: ParameterRef | str) -> str:
    """Return a text, at the values of the parameters."""
    return str(known[value.name] if isinstance(value, ParameterRef) else value)


def problems(scenario: OpenScenario) -> list[str]:
    """Return what is wrong with the parameters, one sentence each, with the line."""
    found: list[tuple[int, str]] = []
    first: dict[str, ParameterDeclaration] = {}
    declared: dict[str, tuple[Kind, Literal]] = {}
    for parameter_declaration in _declarations(scenario):
        name = parameter_declaration.name
        if problem := name_problem(name) or clash(parameter_declaration, first.get(name)):
            found.append((parameter_declaration.line, problem))
            continue
        first[name] = parameter_declaration
        kind = kind_of(parameter_declaration.parameter_type)
        try:
            value = value_of(parameter_declaration)
        except FileFormatError as error:
            found.append((parameter_declaration.line, f"the value of parameter {name} {error}"))
            value = parameter_declaration.value
        declared[name] = kind, value
    # All values first: a constraint may refer to a parameter that is declared further down.
    known_values = {name: value for name, (_, value) in declared.items()}
    for name, parameter_declaration in first.items():
        if not isinstance(declared[name][1], str) or declared[name][0] is Kind.STRING:
            reasons = broken(parameter_declaration, declared[name][1], known_values)
            found += [(parameter_declaration.line, f"parameter {name} {text}") for text in reasons]
    known = {
        Meaning.PARAMETER: declared.keys(),
        Meaning.VARIABLE: _names(scenario.variable_declarations, "variables"),
        Meaning.MONITOR: _names(scenario.monitor_declarations, "monitors"),
    }
    judged = {
        id(below)
        for node in walk(scenario)
        if isinstance(node, Condition) and node.is_criterion
        for below in walk(node)
    }
    for element in walk(scenario):
        for attribute, value in values_of(element):
            if id(element) in judged and attribute.means is Meaning.PARAMETER:
                continue  # no parameter, but an argument of ScenarioRunner's criterion
            if attribute.means in known and value not in known[attribute.means]:
                what = f"must name a declared {attribute.means.name.lower()}, got '{value}'"
                tag = type(element).__name__
                found.append((element.line, f"{attribute.name} of {tag} {what}"))
            for text in misfits(attribute, value, declared):
                tag = type(element).__name__
                found.append((element.line, f"{attribute.name} of {tag} {text}"))
    return [f"{text} (line {line})" for line, text in sorted(found, key=lambda item: item[0])]


def _names(declarations: Element | None, field: str) -> Set[str]:
    return {item.name for item in getattr(declarations, field, ())}


def name_problem(name: str) -> str | None:
    """Return what is wrong with the name of a declared parameter, if anything is."""
    if _NAME.fullmatch(name):
        return None
    return f"a parameter's name must be an identifier, got '{name}'"


def clash(
    parameter_declaration: ParameterDeclaration, other: ParameterDeclaration | None
) -> str | None:
    """Return what is wrong with declaring a parameter twice; saying the same again is not."""
    if other is None or (parameter_declaration.parameter_type, parameter_declaration.value) == (
        other.parameter_type,
        other.value,
    ):
        return None
    return (
        f"parameter {parameter_declaration.name} is declared twice, as {other.value} and as "
        f"{parameter_declaration.value}"
    )


def _declarations(scenario: OpenScenario) -> tuple[ParameterDeclaration, ...]:
    declarations = scenario.parameter_declarations
    return () if declarations is None else declarations.parameters


def misfits(
    attribute: Attribute,
    value: Any,
    declared: Mapping[str, tuple[Kind, Literal]],
    *,
    texts: bool = False,
) -> Iterator[str]:
    """Yield why the references of one attribute do not fit.

    Args:
        attribute: what takes them.
        value: as in the file.
        declared: parameters with their types and values.
        texts: whether a text may stand for all that it reads as.
    """
    if not isinstance(value, ParameterRef | Expr):
        return
    is_known = True
    for name in sorted(value.names):
        if name not in declared:
            is_known = False
            yield f"refers to ${name}, which is not declared"
            continue
        kind, current = declared[name]
        if isinstance(value, Expr):
            as_text = texts and _reads_as(Kind.DOUBLE, kind, current)
            if not kind.is_number and kind is not Kind.BOOLEAN and not as_text:
                is_known = False
                yield f"computes with ${name}, which is a {kind.value}"
        elif attribute.enum is not None:
            if kind is not Kind.STRING:
                yield f"must be a string parameter, ${name} is a {kind.value}"
            elif current not in list(attribute.enum):
                known = ", ".join(attribute.enum)
                yield f"must be one of {known}, got ${name} = '{current}'"
        elif not _fits(attribute.kind, kind, current) and not (
            texts and _reads_as(attribute.kind, kind, current)
        ):
            yield f"must be of type {attribute.kind.value}, ${name} is a {kind.value}"
    if is_known and isinstance(value, Expr):
        booleans = {name: declared[name][0] is Kind.BOOLEAN for name in value.names}
        if text := expression_types.problem(value, booleans, attribute.kind):
            yield text


def _fits(want: Kind, have: Kind, value: Literal) -> bool:
    if want is Kind.STRING or want is have:
        return True
    if want is Kind.DATE_TIME and have is Kind.STRING:
        return _reads_as(want, have, value)
    return have.is_integer if want.is_integer else want.is_number and have.is_number


def _reads_as(want: Kind, have: Kind, value: Literal) -> bool:
    """Return whether a text reads as a value of another type."""
    if have is not Kind.STRING:
        return False
    try:
        parse_literal(want, str(value))
    except FileFormatError:
        return False
    return True


def broken(
    declaration: ParameterDeclaration, value: Literal, known: Mapping[str, Literal]
) -> list[str]:
    """Return why a value breaks its constraints: none of the groups holds.

    Args:
        declaration: the parameter's.
        value: its value.
        known: the values of the parameters that a constraint may refer to, by name.
    """
    reasons: list[str] = []
    for group in declaration.constraint_groups:
        found = [
            text
            for constraint in group.constraints
            for text in _violates(declaration, constraint, value, known)
        ]
        if not found:
            return []
        reasons += found
    return reasons


def refers(constraint: ValueConstraint) -> bool:
    """Return whether a constraint's limit depends on parameters, or is computed."""
    return constraint.value.startswith("$")


def _violates(
    declaration: ParameterDeclaration,
    constraint: ValueConstraint,
    value: Literal,
    known: Mapping[str, Literal],
) -> list[str]:
    rule, text = constraint.rule, constraint.value
    kind = kind_of(declaration.parameter_type)
    try:
        limit = _limit(kind, text, known) if refers(constraint) else parse_literal(kind, text)
    except FileFormatError as error:
        return [f"has a constraint that {error}"]
    ordered = kind.is_number or rule in (Rule.EQUAL_TO, Rule.NOT_EQUAL_TO)
    if not ordered:
        return [f"has the constraint {rule}, which {kind.value} does not know"]
    if _COMPARE[rule](value, limit) or _nearly(rule, value, limit):
        return []
    shown = f"{text} = {limit}" if refers(constraint) else text
    return [f"must be {rule} {shown}, got {value}"]


def _limit(kind: Kind, text: str, known: Mapping[str, Literal]) -> Literal:
    """Return what a constraint's limit is by the values of the parameters that it refers to.

    Raises:
        FileFormatError: it refers to what is not there, or has no value of that type.
    """
    value = parse_value(kind, text, expressions=kind.is_number)
    if not isinstance(value, ParameterRef | Expr):
        raise FileFormatError(f"must be of type {kind.value}, got '{text}'")
    if unknown := sorted(value.names - known.keys()):
        raise FileFormatError(f"refers to ${unknown[0]}, which is not declared")
    if isinstance(value, ParameterRef):
        return parse_literal(kind, str(known[value.name]))
    numbers = {name: item for name in value.names if isinstance(item := known[name], int | float)}
    if texts := sorted(value.names - numbers.keys()):
        raise FileFormatError(f"computes with ${texts[0]}, which is no number")
    # What overflows or divides by zero is found below, as a limit that is not finite.
    with np.errstate(all="ignore"):
        number = float(value.resolve(numbers))
    if not np.isfinite(number):
        raise FileFormatError(f"must be finite, got {value} = {number:g}")
    return number


def _nearly(rule: Rule, value: Literal, limit: Literal) -> bool:
    """Return whether a number misses a limit only by rounding (``odd.parameters.slack``)."""
    inclusive = rule in (Rule.GREATER_OR_EQUAL, Rule.LESS_OR_EQUAL, Rule.EQUAL_TO)
    if not inclusive or not isinstance(value, float) or not isinstance(limit, float):
        return False
    # The decoder puts parameters onto their bounds, and a bound that is computed may round either
    # way; a file that was written must be one that is read.
    return abs(value - limit) <= float(slack(limit))


# --- Giving an entity another name, wherever a scenario refers to it ---


T = TypeVar("T", bound=Element)


EGO = "ego"
"""The name of the entity under test in files of BridgeGen."""


def ego_of(storyboard: osc.OpenScenario) -> str:
    """Return the name of the entity under test: the one called so, else the first."""
    names = [str(obj.name) for obj in storyboard.entities.scenario_objects]
    return next((name for name in names if name.lower() == EGO), names[0])


def rename_entity(scenario: osc.OpenScenario, old: str, new: str) -> osc.OpenScenario:
    """Return a scenario in which an entity has another name.

    Raises:
        InputError: there is no entity of the old name, or one that has the new one already.
    """
    names = [str(obj.name) for obj in scenario.entities.scenario_objects]
    if old not in names:
        raise InputError(f"no entity has the name '{old}'; there are {', '.join(names) or 'none'}")
    if new in names and new != old:
        raise InputError(f"'{old}' must not become '{new}': another entity has that name")
    return _renamed(scenario, old, new)


def _renamed(element: T, old: str, new: str) -> T:
    declared = declaration(type(element))
    changed: dict[str, Any] = {}
    for attribute in declared.attributes.values():
        own = isinstance(element, osc.ScenarioObject) and attribute.field == "name"
        if (attribute.is_entity or own) and getattr(element, attribute.field) == old:
            changed[attribute.field] = new
    for child in declared.children:
        value = getattr(element, child.field)
        if child.many:
            changed[child.field] = tuple(_renamed(item, old, new) for item in value)
        elif value is not None:
            changed[child.field] = _renamed(value, old, new)
    return replace(element, **changed)
