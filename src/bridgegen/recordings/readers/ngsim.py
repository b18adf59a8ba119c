"""NGSIM trajectories: comma-separated with a head, or the 18 columns between spaces without one.

Lengths are feet, times milliseconds. Local_Y runs along the road, Local_X from its left edge to the
right; a position is that of the front's centre. Here x runs along the road and y to its left, and
the centre is half a length behind the front, along the heading with which the rear axle follows it.
Vehicle numbers are used again, so a vehicle is told by its number and its number of frames.

Source: US DOT FHWA, Next Generation Simulation (NGSIM) Vehicle Trajectories, metadata.
"""

import itertools
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import CAR, MOTORCYCLE, TRUCK
from bridgegen.recordings.readers.columns import read_columns, whole_numbers
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.smoothing import NOISE, scatter, smooth
from bridgegen.recordings.readers.states import SHORTEST_ARM, centre_ahead, headings_behind
from bridgegen.recordings.readers.table import (
    NO_LANE,
    UNKNOWN_KIND,
    Facts,
    RecordedTraffic,
    build,
    median_step,
    numbered,
    per_participant,
)

FOOT = 0.3048  # m
CLASSES = {1: MOTORCYCLE, 2: CAR, 3: TRUCK}

NUMBERS = (
    "Vehicle_ID",
    "Total_Frames",
    "Global_Time",
    "Local_X",
    "Local_Y",
    "v_length",
    "v_Width",
    "v_Class",
    "v_Vel",
    "v_Acc",
    "Lane_ID",
)
TEXT_FILE = (
    "Vehicle_ID", "Frame_ID", "Total_Frames", "Global_Time", "Local_X", "Local_Y", "Global_X",
    "Global_Y", "v_length", "v_Width", "v_Class", "v_Vel", "v_Acc", "Lane_ID", "Preceding",
    "Following", "Space_Headway", "Time_Headway",
)  # fmt: skip
EPOCH = (1.0e12, 2.0e12)
"""Range of Global_Time [ms]: the years 2001 to 2033."""


def _is_text_file(head: Head) -> bool:
    fields = head.data.split(b"\n", 1)[0].split()
    try:
        numbers = [float(field) for field in fields]
    except ValueError:
        return False
    # A file without a head line is told by the number of its columns and by a plausible time.
    return len(numbers) == len(TEXT_FILE) and EPOCH[0] < numbers[3] < EPOCH[1]


def _recognises(head: Head) -> bool:
    return head.has("Vehicle_ID", "Global_Time", "Local_X", "Local_Y") or _is_text_file(head)


def _read(path: Path) -> Iterator[RecordedTraffic]:
    with path.open("rb") as file:
        head = Head(path, file.readline(4096))
    text_file = _is_text_file(head)
    texts = ("Location",) if head.has("Location") else ()
    data = read_columns(path, NUMBERS, texts, names=TEXT_FILE if text_file else None)
    first_line = 1 if text_file else 2
    places, codes = data.texts.get("Location", ([path.stem], np.zeros(0, dtype=np.int64)))
    for code, place in enumerate(places):
        rows = np.flatnonzero(codes == code) if texts else np.arange(len(data.numbers["v_Vel"]))
        values = {name: column[rows] for name, column in data.numbers.items()}
        yield _recording(path, place, values, rows + first_line)


def _recording(path: Path, place: str, values: dict[str, Float], lines: Int) -> RecordedTraffic:
    head = 0 if lines[0] == 1 else 1
    number, frames = (
        whole_numbers(path, name, values[name], head) for name in ("Vehicle_ID", "Total_Frames")
    )
    # Numbers of vehicles are used again; number and number of frames together tell who is meant.
    keys, ids = numbered(number * 2**24 + np.clip(frames, 0, 2**24 - 1))
    order = np.lexsort((values["Global_Time"], ids))
    values = {name: column[order] for name, column in values.items()}
    ids, lines = ids[order], lines[order]
    time = (values["Global_Time"] - values["Global_Time"].min()) / 1000.0
    x, y = values["Local_Y"] * FOOT, -values["Local_X"] * FOOT
    sizes = {name: per_participant(ids, values[name]) for name in ("v_length", "v_Width")}
    classes = per_participant(ids, values["v_Class"])
    bounds = np.searchsorted(ids, np.arange(len(keys) + 1))
    kinds = np.array(
        [
            UNKNOWN_KIND if np.isnan(item) else CLASSES.get(int(item), UNKNOWN_KIND)
            for item in classes
        ]
    )
    length = np.nan_to_num(sizes["v_length"]) * FOOT
    arm = 0.5 * length + np.array(
        [
            centre_ahead(CAR if kind == UNKNOWN_KIND else kind, item)
            for kind, item in zip(kinds.tolist(), length.tolist(), strict=True)
        ]
    )
    # For headings alone: with raw fronts 5 % of the lane changes seemed to begin before the
    # recording.
    quiet = _without_noise(time, x, y, bounds)
    heading = headings_behind(*quiet, bounds, np.maximum(arm, SHORTEST_ARM))
    behind = 0.5 * length[ids]
    speed, lane = values["v_Vel"] * FOOT, values["Lane_ID"]
    facts = Facts(
        name=place,
        format=FORMAT.name,
        source=str(path),
        time_step=median_step(time, bounds),
        frame="the road's: x along Local_Y, y to the left",
        notes=("headings are those with which rear axles follow the fronts",),
    )
    numbers = [key // 2**24 for key in keys.tolist()]
    used = Counter(numbers)
    names = [
        str(number) if used[number] == 1 else f"{number} of {key % 2**24} frames"
        for number, key in zip(numbers, keys.tolist(), strict=True)
    ]
    return build(
        facts,
        ids,
        {
            "time": time,
            "x": x - behind * np.cos(heading),
            "y": y - behind * np.sin(heading),
            "heading": heading,
            "vx": speed * np.cos(heading),
            "vy": speed * np.sin(heading),
            "acceleration": values["v_Acc"] * FOOT,
            "lane": np.where(np.abs(lane) < 1e6, lane, NO_LANE),
        },
        lambda i: f"{path}, line {lines[i]}",
        names=names,
        kind=kinds,
        length=sizes["v_length"] * FOOT,
        width=sizes["v_Width"] * FOOT,
    )


def _without_noise(time: Float, x: Float, y: Float, bounds: Int) -> tuple[Float, Float]:
    """Return positions, smoothed where they scatter, for directions."""
    x, y = x.copy(), y.copy()
    for begin, end in itertools.pairwise(bounds.tolist()):
        at = slice(begin, end)
        if scatter(x[at], y[at]) > NOISE:
            step = float(time[end - 1] - time[begin]) / (end - begin - 1)
            x[at], y[at] = (smooth(values[at], step, 0) for values in (x, y))
    return x, y


FORMAT = Format(
    name="NGSIM",
    title="NGSIM (.csv, .txt)",
    recognises=_recognises,
    read=_read,
)
