"""Kernel density estimates of a column of numbers, reflected at the ends of a range.

The estimate is tabulated: numbers are spread over a grid of an eighth of a bandwidth, or finer,
and the density is linear between its points, which changes it by less than 0.3 %.
Source: Silverman, Density Estimation (1986), sections 2.10 (reflection), 3.4.2 (bandwidth) and 3.5
(grid).
"""

import math

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.exposure.marginals import Polygon

LEAST, MOST = 64, 8192
"""Intervals of the grid."""

_PER_BANDWIDTH, _REACH = 8, 6.0
_ROOT = math.sqrt(2.0 * math.pi)


def usual_bandwidth(values: Float) -> float:
    """Return Silverman's bandwidth, 0.9 n^(-1/5) of the smaller measure of spread.

    Args:
        values: ``(n,)``, not all the same.
    """
    quarters = np.quantile(values, [0.25, 0.75])
    spreads = [float(np.std(values, ddof=1)), float(quarters[1] - quarters[0]) / 1.34]
    spread = min(one for one in spreads if one > 0.0)
    return 0.9 * spread / math.pow(len(values), 0.2)


def estimate(values: Float, bandwidth: float, low: float, high: float) -> Polygon:
    """Return the density of values within a range.

    Args:
        values: ``(n,)`` in [low, high].
        bandwidth: standard deviation of the kernels, > 0.
        low: smallest value.
        high: largest value, above low.

    Raises:
        InputError: the range is too many bandwidths wide.
    """
    wanted = math.ceil(_PER_BANDWIDTH * (high - low) / bandwidth)
    if wanted > MOST:
        raise InputError(
            f"a bandwidth must be at least {_PER_BANDWIDTH * (high - low) / MOST:.3g}, "
            f"{_PER_BANDWIDTH / MOST:.2g} of the range, got {bandwidth:g}"
        )
    count = max(wanted, LEAST)
    step = (high - low) / count
    at = np.clip((values - low) / step, 0.0, count)
    left = np.minimum(at.astype(np.int64), count - 1)
    right = at - left
    mass = np.zeros(count + 1)
    np.add.at(mass, left, 1.0 - right)
    np.add.at(mass, left + 1, right)
    mass[[0, -1]] *= 2.0  # its mirror image lies at the same point
    reach = math.ceil(_REACH * bandwidth / step)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step / bandwidth) ** 2)
    smooth = np.convolve(np.pad(mass, reach, mode="reflect" if reach <= count else "edge"), kernel)
    heights = smooth[2 * reach : 2 * reach + count + 1]
    corners = np.linspace(low, high, count + 1)
    heights = heights / (0.5 * (heights[1:] + heights[:-1]) * step).sum()
    text = f"kernel density, bandwidth {bandwidth:.4g}"
    return Polygon(tuple(corners.tolist()), tuple(heights.tolist()), text)


def left_out_log_densities(values: Float, density: Polygon, bandwidth: float) -> Float:
    """Return the log density of each value by the estimate that the others give, ``(n,)``.

    Args:
        values: ``(n,)`` that the estimate was made of, n > 1.
        density: the estimate.
        bandwidth: of it.
    """
    n = len(values)
    own = np.exp(-0.5 * (2.0 * (values - density.low) / bandwidth) ** 2)
    own += np.exp(-0.5 * (2.0 * (density.high - values) / bandwidth) ** 2)
    own = (1.0 + own) / (bandwidth * _ROOT)
    others = (n * np.exp(density.log_density(values)) - own) / (n - 1)
    result: Float = np.log(np.maximum(others, 1e-12 / (density.high - density.low)))
    return result
