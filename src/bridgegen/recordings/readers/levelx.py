"""The drone recordings of levelXData: highD; inD, rounD, exiD, uniD.

A recording is NN_tracks.csv with NN_tracksMeta.csv and NN_recordingMeta.csv beside it. highD gives
the upper left corner of an upright box in an image whose y axis points down, and calls its extent
along x the width; the others give centres, y up, and headings in degrees.

Source: Krajewski et al., The highD Dataset, ITSC 2018; Bock et al., The inD Dataset, IV 2020; and
the formats' descriptions that come with the data.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import BICYCLE, BUS, CAR, MOTORCYCLE, PEDESTRIAN, TRUCK
from bridgegen.recordings.readers.columns import Columns, read_columns, whole_numbers
from bridgegen.recordings.readers.format import Format, Head, read_head
from bridgegen.recordings.readers.states import (
    SHORTEST_ARM,
    STANDING,
    centre_ahead,
    headings_of_centres,
)
from bridgegen.recordings.readers.table import (
    UNKNOWN_KIND,
    Facts,
    Lanelet,
    RecordedTraffic,
    build,
    line_of_table,
    numbered,
)

HIGHD = ("frame", "id", "x", "y", "width", "height", "xVelocity", "yVelocity")
HIGHD_MORE = ("xAcceleration", "yAcceleration", "laneId")
OTHERS = ("trackId", "frame", "xCenter", "yCenter", "heading", "width", "length")
OTHERS_MORE = ("xVelocity", "yVelocity", "xAcceleration", "yAcceleration")

CLASSES = {
    "car": CAR,
    "van": CAR,
    "truck": TRUCK,
    "truck_bus": TRUCK,
    "bus": BUS,
    "trailer": TRUCK,
    "motorcycle": MOTORCYCLE,
    "bicycle": BICYCLE,
    "pedestrian": PEDESTRIAN,
}
"""Kinds by the recordings' classes; a trailer is a track of its own."""

META, RECORDING_META = "_tracksMeta.csv", "_recordingMeta.csv"
LEFTWARDS = 1
"""highD's driving direction on the upper carriageway, against x; 2 is along it."""


def _recognises(head: Head) -> bool:
    return head.has(*HIGHD) or head.has(*OTHERS)


def _companion(head: Head) -> bool:
    return head.path.name.endswith((META, RECORDING_META)) or head.has("frameRate", "locationId")


def _read(path: Path) -> Iterator[RecordedTraffic]:
    if not path.name.endswith("_tracks.csv"):
        raise FileFormatError(
            f"{path}: the name of a levelX recording ends in _tracks.csv, so that its metadata "
            f"are found ({META}, {RECORDING_META})"
        )
    stem = path.name.removesuffix("_tracks.csv")
    about = read_columns(
        path.with_name(stem + RECORDING_META), ("frameRate",), optional=("locationId",)
    ).numbers
    rate = float(about["frameRate"][0])
    if not 1.0 <= rate <= 1000.0:
        raise FileFormatError(
            f"{path.with_name(stem + RECORDING_META)}, line 2: 1 <= frameRate <= 1000 [Hz] must "
            f"hold, got {rate:g}"
        )
    with path.open("rb") as file:
        is_highd = Head(path, file.readline()).has(*HIGHD)
    yield (_read_highd if is_highd else _read_others)(path, stem, rate, about)


def _facts(
    path: Path,
    rate: float,
    about: dict[str, Float],
    frame: str,
    *notes: str,
    lanelets: tuple[Lanelet, ...] = (),
) -> Facts:
    place = about.get("locationId")
    where = "" if place is None or not np.isfinite(place[0]) else f", location {place[0]:g}"
    return Facts(
        name=path.name.removesuffix("_tracks.csv"),
        format=FORMAT.name,
        source=str(path),
        time_step=1.0 / rate,
        frame=frame + where,
        notes=notes,
        lanelets=lanelets,
    )


def _read_highd(path: Path, stem: str, rate: float, about: dict[str, Float]) -> RecordedTraffic:
    data = read_columns(path, HIGHD, optional=HIGHD_MORE).numbers
    tracks, ids = _ids(path, "id", data.pop("id"))
    meta = read_columns(
        path.with_name(stem + META), ("id", "width", "height", "drivingDirection"), ("class",)
    )
    rows = _rows(path, stem, "id", meta, tracks)
    # highD calls a box's extent along the road its width, and the one across its height.
    length, width = meta.numbers["width"][rows], meta.numbers["height"][rows]
    # highD's y points down the image: all that has a y changes its sign, headings and lanes too.
    vx, vy = data.pop("xVelocity"), -data.pop("yVelocity")
    along = np.where(meta.numbers["drivingDirection"][rows] == LEFTWARDS, np.pi, 0.0)[ids]
    kinds, time = _kinds(meta, rows), data.pop("frame") / rate
    # highD says how centres move and not how vehicles are turned. The direction of motion would let
    # the rear axle swing out when a lane change begins, by which a long vehicle's centre was 0.1 m
    # off.
    heading = _headings(ids, time, vx, vy, along, kinds, length)
    columns: dict[str, npt.NDArray[Any]] = {
        "time": time,
        "x": data.pop("x") + 0.5 * data.pop("width"),
        "y": -(data.pop("y") + 0.5 * data.pop("height")),
        "heading": heading,
        "vx": vx,
        "vy": vy,
    }
    if {"xAcceleration", "yAcceleration"} <= set(data):
        columns["acceleration"] = data["xAcceleration"] * np.cos(heading) - data[
            "yAcceleration"
        ] * np.sin(heading)
    if "laneId" in data:
        columns["lane"] = whole_numbers(path, "laneId", data["laneId"])
    frame = "the road's, x along it, y up (the image's y turned)"
    ends = (float(columns["x"].min()), float(columns["x"].max()))
    lanelets = _lanes(path.with_name(stem + RECORDING_META), ends)
    return build(
        _facts(path, rate, about, frame, lanelets=lanelets),
        ids,
        columns,
        line_of_table(str(path)),
        names=[str(track) for track in tracks],
        kind=kinds,
        length=length,
        width=width,
    )


