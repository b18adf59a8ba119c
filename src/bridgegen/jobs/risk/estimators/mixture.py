"""A mixture of normal distributions, fitted to weighted points by expectation and maximisation.

Source: Dempster, Laird and Rubin, Journal of the Royal Statistical Society B 39 (1977) 1-38; the
number of components by Schwarz's criterion, Annals of Statistics 6 (1978) 461-464.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.spatial.distance

from bridgegen.base.arrays import Float, Int

MOST_COMPONENTS, PATIENCE = 8, 2
FLOOR = 0.04  # added to variances: proposals never become thinner than 0.2
_ROUNDS, _TOLERANCE = 60, 1e-3


@dataclass(frozen=True)
class Mixture:
    """Weights ``(K,)``, means ``(K, d)``, and lower Cholesky factors ``(K, d, d)``."""

    weights: Float
    means: Float
    factors: Float

    def log_densities(self, Z: Float) -> Float:
        """Return the weighted log-densities of the components, ``(N, K)``."""
        d = Z.shape[1]
        out = np.empty((len(Z), len(self.weights)))
        for k, factor in enumerate(self.factors):
            scaled = scipy.linalg.solve_triangular(factor, (Z - self.means[k]).T, lower=True)
            out[:, k] = (
                np.log(self.weights[k])
                - 0.5 * np.sum(scaled * scaled, axis=0)
                - np.log(np.diag(factor)).sum()
                - 0.5 * d * np.log(2.0 * np.pi)
            )
        return out

    def log_density(self, Z: Float) -> Float:
        """Return the log-density of points, ``(N,)``."""
        found: Float = np.logaddexp.reduce(self.log_densities(Z), axis=1)
        return found

    def sample(self, n: int, random: np.random.Generator) -> Float:
        """Draw points, ``(n, d)``."""
        which = random.choice(len(self.weights), n, p=self.weights)
        noise = random.standard_normal((n, self.means.shape[1]))
        moved = np.einsum("nij,nj->ni", self.factors[which], noise)
        found: Float = self.means[which] + moved
        return found

    @property
    def within(self) -> Float:
        """The mean covariance of a component, ``(d, d)``."""
        covariances = self.factors @ self.factors.transpose(0, 2, 1)
        found: Float = np.einsum("k,kij->ij", self.weights, covariances)
        return found


@dataclass(frozen=True)
class Kernels:
    """Equal normal distributions around points ``(M, d)``, with one Cholesky factor ``(d, d)``."""

    points: Float
    factor: Float

    @classmethod
    def around(cls, points: Float, covariance: Float) -> "Kernels":
        """Return kernels of the width that suits so many points of a covariance."""
        count, d = points.shape
        width = (4.0 / (d + 2.0) / count) ** (1.0 / (d + 4.0))
        return cls(points, width * np.linalg.cholesky(covariance))

    def log_density(self, Z: Float) -> Float:
        """Return the log-density of points, ``(N,)``."""
        d = Z.shape[1]
        own = scipy.linalg.solve_triangular(self.factor, self.points.T, lower=True).T
        other = scipy.linalg.solve_triangular(self.factor, Z.T, lower=True).T
        square = scipy.spatial.distance.cdist(other, own, "sqeuclidean")
        # The nearest kernel's exponent is taken out, or all would underflow far from the points.
        nearest = square.min(axis=1)
        mean = np.exp(-0.5 * (square - nearest[:, np.newaxis])).mean(axis=1)
        scale = np.log(np.diag(self.factor)).sum() + 0.5 * d * np.log(2.0 * np.pi)
        found: Float = np.log(mean) - 0.5 * nearest - scale
        return found

    def sample(self, n: int, random: np.random.Generator) -> Float:
        """Draw points, ``(n, d)``."""
        around = self.points[random.integers(0, len(self.points), n)]
        found: Float = around + random.standard_normal(around.shape) @ self.factor.T
        return found


def fit(Z: Float, weights: Float, size: float, random: np.random.Generator) -> Mixture:
    """Fit a mixture; the number of components is chosen by Schwarz's criterion.

    Args:
        Z: ``(N, d)``.
        weights: ``(N,)``, positive.
        size: how many independent points they are worth.
        random: chooses where components begin.
    """
    weights = weights / weights.sum()
    d = Z.shape[1]
    best, least, chosen = None, np.inf, 0
    for count in range(1, MOST_COMPONENTS + 1):
        # Points of chains are worth fewer independent ones than there are; the size, not the
        # number, says how many components they bear.
        if count > 1 and (size < 5.0 * count * (d + 1) or count > chosen + PATIENCE):
            break
        found = _maximised(Z, weights, _begin(Z, weights, count, random))
        likelihood = size * float(np.sum(weights * found.log_density(Z)))
        numbers = count * (1 + d + 0.5 * d * (d + 1)) - 1
        criterion = -2.0 * likelihood + numbers * np.log(size)
        if criterion < least:
            best, least, chosen = found, criterion, count
    assert best is not None
    return best


def _begin(Z: Float, weights: Float, count: int, random: np.random.Generator) -> Float:
    """Return the responsibilities of components that begin far apart (k-means++)."""
    centres = [Z[random.choice(len(Z), p=weights)]]
    while len(centres) < count:
        away = np.min([np.sum((Z - centre) ** 2, axis=1) for centre in centres], axis=0) * weights
        total = away.sum()
        centres.append(Z[random.choice(len(Z), p=away / total if total > 0.0 else weights)])
    distances = np.array([np.sum((Z - centre) ** 2, axis=1) for centre in centres])
    nearest: Int = np.argmin(distances, axis=0)
    found = np.zeros((len(Z), count))
    found[np.arange(len(Z)), nearest] = 1.0
    return found


def _maximised(Z: Float, weights: Float, responsible: Float) -> Mixture:
    last = -np.inf
    for _ in range(_ROUNDS):
        made = _made(Z, weights, responsible)
        densities = made.log_densities(Z)
        total = np.logaddexp.reduce(densities, axis=1)
        likelihood = float(np.sum(weights * total))
        if likelihood - last < _TOLERANCE:
            break
        last = likelihood
        responsible = np.exp(densities - total[:, np.newaxis])
    return made


def _made(Z: Float, weights: Float, responsible: Float) -> Mixture:
    d = Z.shape[1]
    parts = responsible * weights[:, np.newaxis]
    sums = np.maximum(parts.sum(axis=0), 1e-12)
    means = parts.T @ Z / sums[:, np.newaxis]
    factors = np.empty((len(sums), d, d))
    for k in range(len(sums)):
        off = Z - means[k]
        covariance = (parts[:, k, np.newaxis] * off).T @ off / sums[k]
        factors[k] = np.linalg.cholesky(covariance + FLOOR * np.eye(d))
    return Mixture(sums / sums.sum(), means, factors)
