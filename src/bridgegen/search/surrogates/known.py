"""The rows that a search has been told of."""

from math import prod

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.search.algorithms.algorithm import Problem

# --- The columns of U as a model sees them ---


class Columns:
    """What the columns of U are: continuous, or levels, which are equal intervals of the cube.

    Rows of one level are one scenario, so a model sees a level as one number: its place among the
    levels, 0 to 1.

    Attributes:
        levels: ``(n_var,)`` of them, per column; 0 where it is continuous.
        discrete: ``(n_var,)`` bool, which columns have levels.
        count: number of different rows; 0 where it is infinite, or beyond 2⁶².

    Args:
        n_var: number of columns.
        levels: per column the number of levels, 0 for a continuous one; empty: all continuous.

    Source: Garrido-Merchán and Hernández-Lobato (2020), doi:10.1016/j.neucom.2019.11.004, for
    kernels that round.
    """

    def __init__(self, n_var: int, levels: tuple[int, ...] = ()) -> None:
        self.levels = levels or (0,) * n_var
        numbers = np.array(self.levels, np.float64)
        self.discrete = numbers > 0.0
        count = prod(self.levels)
        # Beyond 2**62 the number of rows counts as infinite: no search comes near it.
        self.count = count if count < 2**62 else 0
        self._of = numbers[self.discrete]

    def snapped(self, U: Float) -> Float:
        """Return rows with each level at the centre of its interval."""
        rows = U.copy()
        number = np.minimum(np.floor(U[:, self.discrete] * self._of), self._of - 1.0)
        rows[:, self.discrete] = (number + 0.5) / self._of
        return rows

    def points(self, U: Float) -> Float:
        """Return what a model sees of rows: ``(n, n_var)`` float64 in the unit cube."""
        points = U.copy()
        number = np.minimum(np.floor(U[:, self.discrete] * self._of), self._of - 1.0)
        # One number per level, so that no model distinguishes rows of one scenario.
        points[:, self.discrete] = number / np.maximum(self._of - 1.0, 1.0)
        return points

    def everything(self) -> Float:
        """Return all rows there are, ``(count, n_var)``, snapped; only where there are few."""
        grids = np.meshgrid(*[(np.arange(k) + 0.5) / k for k in self._of.tolist()], indexing="ij")
        return np.stack([grid.ravel() for grid in grids], axis=1)


# --- Objectives as numbers that a Gaussian process can learn ---


def compressed(F: Float) -> Float:
    """Return the signed logarithms of the standardised distances from the median.

    Outliers keep their order and their distance from the rest, but do not rule the scale. An
    infinite value counts as the nearest finite one.

    Args:
        F: ``(n,)`` float64, no NaN.

    Returns:
        ``(n,)`` float64, finite, about 1 in size; 0 where no value is finite, or all are equal.
    """
    finite = np.isfinite(F)
    if not finite.any():
        return np.zeros(len(F))
    known = F[finite] / max(np.abs(F[finite]).max(), np.finfo(np.float64).tiny)  # no overflow
    values = np.where(F > 0.0, known.max(), known.min())
    values[finite] = known
    values -= np.median(known)
    spread = known.std()
    if not spread > 1e-12:
        return np.zeros(len(F))
    scores: Float = np.sign(values) * elementary.log(1.0 + np.abs(values) / spread)
    return scores


FEW = 100_000
"""Number of different rows up to which all are enumerated in search of a new one."""


class Known:
    """Rows with their results; a failed row counts as one of the greatest objective.

    Rows that have been asked for and not told are no new ones either.

    Attributes:
        columns: what the columns of U are.
        U: ``(n, n_var)`` float64.
        points: ``(n, n_var)`` float64, what a model sees of U.
        F: ``(n,)`` float64, smaller is more critical; +inf in failed rows and for NaN.
        critical: ``(n,)`` bool, False in failed rows.
        distinct: places of critical rows, each ``apart`` or more from the others in root mean
            square, ascending.
        pending: ``(m, n_var)`` float64, what a model sees of rows that are not told, in the order
            in which they were asked for.

    Args:
        problem: the search problem.
        apart: of two critical rows that count as distinct.
    """

    def __init__(self, problem: Problem, apart: float) -> None:
        n_var = problem.n_var
        self.columns = Columns(n_var, problem.levels)
        self._apart = apart
        self.U, self.points, self.F = np.empty((0, n_var)), np.empty((0, n_var)), np.empty(0)
        self.pending = np.empty((0, n_var))
        self.critical, self.distinct = np.empty(0, np.bool_), np.empty(0, np.int64)
        self._rows: set[bytes] = set()

    def __len__(self) -> int:
        return len(self.F)

    @property
    def different(self) -> int:
        """Number of different rows that have been asked for."""
        return len(self._rows)

    @property
    def exhausted(self) -> bool:
        """Whether all rows there are have been told, or asked for."""
        return 0 < self.columns.count <= len(self._rows)

    def expect(self, U: Float) -> None:
        """Note that rows ``(n, n_var)`` are asked for; they are added in this order."""
        self.pending = np.concatenate([self.pending, self.columns.points(U)])
        self._rows.update(_keys(self.columns.snapped(U)))

    def add(self, U: Float, F: Float, ok: Bool, critical: Bool) -> None:
        """Add rows and their results.

        Args:
            U: ``(n, n_var)`` float64.
            F: ``(n,)`` float64, anything in rows that are not ok.
            ok: ``(n,)`` bool.
            critical: ``(n,)`` bool.
        """
        points, before = self.columns.points(U), len(self)
        self.pending = self.pending[len(U) :]
        self.U, self.points = np.concatenate([self.U, U]), np.concatenate([self.points, points])
        self.F = np.concatenate([self.F, np.where(ok & ~np.isnan(F), F, np.inf)])
        self.critical = np.concatenate([self.critical, ok & critical])
        self._rows.update(_keys(self.columns.snapped(U)))
        for k in before + np.flatnonzero(ok & critical):
            # A greedy net in the order of the rows; `compare` counts distinct scenarios in the same
            # way.
            if distances(self.points[[k]], self.points[self.distinct])[0] >= self._apart:
                self.distinct = np.append(self.distinct, k)

    def scores(self) -> Float:
        """Return F as a process learns it, ``(n,)``: `compressed`."""
        return compressed(self.F)

    def new(self, U: Float) -> Int:
        """Return the places of rows that are not known, the first of equal ones, ascending."""
        first: dict[bytes, int] = {}
        for k, key in enumerate(_keys(self.columns.snapped(U))):
            first.setdefault(key, k)
        return np.array([k for key, k in first.items() if key not in self._rows], np.int64)

    def anywhere(self, n: int, rng: np.random.Generator) -> Float:
        """Return n new rows drawn at random, fewer where there are no more; snapped."""
        if 0 < self.columns.count <= FEW:
            # Where there are few rows in all, the last unknown ones are found by listing, not by
            # luck.
            rows = self.columns.everything()
            return rng.permutation(rows[self.new(rows)])[:n]
        rows = self.columns.snapped(rng.random((n, self.U.shape[1])))
        return rows[self.new(rows)]


def _keys(rows: Float) -> list[bytes]:
    return [row.tobytes() for row in rows + 0.0]  # −0.0 is 0.0


def distances(points: Float, others: Float) -> Float:
    """Return how far points are from the nearest of others, ``(n,)``; inf where there is none.

    The distance is the root mean square of the columns' differences.
    """
    from scipy.spatial.distance import cdist

    if not len(others):
        return np.full(len(points), np.inf)
    nearest: Float = cdist(points, others).min(axis=1) / np.sqrt(points.shape[1])
    return nearest
