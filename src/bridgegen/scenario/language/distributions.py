"""How a parameter's values are distributed, where they are not spread evenly over its range.

A search goes over the unit cube; a distribution turns a share of 0 to 1 into a value by its inverse
distribution function. So random search draws from the distribution, a Sobol sequence covers it
evenly, and any other algorithm goes from the rare through the usual to the rare.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np
import scipy  # its parts are imported as they are used: they take a tenth of a second

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.expression import FUNCTIONS

TAIL = 1e-6
"""The probability that is cut off at an end where a distribution has none."""

_MOST_EXPECTED = 1e8  # of a Poisson distribution: 1e5 values are within its tails
_exp, _log = FUNCTIONS["exp"][2], FUNCTIONS["log"][2]  # the same bits in any batch


class Distribution(Protocol):
    """A probability distribution of finite support."""

    @property
    def low(self) -> float:
        """Smallest value."""

    @property
    def high(self) -> float:
        """Largest value."""

    def value(self, share: Float) -> Float:
        """Return the values below which these shares of the probability are, ``(N,)``.

        Args:
            share: ``(N,)`` in [0, 1].
        """

    def share(self, value: Float) -> Float:
        """Return shares that ``value`` gives these values for, ``(N,)``.

        Args:
            value: ``(N,)`` in [low, high].
        """

    def density(self, value: Float) -> Float:
        """Return the density at these values, ``(N,)``; of single values, their probability.

        Args:
            value: ``(N,)``; 0 outside [low, high].
        """


def shares_within(distribution: Distribution, low: float, high: float) -> tuple[Float, Float]:
    """Return the first and the last share of a distribution's values in [low, high].

    The last is at most the first where there is none of any probability.
    """

    def first(holds: Callable[[float], bool]) -> float:
        """Return the first share at which the value is so: it is from there on."""
        # A bisection: `share` gives the middle of the shares of a single value, and not the first.
        # It ends where no float lies between the two.
        below, above = 0.0, 1.0
        if holds(float(distribution.value(np.array([below]))[0])):
            return below
        while below < (middle := below + (above - below) / 2) < above:
            if holds(float(distribution.value(np.array([middle]))[0])):
                above = middle
            else:
                below = middle
        return above

    last = first(lambda value: value > high) if distribution.high > high else 1.0
    begin = first(lambda value: value >= low) if distribution.high >= low else 1.0
    return np.array(begin), np.array(last)


@dataclass(frozen=True)
class Uniform:
    """All values of an interval, equally likely.

    Attributes:
        low: smallest value.
        high: largest value.

    Raises:
        InputError: the ends are not finite, or in the wrong order.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        if not -math.inf < self.low <= self.high < math.inf:
            raise InputError(
                f"low <= high must hold for a range, got {self.low:g} and {self.high:g}"
            )

    def value(self, share: Float) -> Float:
        """See `Distribution`."""
        value: Float = np.minimum(self.low + share * (self.high - self.low), self.high)
        return value

    def share(self, value: Float) -> Float:
        """See `Distribution`."""
        width = self.high - self.low
        # Every share gives the only value of an empty interval; the middle one is as good as any.
        return (value - self.low) / width if width > 0.0 else np.full(len(value), 0.5)

    def density(self, value: Float) -> Float:
        """See `Distribution`; of a single value, its probability."""
        height = 1.0 / (self.high - self.low) if self.low < self.high else 1.0
        return np.where((self.low <= value) & (value <= self.high), height, 0.0)


@dataclass(frozen=True)
class Normal:
    """A normal distribution, cut off at both ends.

    Attributes:
        mean: of the whole distribution.
        deviation: its standard deviation, > 0.
        limits: where it is cut off; at ``TAIL`` of the probability by default.

    Raises:
        InputError: no deviation, or no probability within the limits.
    """

    mean: float
    deviation: float
    limits: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and 0.0 < self.deviation < math.inf):
            raise InputError(
                "a normal distribution needs a finite expected value and a variance above 0, got "
                f"{self.mean:g} and {self.deviation**2:g}"
            )
        if not self._ends[0] < self._ends[1]:
            raise InputError(
                f"a normal distribution (expected value {self.mean:g}, standard deviation "
                f"{self.deviation:g}) has no probability from {self.low:g} to {self.high:g}"
            )

    @cached_property
    def low(self) -> float:
        """Smallest value."""
        if self.limits:
            return self.limits[0]
        return self.mean + self.deviation * float(scipy.special.ndtri(TAIL))

    @cached_property
    def high(self) -> float:
        """Largest value."""
        if self.limits:
            return self.limits[1]
        return self.mean - self.deviation * float(scipy.special.ndtri(TAIL))

    @cached_property
    def _sign(self) -> float:
        """-1 where all is above the mean: there the upper tail has the digits."""
        return -1.0 if self.low > self.mean else 1.0

    @cached_property
    def _ends(self) -> tuple[float, float]:
        """The probability below the lower of the (mirrored) limits, and below the upper."""
        ends = sorted(self._sign * (value - self.mean) for value in (self.low, self.high))
        below, above = (float(scipy.special.ndtr(end / self.deviation)) for end in ends)
        return below, above

    def value(self, share: Float) -> Float:
        """See `Distribution`."""
        below, above = self._ends
        if self._sign < 0.0:
            share = 1.0 - share
        standard = self._sign * scipy.special.ndtri(below + share * (above - below))
        value: Float = np.clip(self.mean + self.deviation * standard, self.low, self.high)
        return value

    def share(self, value: Float) -> Float:
        """See `Distribution`."""
        below, above = self._ends
        standard = self._sign * (value - self.mean) / self.deviation
        share = np.clip((scipy.special.ndtr(standard) - below) / (above - below), 0.0, 1.0)
        return share if self._sign > 0.0 else 1.0 - share

    def density(self, value: Float) -> Float:
        """See `Distribution`."""
        below, above = self._ends
        standard = (value - self.mean) / self.deviation
        height = _exp(-0.5 * standard * standard) / (self.deviation * math.sqrt(2.0 * math.pi))
        return np.where((self.low <= value) & (value <= self.high), height / (above - below), 0.0)


