"""What a format of recordings is: how to recognise a file of it, and how to read it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.xml import read_bytes
from bridgegen.recordings.readers.columns import header
from bridgegen.recordings.readers.table import RecordedTraffic

HEAD_BYTES = 2**16


@dataclass(frozen=True)
class Head:
    """The beginning of a file, by which its format is recognised.

    Attributes:
        path: of the file.
        data: its first bytes, `HEAD_BYTES` at most.
    """

    path: Path
    data: bytes

    @cached_property
    def columns(self) -> frozenset[str]:
        """The names in the first line, if it is one of a comma-separated table."""
        return frozenset(header(self.data.split(b"\n", 1)[0]))

    def has(self, *columns: str) -> bool:
        """Return whether the first line names all these columns."""
        return self.columns.issuperset(columns)

    def has_element(self, name: str) -> bool:
        """Return whether an XML document begins with this element."""
        text = self.data.lstrip(b"\xef\xbb\xbf \t\r\n")
        return text.startswith(b"<") and f"<{name}".encode() in text


@dataclass(frozen=True)
class Format:
    """A format of recordings.

    Attributes:
        name: short, for tables.
        title: what it is, for messages and documentation.
        recognises: whether a file is of it, by its content.
        read: the recordings in a file, one after the other.
        companion: whether a file only belongs to recordings of it, and is not itself a recording.
    """

    name: str
    title: str
    recognises: Callable[[Head], bool]
    read: Callable[[Path], Iterator[RecordedTraffic]]
    companion: Callable[[Head], bool] = lambda head: False


def read_head(path: Path) -> Head:
    """Return a file's beginning.

    Raises:
        FileFormatError: it is missing, no regular file, cannot be read, or is empty.
    """
    if not path.is_file():
        read_bytes(path)  # says why not
    try:
        with path.open("rb") as file:
            data = file.read(HEAD_BYTES)
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    if not data.strip():
        raise FileFormatError(f"{path}: is empty")
    return Head(path, data)
