import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bridgegen.pages.data import Column
from bridgegen.pages.payload import payload, to_json
from bridgegen.pages.playback_payload import SCALE
from bridgegen.pages.series import decimals, significant, unpacked

HOSTILE = [
    "</script><script>window.hacked = 1</script>", "<!-- <script>", "\"'`\\", "\u2028\u2029\x00",
    "Kreuzung Süd 交差点 🚗", "\udcff", "%{x}", "{{data}}", "&lt;b&gt;", "__proto__",
]  # fmt: skip


def read(text: str):
    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is not JSON")

    return json.loads(text, parse_constant=refuse)


def test_round_trip(report):
    data = read(to_json(report))
    assert data == json.loads(json.dumps(payload(report)))
    e = report.evaluations
    assert data["rows"]["critical"] == e.critical.astype(int).tolist()
    assert [c["name"] for c in data["rows"]["columns"]] == [c.name for c in e.columns]
    for sent, column in zip(data["rows"]["columns"], e.columns, strict=True):
        finite = np.isfinite(column.values)
        assert [v is not None for v in sent["values"]] == finite.tolist()
        got = np.array([v for v in sent["values"] if v is not None])
        top = np.abs(column.values[finite]).max()
        assert got == pytest.approx(column.values[finite], abs=1e-4 * top)
        assert sent["unit"] == column.unit


def test_a_playback_comes_back_to_the_millimetre_and_no_longer_than_it_ran(report):
    data = read(to_json(report))
    for sent, p in zip(data["kept"], report.kept, strict=True):
        for name in "xyhv":
            for runs, row in zip(sent["series"][name], getattr(p, name), strict=True):
                got = unpacked(runs, p.n_steps, SCALE[name])
                assert got == pytest.approx(row[: p.n_steps], abs=5.01e-4)
        distance = unpacked(sent["series"]["distance"], p.n_steps, SCALE["distance"])
        assert distance == pytest.approx(p.distance[: p.n_steps], abs=5.01e-4)
        assert sent["metrics"] == {  # each to the last bit
            name: value if math.isfinite(value) else None for name, value in p.metrics.items()
        }
        assert sent["parameters"] == dict(p.parameters)


def test_a_road_shared_by_playbacks_is_held_once(report):
    assert len(payload(report)["roads"]) == 1
    other = replace(report.kept[0], lanes=report.kept[0].lanes[:-1])
    data = payload(replace(report, kept=(*report.kept, other)))
    assert len(data["roads"]) == 2
    assert [kept["road"] for kept in data["kept"]] == [0, 0, 0, 0, 1]


def test_contacts_and_the_smallest_gap_are_found_before_rounding(report):
    distance = np.full(401, 5.0)
    distance[[50, 51, 90]] = [0.0, 0.0, 0.0]
    distance[70] = 1e-4  # rounds to zero, and is a miss
    p = replace(report.kept[0], distance=distance, n_steps=401)
    sent = payload(replace(report, kept=(p,)))["kept"][0]
    assert sent["contacts"] == [50, 90]
    assert sent["closest"] == 50
    assert unpacked(sent["series"]["distance"], 401, SCALE["distance"])[70] == 0.0


def test_an_entity_alone_has_no_smallest_gap(report):
    p = report.kept[0]
    alone = replace(
        p, entities=p.entities[:1], x=p.x[:1], y=p.y[:1], h=p.h[:1], v=p.v[:1],
        distance=np.full(401, np.inf),
    )  # fmt: skip
    sent = payload(replace(report, kept=(alone,)))["kept"][0]
    assert sent["closest"] is None
    assert sent["contacts"] == []
    assert sent["series"]["distance"] == []


def test_failed_rows_are_counted_but_not_drawn(report):
    e = report.evaluations
    status = e.status.copy()
    status[[3, 5]] = 1
    data = payload(replace(report, evaluations=replace(e, status=status)))
    rows = data["rows"]
    assert (rows["n"], rows["n_failed"]) == (120, 2)
    assert 3 not in rows["evaluation"]
    assert len(rows["evaluation"]) == len(rows["columns"][0]["values"]) == 118


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_text_stays_text(report, text):
    e = report.evaluations
    p = report.kept[0]
    columns = (replace(e.parameters[0], name=text, unit=text, description=text), *e.parameters[1:])
    data = replace(
        report,
        summary=replace(report.summary, title=text, command=text, settings={text: text}),
        evaluations=replace(e, parameters=columns),
        kept=(replace(p, name=text, parameters={text: 1.0}, metrics={text: 2.0}, files=(text,)),),
    )
    sent = to_json(data)
    assert "<" not in sent
    assert sent.isascii()
    back = read(sent)
    assert back["summary"]["title"] == back["summary"]["command"] == text
    assert [text, text] in back["summary"]["provenance"]
    assert back["kept"][0]["parameters"] == {text: 1.0}
    assert back["rows"]["columns"][0]["name"] == text


def test_numpy_scalars_are_taken(report):
    p = replace(
        report.kept[0], rank=np.int64(1), evaluation=np.int64(3), critical=np.bool_(True),
        time_step=np.float64(0.05), parameters={"bv_speed": np.float64(1.5)},
    )  # fmt: skip
    sent = read(to_json(replace(report, kept=(p,))))["kept"][0]
    assert (sent["rank"], sent["evaluation"], sent["critical"]) == (1, 3, True)


numbers = arrays(np.float64, st.integers(0, 30), elements=st.floats(width=64))


@given(numbers, st.integers(0, 6))
def test_rounding_is_to_half_a_place_and_null_is_what_is_not_finite(values, places):
    sent = read(json.dumps(decimals(values, places), allow_nan=False))
    for value, got in zip(values.tolist(), sent, strict=True):
        assert (got is None) == (not math.isfinite(value))
        if got is not None:
            assert abs(got - value) <= 0.5000001 * 10.0**-places + 4e-16 * abs(value)
            assert math.copysign(1.0, got) == 1.0 or got < 0.0


@given(numbers)
def test_five_digits_of_the_largest_are_kept(values):
    sent = significant(values)
    finite = values[np.isfinite(values)]
    top = np.abs(finite).max() if finite.size else 0.0
    for value, got in zip(values.tolist(), sent, strict=True):
        assert (got is None) == (not math.isfinite(value))
        if got is not None:
            assert abs(got - value) <= 1e-4 * top + 1e-300


def test_a_column_without_a_number_is_all_null(report):
    e = report.evaluations
    empty = Column("ttc2", "s", np.full(120, np.nan))
    data = payload(replace(report, evaluations=replace(e, metrics=(*e.metrics, empty))))
    column = next(c for c in data["rows"]["columns"] if c["name"] == "ttc2")
    assert set(column["values"]) == {None}