@dataclass(frozen=True)
class LogNormal:
    """A distribution whose logarithm is normal.

    Attributes:
        logarithm: the distribution of the natural logarithm.
    """

    logarithm: Normal

    @classmethod
    def of(
        cls, mean: float, variance: float, limits: tuple[float, float] | None = None
    ) -> "LogNormal":
        """Return the one with this mean and variance, both of the value and not of its logarithm.

        Args:
            mean: > 0.
            variance: > 0.
            limits: where it is cut off; at ``TAIL`` of the probability by default.

        Raises:
            InputError: a number out of range, or no probability within the limits.
        """
        if not (0.0 < mean < math.inf and 0.0 < variance < math.inf):
            raise InputError(
                "a log-normal distribution needs an expected value and a variance above 0, got "
                f"{mean:g} and {variance:g}"
            )
        if limits and not limits[0] > 0.0:
            raise InputError(f"a log-normal distribution is above 0, got the limit {limits[0]:g}")
        # OpenSCENARIO gives the moments of the value itself: m = exp(μ + σ²/2) and v = m²·(exp(σ²)
        # − 1), solved for σ² and μ.
        square = elementary.log(1.0 + variance / mean**2)
        logs = (elementary.log(limits[0]), elementary.log(limits[1])) if limits else None
        return cls(Normal(elementary.log(mean) - 0.5 * square, math.sqrt(square), logs))

    @property
    def low(self) -> float:
        """Smallest value."""
        return elementary.exp(self.logarithm.low)

    @property
    def high(self) -> float:
        """Largest value."""
        return elementary.exp(self.logarithm.high)

    def value(self, share: Float) -> Float:
        """See `Distribution`."""
        value: Float = np.clip(_exp(self.logarithm.value(share)), self.low, self.high)
        return value

    def share(self, value: Float) -> Float:
        """See `Distribution`."""
        return self.logarithm.share(_log(value))

    def density(self, value: Float) -> Float:
        """See `Distribution`."""
        inside = (self.low <= value) & (value <= self.high)
        kept = np.where(inside, value, self.low)
        return np.where(inside, self.logarithm.density(_log(kept)) / kept, 0.0)


