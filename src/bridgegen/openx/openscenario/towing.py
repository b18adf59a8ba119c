"""Vehicles that tow others: each trailer an entity of its own."""

from collections.abc import Iterator
from dataclasses import replace

from bridgegen.openx.openscenario.entities import (
    Entities,
    EntityRef,
    ScenarioObject,
    Trailer,
    Vehicle,
)
from bridgegen.openx.openscenario.storyboard import OpenScenario


def with_trailers_apart(scenario: OpenScenario) -> OpenScenario:
    """Return a scenario in which no vehicle contains another: it names the one that it tows.

    The trailers stand behind all other entities. One keeps its name unless another entity has it;
    then its towing vehicle's stands before it ("Lorry.trailer").
    """
    objects = scenario.entities.scenario_objects
    if not any(_towed(one) for one in objects):
        return scenario
    taken = {str(one.name) for one in objects}
    apart: list[ScenarioObject] = []
    trailers: list[ScenarioObject] = []
    for one in objects:
        first, *others = _uncoupled(one, taken)
        apart.append(first)
        trailers += others
    entities = Entities((*apart, *trailers), scenario.entities.entity_selections)
    return replace(scenario, entities=entities)


def _towed(one: ScenarioObject) -> ScenarioObject | None:
    """Return the trailer that an entity contains, if it contains one."""
    vehicle = one.entity_object
    if not isinstance(vehicle, Vehicle) or vehicle.trailer is None:
        return None
    inner = vehicle.trailer.trailer
    return inner if isinstance(inner, ScenarioObject) else None


def _uncoupled(one: ScenarioObject, taken: set[str]) -> Iterator[ScenarioObject]:
    """Yield an entity, and those that it tows, one behind the other."""
    inner, vehicle = _towed(one), one.entity_object
    if inner is None:
        yield one
        return
    assert isinstance(vehicle, Vehicle)
    assert vehicle.trailer is not None
    name, number = str(inner.name), 1
    while name in taken:
        name = f"{one.name}.{inner.name}" + (f"_{number}" if number > 1 else "")
        number += 1
    taken.add(name)
    named = Trailer(EntityRef(name, line=inner.line), line=vehicle.trailer.line)
    yield replace(one, entity_object=replace(vehicle, trailer=named))
    yield from _uncoupled(replace(inner, name=name), taken)
