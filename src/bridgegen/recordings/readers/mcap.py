"""MCAP, a container of messages: those of an uncompressed or compressed file, in file order.

Compressed chunks need the extra ``osi``.

Source: MCAP format specification (mcap.dev/spec), version 0.
"""

import io
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from bridgegen.base.errors import FileFormatError
from bridgegen.base.extras import require

MAGIC = b"\x89MCAP0\r\n"
MOST_RECORD = 256 * 2**20
"""Largest size of a record, and of a chunk when it is decompressed [bytes]."""
MOST_CHANNELS = 2**16
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 2, 3, 4, 5, 6


class Stored(NamedTuple):
    """A message of a file.

    Attributes:
        topic: of its channel.
        schema: name of its type.
        encoding: of its data.
        time: when it was logged [ns].
        data: its bytes.
        source: the file, or the chunk of it, in words.
        offset: of the data in that [bytes].
    """

    topic: str
    schema: str
    encoding: str
    time: int
    data: bytes
    source: str
    offset: int


def read_messages(path: Path) -> Iterator[Stored]:
    """Yield the messages of an MCAP file.

    Raises:
        FileFormatError: cut off, damaged, or larger than the bounds; with the byte.
        InputError: chunks are compressed, and the extra is not installed.
    """
    reading = _Reading(path)
    try:
        with path.open("rb") as file:
            # Front to back, without the index at the end: a file that is cut off is refused with
            # its byte, and damage is found in each record, where the package `mcap` reads on.
            file.seek(len(MAGIC))
            for code, content, offset in _records(file, str(path)):
                if code == _FOOTER:
                    return
                yield from reading.messages(code, content, str(path), offset)
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    raise FileFormatError(f"{path}: is cut off: it has no footer")


def _records(file: BinaryIO, source: str) -> Iterator[tuple[int, bytes, int]]:
    """Yield code, content and place of each record."""
    while head := file.read(9):
        offset = file.tell()
        size = struct.unpack_from("<Q", head, 1)[0] if len(head) == 9 else 0
        if size > MOST_RECORD:
            raise FileFormatError(
                f"{source}, byte {offset - 9}: a record may have {MOST_RECORD:,} bytes, got "
                f"{size:,}"
            )
        content = file.read(size)
        if len(head) < 9 or len(content) < size:
            raise FileFormatError(f"{source}, byte {offset - len(head)}: a record is cut off")
        yield head[0], content, offset


class _Reading:
    """What has been read of schemas and channels."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.schemas: dict[int, str] = {}
        self.channels: dict[int, tuple[str, str, str]] = {}

    def messages(
        self, code: int, content: bytes, source: str, offset: int, in_chunk: bool = False
    ) -> Iterator[Stored]:
        """Yield the messages of a record."""
        fields = _Fields(content, f"{source}, byte {offset}")
        if code == _MESSAGE:
            number, _, time, _ = fields.take("<HIQQ")
            if number not in self.channels:
                raise FileFormatError(f"{fields.place}: a message of channel {number}, unknown")
            topic, schema, encoding = self.channels[number]
            yield Stored(
                topic, schema, encoding, time, content[fields.at :], source, offset + fields.at
            )
        elif code == _SCHEMA:
            (number,) = fields.take("<H")
            self.schemas[number] = fields.text()
        elif code == _CHANNEL:
            number, of_schema = fields.take("<HH")
            name = self.schemas.get(of_schema, "")
            self.channels[number] = fields.text(), name, fields.text()
        elif code == _CHUNK and not in_chunk:
            records, place = self._decompressed(fields), f"{source}, chunk at byte {offset}"
            # A chunk within a chunk is passed over (`in_chunk`), so that decompression nests one
            # level deep.
            for inner, data, at in _records(io.BytesIO(records), place):
                yield from self.messages(inner, data, place, at, in_chunk=True)
        if len(self.channels) + len(self.schemas) > MOST_CHANNELS:
            raise FileFormatError(f"{self.path}: may have {MOST_CHANNELS:,} channels, got more")

    def _decompressed(self, fields: "_Fields") -> bytes:
        _, _, size, checksum = fields.take("<QQQI")
        method = fields.text()
        (stored,) = fields.take("<Q")
        data = fields.content[fields.at : fields.at + stored]
        # The stated size is checked before anything is decompressed; afterwards, no more than one
        # byte beyond it is (`_decompress`), so that a small chunk cannot become gigabytes.
        if size > MOST_RECORD or len(data) < stored:
            raise FileFormatError(
                f"{fields.place}: a chunk must hold what it says, {MOST_RECORD:,} bytes at most "
                f"when decompressed, got {size:,}"
            )
        if method not in ("", "zstd", "lz4"):
            raise FileFormatError(
                f"{fields.place}: chunks must be compressed by zstd or lz4, got '{method[:40]}'"
            )
        if method:
            require("osi", f"{fields.place}: reading chunks compressed by {method}")
        records = _decompress(method, data, size, fields.place)
        if len(records) != size or (checksum and zlib.crc32(records) != checksum):
            raise FileFormatError(f"{fields.place}: this chunk is damaged: its checksum differs")
        return records


def _decompress(method: str, data: bytes, size: int, place: str) -> bytes:
    """Return a chunk's records, ``size + 1`` bytes of them at most."""
    if method == "zstd":
        import zstandard

        try:
            # A frame may ask for a window of its own size, which zstd allocates before it writes a
            # byte.
            reader = zstandard.ZstdDecompressor(max_window_size=MOST_RECORD).stream_reader(data)
            return bytes(reader.read(size + 1))
        except zstandard.ZstdError as error:
            raise FileFormatError(f"{place}: no valid zstd: {str(error)[:80]}") from None
    if method == "lz4":
        import lz4.frame

        try:
            frame = lz4.frame.LZ4FrameDecompressor()
            return bytes(frame.decompress(data, max_length=size + 1)) if data else b""
        except RuntimeError as error:
            raise FileFormatError(f"{place}: no valid lz4: {str(error)[:80]}") from None
    return data


class _Fields:
    """The fields of a record, one after the other."""

    def __init__(self, content: bytes, place: str) -> None:
        self.content, self.place, self.at = content, place, 0

    def take(self, layout: str) -> tuple[int, ...]:
        try:
            values = struct.unpack_from(layout, self.content, self.at)
        except struct.error:
            raise FileFormatError(f"{self.place}: a record is too short") from None
        self.at += struct.calcsize(layout)
        return values

    def text(self) -> str:
        (size,) = self.take("<I")
        data = self.content[self.at : self.at + size]
        if len(data) < size:
            raise FileFormatError(f"{self.place}: a record is too short")
        self.at += size
        return data.decode("utf-8", errors="replace")
