"""Which bins of the searched parameters, and which t-way combinations of bins, a run has seen.

A t-way combination is one bin of each of t parameters (Kuhn, Kacker and Lei, "Combinatorial
coverage as an aspect of test quality", CrossTalk 2015). Bins divide the *declared* range of a
parameter. Constraints narrow that range, so that some combinations exist in no scenario and can
never be covered. Which they are follows from no formula; a fixed random sample of the search
space says which are feasible. A combination that is possible but rare may be missing from it: the
number of feasible ones is a lower bound.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int, Numbers, as_float
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.space import SearchSpace

# --- Bins of rows, and of a random sample of the search space ---


# Rows decoded at a time, and cells of a table that marks combinations: both bound the memory.
_CHUNK = 20_000
_CELLS = 1 << 24


class BinnedRows:
    """The bins of rows and of a fixed random sample, to be counted parameter by parameter.

    Attributes:
        space: what was searched.
        names: of the parameters, as they are numbered: all that are searched, but for an
            adversary's decisions.
        edges: per parameter ``(n + 1,)`` float64 in its unit, ascending.
        sizes: per parameter n, its bins.
        n_rows: N.
        n_critical: critical ones among the rows.
        n_met: how many rows say what is met on the road.

    Args:
        space: what was searched.
        X: ``(N, len(space.names))`` float64; read a stretch at a time.
        critical: ``(N,)`` bool.
        bins: equal bins over the declared range; a parameter of whole numbers has one for each.
        sample: random points of the space.
        met: ``(M, len(space.names))`` float64, what is met on the road.

    Raises:
        ValueError: wrong shape.
        ScenarioError: the constraints leave a parameter no value somewhere in the sample.
    """

    def __init__(
        self,
        space: SearchSpace,
        X: Numbers,
        critical: Bool,
        bins: int,
        sample: int,
        met: Float | None = None,
    ) -> None:
        as_float("X", X[:0], (None, len(space.names)))  # no row may be there to be checked
        hit = np.asarray(critical, np.bool_)
        if hit.shape != (len(X),):
            raise ValueError(f"critical must have shape ({len(X)},), got {hit.shape}")
        self.space = space
        self.names = tuple(name for name in space.variables if name not in space.decisions)
        self.edges = [_edges(space, name, bins) for name in self.names]
        self.sizes = [len(edge) - 1 for edge in self.edges]
        self.n_rows, self.n_critical = len(X), int(hit.sum())
        # Sorted into critical rows, other rows, sample: each is a stretch of columns.
        kind = np.min_scalar_type(max(self.sizes, default=0))
        # The smallest integers that hold the bins: a run of a million rows is counted in memory.
        self._where = np.empty((len(self.names), len(X) + sample), kind)
        place, end = np.argsort(np.argsort(~hit, kind="stable")), len(X)
        for start in range(0, len(X), _CHUNK):
            part = as_float("X", X[start : start + _CHUNK], (None, len(space.names)))
            self._where[:, place[start : start + len(part)]] = self._bin(part)
        for sampled in self._sampled(sample):
            self._where[:, end : end + sampled.shape[1]] = sampled
            end += sampled.shape[1]
        self._ends = (self.n_critical, self.n_rows, self._where.shape[1])
        self.n_met = 0 if met is None else len(met)
        self._met = np.empty((len(self.names), 0), kind) if met is None else self._bin(met)

    def counts(self, chosen: Sequence[int]) -> tuple[Int, Int, Int]:
        """Return how many are in each combination of the chosen parameters' bins.

        Args:
            chosen: numbers of parameters; their bins' product must fit into memory.

        Returns:
            Critical rows, rows, and rows with sample; each ``(n, m, …)`` int64.
        """
        shape = tuple(self.sizes[k] for k in chosen)
        codes, start, found = self._codes(chosen), 0, []
        for end in self._ends:
            found.append(np.bincount(codes[start:end], minlength=prod(shape)).reshape(shape))
            start = end
        critical, other, sampled = found
        return critical, critical + other, critical + other + sampled

    def distinct(self, chosen: Sequence[int]) -> list[int]:
        """Return how many combinations of the chosen parameters' bins occur.

        Args:
            chosen: numbers of parameters.

        Returns:
            In the critical rows, in the rows, and in the rows or the sample.
        """
        codes, cells = self._codes(chosen), prod(self.sizes[k] for k in chosen)
        # A table of marks where it fits, else distinct numbers, which cost a sort.
        if cells > _CELLS:
            return [len(np.unique(codes[:end])) for end in self._ends]
        marks, counts, start = np.zeros(cells, np.bool_), [], 0
        for end in self._ends:
            marks[codes[start:end]] = True
            counts.append(int(np.count_nonzero(marks)))
            start = end
        return counts

    def met(self, number: int) -> Float:
        """Return the share of what is met on the road in each bin of a parameter, ``(n,)``."""
        counts = np.bincount(self._met[number], minlength=self.sizes[number])
        return np.asarray(counts / self.n_met)

    def met_among(self, chosen: Sequence[int]) -> tuple[float, float]:
        """Return what share of what is met is in a combination of bins that rows are in.

        Args:
            chosen: numbers of parameters.

        Returns:
            In combinations of critical rows, and of all rows.
        """
        rows, road = self._codes(chosen), self._codes_of(self._met, chosen)
        found = (np.isin(road, np.unique(rows[:end])).mean() for end in self._ends[:2])
        critical, evaluated = (float(item) for item in found)
        return critical, evaluated

    def _bin(self, X: Float) -> npt.NDArray[np.int32]:
        """Return ``(len(names), len(X))``, the bin of every parameter."""
        where = np.empty((len(self.names), len(X)), np.int32)
        for number, name in enumerate(self.names):
            column = np.ascontiguousarray(X[:, self.space.index(name)])
            # Inner edges only: what rounding puts beyond an end is in the last bin there.
            where[number] = np.searchsorted(self.edges[number][1:-1], column, side="right")
        return where

    def _sampled(self, sample: int) -> Iterator[npt.NDArray[np.int32]]:
        """Yield the bins of the sample, a chunk at a time."""
        # Always the same sample: what is feasible belongs to the space, and two runs are to be
        # compared.
        rng = np.random.Generator(np.random.PCG64(0))
        for start in range(0, sample, _CHUNK):
            U = rng.random((min(_CHUNK, sample - start), self.space.n_var))
            yield self._bin(self.space.decode(U))

    def _codes(self, chosen: Sequence[int]) -> Int:
        """Return for every row and sample the number of its combination, in C order."""
        return self._codes_of(self._where, chosen)

    def _codes_of(self, where: npt.NDArray[Any], chosen: Sequence[int]) -> Int:
        codes = np.zeros(where.shape[1], np.int64)
        for k in chosen:
            codes *= self.sizes[k]
            codes += where[k]
        return codes


def _edges(space: SearchSpace, name: str, bins: int) -> Float:
    parameter = space.parameters[name]
    return parameter.kind.edges(parameter.low, parameter.high, bins)


SAMPLE = 200_000
"""Number of random points of the search space, always the same ones, that show what is feasible."""

MAX_STRENGTH = 3
MAX_BINS = 1000

MAX_GRID = 2_500
"""Largest number of pairs of bins of two parameters that are counted one by one; whole numbers may
have more."""


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
        parameter = rows.space.parameters[name]
        critical, evaluated, met = rows.counts([number])
        found.append(
            ParameterBins(
                name,
                parameter.unit,
                str(parameter.axis),
                parameter.kind.apart,
                parameter.kind.labels(),
                parameter.kind.span_text(
                    parameter.low, parameter.high, "{:g}".format, f" {parameter.unit}"
                ),
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
    hit, seen, met = (int(np.count_nonzero(count)) for count in counts)
    ways = Ways(2, total, met, seen, hit)
    return PairBins(first, second, ways, evaluated, critical, feasible > 0)


def _sum(ways: list[Ways]) -> Ways:
    """Return the sum over all pairs of parameters, of which there is one at least."""
    return Ways(
        2,
        sum(way.total for way in ways),
        sum(way.feasible for way in ways),
        sum(way.evaluated for way in ways),
        sum(way.critical for way in ways),
    )
