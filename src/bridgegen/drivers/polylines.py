"""The map around the ego as learned planners take it: polylines of fixed size in the ego's frame.

    def reset(self, n, scene):
        self._scene = scene

    def act(self, observation):
        polylines = gather(self._scene, observation)  # for a driver that wants "map"

The frame: origin at the ego's reference point, x along its heading, y to its left.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Int
from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import PIECE_POINTS, Observation, RoadMap, Scene

Float32 = npt.NDArray[np.float32]

KINDS, MARKINGS, LIGHTS = 4, 3, 5
ATTRIBUTES = KINDS + MARKINGS + LIGHTS + 2
"""Number of attributes of a polyline."""


@dataclass(frozen=True)
class Polylines:
    """Q polylines of V points around each of N egos, the nearest first.

    Attributes:
        points: ``(N, Q, V, 4)`` float32: x, y [m], cosine and sine of the direction.
        attributes: ``(N, Q, ATTRIBUTES)`` float32: its kind, one of four (centre, border,
            crosswalk, stop line); how it is marked, one of three (not, broken, solid); the state of
            the light that governs its lane, one of five (the codes of `Rollout.lights`; all 0
            where no light does); the speed limit [m/s], 0 where none is posted; and whether its
            lane is of the ego's route.
        mask: ``(N, Q, V)`` bool, which points there are; elsewhere all is 0.
    """

    points: Float32
    attributes: Float32
    mask: Bool


class _Tables:
    """The pieces of all maps of a scene, one after the other; the last one is none."""

    def __init__(self, maps: Sequence[RoadMap]) -> None:
        pieces = [map_.pieces for map_ in maps]
        self.first: Int = np.cumsum([0, *map(len, pieces)])
        self.pieces = np.concatenate([*pieces, np.zeros((1, PIECE_POINTS, 3))])
        h = self.pieces[:, :, 2]
        self.directions = np.stack((np.cos(h), np.sin(h)), axis=-1)
        self.counts: Int = np.concatenate([*(map_.piece_points for map_ in maps), [0]])
        self.light: Int = np.concatenate([*(map_.piece_light for map_ in maps), [-1]])
        self.attributes = np.zeros((len(self.pieces), ATTRIBUTES), dtype=np.float32)
        for map_, first in zip(maps, self.first, strict=False):
            _fill(map_, self.attributes[first : first + len(map_.pieces)])


def _fill(roads: RoadMap, attributes: Float32) -> None:
    rows = np.arange(len(attributes))
    attributes[rows, roads.piece_kind] = 1.0
    attributes[rows, KINDS + roads.piece_marking] = 1.0
    owned = roads.piece_lane >= 0
    limits = np.array([lane.speed_limit[0] for lane in roads.lanes])
    route = set(roads.route)
    on_route = np.array([lane.id in route for lane in roads.lanes])
    if owned.any():
        limit = limits[roads.piece_lane[owned]]
        attributes[owned, -2] = np.where(np.isfinite(limit), limit, 0.0)
        attributes[owned, -1] = on_route[roads.piece_lane[owned]]


_last: list[tuple[tuple[RoadMap, ...], _Tables]] = []
"""The maps of the last scene, and their tables."""


def gather(scene: Scene, observation: Observation) -> Polylines:
    """Return the polylines around the egos.

    Args:
        scene: as ``reset`` got it.
        observation: N instants of it.

    Raises:
        InputError: the driver does not want "map".
    """
    from bridgegen.drivers._path_kernels import gather_points  # numba is slow to import

    view = observation.map
    if view is None:
        raise InputError('gather needs a driver that has "map" in its wants')
    if not _last or _last[0][0] is not scene.maps:
        _last[:] = [(scene.maps, _Tables(scene.maps))]
    tables = _last[0][1]
    near = view.near
    at = np.where(near >= 0, near + tables.first[scene.map_of][:, None], len(tables.pieces) - 1)
    points = np.zeros((*at.shape, PIECE_POINTS, 4), dtype=np.float32)
    mask = np.zeros(points.shape[:3], dtype=np.bool_)
    gather_points(
        at,
        tables.counts,
        tables.pieces,
        tables.directions,
        observation.x,
        observation.y,
        np.cos(observation.h),
        np.sin(observation.h),
        points,
        mask,
    )
    attributes = tables.attributes[at]
    light = tables.light[at]
    if view.lights.shape[1]:
        rows, columns = np.nonzero(light >= 0)
        states = view.lights[rows, light[rows, columns]].astype(np.int64)
        attributes[rows, columns, KINDS + MARKINGS + states] = 1.0
    return Polylines(points, attributes, mask)
