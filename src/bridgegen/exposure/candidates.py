"""Forms fitted to values: maximum likelihood within a range, and which form describes them best.

Forms are compared by Akaike's criterion, 2k - 2 log L. A kernel density has no k; its criterion is
-2 times its leave-one-out log likelihood, which estimates the same: the log density of values that
were not seen (Stone, Journal of the Royal Statistical Society B 39 (1977) 44-47).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from bridgegen.arrays import Float
from bridgegen.errors import InputError
from bridgegen.exposure.families import FAMILIES, Family, Pareto
from bridgegen.exposure.kernels import estimate, left_out_log_densities, usual_bandwidth

LEAST_EXCEEDANCES = 50
"""Values beyond the threshold of a tail: the standard error of its shape is 1/√50 = 0.14 then."""

TAIL_SHARE = 0.1
"""Of the values, those that are a tail of their own."""

_DIGITS = 6
_BODIES = ("uniform", "normal", "lognormal", "exponential", "gamma", "weibull", "beta", "kde")
_POSITIVE = ("lognormal", "exponential", "gamma", "weibull")

Section = dict[str, Any]


@dataclass(frozen=True)
class Recipe:
    """What is fitted again to other values: everything that a choice by the data decided.

    Attributes:
        body: the form between the tails.
        lower: threshold of the lower tail, or None.
        upper: threshold of the upper tail, or None.
        bandwidth: of a kernel density; None for others.
    """

    body: str
    lower: float | None = None
    upper: float | None = None
    bandwidth: float | None = None

    @property
    def text(self) -> str:
        """The form in words."""
        tails = [
            f"{name} tail"
            for name, one in (("lower", self.lower), ("upper", self.upper))
            if one is not None
        ]
        body = "kernel density" if self.body == "kde" else self.body
        return " + ".join((body, *tails))


@dataclass(frozen=True)
class Candidate:
    """A form that was fitted.

    Attributes:
        recipe: which.
        section: it as an exposure's file has it.
        criterion: less is better.
    """

    recipe: Recipe
    section: Section
    criterion: float


def candidates(values: Float, low: float, high: float) -> list[Candidate]:
    """Return the forms that fit values, best first.

    Args:
        values: ``(n,)`` in [low, high], not all the same.
        low: of the range.
        high: of the range, above low.
    """
    found: list[Candidate] = []
    for lower, upper in _tails(values, low, high):
        start, end = (low if lower is None else lower), (high if upper is None else upper)
        inside = values[(start <= values) & (values <= end)]
        bodies: list[Candidate] = []
        for body in _BODIES:
            tails = lower is not None or upper is not None
            if (body == "beta" and tails) or (body in _POSITIVE and not low >= 0.0):
                continue
            if len(np.unique(inside)) < 2:
                continue
            bandwidth = _rounded(usual_bandwidth(inside)) if body == "kde" else None
            one = fit(values, Recipe(body, lower, upper, bandwidth), low, high)
            if one is not None:
                bodies.append(one)
        if lower is None and upper is None:
            found += bodies
        elif bodies:
            found.append(min(bodies, key=lambda one: one.criterion))
    return sorted(found, key=lambda one: one.criterion)


def fit(values: Float, recipe: Recipe, low: float, high: float) -> Candidate | None:
    """Fit one form; None where it cannot be fitted.

    Args:
        values: ``(n,)`` in [low, high].
        recipe: what to fit.
        low: of the range.
        high: of the range, above low.
    """
    start = low if recipe.lower is None else recipe.lower
    end = high if recipe.upper is None else recipe.upper
    inside = values[(start <= values) & (values <= end)]
    body = _fit_body(inside, recipe, start, end)
    if body is None:
        return None
    section, criterion = body
    if recipe.lower is None and recipe.upper is None:
        return Candidate(recipe, section, criterion)
    shares = [len(inside) / len(values)]
    for key, excess, threshold, width in (
        ("lower_tail", start - values[values < start], start, start - low),
        ("upper_tail", values[values > end] - end, end, high - end),
    ):
        if getattr(recipe, key.removesuffix("_tail")) is None:
            continue
        tail = _fit_family(excess, Pareto, 0.0, width)
        if tail is None or not len(excess):
            return None
        (_, shape, scale), log_likelihood = tail
        share = len(excess) / len(values)
        shares.append(share)
        section[key] = {
            "threshold": threshold, "share": _rounded(share), "scale": _rounded(scale),
            "shape": _rounded(shape),
        }  # fmt: skip
        criterion += 2.0 * 3 - 2.0 * log_likelihood  # scale, shape and share
    counts = np.array(shares) * len(values)
    criterion -= 2.0 * float((counts * np.log(shares)).sum())
    return Candidate(recipe, section, criterion)


def _tails(values: Float, low: float, high: float) -> Iterator[tuple[float | None, float | None]]:
    """Yield the thresholds of the tails that the values support, none first."""
    yield None, None
    lower, upper = (_rounded(one) for one in np.quantile(values, [TAIL_SHARE, 1.0 - TAIL_SHARE]))
    has_lower = (values < lower).sum() >= LEAST_EXCEEDANCES and low < lower
    has_upper = (values > upper).sum() >= LEAST_EXCEEDANCES and upper < high
    if has_upper:
        yield None, upper
    if has_lower:
        yield lower, None
    if has_lower and has_upper and lower < upper:
        yield lower, upper


def _fit_body(
    values: Float, recipe: Recipe, low: float, high: float
) -> tuple[Section, float] | None:
    """Return the section of a form without tails, and its criterion."""
    if not low < high or len(values) < 2:
        return None
    if recipe.body == "uniform":
        return {"distribution": "uniform"}, 2.0 * len(values) * float(np.log(high - low))
    if recipe.body == "kde":
        assert recipe.bandwidth is not None
        try:
            density = estimate(values, recipe.bandwidth, low, high)
        except InputError:  # narrower than its grid
            return None
        left_out = left_out_log_densities(values, density, recipe.bandwidth)
        corners = zip(density.at, density.heights, strict=True)
        rounded = {_rounded(x, 9): _rounded(height) for x, height in corners}
        section = {
            "distribution": "polygon", "at": list(rounded), "density": list(rounded.values()),
        }  # fmt: skip
        return section, -2.0 * float(left_out.sum())
    family = FAMILIES[recipe.body]
    found = _fit_family(values, family, low, high)
    if found is None:
        return None
    numbers, log_likelihood = found
    section = {"distribution": recipe.body}
    section |= {key: _rounded(one) for key, one in zip(family.keys, numbers, strict=True)}
    return section, 2.0 * len(numbers) - 2.0 * log_likelihood


def _fit_family(
    values: Float, family: type[Family], low: float, high: float
) -> tuple[tuple[float, ...], float] | None:
    """Return the numbers of greatest likelihood within a range, and its logarithm."""
    if len(values) < 2:
        return None
    numbers = _NUMBERS[family.name](values, low, high)
    if numbers is None:
        return None
    start, least, most, to_numbers = numbers
    ends = (low, high) if family.name == "beta" else ()

    def loss(point: Float) -> float:
        if np.any(point < least) or np.any(point > most):
            return np.inf
        given = (*to_numbers(point), *ends)
        below, above = family.below(low, *given), family.above(low, *given)
        if below > 0.5:
            mass = above - family.above(high, *given)
        else:
            mass = family.below(high, *given) - below
        if not mass > 0.0:
            return np.inf
        total = float(family.log_density(values, *given).sum()) - len(values) * float(np.log(mass))
        return -total if np.isfinite(total) else np.inf

    with np.errstate(all="ignore"):
        first = np.clip(start, least, most)
        if not np.isfinite(loss(first)):
            return None
        found = scipy.optimize.minimize(
            loss, first, method="Nelder-Mead",
            options={"xatol": 1e-5, "fatol": 1e-5, "maxiter": 600, "maxfev": 900},
        )  # fmt: skip
    return tuple(float(one) for one in to_numbers(found.x)), -float(found.fun)


Start = tuple[Float, Float, Float, Callable[[Float], tuple[float, ...]]]


def _positive(point: Float) -> tuple[float, ...]:
    return tuple(np.exp(point).tolist())


def _start_normal(values: Float, low: float, high: float) -> Start:
    width = high - low
    start = np.array([values.mean(), np.log(max(float(values.std()), 1e-6 * width))])
    limits = np.array([10.0 * width, 0.0])
    least = np.array([low, np.log(1e-6 * width)]) - limits
    most = np.array([high, np.log(20.0 * width)]) + limits
    return start, least, most, lambda point: (float(point[0]), float(np.exp(point[1])))


def _start_lognormal(values: Float, low: float, high: float) -> Start | None:
    if not values.min() > 0.0:
        return None
    logs = np.log(values)
    start = np.array([logs.mean(), np.log(max(float(logs.std()), 1e-6))])
    limits = np.array([20.0, 0.0])
    return (
        start, np.array([start[0], np.log(1e-6)]) - limits,
        np.array([start[0], np.log(20.0)]) + limits, _positive,
    )  # fmt: skip


def _start_exponential(values: Float, low: float, high: float) -> Start:
    width = high - low
    return (
        np.array([np.log(max(float(values.mean()), 1e-6 * width))]),
        np.array([np.log(1e-6 * width)]), np.array([np.log(1e3 * high)]), _positive,
    )  # fmt: skip


def _start_gamma(values: Float, low: float, high: float) -> Start:
    mean, variance = float(values.mean()), max(float(values.var()), 1e-12)
    start = np.log([mean**2 / variance, variance / mean])
    return start, np.log([1e-2, 1e-9 * high]), np.log([1e5, 1e3 * high]), _positive


def _start_weibull(values: Float, low: float, high: float) -> Start:
    mean, deviation = float(values.mean()), max(float(values.std()), 1e-9)
    shape = (mean / deviation) ** 1.086  # Justus et al., Journal of Applied Meteorology 17 (1978)
    start = np.log([shape, mean / scipy.special.gamma(1.0 + 1.0 / shape)])
    return start, np.log([5e-2, 1e-9 * high]), np.log([1e3, 1e3 * high]), _positive


def _start_beta(values: Float, low: float, high: float) -> Start:
    part = (values - low) / (high - low)
    mean, variance = float(part.mean()), max(float(part.var()), 1e-12)
    common = max(mean * (1.0 - mean) / variance - 1.0, 0.2)
    start = np.log([mean * common, (1.0 - mean) * common])
    return start, np.log([5e-2, 5e-2]), np.log([1e5, 1e5]), _positive


def _start_pareto(values: Float, low: float, high: float) -> Start:
    mean = max(float(values.mean()), 1e-9 * high)
    return (
        np.array([0.05, np.log(mean)]), np.array([-0.9, np.log(1e-4 * mean)]),
        np.array([2.0, np.log(1e3 * mean)]),
        lambda point: (0.0, float(point[0]), float(np.exp(point[1]))),
    )  # fmt: skip


_NUMBERS: dict[str, Callable[[Float, float, float], Start | None]] = {
    "normal": _start_normal,
    "lognormal": _start_lognormal,
    "exponential": _start_exponential,
    "gamma": _start_gamma,
    "weibull": _start_weibull,
    "beta": _start_beta,
    "pareto": _start_pareto,
}


def _rounded(value: float, digits: int = _DIGITS) -> float:
    return float(f"{value:.{digits}g}")
