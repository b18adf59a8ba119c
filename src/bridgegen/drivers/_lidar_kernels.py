"""The LiDAR: beams on target, of which those return whose signal is above the noise."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._physics_kernels import (
    BEAM_ANGLE,
    BEAM_AREA,
    BEST,
    ENOUGH_RETURNS,
    LIDAR_FLOOR,
    RANGE_NOISE,
    snr,
)


@kernel
def returns(area, reflectance, attenuation, d):
    """Return how many beams come back from a target of an area [m²], and their SNR.

    Half of them do where the signal just reaches the threshold.
    """
    ratio = snr(reflectance, attenuation, d)
    squared = ratio * ratio
    steep = squared * squared
    share = steep / (1.0 + steep) if ratio < 1e3 else 1.0
    return area * share / (d * d * BEAM_AREA), ratio


@kernel
def detection(on_target):
    """Return the probability that a target with so many returns is detected."""
    ratio = on_target / ENOUGH_RETURNS
    odds = ratio * ratio
    return BEST * odds / (1.0 + odds)


@kernel
def position_errors(d, ratio):
    """Return the standard deviations [m] along and across the line of sight; SNR is ``ratio``."""
    along = math.sqrt(LIDAR_FLOOR * LIDAR_FLOOR + RANGE_NOISE * RANGE_NOISE / (2.0 * ratio))
    across = BEAM_ANGLE * d
    return along, math.sqrt(LIDAR_FLOOR * LIDAR_FLOOR + across * across / 12.0)
