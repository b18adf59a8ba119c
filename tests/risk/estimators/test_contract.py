"""What every estimator keeps, on problems whose probability is known."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.jobs.risk.estimators.problem import Aim
from bridgegen.jobs.risk.experiment import METHODS, estimate

pytestmark = pytest.mark.thorough

_spec = importlib.util.spec_from_file_location(
    "risk_problems", Path(__file__).with_name("problems.py")
)
problems = importlib.util.module_from_spec(_spec)
sys.modules[_spec.name] = problems
_spec.loader.exec_module(problems)


def run(method, problem, seed, budget, precision=0.0, start=None):
    return estimate(method, problem, Aim(0.0, -0.05, budget, precision), seed, start).weighted


COMMON = {
    "bent": problems.bent,
    "branches": problems.branches,
    "two sides": lambda: problems.two_sides(2, 2.4, 2.6),
    "constrained": problems.constrained,
    "cases": lambda: problems.discrete(0.2),
    "six dimensions": lambda: problems.linear(6, 2.6),
    "twenty dimensions": lambda: problems.linear(20, 2.6),
}
"""Events of 0.1 % to 1 %."""

RARE = {
    "half space": lambda: problems.linear(6, 4.753),
    "RP107": lambda: problems.linear(10, 5.0),
    "RP111": problems.product,
    "RP25": problems.wedge,
    "two sides": lambda: problems.two_sides(6, 4.5, 4.8),
    "plateaus": lambda: problems.stairs(6, 4.753),
}
"""Events of 2.9e-7 to 4e-5."""


def agreement(method, make, repeats, budget):
    """Return how many of the believed intervals hold the truth, how many are believed, and all
    estimates over the truth."""
    inside = believed = 0
    ratios = []
    for seed in range(repeats):
        problem = make()
        found = run(method, problem, seed, budget)
        p = found.probability(0.0)
        ratios.append(p.estimate / problem.probability)
        if not found.doubts:
            believed += 1
            inside += p.low <= problem.probability <= p.high
    return inside, believed, np.array(ratios)


@pytest.mark.parametrize("name", COMMON)
@pytest.mark.parametrize("method", ["mc", "subset", "importance", "stratified"])
def test_intervals_hold_the_truth(method, name):
    inside, believed, ratios = agreement(method, COMMON[name], 16, 20_000)
    error = ratios.std(ddof=1) / np.sqrt(len(ratios))
    assert abs(ratios.mean() - 1.0) <= 4.0 * error + 0.01
    assert believed >= 12
    # Less often only if chance makes it one in a thousand.
    assert inside >= scipy.stats.binom.ppf(1e-3, believed, 0.95)


@pytest.mark.parametrize("name", RARE)
@pytest.mark.parametrize("method", ["subset", "importance"])
def test_of_rare_events_too(method, name):
    inside, believed, ratios = agreement(method, RARE[name], 8, 50_000)
    error = ratios.std(ddof=1) / np.sqrt(len(ratios))
    assert abs(ratios.mean() - 1.0) <= 4.0 * error + 0.01
    assert believed >= 5
    assert inside >= scipy.stats.binom.ppf(1e-3, believed, 0.95)


def test_one_in_a_million_takes_a_thousand_times_less_than_counting():
    for seed in range(3):
        problem = problems.linear(6, 4.753)
        found = run("auto", problem, seed, 200_000, precision=0.2)
        p = found.probability(0.0)
        assert not found.doubts
        assert p.low <= problem.probability <= p.high
        counting = (1.96 / p.precision) ** 2 / problem.probability
        assert problem.evaluations <= counting / 1000.0


@pytest.mark.parametrize("make", [problems.misleading, problems.hidden])
def test_what_scores_do_not_lead_to_is_in_doubt_or_within(make):
    wrong = 0
    for seed in range(8):
        problem = make()
        for method in ("subset", "importance"):
            found = run(method, problem, seed, 20_000)
            p = found.probability(0.0)
            wrong += not found.doubts and not p.low <= problem.probability <= p.high
    assert wrong <= 4  # of 16: no method that follows a score can exclude it


@pytest.mark.parametrize(
    ("make", "budget"), [(problems.hidden, 50_000), (problems.partly_hidden, 100_000)]
)
def test_what_no_score_leads_to_is_found_by_spread_points(make, budget):
    """Also where levels lead to another region, with a fifth of the probability."""
    believed = 0
    for seed in range(6):
        problem = make()
        found = run("importance", problem, seed, budget, precision=0.2)
        p = found.probability(0.0)
        assert p.low <= 1.1 * problem.probability
        assert problem.probability <= p.high
        assert p.high > 1.03 * p.estimate  # what few spread points may have missed
        believed += not found.doubts
    assert believed >= 4


def test_harm_at_single_points_is_counted():
    """A third of the probability is noise, which no proposals cover; chains may miss it, too."""
    counted = 0
    for seed in range(6):
        problem = problems.noisy()
        found = estimate("auto", problem, Aim(0.0, -0.05, 100_000, 0.2), seed, None)
        p = found.weighted.probability(0.0)
        if found.method == "mc":
            counted += 1
            assert p.low <= problem.probability <= p.high
    assert counted >= 4


def test_subset_simulation_is_in_doubt_where_it_met_noise():
    """And not where the same harm has none."""
    doubted = 0
    for seed in range(6):
        found = run("subset", problems.noisy(), seed, 100_000, precision=0.2)
        doubted += any("single ones" in one for one in found.doubts)
        assert not run("subset", problems.linear(3, 3.5), seed, 20_000).doubts
    assert doubted >= 4


def test_auto_falls_back_on_counting():
    problem = problems.Analytic(3, lambda Z: np.where(Z[:, 0] > 12.0, 0.1, -1.0), 0.0)
    found = estimate("auto", problem, Aim(0.0, 0.0, 20_000, 0.2), 0, None)
    assert found.method == "mc"
    p = found.weighted.probability(0.0)
    assert p.estimate == 0.0
    assert p.upper == pytest.approx(3.0 / found.weighted.rows, rel=0.01)  # the rule of three


def test_auto_counts_where_that_suffices():
    found = estimate("auto", problems.linear(3, 1.0), Aim(0.0, 0.0, 20_000, 0.1), 0, None)
    assert found.method == "mc"
    assert found.weighted.probability(0.0).precision <= 0.1


def test_a_needle_that_a_search_has_found_counts():
    """A narrow region, far from where the levels lead, with a fifth of the probability."""

    def score(Z):
        away = np.linalg.norm(Z - np.array([-3.2, 0.0]), axis=1)
        return np.maximum(Z[:, 0] - 3.2, np.where(away < 0.3, 0.1, -9.0))

    ball = np.random.default_rng(1).uniform(-0.3, 0.3, (400_000, 2))
    ball = ball[np.linalg.norm(ball, axis=1) < 0.3] + np.array([-3.2, 0.0])
    needle = np.exp(-0.5 * (ball**2).sum(axis=1)).mean() / (2.0 * np.pi) * np.pi * 0.3**2
    truth = problems.normal.sf(3.2) + needle
    assert needle > 0.15 * truth
    for seed in range(4):
        problem = problems.Analytic(2, score, truth)
        found = run("importance", problem, seed, 20_000, start=np.array([[-3.2, 0.0]]))
        p = found.probability(0.0)
        assert p.estimate == pytest.approx(truth, rel=0.1)
        assert p.low <= truth  # its upper end may be in doubt: who knows of other needles


@pytest.mark.parametrize("method", METHODS)
@settings(max_examples=12)
@given(budget=st.integers(20, 9000), seed=st.integers(0, 2**31))
def test_the_budget_is_kept_and_counted(method, budget, seed):
    problem = problems.linear(3, 2.0)
    found = run(method, problem, seed, budget)
    assert found.evaluations == problem.evaluations <= budget


@pytest.mark.parametrize("method", METHODS)
def test_same_seed_same_bits_whatever_the_batches(method):
    problem = problems.bent()
    one = run(method, problem, 5, 20_000)
    other = run(method, replace(problem, chunk=7), 5, 20_000)
    assert one.Z.tobytes() == other.Z.tobytes()
    assert one.weights.tobytes() == other.weights.tobytes()
    assert one.probability(0.0) == other.probability(0.0)
    assert run(method, problem, 6, 20_000).Z.tobytes() != one.Z.tobytes()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("score", [-1.0, 1.0])
def test_never_and_always(method, score):
    problem = problems.Analytic(2, lambda Z: np.full(len(Z), score), float(score > 0.0))
    found = run(method, problem, 0, 3000)
    p = found.probability(0.0)
    assert found.doubts or p.low <= problem.probability <= p.high + 1e-12


@pytest.mark.parametrize("method", ["mc", "subset", "importance", "stratified"])
def test_any_mean_follows_from_the_weights(method):
    """The probability of half of the event, and of a higher threshold."""
    problem = problems.linear(4, 2.0)
    found = run(method, problem, 3, 20_000)
    event = found.there(0.0)
    half = found.mean(event * (found.Z[:, 0] > found.Z[:, 1]))
    higher = found.probability(0.5)
    for one, truth in ((half, 0.5 * problem.probability), (higher, problems.normal.sf(2.5))):
        assert abs(one.estimate - truth) <= one.high - one.low  # four standard errors
    assert found.weights.sum() == pytest.approx(found.probability(-0.05).estimate)
