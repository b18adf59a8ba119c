"""OpenSCENARIO2OWL, what the ontology has no words for: kept in OpenSCENARIO's own, as XML.

An action, a condition or a position of a file of somebody else is then an individual that says
whose it is and when, and what it is in the words of the standard. Nothing is lost, and it is
written again as it was; the ontology's constraints see nothing of it.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

import pyoxigraph as ox

from bridgegen.base.errors import InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, rewritten, values_of, walk
from bridgegen.openx.openscenario.fragments import fragment_of
from bridgegen.openx.openscenario.resolve import part_resolved
from bridgegen.openx.openscenario.to_owl.build import StoryBuilder, UnsayableError

ACTION, CONDITION, POSITION = (
    "OpenScenarioAction",
    "OpenScenarioCondition",
    "OpenScenarioPosition",
)
"""The ontology's classes of what is kept in these words."""

_REFERRING = (
    osc.ParameterCondition
    | osc.TrafficSignalControllerCondition
    | osc.TrafficSignalControllerAction
    | osc.ParameterAction
    | osc.SetMonitorAction
)
"""They name parts of the file that are not kept under their names."""


T = TypeVar("T")


def said_or_quoted(
    builder: StoryBuilder,
    name: str,
    cls: str,
    element: Element,
    say: Callable[[], T],
    quote: Callable[[ox.NamedNode], T],
) -> T:
    """Return the individual of an element, in the ontology's words or else in OpenSCENARIO's.

    Args:
        builder: where to.
        name: of the individual, if it is quoted.
        cls: its class then.
        element: the element.
        say: states it in the ontology's words.
        quote: makes the same of the individual if it is quoted.

    Raises:
        UnsayableError: it can be neither said nor quoted, or is to be said in words only.
    """
    if not builder.in_substance:
        return say()
    if any(one.line in builder.quoted_lines for one in walk(element)):
        return quote(quoted(builder, name, cls, element))
    kept = builder.mark()
    try:
        return say()
    except UnsayableError as error:
        if error.lost.is_detail:
            raise
        builder.take_back(kept)
        try:
            return quote(quoted(builder, name, cls, element))
        except UnsayableError:
            raise error from None


def node_of(
    builder: StoryBuilder,
    name: str,
    cls: str,
    element: Element,
    say: Callable[[], ox.NamedNode],
) -> ox.NamedNode:
    """Return the individual of an element; see `said_or_quoted`."""
    return said_or_quoted(builder, name, cls, element, say, lambda node: node)


def quoted(builder: StoryBuilder, name: str, cls: str, element: Element) -> ox.NamedNode:
    """Return the individual of an element in OpenSCENARIO's words.

    Raises:
        UnsayableError: it names parts of the file that are not kept, or has no finite value.
    """
    try:
        plain = part_resolved(element, builder.scenario_file, "document")
        plain = rewritten(plain, partial(_renamed, builder))
    except InputError:
        raise UnsayableError(element, f"a value of {type(element).__name__}") from None
    for one in walk(plain):
        variable = getattr(one, "variable_ref", None)
        if isinstance(one, _REFERRING) or (variable and variable not in builder.variables):
            raise UnsayableError(element, type(one).__name__)
        for attribute, value in values_of(one):
            if attribute.is_entity and str(value) not in builder.entities:
                what = type(one).__name__
                raise UnsayableError(one, f"{what} of {value}, an entity that is not stated")
    try:
        text = fragment_of(plain)
    except (TypeError, ValueError):
        raise UnsayableError(element, type(element).__name__) from None
    node = builder.node(name, cls)
    builder.put(node, "has_openscenario", text)
    return node


def _renamed(builder: StoryBuilder, element: Element) -> Element:
    """Return an element that calls a part of the storyboard as it will be called.

    Raises:
        UnsayableError: the part will not be there, or several have its name.
    """
    if not isinstance(element, osc.StoryboardElementStateCondition):
        return element
    kind, name = str(element.storyboard_element_type), str(element.storyboard_element_ref)
    found = builder.element_names.get((kind, name))
    if not found:
        what = f"StoryboardElementStateCondition on {element.state} of the {kind} {name}"
        raise UnsayableError(element, what)
    if kind == "event":
        builder.referred.add(found)
    return replace(element, storyboard_element_ref=found)
