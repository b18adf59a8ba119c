"""Messages of the protocol: maps in msgpack or JSON, with arrays.

This file needs NumPy and msgpack only, and Python 3.9: see `bridgegen.drivers.remote.server`.
"""

from __future__ import annotations

import json
import math
import struct
import threading
from dataclasses import fields, is_dataclass
from functools import lru_cache
from typing import Any

import msgpack
import numpy as np

PROTOCOL = 1
"""The version of the protocol."""

# The other end may be anybody's program, so bounds hold while a message is read, not after. A map
# as large as Town05 is 7.5 MB.
MAX_FRAME = 64 * 2**20
"""Largest size of a message [bytes]."""

DTYPES = ("float64", "float32", "int64", "int32", "int8", "bool")
"""Types that the elements of an array may have."""

_SENT = {name: np.dtype("uint8" if name == "bool" else name).newbyteorder("<") for name in DTYPES}
"""Types of elements as they are in messages."""

MAX_ITEMS, MAX_DEPTH, MAX_DIMENSIONS = 5_000_000, 16, 8
"""Largest number of elements of the lists and maps of a message, their largest depth, and largest
number of dimensions of an array."""

MAX_JSON, MAX_JSON_LISTS = 16 * 2**20, 100_000
"""Largest size of an answer in JSON [bytes], and most lists and maps in it: while it is read, each
number of two bytes is an object of 40, and each list of 60."""

NUMBERS = frozenset(("acceleration", "curvature", "demand", "time", "x", "y", "h", "v"))
"""Keys of an answer in JSON whose lists are arrays."""

NOT_FINITE = {"Infinity": math.inf, "-Infinity": -math.inf, "NaN": math.nan}
"""Numbers that JSON does not have, as the texts that stand for them."""

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
    packer = _of_thread.packer
    packer.reset()
    packer.pack(message)
    with packer.getbuffer() as data:
        if len(data) > MAX_FRAME:
            raise ProtocolError(_too_long(len(data)))
        return b"".join((struct.pack("<I", len(data)), data))


def pack_json(message: Message) -> bytes:
    """Return a message as a frame: its length, four bytes little-endian, and itself in JSON.

    Arrays are nested lists. Numbers are written with as many digits as it takes to read the same
    bits again; those that are not finite are the texts `NOT_FINITE`.

    Raises:
        ProtocolError: it is longer than `MAX_FRAME`, or holds anything else than `pack` takes.
    """
    data = json.dumps(_listed(message), allow_nan=False, separators=(",", ":")).encode()
    if len(data) > MAX_FRAME:
        raise ProtocolError(_too_long(len(data)))
    return struct.pack("<I", len(data)) + data


def _listed(value: Any) -> Any:
    """Return a value in terms of those that JSON has."""
    if isinstance(value, np.ndarray):
        _element_of(value.dtype)
        if value.dtype.kind != "f" or np.isfinite(value).all():
            return value.tolist()
        found = value.astype(object)
        for text, number in NOT_FINITE.items():
            found[np.isnan(value) if number != number else value == number] = text
        return found.tolist()
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_listed(item) for item in value]
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        texts = ("NaN", "Infinity", "-Infinity")
        return value if math.isfinite(value) else texts[0 if value != value else 1 + (value < 0)]
    return _listed(_plain(value))


# msgpack's own C code reads and writes the rest. 330 lines of ours took 59 µs instead of 76 with
# one row, but 400 instead of 180 with 256: no search shows it.
def _plain(value: Any) -> Any:
    """Return a value that msgpack does not know in terms of those that it does."""
    if isinstance(value, np.ndarray):
        name, sent = _element_of(value.dtype)
        return {
            "dtype": name,
            "shape": value.shape,
            "data": value.astype(sent, copy=False).tobytes(),
        }
    if is_dataclass(value):
        return {name: getattr(value, name) for name in _fields_of(type(value))}  # type: ignore[arg-type]
    if isinstance(value, np.generic):
        return value.item()
    raise ProtocolError(f"a message cannot hold a {type(value).__name__}: {ascii(value)[:40]}")


@lru_cache(maxsize=64)
def _element_of(dtype: np.dtype[Any]) -> tuple[str, np.dtype[Any]]:
    """Return the name of an array's type, and the type that is sent."""
    if dtype.name not in DTYPES:
        raise ProtocolError(f"an array must be one of {', '.join(DTYPES)}, got {dtype.name}")
    return dtype.name, dtype.newbyteorder("<")


class _OfThread(threading.local):
    """A packer keeps its buffer; it is for one thread."""

    def __init__(self) -> None:
        self.packer = msgpack.Packer(default=_plain, autoreset=False, unicode_errors="replace")


_of_thread = _OfThread()


