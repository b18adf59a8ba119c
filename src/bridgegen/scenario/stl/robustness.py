"""The margin by which recordings satisfy a formula."""

from collections.abc import Callable
from functools import reduce
from math import ceil, floor, inf

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.scenario.stl import formula as f

TINY = float(np.finfo(np.float64).tiny)
"""Value in place of 0 in a margin: > 0 where a comparison of equal sides holds, < 0 where it does
not. So the sign of a margin says exactly whether a formula holds, strict comparisons and negations
included."""

_ROUNDING = 1e-9
"""Rounding tolerance of an instant's number [steps]: 0.15 s are three steps of 0.05 s, despite
binary fractions."""


def robustness(
    formula: f.Formula, read: Callable[[f.Reading], Float], n_steps: Int, time_step: float
) -> Float:
    """Return the margins of N recordings at their first instant.

    Args:
        formula: as `parse` gives it.
        read: returns a signal, ``(N, T)`` float64, or a metric, ``(N, 1)``, in SI units; values may
            be infinite, but are not NaN.
        n_steps: ``(N,)`` int64, the real instants of each; what lies behind them has no part.
        time_step: [s] between two instants.

    Returns:
        ``(N,)`` float64, > 0 where the formula holds and < 0 where it does not, never 0; in the
        unit of the comparison that decides. It is infinite where an interval has no instant in the
        recording: inf of ``always``, −inf of ``eventually``.

    Source: see `bridgegen.scenario.stl`; windows are cut off at the recording's end.
    """
    found: Float = _Evaluation(read, n_steps, time_step).formula(formula)[0]
    return found.copy()


class _Evaluation:
    """One batch of recordings.

    Arrays are ``(T, N)``, instants first, so that all runs over time take whole lines of memory.
    """

    def __init__(self, read: Callable[[f.Reading], Float], n_steps: Int, time_step: float) -> None:
        self._given, self._n_steps, self._time_step = read, n_steps, time_step
        self._shape = (int(n_steps.max(initial=1)), len(n_steps))
        self._padding: Bool = np.arange(self._shape[0])[:, np.newaxis] >= n_steps
        self._padded = bool(self._padding.any())
        self._known: dict[tuple[str, tuple[str, ...]], Float] = {}

    def formula(self, comparison: f.Formula) -> Float:
        """Return the margins at each instant."""
        return np.broadcast_to(self._margins(comparison), self._shape)

    def _margins(self, formula: f.Formula) -> Float:
        """Return the margins at each instant, or at all alike, ``(1, N)`` or ``(1, 1)``."""
        if isinstance(formula, f.Comparison):
            return self._comparison(formula)
        if isinstance(formula, f.Not):
            return -self._margins(formula.formula)
        if isinstance(formula, f.Junction):
            join = np.minimum if formula.sign == "and" else np.maximum
            joined: Float = join(self._margins(formula.left), self._margins(formula.right))
            return joined
        if isinstance(formula, f.Temporal):
            return self._temporal(formula)
        return self._until(formula)

    def _term(self, term: f.Term) -> Float:
        """Return the values, of a shape as those of ``_margins``."""
        if isinstance(term, f.Constant):
            return np.full((1, 1), term.value)
        if isinstance(term, f.Reading):
            key = (term.name, term.of)
            if key not in self._known:
                given = self._given(term)[:, : self._shape[0]]
                self._known[key] = np.ascontiguousarray(given.T)
            return self._known[key]
        if isinstance(term, f.Arithmetic):
            return self._arithmetic(term)
        if isinstance(term, f.Function):
            values = [self._term(each) for each in term.terms]
            if term.name == "abs":
                return np.abs(values[0])
            return reduce(np.minimum if term.name == "min" else np.maximum, values)
        return self._whole(term)

    def _arithmetic(self, arithmetic: f.Arithmetic) -> Float:
        left, right = self._term(arithmetic.left), self._term(arithmetic.right)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            found = _ARITHMETIC[arithmetic.sign](left, right)
        return np.where(np.isnan(found), inf, found)  # of 0/0, and of differences of infinities

    def _whole(self, whole: f.Whole) -> Float:
        values = np.broadcast_to(self._term(whole.term), self._shape)
        if whole.name == "first":
            return values[:1]
        if whole.name == "last":
            return np.take_along_axis(values, self._n_steps[np.newaxis] - 1, axis=0)
        least = whole.name == "min"
        kept = self._filled(values, inf if least else -inf)
        found: Float = (np.min if least else np.max)(kept, axis=0, keepdims=True)
        return found

    def _filled(self, values: Float, neutral: float) -> Float:
        """Return values that have no part behind the end of a recording."""
        return np.where(self._padding, neutral, values) if self._padded else values

    def _comparison(self, comparison: f.Comparison) -> Float:
        left, right = self._term(comparison.left), self._term(comparison.right)
        if comparison.sign in ("<", "<="):
            left, right = right, left
        with np.errstate(invalid="ignore"):
            found = left - right
        # One sum tells whether any value is NaN, and costs no array of flags.
        if np.isnan(found.sum()):  # equal infinities
            found[left == right] = 0.0
        if comparison.sign in ("==", "!="):
            found = np.abs(found)
        zero = TINY if comparison.sign in ("<=", ">=", "==") else -TINY
        if comparison.sign == "==":
            found = -found
        found[found == 0.0] = zero
        return found

    def _window(self, interval: f.Interval) -> tuple[int, int]:
        """Return the instants of an interval, relative to the present one, both included."""
        most = self._shape[0]  # beyond every recording
        if interval.low / self._time_step >= most:
            return most, most
        low = ceil(interval.low / self._time_step - _ROUNDING)
        if interval.high / self._time_step >= most:
            return low, most
        return low, floor(interval.high / self._time_step + _ROUNDING)

    def _temporal(self, temporal: f.Temporal) -> Float:
        low, high = self._window(temporal.interval)
        least = temporal.name in ("always", "historically")
        neutral, values = inf if least else -inf, self.formula(temporal.formula)
        if temporal.name in ("historically", "once"):
            return _over_window(values[::-1], low, high, neutral)[::-1]
        return _over_window(self._filled(values, neutral), low, high, neutral)

    def _until(self, until: f.Until) -> Float:
        low, high = self._window(until.interval)
        left, right = self.formula(until.left), self.formula(until.right)
        if until.name == "since":
            return _until(left[::-1], right[::-1], low, high)[::-1]
        return _until(left, self._filled(right, -inf), low, high)


