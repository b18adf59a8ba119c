"""What estimators of rare events are given: a score in standard normal space, and an aim."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bridgegen.base.arrays import Bool, Float

SCORE = 0
"""Column of an outcome with the score: how near a row is to the event, which happens from the aim
on."""


class Problem(Protocol):
    """A random experiment: points of standard normal space, and the outcome of each."""

    @property
    def dimensions(self) -> int:
        """The number of independent standard normal variables, ≥ 1."""

    @property
    def columns(self) -> int:
        """The number of columns of an outcome, ≥ 1."""

    @property
    def share(self) -> tuple[float, float, float]:
        """The probability that a point is feasible, and its 95 % interval."""

    def feasible(self, Z: Float) -> Bool:
        """Return which of N points ``(N, dimensions)`` can happen at all, ``(N,)``."""

    def spread(self, n: int, random: np.random.Generator) -> tuple[Float, Float]:
        """Return points that are spread over all of the space, and their weights.

        Args:
            n: how many.
            random: all random numbers.

        Returns:
            ``(n, dimensions)``, independent; and ``(n,)``, how much likelier each one is among
            feasible points than among these: 0 of one that is not feasible.
        """

    def evaluate(self, Z: Float, least: float = -np.inf) -> Float:
        """Evaluate N feasible points; a point's outcome depends on that point alone.

        Args:
            Z: ``(N, dimensions)``.
            least: outcomes with a lower score may be returned as any lower score.

        Returns:
            ``(N, columns)``; column `SCORE` is the score, the others belong to the problem.
        """


@dataclass(frozen=True)
class Aim:
    """The event whose probability is estimated, and how well.

    Attributes:
        threshold: it happens from this score on.
        least: a lower score of which the outcomes are kept as well, at most ``threshold``.
        budget: evaluations, exactly or fewer.
        precision: half of the 95 % interval over the estimate, at which an estimator may stop; 0
            to use the whole budget.
    """

    threshold: float
    least: float
    budget: int
    precision: float


def block_of(seed: int, *path: int) -> np.random.Generator:
    """Return the random numbers of one block of work; each block has its own."""
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, *path))))
