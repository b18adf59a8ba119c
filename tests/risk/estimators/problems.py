"""Analytic problems: harm by a formula, whose probability is known."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.integrate
import scipy.stats

normal = scipy.stats.norm


@dataclass
class Analytic:
    """The event is score ≥ 0.

    Scores are computed in chunks of some rows, which must not matter; evaluations are counted.
    """

    dimensions: int
    score: Callable
    probability: float
    allowed: Callable = lambda Z: np.ones(len(Z), np.bool_)
    share: tuple[float, float, float] = (1.0, 1.0, 1.0)
    chunk: int = 10**9
    evaluations: int = field(default=0)
    columns: int = 2

    def feasible(self, Z):
        return self.allowed(Z)

    def spread(self, n, random):
        """Return points of a distribution twice as wide."""
        Z = 2.0 * random.standard_normal((n, self.dimensions))
        weights = 2.0**self.dimensions * np.exp(-0.375 * (Z * Z).sum(axis=1))
        return Z, weights * self.allowed(Z) / self.share[1]

    def evaluate(self, Z, least=-np.inf):
        assert self.allowed(Z).all()
        self.evaluations += len(Z)
        parts = [self.score(Z[k : k + self.chunk]) for k in range(0, len(Z), self.chunk)]
        score = np.concatenate(parts) if parts else np.empty(0)
        return np.column_stack([score, np.arange(len(Z)) * 0.0])


def linear(d, distance):
    """A half space: RP107 of the TU Delft challenge with ten dimensions and a distance of 5."""
    return Analytic(d, lambda Z: Z.sum(axis=1) / np.sqrt(d) - distance, normal.sf(distance))


def two_sides(d, right, left):
    """Two half spaces that do not meet."""
    return Analytic(
        d,
        lambda Z: np.maximum(Z[:, 0] - right, -Z[:, 0] - left),
        normal.sf(right) + normal.sf(left),
    )


def product():
    """RP111: four regions, between hyperbolas."""
    inner, _ = scipy.integrate.quad(
        lambda x: normal.pdf(x) * normal.sf(12.5 / x),
        1e-9,
        40.0,
        epsabs=0.0,
        epsrel=1e-10,
        limit=500,
    )
    return Analytic(2, lambda Z: np.abs(Z[:, 0] * Z[:, 1]) - 12.5, 4.0 * inner)


def bent():
    """RP22: a parabola."""

    def score(Z):
        x, y = Z.T
        return (x + y) / np.sqrt(2.0) - 2.5 - 0.1 * (x - y) ** 2

    return Analytic(2, score, 0.004207305511299618)


def wedge():
    """RP25: an intersection of a parabola's inside and a half plane."""

    def score(Z):
        x, y = Z.T
        return -np.maximum(x**2 - 8.0 * y + 16.0, -16.0 * x + y + 32.0)

    return Analytic(2, score, 4.148566293759747e-05)


def branches():
    """The four branch series system of Waarts (2000)."""

    def score(Z):
        x, y = Z.T
        root = np.sqrt(2.0)
        bow = 3.0 + 0.1 * (x - y) ** 2
        return -np.min(
            [bow - (x + y) / root, bow + (x + y) / root, x - y + 7.0 / root, y - x + 7.0 / root],
            axis=0,
        )

    return Analytic(2, score, 0.002222)


def stairs(d, distance):
    """A half space whose score has plateaus and jumps, as harm has."""

    def score(Z):
        s = Z.sum(axis=1) / np.sqrt(d)
        near = np.where(s < 1.0, 0.05 * np.exp(s - 1.0), 0.1 + 0.2 * (s - 1.0) / (distance - 1.0))
        return np.where(s < distance, near, np.where(s < distance + 0.3, 0.35, 0.7)) - 0.3

    return Analytic(d, score, normal.sf(distance))


def discrete(p):
    """A half space in one case of five, of which p is the share; three dimensions."""
    limit = normal.isf(p)

    def score(Z):
        case = Z[:, 1] > limit
        return np.where(case, Z[:, 0], np.minimum(Z[:, 0], 1.0) - 3.0) - 2.0

    return Analytic(3, score, p * normal.sf(2.0))


def constrained():
    """A half space, of whose half only a part is allowed."""
    return Analytic(
        4, lambda Z: Z[:, 0] - 3.0, normal.sf(3.0), lambda Z: Z[:, 1] < 0.0, (0.5, 0.5, 0.5)
    )


def misleading():
    """RP110: the score rises away from the event, and jumps there."""

    def score(Z):
        x, y = Z.T
        first = np.where(x <= 3.5, 0.85 - 0.1 * x, 4.0 - x)
        return -np.minimum(first, np.where(y <= 2.0, 2.3 - y, 0.5 - 0.1 * y))

    union = normal.sf(4.0) + normal.sf(5.0) - normal.sf(4.0) * normal.sf(5.0)
    return Analytic(2, score, union)


def hidden():
    """An event that no score leads to."""
    return Analytic(3, lambda Z: np.where(Z[:, 0] > 4.5, 0.1, -1.0), normal.sf(4.5))


def partly_hidden():
    """A score leads to a fifth of the probability, and says nothing of the rest."""
    shown, rest = normal.sf(4.5), normal.sf(4.2)

    def score(Z):
        return np.where(Z[:, 1] > 4.2, 0.1, Z[:, 0] - 4.5)

    return Analytic(3, score, shown + rest - shown * rest)


def noisy():
    """A half space, and single points anywhere: one of 10,000, by the bits of the point."""

    def score(Z):
        bits = np.ascontiguousarray(Z).view(np.uint64)
        mixed = bits[:, 0] ^ (bits[:, 1] * np.uint64(0x9E3779B97F4A7C15))
        mixed = (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
        mixed = (mixed ^ (mixed >> np.uint64(32))) * np.uint64(0x94D049BB133111EB)
        chance = (mixed >> np.uint64(11)) / 2.0**53
        return np.where(chance < 1e-4, 0.1, Z[:, 0] - 3.5)

    half = normal.sf(3.5)
    return Analytic(3, score, half + 1e-4 * (1.0 - half))


class AnalyticRoad:
    """A problem in the unit cube of a search, which holds normal scores of −4 to 4."""

    def __init__(self, problem):
        self.problem, self.dimensions, self.share = problem, problem.dimensions, problem.share
        self.continuous = np.ones(self.dimensions, np.bool_)

    def normal(self, U):
        return 8.0 * U - 4.0

    def rows(self, Z):
        inside = (np.abs(Z) < 4.0).all(axis=1)
        density = normal.logpdf(Z).sum(axis=1) - np.log(self.share[1])
        log_even = np.log(self.even_share) - self.dimensions * np.log(8.0) - density
        return np.clip((Z + 4.0) / 8.0, 0.0, 1.0), inside & self.problem.feasible(Z), log_even

    @property
    def even_share(self):
        """One over the share of the cube that is feasible: rows of `even` are uniform in it."""
        return 1.0 / self.share[1]

    def met(self, n, random):
        Z = random.standard_normal((8 * n + 100, self.dimensions))
        return Z[self.problem.feasible(Z)][:n]

    def even(self, n, random):
        Z = 8.0 * random.random((4 * n, self.dimensions)) - 4.0
        return Z[self.problem.feasible(Z)][:n], np.ones(n, np.bool_)
