"""Messages: what is packed is read, within bounds, and any bytes at all are read or refused."""

import ast
import struct
import sys
from contextlib import suppress
from pathlib import Path

import msgpack
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.drivers.remote import messages, server
from bridgegen.drivers.remote.messages import DTYPES, MAX_DEPTH, ProtocolError, length, pack, unpack

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=20) | st.dictionaries(st.text(), inner, max_size=20),
    max_leaves=40,
)
MESSAGES = st.dictionaries(st.text().filter(lambda name: name != "dtype"), PLAIN, max_size=20)


@st.composite
def arrays(draw):
    shape = draw(st.lists(st.integers(0, 4), max_size=4))
    seed = draw(st.integers(0, 2**32 - 1))
    bits = np.random.default_rng(seed).bytes(8 * int(np.prod(shape)))
    name = draw(st.sampled_from(DTYPES))
    count = int(np.prod(shape))
    if name == "bool":
        return (np.frombuffer(bits, np.uint8)[:count] & 1).astype(bool).reshape(shape)
    return np.frombuffer(bits, name)[:count].reshape(shape)


def has_dtype(value):
    if isinstance(value, dict):
        return "dtype" in value or any(map(has_dtype, value.values()))
    return isinstance(value, list) and any(map(has_dtype, value))


@given(MESSAGES.filter(lambda one: not has_dtype(one)))
def test_what_is_packed_is_read_by_msgpack_and_by_us(message):
    message = {**message, "type": "any"}
    frame = pack(message)
    assert length(frame[:4]) == len(frame) - 4
    assert repr(msgpack.unpackb(frame[4:])) == repr(message)
    assert repr(unpack(frame[4:])) == repr(message)
    assert repr(unpack(msgpack.packb(message))) == repr(message)


@given(st.lists(arrays(), min_size=1, max_size=3))
def test_arrays_keep_their_bits(found):
    message = {"type": "act", "arrays": found}
    for one, two in zip(found, unpack(pack(message)[4:])["arrays"], strict=True):
        assert (one.dtype, one.shape, one.tobytes()) == (two.dtype, two.shape, two.tobytes())
        assert two.flags.writeable


@given(arrays())
def test_an_array_of_any_layout_is_the_same(array):
    for other in (array.astype(array.dtype.newbyteorder(">")), np.array(array, order="F")):
        assert pack({"type": "a", "b": other}) == pack({"type": "a", "b": array})


@given(st.binary(max_size=200))
@example(b"\x83\xa4type\xa1a\xa5dtype\xa4bool\xa1b\xc0")
@example(b"\xdf\xff\xff\xff\xff")
@example(b"\x91" * 100)
@example(b"\x81\xa4type\xd9")
@example(b"\x81\xa4type\xa1\xff")
@example(b"\xc7\x00\x01")
def test_any_bytes_are_a_message_or_a_protocol_error(data):
    with suppress(ProtocolError):
        assert isinstance(unpack(data)["type"], str)


@given(MESSAGES, arrays(), st.integers(0, 10**6), st.integers(0, 255), st.booleans())
def test_a_changed_byte_of_a_message_is_a_message_or_a_protocol_error(
    message, array, place, byte, cut
):
    data = bytearray(pack({**message, "type": "x", "array": array, "again": [array]})[4:])
    place %= len(data)
    data[place] = byte
    with suppress(ProtocolError):
        assert isinstance(unpack(bytes(data[: place + 1] if cut else data))["type"], str)


@pytest.mark.parametrize(
    ("message", "error"),
    [
        (struct.pack(">B", 0xC1), "no msgpack"),
        (msgpack.packb([1]), "type"),
        (msgpack.packb({"type": 3}), "type"),
        (msgpack.packb({1: 2}), "texts"),
        (msgpack.packb({"type": "a"}) + b"\x00", "follows"),
        (msgpack.packb({"type": "a"})[:-1], "msgpack"),
        (b"\x82\xa4type\xa1a\xa1x" + b"\x91" * MAX_DEPTH + b"\xc0", "nested"),
        (b"\x82\xa4type\xa1a\xa1x" + b"\x91" * 5000 + b"\xc0", "nested"),
        (b"\x81\xa4type\xdd\xff\xff\xff\xff", "too large"),
        (msgpack.packb({"type": "a", "x": [[0] * 400] * 3}), "parts"),
        (msgpack.packb({"type": "a", "x": msgpack.ExtType(5, b"")}), "extension"),
        (
            msgpack.packb({"type": "a", "x": {"dtype": "object", "shape": [1], "data": b""}}),
            "dtype",
        ),
        (
            msgpack.packb({"type": "a", "x": {"dtype": "int8", "shape": [-1], "data": b""}}),
            "shape",
        ),
        (
            msgpack.packb(
                {"type": "a", "x": {"dtype": "float64", "shape": [3], "data": b"12345678"}}
            ),
            "24",
        ),
        (
            msgpack.packb({"type": "a", "x": {"dtype": "int8", "shape": [2**26] * 8, "data": b""}}),
            "bytes",
        ),
    ],
)
def test_what_is_no_message(message, error):
    with refuses(ProtocolError, error):
        unpack(message, max_items=1024)


def test_a_length_is_bounded():
    with refuses(ProtocolError, "1024.0", "64 MiB"):
        length(struct.pack("<I", 2**30))
    with refuses(ProtocolError, "64 MiB"):
        pack({"type": "act", "x": np.zeros(2**23 + 1)})


@pytest.mark.parametrize("value", [object(), 2**64, np.zeros(1, complex), {1, 2}])
def test_what_no_message_can_hold(value):
    with pytest.raises(ProtocolError):
        pack({"type": "a", "x": value})


@pytest.mark.parametrize("module", [messages, server])
def test_the_driver_s_end_needs_numpy_and_msgpack_alone_and_an_older_python(module):
    tree = ast.parse(Path(module.__file__).read_text("utf-8"), feature_version=(3, 9))
    names = {one.module for one in ast.walk(tree) if isinstance(one, ast.ImportFrom)}
    names |= {
        alias.name for one in ast.walk(tree) if isinstance(one, ast.Import) for alias in one.names
    }
    roots = {name.partition(".")[0] for name in names}
    assert roots - sys.stdlib_module_names <= {"numpy", "msgpack", "bridgegen", "messages"}
    assert {name for name in names if name.startswith("bridgegen")} <= {"bridgegen.drivers.remote"}


@pytest.mark.parametrize("shape", [[0, 2**26, 2**26, 2**26], [2**26, 2**26, 0], [0, 2**24]])
def test_a_huge_shape_without_elements_is_refused(shape):
    empty = {"dtype": "float64", "shape": shape, "data": b""}
    with pytest.raises(ProtocolError, match="too large"):
        unpack(msgpack.packb({"type": "control", "acceleration": empty}))
