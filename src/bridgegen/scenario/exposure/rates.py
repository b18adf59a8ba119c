"""How often a scenario is met: counted encounters, and rates with exact intervals.

Source: Garwood, Fiducial limits for the Poisson distribution, Biometrika 28 (1936) 437-442.
"""

import math
from dataclasses import dataclass

import scipy

from bridgegen.base.errors import InputError

LEVEL = 0.95
"""Of intervals."""

MOST = 10**12
"""Encounters that may have been counted."""


@dataclass(frozen=True)
class Rate:
    """A rate with its interval.

    Attributes:
        estimate: per unit of exposure.
        low: lower end of the interval.
        high: upper end.
    """

    estimate: float
    low: float
    high: float


def poisson_interval(count: int, level: float = LEVEL) -> tuple[float, float]:
    """Return the exact two-sided interval for the mean of a Poisson distribution.

    Args:
        count: what was observed, at least 0.
        level: of confidence, in (0, 1).

    Raises:
        ValueError: an argument out of range.
    """
    if count < 0 or not 0.0 < level < 1.0:
        raise ValueError(f"count >= 0 and 0 < level < 1 must hold, got {count} and {level}")
    side = 0.5 * (1.0 - level)
    low = float(scipy.special.gammaincinv(count, side)) if count else 0.0
    return low, float(scipy.special.gammainccinv(count + 1, side))


@dataclass(frozen=True)
class Encounters:
    """How often a scenario was met.

    Attributes:
        count: encounters.
        hours: of driving in which they were counted [h]; None where that is not known.
        km: likewise [km].
        source: where the numbers come from.

    Raises:
        InputError: a number out of range, or neither hours nor km; all that is wrong.
    """

    count: int
    hours: float | None
    km: float | None
    source: str

    def __post_init__(self) -> None:
        problems = []
        if not 0 <= self.count <= MOST:
            problems.append(f"count must be 0 to {MOST:g}, got {self.count}")
        if self.hours is None and self.km is None:
            problems.append("hours [h] or km [km] in which they were counted must be given")
        for name, unit, amount in (("hours", "h", self.hours), ("km", "km", self.km)):
            if amount is not None and not 0.0 < amount < math.inf:
                problems.append(f"{name} [{unit}] must be above 0 and finite, got {amount:g}")
        if problems:
            raise InputError(*problems)

    @property
    def per_hour(self) -> Rate | None:
        """Encounters per hour, with their 95 % interval; None without hours."""
        return self._per(self.hours)

    @property
    def per_km(self) -> Rate | None:
        """Encounters per kilometre, with their 95 % interval; None without km."""
        return self._per(self.km)

    def _per(self, amount: float | None) -> Rate | None:
        if amount is None:
            return None
        low, high = poisson_interval(self.count)
        return Rate(self.count / amount, low / amount, high / amount)
