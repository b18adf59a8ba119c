"""CARLA, reached over the network: its bodies, its light and its weather round our storyboard."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from bridgegen.adapters.carla.settings import MEANINGS, OPTIONS, Access, CarlaSettings, Value
from bridgegen.simulation.choice import Kind

if TYPE_CHECKING:  # the table of simulators is part of the command line, which starts fast
    from bridgegen.openx.openscenario.model import OpenScenario
    from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
    from bridgegen.simulation.simulator import Simulator


def _make(
    embedded: "EmbeddedSimulator",
    storyboard: "OpenScenario",
    settings: Mapping[str, Value],
    access: Mapping[str, Value],
) -> "Simulator[Any]":
    from bridgegen.adapters.carla.simulator import CarlaSimulator

    chosen, where = CarlaSettings.of(settings), Access.of(access)
    return CarlaSimulator(embedded, storyboard, settings=chosen, access=where)


CARLA = Kind(
    "carla",
    "A CARLA server, 0.9.13 to 0.9.16: its physics, light and weather (docs/carla.md).",
    _make,
    settings=MEANINGS,
    access=OPTIONS,
    device="GPU",  # a server each
)
