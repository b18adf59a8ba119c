"""CARLA's traffic lights: matched by position, frozen, and controlled by the storyboard."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bridgegen.adapters.carla import frame
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lanes import points
from bridgegen.openx.opendrive.model import OpenDrive

if TYPE_CHECKING:
    import carla

REACH = 12.0
"""Largest distance of a light of CARLA's from one of the map's that it may be, or stand for [m]: a
Town's lights hang elsewhere than the map says, but hold back the same lane."""

STATES = ("Off", "Red", "Red", "Yellow", "Green")
"""CARLA's states for those of `Rollout.lights`; it has no red with yellow."""


def positions(model: OpenDrive, ids: Sequence[str]) -> dict[str, tuple[float, float]]:
    """Return the positions of a road network's signals: x, y [m] by id."""
    wanted, found = set(ids), {}
    for road in model.roads:
        for signal in road.signals:
            if signal.id in wanted:
                x, y = points(road, np.array([signal.s]), np.array([signal.t]))[0, :2].tolist()
                found[signal.id] = (x, y)
    return found


def matched(
    wanted: Mapping[str, tuple[float, float]], known: Sequence[Sequence[tuple[float, float]]]
) -> dict[str, int]:
    """Match lights to signals, the nearest pairs first, each once.

    Args:
        wanted: where the map's stand [m], by id.
        known: where each of the server's may be taken to stand.

    Raises:
        InputError: lights that none is near, all at once.
    """
    # Nearest pairs first, over all lights at once: light by light, one could take its neighbour's.
    # The name breaks ties, so that each run matches alike.
    pairs = sorted(
        (min(math.dist(spot, pair) for pair in spots), name, i)
        for name, spot in wanted.items()
        for i, spots in enumerate(known)
    )
    found: dict[str, int] = {}
    for distance, name, i in pairs:
        if distance <= REACH and name not in found and i not in found.values():
            found[name] = i
    if problems := [
        f"carla: a traffic light must be within {REACH:g} m of the signal '{name}' at "
        f"({x:.1f}, {y:.1f}) m, and the server has none there ({len(known)} elsewhere)"
        for name, (x, y) in wanted.items()
        if name not in found
    ]:
        raise InputError(*problems)
    return found


class Lights:
    """The traffic lights of a world, for a storyboard.

    Those that it does not drive are off: the embedded simulator has none there.

    Args:
        world: CARLA's.
        model: the scenario's road network.
        names: of the S lights that the storyboard drives.

    Raises:
        InputError: one of them is not there.
    """

    def __init__(self, world: "carla.World", model: OpenDrive, names: Sequence[str]) -> None:
        import carla

        self._states = [getattr(carla.TrafficLightState, state) for state in STATES]
        self._actors: list[Any] = list(world.get_actors().filter("traffic.traffic_light*"))
        known = [_spots(actor) for actor in self._actors]
        found = matched(positions(model, names), known) if names else {}
        self._numbers = [found[name] for name in names]
        self._world = world
        self._shown: list[int] = []

    def begin(self) -> None:
        """Freeze all lights, and switch them off."""
        if self._actors:
            self._world.freeze_all_traffic_lights(True)
        # No state: so every light is set once, whatever the last scenario left.
        self._shown = [-1] * len(self._actors)
        for i in range(len(self._actors)):
            self._set(i, 0)

    def show(self, states: npt.NDArray[np.int8]) -> None:
        """Set the states ``(S,)``, see `Rollout.lights`; only changes are sent."""
        for i, state in zip(self._numbers, states.tolist(), strict=True):
            self._set(i, state)

    def _set(self, i: int, state: int) -> None:
        if self._shown[i] != state:
            self._actors[i].set_state(self._states[state])
            self._shown[i] = state


def _spots(light: Any) -> list[tuple[float, float]]:
    """Return where a light may be taken to stand: where it does, and where it holds lanes back."""
    stops = light.get_stop_waypoints()
    return [
        frame.point(light.get_transform().location),
        *(frame.point(stop.transform.location) for stop in stops),
    ]
