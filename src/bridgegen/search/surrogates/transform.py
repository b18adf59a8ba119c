"""Objectives as numbers that a Gaussian process can learn."""

import numpy as np

from bridgegen.base.arrays import Float


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
    scores: Float = np.sign(values) * np.log1p(np.abs(values) / spread)
    return scores
