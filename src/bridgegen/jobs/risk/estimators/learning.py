"""Fits proposals again and again, to the points of the event that they draw themselves.

A point's weight is its density on the road over the mean density of all proposals so far. A point
that the first proposals seldom draw therefore does not outweigh all others. Rows of the result are
drawn afterwards, so learning does not bias it.

Source: Cornuet, Marin, Mira and Robert, Scandinavian Journal of Statistics 39 (2012) 798-812
(adaptive multiple importance sampling).
"""

from dataclasses import replace

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, Problem
from bridgegen.jobs.risk.estimators.proposals import Proposals

OF_ROUND, FEWEST_ROWS = 2000, 100
"""Rows of a round at most, and at least."""
ROUNDS, MOST_ROUNDS = 10, 20
"""Number of rounds that a small budget is divided into, and maximum number of rounds."""
OF_BUDGET = 4
"""All rounds together take at most this part of the budget: a quarter."""
ENOUGH = 400.0
"""Effective number of points of the event at which learning ends."""


def learn(
    problem: Problem, aim: Aim, first: Proposals, budget: int, random: np.random.Generator
) -> tuple[Proposals, int]:
    """Return fitted proposals, and the number of evaluations spent.

    Args:
        problem: the experiment.
        aim: the event.
        first: initial proposals; their kernels are kept, so that no known region is lost.
        budget: remaining evaluations.
        random: source of all random numbers.
    """
    most = budget // OF_BUDGET
    rows = min(OF_ROUND, most // ROUNDS)
    rounds = min(MOST_ROUNDS, most // rows) if rows >= FEWEST_ROWS else 0
    proposals, spent = first, 0
    drawn: list[Proposals] = []
    found: list[Float] = []
    for _ in range(rounds):
        Z, _ = proposals.draw(rows, random)
        Z = Z[problem.feasible(Z)]
        drawn.append(proposals)
        found.append(Z[problem.evaluate(Z, aim.least)[:, SCORE] >= aim.threshold])
        spent += len(Z)
        points = np.concatenate(found)
        if not len(points):
            continue
        weights = 1.0 / np.mean([1.0 / one.weights(points) for one in drawn], axis=0)
        size = float(weights.sum() ** 2 / np.sum(weights * weights))
        proposals = replace(Proposals.of(points, weights, size, random), kernels=first.kernels)
        if size >= ENOUGH:
            break
    return proposals, spent
