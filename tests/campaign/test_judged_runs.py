"""Runs that are judged by pass criteria: what they record, export and say, and how they resume."""

import html
import json
import re
import sqlite3
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, Interrupted, UnknownNameError
from bridgegen.cli.verdict.of_run import PassFailCriteria
from bridgegen.engine.workers.processes import Processes
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.scenario.language.criteria import read_criteria

pytestmark = pytest.mark.thorough

GAP, TTC, CRASH = "R-12: always(gap to bv > 2 m)", "R-13: ttc >= 1.5 s", "R-14: n_collision == 0"
BUDGET = 240
MARGIN = "criterion:R-12"


def search(out: Path, scenario: str = "cut-in", **more) -> bg.Run:
    given = {"budget": BUDGET, "keep": 4, "causes": False, "criteria": [GAP, TTC, CRASH]}
    return bg.run_search(scenario, **{**given, **more}, triage="short", out=out)


@pytest.fixture(scope="module")
def falsified(tmp_path_factory) -> bg.Run:
    """A search for the least margin of R-12."""
    out = tmp_path_factory.mktemp("falsified") / "run"
    return search(out, algorithm="ga", objective={MARGIN: None})


def margins_of(run: bg.Run, name: str = MARGIN) -> np.ndarray:
    return run.frame()[name].to_numpy()


def test_margins_are_recorded_to_the_last_bit_of_the_files(falsified):
    assert len(falsified.scenarios) == 4
    for path in falsified.scenarios:
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        found = bg.simulate_file(path, criteria=read_criteria([GAP, TTC, CRASH]))
        recorded = [facts["metrics"][one.criterion.quantity]["value"] for one in found.criteria]
        assert [one.margin for one in found.criteria] == recorded
        assert found.criteria[0].verdict == "violated"


def test_margins_are_of_the_metrics_that_a_formula_reads(falsified):
    """A comparison's margin is the difference of its sides."""
    frame = falsified.frame()
    difference = np.clip(frame["ttc"].to_numpy() - 1.5, -1000.0, 1000.0)
    assert np.array_equal(frame["criterion:R-13"].to_numpy(), difference)
    assert ((frame["criterion:R-14"] > 0) == (frame["n_collision"] == 0)).all()


def test_all_that_is_exported_violates_the_criterion(falsified):
    frame = falsified.frame()
    violated = (margins_of(falsified) < 0.0) & (frame["implausible"].isna().to_numpy())
    assert np.array_equal(frame["critical"].to_numpy(), violated)
    exported = [
        json.loads(path.with_suffix(".json").read_text("utf-8")) for path in falsified.scenarios
    ]
    margins = [one["metrics"][MARGIN]["value"] for one in exported]
    assert margins == sorted(margins)
    assert margins[0] == margins_of(falsified).min() < 0.0
    assert margins[-1] < 0.0


@pytest.mark.parametrize(
    ("critical", "rule"),
    [
        ("criteria", lambda frame: (frame[MARGIN] < 0) | (frame["criterion:R-13"] < 0)),
        ("criterion:R-13", lambda frame: frame["criterion:R-13"] < 0),
        (
            "criterion:R-13,criterion:R-12",
            lambda frame: (frame[["criterion:R-13", MARGIN]] < 0).any(axis=1),
        ),
        ("harm", lambda frame: frame["harm"] >= 0.3),
        (
            "thresholds",
            lambda frame: (frame["n_collision"] > 0) | ((frame["d_min"] < 2) & (frame["v_d"] >= 1)),
        ),
    ],
)
def test_the_user_says_what_is_critical(tmp_path, critical, rule):
    run = search(
        tmp_path / "run",
        criteria=[GAP, "R-13: ttc >= 4 s"],
        critical=critical,
        keep=0,
        algorithm="random",
        deliver=False,
    )
    frame = run.frame()
    fit = frame["implausible"].isna() if critical != "thresholds" else True
    assert (frame["critical"] == (rule(frame) & fit)).all()
    if critical != "harm":
        assert frame["critical"].any()
    assert f"--critical {critical}" in run.settings.command(run.folder)


def test_criteria_that_are_not_stated_are_refused(tmp_path):
    with refuses(InputError, "--criterion"):
        search(tmp_path / "a", criteria=[], critical="criteria")
    with pytest.raises(UnknownNameError, match="'criterion:R-21'"):
        search(tmp_path / "b", critical="criterion:R-21")
    with refuses(InputError):
        search(tmp_path / "c", criteria=[], objective={MARGIN: None})
    assert not any((tmp_path / name).exists() for name in "abc")


def test_interrupted_and_resumed_is_as_if_undisturbed(falsified, tmp_path, same_rows):
    def stop(progress) -> None:
        if progress.evaluations >= 40:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted):
        search(
            tmp_path / "run",
            algorithm="ga",
            objective={MARGIN: None},
            callbacks=SearchCallbacks(batch=stop),
        )
    resumed = bg.resume(tmp_path / "run")
    assert same_rows(resumed.folder, falsified.folder)
    assert resumed.criteria == falsified.criteria
    for a, b in zip(falsified.scenarios, resumed.scenarios, strict=True):
        assert a.read_bytes() == b.read_bytes()


