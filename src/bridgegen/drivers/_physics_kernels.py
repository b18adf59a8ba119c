"""The laws that weather and sensors obey, and the constants of them alone: with unit and source.

Where no source is named the figure is ours, chosen to give the ranges that its comment says.
Lengths in metres, angles in radians, extinctions in 1/m, luminances in cd/m², illuminances in lx.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel

# The air.
KOSCHMIEDER = 2.996  # −ln 0.05: contrast is 5 % at the meteorological optical range; WMO-No. 8
RAIN_EXTINCTION, RAIN_POWER = 3.65e-4, 0.63  # of R [mm/h]: 1/m; Mie, Marshall–Palmer drops
SNOW_EXTINCTION, SNOW_POWER = 1.277e-3, 1.38  # dry snow, mm/h of water; ITU-R P.1814, 5.55 dB/km
RAIN_ON_GLASS = 0.01  # h/mm, of light that wet glass scatters over the picture: a third at 50 mm/h

# The light.
CLEAR_NORMAL = 127_500.0  # lx, of the sun outside the air; IES RP-21-84
CLEAR_DEPTH = 0.21  # optical depth of a clear sky per air mass; the same
AT_HORIZON, AT_CIVIL, AT_NAUTICAL, AT_NIGHT = 400.0, 3.4, 0.008, 0.001
"""Illuminance on the ground with the sun at 0, −6, −12 and −18° or below [lx]: sunset, the ends of
civil and of nautical twilight, a moonless night. Source: P. K. Seidelmann (ed.), Explanatory
Supplement to the Astronomical Almanac, 1992; the last from the RCA Electro-Optics Handbook,
1974."""
CLOUD_SHADE, CLOUD_POWER = 0.75, 3.4  # 1 − 0.75·n^3.4; Kasten, Czeplak, Sol. Energy 24 (1980)
GROUND_ALBEDO = 0.2  # of the scene behind a target: grey asphalt, walls, trees
GLARE, GLARE_FROM = 10.0, 1.0  # Stiles–Holladay, L = 10·E/θ² with θ in degrees, from 1° on

# The camera: a ring of them, 1920 pixels over 77° each.
FOCAL_LENGTH = 1207.0  # pixels
IDENTIFY = 12.8  # pixels across a target: 6.4 cycles, his identification, to tell what it is
NOTICE = 2.8  # pixels: 1.4 cycles, his orientation, which is enough for a lamp
# His: J. Johnson, Analysis of image forming systems, Image Intensifier Symposium (1958).
TARGET_CONTRAST = 0.5  # of target and background, close by, in clear air
DARK_LUMINANCE = 1.0  # cd/m², where noise halves the contrast: dark clothes are seen for some 45 m
TARGET_ALBEDO = 0.1  # dark clothes
HEADLAMP = 20_000.0  # cd, low beam straight ahead; UN R112, class B: 10,100 at least at point 50R
BEAM_WIDTH = 0.4  # tangent of the angle at which it has a quarter of that
BACKSCATTER = 0.003  # 1/(m·sr), of headlamps in fog: its veil is HEADLAMP · β · this
SIGNAL_LAMP = 200.0  # cd, of a traffic light; EN 12368, level 2
SIGNAL_SIZE = 0.3  # m, its diameter; EN 12368
PIXEL_ERROR = 1.0  # pixels, of a box's foot and side in a clear picture
CAMERA_FLOOR = 0.1  # m, of position, however close

# The LiDAR.
RATED_RANGE, RATED_REFLECTANCE = 200.0, 0.9  # m, at which 90 % is just seen; data sheets' practice
BEAM_AREA = 2.03e-5  # sr, between beams 0.2° and 0.33° apart
ENOUGH_RETURNS = 5.0  # returns from a target of which half are recognised
RANGE_NOISE = 0.09  # m·√2, at a signal-to-noise ratio of 1: σ = 0.09/√(2·SNR)
LIDAR_FLOOR = 0.05  # m, of position: the box's fit
BEAM_ANGLE = 0.0035  # rad, 0.2°

# Both.
MOUNT = 0.95  # of the ego's height: where the sensors look from …
LEAST_HEIGHT = 0.5  # m, … at least
BEST = 0.99  # of frames, recall close by in clear air; ours, after what detectors reach
CULL = 250.0  # m, beyond which nobody looks
FRAME = 0.1  # s, between two frames
DROPOUT_TIME = 0.7  # s, correlation time of being seen or missed; that misses come in runs:
# Piazzoni et al., Modeling Perception Errors towards Robust Decision Making, IJCAI (2020)
ERROR_TIME = 0.5  # s, of position and box errors
BOX_ERROR = 0.06  # of length and width, with a LiDAR; twice that by camera alone
HEADING_ERROR = 0.05  # rad, likewise
LEAST_CONFIDENCE = 0.3  # of what is detected at all
LIDAR_CONFIDENCE = 0.6  # at most, without a picture …
SURE_RETURNS = 20.0  # … of which so many returns give half
SURE_PIXELS = 25.6  # pixels that give half of a camera's: twice what detection needs


@kernel
def transmission(extinction, d):
    """Return the share of contrast that is left over a distance: Koschmieder's e^(−βd)."""
    return elementary.exp(-extinction * d)


@kernel
def snr(reflectance, attenuation, d):
    """Return a LiDAR's signal-to-noise ratio: 1 where ρ·e^(−2αd)/d² = 0.9/r_max²."""
    signal = reflectance * elementary.exp(-2.0 * attenuation * d) / (d * d)
    return signal * RATED_RANGE * RATED_RANGE / RATED_REFLECTANCE


@kernel
def veil(illuminance, cosine):
    """Return the veiling luminance [cd/m²] of a glaring source at an angle; Stiles–Holladay.

    ``illuminance`` is square to the source's rays; the lens, which looks aside, has its cosine.

    Source: CIE 146:2002, after Holladay (1926) and Stiles (1929).
    """
    if cosine <= 0.0:
        return 0.0
    angle = max(math.degrees(elementary.acos(min(cosine, 1.0))), GLARE_FROM)
    return GLARE * illuminance * cosine / (angle * angle)


@kernel
def recognised(ratio):
    """Return the probability of a target with ``ratio`` times the cycles that half need.

    Source: the target transfer probability function of Johnson's criteria; Ratches, Opt. Eng. 15
    (1976) 525: P = r^E/(1 + r^E), E = 2.7 + 0.7·r.
    """
    if ratio <= 0.0:
        return 0.0
    if ratio > 8.0:
        return 1.0
    odds = elementary.exp((2.7 + 0.7 * ratio) * elementary.log(ratio))
    return odds / (1.0 + odds)
