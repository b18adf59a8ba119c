"""The lane segments of an Argoverse 2 map (JSON), which lies beside its scenario.

Source: argoverse/av2-api, src/av2/map/lane_segment.py.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.openx.xml import read_bytes
from bridgegen.recordings.readers.table import FARTHEST, Lanelet

KINDS = {"BIKE": ("bicycleLane",)}
MOST_BYTES = 256 * 2**20


def map_beside(path: Path, scenario: str) -> Path | None:
    """Return the map of a scenario, if it is beside the scenario's file."""
    if "/" in scenario or "\0" in scenario or len(scenario) > 200:
        return None
    found = path.parent / f"log_map_archive_{scenario}.json"
    return found if found.is_file() else None


def read_lanelets(path: Path) -> tuple[Lanelet, ...]:
    """Return the lanelets of a map.

    Raises:
        FileFormatError: unreadable, no valid JSON, or a segment is malformed.
    """
    try:
        whole = json.loads(read_bytes(path, limit=MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"{path}: no valid JSON: {error}") from None
    segments = whole.get("lane_segments") if isinstance(whole, dict) else None
    if not isinstance(segments, dict):
        raise FileFormatError(f"{path}: lane_segments must be an object")
    bounds: dict[str, tuple[Float, Float]] = {}
    for name, segment in segments.items():
        place = f"{path}, lane segment '{name[:40]}'"
        if not isinstance(segment, dict):
            raise FileFormatError(f"{place} must be an object")
        left, right = (_points(place, segment.get(f"{side}_lane_boundary")) for side in _SIDES)
        bounds[name] = left, right
    return tuple(_lanelet(name, segments[name], bounds) for name in bounds)


_SIDES = ("left", "right")


def _lanelet(name: str, record: dict[str, Any], bounds: dict[str, tuple[Float, Float]]) -> Lanelet:
    beside = {side: str(record.get(f"{side}_neighbor_id")) for side in _SIDES}
    same = {
        side: other
        for side, other in beside.items()
        if other in bounds and _course(bounds[name]) @ _course(bounds[other]) > 0.0
    }
    other = beside["left"]
    successors = record.get("successors")
    return Lanelet(
        name=name,
        left=bounds[name][0],
        right=bounds[name][1],
        left_same=same.get("left", ""),
        right_same=same.get("right", ""),
        left_opposite=other if other in bounds and "left" not in same else "",
        successors=tuple(map(str, successors)) if isinstance(successors, list) else (),
        kinds=KINDS.get(str(record.get("lane_type")), ()),
    )


def _course(bounds: tuple[Float, Float]) -> Float:
    step: Float = bounds[0][-1] - bounds[0][0] + bounds[1][-1] - bounds[1][0]
    return step


def _points(place: str, value: Any) -> Float:
    try:
        points = np.array([[float(item["x"]), float(item["y"])] for item in value])
    except (TypeError, KeyError, ValueError):
        points = np.empty((0, 2))
    if len(points) < 2 or not (np.abs(points) <= FARTHEST).all():
        raise FileFormatError(
            f"{place}: each boundary must have two points at least, with x and y [m] within "
            f"±{FARTHEST:g}"
        )
    return points
