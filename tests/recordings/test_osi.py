"""ASAM OSI: what a message says, and what is refused, with the byte."""

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.recordings.readers import mcap, osi
from bridgegen.recordings.readers.formats import read
from bridgegen.recordings.readers.wire import Message, Shape

from . import binary_writers as b
from . import writers as w

SHAPE = Shape({1: "i", 2: "x.", 5: {3: "y.", 40: "j", 4: {7: "z."}}})


@given(
    st.integers(0, 2**63 - 1), st.floats(), st.floats(allow_nan=False), st.integers(0, 2**40),
    st.floats(allow_nan=False), st.lists(st.tuples(st.integers(8, 2**28), st.binary(max_size=9))),
    st.randoms(),
)  # fmt: skip
def test_wanted_fields_are_read_in_any_order_among_others(i, x, y, j, z, others, random):
    inner = [b.field(3, y), b.field(40, j), b.field(4, b.field(7, z)), b.field(9, b"text")]
    random.shuffle(inner)
    parts = [b.field(1, i), b.field(2, x), b.field(5, b"".join(inner))]
    parts += [b.field(number, value) for number, value in others]
    random.shuffle(parts)
    data = b"".join(parts)
    found = SHAPE.read(Message.of(data, "", 0), np.array([[0, len(data)]]))
    assert (found["i"][0], found["j"][0]) == (i, j)
    assert np.array_equal([found["x"][0], found["y"][0], found["z"][0]], [x, y, z], equal_nan=True)


def test_what_a_missing_message_holds_is_unknown_and_what_a_message_leaves_out_is_0():
    data = b.field(5, b"")
    found = SHAPE.read(Message.of(data, "", 0), np.array([[0, len(data)], [0, 0]]))
    assert found["y"][0] == 0.0
    assert found["j"][0] == 0
    assert np.isnan(found["y"][1])
    assert found["j"][1] == -1
    assert np.isnan(found["z"]).all()


def _osi(tmp_path, messages):
    path = tmp_path / "one.osi"
    path.write_bytes(b.trace(messages))
    return path


def _state(name=1, nanos=0, x=1.0, **more):
    base = b.message(_2=b.message(_1=x, _2=2.0), **more)
    return (
        b.message(_2=b.message(_1=1, _2=nanos))
        + b.field(5, b.message(_1=b.message(_1=name), _2=base))
    )  # fmt: skip


def test_a_trace_that_is_cut_off_is_an_error_with_the_byte(tmp_path):
    path = w_path = b.write_osi(tmp_path)
    whole = w_path.read_bytes()
    begin = 4 + struct.unpack_from("<I", whole)[0]
    path.write_bytes(whole[: begin + 100])
    with refuses(FileFormatError, begin):
        list(read(path))


def test_a_message_longer_than_any_is_not_read(tmp_path):
    path = b.write_osi(tmp_path)
    size = path.stat().st_size
    with path.open("ab") as file:
        file.write(b"\xff\xff\xff\xff")
    with refuses(FileFormatError, size, "4,294,967"):
        list(read(path))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda one: one[:-1], "cut off"),
        (lambda one: one + b"\x2a\x7f", "longer"),
        (lambda one: one + b"\x2b", "begins"),
        (lambda one: one + b.field(5, b.message(_1=b.message(_1=1), _2=7)), "type"),
        (lambda one: one + b.field(5, b.message(_2=b"")), "id"),
        (lambda _: b.field(5, b.message(_1=b.message(_1=1))), "timestamp"),
    ],
)
def test_a_malformed_message_is_an_error_with_the_byte(tmp_path, change, says):
    path = _osi(tmp_path, [_state(), change(_state(nanos=10**8))])
    with refuses(FileFormatError, says) as error:
        list(read(path))
    at = int(str(error.value).split("byte ")[1].split(":")[0])
    assert 4 + len(_state()) <= at < path.stat().st_size


