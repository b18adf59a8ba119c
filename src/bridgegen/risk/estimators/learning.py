"""Proposals learnt from what they draw themselves, round by round.

Each round's points of the event are weighted by all proposals so far together, so that a point that
the first ones hardly reached does not outweigh all others. Rows of a result are drawn afterwards.

Source: Cornuet, Marin, Mira and Robert, Scandinavian Journal of Statistics 39 (2012) 798-812
(adaptive multiple importance sampling).
"""

from dataclasses import replace

import numpy as np

from bridgegen.arrays import Float
from bridgegen.risk.estimators.problem import SCORE, Aim, Problem
from bridgegen.risk.estimators.proposals import Proposals

OF_ROUND, FEWEST_ROWS = 2000, 100
"""Rows of a round at most, and at least."""
ROUNDS, MOST_ROUNDS = 10, 20
"""So many rounds take a quarter of a small budget at most; more of them are for a large one."""
OF_BUDGET = 4
ENOUGH = 400.0
"""Effective number of points of the event, from which on no further round is needed."""


def learn(
    problem: Problem, aim: Aim, first: Proposals, budget: int, random: np.random.Generator
) -> tuple[Proposals, int]:
    """Return better proposals, and how many evaluations they took.

    Args:
        problem: the experiment.
        aim: the event.
        first: the proposals to begin with; their kernels stay, so that no region is lost.
        budget: evaluations that are left.
        random: all random numbers.
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
