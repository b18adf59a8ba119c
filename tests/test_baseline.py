"""Searches for where a driver is worse than another: what is critical, F, trials, playback."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.baseline import RECORDED
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.engine.workers import Threads
from bridgegen.jobs.dashboard.project import read_project
from bridgegen.jobs.search.regions import regions_of
from bridgegen.pages.playbacks import beside_others, measured_playbacks, others_of
from bridgegen.scenario.language.reader import load

pytestmark = pytest.mark.thorough

DRIVERS = Path(__file__).parent / "ego" / "drivers.py"
NAME = "crossroads-s3"


def made(ego: str, worse_than: str | None = None, name: str = NAME, **options) -> Pipeline:
    scenario = load(name)
    scenario = replace(scenario, objective=replace(scenario.objective, rule="harm"))
    given = PipelineOptions(ego=ego, worse_than=worse_than, **options)
    pipeline = Pipeline(scenario, scenario.space(), given, workers=Threads(1))
    pipeline.choose_objective()
    return pipeline


def rows(pipeline: Pipeline, n: int = 120) -> np.ndarray:
    return pipeline.space.decode(np.random.default_rng(3).random((n, pipeline.space.n_var)))


def column(pipeline: Pipeline, evaluation, name: str) -> np.ndarray:
    return evaluation.metrics[:, pipeline.metrics.index(name)]


def test_what_is_critical_is_so_with_the_ego_s_driver_and_not_with_the_other():
    both = made("route-follower", "careful", causes=True)
    ego, other = made("route-follower"), made("careful")
    X = rows(both)
    found, first, second = (one.evaluate(X) for one in (both, ego, other))
    plausible = (first.findings.implausible == "") & (second.findings.implausible == "")
    assert np.array_equal(found.critical, first.critical & ~second.critical & plausible)
    assert 0 < found.critical.sum() < first.critical.sum()
    assert (first.critical & second.critical).any()
    assert np.array_equal(found.F[plausible], (first.F - second.F)[plausible])
    assert (found.F[~plausible] == 0.0).all()
    for name in RECORDED:
        expected = column(other, second, name.removeprefix("baseline:"))
        assert np.array_equal(column(both, found, name), expected)
    own = [both.metrics.index(name) for name in ego.metrics]
    assert np.array_equal(found.metrics[:, own], first.metrics)
    assert ((found.cause > 0) == found.critical).all()


def test_the_difference_of_two_drivers_changes_sign_with_their_order():
    one, other = made("route-follower", "careful"), made("careful", "route-follower")
    X = rows(one)
    there, back = one.evaluate(X), other.evaluate(X)
    assert np.array_equal(there.F, -back.F)
    assert not (there.critical & back.critical).any()


def test_trials_count_what_the_other_driver_avoids():
    both, other = made("route-follower", "careful"), made("careful")
    X = rows(both)
    found = both.evaluate(X)
    trials = both.try_all(X)
    assert np.array_equal(trials.harmful, found.critical)
    assert not (trials.harmful & other.try_all(X).harmful).any()


def test_a_row_that_the_other_driver_cannot_drive_has_no_result():
    both = made("route-follower", f"{DRIVERS}:FailsFast")
    X = rows(both, 40)
    found = both.evaluate(X)
    lost = np.flatnonzero(found.status)
    assert 0 < len(lost) < len(X)
    assert np.isnan(found.metrics[lost]).all()
    assert not found.critical[lost].any()
    assert (found.F[lost] == 0.0).all()
    assert all(found.messages[row].startswith("with the baseline's driver") for row in lost)
    approve(found.messages.values(), "fast")


@pytest.mark.parametrize(
    ("ego", "worse_than", "error", "message"),
    [
        ("reference", "reference", InputError, "reference"),
        ("reference", "no-such", UnknownNameError, "no-such"),
    ],
)
def test_a_baseline_that_makes_no_sense_is_refused(ego, worse_than, error, message):
    with refuses(error, message):
        made(ego, worse_than)


def test_without_a_baseline_its_quantities_are_not_to_be_had():
    with pytest.raises(UnknownNameError, match="baseline:harm"):
        made("reference", metrics=["baseline:harm"])


def test_a_run_says_where_the_driver_is_worse_and_its_files_show_it(tmp_path):
    run = bg.run_search(
        NAME, ego="route-follower", worse_than="careful", objective={"harm": None}, budget=60,
        keep=2, algorithm="random", triage="short", out=tmp_path / "run", workers=2,
    )  # fmt: skip
    assert run.summary.critical == run.triage.bound.harmful > 0
    assert run.triage.baseline == "careful"
    approve(run.triage.bound.sentence, "route-follower")
    frame = run.frame().query("critical")
    assert (frame["harm"] >= NEAR_MISS).all()
    assert (frame["baseline:harm"] < NEAR_MISS).all()
    minimal = run.minimal_scenarios[0]
    for path in (run.scenarios[0], minimal):
        with_ego, with_other = (
            simulate_file(path, ego=ego).metrics["harm"] for ego in ("route-follower", "careful")
        )
        assert with_ego >= NEAR_MISS > with_other
    again = bg.run_search(
        NAME, ego="route-follower", worse_than="careful", objective={"harm": None}, budget=60,
        keep=2, algorithm="random", triage="short", out=tmp_path / "again", workers=1,
    )  # fmt: skip
    assert again.triage.model_dump() == run.triage.model_dump()
    assert bg.resume(run.folder, deliver=False).summary == run.summary
    with refuses(InputError, "--worse-than", "fsm"):
        bg.resume(run.folder, worse_than="fsm")
    assert "worse than careful" in run.report.read_text("utf-8")
    found = regions_of(run.folder, samples=20, at_least=0.2)
    assert found is not None
    with refuses(InputError, "route-follower"):
        bg.export_safety_case([run.folder], out=tmp_path / "case")
    project = read_project(tmp_path)
    one = next(one for one in project.results if one.source == "run")
    assert (one.kind, one.worse_than, one.space) == ("difference", "careful", None)
    assert one.failures
    assert "worse than careful" in bg.build_dashboard(tmp_path).page.read_text("utf-8")


def test_a_driver_of_one_s_own_is_named_again_to_resume(tmp_path):
    spec = f"{DRIVERS}:Cruises"
    run = bg.run_search(
        NAME, ego="route-follower", worse_than=spec, budget=10, keep=0, algorithm="random",
        triage="short", out=tmp_path / "run",
    )  # fmt: skip
    with refuses(InputError, "--worse-than"):
        bg.resume(run.folder, deliver=False)
    assert bg.resume(run.folder, worse_than=spec, deliver=False).summary == run.summary


def test_the_playback_shows_both_drivers():
    both, other = made("route-follower", "careful"), made("careful")
    X = rows(both, 40)
    at = int(np.flatnonzero(both.evaluate(X).critical)[0])
    played = measured_playbacks(both, [("a", 0, ())], X[at : at + 1])
    assert played[0].beside == ()
    (one,) = beside_others(played, X[at : at + 1], others_of(both))
    (beside,) = one.beside
    rollout = other.rollout(X[at : at + 1])
    assert beside.label == "careful"
    assert 0 in beside.entities
    k = beside.entities.index(0)
    n = int(rollout.n_steps[0])
    assert np.array_equal(beside.x[k, :n], rollout.x[0, 0, :n])
    assert np.isnan(beside.x[k, n:]).all()
