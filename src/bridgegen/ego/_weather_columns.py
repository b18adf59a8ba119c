"""The columns of ``weather`` ``(WEATHER,)`` float64: one scenario's weather, now.

What is stated comes first, then what follows from it, then how far one sees in it. Without numba,
so that compiling a storyboard does not wait for it; private, so that the cache of compiled code
knows when one of them changes.
"""

# Stated; a storyboard's environment has a slot for each, −1 for what it leaves as it was.
VISUAL_RANGE = 0  # m, meteorological optical range
RAIN, SNOW = 1, 2  # mm/h of water
SUN_AZIMUTH, SUN_ELEVATION = 3, 4  # rad, clockwise from north (+y); above the horizon
ILLUMINANCE = 5  # lx, of the sun on the ground without clouds; negative: as the sun stands
CLOUD = 6  # share of the sky
FRICTION_SCALE = 7  # of dry friction
STATED = 8

# What follows, see ``_weather_kernels``.
EXTINCTION = 8  # 1/m, of contrast
ATTENUATION = 9  # 1/m, of a LiDAR's beam, one way
BACKGROUND = 10  # cd/m², luminance of what is behind a target
GLARE = 11  # lx, of the sun, square to its rays
GLASS = 12  # share of contrast that wet glass leaves
FRICTION = 13  # m/s², what the tyres can give: μ·g
SUN_X, SUN_Y = 14, 15  # horizontal components of the direction to the sun

# How far one sees, see ``_sight_kernels``: a row per thing, a column per angle to the sun.
SIGHT = 16  # 0 here until somebody asks
N_THINGS, N_GLARES = 3, 7
WEATHER = SIGHT + N_THINGS * N_GLARES
