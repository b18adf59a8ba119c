"""Messages of Protocol Buffers without generated code: their declaration, their bytes.

A message to write is a list of parts. Bytes are the same at all instants; an array ``(T, …)`` has a
value for each. All instants of a message have the same length, so that `rows` writes them at once.

Source: Protocol Buffers, "Encoding" and descriptor.proto.
"""

import struct
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Parts = list[bytes | npt.NDArray[Any]]

MOST_ITEMS = 10_000
"""Largest number of elements of a list in a message that is read: of two bytes of an empty one, a
reader makes 64."""

_VARINT, _DOUBLE, _LENGTH, _FLOAT = 0, 1, 2, 5
"""Types on the wire."""
_SCALARS = {
    "double": 1, "float": 2, "int64": 3, "uint64": 4, "fixed64": 6, "bool": 8, "string": 9,
    "uint32": 13,
}  # fmt: skip
"""Codes of types in descriptor.proto."""
_FORMATS = {"double": (_DOUBLE, "<d"), "fixed64": (_DOUBLE, "<Q"), "float": (_FLOAT, "<f")}
_FIXED = {kind: (wire, struct.Struct(format_)) for kind, (wire, format_) in _FORMATS.items()}
"""Types of a fixed length: their type on the wire, their format."""
_MESSAGE, _ENUM, _OPTIONAL, _REPEATED = 11, 14, 1, 3


class WireError(ValueError):
    """Bytes that are no message, or not of the declared type."""


class _Field(NamedTuple):
    type: str
    number: int
    repeated: bool


class Schema:
    """Messages that are declared.

    Args:
        package: their package's name.
        messages: each message's fields: name, type and number. A type has ``*`` where the field may
            come several times; one that begins with a dot is the message's own.
        enums: each enumeration with its prefix, and its values, which count from 0.

    Attributes:
        values: the values of each enumeration, in order.
    """

    def __init__(self, package: str, messages: str, enums: str = "") -> None:
        self._package = package
        self._fields = {name: _fields(name, rest) for name, rest in _entries(messages)}
        self._numbers = {
            kind: {field.number: (name, field) for name, field in fields.items()}
            for kind, fields in self._fields.items()
        }
        self.values = {head.split()[0]: rest.split() for head, rest in _entries(enums)}
        self._prefixes = dict(head.split() for head, _ in _entries(enums))

    def message(self, kind: str, **values: Any) -> Parts:
        """Return a message.

        Args:
            kind: its name.
            values: by the names of its fields: a number, a text, a name of an enumeration, a
                message; a sequence of these where the field may come several times. ``(T,)``
                float64 for a double, ``(T,)`` uint8 below 128 for an enumeration. None is left out.
        """
        found: Parts = []
        for name, value in values.items():
            field = self._fields[kind][name]
            if value is not None:
                for one in value if field.repeated else (value,):
                    found += self._written(field, one)
        return found

    def _written(self, field: _Field, value: Any) -> Parts:
        number, kind = field.number, field.type
        if kind in self._fields:
            return nested(number, value)
        if kind in _FIXED:
            wire, format_ = _FIXED[kind]
            return [
                _key(number, wire),
                value if isinstance(value, np.ndarray) else format_.pack(value),
            ]
        if kind == "string":
            return nested(number, [value.encode()])
        if kind in self.values and isinstance(value, str):
            value = self.values[kind].index(value)
        return [_key(number, _VARINT), value if isinstance(value, np.ndarray) else varint(value)]

    def read(self, kind: str, data: bytes) -> dict[str, Any]:
        """Return the declared fields of a message of a kind; what is not declared is skipped.

        Returns:
            By name: a number, a text, a message in the same form; a list of these where the field
            may come several times. What does not come is 0, empty, or a message without fields.

        Raises:
            WireError: malformed, another type than declared, or more than `MOST_ITEMS` elements.
        """
        found: dict[str, Any] = {}
        for number, wire, value in _split(data):
            if number not in self._numbers[kind]:
                continue
            name, field = self._numbers[kind][number]
            format_ = _FIXED.get(field.type)
            is_bytes = field.type == "string" or field.type in self._fields
            if wire != (format_[0] if format_ else _LENGTH if is_bytes else _VARINT):
                raise WireError(f"the field '{name}' of {kind} is of another type than declared")
            if format_:
                (value,) = format_[1].unpack(value)
            elif field.type == "string":
                value = value.decode("utf-8", errors="replace")
            elif field.type in self._fields:
                value = self.read(field.type, value)
            if not field.repeated:
                found[name] = value
                continue
            found.setdefault(name, []).append(value)
            if len(found[name]) > MOST_ITEMS:
                raise WireError(f"the field '{name}' of {kind} comes more than {MOST_ITEMS} times")
        for name, field in self._fields[kind].items():
            if name not in found:
                is_message = field.type in self._fields
                plain = self.read(field.type, b"") if is_message and not field.repeated else 0
                found[name] = [] if field.repeated else "" if field.type == "string" else plain
        return found

    def descriptors(self) -> bytes:
        """Return what is declared as a FileDescriptorSet, as MCAP files carry it."""
        file = f"{self._package}.proto".encode()
        parts = [*nested(1, [file]), *nested(2, [self._package.encode()])]
        for name in self._fields:
            if "." not in name:
                parts += nested(4, self._descriptor(name))
        return flat(nested(1, parts))

    def _descriptor(self, name: str) -> Parts:
        """Return the DescriptorProto of a message."""
        found = nested(1, [_last(name)])
        for field, (kind, number, repeated) in self._fields[name].items():
            of = _SCALARS.get(kind) or (_MESSAGE if kind in self._fields else _ENUM)
            about = nested(1, [field.encode()])
            about.append(_numbers((3, number), (4, _REPEATED if repeated else _OPTIONAL), (5, of)))
            if kind not in _SCALARS:
                about += nested(6, [f".{self._package}.{kind}".encode()])
            found += nested(2, about)
        for inner in self._fields:
            if inner.rpartition(".")[0] == name:
                found += nested(3, self._descriptor(inner))
        for inner, words in self.values.items():
            if inner.rpartition(".")[0] == name:
                values = nested(1, [_last(inner)])
                for number, word in enumerate(words):
                    label = nested(1, [f"{self._prefixes[inner]}_{word}".encode()])
                    values += nested(2, [*label, _numbers((2, number))])
                found += nested(4, values)
        return found


