"""Monte Carlo: rows as they happen, counted. Nothing is assumed, and the interval is exact."""

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, Problem, block_of
from bridgegen.jobs.risk.estimators.weighted import Weighted

BLOCK = 65_536  # points of one block of random numbers
FIRST = 1024  # evaluations after which it is first asked whether the precision is reached
WHOLE = 16_384  # evaluations whose outcomes are kept whole, whatever their score


def drawn(problem: Problem, seed: int, block: int) -> Float:
    """Return the feasible points of a block, in their order."""
    Z = block_of(seed, block).standard_normal((BLOCK, problem.dimensions))
    return Z[problem.feasible(Z)]


def estimate(problem: Problem, aim: Aim, seed: int) -> Weighted:
    """Draw rows until the precision or the budget is reached.

    The precision is looked at after 1024 evaluations, and each time that they have doubled.
    """
    kept, outcomes, road, block, done, check = [], [], [], 0, 0, FIRST
    Z = drawn(problem, seed, block)
    while True:
        n = min(len(Z), min(check, aim.budget) - done)
        found = problem.evaluate(Z[:n], -np.inf if done < WHOLE else aim.least)
        road += [found] if done < WHOLE else []
        hit = found[:, SCORE] >= aim.least
        kept.append(Z[:n][hit])
        outcomes.append(found[hit])
        done += n
        if done == aim.budget:
            break
        if done == check:
            # Looked at only when evaluations have doubled: each look is a chance to stop on luck.
            check *= 2
            result = _result(kept, outcomes, road, done)
            if result.probability(aim.threshold).precision <= aim.precision:
                return result
        Z = Z[n:]
        while not len(Z):
            block += 1
            Z = drawn(problem, seed, block)
    return _result(kept, outcomes, road, done)


def _result(kept: list[Float], outcomes: list[Float], road: list[Float], done: int) -> Weighted:
    Z, found = np.concatenate(kept), np.concatenate(outcomes)
    none = np.empty(0, np.int64)
    weights = np.full(len(Z), 1.0 / done)
    one, whole = (1.0, 1.0, 1.0), np.concatenate(road)
    return Weighted(Z, found, weights, done, none, 0, 1.0 / done, one, done, road=whole)
