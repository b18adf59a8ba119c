"""esmini's binary log: packets of what has changed."""

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.readers.formats import read

from . import binary_writers as b


def _log(tmp_path, *packets, head=None):
    path = tmp_path / "sim.dat"
    path.write_bytes((b.dat_head() if head is None else head) + b"".join(packets))
    return path


def _at(x):
    return b.packet(13, "6d", x, 2.0, 0.0, 0.0, 0.0, 0.0)


def _time(value):
    return b.packet(5, "d", value)


ENTITY, STEP = b.packet(0, "i", 4), b.packet(21, "d", 0.1)


def test_who_stands_is_recorded_while_nothing_changes(tmp_path):
    path = _log(tmp_path, _time(0.0), STEP, ENTITY, _at(7.0), _time(0.5), ENTITY, _at(8.0),
                b.packet(22, "d", 0.8))  # fmt: skip
    (found,) = read(path)
    assert found.time == pytest.approx(np.arange(9) * 0.1)
    assert found.x.tolist() == [7.0] * 5 + [8.0] * 4
    assert found.facts.map == "road.xodr"


def test_an_id_that_is_given_again_is_another_participant(tmp_path):
    name = b.packet(6, "I3s", 3, b"car")
    path = _log(tmp_path, _time(0.0), ENTITY, _at(1.0), name, _time(0.1), ENTITY, _at(2.0),
                _time(0.2), ENTITY, b.packet(19), _time(0.3), ENTITY, _at(90.0), name)  # fmt: skip
    (found,) = read(path)
    assert found.names == ("car", "car (2)")
    assert found.x.tolist() == [1.0, 2.0, 90.0]


@pytest.mark.parametrize(
    ("head", "says"),
    [
        (b.dat_head((5, 2)), "5.2"),
        (b.dat_head((4, 3)), "4.3"),
        (b"\x02\0\0\0" + b"../xodr/e6mini.xodr".ljust(512, b"\0"), "supported"),
    ],
)
def test_other_versions_are_named(tmp_path, head, says):
    with refuses(FileFormatError, says):
        list(read(_log(tmp_path, head=head)))


@pytest.mark.parametrize(
    ("packets", "says"),
    [
        ([_time(1.0), _time(0.5)], "must be a number, and increase, got 0.5 after 1"),
        ([_time(1.0), _time(1.0)], "got 1 after 1"),
        ([_time(float("nan"))], "must be a number"),
        ([_time(0.0), _at(1.0)], "must follow a time and an entity"),
        ([_time(0.0), ENTITY, b.packet(13, "d", 1.0)], "packet 13 must have 48 bytes, got 8"),
        ([_time(0.0), b"\x0d\0\0\0\xff\xff\xff\x7f"], "a packet of .* bytes is cut off"),
        ([_time(0.0), b"\x0d\0\0"], "a packet is cut off"),
        ([_time(0.0), STEP, ENTITY, _at(1.0), _time(9e8)], "may hold .* states"),
        ([_time(0.0)], "holds no states"),
    ],
)  # fmt: skip
def test_a_log_that_breaks_its_rules_is_an_error(tmp_path, packets, says):
    path = _log(tmp_path, *packets)
    with pytest.raises(FileFormatError, match=says) as error:
        list(read(path))
    if "hold" not in says:
        at = len(b.dat_head()) + sum(map(len, packets[:-1]))
        assert f"byte {at}:" in str(error.value)