def test_an_instant_that_comes_twice_is_an_error_with_the_byte_of_the_object(tmp_path):
    path = _osi(tmp_path, [_state(), _state()])
    at = path.read_bytes().rindex(b"\x0a\x02\x08\x01\x12")  # the second object
    with refuses(FileFormatError, at):
        list(read(path))


def test_a_place_that_is_no_number_is_an_error_with_the_byte(tmp_path):
    with refuses(FileFormatError):
        list(read(_osi(tmp_path, [_state(x=math.nan)])))


def test_a_clock_that_counts_from_1970_keeps_its_nanoseconds(tmp_path):
    path = _osi(tmp_path, b.ground_truths(start=1_790_000_000))
    (found,) = read(path)
    assert found.time[: w.N] == pytest.approx(w.states(0)[0], abs=1e-9)
    assert any("from 1790000000 s" in note for note in found.facts.notes)


def test_a_lamp_changes_when_it_is_recorded_to(tmp_path):
    def lamp(color, mode):
        about = b.message(_1=color, _3=mode)
        return b.field(7, b.message(_1=b.message(_1=9), _2=b.message(_2=b""), _3=about))

    seen = [(2, 3), (2, 3), (2, 2), (3, 4)]
    path = _osi(tmp_path, [_state(nanos=k * 10**8) + lamp(*one) for k, one in enumerate(seen)])
    (found,) = read(path)
    ((name, light),) = found.facts.lights.items()
    assert name == "9"
    assert [word for _, word in light.changes] == ["red", "off", "flashing yellow"]
    assert [time for time, _ in light.changes] == pytest.approx([1.0, 1.2, 1.3])


def _lane(name, points, ascending, left, right, before=0, after=0):
    about = b.message(_1=2) + b"".join(b.field(3, b.message(_1=x, _2=y)) for x, y in points)
    about += b.message(_4=int(ascending))
    about += b.field(7, b.message(_1=b.message(_1=before), _2=b.message(_1=after)))
    about += b.field(8, b.message(_1=right)) + b.field(9, b.message(_1=left))
    return b.field(10, b.message(_1=b.message(_1=name), _2=about))


def _border(name, points):
    line = b"".join(b.field(2, b.message(_1=b.message(_1=x, _2=y))) for x, y in points)
    return b.field(9, b.message(_1=b.message(_1=name)) + line)


def test_lanes_run_in_the_direction_of_travel_between_their_borders(tmp_path):
    lines = {name: [(0.0, y), (50.0, y)] for name, y in ((11, 4.0), (12, 1.0), (13, -2.0))}
    road = b"".join(_border(name, points) for name, points in lines.items())
    road += _lane(1, [(0.0, -0.5), (50.0, -0.5)], True, 12, 13, after=5)
    road += _lane(2, [(0.0, 2.5), (50.0, 2.5)], False, 11, 12, before=7)
    (found,) = read(_osi(tmp_path, [_state() + road]))
    right, left = found.facts.lanelets
    assert (right.name, right.left_opposite, left.left_opposite) == ("1", "2", "1")
    assert right.left[:, 1] == pytest.approx(1.0)
    assert right.right[:, 1] == pytest.approx(-2.0)
    assert left.left[[0, -1]] == pytest.approx(np.array([[50.0, 1.0], [0.0, 1.0]]))
    assert left.right[:, 1] == pytest.approx(4.0)


def test_messages_of_an_mcap_file_are_in_the_order_of_their_log(tmp_path):
    path = tmp_path / "one.mcap"
    late, early = b.logged(1, 9, _state(nanos=10**8)), b.logged(1, 3, _state())
    path.write_bytes(b.mcap(b.channel(1, b"a") + late + early))
    (found,) = read(path)
    assert found.time.tolist() == pytest.approx([1.0, 1.1])