def nested(number: int, parts: Parts) -> Parts:
    """Return a message, or a text, as a field of another message."""
    size = sum(part.itemsize if isinstance(part, np.ndarray) else len(part) for part in parts)
    return [_key(number, _LENGTH) + varint(size), *parts]


def varint(value: int) -> bytes:
    """Return a whole number ≥ 0 as Protocol Buffers write it."""
    found = bytearray()
    while value > 127:
        found.append(value & 127 | 128)
        value >>= 7
    return bytes((*found, value))


def flat(parts: Parts) -> bytes:
    """Return a message that is the same at all instants."""
    return b"".join(part if isinstance(part, bytes) else part.tobytes() for part in parts)


def rows(parts: Parts, n: int) -> list[bytes]:
    """Return a message at each of n instants."""
    columns = [
        part.astype(part.dtype.newbyteorder("<")).view(np.uint8).reshape(n, -1)
        if isinstance(part, np.ndarray)
        else np.broadcast_to(np.frombuffer(part, np.uint8), (n, len(part)))
        for part in parts
    ]
    whole = np.concatenate(columns, axis=1)
    data, size = whole.tobytes(), whole.shape[1]
    return [data[k : k + size] for k in range(0, n * size, size)]


def _entries(text: str) -> list[tuple[str, str]]:
    """Return the head and the rest of each entry, which goes on where lines are indented."""
    lines = text.strip().replace("\n    ", " ").splitlines()
    return [(head, rest.strip()) for head, _, rest in (line.partition(":") for line in lines)]


def _fields(name: str, text: str) -> dict[str, _Field]:
    each = [field.split() for field in text.split(",") if field]
    return {
        field: _Field((name if kind[0] == "." else "") + kind.strip("*"), int(number), "*" in kind)
        for field, kind, number in each
    }


def _key(number: int, wire_type: int) -> bytes:
    return varint(number << 3 | wire_type)


def _last(name: str) -> bytes:
    return name.rpartition(".")[2].encode()


def _numbers(*fields: tuple[int, int]) -> bytes:
    return b"".join(_key(number, _VARINT) + varint(value) for number, value in fields)


def _split(data: bytes) -> Iterator[tuple[int, int, Any]]:
    """Yield number, type on the wire and content of each field: a whole number, or its bytes.

    Raises:
        WireError: malformed; with the byte.
    """
    at = 0
    while at < len(data):
        key, begin = _varint_at(data, at)
        number, wire = key >> 3, key & 7
        if not 0 < number < 2**29 or wire not in (_VARINT, _DOUBLE, _LENGTH, _FLOAT):
            raise WireError(f"no valid field begins at byte {at} of a message")
        if wire == _VARINT:
            value, at = _varint_at(data, begin)
            yield number, wire, value
            continue
        size = 8 if wire == _DOUBLE else 4
        if wire == _LENGTH:
            size, begin = _varint_at(data, begin)
        if size > len(data) - begin:
            raise WireError(f"the field at byte {at} of a message is cut off")
        at = begin + size
        yield number, wire, data[begin:at]


def _varint_at(data: bytes, at: int) -> tuple[int, int]:
    """Return the whole number at a place, as 64 bits without a sign, and the place behind it."""
    value = 0
    for k, byte in enumerate(data[at : at + 10]):
        value |= (byte & 127) << 7 * k
        if byte < 128:
            return value & (2**64 - 1), at + k + 1
    raise WireError(f"the number at byte {at} of a message is cut off")
