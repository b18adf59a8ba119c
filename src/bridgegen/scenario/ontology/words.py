"""A SHACL result as sentences: which individual, the value with its unit, the rule, the reason."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pyoxigraph as ox

from bridgegen.scenario.ontology.graph import Individuals, local_value
from bridgegen.scenario.ontology.rule import Rule, with_unit
from bridgegen.scenario.ontology.shapes import WEATHER_PATHS
from bridgegen.scenario.ontology.story import WEATHER
from bridgegen.scenario.ontology.vocabulary import Subject, local_name, tbox

if TYPE_CHECKING:
    from bridgegen.scenario.language.scenario import LogicalScenario

_KINDS = {"double": "a number (xsd:double)", "integer": "a whole number (xsd:integer)"}


@dataclass(frozen=True)
class Violation:
    """A rule that an individual breaks.

    Attributes:
        nodes: IRIs of the individuals that do, the one that is named first.
        individual: what people call it: name and class; how many more there are.
        property: local name of the property at fault; empty where it is not one property.
        parameter: the search space's parameter at fault, or empty.
        message: one sentence: the individual, the value with its unit, the rule, the reason.
    """

    nodes: tuple[str, ...]
    individual: str
    property: str
    parameter: str
    message: str

    def __str__(self) -> str:
        return self.message


@dataclass(frozen=True)
class Finding:
    """A SHACL validation result.

    Attributes:
        shape: IRI of the shape.
        component: IRI of the constraint component.
        focus: the individual that was asked.
        value: the value at fault, if there is one.
        literal: whether it is a literal.
        message: of the shape.
    """

    shape: str
    component: str
    focus: str
    value: str | None
    literal: bool
    message: str = ""


def violations_of(
    individuals: Individuals,
    scenario: "LogicalScenario | None",
    rules: Mapping[str, Rule],
    finding: Finding,
) -> Iterator[Violation]:
    """Return a finding in words."""
    key = local_name(finding.shape)
    focus = individuals.find(finding.focus) or ox.NamedNode(finding.focus)
    if key not in rules:
        yield _about_property(individuals, focus, key.rpartition("-")[2], finding)
    elif key == "one-value":
        yield from _several_values(individuals)
    elif key == "declared-range":
        yield from _outside_declared(individuals, focus)
    elif rules[key].individuals:
        yield _about_individual(individuals, rules[key], focus, finding)
    elif scenario is not None:
        yield from _about_parameter(individuals, scenario, rules[key], focus)


# -- single properties -----------------------------------------------------------------------------


def _about_property(
    individuals: Individuals, focus: Subject, name: str, finding: Finding
) -> Violation:
    ontology = tbox()
    subject = individuals.describe(focus)
    what = f"{name} [{ontology.units[name]}]" if name in ontology.units else name
    got = "" if finding.value is None else _shown(individuals, finding)
    match local_name(finding.component).removesuffix("ConstraintComponent"):
        case "MinCount":
            message = f"{subject} must have {what}, and has none: {ontology.comments[name]}"
        case "MaxCount":
            all_of_them = ", ".join(sorted(map(local_value, individuals.values(focus, name))))
            message = f"{subject} may have one {what} only, got {all_of_them}"
        case "Datatype":
            kind = _KINDS.get(local_name(ontology.ranges[name]), "a text (xsd:string)")
            message = f"{what} of {subject} must be {kind}, got {got}"
        case "Class":
            target = local_name(ontology.ranges[name])
            message = f"{what} of {subject} must point to an individual of {target}, got {got}"
        case "In":
            choice = ", ".join(ontology.allowed[name])
            message = f"{what} of {subject} must be one of {choice}, got {got}"
        case "MinExclusive":
            message = f"{what} of {subject} must be above {ontology.above[name]:g}, got {got}"
        case other:
            message = f"{what} of {subject} breaks {other}, got {got}"
    return Violation((focus.value,), subject, name, "", message)


def _shown(individuals: Individuals, finding: Finding) -> str:
    if finding.literal:
        return f"'{finding.value}'"
    node = individuals.find(str(finding.value))
    return individuals.describe(node) if node else str(finding.value)


# -- parameters ------------------------------------------------------------------------------------


def carriers(individuals: Individuals, parameter: str) -> list[tuple[Subject, str]]:
    """Return the individuals and properties that carry a parameter's value.

    For the weather's own parameters, those are the parts of the scenario's, bound or not.
    """
    if parameter not in WEATHER_PATHS:
        return individuals.bindings.get(parameter, [])
    link = next(link for link, _, names in WEATHER if parameter in names)
    return [
        (part, f"has_{parameter}")
        for scenario in individuals.of_class("Scenario")
        for weather in individuals.values(scenario, "has_weather")
        if isinstance(weather, Subject)
        for part in individuals.values(weather, link)
        if isinstance(part, Subject) and individuals.values(part, f"has_{parameter}")
    ]


def _about_parameter(
    individuals: Individuals, scenario: "LogicalScenario", rule: Rule, focus: Subject
) -> Iterator[Violation]:
    declared = scenario.parameters.get(rule.target) or next(
        derived for derived in scenario.derived if derived.name == rule.target
    )
    what = f"{rule.target} [{declared.unit}]"
    places = _places(individuals, carriers(individuals, rule.target))
    if not places:
        subject = individuals.describe(focus)
        message = f"{subject}: {what} must have a value, and no individual carries one"
        yield Violation((focus.value,), subject, "", rule.target, message)
    side = _limit(individuals, rule)
    why = f": {rule.why}" if rule.why else ""
    for got, found in places.items():
        subject = _described(individuals, found)
        message = f"{subject}: {rule.text}{side} must hold for {what}, got {got}{why}"
        yield _at(found, subject, rule.target, message)


def _places(
    individuals: Individuals, found: list[tuple[Subject, str]]
) -> dict[str, list[tuple[Subject, str]]]:
    """Return where a parameter's value is carried, per value: one, if all is well."""
    places: dict[str, list[tuple[Subject, str]]] = {}
    for node, name in found:
        for value in _values(individuals, node, name):
            places.setdefault(value, []).append((node, name))
    return places


