"""Messages of Protocol Buffers: the few fields of them that a reader wants.

A message that is absent leaves its numbers NaN; in one that is there, a number that is not written
is 0, as the format says (writers leave out what is 0).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.readers._wire_kernels import (
    BAD_TAG,
    CUT_OFF,
    DEEPEST,
    FIXED64,
    LENGTH,
    VARINT,
    WRONG_TYPE,
    find,
    read_each,
)

_FAULTS = {
    CUT_OFF: "a field is cut off, or longer than the message that holds it",
    BAD_TAG: "no valid field begins here",
    WRONG_TYPE: "a field is of another type than its schema says",
}


@dataclass(frozen=True, eq=False)
class Message:
    """A message, or a part of one.

    Attributes:
        data: ``(n,)`` uint8, of the whole message.
        source: what it stands in, for messages of errors.
        offset: of the data in the source [bytes].
        begin: of the part in the data.
        end: of the part in the data.
    """

    data: npt.NDArray[np.uint8]
    source: str
    offset: int
    begin: int
    end: int

    @classmethod
    def of(cls, data: bytes, source: str, offset: int) -> "Message":
        """Return a whole message."""
        array = np.frombuffer(data, dtype=np.uint8)
        return cls(array, source, offset, 0, len(array))

    def place(self, at: int) -> str:
        """Return the place of a byte of the data, in words."""
        return f"{self.source}, byte {self.offset + at}"

    def part(self, begin: int, end: int) -> "Message":
        """Return a part of the same data."""
        return Message(self.data, self.source, self.offset, begin, end)

    def find(self, *fields: int) -> dict[int, Int]:
        """Return where the fields of these numbers are that are messages or texts.

        Returns:
            By number ``(k, 2)``, begin and end of each.

        Raises:
            FileFormatError: the message is malformed; with the byte.
        """
        # Compiled code cannot grow an array. It counts on beyond the room that it has, so a second
        # pass at most has room for all.
        room, wanted = 64, np.array(fields, dtype=np.int64)
        while True:
            spans = np.empty((room, 3), dtype=np.int64)
            count, at, fault = find(self.data, self.begin, self.end, wanted, spans)
            if fault:
                raise FileFormatError(f"{self.place(at)}: {_FAULTS[fault]}")
            if count <= room:
                break
            room = count
        spans = spans[:count]
        return {field: spans[spans[:, 0] == field, 1:] for field in fields}

    def parts(self, field: int) -> Iterator["Message"]:
        """Yield the messages in the fields of a number."""
        for begin, end in self.find(field)[field].tolist():
            yield self.part(begin, end)

    def text(self, field: int) -> str:
        """Return a text; "" if there is none."""
        spans = self.find(field)[field]
        if not len(spans):
            return ""
        begin, end = spans[-1].tolist()
        return self.data[begin:end].tobytes().decode("utf-8", errors="replace")


class Shape:
    """What is wanted of a message: a tree of its fields, whose leaves are columns."""

    def __init__(self, tree: Mapping[int, Any]) -> None:
        """Make a shape.

        Args:
            tree: per number of a field, the tree of the message that it is, or the name of a
                column; of a number (double) if the name ends in ``.``, else of a whole one.
        """
        nodes, levels = [tree], [1]
        rows: list[tuple[int, int, int, int]] = []
        self.numbers: list[str] = []
        self.whole: list[str] = []
        own: list[list[int]] = []
        while len(own) < len(nodes):
            node = len(own)
            columns = [len(self.numbers), 0, len(self.whole), 0]
            for field, what in nodes[node].items():
                if isinstance(what, str):
                    names, wire = (
                        (self.numbers, FIXED64) if what.endswith(".") else (self.whole, VARINT)
                    )
                    names.append(what.rstrip("."))
                    rows.append((node, field, -len(names), wire))
                else:
                    rows.append((node, field, len(nodes), LENGTH))
                    nodes.append(what)
                    levels.append(levels[node] + 1)
            columns[1], columns[3] = len(self.numbers), len(self.whole)
            own.append(columns)
        # The kernel keeps the open messages in arrays of this length.
        assert max(levels) <= DEEPEST
        size = (len(nodes), 1 + max(field for _, field, _, _ in rows))
        self.step, self.wires = np.zeros(size, dtype=np.int64), np.zeros(size, dtype=np.int64)
        for node, field, target, wire in rows:
            self.step[node, field], self.wires[node, field] = target, wire
        self.own = np.array(own, dtype=np.int64)

    def read(self, message: Message, spans: Int) -> dict[str, Any]:
        """Return the columns of messages.

        Args:
            message: that they are parts of.
            spans: ``(k, 2)`` begin and end of each.

        Returns:
            By name ``(k,)``: float64, or int64 of whole numbers.

        Raises:
            FileFormatError: one is malformed; with the byte.
        """
        numbers: Float = np.empty((len(spans), len(self.numbers)))
        whole: Int = np.empty((len(spans), len(self.whole)), dtype=np.int64)
        at, fault = read_each(
            message.data,
            np.ascontiguousarray(spans),
            self.step,
            self.wires,
            self.own,
            numbers,
            whole,
        )
        if fault:
            raise FileFormatError(f"{message.place(at)}: {_FAULTS[fault]}")
        return {
            **{name: numbers[:, k] for k, name in enumerate(self.numbers)},
            **{name: whole[:, k] for k, name in enumerate(self.whole)},
        }
