"""Messages of the protocol: the part of msgpack that it uses, with arrays.

This file needs NumPy only, and Python 3.9: see `bridgegen.drivers.remote.server`.

Source: the msgpack specification, github.com/msgpack/msgpack.
"""

from __future__ import annotations

import struct
from dataclasses import fields, is_dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

PROTOCOL = 1
"""The version of the protocol."""

MAX_FRAME = 64 * 2**20
"""Most bytes of a message."""

DTYPES = ("float64", "float32", "int64", "int32", "int8", "bool")
"""What the elements of an array may be."""

_KINDS = {
    name: (np.dtype("uint8" if name == "bool" else name).newbyteorder("<"), np.dtype(name))
    for name in DTYPES
}
"""Of the elements of an array: as they are in messages, and here."""

MAX_ITEMS, MAX_DEPTH, MAX_DIMENSIONS = 5_000_000, 16, 8
"""Most elements of the lists and maps of a message, how deep they are, dimensions of an array."""

RAISED, NONSENSE = "raised", "answered nonsense"
"""Kinds of errors: the driver's own, or an answer that is none."""

Message = dict[str, Any]


class ProtocolError(ValueError):
    """Bytes that are no message, or a message that breaks the protocol."""


def pack(message: Message) -> bytes:
    """Return a message as a frame: its length, four bytes little-endian, and itself in msgpack.

    Args:
        message: of texts, numbers, lists, maps, arrays and dataclasses.

    Raises:
        ProtocolError: it is longer than `MAX_FRAME`, or holds anything else.
    """
    parts = [b""]
    _put(parts, message)
    size = sum(map(len, parts))
    if size > MAX_FRAME:
        raise ProtocolError(_too_long(size))
    parts[0] = struct.pack("<I", size)
    return b"".join(parts)


def _put(parts: list[bytes], value: Any) -> None:
    """Append a value in msgpack."""
    kind = type(value)
    if kind is np.ndarray:
        head, little = _head_of(value.dtype, value.shape)
        parts.append(head)
        parts.append((value if little is None else value.astype(little)).tobytes())
    elif value is None:
        parts.append(b"\xc0")
    elif kind is float:
        parts.append(struct.pack(">Bd", 0xCB, value))
    elif kind is bool:
        parts.append(b"\xc3" if value else b"\xc2")
    elif kind is int:
        parts.append(_whole(value))
    elif kind is str:
        parts.append(_text(value))
    elif kind is dict:
        parts.append(_sized(len(value), 0x80, 15, (None, 0xDE, 0xDF)))
        for name, one in value.items():
            parts.append(_text(name))
            _put(parts, one)
    elif kind is list or kind is tuple:
        parts.append(_sized(len(value), 0x90, 15, (None, 0xDC, 0xDD)))
        for one in value:
            _put(parts, one)
    elif is_dataclass(value):
        head, names = _fields_of(kind)  # type: ignore[arg-type]
        parts.append(head)
        for name, text in names:
            parts.append(text)
            _put(parts, getattr(value, name))
    elif isinstance(value, np.generic):
        _put(parts, value.item())
    else:
        raise ProtocolError(f"a message cannot hold a {kind.__name__}")


@lru_cache(maxsize=1024)
def _head_of(dtype: np.dtype[Any], shape: tuple[int, ...]) -> tuple[bytes, Any]:
    """Return what precedes the bytes of an array, and the type to convert it to, if need be."""
    name = dtype.name
    if name not in DTYPES:
        raise ProtocolError(f"an array must be one of {', '.join(DTYPES)}, got {name}")
    little = dtype.newbyteorder("<")
    parts = [b"\x83", _text("dtype"), _text(name), _text("shape")]
    _put(parts, list(shape))
    size = dtype.itemsize
    for n in shape:
        size *= n
    parts += [_text("data"), _sized(size, 0, -1, (0xC4, 0xC5, 0xC6))]
    return b"".join(parts), None if little == dtype else little


@lru_cache(maxsize=64)
def _fields_of(kind: Any) -> tuple[bytes, list[tuple[str, bytes]]]:
    names = [(one.name, _text(one.name)) for one in fields(kind)]
    return _sized(len(names), 0x80, 15, (None, 0xDE, 0xDF)), names