def _headings(
    ids: Int, time: Float, vx: Float, vy: Float, along: Float, kinds: Int, length: Float
) -> Float:
    """Return headings with which rear axles follow the centres, ``(S,)`` [rad].

    Where nothing has moved yet, it is the driving direction ``along``.
    """
    order = np.lexsort((time, ids))
    first = np.searchsorted(ids[order], np.arange(len(kinds) + 1))
    begin = order[first[:-1]]
    moves = np.hypot(vx[begin], vy[begin]) > STANDING
    arm = np.array(
        [
            centre_ahead(CAR if kind == UNKNOWN_KIND else kind, item)
            for kind, item in zip(kinds.tolist(), length.tolist(), strict=True)
        ]
    )
    found = np.empty(len(ids))
    found[order] = headings_of_centres(
        time[order],
        vx[order],
        vy[order],
        first,
        np.maximum(arm, SHORTEST_ARM),
        np.where(moves, np.arctan2(vy[begin], vx[begin]), along[begin]),
    )
    return found


def _lanes(path: Path, ends: tuple[float, float]) -> tuple[Lanelet, ...]:
    """Return the lanes between highD's markings, from end to end, named as in the tracks.

    Its lanes are numbered from the top of the image, the strips beside the carriageways included:
    with four upper markings, the upper lanes are 2, 3 and 4, and the lower ones begin with 6.
    """
    if not read_head(path).has("upperLaneMarkings", "lowerLaneMarkings"):
        return ()
    texts = read_columns(path, (), ("upperLaneMarkings", "lowerLaneMarkings")).texts
    found: list[Lanelet] = []
    number = 2
    for name, is_leftwards in (("upperLaneMarkings", True), ("lowerLaneMarkings", False)):
        text = texts[name][0][0]
        try:
            y = -np.array([float(part) for part in text.split(";")])
        except ValueError:
            y = np.full(1, np.nan)
        if not (np.isfinite(y).all() and (np.diff(y) < 0.0).all()):
            raise FileFormatError(
                f"{path}, line 2: {name} [m] must be ascending numbers separated by ;, "
                f"got '{text[:40]}'"
            )
        x = ends[::-1] if is_leftwards else ends
        last = number + len(y) - 2
        for k in range(len(y) - 1):
            upper, lower = (np.column_stack([x, np.full(2, item)]) for item in (y[k], y[k + 1]))
            left, right = (lower, upper) if is_leftwards else (upper, lower)
            above = str(number + k - 1) if k else ""
            below = str(number + k + 1) if number + k < last else ""
            beside = (below, above) if is_leftwards else (above, below)
            found.append(Lanelet(str(number + k), left, right, *beside, is_marked=True))
        number = last + 2
    return tuple(found)


def _read_others(path: Path, stem: str, rate: float, about: dict[str, Float]) -> RecordedTraffic:
    data = read_columns(path, OTHERS, optional=OTHERS_MORE).numbers
    tracks, ids = _ids(path, "trackId", data.pop("trackId"))
    meta = read_columns(path.with_name(stem + META), ("trackId", "width", "length"), ("class",))
    rows = _rows(path, stem, "trackId", meta, tracks)
    heading = np.radians(data.pop("heading"))
    columns = {
        "time": data.pop("frame") / rate,
        "x": data.pop("xCenter"),
        "y": data.pop("yCenter"),
        "heading": heading,
    }
    if {"xVelocity", "yVelocity"} <= set(data):
        columns |= {"vx": data["xVelocity"], "vy": data["yVelocity"]}
    if {"xAcceleration", "yAcceleration"} <= set(data):
        columns["acceleration"] = data["xAcceleration"] * np.cos(heading) + data[
            "yAcceleration"
        ] * np.sin(heading)
    frame = "the recording's, east and north of its UTM origin"
    return build(
        _facts(path, rate, about, frame),
        ids,
        columns,
        line_of_table(str(path)),
        names=[str(track) for track in tracks],
        kind=_kinds(meta, rows),
        length=meta.numbers["length"][rows],
        width=meta.numbers["width"][rows],
    )


def _ids(path: Path, name: str, values: Float) -> tuple[Int, Int]:
    distinct, ids = numbered(whole_numbers(path, name, values))
    return distinct.astype(np.int64), ids


def _rows(path: Path, stem: str, key: str, meta: Columns, tracks: Int) -> Int:
    """Return each track's row of the metadata."""
    row_of = {int(number): row for row, number in enumerate(meta.numbers[key])}
    missing = [str(item) for item in tracks.tolist() if item not in row_of]
    if missing:
        raise FileFormatError(
            f"{path.with_name(stem + META)}: says nothing of {len(missing)} tracks of {path.name}: "
            f"{', '.join(missing[:5])}{' …' if len(missing) > 5 else ''}"
        )
    return np.array([row_of[item] for item in tracks.tolist()], dtype=np.int64)


def _kinds(meta: Columns, rows: Int) -> Int:
    names, codes = meta.texts["class"]
    kinds = np.array([CLASSES.get(name.lower(), UNKNOWN_KIND) for name in names])
    return kinds[codes[rows]]


FORMAT = Format(
    name="levelX",
    title="levelX: highD, inD, rounD, exiD, uniD (_tracks.csv)",
    recognises=_recognises,
    read=_read,
    companion=_companion,
)
