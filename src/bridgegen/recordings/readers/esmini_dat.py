"""esmini's binary log (``--record``, .dat), version 5.3: packets of what has changed.

Whatever is not written at an instant is as it was, so entities that stand are recorded throughout.

Source: esmini 3.6, PacketHandler.hpp and PacketHandler.cpp.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import ANIMAL, BICYCLE, BUS, CAR, MOTORCYCLE, OTHER, PEDESTRIAN, TRUCK
from bridgegen.openx.xml import read_bytes
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.table import (
    FARTHEST,
    MOST_STATES,
    UNKNOWN_KIND,
    Facts,
    RecordedTraffic,
    build,
    median_step,
)

VERSION = (5, 3)
"""Version of the format, written by esmini 3.2 to 3.6."""
MOST_BYTES = 512 * 2**20
LONGEST_NAME = 200
_ENTITY, _TYPE, _CATEGORY, _TIME, _NAME, _SPEED = 0, 2, 3, 5, 6, 7
_BOX, _POSE, _DELETED, _STEP, _END = 10, 13, 19, 21, 22
_SIZES = {
    _ENTITY: 4,
    _TYPE: 4,
    _CATEGORY: 4,
    _TIME: 8,
    _SPEED: 8,
    _BOX: 48,
    _POSE: 48,
    _DELETED: 0,
    _STEP: 8,
    _END: 8,
}
_VEHICLE, _PEDESTRIAN = 1, 2
KINDS = {
    **{(_VEHICLE, k): kind for k, kind in enumerate((
        CAR, CAR, TRUCK, TRUCK, TRUCK, BUS, MOTORCYCLE, BICYCLE, OTHER, OTHER,
    ))},
    (_PEDESTRIAN, 0): PEDESTRIAN, (_PEDESTRIAN, 1): PEDESTRIAN, (_PEDESTRIAN, 2): ANIMAL,
}  # fmt: skip
"""Kinds by esmini's type and category of an entity; a trailer is an entity of its own."""


def _recognises(head: Head) -> bool:
    return _version(head.data) is not None


def _version(data: bytes) -> tuple[int, ...] | None:
    """Return the version of a log; None if it is none."""
    if len(data) < 24:
        return None
    major, minor, size, text = struct.unpack_from("<4I", data)
    # The format has no magic number: plausible versions and lengths tell it apart. Versions 1 and 2
    # begin with the name of a map and are recognised, so that the refusal can name the version.
    if 3 <= major < 100 and minor < 100 and 12 <= size < 2**16 and text <= size - 4:
        return major, minor
    name = data[4:516].split(b"\0", 1)[0]
    if 1 <= major <= 2 and name.endswith(b".xodr") and name.isascii():
        return (major,)
    return None


def _read(path: Path) -> Iterator[RecordedTraffic]:
    data = read_bytes(path, limit=MOST_BYTES)
    version = _version(data) or ()
    # No file of an earlier version was at hand to try a reader on.
    if version != VERSION:
        raise FileFormatError(
            f"{path}: version {'.'.join(map(str, version))} of esmini's .dat is not supported, "
            f"{VERSION[0]}.{VERSION[1]} is (esmini 3.2 to 3.6); esmini's --csv_logger is read, too"
        )
    (size,) = struct.unpack_from("<I", data, 8)
    (text,) = struct.unpack_from("<I", data, 12)
    log = _Log(str(path))
    log.read(data, 12 + size)
    yield log.traffic(path, data[16 : 16 + text].decode("utf-8", errors="replace")[:200])


@dataclass
class _Entity:
    """An entity as it is at the present instant."""

    number: int
    pose: tuple[float, ...] = ()
    speed: float = math.nan
    box: tuple[float, ...] = (0.0, 0.0, 0.0, math.nan, math.nan, math.nan)
    kind: tuple[int, int] = (-1, -1)
    name: str = ""


