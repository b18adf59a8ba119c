"""Stratified sampling: shells of normal space by distance from its middle, rare ones sampled more.

The probability of each shell is known exactly (chi distribution), and rows within it are
independent, so nothing but the event's probability within each shell is estimated. A first fifth of
the budget decides how many rows each shell gets (Neyman's rule); the rest is counted.

Source: Cochran, Sampling Techniques (1977), chapter 5.
"""

import numpy as np
import scipy.stats

from bridgegen.base.arrays import Float, Int
from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, Problem, block_of
from bridgegen.jobs.risk.estimators.weighted import Weighted

SHELLS = 8
"""Number of shells; the outermost begins where 1e-7 of the distribution is further out."""
FIRST = 0.2  # of the budget, to learn where the event is


def estimate(problem: Problem, aim: Aim, seed: int) -> Weighted:
    """Draw rows from shells until the budget is used."""
    d = problem.dimensions
    tails = np.append(10.0 ** -np.arange(SHELLS), 0.0)
    masses = tails[:-1] - tails[1:]
    each = max(int(FIRST * aim.budget) // SHELLS, 1)
    spent = 0
    p = np.zeros(SHELLS)
    for shell in range(SHELLS):
        Z = _points(shell, tails, d, each, block_of(seed, 0, shell))
        Z = Z[problem.feasible(Z)]
        spent += len(Z)
        hits = int((problem.evaluate(Z, aim.least)[:, SCORE] >= aim.threshold).sum())
        # Never 0: a shell in which a first look saw nothing still gets rows.
        p[shell] = (hits + 0.5) / (each + 1.0)
    wanted = masses * np.sqrt(p * (1.0 - p))
    rows = max(aim.budget - spent, SHELLS)
    counts: Int = np.maximum((rows * wanted / wanted.sum()).astype(np.int64), 1)
    counts[np.argmax(counts)] -= max(int(counts.sum()) - rows, 0)
    parts: list[tuple[Float, Float, Float]] = []
    share = problem.share
    for shell, count in enumerate(counts):
        # New rows: those that decided how many a shell gets are not counted, which would bias the
        # estimate.
        Z = _points(shell, tails, d, int(count), block_of(seed, 1, shell))
        Z = Z[problem.feasible(Z)]
        spent += len(Z)
        found = problem.evaluate(Z, aim.least)
        hit = found[:, SCORE] >= aim.least
        weight = np.full(int(hit.sum()), masses[shell] / count / share[1])
        parts.append((Z[hit], found[hit], weight))
    Z, found, weights = (np.concatenate(pair) for pair in zip(*parts, strict=True))
    low, middle, high = share
    largest = float(np.max(masses / counts)) / middle
    result = Weighted(
        Z,
        found,
        weights,
        int(counts.sum()),
        np.empty(0, np.int64),
        0,
        largest,
        (1.0 / high, 1.0 / middle, 1.0 / low),
        spent,
        facts={"shells": float(SHELLS)},
    )
    result.facts["effective_hits"] = result.hits(result.there(aim.threshold))
    return result


def _points(shell: int, tails: Float, d: int, count: int, random: np.random.Generator) -> Float:
    """Return points of a shell, ``(count, d)``."""
    direction = random.standard_normal((count, d))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    tail = tails[shell + 1] + (tails[shell] - tails[shell + 1]) * random.random(count)
    # By the upper tail, whose digits are all there at 1e-7; the quantile of 1 − 1e-7 would lose
    # half of them.
    found: Float = direction * scipy.stats.chi.isf(tail, d)[:, np.newaxis]
    return found
