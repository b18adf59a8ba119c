"""From the weather that a file states to the numbers that sensors and tyres feel.

``weather`` ``(WEATHER,)`` float64 is one scenario's, now; ``_weather_columns`` tells its columns.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.base.physics import GRIP
from bridgegen.drivers._physics_kernels import (
    AT_CIVIL,
    AT_HORIZON,
    AT_NAUTICAL,
    AT_NIGHT,
    CLEAR_DEPTH,
    CLEAR_NORMAL,
    CLOUD_POWER,
    CLOUD_SHADE,
    GROUND_ALBEDO,
    KOSCHMIEDER,
    RAIN_EXTINCTION,
    RAIN_ON_GLASS,
    RAIN_POWER,
    SNOW_EXTINCTION,
    SNOW_POWER,
)
from bridgegen.drivers._weather_columns import (
    ATTENUATION,
    BACKGROUND,
    CLEAR_DAY,
    CLOUD,
    EXTINCTION,
    FRICTION,
    FRICTION_SCALE,
    GLARE,
    GLASS,
    ILLUMINANCE,
    RAIN,
    SIGHT,
    SNOW,
    STATED,
    SUN_AZIMUTH,
    SUN_ELEVATION,
    SUN_X,
    SUN_Y,
    VISUAL_RANGE,
)


@kernel
def set_clear(weather):
    """Set what is stated to a clear day."""
    for i in range(STATED):
        weather[i] = CLEAR_DAY[i]


@kernel
def change(weather, environments, row, slots):
    """Set what an environment states to its slots' values, and what follows from it.

    Args:
        weather: as above.
        environments: ``(·, STATED)`` slots, −1 for what an environment leaves as it was.
        row: of the environment.
        slots: ``(S,)`` the scenario's values.
    """
    for i in range(STATED):
        if environments[row, i] >= 0:
            weather[i] = slots[environments[row, i]]
    derive(weather)


@kernel
def derive(weather):
    """Set the numbers from ``EXTINCTION`` to ``SUN_Y`` by what is stated; forget ``SIGHT``."""
    # Ranges of sight are bisections, 21 of them, of which a driver asks for some four: so each is
    # computed when it is asked for.
    weather[SIGHT:] = 0.0
    rain = RAIN_EXTINCTION * elementary.power(max(weather[RAIN], 0.0), RAIN_POWER)
    snow = SNOW_EXTINCTION * elementary.power(max(weather[SNOW], 0.0), SNOW_POWER)
    # The drops of fog, too, are larger than either wavelength: Kim, McArthur, Korevaar, SPIE 4214
    # (2001), find no difference below 500 m of visibility.
    weather[EXTINCTION] = KOSCHMIEDER / max(weather[VISUAL_RANGE], 1.0) + rain + snow
    weather[ATTENUATION] = weather[EXTINCTION]
    weather[GLASS] = 1.0 / (1.0 + RAIN_ON_GLASS * max(weather[RAIN], 0.0))
    weather[FRICTION] = GRIP * weather[FRICTION_SCALE]
    cosine, sine = elementary.cos(weather[SUN_ELEVATION]), elementary.sin(weather[SUN_ELEVATION])
    weather[SUN_X] = cosine * elementary.sin(weather[SUN_AZIMUTH])
    weather[SUN_Y] = cosine * elementary.cos(weather[SUN_AZIMUTH])
    altitude = math.degrees(elementary.asin(min(max(sine, -1.0), 1.0)))
    cloud = min(max(weather[CLOUD], 0.0), 1.0)
    stated = weather[ILLUMINANCE]
    ground = stated if stated >= 0.0 else 100_000.0 * max(sine, 0.0)
    lit = ground * (1.0 - CLOUD_SHADE * elementary.power(cloud, CLOUD_POWER)) + skylight(altitude)
    weather[BACKGROUND] = GROUND_ALBEDO * lit / math.pi
    weather[GLARE] = 0.0
    if altitude > 0.0:
        # A file's own illuminance bounds the beam: a dark scene with the sun up does not glare.
        beam = min(sunbeam(altitude), ground / max(sine, 0.01))
        weather[GLARE] = beam * (1.0 - cloud)


@kernel
def sunbeam(altitude):
    """Return the illuminance [lx] of the sun at an altitude [deg] ≥ 0, square to its rays.

    Source: IES RP-21-84, Calculation of Daylight Availability, clear sky; air mass by Kasten and
    Young, Applied Optics 28 (1989) 4735.
    """
    mass = 1.0 / (
        elementary.sin(math.radians(altitude))
        + 0.50572 * elementary.power(altitude + 6.07995, -1.6364)
    )
    return CLEAR_NORMAL * elementary.exp(-CLEAR_DEPTH * mass)


@kernel
def skylight(altitude):
    """Return the illuminance [lx] of the sky alone, the sun at an altitude [deg]."""
    if altitude >= 0.0:
        return AT_HORIZON
    if altitude >= -6.0:
        return AT_HORIZON * elementary.power(AT_CIVIL / AT_HORIZON, -altitude / 6.0)
    if altitude >= -12.0:
        return AT_CIVIL * elementary.power(AT_NAUTICAL / AT_CIVIL, (-altitude - 6.0) / 6.0)
    if altitude >= -18.0:
        return AT_NAUTICAL * elementary.power(AT_NIGHT / AT_NAUTICAL, (-altitude - 12.0) / 6.0)
    return AT_NIGHT
