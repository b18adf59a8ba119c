"""A Gaussian process: what is known of the objective between the evaluated rows."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.search.surrogates import _gaussian_process_kernels as kernels
from bridgegen.search.surrogates.subset import telling

# --- The parameters of a Gaussian process, and what is believed of them before any row is known ---


LOW, HIGH = elementary.log([0.02, 0.05, 1e-4]), elementary.log([50.0, 20.0, 0.5])
"""Least and greatest length, variance and noise."""


@dataclass(frozen=True)
class Parameters:
    """The parameters of a Gaussian process.

    Attributes:
        logs: ``(d + 2,)`` float64, the logarithms of the length of each column, of the variance of
            the process and of that of the noise.
    """

    logs: Float

    @classmethod
    def usual(cls, d: int) -> Self:
        """Return the mode of the prior for points of d columns in the unit cube."""
        return cls(prior(d)[0])

    @property
    def lengths(self) -> Float:
        """``(d,)`` float64, the distance over which the process changes in each column."""
        return elementary.exp(self.logs[:-2])

    @property
    def variance(self) -> float:
        """Of the process."""
        return elementary.exp(float(self.logs[-2]))

    @property
    def noise(self) -> float:
        """Variance of the noise."""
        return elementary.exp(float(self.logs[-1]))


def prior(d: int) -> tuple[Float, Float]:
    """Return mean and standard deviation of the logarithms, normally distributed."""
    mean = np.concatenate([np.full(d, elementary.log(0.5 * d**0.5)), elementary.log([1.0, 1e-2])])
    spread = np.concatenate([np.full(d, 1.0), [1.0, 2.0]])
    return mean, spread


# The likelihood is computed anew at every step: its cost is the cube of this number.
LEARN_FROM = 128
"""Maximum number of rows of which the likelihood is computed."""

FIRST_STEPS, NEXT_STEPS = 30, 5
"""Numbers of steps of the likelihood's maximisation: from the prior, and from the previous
parameters."""

# Wilson's pathwise conditioning: a path needs no factor of the candidates' covariance.
FEATURES = 512
"""Number of random features of a sample path."""


def learnt(points: Float, values: Float, parameters: Parameters | None) -> Parameters:
    """Return the parameters of a greater posterior density.

    A fixed number of steps of resilient propagation, which needs the gradient's signs alone.

    Args:
        points: ``(n, d)`` float64 in the unit cube.
        values: ``(n,)`` float64, of mean 0 and a size about 1.
        parameters: where to begin; the prior's mode if None.

    Source: Rasmussen and Williams (2006), "Gaussian Processes for Machine Learning", equations 5.8
    and 5.9; Riedmiller and Braun (1993), doi:10.1109/ICNN.1993.298623, for the steps.
    """
    d = points.shape[1]
    logs = (Parameters.usual(d) if parameters is None else parameters).logs.copy()
    low, high = np.concatenate([np.full(d, LOW[0]), LOW[1:]]), HIGH[[0] * d + [1, 2]]
    step, before = np.full(d + 2, 0.2), np.zeros(d + 2)
    best, greatest = logs, -np.inf
    for _ in range(FIRST_STEPS if parameters is None else NEXT_STEPS):
        density, gradient = _density(points, values, logs)
        if density > greatest:
            best, greatest = logs, density
        # Rprop: only signs of the gradient count, so that a step needs no scale of the density.
        turned = gradient * before
        step = np.clip(step * np.where(turned > 0.0, 1.2, np.where(turned < 0.0, 0.5, 1.0)), 0, 1)
        before = np.where(turned < 0.0, 0.0, gradient)
        logs = np.clip(logs + step * np.sign(before), low, high)
    return Parameters(best)


def _density(points: Float, values: Float, logs: Float) -> tuple[float, Float]:
    """Return the log posterior density of the parameters, and its gradient."""
    now = Parameters(logs)
    scaled = points / now.lengths
    K = kernels.covariance(scaled, scaled, now.variance)
    R = K + now.noise * np.eye(len(K))
    mean, spread = prior(points.shape[1])
    off = (logs - mean) / spread
    if not kernels.factorise(R):
        return -np.inf, -off / spread
    alpha = _weights(R, values)
    gradient = kernels.likelihood_gradient(scaled, K, kernels.inverse(R), alpha, now.variance)
    gradient[-1] *= now.noise
    fit = 0.5 * np.sum(values * alpha) + elementary.log(np.diagonal(R)).sum()
    return float(-fit - 0.5 * np.sum(off * off)), gradient - off / spread


def _weights(R: Float, values: Float) -> Float:
    """Return (Rᵀ R)⁻¹ values, of one or several columns."""
    columns = np.array(values.reshape(len(values), -1), order="C")
    kernels.solve_transposed(R, columns)
    kernels.solve(R, columns)
    return columns.reshape(values.shape)


class GaussianProcess:
    """A Gaussian process with a Matérn 5/2 kernel and a length for each column.

    The parameters are learnt of 128 rows at most, the posterior is of all: a fit of 300 rows of 10
    columns takes 18 ms of processor time from earlier parameters, 47 ms without. The mean
    beyond the rows is the rows' own.

    Attributes:
        parameters: learnt.

    Args:
        points: ``(n, d)`` float64 in the unit cube, n ≥ 1.
        values: ``(n,)`` float64, finite, of a size about 1 (`compressed`).
        parameters: of an earlier fit, where the search for better ones begins.
    """

    def __init__(self, points: Float, values: Float, parameters: Parameters | None = None) -> None:
        self._centre = float(values.mean())
        centred = values - self._centre
        self.parameters = parameters or Parameters.usual(points.shape[1])
        if len(values) > 1 and np.any(centred != centred[0]):
            few = telling(values, LEARN_FROM)
            self.parameters = learnt(points[few], centred[few], parameters)
        self._scaled, self._centred = points / self.parameters.lengths, centred
        K = kernels.covariance(self._scaled, self._scaled, self.parameters.variance)
        # The factor is kept for all predictions: factorising is what costs most.
        # Noise of 1e-4 at least: K can always be factorised.
        self._R = K + self.parameters.noise * np.eye(len(K))
        kernels.factorise(self._R)

    def predict(self, points: Float) -> tuple[Float, Float]:
        """Return the posterior mean and standard deviation, ``(m,)`` each, without noise."""
        cross = kernels.covariance(
            self._scaled, points / self.parameters.lengths, self.parameters.variance
        )
        mean = self._centre + kernels.product(_weights(self._R, self._centred)[None, :], cross)[0]
        kernels.solve_transposed(self._R, cross)
        explained = np.sum(cross * cross, axis=0)
        return mean, np.sqrt(np.maximum(self.parameters.variance - explained, 0.0))

    def sample(self, points: Float, n: int, rng: np.random.Generator) -> Float:
        """Return n sample paths of the posterior at some points, ``(n, m)`` float64.

        A path is one of the prior, made of random features, corrected at the rows.

        Source: Wilson et al. (2020), "Efficiently sampling functions from Gaussian process
        posteriors", arXiv:2002.09309.
        """
        p, d = self.parameters, points.shape[1]
        scaled = points / p.lengths
        # The spectral density of Matérn 5/2 is a t distribution with five degrees of freedom.
        frequencies = rng.standard_normal((d, FEATURES)) / np.sqrt(rng.chisquare(5, FEATURES) / 5)
        phases = 2.0 * np.pi * rng.random(FEATURES)
        weights = np.sqrt(2.0 * p.variance / FEATURES) * rng.standard_normal((FEATURES, n))
        noise = np.sqrt(p.noise) * rng.standard_normal((len(self._centred), n))

        def of_prior(at: Float) -> Float:
            waves = elementary.cos(kernels.product(at, frequencies) + phases)
            path: Float = kernels.product(waves, weights)
            return path

        gap = self._centred[:, None] - of_prior(self._scaled) - noise
        cross = kernels.covariance(scaled, self._scaled, p.variance)
        paths = of_prior(scaled) + kernels.product(cross, _weights(self._R, gap))
        return np.ascontiguousarray(paths.T) + self._centre
