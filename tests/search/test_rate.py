"""A search with rates: the chances that it states are those with which it draws."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen import load, resume, run_search
from bridgegen.base.errors import InputError
from bridgegen.jobs.search import SearchCallbacks, searcher
from bridgegen.jobs.search.loop import Progress
from bridgegen.scenario.exposure import read_exposure
from bridgegen.scenario.exposure.road import OnRoad
from bridgegen.search.algorithms import Problem, Results
from bridgegen.search.algorithms import rate as searching
from bridgegen.search.algorithms.rate import Draws, Rate, row_weights
from bridgegen.search.triage.rates import Drawn, how_likely

EXAMPLE = Path(__file__).parents[2] / "docs/examples/cut-in-exposure.yaml"


@pytest.fixture(scope="module")
def problems():
    path = Path(__file__).parents[1] / "risk/estimators/problems.py"
    spec = importlib.util.spec_from_file_location("problems_of_rates", path)
    module = importlib.util.module_from_spec(spec)
    import sys

    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


class Cheap:
    """A screen that takes every third point for another one, and fails at some."""

    name, each, evaluations = "cheap", 6.0, 0

    def __init__(self, problem, road, budget):
        self.budget, self.score, self.road = budget, problem.score, road

    def evaluate(self, U):
        there = np.arange(self.evaluations, self.evaluations + len(U)) < self.budget
        self.evaluations += int(there.sum())
        Z = self.road.normal(U)
        score = self.score(np.where(np.sin(9.0 * Z[:, :1]) > 0.5, -Z, Z))
        plain = Results.of_F(-score[:, np.newaxis], there & (Z[:, 2] > -1.0))
        return replace(plain, critical=(score >= 0.0) & plain.ok), there


def searched(problems, problem, seed, budget, screened=False):
    """Return what was drawn, and which rows are harmful."""
    road = problems.AnalyticRoad(problem)
    screen = Cheap(problem, road, 6 * budget) if screened else None
    search = Rate(Problem(("a", "b", "c"), road=road, screen=screen), seed, initial=20, batch=20)
    harmful = np.empty(0, np.bool_)
    while len(harmful) < budget:
        U = search.ask()
        score = problem.score(road.normal(U))
        plain = Results.of_F(-score[:, np.newaxis])
        search.tell(U, Results(plain.F, plain.ok, score >= 0.0, plain.metrics, plain.cause))
        harmful = np.append(harmful, score >= 0.0)
    assert screen is None or budget < screen.evaluations <= screen.budget
    return search.draws, harmful


@pytest.mark.parametrize("screened", [False, True])
def test_whatever_the_model_estimates_are_unbiased(screened, problems, monkeypatch):
    monkeypatch.setattr(searching, "POOL", 128)
    # A half space in a case of 30 %; sums of rarer events are too skewed for 30 seeds.
    score = problems.discrete(0.3).score
    problem = problems.Analytic(3, lambda Z: score(Z) + 1.0, 0.3 * problems.normal.sf(1.0))
    sums, ones = [], []
    for seed in range(30):
        draws, harmful = searched(problems, problem, seed, 80, screened)
        sums.append(row_weights(draws)[harmful].sum())
        ones.append(draws.weights.mean())
    for values, truth in ((sums, problem.probability), (ones, 1.0)):
        assert abs(np.mean(values) - truth) < 3.0 * np.std(values) / np.sqrt(len(values))


def test_densities_of_an_exposure_are_those_of_its_pools(monkeypatch):
    scenario = load("cut-in")
    space = scenario.space()
    road = OnRoad(read_exposure(EXAMPLE, scenario), space)
    search = Rate(Problem(space.variables, road=road), 0)
    for _ in range(2):  # without and with points near failures
        pools = [search._pool(1) for _ in range(12)]
        for name in ("road", "even"):
            means = [getattr(pool, name).sum() / pool.size for pool in pools]
            assert abs(np.mean(means) - 1.0) < 4.0 * np.std(means) / np.sqrt(12) + 0.02
        U = search.ask()
        plain = Results.of_F(np.linspace(0.0, 1.0, len(U))[:, np.newaxis])
        critical = plain.F[:, 0] < 0.2
        search.tell(U, Results(plain.F, plain.ok, critical, plain.metrics, plain.cause))


@pytest.mark.parametrize("happens", [False, True])
def test_all_rows_or_none_harmful(happens):
    n = 100
    one = np.ones(n)
    draws = Draws(np.zeros((n, 1)), np.zeros((n, 1)), one, 0.3 * one, 0.3 * one, one, 9.0 * one)
    found = how_likely(Drawn(draws, np.arange(n), (1.0, 1.0, 1.0), ""), np.full(n, happens))
    if happens:
        assert found.low > 0.8
        assert found.high == 1.0
        assert found.estimate == pytest.approx(1.0)
    else:
        assert (found.estimate, found.low) == (0.0, 0.0)
        assert found.high == pytest.approx(3.0 / 30.0)  # rule of three, of rows as on the road


@pytest.mark.thorough
def test_a_rate_is_the_same_after_a_stop(tmp_path, cli, same_rows):
    def stop(progress: Progress) -> None:
        if progress.evaluations >= 60:
            raise KeyboardInterrupt

    one = {"ego": "route-follower", "rate": True, "budget": 90, "triage": "none"}
    status, out, _ = cli(
        "search", "crossroads-s3", "--ego", "route-follower", "--rate", "--budget", 90,
        "--triage", "none", "--out", tmp_path / "whole",
    )  # fmt: skip
    assert status == 0
    approve(out, "How likely", "probability")
    with pytest.raises(Exception, match="evaluations"):
        run_search(
            "crossroads-s3", out=tmp_path / "cut", callbacks=SearchCallbacks(batch=stop), **one
        )
    resume(tmp_path / "cut")
    assert same_rows(tmp_path / "whole", tmp_path / "cut")
    records = [(tmp_path / name / "triage.json").read_bytes() for name in ("whole", "cut")]
    assert records[0] == records[1]
    resume(tmp_path / "cut")  # from its end: all rows are asked for again
    assert (tmp_path / "cut/triage.json").read_bytes() == records[0]


def test_what_cannot_be_rated_is_refused(tmp_path):
    with refuses(InputError, "--rate", "pso"):
        run_search("cut-in", rate=True, algorithm="pso", out=tmp_path / "a")
    screen = {"simulator": "esmini", "screen": "embedded", "budget": 10}
    with refuses(InputError, "--screen-batch", "screen_budget"):
        run_search(
            "cut-in", rate=True, out=tmp_path / "a", screen_batch=4, screen_budget=190, **screen
        )
    with refuses(InputError, "gap"):
        run_search("cut-in", exposure=EXAMPLE, fixed={"gap": 30.0}, out=tmp_path / "a")
    with refuses(InputError, "crossroads-s1"):
        run_search("crossroads-s1", exposure=EXAMPLE, out=tmp_path / "a")
    assert not (tmp_path / "a").exists()


@pytest.mark.thorough
def test_it_ends_when_interval_and_modes_suffice(tmp_path, monkeypatch):
    monkeypatch.setattr(searcher, "LEAST_RATED", 60)
    given = {"ego": "route-follower", "exposure": EXAMPLE, "budget": 200, "triage": "none"}
    settings = {"initial": 70, "precision": 0.9}
    run = run_search("cut-in", settings=settings, out=tmp_path / "a", **given)
    rate = run.triage.rate
    assert (run.summary.evaluations + rate.left, run.finished) == (200, True)
    assert run.summary.evaluations < 150
    often = {amount.unit: amount for amount in rate.per}
    # 412 encounters in 310 hours and 28,400 km.
    assert often["hour"].estimate == pytest.approx(rate.harm.estimate * 412 / 310)
    assert often["1,000 km"].estimate == pytest.approx(rate.harm.estimate * 412 / 28.4)
    assert often["hour"].low < often["hour"].estimate < often["hour"].high
    approve(rate.sentence, "per hour", "not needed")
    first = (tmp_path / "a/triage.json").read_bytes()
    resume(tmp_path / "a")
    assert (tmp_path / "a/triage.json").read_bytes() == first
