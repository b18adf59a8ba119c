"""Waymo's motion data as JSON, in the form of GPUDrive, PufferDrive and Nocturne.

Headings are radians; Nocturne's older files have degrees, which is told by their size. Lanes are
made of the centre lines, lines and edges among the roads.

Source: Emerge-Lab/gpudrive, README and data_utils.
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import BICYCLE, CAR, PEDESTRIAN
from bridgegen.openx.xml import read_bytes
from bridgegen.recordings.readers.centre_lines import lanelets_of_centre_lines
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.road_lines import CentreLine
from bridgegen.recordings.readers.table import UNKNOWN_KIND, Facts, Lanelet, RecordedTraffic, build

TIME_STEP = 0.1
"""Time step of the Waymo Open Motion Dataset [s]; the file does not repeat it."""
KINDS = {"vehicle": CAR, "pedestrian": PEDESTRIAN, "cyclist": BICYCLE}
BICYCLE_LANE = 3
"""Waymo's number of bicycle lanes."""
MOST_BYTES = 256 * 2**20


def _recognises(head: Head) -> bool:
    text = head.data.lstrip()
    return text.startswith(b"{") and b'"objects"' in text and b'"position"' in text


def _read(path: Path) -> Iterator[RecordedTraffic]:
    try:
        whole = json.loads(read_bytes(path, limit=MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"{path}: no valid JSON: {error}") from None
    objects = whole.get("objects") if isinstance(whole, dict) else None
    if not isinstance(objects, list):
        raise FileFormatError(f"{path}: objects must be a list")
    ids: list[int] = []
    rows: list[list[float]] = []
    places: list[tuple[int, int]] = []
    names: list[str] = []
    kinds: list[int] = []
    boxes: list[list[float]] = []
    for number, obj in enumerate(objects):
        states = _states(f"{path}, objects[{number}]", obj)
        if not states:
            continue
        ids += [len(names)] * len(states)
        rows += states
        places += [(number, int(state[0])) for state in states]
        names.append(str(obj.get("id", number)))
        kinds.append(KINDS.get(str(obj.get("type")), UNKNOWN_KIND))
        boxes.append([_size(obj.get(name)) for name in ("length", "width")])
    if not rows:
        raise FileFormatError(f"{path}: holds no states")
    table = np.array(rows)
    notes = []
    if np.abs(table[:, 3]).max() > 2.0 * math.pi + 1e-3:
        table[:, 3] = np.radians(table[:, 3])
        notes.append("headings are taken as degrees")
    lanelets, assumed = _lanelets(path, whole.get("roads") or [])
    notes += assumed
    size = np.array(boxes)
    facts = Facts(
        name=str(whole.get("name", path.stem))[:200],
        format=FORMAT.name,
        source=str(path),
        time_step=TIME_STEP,
        frame="the scenario's (Waymo), metres",
        map="roads of the file" if whole.get("roads") else "",
        notes=tuple(notes),
        lanelets=lanelets,
    )
    yield build(
        facts,
        np.array(ids),
        {
            "time": table[:, 0] * TIME_STEP,
            "x": table[:, 1],
            "y": table[:, 2],
            "heading": table[:, 3],
            "vx": table[:, 4],
            "vy": table[:, 5],
        },
        lambda i: f"{path}, objects[{places[i][0]}], step {places[i][1]}",
        names=names,
        kind=kinds,
        length=size[:, 0],
        width=size[:, 1],
    )


def _lanelets(path: Path, roads: Any) -> tuple[tuple[Lanelet, ...], tuple[str, ...]]:
    if not isinstance(roads, list):
        raise FileFormatError(f"{path}: roads must be a list")
    lines: list[CentreLine] = []
    road: dict[str, Float] = {}
    for number, record in enumerate(roads):
        kind = record.get("type") if isinstance(record, dict) else None
        if kind not in ("lane", "road_line", "road_edge"):
            continue
        points = _line(f"{path}, roads[{number}]", record.get("geometry"))
        if kind != "lane":
            road[str(number)] = points
            continue
        is_bicycle = record.get("map_element_id") == BICYCLE_LANE
        name = str(record.get("id", f"roads[{number}]"))[:200]
        lines.append(CentreLine(name, points, kinds=("bicycleLane",) if is_bicycle else ()))
    return lanelets_of_centre_lines(lines, road, str(path))


def _line(place: str, geometry: Any) -> Float:
    try:
        points = np.array([[float(item["x"]), float(item["y"])] for item in geometry])
    except (TypeError, KeyError, ValueError):
        raise FileFormatError(f"{place}: geometry must be a list of points x, y") from None
    return points.reshape(-1, 2)


def _states(place: str, value: Any) -> list[list[float]]:
    """Return the valid states of an object: step, x, y, heading, vx, vy."""
    if not isinstance(value, dict):
        raise FileFormatError(f"{place} must be an object")
    lists = [value.get(name) for name in ("position", "heading", "velocity", "valid")]
    if not all(isinstance(each, list) for each in lists):
        raise FileFormatError(f"{place}: position, heading, velocity and valid must be lists")
    position, heading, velocity, valid = (list(each or []) for each in lists)
    if not len(position) == len(heading) == len(velocity) == len(valid):
        raise FileFormatError(f"{place}: position, heading, velocity and valid differ in length")
    found = []
    for step, (p, h, v, counts) in enumerate(zip(position, heading, velocity, valid, strict=True)):
        if not counts:
            continue
        try:
            state = [float(step), p["x"], p["y"], h, v["x"], v["y"]]
            good = all(isinstance(each, int | float) for each in state)
        except (TypeError, KeyError):
            good = False
        if not good:
            raise FileFormatError(f"{place}, step {step}: must have numbers x, y, heading, vx, vy")
        found.append(state)
    return found


def _size(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


FORMAT = Format(
    name="WOMD JSON",
    title="Waymo motion as JSON, GPUDrive's form (.json)",
    recognises=_recognises,
    read=_read,
)
