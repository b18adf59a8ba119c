"""INTERACTION's tracks (CSV), those of the challenges too, where a file holds many cases.

Tracks of pedestrians and bicycles have neither heading nor box, and the data do not tell which of
the two they are: who is faster than `FASTEST_WALK` on average while moving is a bicycle.

Source: Zhan et al., INTERACTION Dataset, arXiv 1910.03088, and the data set's format description.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import BICYCLE, BUS, CAR, MOTORCYCLE, PEDESTRIAN, TRUCK
from bridgegen.recordings.readers.columns import Columns, header, read_columns
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.states import STANDING
from bridgegen.recordings.readers.table import (
    UNKNOWN_KIND,
    Facts,
    RecordedTraffic,
    build,
    median_step,
    numbered,
    per_participant,
)

COLUMNS = ("timestamp_ms", "x", "y", "vx", "vy")
MORE = ("psi_rad", "length", "width", "case_id")
TEXTS = ("track_id", "agent_type")
KINDS = {
    "car": CAR,
    "truck": TRUCK,
    "bus": BUS,
    "motorcycle": MOTORCYCLE,
    "bicycle": BICYCLE,
    "pedestrian": PEDESTRIAN,
}
EITHER = "pedestrian/bicycle"
FASTEST_WALK = 2.5  # m/s


def _recognises(head: Head) -> bool:
    return head.has(*COLUMNS, *TEXTS)


def _read(path: Path) -> Iterator[RecordedTraffic]:
    with path.open("rb") as file:
        names = header(file.readline())
    data = read_columns(path, COLUMNS, TEXTS, optional=[name for name in MORE if name in names])
    cases = data.numbers.get("case_id")
    if cases is None:
        yield _recording(path, path.stem, data, np.arange(len(data.numbers["x"])))
        return
    for case in np.unique(cases):
        yield _recording(path, f"{path.stem} case {case:g}", data, np.flatnonzero(cases == case))


def _recording(path: Path, name: str, data: Columns, rows: Int) -> RecordedTraffic:
    values = {key: column[rows] for key, column in data.numbers.items()}
    tracks, codes = data.texts["track_id"]
    distinct, ids = numbered(codes[rows])
    types, of_state = data.texts["agent_type"]
    _, at = np.unique(ids, return_index=True)
    time = values["timestamp_ms"] / 1000.0
    order = np.argsort(ids, kind="stable")
    first = np.searchsorted(ids[order], np.arange(len(distinct) + 1))
    columns = {"time": time, **{key: values[key] for key in ("x", "y", "vx", "vy")}}
    if "psi_rad" in values:
        columns["heading"] = values["psi_rad"]
    kinds, either = _kinds([types[of_state[rows[i]]] for i in at.tolist()], ids, values)
    facts = Facts(
        name=name,
        format=FORMAT.name,
        source=str(path),
        time_step=median_step(time[order], first),
        frame="the map's (Lanelet2, local metres)",
        notes=(f"{either} are pedestrians or bicycles, told apart by their speed",)
        if either
        else (),
    )
    return build(
        facts,
        ids,
        columns,
        lambda i: f"{path}, line {rows[i] + 2}",
        names=[tracks[code] for code in distinct.tolist()],
        kind=kinds,
        length=per_participant(ids, values["length"]) if "length" in values else None,
        width=per_participant(ids, values["width"]) if "width" in values else None,
    )


def _kinds(types: list[str], ids: Int, values: dict[str, Float]) -> tuple[list[int], int]:
    speed = np.hypot(values["vx"], values["vy"])
    usual = per_participant(ids, np.where(speed > STANDING, speed, np.nan))
    kinds = [
        (BICYCLE if usual[p] > FASTEST_WALK else PEDESTRIAN)
        if name.lower() == EITHER
        else KINDS.get(name.lower(), UNKNOWN_KIND)
        for p, name in enumerate(types)
    ]
    return kinds, sum(name.lower() == EITHER for name in types)


FORMAT = Format(
    name="INTERACTION",
    title="INTERACTION (.csv)",
    recognises=_recognises,
    read=_read,
)
