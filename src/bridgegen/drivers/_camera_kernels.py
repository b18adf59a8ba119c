"""The camera: pixels on target, faded by the air, drowned by darkness and glare.

How well a target is seen is the number of pixels across it, times the share of its contrast that
reaches the picture.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._physics_kernels import (
    BACKSCATTER,
    BEAM_WIDTH,
    BEST,
    CAMERA_FLOOR,
    DARK_LUMINANCE,
    FOCAL_LENGTH,
    HEADLAMP,
    IDENTIFY,
    PIXEL_ERROR,
    TARGET_ALBEDO,
    TARGET_CONTRAST,
    recognised,
    transmission,
)
from bridgegen.drivers._weather_columns import BACKGROUND, EXTINCTION, GLASS


@kernel
def beam(along, across):
    """Return the share of its luminous intensity that the ego's low beam has in a direction."""
    if along <= 0.0:
        return 0.0
    tangent = across / (along * BEAM_WIDTH)
    share = 1.0 / (1.0 + tangent * tangent)
    return share * share


@kernel
def clarity(weather, d, veil, lamp, headlit):
    """Return the share of a target's contrast that reaches the picture, 0 to 1.

    Args:
        weather: ``(W,)``.
        d: distance [m].
        veil: veiling luminance in its direction [cd/m²].
        lamp: luminance of the target's own lamps over its area [cd/m²].
        headlit: share of the headlamps' intensity in its direction.
    """
    beta = weather[EXTINCTION]
    air = transmission(beta, d)
    own = lamp + TARGET_ALBEDO * HEADLAMP * headlit * air / (math.pi * d * d)
    light = weather[BACKGROUND]
    dazzle = veil + DARK_LUMINANCE + HEADLAMP * BACKSCATTER * beta
    lit = (TARGET_CONTRAST * light + own) / (TARGET_CONTRAST * (light + dazzle))
    # A product, in which what darkness and glare take cannot exceed 1: so every law is monotone,
    # and fog, rain, snow, night and glare can only take away.
    return air * weather[GLASS] * min(lit, 1.0)


@kernel
def pixels(size, d, clear):
    """Return the pixels across a target of a size [m], counted by their clarity."""
    return FOCAL_LENGTH * size * clear / d


@kernel
def detection(on_target):
    """Return the probability that a target of so many pixels is detected."""
    return BEST * recognised(on_target / IDENTIFY)


@kernel
def position_errors(d, height, clear):
    """Return the standard deviations [m] along and across the line of sight.

    Along: of the distance by where the target meets the ground, d²/(f·height) a pixel.
    """
    blur = PIXEL_ERROR / max(clear, 0.1)
    along = CAMERA_FLOOR + blur * d * d / (FOCAL_LENGTH * height)
    return along, CAMERA_FLOOR + blur * d / FOCAL_LENGTH
