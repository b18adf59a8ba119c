"""The lanes of ScenarioNet's map features.

Source: metadriverse/metadrive, metadrive/type.py and metadrive/scenario/scenario_description.py.
"""

from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.readers.centre_lines import lanelets_of_centre_lines
from bridgegen.recordings.readers.pickles import PickledArray
from bridgegen.recordings.readers.road_lines import CentreLine
from bridgegen.recordings.readers.table import Lanelet

KINDS = {"LANE_BIKE_LANE": ("bicycleLane",)}


def lanelets_of(place: str, features: Any) -> tuple[tuple[Lanelet, ...], tuple[str, ...]]:
    """Return the lanelets of map features, and what was assumed.

    Raises:
        FileFormatError: a feature is malformed, or the map too large.
    """
    if not isinstance(features, dict):
        raise FileFormatError(f"{place}: map_features must be a dictionary")
    lines: list[CentreLine] = []
    road: dict[str, Float] = {}
    for name, feature in features.items():
        at = f"{place}, map feature '{str(name)[:40]}'"
        if not isinstance(feature, dict):
            raise FileFormatError(f"{at} must be a dictionary")
        kind = str(feature.get("type"))
        if kind.startswith(("ROAD_LINE", "ROAD_EDGE")) and "polyline" in feature:
            road[str(name)] = _points(at, feature["polyline"])
        elif kind.startswith("LANE_") and "polyline" in feature:
            exits = feature.get("exit_lanes")
            lines.append(
                CentreLine(
                    name=str(name)[:200],
                    points=_points(at, feature["polyline"]),
                    borders=tuple(
                        str(border.get("boundary_feature_id"))
                        for side in ("left_boundaries", "right_boundaries")
                        for border in _listed(feature.get(side))
                        if isinstance(border, dict)
                    ),
                    outline=_closed(_points(at, feature["polygon"]))
                    if "polygon" in feature
                    else None,
                    successors=tuple(str(exit)[:200] for exit in exits)
                    if isinstance(exits, list)
                    else None,
                    kinds=KINDS.get(kind, ()),
                )
            )
    return lanelets_of_centre_lines(lines, road, place)


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _closed(outline: Float) -> Float:
    return np.concatenate([outline, outline[:1]])


def _points(place: str, value: Any) -> Float:
    try:
        array = value.array() if isinstance(value, PickledArray) else np.array(value)
        points = array.astype(np.float64)
    except (ValueError, TypeError):
        points = np.empty(0)
    if not points.size:
        return np.empty((0, 2))
    if points.ndim != 2 or points.shape[1] < 2:
        raise FileFormatError(f"{place}: its line must be an array of points")
    return points[:, :2]