@lru_cache(maxsize=1024)
def _text(value: str) -> bytes:
    data = value.encode("utf-8", "replace")
    return _sized(len(data), 0xA0, 31, (0xD9, 0xDA, 0xDB)) + data


def _sized(n: int, small: int, most: int, codes: tuple[int | None, int, int]) -> bytes:
    """Return the head of what has n parts; its codes are for sizes of 8, 16 and 32 bits."""
    if n <= most:
        return bytes([small | n])
    if codes[0] is not None and n < 2**8:
        return struct.pack(">BB", codes[0], n)
    if n < 2**16:
        return struct.pack(">BH", codes[1], n)
    if n > MAX_FRAME:
        raise ProtocolError(_too_long(n))
    return struct.pack(">BI", codes[2], n)


def _whole(value: int) -> bytes:
    if 0 <= value < 128:
        return bytes([value])
    if not -(2**63) <= value < 2**63:
        raise ProtocolError(f"a whole number must have at most 64 bits, got {value}")
    return struct.pack(">Bq", 0xD3, value)


def length(head: bytes | bytearray) -> int:
    """Return how long the message is that follows four bytes.

    Raises:
        ProtocolError: longer than `MAX_FRAME`.
    """
    (found,) = struct.unpack("<I", head)
    if found > MAX_FRAME:
        raise ProtocolError(_too_long(found))
    return int(found)


def _too_long(found: int) -> str:
    most = MAX_FRAME // 2**20
    return f"a message must be at most {most} MiB long, got {found / 2**20:.1f} MiB"


def unpack(data: bytes, max_items: int = MAX_ITEMS) -> Message:
    """Return a message, with its arrays as NumPy's.

    Args:
        data: in msgpack, without the length.
        max_items: most elements of all its lists and maps.

    Raises:
        ProtocolError: it is no msgpack, no map, or too large.
    """
    reader = _Reader(data, max_items)
    try:
        found = reader.value(0)
    except (IndexError, struct.error):
        raise ProtocolError("the message is no msgpack: it ends too early") from None
    except UnicodeDecodeError:
        raise ProtocolError("the message is no msgpack: a text is not UTF-8") from None
    if reader.at != len(data):
        raise ProtocolError("the message is no msgpack: more follows its end")
    if not isinstance(found, dict) or not isinstance(found.get("type"), str):
        raise ProtocolError("a message must be a map with a text 'type'")
    return found


_NUMBERS = {
    0xCA: ">f", 0xCB: ">d", 0xCC: ">B", 0xCD: ">H", 0xCE: ">I", 0xCF: ">Q",
    0xD0: ">b", 0xD1: ">h", 0xD2: ">i", 0xD3: ">q",
}  # fmt: skip
_NUMBERS_OF = {tag: struct.Struct(code) for tag, code in _NUMBERS.items()}
_CONSTANTS = {0xC0: None, 0xC2: False, 0xC3: True}
_SIZES = {0: struct.Struct(">B"), 1: struct.Struct(">H"), 2: struct.Struct(">I")}
_BYTES, _TEXT, _LIST, _MAP = range(4)
_SIZED = {
    0xC4: (_BYTES, 0), 0xC5: (_BYTES, 1), 0xC6: (_BYTES, 2),
    0xD9: (_TEXT, 0), 0xDA: (_TEXT, 1), 0xDB: (_TEXT, 2),
    0xDC: (_LIST, 1), 0xDD: (_LIST, 2), 0xDE: (_MAP, 1), 0xDF: (_MAP, 2),
}  # fmt: skip


