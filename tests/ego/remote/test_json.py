"""Drivers that answer in JSON: the same numbers to the bit, and nothing but numbers."""

import json
import math
import shlex
import struct
import sys
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from tests.approval import refuses
from tests.ego.remote.asked import N, observation, scene

from bridgegen.drivers.driver_process import DriverProcess
from bridgegen.drivers.remote import messages
from bridgegen.drivers.remote.messages import ProtocolError, pack, pack_json, unpack

DOUBLES = arrays(np.float64, array_shapes(max_dims=3, max_side=4), elements=st.floats())


def sent(message):
    frame = pack_json(message)
    assert struct.unpack("<I", frame[:4]) == (len(frame) - 4,)

    def refuse(text):
        raise AssertionError(text)

    return json.loads(frame[4:], parse_constant=refuse)


def same_bits(a, b):
    is_nan = np.isnan(a)
    assert a.shape == b.shape
    assert (is_nan == np.isnan(b)).all()
    assert a[~is_nan].tobytes() == b[~is_nan].tobytes()


@given(DOUBLES)
def test_what_is_sent_is_read_as_the_same_bits(values):
    found = sent({"type": "act", "x": values})["x"]
    read = np.array([float(value) for value in np.array(found, object).ravel()])
    same_bits(read.reshape(values.shape), values)


@given(DOUBLES)
def test_what_is_answered_has_the_bits_of_msgpack(values):
    answer = {"type": "control", "acceleration": values, "curvature": values}
    in_json, in_msgpack = unpack(pack_json(answer)[4:]), unpack(pack(answer)[4:])
    for name in ("acceleration", "curvature"):
        assert in_json[name].dtype == np.float64
        same_bits(in_json[name], in_msgpack[name])


def test_a_whole_observation_and_scene_are_json():
    found = sent({"type": "act", "observation": observation(), "scene": scene()})
    seen = found["observation"]
    assert np.array(seen["tracks"]).shape == observation().tracks.shape
    assert sent({"type": "act", "a": math.inf, "b": -math.inf, "c": np.bool_(True)}) == {
        "type": "act", "a": "Infinity", "b": "-Infinity", "c": True,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('{"type": "control", "acceleration": [NaN]}', "NaN"),
        ('{"type": "control", "acceleration": [1, "2"]}', "acceleration"),
        ('{"type": "control", "acceleration": [1, true]}', "acceleration"),
        ('{"type": "control", "acceleration": [[1], [1, 2]]}', "acceleration"),
        ('{"type": "control", "acceleration": [1' + "0" * 400 + "]}", "acceleration"),
        ('{"type": 3}', "type"),
        ('{"type": "control"', "JSON"),
        ('{"type": "' + "\\ud800" + '", "a": ' + "[" * 50 + "]" * 50 + "}", "nested"),
        ("{" + '"a":[' * 200_000, "nested"),
        ('{"type": "ready"} {}', "JSON"),
    ],
)
def test_what_is_no_answer_is_refused(text, named):
    with refuses(ProtocolError, named):
        unpack(text.encode())


def test_an_answer_that_is_too_long_is_refused_before_it_is_read(monkeypatch):
    monkeypatch.setattr(messages, "MAX_JSON", 20)
    with refuses(ProtocolError, "too many parts"):
        unpack(b'{"type": "ready", "more": 1}')


@given(st.binary(max_size=60))
def test_any_bytes_are_a_message_or_refused(data):
    for start in (b"", b"{", b'{"type":"control","x":'):
        with suppress(ProtocolError):
            assert isinstance(unpack(start + data)["type"], str)


def test_a_control_that_is_not_finite_fails_as_in_msgpack(tmp_path):
    loop = tmp_path / "loop.py"
    loop.write_text(
        "import json, struct, sys\n"
        "answers = iter([{'type': 'hello', 'protocol': 1}, {'type': 'ready'},\n"
        " {'type': 'control', 'acceleration': ['NaN'] * 3, 'curvature': [0, 0, 0]}])\n"
        "while head := sys.stdin.buffer.read(4):\n"
        "    sys.stdin.buffer.read(*struct.unpack('<I', head))\n"
        "    data = json.dumps(next(answers)).encode()\n"
        "    sys.stdout.buffer.write(struct.pack('<I', len(data)) + data)\n"
        "    sys.stdout.buffer.flush()\n"
    )
    driver = DriverProcess(f"exec:{shlex.join([sys.executable, str(loop)])}")
    driver.reset(N, scene())
    with pytest.raises(Exception, match=r"finite|NaN"):
        driver.act(observation())
    driver.close()
