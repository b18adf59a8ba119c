"""The most likely point of an event: the design point of structural reliability.

Points that an estimator drew are typical of the event, and in many dimensions the typical ones are
far less likely than the likeliest. So the likeliest of them are moved on: some coordinates towards
the middle of the distribution, with noise; a move is kept if it is likelier and still the event.

Source: Ditlevsen and Madsen, Structural Reliability Methods (1996), chapter 5, for the notion.
"""

from collections.abc import Callable

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.jobs.risk.estimators.problem import Problem

STARTS, CHILDREN = 8, 8
EVALUATIONS = 2048
"""At most: 32 rounds."""
_STEP, _GROW, _SHRINK = 0.3, 1.3, 0.8  # standard deviation of moves, and its factors
_TOWARDS = 0.5  # chance of a coordinate to move towards the middle
_CENTRAL = 1e-6  # of equally likely points the most central one


def find(
    problem: Problem,
    log_density: Callable[[Float], Float],
    Z: Float,
    happens: Callable[[Float], Bool],
    evaluations: int,
    random: np.random.Generator,
) -> Float:
    """Return the most likely point of an event that is found.

    Args:
        problem: the experiment.
        log_density: of N points, ``(N,)``; what is likely by it need not be so in normal space.
        Z: ``(M, d)`` points of the event, M ≥ 1.
        happens: which of N outcomes ``(N, columns)`` are the event, ``(N,)``.
        evaluations: at most.
        random: all random numbers.

    Returns:
        ``(d,)``.
    """

    def likely(points: Float) -> Float:
        found: Float = log_density(points) - _CENTRAL * np.sum(points * points, axis=1)
        return found

    values = likely(Z)
    first = np.argsort(-values, kind="stable")[:STARTS]
    best, merit = Z[first].copy(), values[first]
    count, d = best.shape
    step = np.full(count, _STEP)
    for _ in range(evaluations // (count * CHILDREN)):
        parent = np.repeat(np.arange(count), CHILDREN)
        shape = (len(parent), d)
        inward = (random.random(shape) < _TOWARDS) * random.random((len(parent), 1))
        scale = step[parent, np.newaxis]
        children = best[parent] * (1.0 - np.minimum(scale, 1.0) * inward)
        children += 0.3 * scale * random.standard_normal(shape)
        ours = likely(children)
        good = np.flatnonzero(problem.feasible(children) & (ours > merit[parent]))
        harmful = happens(problem.evaluate(children[good]))
        good = good[harmful]
        better = np.zeros(count, np.bool_)
        for k in good[np.argsort(ours[good], kind="stable")]:  # the best of each is the last
            best[parent[k]], merit[parent[k]], better[parent[k]] = children[k], ours[k], True
        step *= np.where(better, _GROW, _SHRINK)
    found: Float = best[int(np.argmax(merit))]
    return found