@dataclass
class _Log:
    """The states of a log, as its packets are read."""

    source: str
    alive: dict[int, _Entity] = field(default_factory=dict)
    entities: list[_Entity] = field(default_factory=list)
    current: int | None = None
    time: float = math.nan
    step: float = math.nan
    at: int = 0
    rows: list[tuple[float, ...]] = field(default_factory=list)
    places: list[int] = field(default_factory=list)

    def read(self, data: bytes, at: int) -> None:
        """Read the packets from a place on."""
        while at < len(data):
            if at + 8 > len(data):
                raise FileFormatError(f"{self.source}, byte {at}: a packet is cut off")
            code, size = struct.unpack_from("<II", data, at)
            if size > len(data) - at - 8:
                raise FileFormatError(
                    f"{self.source}, byte {at}: a packet of {size:,} bytes is cut off"
                )
            if size < _SIZES.get(code, 0) or (code == _NAME and size < 4):
                raise FileFormatError(
                    f"{self.source}, byte {at}: packet {code} must have "
                    f"{_SIZES.get(code, 4)} bytes, got {size}"
                )
            self._packet(code, data, at + 8, size)
            at += 8 + size
        self._instant(self.time)

    def _packet(self, code: int, data: bytes, at: int, size: int) -> None:
        if code in (_TIME, _END):
            (time,) = struct.unpack_from("<d", data, at)
            # esmini ends a log with the time of its last instant again, which is no new one.
            if code == _END and time == self.time:
                return
            if not abs(time) <= FARTHEST or time <= self.time:
                raise FileFormatError(
                    f"{self.source}, byte {at - 8}: time [s] must be a number, and increase, got "
                    f"{time:g} after {self.time:g}"
                )
            self._instant(time)
            self.time, self.at, self.current = time, at - 8, None
        elif code == _STEP:
            (self.step,) = struct.unpack_from("<d", data, at)
        elif code == _ENTITY:
            (self.current,) = struct.unpack_from("<i", data, at)
            if self.current not in self.alive:
                self.alive[self.current] = _Entity(len(self.entities))
                self.entities.append(self.alive[self.current])
        elif code in (_POSE, _SPEED, _BOX, _TYPE, _CATEGORY, _NAME, _DELETED):
            self._change(code, data, at, size)

    def _change(self, code: int, data: bytes, at: int, size: int) -> None:
        entity = self.alive.get(self.current) if self.current is not None else None
        if entity is None or math.isnan(self.time):
            raise FileFormatError(
                f"{self.source}, byte {at - 8}: packet {code} must follow a time and an entity"
            )
        if code == _POSE:
            entity.pose = struct.unpack_from("<6d", data, at)
        elif code == _SPEED:
            (entity.speed,) = struct.unpack_from("<d", data, at)
        elif code == _BOX:
            entity.box = struct.unpack_from("<6d", data, at)
        elif code == _TYPE:
            entity.kind = struct.unpack_from("<i", data, at)[0], entity.kind[1]
        elif code == _CATEGORY:
            entity.kind = entity.kind[0], struct.unpack_from("<i", data, at)[0]
        elif code == _NAME:
            entity.name = data[at + 4 : at + size].decode("utf-8", errors="replace")[:LONGEST_NAME]
        else:
            self.alive.pop(self.current or 0, None)

    def _instant(self, until: float) -> None:
        """Keep the states of the instant that ends, and of those until the next one.

        An instant at which nothing changes is not written.
        """
        seen = [entity for entity in self.alive.values() if entity.pose]
        if math.isnan(self.time) or not seen:
            return
        unwritten = 0
        # Instants at which nothing changes are not written, and whoever stands is recorded
        # throughout. Half a step more than one tells such a gap from a step that is rounded.
        if self.step > 0.0 and until - self.time > 1.5 * self.step:
            unwritten = int(min((until - self.time) / self.step - 0.5, MOST_STATES))
        if len(self.rows) + (1 + unwritten) * len(seen) > MOST_STATES:
            raise FileFormatError(f"{self.source}: may hold {MOST_STATES:,} states, got more")
        for k in range(1 + unwritten):
            for entity in seen:
                # The pose is x, y, z, heading, pitch, roll.
                x, y, heading = entity.pose[0], entity.pose[1], entity.pose[3]
                self.rows.append(
                    (
                        entity.number,
                        self.time + k * self.step if k else self.time,
                        x,
                        y,
                        heading,
                        entity.speed,
                        entity.box[0],
                        entity.box[1],
                    )
                )
                self.places.append(self.at)

    def traffic(self, path: Path, road: str) -> RecordedTraffic:
        """Return the table of all states."""
        if not self.rows:
            raise FileFormatError(f"{self.source}: holds no states")
        table = np.array(self.rows)
        numbers, ids = np.unique(table[:, 0].astype(np.int64), return_inverse=True)
        entities = [self.entities[number] for number in numbers.tolist()]
        _, time, x, y, heading, speed, ahead, aside = table.T
        cos, sin = np.cos(heading), np.sin(heading)
        order = np.argsort(ids, kind="stable")
        first = np.searchsorted(ids[order], np.arange(len(entities) + 1))
        return build(
            Facts(
                name=path.stem,
                format=FORMAT.name,
                source=self.source,
                time_step=median_step(time[order], first),
                frame="OpenDRIVE's",
                map=road,
            ),
            ids,
            {
                "time": time,
                "x": x + ahead * cos - aside * sin,
                "y": y + ahead * sin + aside * cos,
                "heading": heading,
                "vx": speed * cos,
                "vy": speed * sin,
            },
            lambda i: f"{self.source}, byte {self.places[i]}",
            names=_distinct([entity.name or str(entity.number) for entity in entities]),
            kind=[
                KINDS.get(entity.kind, OTHER if entity.kind[0] == 3 else UNKNOWN_KIND)
                for entity in entities
            ],
            length=[entity.box[3] for entity in entities],
            width=[entity.box[4] for entity in entities],
        )


def _distinct(names: list[str]) -> list[str]:
    """Return the names, those that come again with a number; esmini gives a name again."""
    seen: dict[str, int] = {}
    found = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        found.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return found


FORMAT = Format(
    name="esmini",
    title="esmini's binary log (.dat)",
    recognises=_recognises,
    read=_read,
)
