"""A search whose scenarios a cheap simulator proposes; a biased copy of ours is the dear one."""

import os
import re
from contextlib import suppress

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, Interrupted
from bridgegen.cli import main
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.results.store import Store
from bridgegen.simulation import choice
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice

from .biased import biased_kind, not_finite, slower
from .braking import write_pair

pytestmark = pytest.mark.thorough


@pytest.fixture(autouse=True)
def simulators(monkeypatch):
    for name, change in (("biased", slower), ("broken", not_finite)):
        monkeypatch.setitem(choice.SIMULATORS, name, biased_kind(name, change))


def search(out, budget=16, **changes):
    given = {
        "ego": "route-follower", "algorithm": "es", "objective": {"harm": None}, "causes": False,
        "simulator": "biased", "screen": EMBEDDED, "deliver": False,
    }  # fmt: skip
    given |= changes
    for name in ("simulator", "screen"):
        if isinstance(given[name], str):
            given[name] = SimulatorChoice(given[name])
    return bg.run_search("crossroads-s4", budget=budget, out=out, **given)


def rows(folder):
    with Store.open(folder) as store:
        found = store.read()
        return found.U.tobytes(), found.X.tobytes(), found.F.tobytes(), found.metrics.tobytes()


def first(run):
    critical = run.rows().critical
    return int(np.argmax(critical)) + 1 if critical.any() else np.inf


def test_the_first_failure_comes_sooner(tmp_path):
    """Of what is critical in 1.4 % of all scenarios: three seeds of three."""
    seeds = range(3)
    screened = [first(search(tmp_path / f"s{k}", 16, seed=k)) for k in seeds]
    alone = [first(search(tmp_path / f"a{k}", 80, seed=k, screen=None)) for k in seeds]
    assert max(screened) < min(alone)


def test_it_is_recorded_and_counted_exactly(tmp_path):
    run = search(tmp_path / "run", 20, screen_budget=300, screen_batch=5)
    assert run.summary.evaluations == 20
    settings = run.settings
    assert settings.screen == EMBEDDED
    assert (settings.screen_budget, settings.screen_batch) == (300, 5)
    assert " --simulator biased --screen embedded --screen-budget 300 --screen-batch 5 " in (
        settings.command(tmp_path)
    )
    told = run.screened
    assert (told.screen, told.simulator, told.screen_budget) == ("embedded", "biased", 300)
    assert 240 <= told.screen_evaluations <= 300
    assert told.compared == 20
    assert told.both + told.simulator_only == run.summary.critical
    assert max(np.unique(run.frame()["batch"], return_counts=True)[1]) == 5


def test_the_results_are_those_of_the_run_s_simulator(tmp_path):
    run = search(tmp_path / "run", 8)
    assert (run.settings.screen_budget, run.settings.screen_batch) == (160, 8)
    here = pipeline_of(run, "test")
    np.testing.assert_array_equal(here.evaluate(run.rows().X).F, run.rows().F)
    assert (here.elsewhere(EMBEDDED).evaluate(run.rows().X).F != run.rows().F).any()


def test_workers_do_not_matter(tmp_path, monkeypatch):
    """Processes know no simulator of a test's: the embedded one screens for itself here."""
    monkeypatch.setattr("bridgegen.jobs.search.campaign.require_screen", lambda given, budget: None)
    given = {"simulator": EMBEDDED, "budget": 16}
    one, other = (search(tmp_path / str(n), workers=n, **given) for n in (None, 2))
    assert rows(one.folder) == rows(other.folder)
    assert one.notes == other.notes
    assert one.screened.rank_correlation == 1.0
    assert one.screened.both + one.screened.neither == 16


@pytest.mark.parametrize("stop_after", [1, 2])
def test_an_interrupted_search_becomes_the_same(stop_after, tmp_path):
    whole = search(tmp_path / "whole", 24, screen_budget=240)
    batches = 0

    def stop(progress):
        nonlocal batches
        batches += 1
        if batches == stop_after:
            raise KeyboardInterrupt

    with suppress(Interrupted):
        search(tmp_path / "part", 24, screen_budget=240, callbacks=SearchCallbacks(batch=stop))
    with Store.open(tmp_path / "part") as store:
        assert len(store) == 8 * stop_after
    again = bg.resume(tmp_path / "part", deliver=False)
    assert rows(whole.folder) == rows(again.folder)
    assert again.notes == whole.notes


