"""Tables, read in chunks, against Python's own reading of each field."""

import csv
import io
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.readers import columns
from bridgegen.recordings.readers.columns import read_columns


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("columns")


numbers = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False, width=32).map(repr),
    st.floats(-1e6, 1e6).map(lambda x: f"{x:.4f}"),
    st.integers(-(10**18), 10**18).map(str),
    st.sampled_from(["0", "-0.0", "+1.5", "1e5", "1E-7", ".5", "5.", " 7 ", "1e-300", '"3.25"']),
)


@settings(max_examples=200, deadline=None)
@given(rows=st.lists(st.tuples(numbers, numbers), min_size=1, max_size=30))
def test_numbers_are_those_that_python_reads(folder, rows):
    path = folder / "table.csv"
    path.write_text("a,b\r\n" + "".join(f"{a},{b}\r\n" for a, b in rows))
    found = read_columns(path, ("a", "b")).numbers
    for k, name in enumerate("ab"):
        truth = [float(row[k].strip('"')) for row in rows]
        assert found[name].tobytes() == np.array(truth).tobytes()


@settings(max_examples=200, deadline=None)
@given(texts=st.lists(st.sampled_from(["car", "bus", "a,b", "é", "", "car ", "x" * 99]),
                      min_size=1, max_size=20),
       size=st.integers(8, 300))  # fmt: skip
def test_texts_are_those_that_python_reads_whatever_the_chunks(folder, texts, size):
    buffer = io.StringIO()
    csv.writer(buffer).writerows([["n", "t"], *([k, text] for k, text in enumerate(texts))])
    path = folder / "texts.csv"
    path.write_text(buffer.getvalue(), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(columns, "CHUNK", size)
        found = read_columns(path, ("n",), ("t",))
    names, codes = found.texts["t"]
    assert [names[code] for code in codes] == [text.strip() for text in texts]
    assert found.numbers["n"].tolist() == list(range(len(texts)))


def test_spaces_separate_where_no_line_names_the_columns(tmp_path):
    path = tmp_path / "table.txt"
    path.write_text("  1   2.5\t3 \n4 5 6\n\n")
    found = read_columns(path, ("b",), names=("a", "b", "c"))
    assert found.numbers["b"].tolist() == [2.5, 5.0]


def test_an_empty_field_is_not_known(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("a,b,c,d\n,,,1\n2,nan,,\n,,3,\n")
    found = read_columns(path, ("a", "b", "c", "d")).numbers
    assert all(math.isnan(value) for value in found["b"])
    assert [np.isnan(found[name]).tolist() for name in "acd"] == [
        [True, False, True], [True, True, False], [False, True, True],
    ]  # fmt: skip


@pytest.mark.parametrize(
    "bad", ["1,x", "1,1e", "1,--2", "1,0x1F", "1,1_0", "1,inf", "1,1 2", "1,7e999", "1,٣"]
)
def test_what_is_no_number_is_named_with_its_line(tmp_path, bad):
    path = tmp_path / "table.csv"
    path.write_text(f"a,b\n1,2\n{bad}\n")
    with refuses(FileFormatError, "table.csv", "line 3"):
        read_columns(path, ("a", "b"))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a,c\n1,2\n", "line 1"),
        ("a,b,b\n1,2,3\n", "line 1"),
        ("a,b\n1,2\n3\n", "line 3"),
        ("a,b\n1,2\n3,4,5\n", "line 3"),
        ("a,b\n1,2\n\n3,4\n", "line 3"),
        ("a,b\n" + "1,2\n" * 3 + "\n" * 2**17 + "3,4\n", "line 5"),
        ('a,b\n1,"2\n', "line 2"),
        ("a,b\n", "states"),
        ("a,b\n1," + "2" * 200_000 + "\n", "line"),
    ],
)
def test_a_broken_table_is_one_clear_error(tmp_path, text, says, monkeypatch):
    monkeypatch.setattr(columns, "CHUNK", 2**16)
    path = tmp_path / "table.csv"
    path.write_text(text)
    with refuses(FileFormatError, says):
        read_columns(path, ("a", "b"))