_ARITHMETIC = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}


def _shifted(values: Float, by: int, fill: float) -> Float:
    """Return what stands ``by`` instants later, ``fill`` behind the end."""
    if by == 0:
        return values
    out = np.full(values.shape, fill)
    if by < len(values):
        out[: len(values) - by] = values[by:]
    return out


def _over_window(values: Float, low: int, high: int, neutral: float) -> Float:
    """Return the least (neutral inf) or greatest (−inf) of instants k + low … k + high of each k.

    Windows of two, four, eight … instants are made of each other.
    """
    join = np.minimum if neutral > 0.0 else np.maximum
    if high < low:
        return np.full(values.shape, neutral)
    # A window to the end is a running extreme: one pass, whatever its length.
    if high >= len(values) - 1:
        whole: Float = join.accumulate(values[::-1], axis=0)[::-1]
        return _shifted(whole, low, neutral)
    width, have = high - low + 1, 1
    found = values
    while 2 * have <= width:
        found = join(found, _shifted(found, have, neutral))
        have *= 2
    ahead = _shifted(found, low, neutral)
    if width > have:
        # Two overlapping windows of a power of two cover any width: an extreme may count an instant
        # twice. So a window costs log2(width) passes.
        ahead = join(ahead, _shifted(found, low + width - have, neutral))
    return ahead


def _until(left: Float, right: Float, low: int, high: int) -> Float:
    """Return max over j in low … high of min(right[k + j], left[k … k + j − 1]).

    An interval is that without an end, and ``right`` somewhere in it. Source: Donzé, Ferrère and
    Maler, Efficient robust monitoring for STL (CAV 2013).
    """
    if high < low:
        return np.full(left.shape, -inf)
    found = np.empty(left.shape)
    # Backwards: the value at an instant is that of the next one, limited by left, or right now.
    after = np.full(left.shape[1], -inf)
    for k in range(len(left) - 1, -1, -1):
        after = found[k] = np.maximum(right[k], np.minimum(left[k], after))
    if low:
        # Until the interval begins, left must hold all the time; from there on the unbounded one
        # counts.
        before = _over_window(left, 0, low - 1, inf)
        found = np.minimum(_shifted(found, low, -inf), before)
    if high < len(left) - 1:
        # The unbounded value may come from behind the interval; the least of it and of right's
        # greatest value in the interval is exact (Donzé et al.).
        found = np.minimum(found, _over_window(right, low, high, -inf))
    return found
