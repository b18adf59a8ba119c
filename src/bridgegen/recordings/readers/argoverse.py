"""Argoverse 2 motion forecasting scenarios (Parquet); needs the extra ``parquet``.

There are no boxes in them. Lanes are those of the map that lies beside the file, if it does.

Source: argoverse/av2-api, src/av2/datasets/motion_forecasting/data_schema.py.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Int
from bridgegen.base.errors import FileFormatError
from bridgegen.base.extras import require
from bridgegen.drivers.kinds import BICYCLE, BUS, CAR, MOTORCYCLE, OTHER, PEDESTRIAN
from bridgegen.recordings.readers.argoverse_map import map_beside, read_lanelets
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.table import (
    MOST_STATES,
    UNKNOWN_KIND,
    Facts,
    RecordedTraffic,
    Where,
    build,
    numbered,
)

TIME_STEP = 0.1
"""Time step of the data set [s]."""
KINDS = {
    "vehicle": CAR,
    "bus": BUS,
    "motorcyclist": MOTORCYCLE,
    "cyclist": BICYCLE,
    "pedestrian": PEDESTRIAN,
    "riderless_bicycle": OTHER,
    "static": OTHER,
    "construction": OTHER,
    "background": OTHER,
}
NUMBERS = ("timestep", "position_x", "position_y", "heading", "velocity_x", "velocity_y")


def _recognises(head: Head) -> bool:
    return head.data.startswith(b"PAR1")


def _read(path: Path) -> Iterator[RecordedTraffic]:
    require("parquet", f"{path}: reading Parquet")
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = (*NUMBERS, "track_id", "object_type", "scenario_id", "city")
    try:
        with pq.ParquetFile(path) as file:
            missing = [name for name in columns if name not in file.schema_arrow.names]
            if missing:
                raise FileFormatError(f"{path}: columns are missing: {', '.join(missing)}")
            if file.metadata.num_rows > MOST_STATES:
                raise FileFormatError(f"{path}: may hold {MOST_STATES:,} states, got more")
            data = file.read(columns=list(columns))
        values = {name: data[name].cast(pa.float64()).to_numpy() for name in NUMBERS}
        texts = {
            name: [str(item) for item in data[name].to_pylist()]
            for name in ("track_id", "object_type", "scenario_id", "city")
        }
    except (pa.ArrowException, OSError) as error:
        first = str(error).splitlines()[0]
        raise FileFormatError(f"{path}: no valid Parquet file: {first}") from None
    if not texts["track_id"]:
        raise FileFormatError(f"{path}: holds no states")
    scenarios, codes = numbered(np.array(texts["scenario_id"]))
    for code, scenario in enumerate(scenarios.tolist()):
        rows = np.flatnonzero(codes == code)
        tracks, ids = numbered(np.array(texts["track_id"])[rows])
        _, at = np.unique(ids, return_index=True)
        beside = map_beside(path, scenario)
        facts = Facts(
            name=scenario,
            format=FORMAT.name,
            source=str(path),
            time_step=TIME_STEP,
            frame=f"the city's ({texts['city'][rows[0]]})",
            map=beside.name if beside else "",
            lanelets=read_lanelets(beside) if beside else (),
        )
        of = {name: column[rows] for name, column in values.items()}
        yield build(
            facts,
            ids,
            {
                "time": of["timestep"] * TIME_STEP,
                "x": of["position_x"],
                "y": of["position_y"],
                "heading": of["heading"],
                "vx": of["velocity_x"],
                "vy": of["velocity_y"],
            },
            _rows_of(path, rows),
            names=tracks.tolist(),
            kind=[KINDS.get(texts["object_type"][rows[i]], UNKNOWN_KIND) for i in at.tolist()],
        )


def _rows_of(path: Path, rows: Int) -> Where:
    return lambda i: f"{path}, row {rows[i] + 1}"


FORMAT = Format(
    name="Argoverse 2",
    title="Argoverse 2 motion forecasting (.parquet)",
    recognises=_recognises,
    read=_read,
)
