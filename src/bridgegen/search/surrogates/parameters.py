"""The parameters of a Gaussian process, and what is believed of them before any row is known."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from bridgegen.base.arrays import Float

LOW, HIGH = np.log([0.02, 0.05, 1e-4]), np.log([50.0, 20.0, 0.5])
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
        lengths: Float = np.exp(self.logs[:-2])
        return lengths

    @property
    def variance(self) -> float:
        """Of the process."""
        return float(np.exp(self.logs[-2]))

    @property
    def noise(self) -> float:
        """Variance of the noise."""
        return float(np.exp(self.logs[-1]))


def prior(d: int) -> tuple[Float, Float]:
    """Return mean and standard deviation of the logarithms, normally distributed."""
    mean = np.concatenate([np.full(d, np.log(0.5 * np.sqrt(d))), np.log([1.0, 1e-2])])
    spread = np.concatenate([np.full(d, 1.0), [1.0, 2.0]])
    return mean, spread