def test_topics_are_recordings_and_share_the_lanes_of_one(tmp_path):
    path = tmp_path / "one.mcap"
    road = _lane(1, [(0.0, 0.0), (50.0, 0.0)], True, 0, 0)
    channels = [b.channel(k, topic) for k, topic in ((1, b"map"), (2, b"a"), (3, b"b"))]
    other = b.channel(4, b"c", b"osi3.SensorData") + b.logged(4, 0, b"")
    states = b.logged(1, 0, road) + b.logged(2, 0, _state()) + b.logged(3, 0, _state(name=5))
    path.write_bytes(b.mcap(b"".join(channels) + other + states))
    one, two = read(path)
    assert (one.facts.name, two.facts.name, two.names) == ("a", "b", ("5",))
    assert one.facts.lanelets == two.facts.lanelets != ()
    approve(one.facts.notes, "SensorData")


@pytest.mark.osi
@pytest.mark.parametrize("method", ["zstd", "lz4"])
def test_a_compressed_file_holds_what_an_uncompressed_one_does(tmp_path, method):
    zstandard, lz4 = pytest.importorskip("zstandard"), pytest.importorskip("lz4.frame")
    pack = zstandard.ZstdCompressor().compress if method == "zstd" else lz4.compress
    records = b.records(b.ground_truths())
    path = tmp_path / "traffic.mcap"
    path.write_bytes(b.mcap(records, pack, method.encode()))
    (packed,), (plain,) = read(path), read(b.write_mcap(tmp_path))
    assert packed.time.tobytes() == plain.time.tobytes()
    assert packed.x.tobytes() == plain.x.tobytes()
    for size in (100, mcap.MOST_RECORD + 1):  # less than it holds, more than any may
        path.write_bytes(b.mcap(records, pack, method.encode(), size, checksum=0))
        with refuses(FileFormatError):
            list(read(path))
    path.write_bytes(b.mcap(records, lambda data: pack(data)[:-40], method.encode()))
    with refuses(FileFormatError):
        list(read(path))


def test_without_the_extra_a_compressed_file_names_it(tmp_path, monkeypatch):
    monkeypatch.setattr("bridgegen.base.extras.is_installed", lambda extra: extra != "osi")
    path = tmp_path / "one.mcap"
    path.write_bytes(b.mcap(b.records([_state()]), method=b"zstd"))
    with refuses(InputError, "bridgegen[osi]"):
        list(read(path))


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b.mcap(b.records([_state()]), method=b"snappy"), "snappy"),
        (b.mcap(b.records([_state()]), checksum=1), "checksum differs"),
        (b.mcap(b.records([_state()]), checksum=0, size=50), "is damaged"),
        (b.mcap(b.records([_state()]))[:-40], "cut off"),
        (b.mcap(b.logged(1, 0, _state())), "channel 1, unknown"),
        (b.mcap(b.channel(1, b"a")), "GroundTruth"),
        (b.mcap(b.channel(1, b"a") + b.record(5, b"abc")), "too short"),
        (mcap.MAGIC + b"\x06" + b"\xff" * 8, "record"),
    ],
)
def test_a_container_that_breaks_its_rules_is_an_error(tmp_path, data, says):
    path = tmp_path / "one.mcap"
    path.write_bytes(data)
    with refuses(FileFormatError, says):
        list(read(path))


def test_a_ground_truth_with_one_traffic_light_is_no_sensor_view():
    box = b.message(_1=b.message(_1=1.0), _2=b.message(_1=5.0))
    truth = b.message(_2=b.message(_1=1)) + b.field(7, b.message(_1=b.message(_1=3), _2=box))
    message = Message.of(truth, "", 0)
    assert osi._ground_truth(message) is message
    view = Message.of(b.field(7, truth), "", 0)
    assert osi._ground_truth(view).begin == len(view.data) - len(truth)


def test_an_id_of_64_bits_keeps_them(tmp_path):
    (found,) = read(_osi(tmp_path, [_state(name=2**63 - 1)]))
    assert found.names == (str(2**63 - 1),)
    with refuses(FileFormatError):  # OSI's mark of an invalid one
        list(read(_osi(tmp_path, [_state(name=2**64 - 1)])))
