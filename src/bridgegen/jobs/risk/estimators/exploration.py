"""The event found without a score that leads to it, by points spread over all of the space."""

from dataclasses import replace

import numpy as np

from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, Problem, block_of
from bridgegen.jobs.risk.estimators.weighted import Weighted

MOST = 20_000  # points
FEWEST = 5.0
"""Effective points of the event, of those that are spread, below which it is not known well."""
_STREAM = 5  # of random numbers


def explore(problem: Problem, aim: Aim, seed: int) -> Weighted:
    """Evaluate spread points, and weight them by how much likelier they are on the road.

    Args:
        problem: the experiment.
        aim: the event; at most its budget is spent.
        seed: of all random numbers.
    """
    n = max(min(MOST, aim.budget), 1)
    Z, weights = problem.spread(n, block_of(seed, 0, _STREAM))
    there = np.flatnonzero(weights > 0.0)
    found = problem.evaluate(Z[there], aim.least)
    kept = found[:, SCORE] >= aim.least
    Z, found, weights = Z[there][kept], found[kept], weights[there][kept] / n
    largest = float(weights.max(initial=1.0 / n))
    none = np.empty(0, np.int64)
    known = Weighted(Z, found, weights, n, none, 0, largest, (1.0, 1.0, 1.0), len(there))
    hits = known.hits(known.there(aim.threshold))
    doubt = f"{hits:.1f} effective ones of {n:,} rows that are spread over the ranges are harmful"
    return replace(
        known,
        doubts=() if hits >= FEWEST else (doubt,),
        facts={"explored_hits": hits, "reached": 0.0},
    )
