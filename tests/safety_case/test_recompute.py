"""The script that recomputes a case: right by scipy, independent of BridgeGen, hard to fool."""

import ast
import json
import sqlite3
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, binomtest

from bridgegen.jobs.safety_case import recompute

pytestmark = pytest.mark.thorough


@st.composite
def counts(draw):
    n = draw(st.integers(1, 5000))
    return draw(st.integers(0, n)), n


@given(counts(), st.sampled_from([0.5, 0.9, 0.95, 0.999]))
def test_bounds_are_scipy_s(kn, confidence):
    k, n = kn
    expected = binomtest(k, n).proportion_ci(confidence, "exact")
    found = [recompute.bound(k, n, upper, confidence) for upper in (False, True)]
    assert found == pytest.approx([expected.low, expected.high], rel=1e-8, abs=1e-12)


@pytest.mark.parametrize("k", [0, 1, 17, 500_000, 999_999, 1_000_000])
def test_bounds_of_long_runs_are_scipy_s(k):
    expected = binomtest(k, 10**6).proportion_ci(0.95, "exact")
    found = [recompute.bound(k, 10**6, upper, 0.95) for upper in (False, True)]
    assert found == pytest.approx([expected.low, expected.high], rel=1e-7)


def test_no_failure_in_1000_draws_leaves_at_most_0369_per_cent():
    """By hand: (1 - p) ** 1000 = 0.025."""
    assert recompute.bound(0, 1000, True, 0.95) == pytest.approx(1.0 - 0.025**0.001, rel=1e-12)
    assert recompute.written(1.0 - 0.025**0.001, "percent_up") == "0.369 %"


@given(counts(), st.floats(1e-6, 1.0 - 1e-6))
def test_the_tail_is_scipy_s(kn, p):
    k, n = max(kn[0], 1), kn[1]
    assert recompute.tail(k, n, p) == pytest.approx(binom.sf(k - 1, n, p), rel=1e-7, abs=1e-12)


