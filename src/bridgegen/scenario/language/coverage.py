"""Which bins of the searched parameters, and which t-way combinations of bins, a run has seen.

A t-way combination is one bin of each of t parameters (Kuhn, Kacker and Lei, "Combinatorial
coverage as an aspect of test quality", CrossTalk 2015). Bins divide the *declared* range of a
parameter. Constraints narrow that range, so that some combinations exist in no scenario and can
never be covered. Which they are follows from no formula; a fixed random sample of the search
space says which are feasible. A combination that is possible but rare may be missing from it: the
number of feasible ones is a lower bound.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from math import prod
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int, Numbers
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.binned import BinnedRows
from bridgegen.scenario.language.space import SearchSpace

SAMPLE = 200_000
"""Number of random points of the search space, always the same ones, that show what is feasible."""

MAX_STRENGTH = 3
MAX_BINS = 1000

MAX_GRID = 2_500
"""Pairs of bins of two parameters that are counted one by one; whole numbers may have more."""


@dataclass(frozen=True)
class ParameterBins:
    """The bins of one searched parameter.

    Attributes:
        name: the parameter.
        unit: its unit.
        axis: where it belongs.
        integer: whether each bin is one whole number, at its centre.
        labels: how its values are read, `bridgegen.scenario.language.kinds.Kind.labels`.
        span: its declared range in words.
        edges: ``(n + 1,)`` float64 in the unit, ascending; a value on an inner edge belongs to
            the upper bin.
        evaluated: ``(n,)`` int64, rows in each bin.
        critical: ``(n,)`` int64, critical ones among them.
        feasible: ``(n,)`` bool, whether the sample or the run has a row there.
        met: ``(n,)`` float64, the share of what is met on the road; None if that is not known.
    """

    name: str
    unit: str
    axis: str
    integer: bool
    labels: Mapping[str, Any]
    span: str
    edges: Float
    evaluated: Int
    critical: Int
    feasible: Bool
    met: Float | None = None


@dataclass(frozen=True)
class Ways:
    """How many t-way combinations of bins there are, over all choices of t parameters.

    Attributes:
        strength: t.
        total: all of them.
        feasible: those met in the sample or in the run; at most ``total``.
        evaluated: those that an evaluated row is in; at most ``feasible``.
        critical: those that a critical row is in; at most ``evaluated``.
        met_evaluated: the share of what is met on the road in evaluated ones, the mean over all
            choices of t parameters; None if that is not known.
        met_critical: likewise in those of critical rows.
    """

    strength: int
    total: int
    feasible: int
    evaluated: int
    critical: int
    met_evaluated: float | None = None
    met_critical: float | None = None

    @property
    def share(self) -> float:
        """Evaluated combinations of the feasible ones, in [0, 1]; 0 where none is known."""
        return self.evaluated / max(self.feasible, 1)


@dataclass(frozen=True)
class Coverage:
    """What a run has covered of its search space.

    Attributes:
        evaluations: rows that were evaluated; failed simulations are none.
        critical: critical ones among them.
        sample: random points that ``feasible`` is estimated from.
        parameters: every searched parameter, in the search space's order.
        ways: for t = 1, 2 … up to the strength, or to the number of parameters.
    """

    evaluations: int
    critical: int
    sample: int
    parameters: tuple[ParameterBins, ...]
    ways: tuple[Ways, ...]


@dataclass(frozen=True)
class PairBins:
    """The bins of two searched parameters, n of the first and m of the second.

    Attributes:
        first: one parameter.
        second: the other, later in the search space's order.
        ways: how many pairs of their bins there are; ``strength`` is 2.
        evaluated: ``(n, m)`` int64, rows in each pair of bins; None if n·m is above `MAX_GRID`.
        critical: ``(n, m)`` int64, critical ones among them; likewise.
        feasible: ``(n, m)`` bool, whether the sample or the run has a row there; likewise.
    """

    first: str
    second: str
    ways: Ways
    evaluated: Int | None
    critical: Int | None
    feasible: Bool | None


@dataclass(frozen=True)
class CoverageMap:
    """What a run has covered, and where: to be drawn.

    Attributes:
        total: over all parameters.
        pairs: every pair of parameters, in the order of `itertools.combinations`.
    """

    total: Coverage
    pairs: tuple[PairBins, ...]


def coverage(
    space: SearchSpace,
    X: Numbers,
    critical: Bool,
    *,
    bins: int = 5,
    strength: int = MAX_STRENGTH,
    sample: int = SAMPLE,
    met: Float | None = None,
) -> Coverage:
    """Count the bins, and the t-way combinations of bins, that rows are in.

    Args:
        space: what was searched.
        X: ``(N, len(space.names))`` float64, rows whose simulation succeeded.
        critical: ``(N,)`` bool.
        bins: equal bins over the declared range; a parameter of whole numbers has one for each.
        strength: the largest t.
        sample: random points that show what is feasible, besides X.
        met: ``(M, len(space.names))`` float64, what is met on the road.

    Raises:
        InputError: bins or strength out of range.
        ValueError: wrong shape.
    """
    _check(bins, strength)
    rows = BinnedRows(space, X, critical, bins, sample, met)
    ways = (_ways(rows, t) for t in range(1, min(strength, len(rows.names)) + 1))
    return Coverage(rows.n_rows, rows.n_critical, sample, _parameters(rows), tuple(ways))


def coverage_map(
    space: SearchSpace,
    X: Numbers,
    critical: Bool,
    *,
    bins: int = 5,
    strength: int = MAX_STRENGTH,
    sample: int = SAMPLE,
) -> CoverageMap:
    """Count as `coverage` does, and return the pairs of bins of the rows.

    Args:
        space: what was searched.
        X: ``(N, len(space.names))`` float64, rows whose simulation succeeded.
        critical: ``(N,)`` bool.
        bins: as for `coverage`.
        strength: the largest t; pairs are counted even where it is 1.
        sample: as for `coverage`.

    Raises:
        InputError: bins or strength out of range.
        ValueError: wrong shape.
    """
    _check(bins, strength)
    rows = BinnedRows(space, X, critical, bins, sample)
    pairs = tuple(_pair(rows, i, j) for i, j in combinations(range(len(rows.names)), 2))
    ways = []
    for t in range(1, min(strength, len(rows.names)) + 1):
        ways.append(_ways(rows, t) if t != 2 else _sum([pair.ways for pair in pairs]))
    total = Coverage(rows.n_rows, rows.n_critical, sample, _parameters(rows), tuple(ways))
    return CoverageMap(total, pairs)


def _check(bins: int, strength: int) -> None:
    problems = [
        f"1 <= {name} <= {high} must hold, got {value}"
        for name, value, high in (("bins", bins, MAX_BINS), ("strength", strength, MAX_STRENGTH))
        if not 1 <= value <= high
    ]
    if problems:
        raise InputError(*problems)


def _parameters(rows: BinnedRows) -> tuple[ParameterBins, ...]:
    found = []
    for number, name in enumerate(rows.names):
        one = rows.space.parameters[name]
        critical, evaluated, met = rows.counts([number])
        found.append(
            ParameterBins(
                name,
                one.unit,
                str(one.axis),
                one.kind.apart,
                one.kind.labels(),
                one.kind.span_text(one.low, one.high, "{:g}".format, f" {one.unit}"),
                rows.edges[number],
                evaluated=evaluated,
                critical=critical,
                feasible=met > 0,
                met=rows.met(number) if rows.n_met else None,
            )
        )
    return tuple(found)


def _ways(rows: BinnedRows, t: int) -> Ways:
    total, found = 0, np.zeros(3, np.int64)
    met: list[tuple[float, float]] = []
    for chosen in combinations(range(len(rows.names)), t):
        total += prod(rows.sizes[k] for k in chosen)
        found += rows.distinct(chosen)
        if rows.n_met:
            met.append(rows.met_among(chosen))
    hit, seen = np.mean(met, axis=0).tolist() if met else (None, None)
    return Ways(t, total, int(found[2]), int(found[1]), int(found[0]), seen, hit)


def _pair(rows: BinnedRows, i: int, j: int) -> PairBins:
    first, second = rows.names[i], rows.names[j]
    total = rows.sizes[i] * rows.sizes[j]
    if total > MAX_GRID:
        hit, seen, met = rows.distinct([i, j])
        return PairBins(first, second, Ways(2, total, met, seen, hit), None, None, None)
    counts = rows.counts([i, j])
    critical, evaluated, feasible = counts
    hit, seen, met = (int(np.count_nonzero(one)) for one in counts)
    ways = Ways(2, total, met, seen, hit)
    return PairBins(first, second, ways, evaluated, critical, feasible > 0)


def _sum(ways: list[Ways]) -> Ways:
    """Return the sum over all pairs of parameters, of which there is one at least."""
    return Ways(
        2,
        sum(one.total for one in ways),
        sum(one.feasible for one in ways),
        sum(one.evaluated for one in ways),
        sum(one.critical for one in ways),
    )
