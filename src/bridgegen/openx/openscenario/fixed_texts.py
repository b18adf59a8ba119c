"""Texts and truths that a distribution gives one value each: no axis of a search.

A text may be the name of a catalogue's entry, or label a test case; with one value it varies
nothing, and the storyboard is read with that value in place of the declared one.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from bridgegen.openx.openscenario import distributions as dst
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.parameters import kind_of
from bridgegen.openx.openscenario.values import Kind

_TEXTS = (Kind.STRING, Kind.BOOLEAN)

Definition = dst.Deterministic | dst.Stochastic


def fixed_texts(
    scenario: osc.OpenScenario, definition: Definition
) -> tuple[dict[str, str], Definition | None]:
    """Return the texts that a distribution fixes, and what is left of the distribution.

    Args:
        scenario: the file; a text that a formula of its header compares is left to the formula.
        definition: the distribution.

    Returns:
        The one value of each by the parameter's name; and the distribution without them, None
        where nothing is left.
    """
    header = scenario.file_header.properties
    said = " ".join(str(property_.value) for property_ in header.properties) if header else ""
    declared = scenario.parameter_declarations
    texts = {
        parameter.name
        for parameter in (declared.parameters if declared else ())
        if kind_of(parameter.parameter_type) in _TEXTS and parameter.name not in said
    }
    given: dict[str, set[str]] = {}
    for distribution in definition.distributions:
        for name, values in _texts(distribution):
            given.setdefault(name, set()).update(values)
    fixed = {
        name: min(values) for name, values in given.items() if name in texts and len(values) == 1
    }
    left = (_without(distribution, fixed) for distribution in definition.distributions)
    kept: Any = tuple(element for element in left if element is not None)
    return fixed, replace(definition, distributions=kept) if kept else None


def _texts(element: Element) -> Iterator[tuple[str, list[str]]]:
    if isinstance(element, dst.DeterministicMultiParameterDistribution):
        sets = element.distribution.sets
        names = {each.parameter_ref for given in sets for each in given.assignments}
        for name in names:
            found = [
                str(each.value)
                for given in sets
                for each in given.assignments
                if each.parameter_ref == name
            ]
            if len(found) == len(sets):
                yield name, found
        return
    assert isinstance(
        element, dst.DeterministicSingleParameterDistribution | dst.StochasticDistribution
    )
    if isinstance(element.distribution, dst.DistributionSet | dst.ProbabilityDistributionSet):
        yield element.parameter_name, [str(each.value) for each in element.distribution.elements]


def _without(element: Element, fixed: dict[str, str]) -> Element | None:
    """Return a distribution without some parameters, None where no other is left."""
    if not isinstance(element, dst.DeterministicMultiParameterDistribution):
        return None if getattr(element, "parameter_name", None) in fixed else element
    sets = tuple(
        replace(
            given,
            assignments=tuple(
                each for each in given.assignments if each.parameter_ref not in fixed
            ),
        )
        for given in element.distribution.sets
    )
    if not all(given.assignments for given in sets):
        return None
    return replace(element, distribution=replace(element.distribution, sets=sets))