def test_it_needs_the_standard_library_alone():
    tree = ast.parse(Path(recompute.__file__).read_text("utf-8"))
    names = {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
    names |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {one.partition(".")[0] for one in names} <= {*sys.stdlib_module_names}


@pytest.mark.parametrize("name", ["fails", "unlucky", "clean", "judged", "all"])
def test_it_agrees_and_says_what_it_cannot_recompute(cases, checked, name):
    assert checked(cases[name].folder) == (0, [], "")
    rest = {one.id.partition(".")[2] for one in cases[name].case.numbers if not one.source}
    assert rest <= {"bins_feasible", "pairs_feasible"}


def number(data, name):
    return next(one for one in data["numbers"] if one["id"] == f"R1.{name}")


def element(data, name):
    return next(one for one in data["elements"] if one["id"] == name)


def no_failures(data):
    """As one who dresses it up would: the number, its text, and the sentence."""
    number(data, "harmful").update(value=0, text="0")
    one = element(data, "CG1.3")["statement"]
    texts = {each["id"]: each["text"] for each in data["numbers"]}
    text = one["template"]
    for key, value in texts.items():
        text = text.replace("{" + key + "}", value)
    one["text"] = text


CHANGES = {
    "a value": (lambda d: number(d, "harmful").update(value=0), "R1.harmful"),
    "a bound": (lambda d: number(d, "share_high").update(value=1e-6), "R1.share_high"),
    "how a number is written": (
        lambda d: number(d, "share_high").update(text="0.001 %"), "R1.share_high",
    ),
    "a number, its text and its sentence": (no_failures, "R1.harmful"),
    "a sentence": (
        lambda d: element(d, "CG1.3")["statement"].update(text="It never fails."), "text of CG1.3",
    ),
    "a status": (lambda d: element(d, "G1").update(status="supported"), "status of G1"),
    "a digest": (lambda d: d["evidence"][0].update(sha256="0" * 64), "SHA-256 ../run.sqlite"),
    "a mode's title": (lambda d: number(d, "title1").update(value="is safe"), "R1.title1"),
    "the confidence": (lambda d: d.update(confidence=0.5), "R1.share_high"),
}  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_case_is_told(case, checked, edited, change):
    found = case("fails")
    edit, place = CHANGES[change]
    edited(found.file, edit)
    code, lines, errors = checked(found.folder)
    assert (code, errors) == (1, "")
    assert [line for line in lines if place in line]


def test_a_goal_stays_defeated_without_its_counter_argument(case, checked, edited):
    """Its own condition says that there are failures."""
    found = case("fails")

    def dressed_up(data):
        data["relations"] = [one for one in data["relations"] if one["kind"] != "Challenges"]
        for one in data["elements"]:
            if one["id"] in ("G1", "G1.3"):
                one["status"] = "incomplete"

    edited(found.file, dressed_up)
    lines = checked(found.folder)[1]
    assert [line.split()[3] for line in lines] == ["G1", "G1.3"]


@pytest.mark.parametrize(
    ("sql", "told"),
    [
        ("UPDATE evaluations SET harm = 0 WHERE harm >= 0.3 AND id > 100", "R1.harmful"),
        ("UPDATE evaluations SET critical = 0", "R1.critical"),
        ("UPDATE evaluations SET status = 3 WHERE id = 0", "R1.failed"),
        ("UPDATE evaluations SET d_min = -1 WHERE id = 7", "R1.d_min"),
        ("UPDATE evaluations SET bv_speed = 0", "R1.bins_evaluated"),
        ("DELETE FROM evaluations WHERE id = 199", "R1.evaluations"),
    ],
)
def test_a_changed_row_is_told(case, checked, sql, told):
    found = case("fails")
    with sqlite3.connect(found.folder.parent / "run.sqlite") as connection:
        connection.execute(sql)
    connection.close()
    code, lines, _ = checked(found.folder)
    assert code == 1
    assert "SHA-256" in lines[0]
    assert [line for line in lines if told in line]


def test_a_changed_margin_is_told(case, checked):
    found = case("judged")
    with sqlite3.connect(found.folder.parent / "run.sqlite") as connection:
        connection.execute('UPDATE evaluations SET "criterion:R-12" = 1')
    connection.close()
    lines = checked(found.folder)[1]
    for name in ("violated:R-12", "met:R-12", "worst:R-12", "worst_at:R-12"):
        assert [line for line in lines if f"R1.{name} " in line], name


def test_changed_draws_are_told(case, checked, edited):
    found = case("fails")

    def harmless(data):
        data["fresh"]["harm"] = [0.0] * len(data["fresh"]["harm"])

    edited(found.folder.parent / "triage.json", harmless)
    lines = checked(found.folder)[1]
    for name in ("drawn_harmful", "share", "share_low", "share_high"):
        assert [line for line in lines if f"R1.{name} " in line], name


def test_what_cannot_be_read_is_one_line(case, checked):
    found = case("clean")
    (found.folder.parent / "triage.json").unlink()
    code, _, errors = checked(found.folder)
    assert code == 2
    assert errors.count("\n") == 1
    assert "triage.json" in errors
    found.file.write_text("{}", "utf-8")
    assert checked(found.folder)[0] == 2
    found.file.unlink()
    assert checked(found.folder)[0] == 2


def test_a_case_moves_with_its_run(case, checked, tmp_path):
    found = case("clean")
    found.folder.parent.rename(tmp_path / "elsewhere")
    assert checked(tmp_path / "elsewhere" / "safety-case")[0] == 0


def test_the_numbers_are_those_of_the_rows(cases, made):
    """By pandas, from the run's data frame."""
    import bridgegen as bg

    frame = bg.Run(made["fails"]).frame()
    data = json.loads(cases["fails"].file.read_text("utf-8"))
    fit = (frame["status"] == 0) & frame["implausible"].isna()
    harmful = fit & (frame["harm"] >= 0.3)
    assert harmful.sum() > 0
    for name, value in {
        "evaluations": 200,
        "harmful": harmful.sum(),
        "critical": frame["critical"].sum(),
        "collisions": (frame["n_collision"] > 0).sum(),
        "not_preventable": (fit & (frame["n_collision"] > 0) & (frame["harm"] < 0.3)).sum(),
        "d_min": frame["d_min"].min(),
        "harm1": frame["harm"].max(),
    }.items():
        assert number(data, name)["value"] == value, name
    ways = frame[harmful].groupby(["conflict", "conflict_type", "responsible", "rule"]).size()
    counts = [one["value"] for one in data["numbers"] if one["id"].startswith("R1.way")]
    assert sorted(counts) == sorted(ways.tolist())
