"""The bins that rows, and a random sample of the search space, are in; and how many are where."""

from collections.abc import Iterator, Sequence
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int, Numbers, as_float
from bridgegen.scenario.language.space import SearchSpace

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
        self.sizes = [len(one) - 1 for one in self.edges]
        self.n_rows, self.n_critical = len(X), int(hit.sum())
        # Sorted into critical rows, other rows, sample: each is a stretch of columns.
        kind = np.min_scalar_type(max(self.sizes, default=0))
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
        critical, evaluated = (float(one) for one in found)
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
    one = space.parameters[name]
    return one.kind.edges(one.low, one.high, bins)
