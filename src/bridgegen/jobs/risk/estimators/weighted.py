"""What estimators return: weighted outcomes, from which the mean of any function follows.

The mean of f over the feasible distribution is the sum of weight times f over the outcomes, for
any f that is 0 below the least score. Intervals need what is independent of what: single rows, or
whole repetitions.

Sources: Clopper and Pearson, Biometrika 26 (1934) 404-413; Fay and Feuer, Statistics in Medicine 16
(1997) 791-801, for weighted sums of counts, with the mid-P correction of Fay and Kim, Biometrical
Journal 59 (2017) 1174-1186.
"""

from dataclasses import dataclass, field

import numpy as np
import scipy.stats

from bridgegen.base.arrays import Float, Int
from bridgegen.base.statistics import clopper_pearson, weighted_counts
from bridgegen.jobs.risk.estimators.problem import SCORE

LEVEL = 0.95
ONE_SIDED = 0.9
"""The two-sided level whose upper end is the one-sided bound of `LEVEL`."""
FEWEST_HITS = 30.0
"""Effective number of hits below which an interval of unequal weights is not believed."""


@dataclass(frozen=True)
class Probability:
    """An estimated probability, or mean of a number between 0 and 1.

    Attributes:
        estimate: the estimate.
        low: lower end of the 95 % interval.
        high: its upper end.
        upper: it is below this with 95 % confidence (one-sided).
    """

    estimate: float
    low: float
    high: float
    upper: float

    @property
    def precision(self) -> float:
        """Half of the interval over the estimate; inf if that is 0."""
        return 0.5 * (self.high - self.low) / self.estimate if self.estimate > 0.0 else np.inf

    def widened(self, low: float, high: float) -> "Probability":
        """Return it with its ends moved by factors, of at most and of at least 1."""
        return Probability(self.estimate, self.low * low, self.high * high, self.upper * high)


@dataclass(frozen=True)
class Weighted:
    """Outcomes with weights.

    Attributes:
        Z: ``(M, d)`` the points.
        outcomes: ``(M, C)``, see `Problem.evaluate`; their scores are the aim's least or more.
        weights: ``(M,)``.
        rows: how many independent rows were drawn; 0 where repetitions are independent.
        repetition: ``(M,)`` the number of each one's repetition; empty where rows are independent.
        repetitions: how many repetitions there are.
        largest: the largest weight that a row could have had.
        share: low, middle and high value of the factor that weights were multiplied by.
        evaluations: that it took, preparation included.
        doubts: why the interval should not be believed, a sentence each.
        facts: diagnostics by name.
        road: ``(n, C)`` whole outcomes, harmless ones as well, of the first independent rows that
            were drawn as on the road; there may be none.
    """

    Z: Float
    outcomes: Float
    weights: Float
    rows: int
    repetition: Int
    repetitions: int
    largest: float
    share: tuple[float, float, float]
    evaluations: int
    doubts: tuple[str, ...] = ()
    facts: dict[str, float] = field(default_factory=dict)
    road: Float = field(default_factory=lambda: np.empty((0, 0)))

    @property
    def scores(self) -> Float:
        """``(M,)``, the scores."""
        return self.outcomes[:, SCORE]

    def there(self, threshold: float) -> Float:
        """Return 1 of the outcomes whose score reaches a threshold, 0 of the others, ``(M,)``."""
        return (self.scores >= threshold).astype(np.float64)

    def probability(self, threshold: float) -> Probability:
        """Return the probability that the score reaches a threshold."""
        return self.mean(self.there(threshold))

    def hits(self, values: Float) -> float:
        """Return the effective number of outcomes behind a mean."""
        parts = self.weights * values
        squares = float(np.sum(parts * parts))
        return float(parts.sum()) ** 2 / squares if squares > 0.0 else 0.0

    def sums(self, values: Float) -> Float:
        """Return the mean of a function that each repetition estimates, ``(repetitions,)``."""
        parts = self.weights * values * self.repetitions
        return np.bincount(self.repetition, parts, self.repetitions).astype(np.float64)

    def mean(self, values: Float) -> Probability:
        """Return the mean of a function over the distribution.

        Args:
            values: ``(M,)`` in [0, 1], of each outcome; the function is 0 for all others.
        """
        parts = self.weights * values
        if self.repetitions:
            found = of_repetitions(self.sums(values))
        else:
            held = parts[parts > 0.0]
            each = held[0] if held.size else self.largest
            # Equal weights are a count, whose interval is exact; none needs the approximation.
            is_count = not held.size or np.ptp(held) == 0.0
            found = of_counts(held.size, self.rows, each) if is_count else of_weights(held)
        # The factor has an uncertainty of its own: the ends move by it.
        low, middle, high = self.share
        return found.widened(low / middle, high / middle)

    def draws(self, values: Float, random: np.random.Generator, n: int) -> tuple[Float, ...]:
        """Return draws of confidence distributions of a mean, of which sums of means are made.

        Args:
            values: as for `mean`.
            random: all random numbers.
            n: how many draws.

        Returns:
            ``(n,)`` each: of which lower ends are quantiles; the same, raised by what regions may
            have that were not seen; and that with one more hit of the largest weight, of which the
            upper ends of the mean by itself are quantiles (Fay and Feuer's upper end).
        """
        parts = self.weights * values
        held = parts[parts > 0.0]
        if self.repetitions:
            sums = self.sums(values)
            # Student's spread of the mean of few, by the variance of a gamma distribution.
            wide = float(scipy.stats.t.ppf(0.975, len(sums) - 1) / scipy.stats.norm.ppf(0.975)) ** 2
            lower, upper = (
                _gamma(float(some.mean()), wide * float(some.var(ddof=1)) / len(sums), random, n)
                for some in (sums, np.append(sums, sums.max()))
            )
            upper = upper if held.size else np.ones(n)
        elif not held.size or np.ptp(held) == 0.0:
            hits, rows = held.size, self.rows
            factor = rows * float(held[0] if hits else self.largest)
            lower = factor * random.beta(hits, rows - hits + 1, n) if hits else np.zeros(n)
            upper = np.full(n, factor) if rows else np.ones(n)
            if hits < rows:
                upper = factor * random.beta(hits + 1, rows - hits, n)
        else:
            total, square, largest = float(held.sum()), float(held @ held), float(held.max())
            lower = _gamma(total, square, random, n)
            upper = _gamma(total + largest, square + largest**2, random, n)
        low, middle, high = self.share
        less, more = random.exponential(size=(2, n))
        # 97.5 % of exponential numbers are below 3.69, and 95 % below 3, as in the rule of three.
        lowered = np.maximum(1.0 - (1.0 - low / middle) * less / 3.69, 0.0)
        raised = 1.0 + (high / middle - 1.0) * more / 3.0
        return lower * lowered, np.minimum(lower * raised, 1.0), np.minimum(upper * raised, 1.0)


