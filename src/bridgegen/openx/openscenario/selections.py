"""Several entities under one name, replaced by their names wherever there may be several."""

from dataclasses import replace
from typing import Any

from bridgegen.openx.openscenario.element import Element, rewritten
from bridgegen.openx.openscenario.entities import (
    Entities,
    EntityRef,
    ExternalObjectReference,
    MiscObject,
    Pedestrian,
    ScenarioObject,
    Vehicle,
)
from bridgegen.openx.openscenario.enumerations import ObjectType
from bridgegen.openx.openscenario.storyboard import InitActions, OpenScenario

_KINDS: dict[type[Element], ObjectType] = {
    Vehicle: ObjectType.VEHICLE,
    Pedestrian: ObjectType.PEDESTRIAN,
    MiscObject: ObjectType.MISCELLANEOUS,
    ExternalObjectReference: ObjectType.EXTERNAL,
}


def without_selections(scenario: OpenScenario) -> OpenScenario:
    """Return a scenario in which the members of each selection stand for it.

    They do wherever an element lists entities, and as actors of initial actions. Elsewhere the
    name stays, and refers to no entity.
    """
    selections = scenario.entities.entity_selections
    if not selections:
        return scenario
    objects = scenario.entities.scenario_objects
    members: dict[Any, tuple[Any, ...]] = {}
    for one in selections:
        found: dict[Any, None] = {}
        for member in one.members.members:
            if isinstance(member, EntityRef):
                found |= dict.fromkeys(members.get(member.entity_ref, (member.entity_ref,)))
            else:
                found |= dict.fromkeys(_of_kind(objects, member.object_type))
        members[one.name] = tuple(found)

    def change(element: Element) -> Element:
        if isinstance(element, InitActions):
            privates = tuple(
                replace(private, entity_ref=name)
                for private in element.privates
                for name in members.get(private.entity_ref, (private.entity_ref,))
            )
            return replace(element, privates=privates)
        refs = getattr(element, "entity_refs", None)
        if refs is None:
            return element
        several: tuple[EntityRef, ...] = tuple(
            replace(ref, entity_ref=name)
            for ref in refs
            for name in members.get(ref.entity_ref, (ref.entity_ref,))
        )
        changes: dict[str, Any] = {"entity_refs": several}
        return replace(element, **changes)

    made = rewritten(scenario, change)
    return replace(made, entities=Entities(made.entities.scenario_objects))


def _of_kind(objects: tuple[ScenarioObject, ...], kind: Any) -> list[Any]:
    return [one.name for one in objects if _KINDS[type(one.entity_object)] == kind]