@dataclass(frozen=True)
class Discrete:
    """Single values, each with its weight.

    Attributes:
        values: ascending, at least one.
        weights: > 0, of any sum.
    """

    values: tuple[float, ...]
    weights: tuple[float, ...]

    @classmethod
    def of(cls, values: Sequence[float], weights: Sequence[float] | None = None) -> "Discrete":
        """Return the distribution of values in any order, equally likely by default.

        Raises:
            InputError: a value that is not finite, a weight below 0, or nothing above 0.
        """
        weights = [1.0] * len(values) if weights is None else weights
        if not all(map(math.isfinite, values)):
            raise InputError(f"the values must be finite, got {', '.join(map(str, values))}")
        _check_weights(weights)
        total: dict[float, float] = {}
        for value, weight in zip(values, weights, strict=True):
            if weight > 0.0:
                total[value] = total.get(value, 0.0) + weight
        return cls(tuple(sorted(total)), tuple(total[value] for value in sorted(total)))

    @classmethod
    def poisson(cls, mean: float, limits: tuple[float, float] | None = None) -> "Discrete":
        """Return a Poisson distribution, cut off at both ends.

        Args:
            mean: above 0, at most 1e8.
            limits: where it is cut off; at ``TAIL`` of the probability by default.

        Raises:
            InputError: a mean out of range, or no probability within the limits.
        """
        if not 0.0 < mean <= _MOST_EXPECTED:
            raise InputError(
                f"a Poisson distribution needs an expected value above 0, at most "
                f"{_MOST_EXPECTED:g}, got {mean:g}"
            )
        low, high = limits or (0.0, math.inf)
        # The tails are left out even within limits: wide limits would make a table of values that
        # have next to no probability.
        first = max(math.ceil(low), math.floor(float(scipy.special.pdtrik(TAIL, mean))), 0)
        last = min(high, math.ceil(float(scipy.special.pdtrik(1.0 - TAIL, mean))))
        counts = np.arange(first, math.floor(last) + 1, dtype=np.float64)
        if not len(counts):
            raise InputError(
                f"a Poisson distribution (expected value {mean:g}) has a probability below "
                f"{TAIL:g} from {low:g} to {high:g}"
            )
        # By logarithms: the powers and the factorials overflow a float for means above about 100.
        weights = elementary.exp(
            counts * elementary.log(mean) - mean - scipy.special.gammaln(counts + 1.0)
        )
        return cls.of(counts.tolist(), weights.tolist())

    @property
    def low(self) -> float:
        """Smallest value."""
        return self.values[0]

    @property
    def high(self) -> float:
        """Largest value."""
        return self.values[-1]

    @cached_property
    def _table(self) -> tuple[Float, Float]:
        """The values, and the probability up to and including each."""
        up_to = np.cumsum(self.weights)
        return np.array(self.values), up_to / up_to[-1]

    def value(self, share: Float) -> Float:
        """See `Distribution`."""
        values, up_to = self._table
        # Without the last sum, which is 1: a share of 1 would otherwise get the place after the
        # last value.
        found: Float = values[np.searchsorted(up_to[:-1], share, side="right")]
        return found

    def share(self, value: Float) -> Float:
        """See `Distribution`; the middle of those that give the nearest value."""
        values, up_to = self._table
        nearest = np.abs(value[:, np.newaxis] - values).argmin(axis=1)
        middle: Float = (up_to - 0.5 * np.diff(up_to, prepend=0.0))[nearest]
        return middle

    def density(self, value: Float) -> Float:
        """See `Distribution`: the probability of a value."""
        values, up_to = self._table
        # A value above all others gets the place after the last one; the comparison below gives it
        # 0.
        at = np.minimum(np.searchsorted(values, value), len(values) - 1)
        return np.where(values[at] == value, np.diff(up_to, prepend=0.0)[at], 0.0)


@dataclass(frozen=True)
class Histogram:
    """Intervals, each with its weight, and evenly filled.

    Attributes:
        bins: lower and upper end, ascending, not overlapping.
        weights: > 0, of any sum.
    """

    bins: tuple[tuple[float, float], ...]
    weights: tuple[float, ...]

    @classmethod
    def of(cls, bins: Sequence[tuple[float, float]], weights: Sequence[float]) -> "Histogram":
        """Return the distribution of bins in any order; those of weight 0 are left out.

        Raises:
            InputError: a bin that is empty, infinite, or overlaps another; a weight below 0, or
                nothing above 0.
        """
        _check_weights(weights)
        both = sorted(pair for pair in zip(bins, weights, strict=True) if pair[1] > 0.0)
        for (low, high), _ in both:
            if not (math.isfinite(low) and low < high < math.inf):
                raise InputError(f"low < high must hold for a bin, got {low:g} and {high:g}")
        for ((low, high), _), (after, _) in pairwise(both):
            if after[0] < high:
                raise InputError(
                    f"bins must not overlap, got {low:g} to {high:g} and {after[0]:g} to "
                    f"{after[1]:g}"
                )
        return cls(tuple(pair for pair, _ in both), tuple(weight for _, weight in both))

    @property
    def low(self) -> float:
        """Smallest value."""
        return self.bins[0][0]

    @property
    def high(self) -> float:
        """Largest value."""
        return self.bins[-1][1]

    @cached_property
    def _table(self) -> tuple[Float, Float, Float]:
        """The bins' lower ends and widths, and the probability below each end of a bin."""
        ends = np.array(self.bins)
        below = np.concatenate([[0.0], np.cumsum(self.weights)])
        return ends[:, 0], ends[:, 1] - ends[:, 0], below / below[-1]

    def value(self, share: Float) -> Float:
        """See `Distribution`."""
        start, width, below = self._table
        at = np.searchsorted(below[1:-1], share, side="right")
        within = (share - below[at]) / (below[at + 1] - below[at])
        return np.minimum(start[at] + within * width[at], start[at] + width[at])

    def share(self, value: Float) -> Float:
        """See `Distribution`."""
        start, width, below = self._table
        at = np.maximum(np.searchsorted(start, value, side="right") - 1, 0)
        within = np.clip((value - start[at]) / width[at], 0.0, 1.0)
        share: Float = below[at] + within * (below[at + 1] - below[at])
        return share

    def density(self, value: Float) -> Float:
        """See `Distribution`; at an end that two bins share, that of the upper one."""
        start, width, below = self._table
        at = np.maximum(np.searchsorted(start, value, side="right") - 1, 0)
        inside = (start[at] <= value) & (value <= start[at] + width[at])
        return np.where(inside, np.diff(below)[at] / width[at], 0.0)


def _check_weights(weights: Sequence[float]) -> None:
    if not all(0.0 <= weight < math.inf for weight in weights) or not any(weights):
        raise InputError(
            "weights must be at least 0 and finite, and one above 0, got "
            f"{', '.join(f'{weight:g}' for weight in weights)}"
        )
