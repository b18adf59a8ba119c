"""Perception of other participants: sensor frames, detections and tracks.

A camera and a LiDAR look all round from the middle of the ego's box. Each frame, every 0.1 s, takes
the geometry of the bodies (`place`), their occlusion, detections, and updates the tracks.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers import _tracking_kernels as tracking
from bridgegen.drivers._occlusion_kernels import (
    BEARING,
    COS,
    DX,
    DY,
    HIGH,
    LOW,
    SIN,
    D,
    span,
    visible_share,
)
from bridgegen.drivers._physics_kernels import (
    CULL,
    DROPOUT_TIME,
    ERROR_TIME,
    FRAME,
    LEAST_HEIGHT,
    MOUNT,
)
from bridgegen.drivers._resolution_kernels import merge
from bridgegen.drivers._sensor_kernels import DRAWN, INTO, MEMORY, VAR_X, VAR_Y, draw, observe
from bridgegen.drivers.kinds import (
    BOTH,
    CONFIDENCE,
    DETECTION,
    HEADING,
    KIND,
    LENGTH,
    MISSED,
    NO_FRAME,
    SEEN_BY,
    WIDTH,
    X,
    Y,
)

__all__ = ["MEMORY", "perceive"]

# Errors that last tell a filter little more by their number. Without this its velocities swing by
# metres per second.
COLOURED = 10.0  # of variances, for the tracker: errors last (1 + φ)/(1 − φ) frames, φ = e^(−0.2)


@kernel
def blank(detections, e, k, why):
    """Record that body e was missed at instant k, or that no frame was taken."""
    detections[e, k, SEEN_BY] = why
    for i in range(1, DETECTION):
        detections[e, k, i] = 0.0


@kernel
def frame_at(k, dt):
    """Return the number of the frame taken at instant k, −1 if none is."""
    # Frames are numbered by time, so the noise does not depend on the step.
    now = int(k * dt / FRAME + 1e-6)
    if k == 0 or now != int((k - 1) * dt / FRAME + 1e-6):
        return now
    return -1


@kernel
def place(k, present, x, y, h, bodies, memory):
    """Fill the geometry of all bodies from the ego's box centre; return how many are in range."""
    cosine, sine = elementary.cos(h[0, k]), elementary.sin(h[0, k])
    sx, sy = x[0, k] + bodies[0, 2] * cosine, y[0, k] + bodies[0, 2] * sine
    near = 0
    for e in range(1, x.shape[0]):
        c, s = elementary.cos(h[e, k]), elementary.sin(h[e, k])
        dx, dy = x[e, k] + bodies[e, 2] * c - sx, y[e, k] + bodies[e, 2] * s - sy
        d = math.sqrt(dx * dx + dy * dy)
        memory[e, DX], memory[e, DY], memory[e, COS], memory[e, SIN] = dx, dy, c, s
        memory[e, D] = max(d, 1e-3)
        # Who is beyond the sensors' range is cheap: a rollout takes 231 µs for each of 120 actors,
        # 305 for each of 4.
        if present[e] and d <= CULL:
            near += 1
        else:
            memory[e, D] = math.inf
    if near > 1:
        for e in range(1, x.shape[0]):
            if memory[e, D] < math.inf:
                memory[e, BEARING] = elementary.atan2(memory[e, DY], memory[e, DX])
                memory[e, LOW], memory[e, HIGH] = span(memory, e, bodies[e, 0], bodies[e, 1])
    return near


@kernel
def know_body(e, k, dt, x, y, h, v, bodies, kinds, lamps, tracks):
    """Copy the truth of body e to its track."""
    cosine, sine = elementary.cos(h[e, k]), elementary.sin(h[e, k])
    tracks[e, tracking.STATE] = tracking.CONFIRMED
    tracks[e, tracking.X] = x[e, k] + bodies[e, 2] * cosine
    tracks[e, tracking.Y] = y[e, k] + bodies[e, 2] * sine
    tracks[e, tracking.H] = h[e, k]
    tracks[e, tracking.VX], tracks[e, tracking.VY] = v[e, k] * cosine, v[e, k] * sine
    tracks[e, tracking.LENGTH], tracks[e, tracking.WIDTH] = bodies[e, 0], bodies[e, 1]
    tracks[e, tracking.KIND], tracks[e, tracking.CONFIDENCE] = kinds[e], 1.0
    tracks[e, tracking.UNSEEN], tracks[e, tracking.AGE] = 0.0, k * dt
    tracks[e, tracking.LAMPS] = lamps[e]


@kernel
def know(k, dt, present, x, y, h, v, bodies, kinds, lamps, tracks, detections):
    """Ideal perception: copy the truth to the tracks, and to the detections of a frame."""
    frame = frame_at(k, dt) >= 0
    for e in range(1, x.shape[0]):
        if not present[e]:
            blank(detections, e, k, MISSED if frame else NO_FRAME)
            continue
        know_body(e, k, dt, x, y, h, v, bodies, kinds, lamps, tracks)
        blank(detections, e, k, NO_FRAME)
        if frame:
            detections[e, k, SEEN_BY] = BOTH
            detections[e, k, X] = tracks[e, tracking.X]
            detections[e, k, Y] = tracks[e, tracking.Y]
            detections[e, k, HEADING] = h[e, k]
            detections[e, k, LENGTH], detections[e, k, WIDTH] = bodies[e, 0], bodies[e, 1]
            detections[e, k, CONFIDENCE], detections[e, k, KIND] = 1.0, kinds[e]


