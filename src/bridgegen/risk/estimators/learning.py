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

MOST_ROUNDS, OF_ROUND = 10, 2000
"""How often proposals are fitted again at most, and to how many rows more each time."""
ENOUGH = 400.0
"""Effective number of points of the event, from which on no further round is needed."""
OF_BUDGET = 4  # of which all rounds take one part at most
FEWEST_ROWS = 100  # of a round


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
    rows = min(OF_ROUND, budget // (OF_BUDGET * MOST_ROUNDS))
    proposals, spent = first, 0
    drawn: list[Proposals] = []
    found: list[Float] = []
    for _ in range(MOST_ROUNDS if rows >= FEWEST_ROWS else 0):
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
