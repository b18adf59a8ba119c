"""The copula of several parameters: Gaussian, or Student's, whose parameters are extreme together.

Sources: Nelsen, An Introduction to Copulas, 2nd ed. (2006), section 2.3; its use as a transform to
independent normal variables: Liu and Der Kiureghian, Probabilistic Engineering Mechanics 1 (1986)
105-112. Student's: Demarta and McNeil, International Statistical Review 73 (2005) 111-129; its
conditional distributions, of which the transform is made: Ding, The American Statistician 70 (2016)
293-295. Fit: Genest, Ghoudi and Rivest, Biometrika 82 (1995) 543-552 (pseudo-likelihood of ranks),
with the scatter by Lange, Little and Taylor, JASA 84 (1989) 881-896 (EM).
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.special

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError

LEAST_EIGENVALUE = 1e-10
"""Least eigenvalue of a correlation matrix."""
FREEDOMS = (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0)
"""Degrees of freedom that a fit tries; the first are the least allowed."""
MOST_FREEDOM = 1000.0
"""Most degrees of freedom; the copula is Gaussian then, but for what no data show."""
BETTER = 4.0
"""By how much Akaike's criterion must prefer Student's copula to the Gaussian one."""
_STEPS = 10  # of EM; from the third on the scatter changes by less than 0.01
_SMALLEST = 1e-300  # a tail probability, so that its score is finite
_FURTHEST = 1e120  # of Student's scores, so that squares are finite: some 20 deviations off


@dataclass(frozen=True)
class Copula:
    """Correlations of scores, which are normal, or Student's.

    Attributes:
        names: the parameters, one for each row and column.
        rows: the correlation matrix.
        freedom: degrees of freedom of Student's copula; inf is the Gaussian one.
        tied: the parameters that are extreme together, whatever their correlation; the others are
            independent of all. None in a Gaussian copula.

    Raises:
        InputError: not symmetric, not 1 on the diagonal, or not positive definite.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    freedom: float = math.inf
    tied: tuple[str, ...] = ()

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
    def independent(cls, names: tuple[str, ...]) -> "Copula":
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

    @property
    def _tied(self) -> list[int]:
        """The columns of Student's scores."""
        return [self.names.index(n) for n in self.tied] if math.isfinite(self.freedom) else []

    def correlate(self, Z: Float) -> Float:
        """Return normal scores with these correlations.

        Args:
            Z: ``(N, d)`` independent standard normal. A row's result has the same bits whatever
                the rows around it.
        """
        E, squares = Z.copy(), np.zeros(len(Z))
        for k, column in enumerate(self._tied):
            scale = np.sqrt((self.freedom + squares) / (self.freedom + k))
            far = scale * _student(Z[:, column], self.freedom + k)
            E[:, column] = np.clip(far, -_FURTHEST, _FURTHEST)
            squares += E[:, column] ** 2
        Y = np.empty_like(Z)
        for row, weights in enumerate(self._root):
            Y[:, row] = _sum(E, weights[: row + 1])
        for column in self._tied:
            Y[:, column] = _normal(Y[:, column], self.freedom)
        return Y

    def whiten(self, Y: Float) -> Float:
        """Return the independent normal variables that `correlate` makes these scores of."""
        Z, squares = self._whitened(self._scores(Y)), np.zeros(len(Y))
        for k, column in enumerate(self._tied):
            scale = np.sqrt((self.freedom + squares) / (self.freedom + k))
            squares += Z[:, column] ** 2
            Z[:, column] = _normal(Z[:, column] / scale, self.freedom + k)
        return Z

    def log_density(self, Y: Float) -> Float:
        """Return the log density of the copula, over that of independence, at scores ``(N,)``."""
        X = self._scores(Y)
        E = self._whitened(X)
        result = np.zeros(len(Y))
        at, v = self._tied, self.freedom
        for column in range(Y.shape[1]):
            if not at:
                result += 0.5 * (X[:, column] ** 2 - E[:, column] ** 2)
            result -= float(np.log(self._root[column][column]))
        if at:
            one, none = (math.lgamma((v + k) / 2.0) for k in (1, 0))
            result += math.lgamma((v + len(at)) / 2.0) - none - len(at) * (one - none)
            result -= 0.5 * (v + len(at)) * np.log1p((E[:, at] ** 2).sum(axis=1) / v)
            result += 0.5 * (v + 1.0) * np.log1p(X[:, at] ** 2 / v).sum(axis=1)
        return result

    def _scores(self, Y: Float) -> Float:
        """Return scores of which those that are tied are Student's."""
        X = Y.copy()
        for column in self._tied:
            X[:, column] = _student(Y[:, column], self.freedom)
        return X

    def _whitened(self, X: Float) -> Float:
        E = np.empty_like(X)
        for row, weights in enumerate(self._root):
            E[:, row] = (X[:, row] - _sum(E, weights[:row])) / weights[row]
        return E


def fit_freedom(names: tuple[str, ...], scores: Float, matrix: Float) -> tuple[float, float]:
    """Return the degrees of freedom of the copula of events, inf for the Gaussian one.

    Args:
        names: of the parameters.
        scores: ``(d, n)`` normal scores of their values.
        matrix: ``(d, d)`` the correlations of these.

    Returns:
        The degrees of freedom; and by how much Akaike's criterion prefers Student's copula of
        these, or of the best ones, to the Gaussian one.
    """
    if len(names) < 2:
        return math.inf, 0.0

    def likelihood(matrix: Float, freedom: float) -> float:
        copula = Copula(names, tuple(map(tuple, matrix.tolist())), freedom, names)
        return float(copula.log_density(scores.T).sum())

    found = {v: likelihood(scatter(scores, matrix, v), v) for v in FREEDOMS}
    best = max(FREEDOMS, key=found.__getitem__)
    gain = 2.0 * (found[best] - likelihood(matrix, math.inf)) - 2.0
    return (best if gain >= BETTER else math.inf), gain


def scatter(scores: Float, matrix: Float, freedom: float) -> Float:
    """Return the correlations of Student's scores, from those of normal ones; inf: these."""
    if not math.isfinite(freedom):
        return matrix
    X = _student(scores, freedom)
    for _ in range(_STEPS):
        squares = np.sum(X * np.linalg.solve(matrix, X), axis=0)
        found = (X * ((freedom + len(X)) / (freedom + squares))) @ X.T
        root = np.sqrt(np.diag(found))
        matrix = found / np.outer(root, root)
        matrix = 0.5 * (matrix + matrix.T)
        np.fill_diagonal(matrix, 1.0)
    return matrix


def _student(scores: Float, freedom: float) -> Float:
    """Return the values of Student's distribution as likely as normal scores, by their tails."""
    tail = np.maximum(scipy.special.ndtr(-np.abs(scores)), _SMALLEST)
    found: Float = np.copysign(scipy.special.stdtrit(freedom, tail), scores)
    return found


def _normal(values: Float, freedom: float) -> Float:
    tail = np.maximum(scipy.special.stdtr(freedom, -np.abs(values)), _SMALLEST)
    found: Float = np.copysign(scipy.special.ndtri(tail), values)
    return found


def _sum(columns: Float, weights: list[float]) -> Float:
    """Return a weighted sum of the first columns, in one order whatever the number of rows."""
    total = np.zeros(len(columns))
    for column, weight in enumerate(weights):
        if weight != 0.0:
            total += weight * columns[:, column]
    return total
