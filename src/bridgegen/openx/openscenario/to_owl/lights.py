"""The lights of a vehicle that the ontology knows: those by which it tells others something."""

from collections.abc import Callable

from bridgegen.openx.openscenario import model as osc
from bridgegen.scenario.ontology.vocabulary import tbox


def known_light(action: object, text: Callable[[osc.ParameterRef | str], str]) -> str | None:
    """Return which light an action switches, as the ontology calls it; None if it knows it not.

    Args:
        action: any action.
        text: gives a text at the parameters' values.
    """
    if not isinstance(action, osc.LightStateAction):
        return None
    light = action.light_type.light
    if not isinstance(light, osc.VehicleLight):
        return None
    name = text(light.vehicle_light_type)
    return name if name in tbox().allowed["has_light_type"] else None
