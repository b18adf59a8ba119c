"""The traffic of `writers`, in binary formats, byte by byte as their specifications say."""

import itertools
import math
import struct
import zlib
from pathlib import Path

from .writers import STEP, TRACKS, by_time

VEHICLE_TYPES = {"car": 4, "truck": 7, "motorcycle": 10, "bicycle": 11}  # of OSI
CATEGORIES = {"car": 0, "truck": 2, "motorcycle": 6, "bicycle": 7}  # of esmini


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


def moving_object(one, row):
    """Return a participant's state as an OSI MovingObject."""
    _, x, y, h, vx, vy, a = row
    base = message(
        _1=message(_1=one.length, _2=one.width, _3=1.5), _2=message(_1=x, _2=y, _3=0.75),
        _3=message(_3=h), _4=message(_1=vx, _2=vy),
        _5=message(_1=a * math.cos(h), _2=a * math.sin(h)),
    )  # fmt: skip
    is_vehicle = one.kind in VEHICLE_TYPES
    return message(
        _1=message(_1=int(one.name)), _2=base, _3=2 if is_vehicle else 3, _7=b"model.osgb",
        _6=message(_1=VEHICLE_TYPES[one.kind] if is_vehicle else 0),
        _9=message(_1=message(_1=one.lane)),
    )  # fmt: skip


def ground_truths(tracks=TRACKS, step=STEP, start=0):
    """Yield an OSI GroundTruth per instant."""
    for frame, rows in itertools.groupby(by_time(tracks, step), lambda one: one[0]):
        nanos = frame * round(step * 1e9)
        head = message(
            _1=message(_1=3, _2=7),
            _2=message(_1=start + nanos // 10**9, _2=nanos % 10**9),
        )
        yield head + b"".join(field(5, moving_object(one, row)) for _, one, row in rows)


def trace(messages):
    """Return a trace file of OSI."""
    return b"".join(struct.pack("<I", len(one)) + one for one in messages)


def write_osi(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    return _bytes(folder / "traffic.osi", trace(ground_truths(tracks, step)))


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
    chunk = struct.pack("<QQQI", 0, 0, size, checksum) + _text(method)
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


def write_dat(folder: Path, tracks=TRACKS, step=STEP) -> Path:
    number = {one.name: k for k, one in enumerate(tracks)}
    ends = {one.name: round(one.states[-1, 0] / step) for one in tracks}
    found, speeds = [dat_head()], {}
    frames = {end + 1: [] for end in ends.values()}
    for frame, *row in by_time(tracks, step):
        frames.setdefault(frame, []).append(row)
    left = {}
    for name, end in ends.items():
        left.setdefault(end + 1, []).append(name)
    first = min(frames)
    for frame, rows in sorted(frames.items()):
        found += [
            packet(5, "d", frame * step),
            packet(21, "d", step) if frame == first else b"",
        ]
        for name in left.get(frame, ()):
            found += [packet(0, "i", number[name]), packet(19)]
        for one, (_, x, y, h, vx, vy, _) in rows:
            ahead, speed = 1.4, math.hypot(vx, vy)  # positions are those of a point behind
            at = (x - ahead * math.cos(h), y - ahead * math.sin(h), 0.0, h, 0.0, 0.0)
            found += [packet(0, "i", number[one.name]), packet(13, "6d", *at)]
            if one.name not in speeds:
                is_vehicle = one.kind in CATEGORIES
                found += [
                    packet(2, "i", 1 if is_vehicle else 2),
                    packet(3, "i", CATEGORIES.get(one.kind, 0)),
                    packet(10, "6d", ahead, 0.0, 0.75, one.length, one.width, 1.5),
                    packet(6, f"I{len(one.name)}s", len(one.name), one.name.encode()),
                ]  # fmt: skip
            if speeds.get(one.name) != speed:
                speeds[one.name] = speed
                found.append(packet(7, "d", speed))
    return _bytes(folder / "sim.dat", b"".join([*found, packet(22, "d", frame * step)]))


def _bytes(path: Path, data: bytes) -> Path:
    path.write_bytes(data)
    return path
