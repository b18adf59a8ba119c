"""Drawings of a concrete scenario besides its motion: the road, the bodies, the lights."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import BLUE, BRAKE, BRAKE_LIGHTS_FROM, IS_VEHICLE
from bridgegen.engine.runner import Runner
from bridgegen.openx.opendrive.lanes import points
from bridgegen.openx.opendrive.mirror import as_written
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.outline import Light, Shape, lights, outline
from bridgegen.openx.opendrive.to_owl.furniture import class_of
from bridgegen.pages.playback import Entity, Lamp, Outline
from bridgegen.scenario.ontology.site import Site
from bridgegen.simulation.rollout import Rollout


@dataclass(frozen=True)
class RoadPicture:
    """A road network from above.

    Attributes:
        outlines: in the order in which they are drawn.
        lights: its traffic lights.
        street_lights: ``(n, 2)`` float64 [m].
    """

    outlines: tuple[Outline, ...]
    lights: list[Light]
    street_lights: Float


class Scenery:
    """The drawings of a runner's road networks, each drawn once.

    Args:
        runner: of the scenarios.
    """

    def __init__(self, runner: Runner) -> None:
        self._runner = runner
        self._known: dict[bytes, RoadPicture] = {}

    def road(self, x: Float) -> RoadPicture:
        """Return the drawing of a row's road network, the same objects for the same network."""
        space, source = self._runner.space, self._runner.source
        names = (*source.variant_names, *source.static_names)
        # Rows of one road network share one drawing, and a page holds it once.
        key = x[[space.index(name) for name in names]].tobytes()
        if key not in self._known:
            model = as_written(self._runner.concrete(x).roads)
            found = tuple(Outline(*pair) for pair in _outline(model, source.place(space.values(x))))
            self._known[key] = RoadPicture(found, lights(model), street_lights(model))
        return self._known[key]


def _outline(model: OpenDrive, site: Site | None) -> list[Shape]:
    """Return what to draw of a road network: all of it, or a place of a map with what is near."""
    if site is None:
        return outline(model)
    if site.kind in (None, "Roundabout", "Merge"):
        return outline(model, along=[road.road_id for leg in site.legs for road in leg.roads])
    return outline(model, site.place_id)


def street_lights(model: OpenDrive) -> Float:
    """Return where the street lights of a road network stand, ``(n, 2)`` float64 [m]."""
    found = [
        points(road, np.array([min(obj.s, road.length)]), np.array([obj.t]))[0]
        for road in model.roads
        for obj in road.objects
        if class_of(obj) == "StreetLight"
    ]
    return np.array(found, dtype=np.float64).reshape(-1, 2)


def bodies(rollout: Rollout, types: Mapping[str, str]) -> tuple[Entity, ...]:
    """Return the bodies of a rollout with their types (`Pipeline.bodies`)."""
    return tuple(
        Entity(name, length, width, ahead, types.get(name, "obstacle"))
        for name, (length, width, ahead) in zip(rollout.names, rollout.box.tolist(), strict=True)
    )


def lamps(rollout: Rollout, row: int, found: list[Light]) -> tuple[Lamp, ...]:
    """Return the lights that change in one scenario of a rollout, with their states."""
    shown = {name: number for number, name in enumerate(rollout.light_names)}
    return tuple(
        Lamp(light.x, light.y, light.h, rollout.lights[row, shown[light.id]], light.id)
        for light in found
        if light.id in shown
    )


def vehicle_lamps(rollout: Rollout, sirens: Int) -> npt.NDArray[np.int8]:
    """Return what lamps show, ``(N, E, T)``; where it is not recorded, who brakes shows that.

    Args:
        rollout: of N scenarios and E entities.
        sirens: ``(E,)``, 1 of an emergency vehicle on a call.
    """
    found = np.zeros(rollout.x.shape, dtype=np.int8)
    if rollout.lamps.size:
        found |= rollout.lamps
    elif rollout.kinds.size:
        # An acceleration acts from its instant on: the lamp is seen one instant later.
        brakes = rollout.a[:, :, :-1] <= -BRAKE_LIGHTS_FROM
        lit = brakes & np.array(IS_VEHICLE)[rollout.kinds][:, np.newaxis]
        found[:, :, 1:][lit] = BRAKE
    found[:, np.flatnonzero(sirens)] |= BLUE
    return found
