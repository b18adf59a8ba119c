import json

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, StorageError
from bridgegen.search.triage import JSON_FILE, read_record, write_record
from bridgegen.search.triage.triage import triage


def planted(v, fix):
    harmful = (v["ego_speed"] >= 7.5) & (v["bv_start"] <= 14.0) & (fix != 1)
    return np.where(harmful, 0.3 + 0.1 * v["ego_speed"] / 8.9, 0.1)


@pytest.fixture(scope="module")
def found(space, world, fixed):
    pipeline = world(space, planted, fixed)
    return triage(pipeline, pipeline.rows(300), algorithm="random", seed=0, keep=4).record


def test_what_is_written_is_read(found, tmp_path):
    path = write_record(tmp_path, found)
    assert path == tmp_path / JSON_FILE
    assert read_record(path, "the rows") == found
    assert path.read_bytes() == write_record(tmp_path, found).read_bytes()


def test_where_there_is_none_there_is_none(tmp_path):
    assert read_record(tmp_path / JSON_FILE) is None


def changed(data, *place, to):
    for key in place[:-1]:
        data = data[key]
    data[place[-1]] = to


@pytest.mark.parametrize(
    ("place", "to", "said"),
    [
        (("modes",), None, "modes"),
        (("modes", 0, "count"), 0, "modes.0.count"),
        (("modes", 0, "harm"), 1.5, "modes.0.harm"),
        (("modes", 0, "number"), 2, "modes must be numbered"),
        (("modes", 0, "worst"), 300, "evaluation 300 must be one of the run's"),
        (("modes", 0, "cause"), "fate", "modes.0.cause"),
        (("modes", 0, "examples"), list(range(21)), "modes.0.examples"),
        (("modes", 0, "surplus"), 1, "modes.0.surplus"),
        (("neighbourhoods", 0, "harmful"), "32", "neighbourhoods.0.harmful"),
        (("neighbourhoods", 0, "fixes", 0, "drop"), 2.0, "neighbourhoods.0.fixes.0.drop"),
        (("bound", "harmful"), 0, "modes must not hold more rows than are harmful"),
        (("schema_version",), 2, "schema_version"),
    ],
)
def test_a_damaged_record_is_one_clear_error(found, tmp_path, place, to, said):
    path = write_record(tmp_path, found)
    data = json.loads(path.read_text("utf-8"))
    changed(data, *place, to=to)
    path.write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(FileFormatError) as error:
        read_record(path)
    (problem,) = error.value.problems
    assert said in problem
    assert str(path) in problem
    assert "bridgegen resume" in problem


def test_fresh_rows_are_those_of_the_share(space, world, fixed, tmp_path):
    pipeline = world(space, planted, fixed, fails=lambda v: v["bv_start"] <= 9.0)
    record = triage(pipeline, pipeline.rows(100), algorithm="pso", seed=0, keep=2).record
    path = write_record(tmp_path, record)
    assert read_record(path) == record
    assert 0 < record.fresh.harm.count(None) == len(record.fresh.harm) - record.bound.space.rows
    data = json.loads(path.read_text("utf-8"))
    at = next(k for k, one in enumerate(record.fresh.harm) if one is not None and one < 0.3)
    changed(data, "fresh", "harm", at, to=0.9)
    path.write_text(json.dumps(data), encoding="utf-8")
    with refuses(FileFormatError):
        read_record(path)


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"\xff", b"[" * 10_000, b"{}"])
def test_what_is_no_record_is_refused(tmp_path, data):
    path = tmp_path / JSON_FILE
    path.write_bytes(data)
    with pytest.raises(FileFormatError):
        read_record(path)


def test_a_record_of_other_evaluations_is_refused(found, tmp_path):
    path = write_record(tmp_path, found)
    with pytest.raises(FileFormatError, match="other evaluations"):
        read_record(path, "others")


def test_what_cannot_be_read_is_told(tmp_path):
    (tmp_path / JSON_FILE).mkdir()
    with refuses(StorageError):
        read_record(tmp_path / JSON_FILE)
