"""Searches with pass criteria: margins, what is critical, resuming, exports, verdicts."""

import json

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen import resume, run_search
from bridgegen.base.errors import InputError
from bridgegen.cli.verdict.of_run import PassFailCriteria
from bridgegen.engine.simulate import simulate_file
from bridgegen.results.store import Store

GAP = "R-12: always(gap to bv > 2 m)"
BRAKE = "R-13: always(ego.a > -12 m/s²)"
GIVEN = {"ego": "reference", "causes": False, "seed": 3}


def rows(run):
    with Store.open(run.folder) as store:
        return store.read()


def test_a_search_falsifies_a_criterion(tmp_path):
    aimed = run_search(
        "cut-in", criteria=[GAP, BRAKE], objective={"criterion:R-12": None}, budget=240, keep=2,
        triage="none", out=tmp_path / "aimed", **GIVEN,
    )  # fmt: skip
    chance = run_search(
        "cut-in", criteria=[GAP, BRAKE], algorithm="random", budget=240, deliver=False,
        out=tmp_path / "chance", **GIVEN,
    )  # fmt: skip
    found, by_chance = (run.criteria[0] for run in (aimed, chance))
    assert found.violated > 1.2 * by_chance.violated > 0
    table = rows(aimed)
    margins = table.metrics[:, aimed.metrics.index("criterion:R-12")]
    plausible = table.findings.implausible == ""
    assert table.critical.tolist() == ((margins < 0.0) & plausible).tolist()
    assert found.worst == margins.min()
    assert margins[found.at - 1] == margins.min()
    assert aimed.criteria[1].violated == 0
    # what is exported violates it, and the file says so to the last bit
    assert len(aimed.scenarios) == 2
    for path in aimed.scenarios:
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        stated = facts["metrics"]["criterion:R-12"]
        assert stated["value"] < 0.0
        assert stated["unit"] == "m"
        again = simulate_file(path, criteria=[run_criterion(aimed)])
        assert again.criteria[0].margin == stated["value"]


def run_criterion(run):
    return run.criteria[0].criterion


@pytest.mark.thorough
def test_the_same_bits_after_an_interruption_and_with_processes(tmp_path):
    search = {"criteria": [GAP], "budget": 120, "keep": 1, "triage": "none", **GIVEN}
    whole = run_search("cut-in", **search, out=tmp_path / "a")
    processes = run_search("cut-in", **search, workers=2, deliver=False, out=tmp_path / "b")
    assert rows(whole).metrics.tobytes() == rows(processes).metrics.tobytes()
    again = resume(processes.folder)
    assert rows(whole).metrics.tobytes() == rows(again).metrics.tobytes()
    assert again.criteria[0].violated == whole.criteria[0].violated


def test_what_makes_a_scenario_critical_is_chosen(tmp_path):
    def critical(name, **options):
        run = run_search(
            "cut-in", criteria=[GAP, BRAKE], budget=80, deliver=False, out=tmp_path / name,
            **GIVEN, **options,
        )  # fmt: skip
        return run.summary.critical, run.criteria[0].violated

    assert critical("harm")[0] == 0
    n, violated = critical("any", critical="criteria")
    assert n == violated > 0
    assert critical("brake", critical="criterion:R-13")[0] == 0
    with refuses(InputError, "criterion:R-14"):
        critical("no", critical="criterion:R-14")


def test_junit_has_a_test_for_each_and_fails_with_the_exit_status(tmp_path):
    run = run_search(
        "cut-in", criteria=[GAP, BRAKE], budget=80, triage="none", out=tmp_path / "a", **GIVEN
    )
    judges = PassFailCriteria.of_run((), tmp_path / "j.xml", run.folder)
    verdicts = {one.test.partition(":")[0]: one.verdict for one in judges.judge(run)}
    assert verdicts == {"the search has results": "passed", "R-12": "failed", "R-13": "passed"}
    text = (tmp_path / "j.xml").read_text("utf-8")
    assert text.count("<failure") == 1
    approve(text, "12", "2 m")


def test_a_scenario_file_states_criteria(tmp_path):
    from importlib import resources

    text = (
        resources.files("bridgegen.scenario.catalogue").joinpath("cut-in.yaml").read_text("utf-8")
    )
    text = text.replace(
        "objective: harm\n",
        "criteria:\n  - {id: R-12, formula: always(gap to bv > 2 m), severity: critical}\n"
        "objective:\n  terms: [{metric: 'criterion:R-12', weight: 1.0}]\n  weights: fixed\n"
        "  scale: raw\n  critical: criteria\n",
    )
    path = tmp_path / "mine.yaml"
    path.write_text(text.replace("scenario: cut-in", "scenario: mine"), "utf-8")
    run = run_search(path, budget=80, deliver=False, out=tmp_path / "a", **GIVEN)
    assert run.summary.critical == run.criteria[0].violated > 0
    assert run.criteria[0].criterion.severity == "critical"
    F = rows(run).F[:, 0]
    assert np.array_equal(F, rows(run).metrics[:, run.metrics.index("criterion:R-12")])
    path.write_text(text.replace("gap to bv", "gap to bw"), "utf-8")
    with refuses(InputError, "bw", "12"):
        run_search(path, triage="none", out=tmp_path / "b")
