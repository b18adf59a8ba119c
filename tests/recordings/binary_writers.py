"""The traffic of `writers`, in binary formats, byte by byte as their specifications say."""

import math
import struct
import zlib
from pathlib import Path

import numpy as np

from .writers import CLASSES, NAMES, SIZES, STEP, N, by_time, states

VEHICLE_TYPES = {"car": 4, "truck": 7}  # of OSI
CATEGORIES = {"car": 0, "truck": 2}  # of esmini


def varint(value):
    """Return a number as Protocol Buffers write it."""
    found = bytearray()
    while True:
        value, low = value >> 7, value & 127
        found.append(low | (128 if value else 0))
        if not value:
            return bytes(found)


def field(number, value):
    """Return a field: bytes are a message or a text, whole numbers a varint, others a double.

    What is 0 is left out, as Protocol Buffers 3 do.
    """
    if isinstance(value, bytes):
        return varint(number << 3 | 2) + varint(len(value)) + value
    if value == 0:
        return b""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 1) + struct.pack("<d", value)


def message(**fields):
    """Return a message of fields that are named ``_NUMBER``."""
    return b"".join(field(int(name[1:]), value) for name, value in fields.items())


def moving_object(p, row):
    """Return a participant's state as an OSI MovingObject."""
    _, x, y, h, vx, vy, a = row
    base = message(
        _1=message(_1=SIZES[p][0], _2=SIZES[p][1], _3=1.5), _2=message(_1=x, _2=y, _3=0.75),
        _3=message(_3=h), _4=message(_1=vx, _2=vy),
        _5=message(_1=a * math.cos(h), _2=a * math.sin(h)),
    )  # fmt: skip
    return message(
        _1=message(_1=int(NAMES[p])), _2=base, _3=2, _7=b"car.osgb",
        _6=message(_1=VEHICLE_TYPES[CLASSES[p]]), _9=message(_1=message(_1=p + 2)),
    )  # fmt: skip


def ground_truths(start=0, extra=b""):
    """Yield an OSI GroundTruth per instant; ``extra`` are more fields of each."""
    rows = list(by_time())
    for step in sorted({step for step, _, _ in rows}):
        nanos = step * round(STEP * 1e9)
        head = message(
            _1=message(_1=3, _2=7),
            _2=message(_1=start + nanos // 10**9, _2=nanos % 10**9),
        )
        objects = [field(5, moving_object(p, row)) for at, p, row in rows if at == step]
        yield head + b"".join(objects) + extra


def trace(messages):
    """Return a trace file of OSI."""
    return b"".join(struct.pack("<I", len(one)) + one for one in messages)


def write_osi(folder: Path) -> Path:
    return _bytes(folder / "traffic.osi", trace(ground_truths()))


def write_osi_view(folder: Path) -> Path:
    views = [
        message(_1=message(_1=3), _2=message(_2=1), _3=message(_1=1)) + field(7, one)
        + message(_8=message(_1=1)) + field(1000, message(_1=b""))
        for one in ground_truths()
    ]  # fmt: skip
    return _bytes(folder / "view.osi", trace(views))


def record(code, content):
    """Return a record of MCAP."""
    return bytes([code]) + struct.pack("<Q", len(content)) + content


def _text(value):
    return struct.pack("<I", len(value)) + value


def channel(number, topic, schema=b"osi3.GroundTruth"):
    """Return the records of an MCAP channel."""
    head = struct.pack("<H", number)
    return record(3, head + _text(schema) + _text(b"protobuf") + _text(b"")) + record(
        4, head + head + _text(topic) + _text(b"protobuf") + _text(b"")
    )


def logged(number, time, data):
    """Return the record of an MCAP message."""
    return record(5, struct.pack("<HIQQ", number, 0, time, time) + data)


def records(messages):
    """Return the records of a topic with messages."""
    return channel(1, b"truth") + b"".join(logged(1, k, one) for k, one in enumerate(messages))


def mcap(content, pack=None, method=b"", size=None, checksum=None):
    """Return an MCAP file of records in a chunk, which ``pack`` compresses."""
    packed = pack(content) if pack else content
    size = len(content) if size is None else size
    checksum = zlib.crc32(content) if checksum is None else checksum
    chunk = struct.pack("<QQQI", 0, N, size, checksum) + _text(method)
    chunk += struct.pack("<Q", len(packed)) + packed
    magic = b"\x89MCAP0\r\n"
    return (
        magic + record(1, _text(b"") + _text(b"test")) + record(6, chunk)
        + record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + magic
    )  # fmt: skip


def write_mcap(folder: Path) -> Path:
    return _bytes(folder / "traffic.mcap", mcap(records(ground_truths())))


def write_mcap_unchecked(folder: Path) -> Path:
    """Write a file without a checksum, whose damages are found further in."""
    return _bytes(folder / "traffic.mcap", mcap(records(ground_truths()), checksum=0))


def packet(code, layout="", *values):
    """Return a packet of esmini's binary log."""
    content = struct.pack("<" + layout, *values)
    return struct.pack("<II", code, len(content)) + content


def dat_head(version=(5, 3), road=b"road.xodr"):
    """Return the head of esmini's binary log."""
    texts = b"".join(_text(one) for one in (road, b"", b"v3.6.0"))
    return struct.pack("<III", *version, len(texts)) + texts


def write_dat(folder: Path) -> Path:
    tracks = [np.column_stack(states(p)) for p in range(3)]
    begins = [round(track[0, 0] / STEP) for track in tracks]
    found, known = [dat_head()], {}
    rows = list(by_time())
    for step in sorted({step for step, _, _ in rows}):
        found += [packet(5, "d", step * STEP), packet(21, "d", STEP) if step < 2 else b""]
        for p in range(3):
            if step - begins[p] == N:
                found += [packet(0, "i", p), packet(19)]
            if not 0 <= step - begins[p] < N:
                continue
            _, x, y, h, vx, vy, _ = tracks[p][step - begins[p]]
            ahead = 1.4  # positions are those of a point behind the centre
            at = (x - ahead * math.cos(h), y - ahead * math.sin(h), 0.0, h, 0.0, 0.0)
            found += [packet(0, "i", p), packet(13, "6d", *at)]
            if known.get(p) != math.hypot(vx, vy):
                known[p] = math.hypot(vx, vy)
                found.append(packet(7, "d", known[p]))
            if step == begins[p]:
                found += [
                    packet(2, "i", 1), packet(3, "i", CATEGORIES[CLASSES[p]]),
                    packet(10, "6d", ahead, 0.0, 0.75, *SIZES[p], 1.5),
                    packet(6, f"I{len(NAMES[p])}s", len(NAMES[p]), NAMES[p].encode()),
                ]  # fmt: skip
    last = max(step for step, _, _ in rows) * STEP
    return _bytes(folder / "sim.dat", b"".join([*found, packet(22, "d", last)]))


def _bytes(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path
