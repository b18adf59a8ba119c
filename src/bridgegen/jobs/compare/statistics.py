"""Statistics of measures over seeds: do two algorithms differ, and by how much?

A measure that a run never reached (for example, evaluations to the 50th critical scenario) is +inf:
a censored value, known only to exceed the run's length. Ranks need no more than that, so medians,
quartiles, tests and effect sizes all accept it, ranked last and tied with other censored values.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np

from bridgegen.base.arrays import Float

EFFECTS = ((0.71, "large"), (0.64, "medium"), (0.56, "small"))
"""The least A12, or 1 − A12, of each name of a difference (Vargha and Delaney 2000)."""


@dataclass(frozen=True)
class Quartiles:
    """The quartiles of some values; NaN without values, +inf where the values are.

    Attributes:
        low: the first quartile.
        median: the second.
        high: the third.
    """

    low: float
    median: float
    high: float


def quartiles(values: Float) -> Quartiles:
    """Return the quartiles of ``(n,)`` values, interpolated linearly; NaN ones do not count.

    As NumPy does, except that halfway to +inf is +inf, where NumPy returns NaN.
    """
    ordered = np.sort(values[~np.isnan(values)]).tolist()

    def at(share: float) -> float:
        if not ordered:
            return float("nan")
        place = share * (len(ordered) - 1)
        below, above = ordered[floor(place)], ordered[ceil(place)]
        return float(below if below == above else below + (place - floor(place)) * (above - below))

    return Quartiles(at(0.25), at(0.5), at(0.75))


def mann_whitney(x: Float, y: Float) -> float:
    """Return the two-sided p value of the Mann–Whitney U test; NaN where either is empty.

    scipy's: exact for up to eight values without ties, else the normal approximation with
    corrections for ties and continuity. Values that are all the same give 1.

    Args:
        x: ``(n,)``, NaN ones do not count; +inf may be among them.
        y: ``(m,)``, likewise.
    """
    from scipy.stats import mannwhitneyu

    x, y = x[~np.isnan(x)], y[~np.isnan(y)]
    if not len(x) or not len(y):
        return float("nan")
    # Ranks are equivalent, and avoid subtracting infinities.
    ranks = np.unique(np.concatenate([x, y]), return_inverse=True)[1]
    return float(mannwhitneyu(ranks[: len(x)], ranks[len(x) :]).pvalue)


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p values corrected for their number, by Holm's step-down method.

    NaN (no test) stays, and does not count.

    Source: Holm (1979), "A simple sequentially rejective multiple test procedure".
    """
    corrected, worst = [float("nan")] * len(p_values), 0.0
    known = sorted((p, k) for k, p in enumerate(p_values) if p == p)
    for rank, (p, k) in enumerate(known):
        worst = max(worst, min(1.0, (len(known) - rank) * p))
        corrected[k] = worst
    return corrected


def a12(x: Float, y: Float, *, larger_is_better: bool) -> float:
    """Return the probability that a value of x is *better* than one of y, ties by half.

    0.5: no difference; 1: each of x is better than each of y. NaN where either is empty.

    Args:
        x: ``(n,)``, NaN ones do not count; +inf may be among them.
        y: ``(m,)``, likewise.
        larger_is_better: else smaller is.

    Source: Vargha and Delaney (2000), doi:10.3102/10769986025002101, Eq. 5.
    """
    x, y = x[~np.isnan(x)], y[~np.isnan(y)]
    if not len(x) or not len(y):
        return float("nan")
    more = np.count_nonzero(x[:, None] > y) + 0.5 * np.count_nonzero(x[:, None] == y)
    share = more / (len(x) * len(y))
    return float(share if larger_is_better else 1.0 - share)


def effect(share: float) -> str:
    """Return the name of a difference of this A12: negligible, small, medium or large."""
    distance = max(share, 1.0 - share)
    return next((word for limit, word in EFFECTS if distance >= limit), "negligible")