def _gamma(mean: float, variance: float, random: np.random.Generator, n: int) -> Float:
    if not (mean > 0.0 and variance > 0.0):
        return np.full(n, mean)
    return random.gamma(mean * mean / variance, variance / mean, n)


def of_counts(hits: int, rows: int, each: float) -> Probability:
    """Return the exact interval of what hits sum up to.

    Args:
        hits: how many there are.
        rows: of so many independent rows.
        each: how much one counts.
    """
    if not rows:
        return Probability(0.0, 0.0, 1.0, 1.0)
    factor = rows * float(each)
    low, high = clopper_pearson(hits, rows, LEVEL)
    _, upper = clopper_pearson(hits, rows, ONE_SIDED)
    return Probability(hits / rows * factor, low * factor, high * factor, upper * factor)


def of_weights(parts: Float) -> Probability:
    """Return the interval of a sum of weights of hits, see `weighted_counts`."""
    return Probability(*weighted_counts(parts))


def of_repetitions(sums: Float) -> Probability:
    """Return the interval of a mean of independent repetitions.

    Student's interval of the logarithm of the mean, because repetitions are skewed to the right.
    Few repetitions may lack a large one, so upper ends are computed with one more repetition that
    equals the largest.

    Args:
        sums: ``(R,)`` the estimate of each, R ≥ 2.
    """
    mean = float(sums.mean())
    if not mean > 0.0:
        return Probability(0.0, 0.0, 1.0, 1.0)
    more = np.append(sums, sums.max())
    tail = 0.5 * (1.0 - LEVEL)
    return Probability(
        mean,
        _quantile(sums, tail),
        min(_quantile(more, 1.0 - tail), 1.0),
        min(_quantile(more, LEVEL), 1.0),
    )


def _quantile(sums: Float, confidence: float) -> float:
    """Return what the mean of repetitions is below with a confidence."""
    count, mean = len(sums), float(sums.mean())
    spread = float(sums.std(ddof=1)) / np.sqrt(count) / mean
    return mean * float(np.exp(scipy.stats.t.ppf(confidence, count - 1) * spread))
