"""Families of continuous distributions: functions of a value and of numbers that may differ by row.

Lower and upper tail are computed apart, so that neither loses its digits far out. All is made of
operations that give a row the same bits whatever the batch around it.
Sources: Johnson, Kotz and Balakrishnan, Continuous Univariate Distributions, 2nd ed. (1994);
generalised Pareto: Pickands, Annals of Statistics 3 (1975) 119-131.
"""

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
import scipy

from bridgegen.base.arrays import Float
from bridgegen.scenario.language.expression import FUNCTIONS

_exp, _log = FUNCTIONS["exp"][2], FUNCTIONS["log"][2]
_LOG_ROOT = 0.5 * math.log(2.0 * math.pi)

Value = Float | float


class Family(ABC):
    """A family of distributions.

    Each function takes numbers or arrays of one shape: ``x``, then those of ``keys`` in order.

    Attributes:
        name: in a scenario file.
        keys: its numbers.
        measured: those that have the parameter's unit.
        positive: those that must be above 0.
    """

    name: ClassVar[str]
    keys: ClassVar[tuple[str, ...]]
    measured: ClassVar[frozenset[str]]
    positive: ClassVar[frozenset[str]]

    @staticmethod
    @abstractmethod
    def below(x: Value, *numbers: Value) -> Any:
        """Return the probability below a value."""

    @staticmethod
    @abstractmethod
    def above(x: Value, *numbers: Value) -> Any:
        """Return the probability above a value."""

    @staticmethod
    @abstractmethod
    def value_below(p: Value, *numbers: Value) -> Any:
        """Return the value with this probability below it."""

    @staticmethod
    @abstractmethod
    def value_above(p: Value, *numbers: Value) -> Any:
        """Return the value with this probability above it."""

    @staticmethod
    @abstractmethod
    def log_density(x: Value, *numbers: Value) -> Any:
        """Return the natural logarithm of the density; -inf outside the support."""


