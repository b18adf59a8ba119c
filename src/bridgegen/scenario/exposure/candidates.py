"""Forms fitted to values: maximum likelihood within a range, and which form describes them best.

Forms are compared by Akaike's criterion, 2k - 2 log L. A kernel density has no k; its criterion is
-2 times its leave-one-out log likelihood, which estimates the same: the log density of values that
were not seen (Stone, Journal of the Royal Statistical Society B 39 (1977) 44-47). Of forms that
differ by less than `SUPPORT` the data do not say which is right: the one with the fewest numbers is
taken (Burnham and Anderson, Model Selection and Multimodel Inference, 2nd ed. (2002), section 2.6).
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.exposure.families import FAMILIES, Family, Pareto
from bridgegen.scenario.exposure.marginals import Polygon

# --- Kernel density estimates of a column of numbers, reflected at the ends of a range ---
# The estimate is tabulated: numbers are spread over a grid of an eighth of a bandwidth, or finer,
# and the density is linear between its points, which changes it by less than 0.3 %.
# Source: Silverman, Density Estimation (1986), sections 2.10 (reflection), 3.4.2 (bandwidth) and
# 3.5 # (grid).


LEAST, MOST = 64, 8192
"""Least and greatest number of intervals of the grid."""

_PER_BANDWIDTH, _REACH = 8, 6.0
_ROOT = math.sqrt(2.0 * math.pi)


def usual_bandwidth(values: Float) -> float:
    """Return Silverman's bandwidth, 0.9 n^(-1/5) of the smaller measure of spread.

    Args:
        values: ``(n,)``, not all the same.
    """
    quarters = np.quantile(values, [0.25, 0.75])
    spreads = [float(np.std(values, ddof=1)), float(quarters[1] - quarters[0]) / 1.34]
    spread = min(value for value in spreads if value > 0.0)
    return 0.9 * spread / math.pow(len(values), 0.2)


def estimate(values: Float, bandwidth: float, low: float, high: float) -> Polygon:
    """Return the density of values within a range.

    Args:
        values: ``(n,)`` in [low, high].
        bandwidth: standard deviation of the kernels, > 0.
        low: smallest value.
        high: largest value, above low.

    Raises:
        InputError: the range is too many bandwidths wide.
    """
    wanted = math.ceil(_PER_BANDWIDTH * (high - low) / bandwidth)
    if wanted > MOST:
        raise InputError(
            f"a bandwidth must be at least {_PER_BANDWIDTH * (high - low) / MOST:.3g}, "
            f"{_PER_BANDWIDTH / MOST:.2g} of the range, got {bandwidth:g}"
        )
    count = max(wanted, LEAST)
    step = (high - low) / count
    at = np.clip((values - low) / step, 0.0, count)
    left = np.minimum(at.astype(np.int64), count - 1)
    right = at - left
    mass = np.zeros(count + 1)
    np.add.at(mass, left, 1.0 - right)
    np.add.at(mass, left + 1, right)
    mass[[0, -1]] *= 2.0  # its mirror image lies at the same point
    reach = math.ceil(_REACH * bandwidth / step)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step / bandwidth) ** 2)
    smooth = np.convolve(np.pad(mass, reach, mode="reflect" if reach <= count else "edge"), kernel)
    heights = smooth[2 * reach : 2 * reach + count + 1]
    corners = np.linspace(low, high, count + 1)
    heights = heights / (0.5 * (heights[1:] + heights[:-1]) * step).sum()
    text = f"kernel density, bandwidth {bandwidth:.4g}"
    return Polygon(tuple(corners.tolist()), tuple(heights.tolist()), text)


def left_out_log_densities(values: Float, density: Polygon, bandwidth: float) -> Float:
    """Return the log density of each value by the estimate that the others give, ``(n,)``.

    Args:
        values: ``(n,)`` that the estimate was made of, n > 1.
        density: the estimate.
        bandwidth: of it.
    """
    n = len(values)
    own = np.exp(-0.5 * (2.0 * (values - density.low) / bandwidth) ** 2)
    own += np.exp(-0.5 * (2.0 * (density.high - values) / bandwidth) ** 2)
    own = (1.0 + own) / (bandwidth * _ROOT)
    others = (n * np.exp(density.log_density(values)) - own) / (n - 1)
    result: Float = np.log(np.maximum(others, 1e-12 / (density.high - density.low)))
    return result


LEAST_EXCEEDANCES = 50
"""Least number of values beyond the threshold of a tail: the standard error of its shape is 1/√50 =
0.14 then."""

SUPPORT = 4.0
"""Difference of the criterion beyond which a form has considerably less support."""

TAIL_SHARE = 0.1
"""Share of the values that form a tail of their own."""

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
            for name, value in (("lower", self.lower), ("upper", self.upper))
            if value is not None
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
        numbers: how many were fitted; inf of a kernel density.
    """

    recipe: Recipe
    section: Section
    criterion: float

    @property
    def numbers(self) -> float:
        """See above."""
        body = {"uniform": 0, "kde": math.inf}.get(self.recipe.body)
        tails = sum(value is not None for value in (self.recipe.lower, self.recipe.upper))
        return 3 * tails + (len(_KEYS[self.recipe.body]) if body is None else body)


