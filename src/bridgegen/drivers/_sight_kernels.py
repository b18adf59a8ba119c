"""Range of sight in this weather: the distance at which half of the frames show a thing.

`sight` reads it from a table by thing and angle to the sun, of which it computes what it needs once
in each weather.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers import _camera_kernels as camera
from bridgegen.drivers import _lidar_kernels as lidar
from bridgegen.drivers._physics_kernels import (
    CULL,
    ENOUGH_RETURNS,
    IDENTIFY,
    NOTICE,
    SIGNAL_LAMP,
    SIGNAL_SIZE,
    veil,
)
from bridgegen.drivers._weather_columns import ATTENUATION, GLARE, N_GLARES, SIGHT, SUN_X, SUN_Y
from bridgegen.drivers.kinds import CAR, LAMPS, PEDESTRIAN, REFLECTANCE

LIGHT, REAR, WALKER = 0, 1, 2
"""Objects to be seen: a traffic light, a car from behind, a pedestrian."""

CAR_WIDTH, CAR_HEIGHT = 1.8, 1.5  # m
WALKER_WIDTH, WALKER_HEIGHT = 0.5, 1.7  # m
NEAREST = 1.0  # m
_HALVINGS = 24  # of the logarithm of the distance: to 1e-6 of itself


@kernel
def camera_sight(weather, size, lamp, need, dazzle):
    """Return where a target of a size [m] straight ahead has ``need`` pixels, up to `CULL`."""
    low, high = elementary.log(NEAREST), elementary.log(CULL)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        d = elementary.exp(middle)
        clear = camera.clarity(weather, d, dazzle, lamp, 1.0)
        if camera.pixels(size, d, clear) >= need:
            low = middle
        else:
            high = middle
    return elementary.exp(low)


@kernel
def lidar_sight(weather, area, reflectance):
    """Return where a target of an area [m²] sends back half of enough returns, up to `CULL`."""
    low, high = elementary.log(NEAREST), elementary.log(CULL)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        found, _ = lidar.returns(area, reflectance, weather[ATTENUATION], elementary.exp(middle))
        if found >= ENOUGH_RETURNS:
            low = middle
        else:
            high = middle
    return elementary.exp(low)


@kernel
def glare_of(weather, i):
    """Return the veiling luminance of column i: 64°, 32° … 1° off the sun."""
    return veil(
        weather[GLARE], elementary.cos(math.radians(elementary.power(2.0, N_GLARES - 1.0 - i)))
    )


@kernel
def range_of(weather, thing, i):
    """Return how far a thing is seen in column i, by camera or LiDAR, whichever sees farther."""
    dazzle = glare_of(weather, i)
    if thing == LIGHT:
        signal = SIGNAL_LAMP / (0.25 * math.pi * SIGNAL_SIZE * SIGNAL_SIZE)
        return camera_sight(weather, SIGNAL_SIZE, signal, NOTICE, dazzle)
    if thing == REAR:
        rear = math.sqrt(CAR_WIDTH * CAR_HEIGHT)
        by_lidar = lidar_sight(weather, rear * rear, REFLECTANCE[CAR])
        lamp = LAMPS[CAR] / (rear * rear)
        return max(camera_sight(weather, rear, lamp, IDENTIFY, dazzle), by_lidar)
    walker = math.sqrt(WALKER_WIDTH * WALKER_HEIGHT)
    by_lidar = lidar_sight(weather, walker * walker, REFLECTANCE[PEDESTRIAN])
    return max(camera_sight(weather, walker, 0.0, IDENTIFY, dazzle), by_lidar)


@kernel
def tabulated(weather, thing, i):
    """Return a number of the table, which is computed when it is first asked for."""
    at = SIGHT + thing * N_GLARES + i
    # 0 is no range: they begin at `NEAREST`.
    if weather[at] == 0.0:
        weather[at] = range_of(weather, thing, i)
    return weather[at]


@kernel
def sight(weather, thing, cosine, sine):
    """Return how far [m] a thing is seen in the direction (cosine, sine), at most `CULL`.

    Args:
        weather: ``(WEATHER,)``.
        thing: `LIGHT`, `REAR` or `WALKER`.
        cosine: of the heading in which one looks.
        sine: of it.
    """
    i, share = column_of(weather, cosine, sine)
    return seen_in(weather, thing, i, share)


@kernel
def column_of(weather, cosine, sine):
    """Return the column of the table by the angle to the sun of a heading, and the share beyond."""
    if weather[GLARE] <= 0.0:
        return 0, 0.0
    angle = elementary.acos(min(max(weather[SUN_X] * cosine + weather[SUN_Y] * sine, -1.0), 1.0))
    halvings = N_GLARES - 1 - elementary.log2(min(max(math.degrees(angle), 1.0), 64.0))
    i = min(int(halvings), N_GLARES - 2)
    return i, halvings - i


@kernel
def seen_in(weather, thing, i, share):
    """Return how far [m] a thing is seen between two columns of the table."""
    off = tabulated(weather, thing, i)
    if share == 0.0:
        return off
    return off + share * (tabulated(weather, thing, i + 1) - off)