def _described(individuals: Individuals, places: list[tuple[Subject, str]]) -> str:
    more = len({node for node, _ in places}) - 1
    first = individuals.describe(places[0][0])
    return f"{first} and {more} more" if more else first


def _at(places: list[tuple[Subject, str]], subject: str, parameter: str, message: str) -> Violation:
    nodes = tuple(dict.fromkeys(node.value for node, _ in places))
    return Violation(nodes, subject, places[0][1], parameter, message)


def _limit(individuals: Individuals, rule: Rule) -> str:
    """Return the value of the limit, and its inputs: " (= 60 with precipitation = 60)"."""
    if rule.limit is None:
        return ""
    given: dict[str, float] = {}
    texts: dict[str, str] = {}
    categories = dict(rule.limit.categories)
    for name in sorted(rule.limit.names):
        for node, property_name in carriers(individuals, name)[:1]:
            text = _values(individuals, node, property_name)[0].strip("'")
            words = categories.get(name)
            try:
                given[name] = float(text) if words is None else float(words.index(text))
            except ValueError:
                return ""
            texts[name] = f"{given[name]:.6g}" if words is None else text
    if given.keys() != rule.limit.names:
        return ""
    with np.errstate(all="ignore"):
        value = float(rule.limit.evaluate(given))
    names = ", ".join(f"{name} = {text}" for name, text in texts.items())
    return f" (= {value:.6g}{f' with {names}' if names else ''})"


def _several_values(individuals: Individuals) -> Iterator[Violation]:
    for name, bound in individuals.bindings.items():
        places = _places(individuals, bound)
        if len(places) > 1:
            shown = " but ".join(
                f"{value} at {_described(individuals, found)}" for value, found in places.items()
            )
            odd_one = min(places.values(), key=len)
            message = f"{name} must have one value wherever it is bound, got {shown}"
            yield _at(odd_one, _described(individuals, odd_one), name, message)


def _outside_declared(individuals: Individuals, parameter: Subject) -> Iterator[Violation]:
    name = ", ".join(individuals.texts(parameter, "has_name"))
    low, high = (
        ", ".join(_values(individuals, parameter, side)) for side in ("has_low", "has_high")
    )
    unit = ", ".join(individuals.texts(parameter, "has_unit")) or "1"
    for got, found in _places(individuals, individuals.bindings.get(name, [])).items():
        subject = _described(individuals, found)
        message = f"{subject}: {low} <= {name} <= {high} must hold for {name} [{unit}], got {got}"
        yield _at(found, subject, name, message)


# -- individuals -----------------------------------------------------------------------------------


def _about_individual(
    individuals: Individuals, rule: Rule, focus: Subject, finding: Finding
) -> Violation:
    node = individuals.find(str(finding.value)) or focus
    subject, what = individuals.describe(node), with_unit(rule.at_fault)
    text = finding.message.removeprefix(what).lstrip()
    message = f"{what} of {subject} {text}" if rule.at_fault else f"{subject} {text}"
    return Violation((node.value,), subject, rule.at_fault, "", message)


# -- values ----------------------------------------------------------------------------------------


def _values(individuals: Individuals, node: Subject, name: str) -> list[str]:
    return [
        _number(value.value) if isinstance(value, ox.Literal) else local_value(value)
        for value in individuals.values(node, name)
    ]


def _number(text: str) -> str:
    """Return a number without superfluous digits, and any other text in quotes."""
    try:
        return f"{float(text):.10g}"
    except ValueError:
        return f"'{text}'"
