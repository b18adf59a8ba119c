"""What a run adds to the storyboard that it writes: properties of the controllers of drivers."""

from collections.abc import Callable
from dataclasses import replace

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import DRIVER, NOISE_KEY, VEHICLE
from bridgegen.openx.openscenario.parameters import ego_of
from bridgegen.simulation.vehicles import KINEMATIC


def keyed(scenario: osc.OpenScenario, key: str) -> osc.OpenScenario:
    """Return a scenario that states the key of its driver's random numbers, unless it does."""

    def changed(before: osc.Properties) -> osc.Properties:
        # A key that is stated decides what the driver sees: it is kept.
        if before.get(NOISE_KEY) is not None:
            return before
        return replace(before, properties=(*before.properties, osc.Property(NOISE_KEY, key)))

    return with_properties(scenario, changed)


def with_vehicle(scenario: osc.OpenScenario, vehicle: str) -> osc.OpenScenario:
    """Return a scenario that states how its ego moves, in place of what it states, if need be."""
    ego = ego_of(scenario)

    def changed(before: osc.Properties) -> osc.Properties:
        others = tuple(property_ for property_ in before.properties if property_.name != VEHICLE)
        added = () if vehicle == KINEMATIC else (osc.Property(VEHICLE, vehicle),)
        return replace(before, properties=(*others, *added))

    return with_properties(scenario, changed, only=ego)


def with_properties(
    scenario: osc.OpenScenario,
    changed: Callable[[osc.Properties], osc.Properties],
    only: str | None = None,
) -> osc.OpenScenario:
    """Return a scenario with other properties of the controllers that name a driver.

    Args:
        scenario: it.
        changed: a controller's new properties, by the ones that it has.
        only: the name of the one entity whose controllers are changed; all by default.
    """

    def with_changed(object_controller: osc.ObjectController) -> osc.ObjectController:
        before = object_controller.controller.properties
        if before is None or before.get(DRIVER) is None:
            return object_controller
        return replace(
            object_controller,
            controller=replace(object_controller.controller, properties=changed(before)),
        )

    objects = tuple(
        replace(obj, object_controllers=tuple(with_changed(c) for c in obj.object_controllers))
        if only in (None, str(obj.name))
        else obj
        for obj in scenario.entities.scenario_objects
    )
    return replace(scenario, entities=replace(scenario.entities, scenario_objects=objects))
