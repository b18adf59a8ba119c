"""The Gaussian copula: normal scores of several parameters, correlated.

Source: Nelsen, An Introduction to Copulas, 2nd ed. (2006), section 2.3; its use as a transform to
independent normal variables: Liu and Der Kiureghian, Probabilistic Engineering Mechanics 1 (1986)
105-112.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError

LEAST_EIGENVALUE = 1e-10
"""Least eigenvalue of a correlation matrix."""


@dataclass(frozen=True)
class GaussianCopula:
    """Correlations of normal scores.

    Attributes:
        names: the parameters, one for each row and column.
        rows: the correlation matrix.

    Raises:
        InputError: not symmetric, not 1 on the diagonal, or not positive definite.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        if len(self.rows) != len(self.names) or {len(row) for row in self.rows} - {len(self.rows)}:
            raise InputError(
                f"a correlation matrix of {len(self.names)} parameters must be square of that size"
            )
        if not self.names:
            return
        matrix = self.matrix
        if not (np.array_equal(matrix, matrix.T) and np.all(np.diag(matrix) == 1.0)):
            raise InputError("a correlation matrix must be symmetric, with 1 on its diagonal")
        values, vectors = np.linalg.eigh(matrix)
        if not values[0] >= LEAST_EIGENVALUE:
            heavy = np.flatnonzero(np.abs(vectors[:, 0]) > 0.1)
            names = ", ".join(self.names[k] for k in heavy)
            raise InputError(
                f"the correlations of {names} must be positive definite: no distribution has all "
                f"of them at once (smallest eigenvalue {values[0]:.3g})"
            )

    @classmethod
    def independent(cls, names: tuple[str, ...]) -> "GaussianCopula":
        """Return the copula of independent parameters."""
        return cls(names, tuple(map(tuple, np.eye(len(names)).tolist())))

    @property
    def matrix(self) -> Float:
        """The correlation matrix ``(d, d)``."""
        return np.array(self.rows, dtype=np.float64).reshape(len(self.rows), len(self.names))

    @cached_property
    def _root(self) -> list[list[float]]:
        root: list[list[float]] = np.linalg.cholesky(self.matrix).tolist() if self.rows else []
        return root

    def correlate(self, Z: Float) -> Float:
        """Return normal scores with these correlations.

        Args:
            Z: ``(N, d)`` independent standard normal. A row's result has the same bits whatever
                the rows around it.
        """
        Y = np.empty_like(Z)
        for row, weights in enumerate(self._root):
            Y[:, row] = _sum(Z, weights[: row + 1])
        return Y

    def whiten(self, Y: Float) -> Float:
        """Return the independent normal variables that `correlate` makes these scores of."""
        Z = np.empty_like(Y)
        for row, weights in enumerate(self._root):
            Z[:, row] = (Y[:, row] - _sum(Z, weights[:row])) / weights[row]
        return Z

    def log_density(self, Y: Float) -> Float:
        """Return the log density of the copula, over that of independence, at scores ``(N,)``."""
        Z = self.whiten(Y)
        result = np.zeros(len(Y))
        for column in range(Y.shape[1]):
            result += 0.5 * (Y[:, column] ** 2 - Z[:, column] ** 2)
            result -= float(np.log(self._root[column][column]))
        return result


def _sum(columns: Float, weights: list[float]) -> Float:
    """Return a weighted sum of the first columns, in one order whatever the number of rows."""
    total = np.zeros(len(columns))
    for column, weight in enumerate(weights):
        if weight != 0.0:
            total += weight * columns[:, column]
    return total
