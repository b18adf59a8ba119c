"""How one parameter is distributed: forms of which both tails are computed to full precision.

Sources: peaks over a threshold: Coles, An Introduction to Statistical Modeling of Extreme Values
(2001), chapter 4; kernels reflected at bounds: Silverman, Density Estimation (1986), section 2.10.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.exposure.families import Beta, Family, Value
from bridgegen.scenario.language.distributions import Discrete, Distribution
from bridgegen.scenario.language.expression import FUNCTIONS, Expression

_exp, _log = FUNCTIONS["exp"][2], FUNCTIONS["log"][2]
_HALVINGS = 1100  # of any interval of doubles, until its ends are neighbours


class Marginal(Protocol):
    """A distribution of finite support.

    Attributes:
        low: smallest value.
        high: largest value.
        apart: whether its values are single ones, each with a probability instead of a density.
        text: the form in words.
    """

    @property
    def low(self) -> float: ...  # noqa: D102

    @property
    def high(self) -> float: ...  # noqa: D102

    @property
    def apart(self) -> bool: ...  # noqa: D102

    @property
    def text(self) -> str: ...  # noqa: D102

    def value(self, tail: Float, upper: Bool) -> Float:
        """Return the values beyond which these probabilities are, ``(N,)``.

        Args:
            tail: ``(N,)`` in [0, 1].
            upper: ``(N,)`` whether it is the probability above the value, not below it.
        """

    def tails(self, value: Float) -> tuple[Float, Float]:
        """Return the probability below and the one above these values, ``(N,)`` each.

        Args:
            value: ``(N,)``; outside the support one of both is 0. Of single values, half of the
                value's own probability belongs to each.
        """

    def log_density(self, value: Float) -> Float:
        """Return the natural logarithm of the density, ``(N,)`` [1/unit]; -inf outside."""


@dataclass(frozen=True)
class Shared:
    """A distribution of `bridgegen.scenario.language.distributions`.

    Attributes:
        distribution: which.
    """

    distribution: Distribution

    @property
    def low(self) -> float:
        """See `Marginal`."""
        return self.distribution.low

    @property
    def high(self) -> float:
        """See `Marginal`."""
        return self.distribution.high

    @property
    def apart(self) -> bool:
        """See `Marginal`."""
        return isinstance(self.distribution, Discrete) or self.low == self.high

    @property
    def text(self) -> str:
        """See `Marginal`."""
        return type(self.distribution).__name__.lower()

    def value(self, tail: Float, upper: Bool) -> Float:
        """See `Marginal`."""
        return self.distribution.value(np.where(upper, 1.0 - tail, tail))

    def tails(self, value: Float) -> tuple[Float, Float]:
        """See `Marginal`."""
        below = self.distribution.share(np.clip(value, self.low, self.high))
        return below, 1.0 - below

    def log_density(self, value: Float) -> Float:
        """See `Marginal`."""
        with np.errstate(divide="ignore"):
            log: Float = _log(self.distribution.density(value))
        return log


@dataclass(frozen=True)
class Truncated:
    """A family's distribution, cut off at both ends.

    Attributes:
        family: which.
        numbers: those of its keys, each a number or ``(N,)``, one for each row.
        low: smallest value.
        high: largest value.

    Raises:
        InputError: a number that is not finite or not above 0 where it must be, or no probability
            from low to high.
    """

    family: type[Family]
    numbers: tuple[Value, ...]
    low: float
    high: float

    apart = False

    def __post_init__(self) -> None:
        for key, number in zip(self.family.keys, self.numbers, strict=True):
            least = 0.0 if key in self.family.positive else -np.inf
            good = np.isfinite(number) & (np.asarray(number) > least)
            if not np.all(good):
                must = "above 0" if key in self.family.positive else "finite"
                first = np.atleast_1d(number)[~np.atleast_1d(good)][0]
                raise InputError(f"{key} must be {must}, got {first:g}")
        if not self.low < self.high:
            raise InputError(f"low < high must hold, got low={self.low:g}, high={self.high:g}")
        mass = self._ends[4]
        if not np.all(mass > 0.0):
            raise InputError(
                f"the {self.family.name} distribution must have probability from {self.low:g} to "
                f"{self.high:g}, and has none"
            )

    @property
    def text(self) -> str:
        """See `Marginal`."""
        given = zip(self.family.keys, self.numbers, strict=True)
        numbers = ", ".join(f"{key} {float(np.ravel(array)[0]):.4g}" for key, array in given)
        return f"{self.family.name} ({numbers})"

    @property
    def _all(self) -> tuple[Value, ...]:
        ends = (self.low, self.high) if self.family is Beta else ()
        return (*self.numbers, *ends)

    @cached_property
    def _ends(self) -> tuple[Value, Value, Value, Value, Value]:
        """Of the whole distribution: below low, above low, below high, above high, between."""
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            below_low, below_high = (
                self.family.below(x, *self._all) for x in (self.low, self.high)
            )
            above_low, above_high = (
                self.family.above(x, *self._all) for x in (self.low, self.high)
            )
        # In the upper tail the difference of probabilities below would be one of two numbers near
        # 1, of which no digit is left.
        between = np.where(below_low > 0.5, above_low - above_high, below_high - below_low)
        return below_low, above_low, below_high, above_high, between

    def value(self, tail: Float, upper: Bool) -> Float:
        """See `Marginal`."""
        below_low, above_low, below_high, above_high, mass = self._ends
        part = tail * mass
        below = np.where(upper, below_high - part, below_low + part)
        above = np.where(upper, above_high + part, above_low - part)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            x = np.where(
                # Each value by the tail that it is in: so rare ends keep all their digits, on
                # either side.
                below <= above,
                self.family.value_below(np.clip(below, 0.0, 1.0), *self._all),
                self.family.value_above(np.clip(above, 0.0, 1.0), *self._all),
            )
        clipped: Float = np.clip(x, self.low, self.high)
        return clipped

    def tails(self, value: Float) -> tuple[Float, Float]:
        """See `Marginal`."""
        below_low, above_low, below_high, above_high, mass = self._ends
        x = np.clip(value, self.low, self.high)
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            below, above = self.family.below(x, *self._all), self.family.above(x, *self._all)
        return _parts(below, above, below_low, above_low, below_high, above_high, mass)

    def log_density(self, value: Float) -> Float:
        """See `Marginal`."""
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            log = self.family.log_density(value, *self._all) - _log(self._ends[4])
        return np.where((self.low <= value) & (value <= self.high), log, -np.inf)


def _parts(
    below: Value,
    above: Value,
    below_low: Value,
    above_low: Value,
    below_high: Value,
    above_high: Value,
    mass: Value,
) -> tuple[Float, Float]:
    """Return both tails of a value of what is left of a distribution between two ends."""
    lower = np.where(below <= above, below - below_low, above_low - above) / mass
    upper = np.where(below <= above, below_high - below, above - above_high) / mass
    return np.clip(lower, 0.0, 1.0), np.clip(upper, 0.0, 1.0)


@dataclass(frozen=True)
class Clipped:
    """A distribution without what is outside a range.

    Attributes:
        whole: what is cut off.
        low: smallest value.
        high: largest value.

    Raises:
        InputError: no probability from low to high.
    """

    whole: Marginal
    low: float
    high: float

    apart = False

    def __post_init__(self) -> None:
        if not (self.low < self.high and self._ends[4] > 0.0):
            raise InputError(
                f"the distribution ({self.whole.text}) must have probability from {self.low:g} to "
                f"{self.high:g}, and has none"
            )

    @property
    def text(self) -> str:
        """See `Marginal`."""
        return self.whole.text

    @cached_property
    def _ends(self) -> tuple[float, float, float, float, float]:
        """As of `Truncated`."""
        below, above = (tail.tolist() for tail in self.whole.tails(np.array([self.low, self.high])))
        between = above[0] - above[1] if below[0] > 0.5 else below[1] - below[0]
        return below[0], above[0], below[1], above[1], between

    def value(self, tail: Float, upper: Bool) -> Float:
        """See `Marginal`."""
        below_low, above_low, below_high, above_high, mass = self._ends
        part = tail * mass
        below = np.where(upper, below_high - part, below_low + part)
        above = np.where(upper, above_high + part, above_low - part)
        far = above < below
        tail = np.clip(np.where(far, above, below), 0.0, 1.0)
        return np.clip(self.whole.value(tail, far), self.low, self.high)

    def tails(self, value: Float) -> tuple[Float, Float]:
        """See `Marginal`."""
        below_low, above_low, below_high, above_high, mass = self._ends
        below, above = self.whole.tails(np.clip(value, self.low, self.high))
        return _parts(below, above, below_low, above_low, below_high, above_high, mass)

    def log_density(self, value: Float) -> Float:
        """See `Marginal`."""
        log = self.whole.log_density(value) - float(np.log(self._ends[4]))
        return np.where((self.low <= value) & (value <= self.high), log, -np.inf)


@dataclass(frozen=True)
class Mirrored:
    """A distribution with its sign changed, about a point: ``center - X`` for an X.

    Attributes:
        whole: how X is distributed.
        center: the value where X is 0.
    """

    whole: Truncated
    center: float

    apart = False

    @property
    def low(self) -> float:
        """See `Marginal`."""
        return self.center - self.whole.high

    @property
    def high(self) -> float:
        """See `Marginal`."""
        return self.center - self.whole.low

    @property
    def text(self) -> str:
        """See `Marginal`."""
        return f"{self.whole.text}, mirrored"

    def value(self, tail: Float, upper: Bool) -> Float:
        """See `Marginal`."""
        return self.center - self.whole.value(tail, ~upper)

    def tails(self, value: Float) -> tuple[Float, Float]:
        """See `Marginal`."""
        below, above = self.whole.tails(self.center - value)
        return above, below

    def log_density(self, value: Float) -> Float:
        """See `Marginal`."""
        return self.whole.log_density(self.center - value)


@dataclass(frozen=True)
class Spliced:
    """Distributions side by side: a body, and tails beyond thresholds.

    Attributes:
        pieces: ascending, each with its probability; they do not overlap.
    """

    pieces: tuple[tuple[Marginal, float], ...]

    apart = False

    @property
    def low(self) -> float:
        """See `Marginal`."""
        return self.pieces[0][0].low

    @property
    def high(self) -> float:
        """See `Marginal`."""
        return self.pieces[-1][0].high

    @property
    def text(self) -> str:
        """See `Marginal`."""
        return ", ".join(f"{share:.3g} of {piece.text}" for piece, share in self.pieces)

    @cached_property
    def _beside(self) -> tuple[Float, Float]:
        """The probability below each piece, and above it."""
        shares = np.array([share for _, share in self.pieces])
        below = np.concatenate([[0.0], np.cumsum(shares)[:-1]])
        above = np.concatenate([np.cumsum(shares[::-1])[-2::-1], [0.0]])
        return below, above

    def value(self, tail: Float, upper: Bool) -> Float:
        """See `Marginal`."""
        below, above = self._beside
        result = np.empty(len(tail))
        lower_at = np.searchsorted(below[1:], tail, side="right")
        upper_at = len(above) - 1 - np.searchsorted(above[-2::-1], tail, side="right")
        at = np.where(upper, upper_at, lower_at)
        for k, (marginal, share) in enumerate(self.pieces):
            mine = at == k
            part = (tail[mine] - np.where(upper[mine], above[k], below[k])) / share
            result[mine] = marginal.value(np.clip(part, 0.0, 1.0), upper[mine])
        return result

    def tails(self, value: Float) -> tuple[Float, Float]:
        """See `Marginal`."""
        lower, upper = np.empty(len(value)), np.empty(len(value))
        at = self._at(value)
        for k, (marginal, share) in enumerate(self.pieces):
            mine = at == k
            below, above = marginal.tails(value[mine])
            lower[mine] = self._beside[0][k] + share * below
            upper[mine] = self._beside[1][k] + share * above
        return lower, upper

    def log_density(self, value: Float) -> Float:
        """See `Marginal`."""
        result = np.empty(len(value))
        at = self._at(value)
        for k, (marginal, share) in enumerate(self.pieces):
            mine = at == k
            result[mine] = np.log(share) + marginal.log_density(value[mine])
        return result

    def _at(self, value: Float) -> "np.typing.NDArray[np.int64]":
        starts = np.array([piece.low for piece, _ in self.pieces])
        return np.maximum(np.searchsorted(starts, value, side="right") - 1, 0)


@dataclass(frozen=True)
class Polygon:
    """A density that is linear between corners.

    Attributes:
        at: places of the corners, ascending, at least two.
        heights: the density there, >= 0, of any integral above 0.
        text: the form in words.
    """

    at: tuple[float, ...]
    heights: tuple[float, ...]
    text: str = "polygon"

    apart = False

    @property
    def low(self) -> float:
        """See `Marginal`."""
        return self.at[0]

    @property
    def high(self) -> float:
        """See `Marginal`."""
        return self.at[-1]

    @cached_property
    def _table(self) -> tuple[Float, Float, Float, Float]:
        """The corners, the density at them, and the probability below and above each."""
        at, heights = np.array(self.at), np.array(self.heights)
        areas = 0.5 * (heights[1:] + heights[:-1]) * np.diff(at)
        whole = areas.sum()
        below = np.concatenate([[0.0], np.cumsum(areas)]) / whole
        above = np.concatenate([np.cumsum(areas[::-1])[::-1], [0.0]]) / whole
        return at, heights / whole, below, above

    def value(self, tail: Float, upper: Bool) -> Float:
        """See `Marginal`."""
        at, height, below, above = self._table
        last = len(at) - 2
        k = np.minimum(np.searchsorted(below[1:], tail, side="right"), last)
        from_low = at[k] + _reach(tail - below[k], height[k], height[k + 1], at[k + 1] - at[k])
        j = last - np.minimum(np.searchsorted(above[-2::-1], tail, side="right"), last)
        from_high = at[j + 1] - _reach(
            tail - above[j + 1], height[j + 1], height[j], at[j + 1] - at[j]
        )
        return np.clip(np.where(upper, from_high, from_low), self.low, self.high)

    def tails(self, value: Float) -> tuple[Float, Float]:
        """See `Marginal`."""
        at, height, below, above = self._table
        x = np.clip(value, self.low, self.high)
        k = np.clip(np.searchsorted(at, x, side="right") - 1, 0, len(at) - 2)
        slope = (height[k + 1] - height[k]) / (at[k + 1] - at[k])
        left, right = x - at[k], at[k + 1] - x
        lower = below[k] + left * (height[k] + 0.5 * slope * left)
        upper = above[k + 1] + right * (height[k + 1] - 0.5 * slope * right)
        return np.clip(lower, 0.0, 1.0), np.clip(upper, 0.0, 1.0)

    def log_density(self, value: Float) -> Float:
        """See `Marginal`."""
        at, height, _, _ = self._table
        inside = (self.low <= value) & (value <= self.high)
        with np.errstate(divide="ignore"):
            log: Float = _log(np.where(inside, np.interp(value, at, height), 0.0))
        return log


def _reach(area: Float, near: Float, far: Float, width: Float) -> Float:
    """Return how far from its near end a trapezium holds an area."""
    slope = (far - near) / width
    # The quadratic's root in the form that adds: the usual one subtracts two near numbers where the
    # density is nearly constant.
    root = near + np.sqrt(np.maximum(near * near + 2.0 * slope * area, 0.0))
    reach = np.divide(2.0 * area, root, out=np.zeros(len(area)), where=root > 0.0)
    return np.clip(reach, 0.0, width)


@dataclass(frozen=True)
class Mixture:
    """A weighted sum of distributions.

    Attributes:
        parts: each with its share; the shares sum to 1.
    """

    parts: tuple[tuple[Marginal, float], ...]

    apart = False

    @property
    def low(self) -> float:
        """See `Marginal`."""
        return min(part.low for part, _ in self.parts)

    @property
    def high(self) -> float:
        """See `Marginal`."""
        return max(part.high for part, _ in self.parts)

    @property
    def text(self) -> str:
        """See `Marginal`."""
        return "mixture of " + ", ".join(f"{share:.3g} {part.text}" for part, share in self.parts)

    def value(self, tail: Float, upper: Bool) -> Float:
        """See `Marginal`; by halving the interval between the parts' values."""
        each = [part.value(tail, upper) for part, _ in self.parts]
        below, above = np.minimum.reduce(each), np.maximum.reduce(each)
        # Halving, and not Newton: a mixture's density may be 0 between its parts. It ends where
        # both ends are neighbouring doubles, and the result does not depend on a tolerance.
        for _ in range(_HALVINGS):
            middle = below + 0.5 * (above - below)
            if np.all((middle <= below) | (middle >= above)):
                break
            lower, higher = self.tails(middle)
            left = np.where(upper, higher > tail, lower < tail)  # the value is to the right
            below, above = np.where(left, middle, below), np.where(left, above, middle)
        result: Float = above
        return result

    def tails(self, value: Float) -> tuple[Float, Float]:
        """See `Marginal`."""
        lower, upper = np.zeros(len(value)), np.zeros(len(value))
        for part, share in self.parts:
            below, above = part.tails(value)
            lower += share * np.where(value > part.high, 1.0, below)
            upper += share * np.where(value < part.low, 1.0, above)
        return lower, upper

    def log_density(self, value: Float) -> Float:
        """See `Marginal`."""
        density = np.zeros(len(value))
        for part, share in self.parts:
            density += share * _exp(part.log_density(value))
        with np.errstate(divide="ignore"):
            log: Float = _log(density)
        return log