class Normal(Family):
    """By mean and standard deviation."""

    name = "normal"
    keys = ("mean", "deviation")
    measured = frozenset(keys)
    positive = frozenset({"deviation"})

    @staticmethod
    def below(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        mean, deviation = numbers
        return scipy.special.ndtr((x - mean) / deviation)

    @staticmethod
    def above(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        mean, deviation = numbers
        return scipy.special.ndtr((mean - x) / deviation)

    @staticmethod
    def value_below(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        mean, deviation = numbers
        return mean + deviation * scipy.special.ndtri(p)

    @staticmethod
    def value_above(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        mean, deviation = numbers
        return mean - deviation * scipy.special.ndtri(p)

    @staticmethod
    def log_density(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        mean, deviation = numbers
        standard = (x - mean) / deviation
        return -0.5 * standard * standard - _log(deviation) - _LOG_ROOT


class LogNormal(Family):
    """By median and standard deviation of the natural logarithm."""

    name = "lognormal"
    keys = ("median", "log_deviation")
    measured = frozenset({"median"})
    positive = frozenset(keys)

    @staticmethod
    def _standard(x: Value, median: Value, log_deviation: Value) -> Any:
        return _log(np.maximum(x, 0.0) / median) / log_deviation

    @staticmethod
    def below(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return scipy.special.ndtr(LogNormal._standard(x, *numbers))

    @staticmethod
    def above(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return scipy.special.ndtr(-LogNormal._standard(x, *numbers))

    @staticmethod
    def value_below(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        median, log_deviation = numbers
        return median * _exp(log_deviation * scipy.special.ndtri(p))

    @staticmethod
    def value_above(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        median, log_deviation = numbers
        return median * _exp(-log_deviation * scipy.special.ndtri(p))

    @staticmethod
    def log_density(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        standard = LogNormal._standard(x, *numbers)
        density = -0.5 * standard * standard - _log(np.maximum(x, 0.0)) - _log(numbers[1])
        return np.where(np.asarray(x) > 0.0, density - _LOG_ROOT, -np.inf)


class Exponential(Family):
    """From 0, by its mean."""

    name = "exponential"
    keys = ("mean",)
    measured = frozenset(keys)
    positive = frozenset(keys)

    @staticmethod
    def below(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return -scipy.special.expm1(-np.maximum(x, 0.0) / numbers[0])

    @staticmethod
    def above(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return _exp(-np.maximum(x, 0.0) / numbers[0])

    @staticmethod
    def value_below(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return -numbers[0] * scipy.special.log1p(-np.asarray(p))

    @staticmethod
    def value_above(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return -numbers[0] * _log(p)

    @staticmethod
    def log_density(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return np.where(np.asarray(x) >= 0.0, -x / numbers[0] - _log(numbers[0]), -np.inf)


class Gamma(Family):
    """From 0, by shape and scale."""

    name = "gamma"
    keys = ("shape", "scale")
    measured = frozenset({"scale"})
    positive = frozenset(keys)

    @staticmethod
    def below(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        shape, scale = numbers
        return scipy.special.gammainc(shape, np.maximum(x, 0.0) / scale)

    @staticmethod
    def above(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        shape, scale = numbers
        return scipy.special.gammaincc(shape, np.maximum(x, 0.0) / scale)

    @staticmethod
    def value_below(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        shape, scale = numbers
        return scale * scipy.special.gammaincinv(shape, p)

    @staticmethod
    def value_above(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        shape, scale = numbers
        return scale * scipy.special.gammainccinv(shape, p)

    @staticmethod
    def log_density(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        shape, scale = numbers
        ratio = np.maximum(x, 0.0) / scale
        density = scipy.special.xlogy(shape - 1.0, ratio) - ratio
        density = density - scipy.special.gammaln(shape) - _log(scale)
        return np.where(np.asarray(x) >= 0.0, density, -np.inf)


class Weibull(Family):
    """From 0, by shape and scale."""

    name = "weibull"
    keys = ("shape", "scale")
    measured = frozenset({"scale"})
    positive = frozenset(keys)

    @staticmethod
    def _hazard(x: Value, shape: Value, scale: Value) -> Any:
        return _exp(shape * _log(np.maximum(x, 0.0) / scale))

    @staticmethod
    def below(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return -scipy.special.expm1(-Weibull._hazard(x, *numbers))

    @staticmethod
    def above(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return _exp(-Weibull._hazard(x, *numbers))

    @staticmethod
    def value_below(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        shape, scale = numbers
        return scale * _exp(_log(-scipy.special.log1p(-np.asarray(p))) / shape)

    @staticmethod
    def value_above(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        shape, scale = numbers
        return scale * _exp(_log(-_log(p)) / shape)

    @staticmethod
    def log_density(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        shape, scale = numbers
        ratio = np.maximum(x, 0.0) / scale
        density = _log(shape / scale) + scipy.special.xlogy(shape - 1.0, ratio)
        return np.where(np.asarray(x) >= 0.0, density - Weibull._hazard(x, *numbers), -np.inf)


class Beta(Family):
    """By alpha and beta, from a start to an end, which are not among its keys."""

    name = "beta"
    keys = ("alpha", "beta")
    measured = frozenset()
    positive = frozenset(keys)

    @staticmethod
    def _part(x: Value, start: Value, end: Value) -> Any:
        return np.clip((x - start) / (end - start), 0.0, 1.0)

    @staticmethod
    def below(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        alpha, beta, start, end = numbers
        return scipy.special.betainc(alpha, beta, Beta._part(x, start, end))

    @staticmethod
    def above(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        alpha, beta, start, end = numbers  # mirrored, the upper end keeps its digits
        part = np.clip((end - x) / (end - start), 0.0, 1.0)
        return scipy.special.betainc(beta, alpha, part)

    @staticmethod
    def value_below(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        alpha, beta, start, end = numbers
        return start + (end - start) * scipy.special.betaincinv(alpha, beta, p)

    @staticmethod
    def value_above(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        alpha, beta, start, end = numbers
        return end - (end - start) * scipy.special.betaincinv(beta, alpha, p)

    @staticmethod
    def log_density(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        alpha, beta, start, end = numbers
        part = Beta._part(x, start, end)
        density = scipy.special.xlogy(alpha - 1.0, part)
        density = density + scipy.special.xlog1py(beta - 1.0, -part)
        return density - scipy.special.betaln(alpha, beta) - _log(end - start)


class Pareto(Family):
    """Generalised Pareto distribution: from a threshold, by shape and scale."""

    name = "pareto"
    keys = ("threshold", "shape", "scale")
    measured = frozenset({"threshold", "scale"})
    positive = frozenset({"scale"})

    @staticmethod
    def _hazard(x: Value, threshold: Value, shape: Value, scale: Value) -> Any:
        """Return minus the logarithm of the probability above."""
        excess = np.maximum(x - threshold, 0.0) / scale
        # With a negative shape the distribution ends; beyond its end the logarithm has no value.
        inner = np.maximum(shape * excess, -1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            curved = scipy.special.log1p(inner) / shape
        # Shape 0 is the exponential distribution, as the limit of both formulas, which divide by
        # it.
        return np.where(np.asarray(shape) == 0.0, excess, curved)

    @staticmethod
    def _value(hazard: Value, threshold: Value, shape: Value, scale: Value) -> Any:
        with np.errstate(divide="ignore", invalid="ignore"):
            curved = scipy.special.expm1(shape * hazard) / shape
        return threshold + scale * np.where(np.asarray(shape) == 0.0, hazard, curved)

    @staticmethod
    def below(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return -scipy.special.expm1(-Pareto._hazard(x, *numbers))

    @staticmethod
    def above(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return _exp(-Pareto._hazard(x, *numbers))

    @staticmethod
    def value_below(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return Pareto._value(-scipy.special.log1p(-np.asarray(p)), *numbers)

    @staticmethod
    def value_above(p: Value, *numbers: Value) -> Any:
        """See `Family`."""
        return Pareto._value(-_log(p), *numbers)

    @staticmethod
    def log_density(x: Value, *numbers: Value) -> Any:
        """See `Family`."""
        threshold, shape, scale = numbers
        hazard = Pareto._hazard(x, *numbers)
        inside = (x >= threshold) & (1.0 + shape * (x - threshold) / scale > 0.0)
        return np.where(inside, -(1.0 + shape) * hazard - _log(scale), -np.inf)


FAMILIES: dict[str, type[Family]] = {
    function.name: function
    for function in (Normal, LogNormal, Exponential, Gamma, Weibull, Beta, Pareto)
}
