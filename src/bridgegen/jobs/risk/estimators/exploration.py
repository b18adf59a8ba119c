"""Exploration: events that no score leads to, their design point, events at single points."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.jobs.risk.estimators.mixture import Kernels
from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, Problem, block_of
from bridgegen.jobs.risk.estimators.weighted import Weighted

# Where subset simulation was in doubt, 20,000 uniform rows had 20 to 30 effective harmful ones.
# Rows of wider normal distributions had 2 to 6 of 25,000: far ends of the weather break
# constraints.
MOST = 20_000  # points
FEWEST = 5.0
"""Effective number of spread points of the event below which it is not known well."""
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


# --- The most likely point of an event: the design point of structural reliability ---
# Points that an estimator drew are typical of the event, and in many dimensions the typical ones
# are # far less likely than the likeliest. So the likeliest of them are moved on: some coordinates
# towards # the middle of the distribution, with noise; a move is kept if it is likelier and still
# the event.
#
# Source: Ditlevsen and Madsen, Structural Reliability Methods (1996), chapter 5, for the notion.


STARTS, CHILDREN = 8, 8
EVALUATIONS = 2048
"""Largest number of evaluations of a search for the most likely point: 32 rounds."""
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


# --- Detects events at single points: points of the event whose neighbours are not in the event ---
# Noise of perception is a function of the row, so a row beside a harmful one has other noise and
# may # be harmless. Proposals around such a row then draw harmful rows no more often than
# elsewhere, and # chains reach them by chance. Only Monte Carlo samples all of them without bias.
#
# Points of a thin region look single as well, if their copies are too far away. So some of the
# points # that look single are tested again with copies that are much closer.


TRIED, COPIES = 128, 8
"""Points of the event around which copies are evaluated, and how many of each."""
OF_BUDGET = 10
"""Part of the budget that the first copies take at most: a tenth."""
BESIDE, CLOSE = 0.01, 1e-4
"""Distance of copies in the first and in the second test, as a share of the kernels' width."""
AGAIN = 16
"""Maximum number of points that are tested again."""
ROUGH = 0.02
"""Share of single points beyond which an estimate is in doubt."""
_STREAM_OF_COPIES = 3  # of random numbers


@dataclass(frozen=True)
class SinglePoints:
    """Result of the test.

    Attributes:
        share: weighted share of the points of the event that are single.
        evaluations: number of evaluations spent.
    """

    share: float = 0.0
    evaluations: int = 0

    @classmethod
    def of(
        cls, problem: Problem, aim: Aim, seed: int, Z: Float, weights: Float, kernels: Kernels
    ) -> Self:
        """Evaluate copies of points of the event.

        Args:
            problem: the experiment.
            aim: the event; of its budget `most_evaluations` are spent at most.
            seed: of all random numbers.
            Z: ``(M, d)`` points of the event.
            weights: ``(M,)``, positive.
            kernels: as wide as proposals around the points would be.
        """
        tried = _tried(aim) if len(Z) else 0
        if tried < 1:
            return cls()
        random = block_of(seed, 0, _STREAM_OF_COPIES)
        points = Z[random.choice(len(Z), tried, p=weights / weights.sum())]

        def alone(points: Float, distance: float) -> tuple[Bool, int, int]:
            """Return which points are single, how many have feasible copies, and how many copies.

            A point without a feasible copy counts as not single.
            """
            noise = random.standard_normal((len(points), COPIES, Z.shape[1]))
            moves = distance * noise @ kernels.factor.T
            copies = (points[:, np.newaxis] + moves).reshape(-1, Z.shape[1])
            good = problem.feasible(copies)
            inside = np.zeros(len(copies), np.bool_)
            inside[good] = problem.evaluate(copies[good], aim.least)[:, SCORE] >= aim.threshold
            has_copies = good.reshape(-1, COPIES).any(axis=1)
            met = inside.reshape(-1, COPIES).any(axis=1)
            return np.asarray(has_copies & ~met), int(has_copies.sum()), int(good.sum())

        looks, tested, evaluations = alone(points, BESIDE)
        if not looks.any():
            return cls(0.0, evaluations)
        # Points of a thin region look single, too: they are asked again much closer. No point is
        # single then in eleven pairs without noise, and 9 to 36 % are with `reference`.
        single, again, more = alone(points[looks][:AGAIN], CLOSE)
        share = float(looks.sum() / tested * single.sum() / max(again, 1))
        return cls(share, evaluations + more)

    @property
    def doubt(self) -> str:
        """Why an estimate is not believed; empty if at most `ROUGH` of the points are single."""
        if self.share <= ROUGH:
            return ""
        return (
            f"{self.share:.0%} of the harmful rows are single ones, with none beside them, as "
            "noise makes them"
        )


def most_evaluations(aim: Aim) -> int:
    """Return the maximum number of evaluations of the test."""
    tried = _tried(aim)
    return COPIES * (tried + min(AGAIN, tried))


def _tried(aim: Aim) -> int:
    """Return the number of points around which copies are evaluated."""
    return min(TRIED, aim.budget // (OF_BUDGET * COPIES))
