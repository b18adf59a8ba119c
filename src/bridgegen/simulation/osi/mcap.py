"""MCAP files of one topic: uncompressed chunks with an index.

Source: MCAP format specification (mcap.dev/spec), version 0.
"""

import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping

MAGIC = b"\x89MCAP0\r\n"
_LEAST_CHUNK = 2**20
"""Size from which on a chunk is complete [bytes]."""
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX = range(1, 9)
_STATISTICS, _METADATA, _METADATA_INDEX, _SUMMARY_OFFSET, _DATA_END = range(11, 16)
_ID = 1
"""Number of the only schema, and of the only channel."""


def mcap(
    topic: str,
    type_: str,
    schema: bytes,
    messages: Iterable[tuple[int, bytes]],
    metadata: tuple[str, Mapping[str, str]],
    of_channel: Mapping[str, str],
) -> Iterator[bytes]:
    """Yield the bytes of a file.

    Args:
        topic: of all messages.
        type_: the messages' type, by its full name.
        schema: of that type, a FileDescriptorSet.
        messages: time [ns] and content of each.
        metadata: name and entries of the file's metadata.
        of_channel: the channel's metadata.
    """
    start = MAGIC + _record(_HEADER, _text("") + _text("bridgegen"))
    about = _record(_METADATA, _text(metadata[0]) + _map(metadata[1]))
    where = struct.pack("<QQ", len(start), len(about))
    metadata_index = _record(_METADATA_INDEX, where + _text(metadata[0]))
    yield start + about
    at = len(start) + len(about)
    type_of = struct.pack("<H", _ID) + _text(type_) + _text("protobuf") + _data(schema)
    channel = struct.pack("<HH", _ID, _ID) + _text(topic) + _text("protobuf") + _map(of_channel)
    head = _record(_SCHEMA, type_of) + _record(_CHANNEL, channel)
    indices, times = list[bytes](), list[int]()
    for begins, chunk in _chunks(head, messages):
        times += [time for time, _ in begins]
        extent, size = struct.pack("<QQ", min(begins)[0], max(begins)[0]), len(chunk)
        # Large ones are not copied, as `_record` would.
        fields = extent + struct.pack("<QI", size, zlib.crc32(chunk)) + _text("")
        record = struct.pack("<BQ", _CHUNK, len(fields) + 8 + size) + fields
        record += struct.pack("<Q", size)
        entries = b"".join(struct.pack("<QQ", *begin) for begin in begins)
        index = _record(_MESSAGE_INDEX, struct.pack("<H", _ID) + _data(entries))
        yield record
        yield chunk
        yield index
        end = at + len(record) + size
        content = extent + struct.pack("<QQ", at, end - at) + _data(struct.pack("<HQ", _ID, end))
        content += struct.pack("<Q", len(index)) + _text("") + struct.pack("<QQ", size, size)
        indices.append(_record(_CHUNK_INDEX, content))
        at = end + len(index)
    data_end = _record(_DATA_END, struct.pack("<I", 0))
    counts = struct.pack("<QHIIII", len(times), 1, 1, 0, 1, len(indices))
    extent = struct.pack("<QQ", min(times, default=0), max(times, default=0))
    statistics = counts + extent + _data(struct.pack("<HQ", _ID, len(times)))
    summary = head + b"".join(indices) + metadata_index + _record(_STATISTICS, statistics)
    footer = struct.pack("<QQ", at + len(data_end), 0)
    begun = bytes([_FOOTER]) + struct.pack("<Q", len(footer) + 4) + footer
    yield data_end + summary + begun + struct.pack("<I", zlib.crc32(summary + begun)) + MAGIC


def _chunks(
    head: bytes, messages: Iterable[tuple[int, bytes]]
) -> Iterator[tuple[list[tuple[int, int]], bytes]]:
    """Yield the chunks: time and place of each message, and all records, the head first."""
    records, size, begins = [head], len(head), list[tuple[int, int]]()
    for sequence, (time, data) in enumerate(messages):
        begins.append((time, size))
        record = struct.pack("<BQHIQQ", _MESSAGE, 22 + len(data), _ID, sequence, time, time)
        records += [record, data]
        size += len(record) + len(data)
        if size >= _LEAST_CHUNK:
            yield begins, b"".join(records)
            records, size, begins = [], 0, []
    if begins:
        yield begins, b"".join(records)


def _record(code: int, content: bytes) -> bytes:
    return bytes([code]) + struct.pack("<Q", len(content)) + content


def _data(content: bytes) -> bytes:
    return struct.pack("<I", len(content)) + content


def _text(text: str) -> bytes:
    return _data(text.encode())


def _map(entries: Mapping[str, str]) -> bytes:
    return _data(b"".join(_text(key) + _text(value) for key, value in entries.items()))