def candidates(values: Float, low: float, high: float) -> list[Candidate]:
    """Return the forms that fit values: the one that is taken, then the others, best first.

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
            candidate = fit(values, Recipe(body, lower, upper, bandwidth), low, high)
            if candidate is not None:
                bodies.append(candidate)
        if lower is None and upper is None:
            found += bodies
        # Of forms with tails only the best one, or its many variants would crowd the ranking.
        elif bodies:
            found.append(min(bodies, key=lambda candidate: candidate.criterion))
    least = min(item.criterion for item in found)
    found.sort(key=lambda candidate: candidate.criterion)
    alike = [item for item in found if item.criterion <= least + SUPPORT]
    # Not the smallest criterion: of some 30 candidates one is best by chance, and log-normal data
    # became kernel densities with tails.
    taken = min(alike, key=lambda candidate: candidate.numbers)
    return [taken, *(item for item in found if item is not taken)]


def fit(
    values: Float, recipe: Recipe, low: float, high: float, near: Section | None = None
) -> Candidate | None:
    """Fit one form; None where it cannot be fitted.

    Args:
        values: ``(n,)`` in [low, high].
        recipe: what to fit.
        low: of the range.
        high: of the range, above low.
        near: the same form fitted to similar values: where to begin, and that a coarser optimum
            will do, to a thousandth.
    """
    start = low if recipe.lower is None else recipe.lower
    end = high if recipe.upper is None else recipe.upper
    inside = values[(start <= values) & (values <= end)]
    body = _fit_body(inside, recipe, start, end, near)
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
        tail = _fit_family(excess, Pareto, 0.0, width, near[key] if near else None)
        if tail is None:
            return None
        (_, shape, scale), log_likelihood = tail
        share = len(excess) / len(values)
        shares.append(share)
        section[key] = {
            "threshold": threshold,
            "share": _rounded(share),
            "scale": _rounded(scale),
            "shape": _rounded(shape),
        }
        criterion += 2.0 * 3 - 2.0 * log_likelihood  # scale, shape and share
    counts = np.array(shares) * len(values)
    criterion -= 2.0 * float((counts * np.log(shares)).sum())
    return Candidate(recipe, section, criterion)


def _tails(values: Float, low: float, high: float) -> Iterator[tuple[float | None, float | None]]:
    """Yield the thresholds of the tails that the values support, none first."""
    yield None, None
    lower, upper = (_rounded(item) for item in np.quantile(values, [TAIL_SHARE, 1.0 - TAIL_SHARE]))
    has_lower = (values < lower).sum() >= LEAST_EXCEEDANCES and low < lower
    has_upper = (values > upper).sum() >= LEAST_EXCEEDANCES and upper < high
    if has_upper:
        yield None, upper
    if has_lower:
        yield lower, None
    if has_lower and has_upper and lower < upper:
        yield lower, upper


def _fit_body(
    values: Float, recipe: Recipe, low: float, high: float, near: Section | None
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
        polygon: Section = {
            "distribution": "polygon",
            "at": list(rounded),
            "density": list(rounded.values()),
        }
        return polygon, -2.0 * float(left_out.sum())
    family = FAMILIES[recipe.body]
    found = _fit_family(values, family, low, high, near)
    if found is None:
        return None
    numbers, log_likelihood = found
    section: Section = {"distribution": recipe.body}
    section |= {key: _rounded(number) for key, number in zip(family.keys, numbers, strict=True)}
    return section, 2.0 * len(numbers) - 2.0 * log_likelihood


def _fit_family(
    values: Float, family: type[Family], low: float, high: float, near: Section | None
) -> tuple[tuple[float, ...], float] | None:
    """Return the numbers of greatest likelihood within a range, and its logarithm."""
    if len(values) < 2 or (family.name in _POSITIVE and not values.min() > 0.0):
        return None
    guess, least, most = _LIMITS[family.name](values, low, high)
    if near is not None:
        guess = [near[key] for key in _KEYS[family.name]]
    logs = np.array([key in family.positive for key in _KEYS[family.name]])
    ends = (low, high) if family.name == "beta" else ()
    threshold = (0.0,) if family is Pareto else ()
    lowest, highest, first = (_logged(group, logs) for group in (least, most, guess))

    def numbers_at(point: Float) -> tuple[float, ...]:
        return (*threshold, *np.where(logs, np.exp(np.where(logs, point, 0.0)), point).tolist())

    def loss(point: Float) -> float:
        if not (np.all(lowest <= point) and np.all(point <= highest)):
            return np.inf
        given = (*numbers_at(point), *ends)
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
        first = np.clip(first, lowest, highest)
        if not np.isfinite(loss(first)):
            return None
        # Refits are for bands, of some hundred of them, which a thousandth does not move.
        precise = 1e-5 if near is None else 1e-3
        step = np.where(logs, 0.05, 0.05 * np.maximum(np.abs(first), 1.0))
        corners = np.vstack(
            [first, first + np.diag(np.where(first + step <= highest, step, -step))]
        )
        found = scipy.optimize.minimize(
            loss,
            first,
            method="Nelder-Mead",
            options={
                "xatol": precise,
                "fatol": precise,
                "maxiter": 600,
                "maxfev": 900,
                "initial_simplex": corners,
            },
        )
    return numbers_at(found.x), -float(found.fun)


def _logged(numbers: Sequence[float], logs: Bool) -> Float:
    given = np.array(numbers, dtype=np.float64)
    return np.where(logs, np.log(np.where(logs, given, 1.0)), given)


Limits = tuple[Sequence[float], Sequence[float], Sequence[float]]


def _normal(values: Float, low: float, high: float) -> Limits:
    """Return where to begin, and the least and the greatest numbers that are tried."""
    width = high - low
    start = (float(values.mean()), max(float(values.std()), 1e-5 * width))
    return start, (low - 10.0 * width, 1e-6 * width), (high + 10.0 * width, 20.0 * width)


def _lognormal(values: Float, low: float, high: float) -> Limits:
    logs = np.log(values)
    median = float(np.exp(logs.mean()))
    start = (median, max(float(logs.std()), 1e-5))
    return start, (1e-8 * median, 1e-6), (1e8 * median, 20.0)


def _exponential(values: Float, low: float, high: float) -> Limits:
    return (float(values.mean()),), (1e-6 * high,), (1e3 * high,)


def _gamma(values: Float, low: float, high: float) -> Limits:
    mean, variance = float(values.mean()), max(float(values.var()), 1e-9 * high**2)
    return (mean**2 / variance, variance / mean), (1e-2, 1e-9 * high), (1e5, 1e3 * high)


def _weibull(values: Float, low: float, high: float) -> Limits:
    mean, deviation = float(values.mean()), max(float(values.std()), 1e-5 * high)
    shape = (mean / deviation) ** 1.086  # Justus et al., Journal of Applied Meteorology 17 (1978)
    scale = mean / float(scipy.special.gamma(1.0 + 1.0 / shape))
    return (shape, scale), (5e-2, 1e-9 * high), (1e3, 1e3 * high)


def _beta(values: Float, low: float, high: float) -> Limits:
    part = (values - low) / (high - low)
    mean, variance = float(part.mean()), max(float(part.var()), 1e-12)
    common = max(mean * (1.0 - mean) / variance - 1.0, 0.2)
    return (mean * common, (1.0 - mean) * common), (5e-2, 5e-2), (1e5, 1e5)


def _pareto(values: Float, low: float, high: float) -> Limits:
    mean = max(float(values.mean()), 1e-9 * high)
    return (0.05, mean), (-0.9, 1e-4 * mean), (2.0, 1e3 * mean)


_LIMITS: dict[str, Callable[[Float, float, float], Limits]] = {
    "normal": _normal,
    "lognormal": _lognormal,
    "exponential": _exponential,
    "gamma": _gamma,
    "weibull": _weibull,
    "beta": _beta,
    "pareto": _pareto,
}
_KEYS = {name: FAMILIES[name].keys for name in _LIMITS} | {"pareto": ("shape", "scale")}
"""Names of the fitted numbers by family."""


def _rounded(value: float, digits: int = _DIGITS) -> float:
    return float(f"{value:.{digits}g}")
