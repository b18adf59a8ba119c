"""Files of strangers: whatever they hold, there is one clear error, and nothing of them is run."""

import contextlib
import os
import pickle
import sqlite3

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.formats import read
from bridgegen.recordings.readers.pickles import PickledArray, read_pickle

from . import binary_writers as b
from . import writers as w

WRITERS = [
    w.write_states, w.write_highd, w.write_ind, w.write_ngsim, w.write_ngsim_text, w.write_smarts,
    w.write_commonroad, w.write_interaction, w.write_sumo, w.write_womd, w.write_scenarionet,
    b.write_osi, b.write_osi_view, b.write_mcap, b.write_mcap_unchecked,
    b.write_dat,
]  # fmt: skip


class Runs:
    """A pickle that would run a command."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.system, (f"touch {self.path}",)


class Calls:
    def __init__(self, function, *arguments):
        self.call = function, arguments

    def __reduce__(self):
        return self.call


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_a_pickle_runs_nothing(tmp_path, protocol):
    trace, path = tmp_path / "was-here", tmp_path / "bad.pkl"
    path.write_bytes(pickle.dumps({"tracks": Runs(trace)}, protocol))
    with refuses(FileFormatError):
        list(read(path))
    assert not trace.exists()
    pickle.loads(path.read_bytes())
    assert trace.exists()  # so the pickle is what it is taken for


@pytest.mark.parametrize(
    "value",
    [Calls(np.ndarray, (10**12,)), Calls(np.ndarray, (10,)),
     Calls(np.dtype, "O"), Calls(np.dtype, "V99999"),
     np.array(["a"], dtype=object), Calls(eval, "1"), Calls(getattr, "", "join"),
     Calls(dict, [(1, 2)])],
)  # fmt: skip
def test_a_pickle_of_more_than_arrays_of_numbers_is_refused(tmp_path, value):
    path = tmp_path / "bad.pkl"
    path.write_bytes(pickle.dumps(value))
    with pytest.raises(FileFormatError, match="refused"):
        read_pickle(path)


@settings(max_examples=100, deadline=None)
@given(shape=st.lists(st.integers(0, 4), max_size=3), order=st.sampled_from("CF"),
       kind=st.sampled_from(["<f8", ">f8", "<f4", "?", "i8", ">i2", "u1"]))  # fmt: skip
def test_arrays_come_back_as_numpy_would_read_them(tmp_path_factory, shape, order, kind):
    kind = "b1" if kind == "?" else kind
    array = np.arange(np.prod(shape, dtype=int)).astype(kind).reshape(shape, order=order)
    path = tmp_path_factory.getbasetemp() / "array.pkl"
    path.write_bytes(pickle.dumps([array, np.float64(1.5)], 4))
    found, scalar = read_pickle(path)
    assert isinstance(found, PickledArray)
    assert found.array().shape == array.shape
    assert (found.array() == array).all()
    assert scalar == 1.5


def _cleaned(path):
    """Return the recordings of a file and the error that ends it, if there is one."""
    found = []
    try:
        for traffic in read(path):
            found.append(clean(traffic).traffic)
    except FileFormatError as error:
        return found, str(error)
    return found, None


@pytest.mark.parametrize("write", WRITERS)
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(write, tmp_path_factory, data):
    path = write(tmp_path_factory.mktemp("damaged"))
    whole = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 6))):
        at = data.draw(st.integers(0, len(whole) - 1))
        what = data.draw(st.sampled_from(["flip", "cut", "insert", "double"]))
        if what == "flip":
            whole[at] = data.draw(st.integers(0, 255))
        elif what == "cut":
            del whole[at : at + data.draw(st.integers(1, 50))]
        elif what == "insert":
            whole[at:at] = data.draw(st.sampled_from([b"\n", b",", b"-", b"e9", b"nan", b"\x00"]))
        else:
            whole[at:at] = whole[at : at + 200]
    path.write_bytes(bytes(whole) or b"x")
    found, error = _cleaned(path)
    assert error is None or str(path.parent) in error
    for one in found:
        for name in ("time", "x", "y", "heading", "vx", "vy", "acceleration", "length"):
            assert np.isfinite(getattr(one, name)).all(), name


def test_a_database_whose_texts_are_no_utf_8_is_refused(tmp_path):
    path = w.write_smarts(tmp_path)
    whole = bytearray(path.read_bytes())
    whole[4060] = 0x80  # in the SQL of a table, which SQLite quotes in its error
    path.write_bytes(whole)
    _, error = _cleaned(path)
    approve(error, "database")


@settings(max_examples=100, deadline=None)
@given(data=st.binary(max_size=300), head=st.sampled_from(
    [b"", b"\x80\x04", b"SQLite format 3\x00", b"<fcd-export>", b'{"objects": [], "position": ',
     b"time,entity,x,y,h,speed\n", b"esmini", b"\xef\xbb\xbf", b"\x89MCAP0\r\n",
     b"\x40\0\0\0\x12\2\x10\1",
     b.dat_head()]))  # fmt: skip
def test_garbage_is_refused(tmp_path_factory, data, head):
    path = tmp_path_factory.getbasetemp() / "garbage"
    path.write_bytes(head + data)
    found, error = _cleaned(path)
    assert not found
    assert error is not None
    assert "garbage" in error


def _edit(path, change):
    lines = path.read_text().splitlines()
    path.write_text("\n".join(change(lines)) + "\n")
    return path


def test_time_that_runs_backwards_is_an_error_with_its_row(tmp_path):
    path = _edit(
        w.write_ind(tmp_path), lambda lines: [*lines[:9], lines[10], lines[9], *lines[11:]]
    )
    with refuses(FileFormatError, "07_tracks", "07_tracks.csv"):
        list(read(path))


def test_an_instant_that_comes_twice_is_an_error_with_its_row(tmp_path):
    path = _edit(w.write_interaction(tmp_path), lambda lines: [*lines[:5], *lines[4:]])
    with refuses(FileFormatError, "line 6"):
        list(read(path))


def test_missing_metadata_are_named(tmp_path):
    path = w.write_highd(tmp_path)
    (tmp_path / "01_tracksMeta.csv").unlink()
    with pytest.raises(FileFormatError, match=r"01_tracksMeta\.csv"):
        list(read(path))


def test_tracks_without_metadata_are_named(tmp_path):
    path = w.write_ind(tmp_path)
    _edit(tmp_path / "07_tracksMeta.csv", lambda lines: lines[:-1])
    with refuses(FileFormatError):
        list(read(path))


def test_ids_that_teleport_all_over_are_refused(tmp_path):
    def mixed(lines):
        return [lines[0], *(line.replace(",car,", ",car,9", 1) if k % 2 else line
                            for k, line in enumerate(lines[1:]))]  # fmt: skip

    (found,) = read(_edit(w.write_interaction(tmp_path), mixed))
    with refuses(FileFormatError):
        clean(found)


def test_a_history_whose_tables_are_views_is_refused(tmp_path):
    path = tmp_path / "bad.shf"
    with sqlite3.connect(path) as base:
        base.execute("CREATE VIEW Trajectory AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL "
                     "SELECT i + 1 FROM n) SELECT i FROM n")  # fmt: skip
        base.execute("CREATE TABLE Vehicle (id, type, length, width)")
    base.close()
    with refuses(FileFormatError):
        list(read(path))


def test_texts_where_a_history_has_numbers_are_refused(tmp_path):
    path = w.write_smarts(tmp_path)
    with sqlite3.connect(path) as base:
        base.execute("UPDATE Trajectory SET speed = 'fast' WHERE vehicle_id = 2")
    base.close()
    with refuses(FileFormatError, "fast"):
        list(read(path))


@pytest.mark.parametrize("name", ["valid", "position", "velocity", "heading", "length"])
@pytest.mark.parametrize("wrong", [3.0, True, None, "x", [], [[[1.0]]], np.float64(2.0)])
def test_columns_of_scenarionet_have_the_dimensions_that_they_must(tmp_path, name, wrong):
    """A number, a text, an empty list, or an array of three dimensions in place of a column."""
    path = w.write_scenarionet(tmp_path)
    whole = pickle.loads(path.read_bytes())
    next(iter(whole["tracks"].values()))["state"][name] = wrong
    path.write_bytes(pickle.dumps(whole))
    if name == "length" or (name == "heading" and np.size(wrong) == 0):
        with contextlib.suppress(FileFormatError):  # a length may be left out
            assert list(read(path))
    else:
        with pytest.raises(FileFormatError, match="must"):
            list(read(path))
