"""How many of some scenarios are critical, and how sure that makes one of the share."""

from dataclasses import dataclass
from functools import cached_property

CONFIDENCE = 0.95


def clopper_pearson(
    successes: int, trials: int, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return an interval that holds a probability with at least this confidence.

    It is exact: whatever the probability, independent trials give an interval without it with a
    probability of at most 1 − confidence, half of that on either side.
    Source: C. Clopper and E. Pearson, Biometrika 26 (1934).

    Args:
        successes: 0 .. trials.
        trials: none gives (0, 1).
        confidence: in (0, 1).
    """
    from scipy.special import betaincinv

    miss, failures = (1.0 - confidence) / 2.0, trials - successes
    low = float(betaincinv(successes, failures + 1, miss)) if successes else 0.0
    high = float(betaincinv(successes + 1, failures, 1.0 - miss)) if failures else 1.0
    return low, high


@dataclass(frozen=True)
class Evidence:
    """What some scenarios came to.

    Attributes:
        rows: scenarios whose simulation succeeded.
        critical: critical ones among them.
        failed: scenarios besides whose simulation failed; they say nothing.
    """

    rows: int
    critical: int
    failed: int = 0

    @property
    def share(self) -> float | None:
        """Critical scenarios of all that succeeded; None of none."""
        return self.critical / self.rows if self.rows else None

    @cached_property
    def interval(self) -> tuple[float, float]:
        """Where the share of all such scenarios is, with 95 % confidence: Clopper-Pearson's.

        That holds for independent random scenarios. A search chooses its own: its interval says
        how much its number of rows can tell, not how large the share is.
        """
        return clopper_pearson(self.critical, self.rows)