def test_processes_find_what_threads_find(falsified, tmp_path, same_rows):
    pool = Processes(2)
    try:
        run = search(
            tmp_path / "run",
            algorithm="ga",
            objective={MARGIN: None},
            workers=pool,
            deliver=False,
        )
    finally:
        pool.close()
    assert same_rows(run.folder, falsified.folder)


def test_junit_has_a_test_for_each_criterion(cli, tmp_path):
    """The exit status is 3 exactly if one fails."""
    for name, criteria, violated in (
        ("a", [GAP, CRASH], ["R-12"]),
        ("b", [CRASH, "R-20: max(ego.v) < 200 m/s"], []),
    ):
        words = [word for one in criteria for word in ("--criterion", one)]
        code, out, err = cli(
            "search",
            "cut-in",
            "--budget",
            60,
            "--algorithm",
            "random",
            "--keep",
            1,
            "--no-causes",
            "--triage",
            "short",
            *words,
            "--junit",
            tmp_path / f"{name}.xml",
            "--out",
            tmp_path / name,
        )
        assert code == (3 if violated else 0), err
        suite = ElementTree.parse(tmp_path / f"{name}.xml").getroot()
        cases = {case.get("name"): case for case in suite.iter("testcase")}
        for one in criteria:
            failed = cases[one].find("failure") is not None
            assert failed == (one.split(":")[0] in violated)
        assert ("violates R-12 in" in out) == bool(violated)
        assert ("meets all 2 pass criteria in all 60 evaluations" in out) != bool(violated)


def test_a_figure_of_fail_if_is_the_number_of_violations(falsified):
    n = falsified.criteria[0].violated
    names = [one.criterion.quantity for one in falsified.criteria]
    for text, verdict in ((f"{MARGIN} > {n}", "passed"), (f"{MARGIN} >= {n}", "failed")):
        found = PassFailCriteria.read([text], None, criteria=names).judge(falsified)
        assert found[1].verdict == verdict  # after that of the search itself


def test_a_run_from_before_criteria_opens_and_resumes(tmp_path):
    run = search(tmp_path / "run", criteria=[], keep=1, algorithm="random")
    with sqlite3.connect(run.folder / "run.sqlite") as connection:
        ((text,),) = connection.execute("SELECT value FROM run WHERE key = 'settings'")
        settings = json.loads(text)
        for later in ("criteria", "critical"):
            del settings[later]
        del settings["objective"]["criteria"]
        connection.execute(
            "UPDATE run SET value = ? WHERE key = 'settings'", (json.dumps(settings),)
        )
        connection.execute("DELETE FROM evaluations WHERE id >= 60")
    again = bg.resume(run.folder)
    assert again.criteria == ()
    assert again.frame()["f0"].tolist() == run.frame()["f0"].tolist()
    assert again.report.exists()


def test_margins_are_columns_of_parquet_files(falsified, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    from bridgegen.jobs.search.table import write_tables

    (path,) = write_tables([falsified.folder], tmp_path)
    table = parquet.read_table(path).to_pydict()
    assert table[MARGIN] == margins_of(falsified).tolist()


def test_failure_modes_are_those_of_harm_and_name_the_exported_files(tmp_path):
    """Criteria choose what is exported; a mode names those of its rows that are."""
    run = search(
        tmp_path / "run",
        "crossroads-s4",
        algorithm="random",
        critical="criteria",
        keep=6,
        criteria=["R-1: d_min > 0.5 m"],
        budget=300,
        objective={"d_min": 1.0},
    )
    frame = run.frame()
    assert run.modes
    exported = {one.name: one.evaluation for one in run.exported()}
    assert (frame["criterion:R-1"].to_numpy()[list(exported.values())] < 0).all()
    assert list(exported) == [f"{k:04d}" for k in range(1, len(exported) + 1)]
    named = [name for mode in run.modes for name in mode.exports]
    assert named
    for mode in run.modes:
        for name in mode.exports:
            row = frame.iloc[exported[name]]
            assert (row["conflict_type"], row["responsible"]) == (
                mode.conflict_type,
                mode.responsible,
            )


def test_a_comparison_measures_what_violates_a_criterion(tmp_path):
    found = bg.compare(
        "cut-in",
        algorithms=["random", "ga"],
        seeds=2,
        budget=60,
        criteria=[GAP],
        causes=False,
        objective={MARGIN: None},
        out=tmp_path / "comparison",
        workers=1,
    )
    assert not found.gaps
    for cell, record in found.records.items():
        (folder,) = (tmp_path / "comparison" / "runs").glob(
            f"**/*{cell.algorithm}*{cell.seed}*/run.sqlite"
        )
        assert record.critical == bg.Run(folder.parent).frame()["critical"].sum() > 0
        assert record.terms == (MARGIN,)
    page = found.page.read_text("utf-8")
    assert f"criteria: {html.escape(GAP)}" in page
    (box,) = re.findall(r"criterion:R-12 ([-.\d]+) to ([-.\d]+)", page)
    assert float(box[0]) > 0.0 > float(box[1])  # margins keep their sign