def test_with_rates_models_see_it_and_both_are_counted(tmp_path):
    """Stopped and resumed, it is the same run."""
    given = {"algorithm": "rate", "screen_budget": 480, "settings": {"initial": 12, "batch": 6}}
    whole = search(tmp_path / "whole", 24, triage="none", **given)
    told = whole.screened
    assert (whole.settings.screen_batch, told.screen_budget) == (None, 480)
    assert 430 < told.screen_evaluations <= 480
    assert told.compared == whole.summary.evaluations == 24
    assert told.both + told.simulator_only == whole.summary.critical

    def stop(progress):
        if progress.evaluations >= 18:
            raise KeyboardInterrupt

    with suppress(Interrupted):
        search(tmp_path / "part", 24, callbacks=SearchCallbacks(batch=stop), triage="none", **given)
    again = bg.resume(tmp_path / "part", deliver=False)
    assert rows(whole.folder) == rows(again.folder)
    assert again.notes == whole.notes
    assert "--screen-batch" not in whole.settings.command(tmp_path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"screen": "biased"}, "simulator"),
        ({"screen": None, "screen_budget": 100}, "--screen-budget"),
        ({"screen": None, "screen_batch": 4}, "--screen-batch"),
        ({"screen_budget": 15}, "screen_budget"),
        ({"screen_batch": 0}, "screen_batch"),
        ({"screen": "esmini"}, "screen"),
        ({"vehicle": "single-track", "simulator": EMBEDDED, "screen": "biased"},
         "single-track"),
    ],
)  # fmt: skip
def test_what_is_no_screen_is_refused(changes, message, tmp_path, monkeypatch):
    monkeypatch.delenv("ESMINI_LIB", raising=False)
    with refuses(InputError, message) as refused:
        search(tmp_path / "run", **changes)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "run").exists()


def test_the_same_simulator_with_other_settings_is_a_screen(tmp_path):
    other = SimulatorChoice("biased", {"noise": 1})
    run = search(tmp_path / "run", 8, screen=other)
    assert bg.Run(run.folder).settings.screen == other
    assert "--screen biased --screen-set noise=1 " in run.settings.command(tmp_path)


def test_a_screen_that_fails_everywhere_is_said_in_a_line(tmp_path, monkeypatch):
    from bridgegen.engine.pipeline import Pipeline

    evaluate = Pipeline.evaluate

    def fails(self, X):
        found = evaluate(self, X)
        if self._simulated_by != EMBEDDED:
            return found
        found.F[:] = np.nan
        return found

    monkeypatch.setattr(Pipeline, "evaluate", fails)
    said = []
    run = search(tmp_path / "run", 16, callbacks=SearchCallbacks(warning=said.append))
    assert run.summary.evaluations == 16
    (line,) = (one for one in said if "screen" in one)
    approve(line)


def test_the_page_and_the_command_line_show_the_agreement(tmp_path, capsys, monkeypatch):
    words = [
        "bridgegen", "search", "crossroads-s4", "--ego", "route-follower", "--objective", "harm",
        "--simulator", "biased", "--screen", "embedded", "--budget", "24", "--keep", "1",
        "--triage", "none", "--no-causes", "--algorithm", "es", "-v",
        "--out", str(tmp_path / "run"),
    ]  # fmt: skip
    monkeypatch.setattr("sys.argv", words)
    with suppress(SystemExit):
        main()
    (line,) = re.findall(r"^screen +(.*)$", capsys.readouterr().out, re.MULTILINE)
    told = bg.Run(tmp_path / "run").screened
    approve(line, told.screen_evaluations)
    page = (tmp_path / "run" / "report.html").read_text()
    assert "Agreement with the screen" in page


def test_a_scenario_file(tmp_path):
    scenario, ranges = write_pair(tmp_path)
    found = bg.run_search(
        scenario, distribution=ranges, budget=8, out=tmp_path / "run", algorithm="random",
        simulator=SimulatorChoice("biased"), screen=EMBEDDED, deliver=False, causes=False,
    )  # fmt: skip
    assert found.screened.compared == 8
    assert found.screened.rank_correlation == 1.0  # it has none of the parameters that differ


@pytest.mark.esmini
def test_esmini_evaluates_what_ours_proposes(tmp_path):
    """Both agree on 99.7 % of the catalogue's critical scenarios."""
    if not os.environ.get("ESMINI_LIB"):
        pytest.skip("ESMINI_LIB names no library of esmini's")
    run = search(tmp_path / "run", 16, simulator="esmini")
    assert run.screened.compared == 16
    assert run.screened.both >= run.screened.screen_only + run.screened.simulator_only
    assert run.screened.rank_correlation > 0.9
