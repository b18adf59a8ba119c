"""The columns of ``weather`` ``(WEATHER,)`` float64: one scenario's weather, now.

What is stated (`bridgegen.scenario.weather.COLUMNS`) comes first, then what follows from it, then
how far one sees in it. Without numba, so that compiling a storyboard does not wait for it; private,
so that the cache of compiled code knows when one of them changes.
"""

from bridgegen.scenario.weather import COLUMNS, column

# Stated; a storyboard's environment has a slot for each, −1 for what it leaves as it was.
VISUAL_RANGE = column("visual_range")  # m, meteorological optical range
RAIN, SNOW = column("rain"), column("snow")  # mm/h of water
SUN_AZIMUTH = column("sun_azimuth")  # rad, clockwise from north (+y)
SUN_ELEVATION = column("sun_elevation")  # rad, above the horizon
ILLUMINANCE = column("illuminance")  # lx, on the ground without clouds; negative: as the sun stands
CLOUD = column("cloud")  # share of the sky
FRICTION_SCALE = column("friction_scale")  # of dry friction
STATED = len(COLUMNS)

CLEAR_DAY = tuple(physical.clear for physical in COLUMNS)
"""Values of the weather where a file states none: WMO's clear air, the sun in the south at 45°."""

# What follows, see ``_weather_kernels``.
EXTINCTION = STATED  # 1/m, of contrast
ATTENUATION = STATED + 1  # 1/m, of a LiDAR's beam, one way
BACKGROUND = STATED + 2  # cd/m², luminance of what is behind a target
GLARE = STATED + 3  # lx, of the sun, square to its rays
GLASS = STATED + 4  # share of contrast that wet glass leaves
FRICTION = STATED + 5  # m/s², what the tyres can give: μ·g
SUN_X, SUN_Y = STATED + 6, STATED + 7  # horizontal components of the direction to the sun

# How far one sees, see ``_sight_kernels``: a row per thing, a column per angle to the sun.
SIGHT = STATED + 8  # each 0 until it is asked for
N_THINGS, N_GLARES = 3, 7
WEATHER = SIGHT + N_THINGS * N_GLARES
