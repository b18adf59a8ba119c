"""Which bins of the searched parameters, and which t-way combinations of bins, a run has seen.

A t-way combination is one bin of each of t parameters (Kuhn, Kacker and Lei, "Combinatorial
coverage as an aspect of test quality", CrossTalk 2015). Bins divide the *declared* range of a
parameter. Constraints narrow that range, so that some combinations exist in no scenario and can
never be covered. Which they are follows from no formula; a fixed random sample of the search
space says which are feasible. A combination that is possible but rare may be missing from it: the
number of feasible ones is a lower bound.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import prod

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float, Int, as_float
from bridgegen.errors import InputError
from bridgegen.odd.space import SearchSpace

SAMPLE = 200_000
"""Random points of the search space, always the same ones, that tell what is feasible."""

MAX_STRENGTH = 3
MAX_BINS = 1000

# Rows decoded at a time, and cells of a table that marks combinations: both bound the memory.
_CHUNK = 20_000
_CELLS = 1 << 24


@dataclass(frozen=True)
class ParameterBins:
    """The bins of one searched parameter.

    Attributes:
        name: the parameter.
        unit: its unit.
        axis: where it belongs.
        integer: whether each bin is one whole number, at its centre.
        edges: ``(n + 1,)`` float64 in the unit, ascending; a value on an inner edge belongs to
            the upper bin.
        evaluated: ``(n,)`` int64, rows in each bin.
        critical: ``(n,)`` int64, critical ones among them.
        feasible: ``(n,)`` bool, whether the sample or the run has a row there.
    """

    name: str
    unit: str
    axis: str
    integer: bool
    edges: Float
    evaluated: Int
    critical: Int
    feasible: Bool


@dataclass(frozen=True)
class Ways:
    """How many t-way combinations of bins there are, over all choices of t parameters.

    Attributes:
        strength: t.
        total: all of them.
        feasible: those met in the sample or in the run; at most ``total``.
        evaluated: those that an evaluated row is in; at most ``feasible``.
        critical: those that a critical row is in; at most ``evaluated``.
    """

    strength: int
    total: int
    feasible: int
    evaluated: int
    critical: int

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


def coverage(
    space: SearchSpace,
    X: Float,
    critical: Bool,
    *,
    bins: int = 5,
    strength: int = MAX_STRENGTH,
    sample: int = SAMPLE,
) -> Coverage:
    """Count the bins, and the t-way combinations of bins, that rows are in.

    Args:
        space: what was searched.
        X: ``(N, len(space.names))`` float64, rows whose simulation succeeded.
        critical: ``(N,)`` bool.
        bins: equal bins over the declared range; a parameter of whole numbers has one for each.
        strength: the largest t.
        sample: random points that tell what is feasible, beside X.

    Raises:
        InputError: bins or strength out of range.
        ValueError: wrong shape.
    """
    problems = [
        f"1 <= {name} <= {high} must hold, got {value}"
        for name, value, high in (("bins", bins, MAX_BINS), ("strength", strength, MAX_STRENGTH))
        if not 1 <= value <= high
    ]
    if problems:
        raise InputError(*problems)
    X = as_float("X", X, (None, len(space.names)))
    hit = np.asarray(critical, np.bool_)
    if hit.shape != (len(X),):
        raise ValueError(f"critical must have shape ({len(X)},), got {hit.shape}")
    edges = [_edges(space, name, bins) for name in space.variables]
    sizes = [len(one) - 1 for one in edges]
    # Sorted into evaluated, critical ones first, then sampled: each kind is a stretch.
    order = np.argsort(~hit, kind="stable")
    n_critical, n_rows = int(hit.sum()), len(X)
    seen = [_bin(space, X[order], edges), *_sampled(space, edges, sample)]
    where = np.concatenate(seen, axis=1)
    parts = (n_critical, n_rows, where.shape[1])

    parameters = []
    for number, name in enumerate(space.variables):
        one, size = space.scenario.parameters[name], sizes[number]
        counts = [np.bincount(where[number, :end], minlength=size) for end in parts]
        parameters.append(
            ParameterBins(
                name,
                one.unit,
                str(one.axis),
                one.kind == "integer",
                edges[number],
                evaluated=counts[1],
                critical=counts[0],
                feasible=counts[2] > 0,
            )
        )
    ways = []
    for t in range(1, min(strength, space.n_var) + 1):
        total, found = 0, np.zeros(3, np.int64)
        for chosen in combinations(range(space.n_var), t):
            shape = [sizes[k] for k in chosen]
            total += prod(shape)
            found += _distinct(where[list(chosen)], shape, parts)
        ways.append(Ways(t, total, int(found[2]), int(found[1]), int(found[0])))
    return Coverage(n_rows, n_critical, sample, tuple(parameters), tuple(ways))


def _edges(space: SearchSpace, name: str, bins: int) -> Float:
    one = space.scenario.parameters[name]
    if one.kind == "integer":
        return np.arange(one.low, one.high + 2.0) - 0.5
    return np.linspace(one.low, one.high, bins + 1)


def _bin(space: SearchSpace, X: Float, edges: list[Float]) -> npt.NDArray[np.int32]:
    """Return ``(n_var, len(X))``, the bin of every searched parameter."""
    where = np.empty((space.n_var, len(X)), np.int32)
    for number, name in enumerate(space.variables):
        column = np.ascontiguousarray(X[:, space.index(name)])
        # Inner edges only: what rounding puts beyond an end is in the last bin there.
        where[number] = np.searchsorted(edges[number][1:-1], column, side="right")
    return where


def _sampled(
    space: SearchSpace, edges: list[Float], sample: int
) -> Iterator[npt.NDArray[np.int32]]:
    """Yield the bins of the sample, a chunk at a time."""
    rng = np.random.Generator(np.random.PCG64(0))
    for start in range(0, sample, _CHUNK):
        U = rng.random((min(_CHUNK, sample - start), space.n_var))
        yield _bin(space, space.decode(U), edges)


def _distinct(
    where: npt.NDArray[np.int32], shape: list[int], parts: tuple[int, int, int]
) -> list[int]:
    """Return how many combinations of bins occur in the first ``parts`` columns, for each part."""
    cells = prod(shape)
    codes = np.zeros(where.shape[1], np.int64)
    for column, size in zip(where, shape, strict=True):
        codes *= size
        codes += column
    if cells > _CELLS:
        return [len(np.unique(codes[:end])) for end in parts]
    marks, counts, start = np.zeros(cells, np.bool_), [], 0
    for end in parts:
        marks[codes[start:end]] = True
        counts.append(int(np.count_nonzero(marks)))
        start = end
    return counts
