"""What the ego's sensors make of the others, frame by frame, and the tracks that come of it.

A camera and a LiDAR look all round from the ego's box centre. Whether one detects a body is a
persistent number per sensor and body, uniform and drawn anew at random times, that the probability
of detection must exceed: for a constant probability, a two-state Markov chain. So the worse of two
weathers never shows what the better one hides. Errors are first-order autoregressive.
"""

import math

from bridgegen.compiled import kernel
from bridgegen.ego import _camera_kernels as camera
from bridgegen.ego import _lidar_kernels as lidar
from bridgegen.ego import _tracking_kernels as tracking
from bridgegen.ego._occlusion_kernels import (
    BEARING,
    COS,
    DX,
    DY,
    HIGH,
    LAST,
    LOW,
    SIN,
    D,
    span,
    visible_share,
)
from bridgegen.ego._physics_kernels import (
    BOX_ERROR,
    CULL,
    DROPOUT_TIME,
    ERROR_TIME,
    FRAME,
    HEADING_ERROR,
    IDENTIFY,
    LAMPS,
    MOUNT,
    REFLECTANCE,
    recognised,
    veil,
)
from bridgegen.ego._random_kernels import block, normal_pair, unit
from bridgegen.ego._weather_kernels import ATTENUATION, GLARE, SUN_X, SUN_Y
from bridgegen.ego.detections import (
    BOTH,
    CAMERA,
    CONFIDENCE,
    DETECTION,
    HEADING,
    KIND,
    LENGTH,
    LIDAR,
    NO_FRAME,
    NOBODY,
    SEEN_BY,
    WIDTH,
    X,
    Y,
)

# Columns of ``memory`` ``(E, MEMORY)`` after the tracker's and the geometry's: 0 until the body's
# random numbers have been drawn; the three persistent uniform numbers; the six errors in standard
# deviations.
DRAWN = LAST
BY_CAMERA, BY_LIDAR, BY_CLASS = DRAWN + 1, DRAWN + 2, DRAWN + 3
CAMERA_ALONG, CAMERA_ACROSS, LIDAR_ALONG, LIDAR_ACROSS, SIZE, TURN = range(DRAWN + 4, DRAWN + 10)
MEMORY = DRAWN + 10

# Streams of random numbers.
DROPOUTS, ERRORS, OTHERS = 0, 1, 2

MISTAKEN_FOR = (1, 2, 1, 4, 3, 4, 5, 5)  # by kind: what it is taken for when it is not recognised
LEAST_CONFIDENCE = 0.3
LIDAR_CONFIDENCE = 0.6  # at most, without a picture
COLOURED = 10.0  # of variances, for the tracker: errors last (1 + φ)/(1 − φ) frames, φ = e^(−0.2)


@kernel
def blank(detections, e, k, why):
    """Write that nobody saw body e at instant k, or that no frame was taken."""
    detections[e, k, SEEN_BY] = why
    for i in range(1, DETECTION):
        detections[e, k, i] = 0.0


@kernel
def frame_at(k, dt):
    """Return the number of the frame taken at instant k, −1 if none is."""
    now = int(k * dt / FRAME + 1e-6)
    if k == 0 or now != int((k - 1) * dt / FRAME + 1e-6):
        return now
    return -1


@kernel
def draw(memory, e, key, frame, renew, keep):
    """Bring a body's random numbers up to a frame.

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
    one, other = normal_pair(p, q)
    memory[e, CAMERA_ALONG] = keep * memory[e, CAMERA_ALONG] + add * one
    memory[e, CAMERA_ACROSS] = keep * memory[e, CAMERA_ACROSS] + add * other
    one, other = normal_pair(r, s)
    memory[e, LIDAR_ALONG] = keep * memory[e, LIDAR_ALONG] + add * one
    memory[e, LIDAR_ACROSS] = keep * memory[e, LIDAR_ACROSS] + add * other
    one, other = normal_pair(t, u)
    memory[e, SIZE] = keep * memory[e, SIZE] + add * one
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
    coarse = 1.0 if by_lidar else 2.0  # a picture alone tells sizes and headings half as well
    stretch = max(1.0 + coarse * BOX_ERROR * memory[e, SIZE], 0.5)
    detections[e, k, LENGTH] = bodies[e, 0] * stretch
    detections[e, k, WIDTH] = bodies[e, 1] * stretch
    detections[e, k, HEADING] = coarse * HEADING_ERROR * memory[e, TURN]
    sure = echoes / (echoes + 20.0) * LIDAR_CONFIDENCE if by_lidar else 0.0
    if by_camera:
        sure = max(sure, recognised(on_target / (2.0 * IDENTIFY)))
    detections[e, k, CONFIDENCE] = LEAST_CONFIDENCE + (1.0 - LEAST_CONFIDENCE) * sure
    known = memory[e, BY_CLASS] < 0.5 * (1.0 + sure)
    detections[e, k, KIND] = kind if known else MISTAKEN_FOR[kind]
    return 1.0 / weight_along, 1.0 / weight_across


@kernel
def place(k, x, y, h, bodies, memory):
    """Fill the geometry of all bodies as seen from the ego's box centre; return how many count."""
    cosine, sine = math.cos(h[0, k]), math.sin(h[0, k])
    sx, sy = x[0, k] + bodies[0, 2] * cosine, y[0, k] + bodies[0, 2] * sine
    near = 0
    for e in range(1, x.shape[0]):
        c, s = math.cos(h[e, k]), math.sin(h[e, k])
        dx, dy = x[e, k] + bodies[e, 2] * c - sx, y[e, k] + bodies[e, 2] * s - sy
        d = math.sqrt(dx * dx + dy * dy)
        memory[e, DX], memory[e, DY], memory[e, COS], memory[e, SIN] = dx, dy, c, s
        memory[e, D] = max(d, 1e-3)
        if d <= CULL:
            near += 1
        else:
            memory[e, D] = math.inf
    if near > 1:
        for e in range(1, x.shape[0]):
            if memory[e, D] < math.inf:
                memory[e, BEARING] = math.atan2(memory[e, DY], memory[e, DX])
                memory[e, LOW], memory[e, HIGH] = span(memory, e, bodies[e, 0], bodies[e, 1])
    return near


