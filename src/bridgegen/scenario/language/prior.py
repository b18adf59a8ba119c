"""How often the values of a parameter are met on the road: what a search draws them by.

A prior is a list of bands, each with the share of driving time in which the parameter is in it.
Within a band values are even, so a prior turns shares of 0 to 1 into values and back. Bounds cut
it: what they leave is scaled up. Where they leave room on both sides of zero (night and day, dry
and wet), each side keeps its share: clouds that take light away make no night.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import ScenarioError
from bridgegen.base.units import percent
from bridgegen.scenario.language.kinds import Value

_RARE = 0.25  # share of driving time below which a band is worth a word


@dataclass(frozen=True)
class Band:
    """Values above the band before it up to ``to``, their name in words and share of driving."""

    name: str
    to: float
    share: float


@dataclass(frozen=True)
class Prior:
    """How often values from low to high are met: ascending bands, of which the first may be low.

    Raises:
        ScenarioError: a rule is broken; the first that is.
    """

    low: float
    high: float
    bands: tuple[Band, ...]
    source: str

    def __post_init__(self) -> None:
        to, shares = [band.to for band in self.bands], [band.share for band in self.bands]
        rises = all(a < b for a, b in pairwise(to)) and to[0] >= self.low
        if not (rises and to[-1] == self.high):
            raise ScenarioError(f"bands must ascend from {self.low:g} to {self.high:g}, got {to}")
        if not (min(shares) > 0.0 and math.isclose(math.fsum(shares), 1.0, abs_tol=1e-6)):
            raise ScenarioError(f"shares must be above 0, and 1 together, got {shares}")

    @cached_property
    def _ends(self) -> tuple[Float, Float]:
        """The ends of the bands, and the share up to each, of which the first may be above 0."""
        values = np.array([self.low, *(band.to for band in self.bands)])
        shares = np.cumsum([0.0, *(band.share for band in self.bands)])
        single = int(values[0] == values[1])
        return values[single:], shares[single:] / shares[-1]

    def _below(self, value: Value, *, inclusive: bool) -> Float:
        """Return the share of smaller values, or of those that are not larger."""
        shares = np.asarray(np.interp(value, *self._ends))
        return shares if inclusive else np.where(np.asarray(value) > self.low, shares, 0.0)

    def _pieces(self, lo: Value, hi: Value) -> tuple[Float, Float]:
        """Return corners of the line from what is left, 0 to 1, to shares: ``(4,)`` or (4, N)."""
        lo, hi = np.broadcast_arrays(lo, hi)
        zero = min(max(0.0, self.low), self.high)
        sides = self._below(zero, inclusive=False), self._below(zero, inclusive=True)
        ends = self._below(lo, inclusive=False), self._below(hi, inclusive=True)
        both = (lo < zero) | ((lo == zero) & (zero == self.low))
        both &= (hi > zero) | (zero == self.high)
        corners = [np.where(both, *pair) for pair in zip(sides, ends, strict=True)]
        left = [np.where(both, side, end) for side, end in zip(sides, (0.0, 1.0), strict=True)]
        zeros, ones = np.zeros(lo.shape), np.ones(lo.shape)
        return np.stack([zeros, *left, ones]), np.stack([ends[0], *corners, ends[1]])

    def at(self, share: Float, lo: Value, hi: Value) -> Float:
        """Return values at shares of what an interval leaves, as `Parameter.at`."""
        values, shares = self._ends
        value = np.interp(_along(share, *self._pieces(lo, hi)), shares, values)
        return np.minimum(np.maximum(value, lo), hi)

    def share(self, value: Value, lo: Value, hi: Value) -> Float:
        """Return the shares at which values are, as `Parameter.share`; the middle of several."""
        middle = 0.5 * np.add(*self.shares(value, value, lo, hi))
        return np.where(np.less(lo, hi), middle, 0.5)

    def shares(self, low: Value, high: Value, lo: Value, hi: Value) -> tuple[Float, Float]:
        """Return the first and the last share of values in a range, as `Parameter.shares`."""
        left, corners = self._pieces(lo, hi)
        first = _along(self._below(low, inclusive=False), corners, left)
        return first, _along(self._below(high, inclusive=True), corners, left)

    def met(self, low: float, high: float) -> float:
        """Return the share of driving time with values from low to high."""
        return float(self._below(high, inclusive=True) - self._below(low, inclusive=False))

    def band(self, value: float) -> Band:
        """Return the band that a value lies in."""
        return next((band for band in self.bands if value <= band.to), self.bands[-1])

    def words(self, low: float, high: float) -> str:
        """Return bands from low to high, and their share; of one value, its band's."""
        first, last = (self.bands.index(self.band(value)) for value in (low, high))
        share = self.met(low, high) if low < high else self.bands[first].share
        ends = dict.fromkeys((self.bands[first].name, self.bands[last].name))
        return f"{' to '.join(ends)}, {percent(share)} of driving"


def _along(x: Float, at: Float, value: Float) -> Float:
    """Return a line through corners: ascending ones, of which some coincide."""
    result = np.broadcast_arrays(x, value[0])[1].copy()
    for k in range(len(at) - 1):
        width = at[k + 1] - at[k]
        step = np.divide(x - at[k], width, out=np.ones(np.shape(result)), where=width > 0.0)
        part = value[k] + np.clip(step, 0.0, 1.0) * (value[k + 1] - value[k])
        result = np.where(x >= at[k], part, result)
    return result


def surprise(bands: Iterable[Band]) -> float:
    """Return how rarely bands are met: minus the logarithm of their shares."""
    return -sum(math.log(band.share) for band in bands)


def rarities(bands: Iterable[Band]) -> str:
    """Return which bands are rare: "night (18 % of driving), fog (1.2 %)"; or ""."""
    rare = [band for band in bands if band.share < _RARE]
    return ", ".join(
        f"{band.name} ({percent(band.share)}{'' if k else ' of driving'})"
        for k, band in enumerate(rare)
    )
