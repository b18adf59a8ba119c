"""Giving an entity another name, wherever a scenario refers to it."""

from dataclasses import replace
from typing import Any, TypeVar

from bridgegen.base.errors import InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, declaration

T = TypeVar("T", bound=Element)


EGO = "ego"
"""The name of the entity under test in files of BridgeGen."""


def ego_of(storyboard: osc.OpenScenario) -> str:
    """Return the name of the entity under test: the one called so, else the first."""
    names = [str(one.name) for one in storyboard.entities.scenario_objects]
    return next((name for name in names if name.lower() == EGO), names[0])


def rename_entity(scenario: osc.OpenScenario, old: str, new: str) -> osc.OpenScenario:
    """Return a scenario in which an entity has another name.

    Raises:
        InputError: there is no entity of the old name, or one that has the new one already.
    """
    names = [str(one.name) for one in scenario.entities.scenario_objects]
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
            changed[child.field] = tuple(_renamed(one, old, new) for one in value)
        elif value is not None:
            changed[child.field] = _renamed(value, old, new)
    return replace(element, **changed)
