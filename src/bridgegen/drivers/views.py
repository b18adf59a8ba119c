"""What a driver in Python wants, put together in its own process.

The simulator sends plain arrays by the word of `WANTS`; what they mean is decided here. Road maps
are sent once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float
from bridgegen.drivers.compiled import LANES
from bridgegen.drivers.interface import (
    HISTORY,
    HISTORY_STEP,
    Conflicts,
    Lanes,
    MapView,
    Observation,
    RoadMap,
    Scene,
)

Views = Mapping[str, npt.NDArray[Any]]
"""Arrays by the word of `WANTS`; "lights" with the map; and "missed" with a history, ``(N, F, M,
13)``, the tracks of the instants since the last call, in which the driver was not asked."""

MOST_PIECES = 200_000
"""Largest number of pieces of road maps that are kept for later batches."""

HISTORY_BYTES = 2**26
"""Largest size of the memory in which a history is kept [bytes], if it has room for a second."""


class Viewer:
    """Completes the observations of one driver, in its process.

    Args:
        wants: words of `WANTS`.
    """

    def __init__(self, wants: Sequence[str]) -> None:
        self._wants = wants
        self._maps: list[RoadMap] = []
        self._history: History | None = None
        self._scene: Scene | None = None

    def reset(self, n: int, scene: Scene, sent: "SentMaps | None" = None) -> Scene:
        """Begin N scenarios; return the scene as the driver gets it.

        Args:
            n: N.
            scene: without maps.
            sent: them.
        """
        if sent is not None:
            del self._maps[sent.kept :]
            self._maps += sent.new
            scene = replace(scene, maps=tuple(self._maps[i] for i in sent.numbers))
        self._history = History(scene.time_step) if "history" in self._wants else None
        self._scene = scene
        return scene

    def complete(self, observation: Observation, views: Views) -> Observation:
        """Return an observation with all that the driver wants."""
        if not self._wants:
            return observation
        parts: dict[str, Any] = {}
        if "lanes" in views:
            parts["lanes"] = lanes_of(views["lanes"])
        if "map" in views:
            place = views["map"]
            parts["map"] = MapView(place[:, 0].astype(np.int64), place[:, 1:], views["lights"])
        if "conflicts" in views:
            parts["conflicts"] = Conflicts(views["conflicts"])
        if self._history is not None:
            for tracks in np.moveaxis(views["missed"], 1, 0) if "missed" in views else ():
                self._history.remember(tracks)
            parts["history"] = self._history.remember(observation.tracks)
        return replace(observation, **parts)


class SentMaps:
    """Which road maps a driver gets, and those of them that its process does not have.

    Attributes:
        kept: how many of those that it has it keeps, the first ones.
        new: those that follow them.
        numbers: which of all these the scene has.
    """

    def __init__(self, kept: int, new: Sequence[RoadMap], numbers: Sequence[int]) -> None:
        self.kept, self.new, self.numbers = kept, tuple(new), tuple(numbers)


class MapSender:
    """Keeps which road maps a driver's process has, so that it is sent each once."""

    def __init__(self) -> None:
        self._known: dict[int, int] = {}  # number by id, of the maps that follow
        self._maps: list[RoadMap] = []

    def send(self, maps: Sequence[RoadMap]) -> SentMaps:
        """Return what to send for a scene with some maps."""
        # All are forgotten at once: both ends can tell that by ``kept`` alone.
        if sum(len(map_.pieces) for map_ in self._maps) > MOST_PIECES:
            self._known, self._maps = {}, []
        kept = len(self._maps)
        for map_ in maps:
            if id(map_) not in self._known:
                self._known[id(map_)] = len(self._maps)
                self._maps.append(map_)
        return SentMaps(kept, self._maps[kept:], [self._known[id(map_)] for map_ in maps])


class History:
    """The tracks of the last second, of one batch.

    Frames are written backwards into a long array, of which a history is a view: it is not
    overwritten later, and not copied.

    Args:
        time_step: between two frames [s].
    """

    def __init__(self, time_step: float) -> None:
        self._back = [instants_back(j, time_step) for j in range(HISTORY)]
        self._frames: Float | None = None
        self._next = 0

    def remember(self, tracks: Float) -> Float:
        """Return the history ``(N, M, H, 13)``, read-only, after one more instant's tracks."""
        if self._frames is None or self._next < 0:
            self._frames, self._next = self._moved(tracks)
        self._frames[:, :, self._next] = tracks
        at = self._next
        self._next -= 1
        step = self._back[1]
        if self._back == [j * step for j in range(HISTORY)]:
            found = self._frames[:, :, at : at + self._back[-1] + 1 : max(step, 1)]
        else:
            found = self._frames[:, :, [at + number for number in self._back]]
        # A view of the frames that later histories share: a driver that writes into it would change
        # its own past.
        found.flags.writeable = False
        return found

    def _moved(self, tracks: Float) -> tuple[Float, int]:
        """Return a new array with the last frames at its end, and where the next one goes."""
        n, m, width = tracks.shape
        kept = self._back[-1]
        room = max(kept + 1, HISTORY_BYTES // max(tracks.nbytes, 1) - kept)
        frames = np.zeros((n, m, min(room, 8 * kept + 8) + kept, width))
        if self._frames is not None:
            frames[:, :, -kept:] = self._frames[:, :, :kept]
        return frames, frames.shape[2] - kept - 1


def instants_back(j: int, time_step: float) -> int:
    """Return how many instants before now entry j of a history is."""
    return round(j * HISTORY_STEP / time_step)


def frames(time_step: float) -> int:
    """Return of how many instants the tracks are needed for a history."""
    return instants_back(HISTORY - 1, time_step) + 1


def lanes_of(view: Float) -> Lanes:
    """Return what the lanes are, from rows of the type `LANES`, ``(N, ·)`` float64."""
    seen = view.view(LANES)[:, 0]
    return Lanes(
        speed_limit=seen["speed_limit"],
        width=seen["width"],
        junction=seen["junction"] > 0.0,
        beside=seen["beside"],
        ends=seen["ends"],
        goal=seen["goal"],
        stop_sign=seen["stop_sign"],
        crosswalk=seen["crosswalk"],
    )
