"""Records on disk: what is written is read, and nothing else is."""

import json
import tempfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError, StorageError
from bridgegen.results.confirmation.differences import (
    BoxSizes,
    Contact,
    EntityDivergence,
    EventTimes,
    LightTimes,
)
from bridgegen.results.confirmation.record import (
    Change,
    Course,
    Differences,
    Outcome,
    Record,
    Scenario,
    digest_of,
    file_name,
    read_record,
    read_records,
    write_record,
)
from bridgegen.scenario.language.thresholds import Thresholds

X, METRICS = np.arange(8.0).reshape(4, 2), np.array([[1.0, np.nan]] * 4)

HERE = Outcome(critical=True, d_min=0.0, v_d=3.25, n_collision=1.0, F=(1.5, None),
               contact=Contact(2.05, "bv"), ends=12.0)  # fmt: skip
THERE = Outcome(critical=False, d_min=None, v_d=0.0, n_collision=0.0, F=(2.0, 3.0), ends=11.0)
WHOLE = Scenario(
    evaluation=2,
    name="0001",
    row=digest_of(X[2], METRICS[2]),
    here=HERE,
    there=THERE,
    change=Change.between(HERE, THERE),
    differences=Differences(
        partings=(
            EntityDivergence("bv", 1.5, 0.6, 0.5, -0.3, 0.1, None, 1.0),
            EntityDivergence("van", 2.0, None, None, None, None, None, 2.0, "here"),
        ),
        events=(EventTimes("go", 1.0, None),),
        lights=(LightTimes("s", 1.0, 1, 4),),
        boxes=(BoxSizes("bv", (4.0, 2.0, 1.0), (4.5, 1.8, 1.2)),),
        only_there=("walker",),
    ),
    tracks=(Course(entity="bv", first=3, x=(1, None), y=(2, None), h=(-3, None)),),
    explanation="because",
)
FAILED = Scenario(evaluation=0, name=None, row=digest_of(X[0], METRICS[0]), here=HERE,
                  failure="no such road")  # fmt: skip
RECORD = Record(
    simulator="esmini",
    label="esmini 3.6",
    settings={"step": 0.01},
    reference="embedded",
    run="runs/s4",
    scenario="crossroads-s4",
    ego="route-follower",
    thresholds=Thresholds(),
    objectives=("d_min", "v_d"),
    scenarios=(WHOLE, FAILED),
)


def test_a_record_of_an_earlier_version_is_read(tmp_path):
    """Before harm there were thresholds alone, and no conflict in an outcome."""
    path = write_record(tmp_path, RECORD)
    facts = json.loads(path.read_text("utf-8"))
    new = ("harm", "severity", "conflict", "conflict_type", "responsible", "partner")
    for name in ("rule", "count"):
        del facts[name]
    for one in facts["scenarios"]:
        del one["robustness"]
        for place in ("here", "there"):
            for name in new if one[place] else ():
                del one[place][name]
        if one["change"]:
            del one["change"]["harm"]
    path.write_text(json.dumps(facts), "utf-8")
    assert read_record(path) == RECORD
    assert RECORD.rule == "thresholds"


def test_what_is_written_is_read(tmp_path):
    path = write_record(tmp_path, RECORD)
    assert path == tmp_path / "confirmation-esmini.json"
    assert read_record(path) == RECORD
    facts = json.loads(path.read_text("utf-8"))
    assert facts["parted_at"] == 0.5
    assert facts["scenarios"][0]["there"]["d_min"] is None
    assert [one.confirmed for one in RECORD.scenarios] == [False, None]


def test_several_simulators_lie_side_by_side(tmp_path):
    write_record(tmp_path, RECORD)
    write_record(tmp_path, RECORD.model_copy(update={"simulator": "carla", "scenarios": ()}))
    (tmp_path / "regions.json").write_text("{}")
    found = read_records(tmp_path, X, METRICS)
    assert [one.simulator for one in found] == ["carla", "esmini"]
    assert read_record(tmp_path / file_name("another")) is None


@pytest.mark.parametrize("change", [np.float64(1e-12), -1.0])
def test_another_run_s_record_is_refused(tmp_path, change):
    write_record(tmp_path, RECORD)
    other = X.copy()
    other[2, 0] += change
    with refuses(FileFormatError):
        read_records(tmp_path, other, METRICS)
    with refuses(FileFormatError):
        read_records(tmp_path, X[:2], METRICS[:2])


def changed(path, **changes):
    """The record with some values changed, by a path of keys joined by ``__``."""
    facts = json.loads(path.read_text("utf-8"))
    for where, value in changes.items():
        *parents, last = where.split("__")
        one = facts
        for key in parents:
            one = one[int(key)] if key.isdigit() else one[key]
        one[last] = value
    path.write_text(json.dumps(facts), "utf-8")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"simulator": "carla"}, "simulator is 'carla'"),
        ({"scenarios__0__evaluation": -1}, "scenarios.0.evaluation"),
        ({"scenarios__0__evaluation": True}, "scenarios.0.evaluation"),
        ({"scenarios__0__here__d_min": float("nan")}, "scenarios.0.here.d_min"),
        ({"scenarios__0__differences__partings__0__time": float("inf")}, "partings.0"),
        ({"scenarios__0__differences__partings__0__entity": 3}, "partings.0"),
        ({"scenarios__0__there": None}, "must be together"),
        ({"scenarios__0__tracks__0__y": [1]}, "x, y and h must be as many"),
        ({"scenarios__0__tracks__0__x": ["<b>", 1]}, "tracks.0.x.0"),
        ({"scenarios__1__failure": {}}, "scenarios.1.failure"),
        ({"thresholds": {"d_min_below": float("nan")}}, "thresholds"),
        ({"thresholds": {"d_min_above": 1.0}}, "thresholds"),
        ({"scenarios": 7}, "scenarios"),
        ({"more": 7}, "more"),
    ],
)
def test_what_is_something_else_is_refused(tmp_path, changes, said):
    path = write_record(tmp_path, RECORD)
    changed(path, **changes)
    with pytest.raises(FileFormatError) as error:
        read_record(path)
    assert said in str(error.value)
    approve(str(error.value), path)


@pytest.mark.parametrize("text", ["", "null", "[]", '"x"', "{", "\xff", "[" * 100_000, "\0"])
def test_what_is_no_record_is_refused(tmp_path, text):
    path = tmp_path / "confirmation-esmini.json"
    path.write_text(text, "latin-1")
    with refuses(FileFormatError):
        read_record(path)


def test_what_cannot_be_read_is_said(tmp_path):
    (tmp_path / "confirmation-esmini.json").mkdir()
    with refuses(StorageError):
        read_record(tmp_path / "confirmation-esmini.json")


@given(st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.binary(max_size=3)), min_size=1))
def test_a_damaged_record_is_read_or_refused(damage):
    with tempfile.TemporaryDirectory() as folder:
        path = write_record(Path(folder), RECORD)
        text = bytearray(path.read_bytes())
        for where, data in damage:
            at = int(where * len(text))
            text[at : at + 1] = data
        path.write_bytes(text)
        with suppress(FileFormatError):
            found = read_records(Path(folder), X, METRICS)
            assert all(one.simulator == "esmini" for one in found)
