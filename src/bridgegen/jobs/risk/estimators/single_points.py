"""Detects events at single points: points of the event whose neighbours are not in the event.

Noise of perception is a function of the row, so a row beside a harmful one has other noise and may
be harmless. Proposals around such a row then draw harmful rows no more often than elsewhere, and
chains reach them by chance. Only Monte Carlo samples all of them without bias.

Points of a thin region look single as well, if their copies are too far away. So some of the points
that look single are tested again with copies that are much closer.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.jobs.risk.estimators.mixture import Kernels
from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, Problem, block_of

TRIED, COPIES = 128, 8
"""Points of the event around which copies are evaluated, and how many of each."""
OF_BUDGET = 10
"""The first copies take at most this part of the budget: a tenth."""
BESIDE, CLOSE = 0.01, 1e-4
"""Distance of copies in the first and in the second test, as a share of the kernels' width."""
AGAIN = 16
"""Maximum number of points that are tested again."""
ROUGH = 0.02
"""The share of single points beyond which an estimate is in doubt."""
_STREAM = 3  # of random numbers


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
        random = block_of(seed, 0, _STREAM)
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