class _Reader:
    """Reads the part of msgpack that messages use: no extensions, keys are texts."""

    def __init__(self, data: bytes, max_items: int) -> None:
        self.at, self._data, self._left = 0, data, max_items

    def value(self, depth: int) -> Any:
        tag = self._data[self.at]
        self.at += 1
        if tag < 0x80:
            return tag
        if tag >= 0xE0:
            return tag - 0x100
        if tag < 0x90:
            return self._sized(_MAP, tag & 0x0F, depth)
        if tag < 0xA0:
            return self._sized(_LIST, tag & 0x0F, depth)
        if tag < 0xC0:
            return self._sized(_TEXT, tag & 0x1F, depth)
        if tag in _SIZED:
            kind, width = _SIZED[tag]
            (n,) = _SIZES[width].unpack_from(self._data, self.at)
            self.at += 1 << width
            return self._sized(kind, n, depth)
        if tag in _NUMBERS_OF:
            number = _NUMBERS_OF[tag]
            (found,) = number.unpack_from(self._data, self.at)
            self.at += number.size
            return found
        if tag in _CONSTANTS:
            return _CONSTANTS[tag]
        raise ProtocolError(f"the message is no msgpack, or has an extension: byte 0x{tag:02x}")

    def _sized(self, kind: int, n: int, depth: int) -> Any:
        if kind <= _TEXT:
            start = self.at
            self.at = end = start + n
            if end > len(self._data):
                raise IndexError
            part = self._data[start:end]
            return part if kind == _BYTES else part.decode("utf-8")
        self._left -= n
        if self._left < 0 or depth >= MAX_DEPTH:
            raise ProtocolError("the message has too many parts, or is nested too deeply")
        if kind == _LIST:
            return [self.value(depth + 1) for _ in range(n)]
        return self._map(n, depth)

    def _key(self, depth: int) -> str:
        begin = self.at + 1
        tag = self._data[begin - 1]
        if 0xA0 <= tag < 0xC0:  # most keys: without a call more
            self.at = end = begin + (tag & 0x1F)
            if end > len(self._data):
                raise IndexError
            return self._data[begin:end].decode()
        if not 0xD9 <= tag <= 0xDB:
            raise ProtocolError("the keys of a map must be texts")
        return str(self.value(depth + 1))

    def _map(self, n: int, depth: int) -> Any:
        data, found, start = self._data, {}, self.at
        for _ in range(n):
            name = self._key(depth)
            head = _heads.get(self.at)
            if head is None or not data.startswith(head.data, self.at):
                found[name] = self.value(depth + 1)
                continue
            self._left -= _ITEMS_OF_ARRAY
            begin = self.at + len(head.data)
            self.at = begin + head.size
            found[name] = head.array(data, begin)
        if "dtype" not in found:
            return found
        head = _head(found)
        if n == 3 and data[start - 1] == 0x83 and next(reversed(found)) == "data":
            if len(_heads) >= _MOST_HEADS:
                _heads.clear()
            _heads[start - 1] = head._replace(data=data[start - 1 : self.at - len(found["data"])])
        return head.array(found["data"], 0)


class _Head(NamedTuple):
    """What precedes the bytes of an array: in lock-step the same at the same place."""

    data: bytes
    dtype: str
    shape: tuple[int, ...]
    size: int

    def array(self, data: bytes, begin: int) -> Any:
        """Return the array whose elements begin at a byte."""
        if len(data) - begin < self.size:
            raise IndexError
        little, kind = _KINDS[self.dtype]
        return np.ndarray(self.shape, little, data, begin).astype(kind)


_heads: dict[int, _Head] = {}
"""Heads of arrays by where they were in an earlier message."""

_MOST_HEADS, _ITEMS_OF_ARRAY = 256, 6


def _head(part: Message) -> _Head:
    """Return what a map says of an array."""
    dtype, shape, data = part.get("dtype"), part.get("shape"), part.get("data")
    if type(dtype) is not str or dtype not in DTYPES:
        raise ProtocolError(f"dtype must be one of {', '.join(DTYPES)}, got {ascii(dtype)[:40]}")
    if (
        not isinstance(shape, list)
        or len(shape) > MAX_DIMENSIONS
        or not all(type(n) is int and 0 <= n <= MAX_FRAME for n in shape)
    ):
        raise ProtocolError("the shape of an array must be a list of sizes")
    if type(data) is not bytes:
        raise ProtocolError("the data of an array must be bytes")
    size = extent = _KINDS[dtype][0].itemsize
    for n in shape:
        size, extent = size * n, extent * max(n, 1)
    if len(data) != size:
        raise ProtocolError(
            f"an array of {dtype} of shape {tuple(shape)} must have {size} bytes, got {len(data)}"
        )
    if extent > MAX_FRAME:  # NumPy refuses huge shapes, of no elements, too
        raise ProtocolError(f"an array of shape {tuple(shape)} is too large")
    return _Head(b"", dtype, tuple(shape), size)
