"""Cutting out what is not supported, and empty StartTriggers."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any, TypeVar

from lxml import etree

from bridgegen.base.errors import UnknownNameError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import (
    Element,
    children_of,
    declaration,
    rewritten,
    values_of,
    walk,
)
from bridgegen.openx.openscenario.entities import ScenarioObject, Trailer
from bridgegen.openx.openscenario.storyboard import ManeuverGroup, OpenScenario

# --- Cutting out of a file what is not supported, so that what is left means what it meant ---
# An action that an event cannot do, or a condition that cannot be watched, makes another event of
# it: the whole event goes. The rest stays as it is.


_WHOLES = frozenset(
    {
        "ConditionGroup",
        "Event",
        "GlobalAction",
        "ObjectController",
        "ParameterDeclaration",
        "PrivateAction",
        "ScenarioObject",
        "TrafficSignalController",
    }
)
_ENDS = frozenset({"Event", "ScenarioObject"})
_NEVER_EMPTY = frozenset({"Act", "Maneuver", "Private", "Story"})
_LOCAL = "ParameterDeclarations"  # of a story or a maneuver: what is below refers to them


E = TypeVar("E", bound=Element)


def prune(node: etree._Element, attribute: str | None = None) -> None:
    """Cut out an attribute, or an element with the event, action or entity that it is part of.

    Args:
        node: not the root.
        attribute: of the element; None if all of it is to go.
    """
    if attribute is not None:
        node.attrib.pop(attribute, None)
        return
    parent = node.getparent()
    whole = node if node.tag != _LOCAL or parent is None else parent
    above = node
    while (parent := above.getparent()) is not None:
        if above.tag in _WHOLES:
            whole = above
            if above.tag in _ENDS:
                break
        above = parent
    _remove(whole)


def _remove(node: etree._Element) -> None:
    parent = node.getparent()
    if parent is None:  # the root, or gone already
        return
    parent.remove(node)
    if parent.tag in _NEVER_EMPTY and not any(child.tag == node.tag for child in parent):
        _remove(parent)


def without(scenario: OpenScenario, culprits: Iterable[Element]) -> OpenScenario:
    """Return a scenario without some of its elements, and what they are part of.

    Args:
        scenario: stays as it is.
        culprits: elements of it, by identity.
    """
    wanted = {id(culprit) for culprit in culprits}
    gone: set[int] = set()
    for path in _paths(scenario):
        if id(path[-1]) in wanted:
            gone.add(id(_whole(path)))
    made = _left(scenario, gone)
    return scenario if made is None else made


def strays(scenario: OpenScenario) -> list[Element]:
    """Return what names an entity that the scenario does not have, and groups of none but such."""
    names = {node.name for node in walk(scenario.entities) if isinstance(node, ScenarioObject)}
    names |= {selection.name for selection in scenario.entities.entity_selections}
    found: list[Element] = []
    for element in walk(scenario):
        for attribute, value in values_of(element):
            if attribute.is_entity and isinstance(value, str) and value not in names:
                found.append(element)
        refs = element.actors.entity_refs if isinstance(element, ManeuverGroup) else ()
        if refs and not names & {ref.entity_ref for ref in refs}:
            found.append(element)
    return found


def _paths(element: Element, above: tuple[Element, ...] = ()) -> Iterator[tuple[Element, ...]]:
    path = (*above, element)
    yield path
    for _, child in children_of(element):
        yield from _paths(child, path)


def _whole(path: tuple[Element, ...]) -> Element:
    """Return what goes with the last element of a path from the root."""
    whole = path[-1]
    if isinstance(whole, Trailer):  # a car without its trailer is one
        return whole
    for element in reversed(path[1:]):
        name = type(element).__name__
        if name in _WHOLES:
            whole = element
            if name in _ENDS:
                break
    return whole


def _left(element: E, gone: set[int]) -> E | None:
    """Return what is left of an element; None if nothing, or too little, is."""
    if id(element) in gone:
        return None
    changes: dict[str, Any] = {}
    for child in declaration(type(element)).children:
        held = getattr(element, child.field)
        before = held if child.many else () if held is None else (held,)
        after = [made for item in before if (made := _left(item, gone)) is not None]
        if all(a is b for a, b in zip(after, before, strict=False)) and len(after) == len(before):
            continue
        if len(after) < child.at_least:
            return None
        changes[child.field] = tuple(after) if child.many else after[0] if after else None
    return replace(element, **changes) if changes else element


# --- Empty StartTriggers: by the standard they never fire, esmini starts what has one at once ---
# Source: ASAM OpenSCENARIO XML 1.1, ``Trigger``: "an empty trigger", that is one without a group of
# conditions, evaluates to false; esmini's own scenarios rely on the other reading.


NEVER, NOW = "never", "now"
READINGS = (NEVER, NOW)

_AT_ONCE = osc.Trigger(
    (
        osc.ConditionGroup(
            (
                osc.Condition(
                    "at_once",
                    0.0,
                    osc.ConditionEdge.NONE,
                    osc.ByValueCondition(
                        osc.SimulationTimeCondition(0.0, osc.Rule.GREATER_OR_EQUAL)
                    ),
                ),
            )
        ),
    )
)


def is_empty(trigger: osc.Trigger | None) -> bool:
    """Return whether a trigger is there and has no condition."""
    return trigger is not None and not trigger.condition_groups


def read_empty_triggers(scenario: osc.OpenScenario, reading: str) -> osc.OpenScenario:
    """Return a scenario file whose acts and events with an empty StartTrigger start as one says.

    Args:
        scenario: the file.
        reading: "never", by the standard, or "now", as esmini does.

    Raises:
        UnknownNameError: no such reading.
    """
    if reading not in READINGS:
        raise UnknownNameError("reading of empty triggers", reading, READINGS)
    return scenario if reading == NEVER else rewritten(scenario, _started)


def _started(element: Element) -> Element:
    if isinstance(element, osc.Act | osc.Event) and is_empty(element.start_trigger):
        return replace(element, start_trigger=_AT_ONCE)
    return element