@kernel
def look(k, dt, frame, key, present, x, y, h, bodies, kinds, lamps, weather, tracker, memory,
         tracks, detections):  # fmt: skip
    """Take a sensor frame: fill its detections, and update the tracks."""
    elapsed = max(dt, FRAME)
    renew = 1.0 - elementary.exp(-elapsed / DROPOUT_TIME)
    keep = elementary.exp(-elapsed / ERROR_TIME)
    near = place(k, present, x, y, h, bodies, memory)
    heading = elementary.cos(h[0, k]), elementary.sin(h[0, k])
    height = max(MOUNT * bodies[0, 7], LEAST_HEIGHT)
    sx = x[0, k] + bodies[0, 2] * heading[0]
    sy = y[0, k] + bodies[0, 2] * heading[1]
    for e in range(1, x.shape[0]):
        blank(detections, e, k, MISSED)
        if memory[e, D] == math.inf:
            memory[e, DRAWN] = 0.0
            continue
        # Whether it is seen or not: the same key then draws the same numbers in any weather, and a
        # counterfactual compares like with like.
        draw(memory, e, key, frame, renew, keep)
        share = visible_share(e, memory, bodies, height) if near > 1 else 1.0
        along, across = observe(
            memory, e, bodies, kinds[e], weather, heading, height, share, detections, k
        )
        if detections[e, k, SEEN_BY] == MISSED:
            continue
        detections[e, k, X] += sx
        detections[e, k, Y] += sy
        detections[e, k, HEADING] += h[e, k]
        ux, uy = memory[e, DX] / memory[e, D], memory[e, DY] / memory[e, D]
        along, across = COLOURED * along, COLOURED * across
        memory[e, VAR_X] = along * ux * ux + across * uy * uy
        memory[e, VAR_Y] = along * uy * uy + across * ux * ux
    if tracker[tracking.ANGLE] > 0.0:  # also of one body, which may have been one with another
        merge(tracker, bodies, memory, detections, k)
    for e in range(1, x.shape[0]):
        if memory[e, INTO] > 0.0:
            blank(detections, e, k, MISSED)
        if detections[e, k, SEEN_BY] == MISSED:
            tracking.miss(tracks, memory, e, tracker)
            continue
        px, py, turn = detections[e, k, X], detections[e, k, Y], detections[e, k, HEADING]
        length, width = detections[e, k, LENGTH], detections[e, k, WIDTH]
        kind, sure = detections[e, k, KIND], detections[e, k, CONFIDENCE]
        vx, vy = memory[e, VAR_X], memory[e, VAR_Y]
        tracking.see(tracks, memory, e, px, py, turn, length, width, kind, sure, vx, vy, tracker)
        tracks[e, tracking.LAMPS] = lamps[e]


@kernel
def perceive(
    k, dt, key, ideal, present, x, y, h, v, bodies, kinds, lamps, weather, tracker, memory,
    tracks, detections,
):  # fmt: skip
    """Bring the tracks up to instant k, with a sensor frame if one is due.

    To be called at every instant from 0 on, in order.

    Args:
        k: the instant.
        dt: between two instants [s].
        key: uint64, of the scenario's random numbers.
        ideal: whether the tracks are the truth.
        present: ``(E,)`` bool; the caller drops the tracks of entities that cease to be present
            (``tracking.forget``).
        x: ``(E, T)`` [m], reference points; of all arrays with T, only instant k is read.
        y: ``(E, T)`` [m].
        h: ``(E, T)`` [rad].
        v: ``(E, T)`` [m/s].
        bodies: ``(E, 8)``, see `bridgegen.simulation.embedded.program.Program`.
        kinds: ``(E,)``, see `bridgegen.drivers.kinds`.
        lamps: ``(E,)`` int64, what shows, see `bridgegen.drivers.kinds`.
        weather: ``(W,)``, see ``_weather_kernels``.
        tracker: see ``_tracking_kernels.settings``.
        memory: ``(E, MEMORY)``, zeros before the first instant.
        tracks: ``(E, TRACK)``, zeros before the first instant; see ``_tracking_kernels``.
        detections: ``(E, T, DETECTION)``, of which instant k is written.
    """
    blank(detections, 0, k, MISSED)
    if ideal:
        know(k, dt, present, x, y, h, v, bodies, kinds, lamps, tracks, detections)
        return
    if k > 0:
        for e in range(1, x.shape[0]):
            tracking.advance(tracks, memory, e, dt)
    frame = frame_at(k, dt)
    if frame >= 0:
        look(
            k, dt, frame, key, present, x, y, h, bodies, kinds, lamps, weather, tracker, memory,
            tracks, detections,
        )  # fmt: skip
        return
    for e in range(1, x.shape[0]):
        blank(detections, e, k, NO_FRAME)
