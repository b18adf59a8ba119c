"""How likely collisions are by near misses alone: a second line of evidence, by extreme values.

The shortest time to collision of encounters as they happen on the road, negated, in blocks: a
generalised extreme value distribution is fitted to the largest one of each block, and says how
often it reaches 0, a collision. It extrapolates: where it disagrees with an estimate, harm does not
grow out of near misses, or the estimate has missed some.

Sources: Songchitruksa and Tarko, Accident Analysis and Prevention 38 (2006) 811-822 (surrogate and
blocks); Hosking, Wallis and Wood, Technometrics 27 (1985) 251-261 (fit by L-moments).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.special

from bridgegen.assess.conflict._limits import HORIZON
from bridgegen.base.arrays import Float
from bridgegen.jobs.risk.estimators.problem import block_of

LEAST_SIZE, FEWEST, MOST = 10, 40, 200
"""Least number of encounters in a block; least and largest number of blocks."""
LEFT_OUT = 0.05
"""Largest share of blocks without a collision course, and of those with a collision."""
RESAMPLED = 400
"""How often blocks are resampled for the interval."""
_STREAM = 5  # of random numbers, beside those of estimators


@dataclass(frozen=True)
class Extreme:
    """How likely a collision is per encounter, by near misses.

    Attributes:
        estimate: NaN where it is not known.
        low: lower end of the 95 % interval; likewise.
        high: upper end.
        resampled: ``(RESAMPLED,)`` the estimates of resampled blocks.
        blocks: how many there are.
        doubt: why it is not known; "" where it is.
    """

    estimate: float
    low: float
    high: float
    resampled: Float
    blocks: int
    doubt: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return what ``risk.json`` says of it."""
        if self.doubt:
            return {"estimate": None, "doubt": self.doubt}
        ends = {"estimate": self.estimate, "low": self.low, "high": self.high}
        return {**ends, "blocks": self.blocks}


def of_near_misses(ttc: Float, seed: int) -> Extreme:
    """Return how likely collisions are.

    Args:
        ttc: ``(N,)`` [s] the shortest time to collision of independent encounters, `HORIZON` of
            those without one, 0 of collisions.
        seed: of the resampling.
    """
    size = max(LEAST_SIZE, len(ttc) // MOST)
    while (largest := _largest(ttc, size)).size >= FEWEST:
        if np.mean(largest <= -HORIZON) <= LEFT_OUT:
            break
        size *= 2
    if largest.size < FEWEST:
        courses = int(np.sum(ttc < HORIZON))
        return _unknown(
            f"{courses} of {len(ttc)} encounters as on the road have a collision course, too few "
            f"for {FEWEST} blocks of {LEAST_SIZE} or more that have one each"
        )
    if (hits := int(np.sum(largest >= 0.0))) > LEFT_OUT * largest.size:
        return _unknown(f"{hits} of {largest.size} blocks have collisions, which are counted")
    if np.ptp(largest) == 0.0:
        return _unknown("all blocks have the same shortest time to collision")
    draws = block_of(seed, 0, _STREAM).choice(largest, (RESAMPLED, largest.size))
    found = _reaches(draws, size)
    estimate = float(_reaches(largest[np.newaxis], size)[0])
    low, high = np.quantile(found, [0.025, 0.975]).tolist()
    return Extreme(estimate, min(low, estimate), max(high, estimate), found, largest.size)


def _unknown(doubt: str) -> Extreme:
    return Extreme(math.nan, math.nan, math.nan, np.empty(0), 0, doubt)


def _largest(ttc: Float, size: int) -> Float:
    blocks = len(ttc) // size
    found: Float = -ttc[: blocks * size].reshape(blocks, size).min(axis=1, initial=HORIZON)
    return found


def _reaches(largest: Float, size: int) -> Float:
    """Return how likely one encounter is a collision, by the largest values of blocks, ``(B,)``."""
    values, n = np.sort(largest, axis=1), largest.shape[1]
    j = np.arange(n)
    b0, b1 = values.mean(axis=1), (values * j).mean(axis=1) / (n - 1)
    b2 = (values * j * (j - 1)).mean(axis=1) / ((n - 1) * (n - 2))
    # A sample of one value has no spread: it reaches 0 or does not.
    second = np.maximum(2.0 * b1 - b0, 1e-12)
    c = 2.0 / (3.0 + (6.0 * b2 - 6.0 * b1 + b0) / second) - math.log(2.0) / math.log(3.0)
    # The shape, positive where values are bounded; beyond ±0.5 some 50 maxima say nothing of it.
    k = np.clip(7.8590 * c + 2.9554 * c * c, -0.5, 0.5)
    k = np.where(np.abs(k) < 1e-6, 1e-6, k)
    gamma = scipy.special.gamma(1.0 + k)
    scale = second * k / ((1.0 - 2.0**-k) * gamma)
    start = b0 - scale * (1.0 - gamma) / k
    found: Float = -np.expm1(-(np.maximum(1.0 + k * start / scale, 0.0) ** (1.0 / k)) / size)
    return found
