"""Criteria of a scenario: what is refused, and margins of rollouts."""

import numpy as np
import pytest
from tests.approval import approve, refuses
from tests.metrics.conftest import drive_around, make_rollout

from bridgegen.assess.criteria import Monitor, evaluate, quantity
from bridgegen.assess.criteria.monitor import LARGEST
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.criteria import (
    Criterion,
    in_words,
    joined,
    read_criteria,
    read_criterion,
)

HELD = ("lights", "offset")


def monitor(*formulas, entities=("ego", "bv1"), duration=20.0):
    criteria = [Criterion(f"C{i}", one) for i, one in enumerate(formulas)]
    return Monitor(criteria, entities, HELD, duration, "the driver 'x'")


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("tcc > 1", "tcc"),
        ("always(ego.w > 1)", "signal"),
        ("always(ego.gap > 1)", "signal"),
        ("always(v to bv1 > 1)", "signal"),
        ("always(gap to bv2 > 1)", "bv2"),
        ("always(gap to ego > 1)", "ego"),
        ("always(lorry.v > 1)", "lorry"),
        ("always(ego.v > 2 m)", "different"),
        ("ttc > 2 km/h", "different"),
        ("iou > 0.5", "iou"),
        ("always[0, 30](ego.v > 1)", "30 s"),
    ],
)
def test_what_a_scenario_does_not_have_is_refused(formula, message):
    with refuses(InputError, message):
        monitor(formula)


def test_all_problems_come_at_once():
    with pytest.raises(InputError) as refused:
        monitor("always(ego.w > 1)", "tcc > 1 and always(xy.v > 1)")
    assert len(refused.value.problems) == 3


def test_margins_by_hand():
    # The ego brakes from 10 to 7 m/s; the gap closes from 6 to 3 m.
    rollout = make_rollout(
        x=[[[0.0, 1.0, 2.0, 3.0], [10.0] * 4]], v=[[[10.0, 9.0, 8.0, 7.0], [0.0] * 4]],
        n_steps=[4],
    )  # fmt: skip
    found = monitor(
        "min(gap to bv1) > 2 m",
        "always(gap to bv1 > 4)",
        "d_min >= 3 m",
        "eventually[0.1, 0.1](ego.v < 8.5)",
        "always[1, 2](ego.v > 0)",
        "n_collision == 0",
        'last("ego".v) == 7',
    )
    expected = [1.0, -1.0, 0.0, 0.5, LARGEST, 0.0, 0.0]
    margins = found.margins(rollout)[0]
    assert margins == pytest.approx(expected, abs=1e-12)
    assert (margins > 0.0).tolist() == [True, False, True, True, True, True, True]
    assert found.units == ("m", "m", "m", "m/s", "m/s", "1", "m/s")


def test_a_row_s_margins_do_not_depend_on_other_rows():
    rollout = drive_around()
    found = monitor(
        "always(ego.v > 1 implies gap to any > 1)", "min(ttc to bv2) > 1 while ego.v > 3",
        "eventually[0.2, 1](ego.a < 1) or max(abs(bv1.yaw_rate)) < 0.5", "ttc > 1",
        entities=rollout.names, duration=2.45,
    )  # fmt: skip
    whole = found.margins(rollout)
    for i in range(rollout.shape[0]):
        assert found.margins(rollout.take(np.array([i]))).tobytes() == whole[i : i + 1].tobytes()


def test_a_failed_scenario_has_no_margin():
    rollout = make_rollout(x=[[[0.0], [9.0]], [[0.0], [9.0]]], status=[0, 1])
    found = monitor("ttc > 1", "always(gap to bv1 > 1)")
    margins = found.margins(rollout)
    assert np.isnan(margins).tolist() == [[False, False], [True, True]]
    assert [one.verdict for one in found.results(rollout, 1)] == ["unknown", "unknown"]
    assert [one.verdict for one in found.results(rollout, 0)] == ["met", "met"]


def test_margins_are_quantities_beside_metrics():
    rollout = make_rollout(x=[[[0.0], [9.0]]])
    found = monitor("always(gap to bv1 > 1)")
    both = evaluate(rollout, ["criterion:C0", "d_min"], found)
    assert both.tolist() == [[4.0, 5.0]]
    assert (quantity("criterion:C0").sense, quantity("criterion:C0").cap) == ("smaller", LARGEST)
    assert quantity("d_min").unit == "m"


# -- declarations ----------------------------------------------------------------------------------


def test_texts_and_files(tmp_path):
    path = tmp_path / "criteria.yaml"
    path.write_text(
        "criteria:\n- {id: A, formula: ttc > 1, text: 'Keep away: always', tags: [x-1]}\n"
    )
    found = read_criteria([str(path), "B.2: n_collision == 0", "{id: C, formula: ttc > 2}"])
    assert [one.id for one in found] == ["A", "B.2", "C"]
    assert (found[0].text, found[0].tags, found[0].severity) == (
        "Keep away: always",
        ("x-1",),
        "major",
    )
    assert read_criteria([in_words(one) for one in found]) == found
    assert tuple(read_criterion(one.to_dict()) for one in found) == found


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["ttc > 1"], "--criterion"),
        (["a b: ttc > 1"], "a b"),
        (["R: "], "--criterion"),
        (
            ["R: ttc >"],
            "--criterion",
        ),
        (["R: ttc > 1", "R: ttc > 2"], "R"),
        (["{id: R}"], "formula"),
        (["{id: R, formula: ttc > 1, severity: huge}"], "minor"),
        (["{id: R, formula: ttc > 1, colour: red}"], "colour"),
        (["nowhere.yaml"], "such"),
    ],
)
def test_what_is_no_criterion(texts, message):
    with refuses(InputError, message):
        read_criteria(texts)


def test_a_file_s_problems_have_lines(tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text(
        "criteria:\n- {id: A, formula: ttc > 1}\n- {id: A, formula: ttc > 2}\n"
        "- {id: B, formula: 'ttc >'}\n- {id: C}\n"
    )
    with pytest.raises(InputError) as refused:
        read_criteria([str(path)])
    problems = "\n".join(refused.value.problems)
    assert "'A' occurs twice" in problems
    assert "line 3" in problems
    approve(problems, "criterion", "line 4", "formula", "line 5")


def test_the_same_said_twice_is_one():
    one, other = Criterion("A", "ttc > 1"), Criterion("A", "ttc > 2")
    assert joined([one], [Criterion("A", "ttc > 1", place="elsewhere")]) == (one,)
    with pytest.raises(InputError, match="'A' occurs twice"):
        joined([one], [other])


def test_a_package_adds_its_own(monkeypatch):
    from importlib.metadata import EntryPoint, EntryPoints

    points = [
        EntryPoint(name, f"{__name__}:{value}", "bridgegen.criteria")
        for name, value in {"ours": "OURS", "one": "ONE", "none": "HELD"}.items()
    ]

    def entry_points(**which):
        return EntryPoints(points if which.get("group") == "bridgegen.criteria" else [])

    monkeypatch.setattr("importlib.metadata.entry_points", entry_points)
    assert [one.id for one in read_criteria(["ours", "B: ttc > 1"])] == ["P-1", "P-2", "B"]
    assert read_criteria(["one"]) == (ONE,)
    with refuses(InputError):
        read_criteria(["none"])
    with refuses(InputError, "--criterion"):
        read_criteria(["ourz"])


ONE = Criterion("P-1", "ttc > 1")
OURS = [ONE, Criterion("P-2", "always(ego.v < 50 km/h)")]
