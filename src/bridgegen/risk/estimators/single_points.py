"""Whether an event happens at single points, with none of it close by, as noise makes it happen.

Harm that has noise of its own, as that of perception, happens here and there. What is learnt of
such a point says nothing of the points around it: proposals around it meet the event no more often
than elsewhere, and chains meet it by chance. Only Monte Carlo sees it all.

Points of a thin region look so, too, until copies are close enough; so some of the points that seem
single are looked at again, from closer by.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from bridgegen.arrays import Bool, Float
from bridgegen.risk.estimators.mixture import Kernels
from bridgegen.risk.estimators.problem import SCORE, Aim, Problem, block_of

TRIED, COPIES = 128, 8
"""Points of the event around which copies are evaluated, and how many of each."""
OF_BUDGET = 10  # of which the first copies take one part at most
BESIDE, CLOSE = 0.01, 1e-4
"""How far away copies are, as a share of kernels that proposals would have around the points."""
AGAIN = 16  # points that seem single, at most, are looked at from close by
ROUGH = 0.02
"""The share of single points beyond which an estimate is in doubt."""
_STREAM = 3  # of random numbers


@dataclass(frozen=True)
class SinglePoints:
    """What was seen of single points.

    Attributes:
        share: of weighted points of the event, those of which no copy is in it.
        evaluations: that it took.
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
            """Return whether each is alone, how many have copies, and how many copies these are."""
            noise = random.standard_normal((len(points), COPIES, Z.shape[1]))
            moves = distance * noise @ kernels.factor.T
            copies = (points[:, np.newaxis] + moves).reshape(-1, Z.shape[1])
            good = problem.feasible(copies)
            inside = np.zeros(len(copies), np.bool_)
            inside[good] = problem.evaluate(copies[good], aim.least)[:, SCORE] >= aim.threshold
            has_copies = good.reshape(-1, COPIES).any(axis=1)
            met = inside.reshape(-1, COPIES).any(axis=1)
            return np.asarray(has_copies & ~met), int(has_copies.sum()), int(good.sum())

        seems, of, evaluations = alone(points, BESIDE)
        if not seems.any():
            return cls(0.0, evaluations)
        single, looked, more = alone(points[seems][:AGAIN], CLOSE)
        share = float(seems.sum() / of * single.sum() / max(looked, 1))
        return cls(share, evaluations + more)

    @property
    def doubt(self) -> str:
        """Why an estimate is not believed; empty where hardly any point is single."""
        if self.share <= ROUGH:
            return ""
        return (
            f"{self.share:.0%} of the harmful rows are single ones, with none beside them, as "
            "noise makes them"
        )


def most_evaluations(aim: Aim) -> int:
    """Return how many evaluations looking for single points takes at most."""
    tried = _tried(aim)
    return COPIES * (tried + min(AGAIN, tried))


def _tried(aim: Aim) -> int:
    """Return the number of points around which copies are evaluated."""
    return min(TRIED, aim.budget // (OF_BUDGET * COPIES))
