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

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import ScenarioError
from bridgegen.base.units import percent

Value = Float | float

RARE = 0.25
"""Share of driving time below which a band is worth a word."""


@dataclass(frozen=True)
class Band:
    """Values from the end of the band before it, or the parameter's lowest one.

    Attributes:
        name: in words: "heavy rain".
        to: its highest value; the lowest one of the parameter if the first band is that value.
        share: of driving time.
    """

    name: str
    to: float
    share: float


@dataclass(frozen=True)
class Prior:
    """How often the values of a parameter are met, in driving time.

    Attributes:
        low: lowest value of the parameter.
        high: highest value.
        bands: ascending.
        source: where the shares come from.

    Raises:
        ScenarioError: a rule is broken; all that are.
    """

    low: float
    high: float
    bands: tuple[Band, ...]
    source: str

    def __post_init__(self) -> None:
        ends = [self.low, *(band.to for band in self.bands)]
        problems = [
            f"the bands of a prior must ascend, got '{band.name}' to {band.to:g} after {before:g}"
            for number, (before, band) in enumerate(zip(ends[:-1], self.bands, strict=True))
            if not (before < band.to or (number == 0 and before == band.to))
        ]
        if ends[-1] != self.high:
            problems.append(f"the last band of a prior must end at {self.high:g}, got {ends[-1]:g}")
        total = math.fsum(band.share for band in self.bands)
        if not all(band.share > 0.0 for band in self.bands) or not math.isclose(
            total, 1.0, abs_tol=1e-6
        ):
            problems.append(
                f"the shares of a prior must be above 0 and 1 together, got {total:g} of "
                f"{', '.join(f'{band.share:g}' for band in self.bands)}"
            )
        if problems:
            raise ScenarioError(*problems)

    @cached_property
    def _ends(self) -> tuple[Float, Float]:
        """The ends of the bands, and the share up to each, of which the first may be above 0."""
        values = np.array([self.low, *(band.to for band in self.bands)])
        shares = np.concatenate([[0.0], np.cumsum([band.share for band in self.bands])])
        shares /= shares[-1]
        single = int(values[0] == values[1])
        return values[single:], shares[single:]

    def _below(self, value: Value, *, inclusive: bool) -> Float:
        """Return the share of smaller values, or of those that are not larger."""
        shares = np.asarray(np.interp(value, *self._ends))
        return shares if inclusive else np.where(np.asarray(value) > self.low, shares, 0.0)

    def _pieces(self, lo: Value, hi: Value) -> tuple[Float, Float]:
        """Return corners of the line from what is left, 0 to 1, to shares: ``(4,)`` or (4, N)."""
        zero = min(max(0.0, self.low), self.high)
        before = self._below(zero, inclusive=False)
        after = self._below(zero, inclusive=True)
        first, last = self._below(lo, inclusive=False), self._below(hi, inclusive=True)
        below = (np.asarray(lo) < zero) | (np.asarray(lo) == zero) & (zero == self.low)
        both = below & ((np.asarray(hi) > zero) | (zero == self.high))
        first, last, both = np.broadcast_arrays(first, last, both)
        middle = np.where(both, before, first), np.where(both, after, last)
        corners = np.stack([first, *middle, last])
        zeros, ones = np.zeros(first.shape), np.ones(first.shape)
        left = np.stack([zeros, np.where(both, before, 0.0), np.where(both, after, 1.0), ones])
        return left, corners

    def at(self, share: Float, lo: Value, hi: Value) -> Float:
        """Return values at shares of what an interval leaves, as `Parameter.at`."""
        values, shares = self._ends
        value = np.interp(_along(share, *self._pieces(lo, hi)), shares, values)
        return np.minimum(np.maximum(value, lo), hi)

    def share(self, value: Value, lo: Value, hi: Value) -> Float:
        """Return the shares at which values are, as `Parameter.share`; the middle of several."""
        first, last = (self._left(value, lo, hi, inclusive=way) for way in (False, True))
        return 0.5 * (first + last)

    def shares(self, low: float, high: float, lo: Value, hi: Value) -> tuple[Float, Float]:
        """Return the first and the last share of values in a range, as `Parameter.shares`."""
        first = self._left(low, lo, hi, inclusive=False)
        return first, self._left(high, lo, hi, inclusive=True)

    def _left(self, value: Value, lo: Value, hi: Value, *, inclusive: bool) -> Float:
        left, corners = self._pieces(lo, hi)
        found = _along(self._below(value, inclusive=inclusive), corners, left)
        return np.where(corners[0] < corners[-1], found, 0.5)

    def met(self, low: float, high: float) -> float:
        """Return the share of driving time with values from low to high."""
        share = self._below(high, inclusive=True) - self._below(low, inclusive=False)
        return max(0.0, float(share))

    def band(self, value: float) -> Band:
        """Return the band that a value lies in."""
        return next((band for band in self.bands if value <= band.to), self.bands[-1])

    def words(self, low: float, high: float) -> str:
        """Return the bands from low to high in words, with their share: "night, 18 % of driving".

        Of a single value it is the share of its band.
        """
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
    rare = [band for band in bands if band.share < RARE]
    return ", ".join(
        f"{band.name} ({percent(band.share)}{'' if k else ' of driving'})"
        for k, band in enumerate(rare)
    )
