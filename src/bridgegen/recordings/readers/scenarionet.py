"""ScenarioNet's scenarios (pickle), read by a restricted reader; see `pickles`.

Lanes are made of the map features.

Source: metadriverse/scenarionet and metadrive/scenario/scenario_description.py.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import BICYCLE, CAR, MOTORCYCLE, OTHER, PEDESTRIAN
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.pickles import PickledArray, read_pickle
from bridgegen.recordings.readers.scenarionet_map import lanelets_of
from bridgegen.recordings.readers.table import (
    UNKNOWN_KIND,
    Facts,
    RecordedLight,
    RecordedTraffic,
    build,
    changes_of,
    median_step,
)

KINDS = {
    "VEHICLE": CAR,
    "PEDESTRIAN": PEDESTRIAN,
    "CYCLIST": BICYCLE,
    "MOTORCYCLIST": MOTORCYCLE,
    "TRAFFIC_CONE": OTHER,
    "TRAFFIC_BARRIER": OTHER,
    "TRAFFIC_OBJECT": OTHER,
}
LIGHTS = {
    "LANE_STATE_STOP": "red",
    "LANE_STATE_ARROW_STOP": "red",
    "LANE_STATE_CAUTION": "yellow",
    "LANE_STATE_ARROW_CAUTION": "yellow",
    "LANE_STATE_GO": "green",
    "LANE_STATE_ARROW_GO": "green",
    "LANE_STATE_FLASHING_STOP": "flashing red",
    "LANE_STATE_FLASHING_CAUTION": "flashing yellow",
}
"""States of traffic lights by ScenarioNet's; any other state is unknown."""
BESIDE_LANE = 5.0
"""Largest distance of a stop point from its lane [m]: unknown ones are at the origin."""
_PROTOCOLS = (b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05")


def _recognises(head: Head) -> bool:
    return head.data.startswith(_PROTOCOLS)


def _read(path: Path) -> Iterator[RecordedTraffic]:
    # The format is a pickle, which would be code to Python's own reader; ours executes nothing.
    whole = read_pickle(path)
    tracks = whole.get("tracks") if isinstance(whole, dict) else None
    if not isinstance(tracks, dict) or not isinstance(whole.get("metadata"), dict):
        raise FileFormatError(f"{path}: is no scenario of ScenarioNet: has no tracks and metadata")
    metadata = whole["metadata"]
    times = _column(f"{path}, metadata", metadata, "ts" if "ts" in metadata else "timestep")
    ids: list[int] = []
    parts: list[npt.NDArray[np.float64]] = []
    places: list[tuple[str, int]] = []
    names: list[str] = []
    kinds: list[int] = []
    boxes: list[tuple[float, float]] = []
    for name, track in tracks.items():
        place = f"{path}, track '{str(name)[:40]}'"
        states, box = _track(place, track, times)
        if not len(states):
            continue
        ids += [len(names)] * len(states)
        parts.append(states[:, 1:])
        places += [(place, int(step)) for step in states[:, 0]]
        names.append(str(name)[:200])
        kinds.append(KINDS.get(str(track.get("type")), UNKNOWN_KIND))
        boxes.append(box)
    if not parts:
        raise FileFormatError(f"{path}: holds no states")
    table, size, numbers = np.concatenate(parts), np.array(boxes), np.array(ids)
    first = np.searchsorted(numbers, np.arange(len(names) + 1))
    lanelets, notes = lanelets_of(str(path), whole.get("map_features") or {})
    data_set = str(metadata.get("dataset", ""))[:40]
    facts = Facts(
        name=str(whole.get("id", path.stem))[:200],
        format=FORMAT.name,
        source=str(path),
        time_step=median_step(table[:, 0], first),
        frame=f"the scenario's ({data_set})" if data_set else "the scenario's",
        map="map features of the file" if whole.get("map_features") else "",
        lights=MappingProxyType(_lights(path, whole, times)),
        notes=notes,
        lanelets=lanelets,
    )
    yield build(
        facts,
        numbers,
        dict(zip(("time", "x", "y", "heading", "vx", "vy"), table.T, strict=True)),
        lambda i: f"{places[i][0]}, step {places[i][1]}",
        names=names,
        kind=kinds,
        length=size[:, 0],
        width=size[:, 1],
    )


def _lights(
    path: Path, whole: dict[Any, Any], times: npt.NDArray[np.float64]
) -> dict[str, RecordedLight]:
    """Return the traffic lights, and where the lanes lead that they govern."""
    states, features = whole.get("dynamic_map_states"), whole.get("map_features")
    if states is None:
        return {}
    if not isinstance(states, dict):
        raise FileFormatError(f"{path}: dynamic_map_states must be a dictionary")
    found = {}
    for name, light in states.items():
        place = f"{path}, light '{str(name)[:40]}'"
        inner = light.get("state") if isinstance(light, dict) else None
        words = inner.get("object_state") if isinstance(inner, dict) else None
        if not isinstance(words, list) or len(words) > len(times):
            raise FileFormatError(f"{place}: object_state must be a list, one of an instant")
        seen = [LIGHTS.get(str(word), "unknown") for word in words]
        lane = str(light.get("lane", ""))[:200]
        feature = features.get(lane) if isinstance(features, dict) else None
        found[str(name)[:200]] = RecordedLight(
            changes_of(times.tolist(), seen), lane, _beyond_stop(place, light, feature)
        )
    return found


def _beyond_stop(place: str, light: dict[Any, Any], feature: Any) -> npt.NDArray[np.float64]:
    """Return a lane's centre line from the stop point on; none if the file does not say."""
    none = np.zeros((0, 2))
    if light.get("stop_point") is None or not isinstance(feature, dict):
        return none
    if feature.get("polyline") is None:
        return none
    stop = _column(place, light, "stop_point").reshape(-1)[:2]
    line = _column(f"{place}, its lane", feature, "polyline")
    if len(stop) < 2 or line.ndim != 2 or line.shape[1] < 2 or len(line) < 2:
        return none
    line = line[:, :2]
    if not (np.isfinite(stop).all() and np.isfinite(line).all()):
        return none
    apart = np.hypot(*(line - stop).T)
    at = int(apart.argmin())
    if apart[at] > BESIDE_LANE:
        return none
    course = line[min(at + 1, len(line) - 1)] - line[min(at, len(line) - 2)]
    # The nearest point may lie before the stop line; the line begins on it.
    beyond = line[at:][(line[at:] - stop) @ course > 0.0]
    beyond = beyond if len(beyond) else (stop + course)[None]
    return np.concatenate([stop[None], beyond])


def _track(
    place: str, track: Any, times: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], tuple[float, float]]:
    """Return a track's valid states (step, time, x, y, heading, vx, vy) and its box [m]."""
    state = track.get("state") if isinstance(track, dict) else None
    if not isinstance(state, dict):
        raise FileFormatError(f"{place}: must have a state")
    valid = _column(place, state, "valid").astype(np.bool_)
    if valid.ndim != 1:
        raise FileFormatError(f"{place}: valid must be of one dimension, got {valid.ndim}")
    n = len(valid)
    position, velocity = (_column(place, state, name) for name in ("position", "velocity"))
    heading = _column(place, state, "heading").reshape(-1)
    for name, array in (("position", position), ("velocity", velocity)):
        if array.ndim != 2 or len(array) != n or array.shape[1] < 2:
            raise FileFormatError(f"{place}: {name} must be of shape ({n}, 2 or more)")
    if len(heading) != n or n > len(times):
        raise FileFormatError(f"{place}: must have a heading for each of {n} instants")
    steps = np.flatnonzero(valid)
    columns = (steps, times[:n], position[:, 0], position[:, 1], heading, *velocity.T[:2])
    rows = [column if column is steps else column[steps] for column in columns]
    length, width = (
        float(np.median(_column(place, state, name).reshape(-1)[steps]))
        if name in state and len(steps) and np.size(_column(place, state, name)) == n
        else math.nan
        for name in ("length", "width")
    )
    return np.column_stack(rows).astype(np.float64), (length, width)


def _column(place: str, holder: Any, name: str) -> npt.NDArray[np.float64]:
    value = holder.get(name)
    try:
        array = value.array() if isinstance(value, PickledArray) else np.array(value)
        numbers = array.astype(np.float64)
    except (ValueError, TypeError) as error:
        raise FileFormatError(f"{place}: {name} must be an array of numbers: {error}") from None
    if not numbers.ndim:
        raise FileFormatError(f"{place}: {name} must be an array of numbers, got {value!r:.40}")
    return numbers


FORMAT = Format(
    name="ScenarioNet",
    title="ScenarioNet (.pkl)",
    recognises=_recognises,
    read=_read,
)
