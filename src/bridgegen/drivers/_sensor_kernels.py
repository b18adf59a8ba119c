"""Both sensors before one body: is it detected, and where, how large and as what.

Whether a sensor detects a body is a persistent number per sensor and body, uniform and drawn anew
at random times, that the probability of detection must exceed: for a constant probability, a
two-state Markov chain. So the worse of two weathers never shows what the better one hides. Errors
are first-order autoregressive.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers import _camera_kernels as camera
from bridgegen.drivers import _lidar_kernels as lidar
from bridgegen.drivers._occlusion_kernels import COS, DX, DY, LAST, SIN, D
from bridgegen.drivers._physics_kernels import (
    BOX_ERROR,
    HEADING_ERROR,
    LEAST_CONFIDENCE,
    LIDAR_CONFIDENCE,
    SURE_PIXELS,
    SURE_RETURNS,
    recognised,
    veil,
)
from bridgegen.drivers._random_kernels import block, normal_pair, unit
from bridgegen.drivers._weather_columns import ATTENUATION, GLARE, SUN_X, SUN_Y
from bridgegen.drivers.kinds import (
    BOTH,
    CAMERA,
    CONFIDENCE,
    HEADING,
    KIND,
    LAMPS,
    LENGTH,
    LIDAR,
    MISTAKEN_FOR,
    REFLECTANCE,
    SEEN_BY,
    WIDTH,
    X,
    Y,
)

# Columns of ``memory`` ``(E, MEMORY)`` after the tracker's and the geometry's: 0 until the body's
# random numbers have been drawn; the three persistent uniform numbers; the six errors in standard
# deviations; the variances [m²] of this frame's position; the body that it is not resolved from.
DRAWN = LAST
BY_CAMERA, BY_LIDAR, BY_CLASS = DRAWN + 1, DRAWN + 2, DRAWN + 3
CAMERA_ALONG, CAMERA_ACROSS, LIDAR_ALONG, LIDAR_ACROSS, SIZE, TURN = range(DRAWN + 4, DRAWN + 10)
VAR_X, VAR_Y, INTO = DRAWN + 10, DRAWN + 11, DRAWN + 12
MEMORY = DRAWN + 13

# Streams of random numbers.
DROPOUTS, ERRORS, OTHERS = 0, 1, 2


@kernel
def draw(memory, e, key, frame, renew, keep):
    """Advance a body's random numbers to a frame.

    Args:
        memory: ``(E, MEMORY)``.
        e: the body.
        key: of the scenario.
        frame: its number.
        renew: probability that a persistent number is drawn anew.
        keep: correlation of an error with that of the frame before.
    """
    a, b, c, d = block(key, e, DROPOUTS, frame)
    p, q, r, s = block(key, e, ERRORS, frame)
    t, u, v, w = block(key, e, OTHERS, frame)
    fresh = memory[e, DRAWN] == 0.0
    if fresh:
        memory[e, DRAWN] = 1.0
        keep = 0.0
    if fresh or unit(a) < renew:
        memory[e, BY_CAMERA] = unit(b)
    if fresh or unit(c) < renew:
        memory[e, BY_LIDAR] = unit(d)
    if fresh or unit(v) < renew:
        memory[e, BY_CLASS] = unit(w)
    add = math.sqrt(1.0 - keep * keep)
    item, other = normal_pair(p, q)
    memory[e, CAMERA_ALONG] = keep * memory[e, CAMERA_ALONG] + add * item
    memory[e, CAMERA_ACROSS] = keep * memory[e, CAMERA_ACROSS] + add * other
    item, other = normal_pair(r, s)
    memory[e, LIDAR_ALONG] = keep * memory[e, LIDAR_ALONG] + add * item
    memory[e, LIDAR_ACROSS] = keep * memory[e, LIDAR_ACROSS] + add * other
    item, other = normal_pair(t, u)
    memory[e, SIZE] = keep * memory[e, SIZE] + add * item
    memory[e, TURN] = keep * memory[e, TURN] + add * other


@kernel
def observe(memory, e, bodies, kind, weather, heading, height, share, detections, k):
    """Let both sensors look at a body; fill a detection relative to the sensors.

    Args:
        memory: ``(E, MEMORY)``; the body's geometry and random numbers are this frame's.
        e: the body.
        bodies: ``(E, 8)``.
        kind: of the body.
        weather: ``(W,)``.
        heading: of the ego, as cosine and sine.
        height: of the sensors [m].
        share: of the body that others do not hide.
        detections: ``(E, T, DETECTION)``: position from the sensors, heading from the body's.
        k: the instant.

    Returns:
        The variances [m²] of its position along and across the line of sight.
    """
    d = max(memory[e, D], 1.0)
    ux, uy = memory[e, DX] / memory[e, D], memory[e, DY] / memory[e, D]
    c, s = memory[e, COS], memory[e, SIN]
    across = bodies[e, 0] * abs(uy * c - ux * s) + bodies[e, 1] * abs(ux * c + uy * s)
    area = across * bodies[e, 7]
    dazzle = 0.0
    if weather[GLARE] > 0.0:
        dazzle = veil(weather[GLARE], weather[SUN_X] * ux + weather[SUN_Y] * uy)
    cosine, sine = heading
    headlit = camera.beam(ux * cosine + uy * sine, uy * cosine - ux * sine)
    clear = camera.clarity(weather, d, dazzle, LAMPS[kind] / area, headlit)
    on_target = camera.pixels(math.sqrt(area * share), d, clear)
    # The same number until it is drawn anew: so worse weather hides what better weather shows,
    # frame by frame, and never the reverse.
    by_camera = memory[e, BY_CAMERA] < camera.detection(on_target)
    echoes, ratio = lidar.returns(area * share, REFLECTANCE[kind], weather[ATTENUATION], d)
    by_lidar = memory[e, BY_LIDAR] < lidar.detection(echoes)
    if not (by_camera or by_lidar):
        return 0.0, 0.0
    along = across = weight_along = weight_across = 0.0
    if by_camera:
        sigma, sideways = camera.position_errors(d, height, clear)
        weight, weight_sideways = 1.0 / (sigma * sigma), 1.0 / (sideways * sideways)
        along += weight * sigma * memory[e, CAMERA_ALONG]
        across += weight_sideways * sideways * memory[e, CAMERA_ACROSS]
        weight_along += weight
        weight_across += weight_sideways
    if by_lidar:
        sigma, sideways = lidar.position_errors(d, ratio)
        weight, weight_sideways = 1.0 / (sigma * sigma), 1.0 / (sideways * sideways)
        along += weight * sigma * memory[e, LIDAR_ALONG]
        across += weight_sideways * sideways * memory[e, LIDAR_ACROSS]
        weight_along += weight
        weight_across += weight_sideways
    along, across = along / weight_along, across / weight_across
    detections[e, k, SEEN_BY] = BOTH if by_camera and by_lidar else CAMERA if by_camera else LIDAR
    detections[e, k, X] = memory[e, DX] + along * ux - across * uy
    detections[e, k, Y] = memory[e, DY] + along * uy + across * ux
    coarse = 1.0 if by_lidar else 2.0  # an image alone gives sizes and headings half as well
    stretch = max(1.0 + coarse * BOX_ERROR * memory[e, SIZE], 0.5)
    detections[e, k, LENGTH] = bodies[e, 0] * stretch
    detections[e, k, WIDTH] = bodies[e, 1] * stretch
    detections[e, k, HEADING] = coarse * HEADING_ERROR * memory[e, TURN]
    sure = echoes / (echoes + SURE_RETURNS) * LIDAR_CONFIDENCE if by_lidar else 0.0
    if by_camera:
        sure = max(sure, recognised(on_target / SURE_PIXELS))
    detections[e, k, CONFIDENCE] = LEAST_CONFIDENCE + (1.0 - LEAST_CONFIDENCE) * sure
    # Without any certainty the class is a toss of a coin.
    known = memory[e, BY_CLASS] < 0.5 * (1.0 + sure)
    detections[e, k, KIND] = kind if known else MISTAKEN_FOR[kind]
    return 1.0 / weight_along, 1.0 / weight_across
