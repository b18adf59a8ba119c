"""The most likely point of an event, where it is known."""

import numpy as np
import pytest

from bridgegen.jobs.risk.estimators import exploration as design_point
from bridgegen.jobs.risk.estimators.problem import SCORE, block_of

from .problems import Analytic, bent, linear, product, two_sides


def normal(Z):
    return -0.5 * np.sum(Z * Z, axis=1)


def happens(outcomes):
    return outcomes[:, SCORE] >= 0.0


def found(problem, Z, evaluations=design_point.EVALUATIONS, density=normal, seed=1):
    return design_point.find(problem, density, Z, happens, evaluations, block_of(seed, 0))


def event(problem, count=400, seed=0):
    """Return points of the event, far from the middle."""
    Z = 3.0 * np.random.default_rng(seed).standard_normal((200_000, problem.dimensions))
    return Z[problem.feasible(Z) & (problem.score(Z) >= 0.0)][:count]


@pytest.mark.parametrize(
    ("problem", "distance"),
    [
        (linear(2, 4.0), 4.0), (linear(6, 4.0), 4.0), (two_sides(5, 3.0, 3.4), 3.0),
        (product(), 5.0), (bent(), 2.5),
    ],
)  # fmt: skip
def test_it_is_the_nearest_one(problem, distance):
    Z = event(problem)
    z = found(problem, Z)
    assert problem.score(z[np.newaxis])[0] >= 0.0
    assert distance - 1e-9 <= np.linalg.norm(z) <= 1.04 * distance


def test_it_is_feasible_and_the_budget_is_kept():
    problem = linear(3, 3.0)
    problem.allowed = lambda Z: Z[:, 0] > 2.2
    Z = event(problem)
    z = found(problem, Z, evaluations=512)
    assert problem.evaluations <= 512
    assert z[0] > 2.2
    best = 2.2**2 + 0.5 * (3.0 * 3.0**0.5 - 2.2) ** 2
    assert np.sum(z * z) == pytest.approx(best, rel=0.02)


def test_likely_is_what_the_density_says():
    problem = Analytic(2, lambda Z: Z[:, 0] - 1.0, 0.16)
    z = found(problem, event(problem), density=lambda Z: -np.sum((Z - [4.0, -3.0]) ** 2, axis=1))
    assert z == pytest.approx([4.0, -3.0], abs=0.05)


def test_of_equally_likely_points_it_is_the_most_central():
    problem = linear(2, 3.0)
    z = found(problem, event(problem), density=lambda Z: np.zeros(len(Z)))
    assert np.linalg.norm(z) == pytest.approx(3.0, abs=0.05)


def test_without_evaluations_it_is_the_likeliest_given_one():
    problem = linear(4, 3.0)
    Z = event(problem)
    z = found(problem, Z, evaluations=0)
    assert np.array_equal(z, Z[np.argmax(normal(Z))])
    assert problem.evaluations == 0


def test_the_same_seed_has_the_same_bits():
    problem = linear(6, 3.0)
    Z = event(problem)
    assert np.array_equal(found(problem, Z), found(problem, Z))
    assert not np.array_equal(found(problem, Z), found(problem, Z, seed=2))
