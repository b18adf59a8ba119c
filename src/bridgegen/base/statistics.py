"""Statistics: intervals of shares, paired differences, and whether samples differ and by how much.

A measure that was never reached (evaluations to the 50th failure, say) is +inf: a censored value,
known only to exceed the run's length. Quartiles, tests and effect sizes need ranks only, so they
accept it, ranked last and tied with other censored values. SciPy is imported late: it takes some
tenths of a second, and not all commands need it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float

CONFIDENCE = 0.95

Z_95 = 1.959963984540054
"""The standard normal distribution's quantile at 1 − (1 − 0.95)/2."""

EFFECTS = ((0.71, "large"), (0.64, "medium"), (0.56, "small"))
"""The least A12, or 1 − A12, of each name of a difference (Vargha and Delaney 2000)."""


def clopper_pearson(
    successes: float, trials: float, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return an interval that contains a probability with at least this confidence.

    It is exact: for independent trials and any probability, the interval misses it with a
    probability of at most 1 − confidence, at most half of that on either side.
    Source: C. Clopper and E. Pearson, Biometrika 26 (1934).

    Args:
        successes: 0 .. trials; not whole where rows have weights.
        trials: 0 gives (0, 1).
        confidence: in (0, 1).
    """
    from scipy.special import betaincinv

    miss, failures = (1.0 - confidence) / 2.0, trials - successes
    low = float(betaincinv(successes, failures + 1, miss)) if successes > 0.0 else 0.0
    high = float(betaincinv(successes + 1, failures, 1.0 - miss)) if failures > 0.0 else 1.0
    return low, high


def weighted_counts(parts: Float) -> tuple[float, float, float, float]:
    """Return the interval of a sum of weights of hits, each of which happens or not.

    Args:
        parts: ``(M,)`` the weights of the hits, of which there is at least one.

    Returns:
        The sum, the ends of its 95 % interval, and its one-sided upper bound.

    Source: Fay and Feuer, Statistics in Medicine 16 (1997) 791-801, with the mid-P correction of
    Fay and Kim, Biometrical Journal 59 (2017) 1174-1186.
    """
    import scipy.optimize
    import scipy.special

    largest = float(parts.max())
    total, square = float(parts.sum()), float(np.sum(parts * parts))
    more, more_square = total + largest, square + largest * largest

    def below(value: float) -> float:
        """Return the mid-P confidence that the mean is below a value."""
        lower = scipy.special.gammainc(total * total / square, value * total / square)
        upper = scipy.special.gammainc(more * more / more_square, value * more / more_square)
        return float(0.5 * (lower + upper))

    def quantile(confidence: float) -> float:
        end = more
        # Doubled until the root lies between the ends: brentq needs a change of sign.
        while below(end) < confidence:
            end *= 2.0
        return float(
            scipy.optimize.brentq(lambda x: below(x) - confidence, 0.0, end, xtol=1e-9 * more)
        )

    tail = 0.5 * (1.0 - CONFIDENCE)
    return total, quantile(tail), quantile(1.0 - tail), quantile(CONFIDENCE)


def confidence_sequence(successes: int, trials: int) -> tuple[float, float]:
    """Return a 95 % interval of a probability that holds even if results decide how long to try.

    It holds the probabilities whose density by these trials, and a prior that is even, exceeds
    0.05; it is a little wider than Clopper's and Pearson's, for a number of trials that is fixed.
    Source: the prior-posterior ratio of I. Waudby-Smith and A. Ramdas, NeurIPS 33 (2020).

    Args:
        successes: 0 .. trials.
        trials: 0 gives (0, 1).
    """
    failures, ways = trials - successes, (trials + 1) * math.comb(trials, successes)
    ends = []
    for outside, is_open in ((0.0, successes), (1.0, failures)):
        inside = successes / max(trials, 1) if is_open else outside
        for _ in range(60 if is_open else 0):
            p = 0.5 * (inside + outside)
            in_it = ways * p**successes * (1.0 - p) ** failures > 1.0 - CONFIDENCE
            inside, outside = (p, outside) if in_it else (inside, p)
        ends.append(inside)
    return ends[0], ends[1]


def beta_binomial(successes: Sequence[int], trials: Sequence[int]) -> tuple[float, float, float]:
    """Return the mean of probabilities that differ from case to case, and its 95 % interval.

    Those of the cases are of one beta distribution, whose mean and correlation have even priors;
    how long a case was tried may depend on its results.

    Args:
        successes: of each case.
        trials: of each case.
    """
    from scipy.special import betaln

    mean = (np.arange(400) + 0.5)[:, np.newaxis] / 400.0
    size = 50.0 / (np.arange(50) + 0.5) - 1.0
    a, b = mean * size, (1.0 - mean) * size
    counts = zip(successes, trials, strict=True)
    log = sum((betaln(a + k, b + n - k) - betaln(a, b) for k, n in counts), np.zeros(a.shape))
    weight = np.exp(log - log.max()).sum(axis=1)
    below = np.cumsum(weight / weight.sum())
    low, high = np.interp([(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0], below, mean[:, 0])
    return float(weight @ mean[:, 0] / weight.sum()), float(low), float(high)


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return an interval that contains a probability with about 95 % confidence; fast.

    Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), doi:10.1080/01621459.1927.10502953.

    Args:
        successes: 0 .. trials.
        trials: 0 gives (0, 1).
    """
    if not trials:
        return 0.0, 1.0
    z2, share = Z_95**2, successes / trials
    middle = (share + z2 / (2 * trials)) / (1.0 + z2 / trials)
    half = Z_95 * math.sqrt(share * (1.0 - share) / trials + z2 / (4 * trials**2))
    half /= 1.0 + z2 / trials
    low, high = max(0.0, middle - half), min(1.0, middle + half)
    return (low if successes else 0.0), (high if successes < trials else 1.0)


def paired_drop(both: int, gone: int, new: int, neither: int) -> tuple[float, float, float]:
    """Return by how much a share drops between two measurements of the same n cases.

    Args:
        both: cases with the property before and after.
        gone: before only.
        new: after only.
        neither: neither before nor after.

    Returns:
        The drop (gone − new) / n, and its 95 % interval; (0, −1, 1) without cases.

    Source: R. G. Newcombe, Improved confidence intervals for the difference between binomial
    proportions based on paired data, Statistics in Medicine 17 (1998), 2635-2650, method 10.
    """
    n = both + gone + new + neither
    if not n:
        return 0.0, -1.0, 1.0
    before, after = both + gone, both + new
    p, q = before / n, after / n
    low_p, high_p = wilson(before, n)
    low_q, high_q = wilson(after, n)
    phi = _phi(both, gone, new, neither)
    drop = (gone - new) / n

    def reach(a: float, b: float) -> float:
        return math.sqrt(max(0.0, a * a - 2.0 * phi * a * b + b * b))

    low = drop - reach(p - low_p, high_q - q)
    high = drop + reach(high_p - p, q - low_q)
    return drop, max(-1.0, low), min(1.0, high)


def _phi(a: int, b: int, c: int, d: int) -> float:
    """Return the continuity-corrected correlation of the two measurements; see the source."""
    product = (a + b) * (c + d) * (a + c) * (b + d)
    if not product:
        return 0.0
    excess, n = a * d - b * c, a + b + c + d
    if excess > 0:
        excess_corrected = max(excess - n / 2.0, 0.0)
        return excess_corrected / math.sqrt(product)
    return excess / math.sqrt(product)


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
        below, above = ordered[math.floor(place)], ordered[math.ceil(place)]
        return float(
            below if below == above else below + (place - math.floor(place)) * (above - below)
        )

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
        # A corrected p value is never below that of a smaller one: the step-down stops at the first
        # that is kept.
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
