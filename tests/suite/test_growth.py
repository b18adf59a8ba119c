"""A suite that grows: each failure mode once, with its minimal form, if it fails there, too."""

import json
import shutil

import pytest
from tests.approval import approve, refuses
from tests.campaign.braking import USUAL, value_sets, write_pair

import bridgegen as bg
from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.cli.verdict.of_suite import SuiteCriteria, figures_of
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.suite import growth
from bridgegen.jobs.suite.growth import add_failures
from bridgegen.jobs.suite.results import counts
from bridgegen.jobs.suite.suite import evaluate_suite
from bridgegen.results.failures import FILE, read_failures

FAST = "R-1: always(ego.v < 13 m/s)"
"""A rule that faster scenarios violate."""

BLIND = """
import numpy as np
from bridgegen.drivers.interface import Control

class Blind:
    def reset(self, n, scene):
        pass

    def act(self, observation):
        return Control(np.zeros_like(observation.v), np.zeros_like(observation.v))
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "s4"
    return bg.run_search(
        "crossroads-s2", algorithm="random", budget=300, seed=5, ego="route-follower", keep=1,
        objective={"harm": None}, out=place, criteria=[FAST],
    )  # fmt: skip


@pytest.fixture
def copied(run, tmp_path):
    """A copy of the run, whose files a test may change."""
    return shutil.copytree(run.folder, tmp_path / "run")


def bytes_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def outcomes(made):
    return [one.outcome for one in made]


def test_each_mode_is_kept_once_and_fails_there_to_the_bit(run, tmp_path):
    to = tmp_path / "mine"
    made = add_failures([run.folder], to)
    failures = read_failures(to).failures
    assert outcomes(made) == ["added"] * len(run.modes)
    assert all(one.is_same and not one.reason for one in made)
    assert {one.id for one in made} == failures.keys()
    assert {bool(mode.exports) for mode in run.modes} == {True, False}
    for mode in run.modes:
        (kept,) = [one for one in failures.values() if one.responsible == mode.responsible]
        assert (kept.partner, kept.place, kept.scenario) == ("car", mode.place, "crossroads-s2")
        assert (kept.status, kept.driver, kept.seed) == ("new", "route-follower", 5)
        assert (kept.cause, kept.minimal) == (mode.cause, mode.minimal.sentence)
        again = [simulate_file(to / name).metrics for name in kept.files]  # without the suite
        assert again[-1]["harm"] == mode.minimal.harm
        assert (kept.harm, kept.severity) == (again[0]["harm"], again[0]["severity"])
        if mode.exports:
            path = run.folder / "critical" / f"{mode.exports[0]}.json"
            recorded = json.loads(path.read_text("utf-8"))["metrics"]
            for name in ("harm", "severity", "d_min"):
                assert again[0][name] == recorded[name]["value"]
        assert len(again) == 1 + bool(mode.exports)  # else its minimal form alone was exported
    names = {name for one in failures.values() for name in one.files}
    maps = {name.replace(".xosc", ".xodr") for name in names}
    assert {path.name for path in to.iterdir()} == {FILE, *names, *maps}


def test_adding_again_changes_no_byte(run, tmp_path):
    to = tmp_path / "mine"
    add_failures([run.folder], to)
    before = bytes_of(to)
    made = add_failures([run.folder, run.folder / "critical" / "0001.xosc"], to)
    assert {*outcomes(made)} == {"known"}
    assert bytes_of(to) == before


def test_a_suite_of_kept_failures_adds_none(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    add_failures([run.folder], tmp_path / "suites" / "mine")
    suite = evaluate_suite("suites/mine", workers=1)
    assert suite.folder.name == "mine-results"  # beside the scenarios, not among them
    assert {one.verdict for one in suite.results} == {"failed"}
    made = add_failures([suite.folder], tmp_path / "suites" / "mine")
    assert {*outcomes(made)} == {"known"}
    with pytest.raises(StorageError, match="holds results"):
        add_failures([run.folder], suite.folder)


def test_a_worse_one_replaces_only_when_asked(run, tmp_path):
    to = tmp_path / "mine"
    add_failures([run.folder / "critical" / "0001.xosc"], to)
    path = to / FILE
    text = path.read_text("utf-8")
    (old,) = read_failures(to).failures.values()
    milder = text.replace(f"harm: {old.harm}", "harm: 0.31").replace("status: new", "status: known")
    path.write_text(milder.replace('comment: ""', "comment: mine"), "utf-8")
    before = bytes_of(to)
    assert outcomes(add_failures([run.folder / "critical" / "0001.xosc"], to)) == ["worse"]
    assert bytes_of(to) == before
    made = add_failures([run.folder / "critical" / "0001.xosc"], to, replace_worse=True)
    assert outcomes(made) == ["replaced"]
    (new,) = read_failures(to).failures.values()
    assert (new.harm, new.status, new.comment) == (old.harm, "known", "mine")


def test_what_does_not_fail_there_is_refused_and_named(copied, tmp_path):
    path = copied / "critical" / "0001.xosc"
    text = path.read_text("utf-8")
    still = text.replace(
        '<ParameterDeclaration name="bv_speed" parameterType="double" value="',
        '<ParameterDeclaration name="bv_speed" parameterType="double" value="0',
    )
    assert still != text
    start = still.index('name="bv_speed" parameterType="double" value="') + 46
    path.write_text(still[:start] + "0.5" + still[still.index('"', start) :], "utf-8")
    made = add_failures([path], tmp_path / "mine")
    assert outcomes(made) == ["refused"]
    assert "0001" in made[0].source
    approve(made[0].reason, "failure")
    assert not (tmp_path / "mine" / FILE).exists()


def test_what_fails_otherwise_than_it_was_found_is_refused(copied, tmp_path):
    path = copied / "triage.json"
    data = json.loads(path.read_text("utf-8"))
    places = [one["place"] for one in data["modes"]]
    data["modes"][0]["place"] = "between junctions"
    path.write_text(json.dumps(data), "utf-8")
    made = add_failures([copied], tmp_path / "mine")
    assert outcomes(made) == ["refused", *["added"] * (len(places) - 1)]
    approve(made[0].reason)


def test_what_fails_otherwise_in_its_new_place_is_refused(run, tmp_path, monkeypatch):
    """As if the export wrote another scenario: first the worst, then the minimal form."""
    write, source = growth.write_scenario, run.folder / "critical"
    wrong = ""

    def written(pipeline, x, folder, name, cause):
        files = write(pipeline, x, folder, name, cause)
        if name.endswith("-minimal") == (wrong == "minimal"):
            text = (source / "minimal-02.xosc").read_text("utf-8")
            (folder / f"{name}.xosc").write_text(text.replace("minimal-02.xodr", f"{name}.xodr"))
            shutil.copy(source / "minimal-02.xodr", folder / f"{name}.xodr")
        return files

    monkeypatch.setattr(growth, "write_scenario", written)
    (made,) = add_failures([source / "0001.xosc"], tmp_path / "mine")
    assert made.outcome == "refused"
    assert f"fails otherwise in {tmp_path / 'mine'}: responsible" in made.reason
    assert [*(tmp_path / "mine").iterdir()] == []
    wrong = "minimal"
    (made,) = add_failures([source / "0001.xosc"], tmp_path / "mine")
    assert (made.outcome, made.is_same) == ("added", True)
    approve(made.reason, "otherwise")
    assert [one.suffix for one in sorted((tmp_path / "mine").iterdir())] == [
        ".xodr", ".xosc", ".yaml",
    ]  # fmt: skip


def test_the_worst_variation_of_a_suite_is_kept_and_its_criterion_judges_there(tmp_path):
    made = tmp_path / "files"
    write_pair(made, value_sets(
        {"EgoSpeed": 8, "Gap": 100}, {"EgoSpeed": 12, "Gap": 15},
        {"EgoSpeed": 14.123456789012345, "Gap": 25},
    ))  # fmt: skip
    suite = evaluate_suite(
        made, egos=["route-follower", "reference"], criteria=[FAST],
        out=tmp_path / "out", workers=1,
    )  # fmt: skip
    follower, reference = suite.results
    assert [row.critical for row in follower.rows] == [False, True, True]
    assert [row.critical for row in reference.rows] == [False, False, False]
    assert [row.verdict for row in reference.rows] == ["passed", "passed", "failed"]
    to = tmp_path / "mine"
    add_failures([suite.folder], to)
    by_conflict = {one.conflict: one for one in read_failures(to).failures.values()}
    assert {*by_conflict} == {"contact", ""}
    assert by_conflict[""].title == "violates R-1"
    assert by_conflict[""].driver == "reference"
    assert by_conflict[""].criteria == [{"id": "R-1", "formula": "always(ego.v < 13 m/s)"}]
    assert by_conflict["contact"].harm == max(row.harm for row in follower.rows)
    again = evaluate_suite(to, out=tmp_path / "again", workers=1)  # without the option
    assert figures_of(again)["criterion:R-1"] == 2
    assert counts(again.results) == {
        "passed": 0, "failed": 2, "not judged": 0, "not run": 0, "flaky": 0,
    }  # fmt: skip


def test_only_new_failures_stop_a_suite(run, tmp_path):
    to = tmp_path / "mine"
    add_failures([run.folder / "critical" / "0001.xosc"], to)
    path, text = to / FILE, (to / FILE).read_text("utf-8")

    def judged(status):
        path.write_text(text.replace("status: new", f"status: {status}"), "utf-8")
        suite = evaluate_suite(to, out=tmp_path / "out", workers=1)
        xml = tmp_path / "junit.xml"
        (outcome,) = SuiteCriteria.read((), xml).judge(suite)
        figures = figures_of(suite)
        counted = tuple(figures[name] for name in ("known", "new_failures", "regressions"))
        assert figures["failed"] == sum(counted) == len(suite.results)
        return outcome, counted, xml.read_text("utf-8")

    outcome, (_, n, _), xml = judged("new")
    assert (outcome.verdict, n > 0) == ("failed", True)
    assert xml.count("<failure") == n
    assert "the first again: bridgegen suite replay" in xml
    for status in ("known", "accepted"):
        outcome, counted, xml = judged(status)
        assert (outcome.verdict, counted) == ("passed", (n, 0, 0))
        assert (xml.count("<failure"), xml.count("<skipped")) == (0, n)
        assert f"{status} failure" in xml
    outcome, counted, xml = judged("fixed")
    assert (outcome.verdict, counted) == ("failed", (0, 0, n))
    approve(outcome.details, "fixed")
    assert "regression, this failure was fixed" in xml


def test_violations_that_make_a_scenario_critical_are_kept_by_their_criterion(tmp_path):
    write_pair(tmp_path / "files", value_sets({"EgoSpeed": 14, "Gap": 60}))
    options = {"criteria": [FAST], "critical": "criterion:R-1"}
    suite = evaluate_suite(
        tmp_path / "files", egos=["reference"], **options, out=tmp_path / "out", workers=1
    )
    assert suite.results[0].rows[0].critical
    (made,) = add_failures([suite.folder], tmp_path / "mine")
    assert (made.outcome, made.title) == ("added", "violates R-1")
    assert (
        evaluate_suite(tmp_path / "mine", out=tmp_path / "o", workers=1).results[0].verdict
        == "failed"
    )


def test_a_driver_is_that_of_the_run_and_code_is_named(run, tmp_path):
    with refuses(InputError, "reference", "route-follower"):
        add_failures([run.folder], tmp_path / "mine", egos=["reference"])
    scenario, _ = write_pair(tmp_path / "files", value_sets({"EgoSpeed": 14, "Gap": 20}))
    driver = tmp_path / "blind.py"
    driver.write_text(BLIND)
    ego = f"{driver}:Blind"
    suite = evaluate_suite(scenario, egos=[ego], out=tmp_path / "out", workers=1)
    assert suite.results[0].verdict == "failed"
    with refuses(InputError):
        add_failures([suite.folder], tmp_path / "mine")
    with pytest.raises(UnknownNameError, match="unknown driver"):
        add_failures([suite.folder], tmp_path / "mine", egos=["reference"])
    (made,) = add_failures([suite.folder], tmp_path / "mine", egos=[ego])
    assert (made.outcome, made.is_same) == ("added", True)
    (kept,) = read_failures(tmp_path / "mine").failures.values()
    assert kept.driver.startswith(str(driver))
    again = evaluate_suite(tmp_path / "mine", egos=[ego], out=tmp_path / "again", workers=1)
    assert again.results[0].rows[0].harm == suite.results[0].rows[0].harm


def test_what_a_catalogue_scenario_or_a_plain_file_does_is_said(tmp_path):
    scenario, _ = write_pair(tmp_path / "files", USUAL)
    made = add_failures([scenario], tmp_path / "mine", egos=["reference"])
    assert [(one.outcome, one.reason) for one in made] == [("refused", "no variation of it fails")]
    assert not (tmp_path / "mine").exists()
    with refuses(InputError):
        add_failures(["nowhere"], tmp_path / "mine")
    (tmp_path / "mine").mkdir()
    inside = shutil.copy(scenario, tmp_path / "mine")
    with refuses(InputError):
        add_failures([inside], tmp_path / "mine")


def test_the_command_prints_what_became_of_each(run, tmp_path, cli):
    to = tmp_path / "mine"
    code, out, err = cli("suite", "add", run.folder, "--to", to)
    n = len(run.modes)
    assert (code, err) == (0, "")
    approve(out, to, n, "recorded")
    path = to / FILE
    path.write_text(path.read_text("utf-8").replace("status: new", "status: fixed", 1), "utf-8")
    code, out, _ = cli("suite", "add", run.folder, "--to", to)
    approve(out, to, n)
    approve(" ".join(out.split()), "called")
    code, out, _ = cli("suite", "add", run.folder, "--to", to, "--json")
    facts = json.loads(out)
    assert [one["outcome"] for one in facts] == ["known"] * n
    assert sorted(one["status"] for one in facts) == ["fixed", *["new"] * (n - 1)]
    code, out, err = cli("suite", to, "--out", tmp_path / "out", "--workers", 1)
    assert code == 3
    (again,) = [one["id"] for one in facts if one["status"] == "fixed"]
    approve(out, again)
    approve(err, again)
    approve(out, "regression")
    path.write_text("failures: [1]\n")
    code, _, err = cli("suite", to, "--out", tmp_path / "out")
    assert (code, err.count("\n")) == (2, 1)
    approve(err, "failures")