@kernel
def know(k, dt, x, y, h, v, bodies, kinds, tracks, detections):
    """Ideal perception: the truth goes to the tracks, and to the detections of a frame."""
    frame = frame_at(k, dt) >= 0
    for e in range(1, x.shape[0]):
        cosine, sine = math.cos(h[e, k]), math.sin(h[e, k])
        tracks[e, tracking.STATE] = tracking.CONFIRMED
        tracks[e, tracking.X] = x[e, k] + bodies[e, 2] * cosine
        tracks[e, tracking.Y] = y[e, k] + bodies[e, 2] * sine
        tracks[e, tracking.H] = h[e, k]
        tracks[e, tracking.VX], tracks[e, tracking.VY] = v[e, k] * cosine, v[e, k] * sine
        tracks[e, tracking.LENGTH], tracks[e, tracking.WIDTH] = bodies[e, 0], bodies[e, 1]
        tracks[e, tracking.KIND], tracks[e, tracking.CONFIDENCE] = kinds[e], 1.0
        tracks[e, tracking.UNSEEN], tracks[e, tracking.AGE] = 0.0, k * dt
        blank(detections, e, k, NO_FRAME)
        if frame:
            detections[e, k, SEEN_BY] = BOTH
            detections[e, k, X] = tracks[e, tracking.X]
            detections[e, k, Y] = tracks[e, tracking.Y]
            detections[e, k, HEADING] = h[e, k]
            detections[e, k, LENGTH], detections[e, k, WIDTH] = bodies[e, 0], bodies[e, 1]
            detections[e, k, CONFIDENCE], detections[e, k, KIND] = 1.0, kinds[e]


@kernel
def look(k, dt, frame, key, x, y, h, bodies, kinds, weather, memory, tracks, detections):
    """Take a sensor frame: fill its detections, and tell the tracks."""
    elapsed = max(dt, FRAME)
    renew, keep = 1.0 - math.exp(-elapsed / DROPOUT_TIME), math.exp(-elapsed / ERROR_TIME)
    near = place(k, x, y, h, bodies, memory)
    heading = math.cos(h[0, k]), math.sin(h[0, k])
    height = MOUNT * bodies[0, 7]
    sx = x[0, k] + bodies[0, 2] * heading[0]
    sy = y[0, k] + bodies[0, 2] * heading[1]
    for e in range(1, x.shape[0]):
        blank(detections, e, k, NOBODY)
        if memory[e, D] == math.inf:
            memory[e, DRAWN] = 0.0
            tracking.miss(tracks, memory, e)
            continue
        draw(memory, e, key, frame, renew, keep)
        share = visible_share(e, memory, bodies, height) if near > 1 else 1.0
        along, across = observe(
            memory, e, bodies, kinds[e], weather, heading, height, share, detections, k
        )
        if detections[e, k, SEEN_BY] == NOBODY:
            tracking.miss(tracks, memory, e)
            continue
        detections[e, k, X] += sx
        detections[e, k, Y] += sy
        detections[e, k, HEADING] += h[e, k]
        ux, uy = memory[e, DX] / memory[e, D], memory[e, DY] / memory[e, D]
        along, across = COLOURED * along, COLOURED * across
        tracking.see(
            tracks, memory, e, detections[e, k, X], detections[e, k, Y], detections[e, k, HEADING],
            detections[e, k, LENGTH], detections[e, k, WIDTH], detections[e, k, KIND],
            detections[e, k, CONFIDENCE],
            along * ux * ux + across * uy * uy, along * uy * uy + across * ux * ux,
        )  # fmt: skip


@kernel
def perceive(k, dt, key, ideal, x, y, h, v, bodies, kinds, weather, memory, tracks, detections):
    """Bring the tracks up to instant k, with a sensor frame if one is due.

    To be called at every instant from 0 on, in order.

    Args:
        k: the instant.
        dt: between two instants [s].
        key: uint64, of the scenario's random numbers.
        ideal: whether the truth itself goes to the tracks.
        x: ``(E, T)`` [m], reference points; of all that has T, only instant k is read.
        y: ``(E, T)`` [m].
        h: ``(E, T)`` [rad].
        v: ``(E, T)`` [m/s].
        bodies: ``(E, 8)``, see `bridgegen.simulation.embedded.program.Program`.
        kinds: ``(E,)``, see `bridgegen.ego.kinds`.
        weather: ``(W,)``, see ``_weather_kernels``.
        memory: ``(E, MEMORY)``, zeros before the first instant.
        tracks: ``(E, TRACK)``, zeros before the first instant; see ``_tracking_kernels``.
        detections: ``(E, T, DETECTION)``, of which instant k is written.
    """
    blank(detections, 0, k, NOBODY)
    if ideal:
        know(k, dt, x, y, h, v, bodies, kinds, tracks, detections)
        return
    if k > 0:
        for e in range(1, x.shape[0]):
            tracking.advance(tracks, memory, e, dt)
    frame = frame_at(k, dt)
    if frame >= 0:
        look(k, dt, frame, key, x, y, h, bodies, kinds, weather, memory, tracks, detections)
        return
    for e in range(1, x.shape[0]):
        blank(detections, e, k, NO_FRAME)
