"""Proposals that learn from what they draw."""

import numpy as np
import pytest

from bridgegen.jobs.risk.estimators.importance import learn
from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, block_of
from bridgegen.jobs.risk.estimators.proposals import Proposals

from .problems import Analytic, normal

EVENT = Aim(0.0, 0.0, 100_000, 0.0)


def corner():
    """A half space of eight dimensions."""
    return Analytic(8, lambda Z: Z[:, 0] - 4.0, normal.sf(4.0))


def far_away():
    """Proposals around points of it that hardly happen: three deviations off in all others."""
    random = np.random.default_rng(0)
    Z = np.column_stack([4.2 + random.random(50), 3.0 + 0.1 * random.standard_normal((50, 7))])
    return Proposals.of(Z, np.ones(50), 50.0, block_of(1))


def effective(proposals):
    """Return how many rows of the event 5,000 proposed ones are worth, and what they estimate."""
    problem = corner()
    Z, weights = proposals.draw(5000, block_of(2))
    parts = weights * (problem.evaluate(Z)[:, SCORE] >= 0.0)
    return parts.sum() ** 2 / (parts * parts).sum(), parts.mean()


def test_they_find_where_the_event_is_likely():
    first = far_away()
    problem = corner()
    learnt, spent = learn(problem, EVENT, first, 160_000, block_of(3))
    assert effective(first)[0] < 30.0
    hits, mean = effective(learnt)
    assert hits > 500.0
    assert mean == pytest.approx(problem.probability, rel=0.15)
    assert spent == problem.evaluations <= 40_000
    assert learnt.kernels is first.kernels


def test_without_a_budget_they_stay():
    first = far_away()
    assert learn(corner(), EVENT, first, 3000, block_of(3)) == (first, 0)


def test_rows_that_all_miss_teach_nothing():
    problem = Analytic(8, lambda Z: np.full(len(Z), -1.0), 0.0)
    first = far_away()
    learnt, spent = learn(problem, EVENT, first, 8000, block_of(3))
    assert learnt is first
    assert spent == problem.evaluations == 2000