@lru_cache(maxsize=64)
def _fields_of(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


def length(head: bytes | bytearray) -> int:
    """Return how long the message is that follows four bytes.

    Raises:
        ProtocolError: longer than `MAX_FRAME`.
    """
    # Before anything is allocated: four bytes could ask for 4 GiB.
    (found,) = struct.unpack("<I", head)
    if found > MAX_FRAME:
        raise ProtocolError(_too_long(found))
    return int(found)


def _too_long(found: int) -> str:
    most = MAX_FRAME // 2**20
    return f"a message must be at most {most} MiB long, got {found / 2**20:.1f} MiB"


def is_json(data: bytes) -> bool:
    """Return whether a message is in JSON: in msgpack, no map begins with this byte."""
    return data[:1] == b"{"


def _unpack_json(data: bytes) -> Message:
    """Return a message in JSON, with its arrays as NumPy's of float64."""
    if len(data) > MAX_JSON or data.count(b"[") + data.count(b"{") > MAX_JSON_LISTS:
        raise ProtocolError(_TOO_LARGE)
    try:
        found = json.loads(data.decode(), parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:  # UnicodeDecodeError is a ValueError
        raise ProtocolError(f"the message is no JSON: {str(error)[:80]}") from None
    if not isinstance(found.get("type"), str):
        raise ProtocolError("a message must be a map with a text 'type'")
    if _is_deeper(found, MAX_DEPTH):
        raise ProtocolError(_TOO_LARGE)
    for name in NUMBERS & found.keys():
        if type(found[name]) is list:
            found[name] = _numbers(found[name], name)
    return dict(found)


def _refuse_constant(text: str) -> Any:
    raise ProtocolError(f'JSON has no number {text}: write the text "{text}"')


def _numbers(values: list[Any], name: str) -> Any:
    """Return nested lists of numbers as an array of float64."""
    try:
        found = np.array(values, dtype=object)
        flat = [
            NOT_FINITE[value] if type(value) is str else value for value in found.ravel().tolist()
        ]
        if not all(type(value) in (int, float) for value in flat):
            raise TypeError
        return np.array(flat, dtype=np.float64).reshape(found.shape)
    except (KeyError, OverflowError, TypeError, ValueError):
        texts = ", ".join(NOT_FINITE)
        raise ProtocolError(
            f"'{name}' must be lists of numbers, all of one length, or the texts {texts}"
        ) from None


def unpack(data: bytes, max_items: int = MAX_ITEMS) -> Message:
    """Return a message, with its arrays as NumPy's.

    Args:
        data: in msgpack or JSON, without the length.
        max_items: most elements of all its lists and maps.

    Raises:
        ProtocolError: it is neither msgpack nor JSON, no map, or too large.
    """
    if is_json(data):
        return _unpack_json(data)
    left = max_items

    def count(part: Any) -> Any:  # while it is read: a byte of a message is an object of 60
        nonlocal left
        left -= len(part)
        if left < 0:
            raise ProtocolError(_TOO_LARGE)
        return part

    def take(part: Message) -> Any:
        count(part)
        if set(map(type, part)) - {str}:
            raise ProtocolError("the keys of a map must be texts")
        return _array(part) if "dtype" in part else part

    # A list cannot have more parts than the message has bytes.
    most = min(max_items, len(data))
    try:
        found = msgpack.unpackb(
            data,
            list_hook=count,
            object_hook=take,
            ext_hook=_refuse_extension,
            strict_map_key=False,  # checked by `take`, in words
            max_array_len=most,
            max_map_len=most,
        )
    except ProtocolError:
        raise
    except msgpack.ExtraData:
        raise ProtocolError("the message is no msgpack: more follows its end") from None
    except msgpack.StackError:
        raise ProtocolError(_TOO_LARGE) from None
    except (ValueError, TypeError) as error:  # TypeError: a map as the key of a map
        raise ProtocolError(
            f"the message is no msgpack, or too large: {str(error) or type(error).__name__}"
        ) from None
    if not isinstance(found, dict) or not isinstance(found.get("type"), str):
        raise ProtocolError("a message must be a map with a text 'type'")
    if _is_deeper(found, MAX_DEPTH):
        raise ProtocolError(_TOO_LARGE)
    return found


_TOO_LARGE = "the message has too many parts, or is nested too deeply"


def _refuse_extension(code: int, data: bytes) -> Any:
    raise ProtocolError(f"the message has an extension of msgpack: {code}")


def _is_deeper(value: Any, depth: int) -> bool:
    """Return whether lists and maps are nested deeper than a depth."""
    if type(value) is dict:
        value = value.values()
    elif type(value) is not list:
        return False
    return depth == 0 or any(_is_deeper(item, depth - 1) for item in value)


def _array(part: Message) -> Any:
    """Return the array that a map describes."""
    dtype, shape, data = part["dtype"], part.get("shape"), part.get("data")
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
    sent = _SENT[dtype]
    size = extent = sent.itemsize
    for n in shape:
        size, extent = size * n, extent * max(n, 1)
    if len(data) != size:
        raise ProtocolError(
            f"an array of {dtype} of shape {tuple(shape)} must have {size} bytes, got {len(data)}"
        )
    if extent > MAX_FRAME:  # NumPy refuses huge shapes, of no elements, too
        raise ProtocolError(f"an array of shape {tuple(shape)} is too large")
    # A copy: ``data`` is read-only, and little-endian on any machine.
    return np.ndarray(shape, sent, data).astype(dtype)
