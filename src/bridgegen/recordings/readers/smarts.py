"""SMARTS' traffic histories (.shf): a database with the tables Spec, Vehicle and Trajectory.

Its headings are counter-clockwise from north (y), positions those of the centres.

Source: SMARTS, smarts/sstudio/genhistories.py and smarts/core/traffic_history.py.
"""

import math
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import CAR, MOTORCYCLE, PEDESTRIAN, TRUCK
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.table import (
    MOST_PARTICIPANTS,
    MOST_STATES,
    NO_LANE,
    UNKNOWN_KIND,
    Facts,
    RecordedTraffic,
    build,
    median_step,
    numbered,
)

CLASSES = {1: MOTORCYCLE, 2: CAR, 3: TRUCK, 4: PEDESTRIAN}
TABLES = {"Vehicle", "Trajectory"}
SIGNATURE = b"SQLite format 3\x00"
BATCH = 100_000  # rows


def _recognises(head: Head) -> bool:
    return head.data.startswith(SIGNATURE)


def _read(path: Path) -> Iterator[RecordedTraffic]:
    try:
        address = path.resolve().as_uri() + "?mode=ro&immutable=1"
        with closing(sqlite3.connect(address, uri=True)) as base:
            base.execute("PRAGMA trusted_schema=OFF")
            tables = {
                name
                for (name,) in base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
            }
            if not tables >= TABLES:
                raise FileFormatError(
                    f"{path}: is a database, but no traffic history of SMARTS: has no table "
                    f"{' or '.join(sorted(TABLES - tables))}"
                )
            yield _recording(path, base)
    except (sqlite3.Error, UnicodeDecodeError) as error:  # names and texts are UTF-8
        raise FileFormatError(f"{path}: is no valid database: {error}") from None


def _recording(path: Path, base: sqlite3.Connection) -> RecordedTraffic:
    states = _rows(path, base, "Trajectory", MOST_STATES, (
        "vehicle_id", "sim_time", "position_x", "position_y", "heading_rad", "speed", "lane_id",
    ), "vehicle_id, sim_time")  # fmt: skip
    vehicles = _rows(
        path, base, "Vehicle", MOST_PARTICIPANTS, ("id", "type", "length", "width"), "id"
    )
    row_of = {item: row for row, item in enumerate(vehicles[:, 0].tolist())}
    distinct, ids = numbered(states[:, 0])
    missing = [item for item in distinct.tolist() if item not in row_of]
    if missing:
        raise FileFormatError(f"{path}: Vehicle says nothing of vehicle_id {missing[0]:g}")
    about = vehicles[[row_of[item] for item in distinct.tolist()]]
    heading, speed, lane = states[:, 4] + math.pi / 2, states[:, 5], states[:, 6]
    first = np.searchsorted(ids, np.arange(len(distinct) + 1))
    facts = Facts(
        name=path.stem,
        format=FORMAT.name,
        source=str(path),
        time_step=median_step(states[:, 1], first),
        frame="the traffic history's",
    )
    return build(
        facts,
        ids,
        {
            "time": states[:, 1],
            "x": states[:, 2],
            "y": states[:, 3],
            "heading": heading,
            "vx": speed * np.cos(heading),
            "vy": speed * np.sin(heading),
            "lane": np.where(np.abs(lane) < 1e6, lane, NO_LANE),
        },
        lambda i: f"{path}, Trajectory of vehicle_id {states[i, 0]:g} at {states[i, 1]:g} s",
        names=[f"{item:g}" for item in distinct.tolist()],
        kind=[CLASSES.get(int(item), UNKNOWN_KIND) for item in np.nan_to_num(about[:, 1])],
        length=about[:, 2],
        width=about[:, 3],
    )


def _rows(
    path: Path, base: sqlite3.Connection, table: str, most: int, columns: tuple[str, ...], by: str
) -> Float:
    """Return columns of a table, ``(R, C)``; NULL is NaN."""
    has = {row[1] for row in base.execute(f"PRAGMA table_info({table})")}
    missing = [name for name in columns if name not in has]
    if missing:
        raise FileFormatError(f"{path}: {table} lacks the columns {', '.join(missing)}")
    cursor = base.execute(f"SELECT {', '.join(columns)} FROM {table} ORDER BY {by}")
    parts: list[Float] = []
    count = 0
    while rows := cursor.fetchmany(BATCH):
        count += len(rows)
        if count > most:
            raise FileFormatError(f"{path}: {table} may hold {most:,} rows, got more")
        parts.append(_numbers(path, table, columns, rows))
    if not parts:
        raise FileFormatError(f"{path}: {table} holds no rows")
    return np.concatenate(parts)


def _numbers(path: Path, table: str, columns: tuple[str, ...], rows: list[Any]) -> Float:
    for row in rows:
        for name, value in zip(columns, row, strict=True):
            if not isinstance(value, int | float | None):
                raise FileFormatError(
                    f"{path}: {name} in {table} must be a number, got '{str(value)[:40]}'"
                )
    return np.array(rows, dtype=np.float64)


FORMAT = Format(
    name="SMARTS",
    title="traffic histories of SMARTS (.shf)",
    recognises=_recognises,
    read=_read,
)
