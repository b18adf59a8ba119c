"""The share of critical scenarios, with its confidence interval."""

import math
from dataclasses import dataclass
from functools import cached_property

CONFIDENCE = 0.95

Z_95 = 1.959963984540054
"""The standard normal distribution's quantile at 1 − (1 − 0.95)/2."""


def clopper_pearson(
    successes: int, trials: int, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return an interval that contains a probability with at least this confidence.

    It is exact: for independent trials and any probability, the interval misses it with a
    probability of at most 1 − confidence, at most half of that on either side.
    Source: C. Clopper and E. Pearson, Biometrika 26 (1934).

    Args:
        successes: 0 .. trials.
        trials: 0 gives (0, 1).
        confidence: in (0, 1).
    """
    from scipy.special import betaincinv

    miss, failures = (1.0 - confidence) / 2.0, trials - successes
    low = float(betaincinv(successes, failures + 1, miss)) if successes else 0.0
    high = float(betaincinv(successes + 1, failures, 1.0 - miss)) if failures else 1.0
    return low, high


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


@dataclass(frozen=True)
class Evidence:
    """The results of a set of scenarios.

    Attributes:
        rows: scenarios whose simulation succeeded.
        critical: critical ones among them.
        failed: scenarios whose simulation failed, not part of ``rows``.
    """

    rows: int
    critical: int
    failed: int = 0

    @property
    def share(self) -> float | None:
        """Critical / successful scenarios; None if none succeeded."""
        return self.critical / self.rows if self.rows else None

    @cached_property
    def interval(self) -> tuple[float, float]:
        """The Clopper-Pearson 95 % confidence interval of the share.

        It is valid for independent random scenarios. A search chooses its scenarios, so its
        interval reflects the number of rows only.
        """
        return clopper_pearson(self.critical, self.rows)
