"""The names of ``import bridgegen as bg``, as a notebook completes them."""

import json
import subprocess
import sys

import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, StorageError
from bridgegen.jobs.search.exported import exported_scenarios, read_facts


def test_tab_completes_all_names_before_first_use():
    code = "import bridgegen as bg; print(*dir(bg))"
    words = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert {*bg.__all__} <= {*words}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "s4"
    return bg.run_search("crossroads-s4", budget=120, keep=1, triage="none", out=str(folder))


def test_paths_may_be_texts(run):
    path = run.scenarios[0]
    assert bg.simulate_file(str(path)).metrics == bg.simulate_file(path).metrics


def test_an_exported_scenario_counts_evaluations_as_the_report_does(run):
    path = run.scenarios[0].with_suffix(".json")
    facts = json.loads(path.read_text("utf-8"))
    X = run.rows().X[facts["evaluation"] - 1]
    at = run.frame().columns.get_loc("bv_speed")
    assert facts["parameters"]["bv_speed"]["value"] == run.frame().iloc[facts["row"], at]
    assert run.frame().iloc[facts["row"], at] in X
    assert run.exported()[0].evaluation == facts["row"]


def test_an_exported_scenario_of_an_earlier_version_counts_from_0(run):
    path = run.scenarios[0].with_suffix(".json")
    text = path.read_text("utf-8")
    facts = json.loads(text)
    row = facts.pop("row")
    try:
        path.write_text(json.dumps(facts | {"evaluation": row}), "utf-8")
        assert (read_facts(path).row, read_facts(path).evaluation) == (row, row + 1)
        assert exported_scenarios(run.folder)[0].evaluation == row
        path.write_text(json.dumps(facts | {"row": row, "evaluation": row}), "utf-8")
        with refuses(StorageError, "evaluation"):
            read_facts(path)
    finally:
        path.write_text(text, "utf-8")


def test_dir_shows_what_is_public():
    assert dir(bg) == sorted([*bg.__all__, "__version__"])


def test_load_reads_scenarios_and_runs(run):
    assert bg.load("cut-in").name == "cut-in"
    assert bg.load(run.folder).summary == bg.load(str(run.folder)).summary == run.summary
    with refuses(StorageError):
        bg.load(run.folder.parent)
    with refuses(InputError, "runs/x"):
        bg.load("runs/x")
    with refuses(InputError, "buget"):
        bg.run_search("cut-in", buget=3)