@dataclass(frozen=True)
class Conditional:
    """A family of which some numbers are formulas of other parameters.

    Attributes:
        family: which.
        formulas: one for each of its keys.
        low: smallest value.
        high: largest value.
        label: the parameter with its unit and place, for messages.
    """

    family: type[Family]
    formulas: tuple[Expression, ...]
    low: float
    high: float
    label: str

    apart = False

    @property
    def text(self) -> str:
        """See `Marginal`."""
        given = zip(self.family.keys, self.formulas, strict=True)
        return (
            f"{self.family.name} ({', '.join(f'{key} {expression}' for key, expression in given)})"
        )

    @property
    def names(self) -> frozenset[str]:
        """The parameters and derived quantities that it depends on."""
        return frozenset().union(*(formula.names for formula in self.formulas))

    def given(self, table: Mapping[str, Float | float]) -> Truncated:
        """Return the distribution in each row.

        Args:
            table: of each of ``names`` the values ``(N,)``, or one.

        Raises:
            InputError: a formula gives a number that the family does not take, somewhere.
        """
        numbers = tuple(formula.evaluate(table) for formula in self.formulas)
        try:
            return Truncated(self.family, numbers, self.low, self.high)
        except InputError as error:
            raise InputError(f"the distribution of {self.label}: {error}") from None


Form = Shared | Truncated | Clipped | Mirrored | Spliced | Polygon | Mixture
