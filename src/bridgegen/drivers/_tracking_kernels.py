"""From detections to tracks: what the planner knows of other participants.

A track is a row of ``tracks`` ``(E, TRACK)``; row e is entity e, or the greater of several. Per
axis of the world a Kalman filter estimates position and velocity; a track is tentative until enough
of its last frames have seen it, coasts at its velocity when they miss it, and is then dropped.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel

STATE, X, Y, H, VX, VY, LENGTH, WIDTH, KIND, CONFIDENCE, UNSEEN, AGE, LAMPS = range(13)
TRACK = 13
NONE, TENTATIVE, CONFIRMED, COASTING = 0, 1, 2, 3

# Further state of a track, in the first columns of ``memory`` ``(E, MEMORY)``: its last
# frames as bits, and the covariance of each axis: of position, of position and velocity, of
# velocity.
HISTORY, PX, PY = 0, 1, 4
MEMORY = 7

ANGLE, RANGE, EXTENT, CONFIRM, OF, COAST = range(6)
"""Columns of ``Plan.tracker`` ``(6,)``, slots of what the scenario states, and items of what
`settings` returns: gaps in bearing [rad; the slot's in degrees] and range [m] up to which two
bodies are one; how far its box grows to enclose both, 0 to 1; in how many of the last frames a
track must be seen to be confirmed, and of how many; how long it lives unseen [s]."""

TRACKER = (0.0, 0.0, 1.0, 3.0, 5.0, 1.0)
"""What holds unless a scenario states otherwise: all is resolved, 3 of 5 frames confirm, 1 s.
Source of M of N: S. Blackman, R. Popoli, Design and Analysis of Modern Tracking Systems (1999)."""

MOST_FRAMES = 30  # that a track's history holds
MANOEUVRE = 4.0  # m²/s³, of white-noise acceleration: ±2 m/s unforeseen in a second
FASTEST = 15.0  # m/s, standard deviation of the velocity of what has just been seen
SMOOTHING = 0.3  # of heading, box and confidence, per frame


@kernel
def settings(tracker, slots):
    """Return what the scenario states of the tracker, else `TRACKER`; the angle in radians."""
    if len(tracker) == 0:
        return TRACKER
    angle, extent = math.radians(slots[tracker[ANGLE]]), slots[tracker[EXTENT]]
    frames, coast = min(slots[tracker[OF]], float(MOST_FRAMES)), slots[tracker[COAST]]
    return angle, slots[tracker[RANGE]], extent, slots[tracker[CONFIRM]], frames, coast


@kernel
def advance(tracks, memory, e, dt):
    """Move a track on by a time step, and let its variances grow."""
    if tracks[e, STATE] == NONE:
        return
    tracks[e, X] += tracks[e, VX] * dt
    tracks[e, Y] += tracks[e, VY] * dt
    tracks[e, UNSEEN] += dt
    tracks[e, AGE] += dt
    for p in (PX, PY):
        memory[e, p] += dt * (
            2.0 * memory[e, p + 1] + dt * (memory[e, p + 2] + MANOEUVRE * dt / 3.0)
        )
        memory[e, p + 1] += dt * (memory[e, p + 2] + 0.5 * MANOEUVRE * dt)
        memory[e, p + 2] += MANOEUVRE * dt


@kernel
def correct(tracks, memory, e, axis, velocity, p, measured, variance):
    """Correct one axis of a track by a position of a variance [m²]."""
    gain = 1.0 / (memory[e, p] + variance)
    k, kv = memory[e, p] * gain, memory[e, p + 1] * gain
    error = measured - tracks[e, axis]
    tracks[e, axis] += k * error
    tracks[e, velocity] += kv * error
    memory[e, p + 2] -= kv * memory[e, p + 1]
    memory[e, p + 1] *= 1.0 - k
    memory[e, p] *= 1.0 - k


@kernel
def begin(tracks, memory, e, x, y, h, length, width, kind, confidence, var_x, var_y):
    """Begin a tentative track where something has been seen."""
    tracks[e, STATE], tracks[e, X], tracks[e, Y], tracks[e, H] = TENTATIVE, x, y, h
    tracks[e, VX] = tracks[e, VY] = 0.0
    tracks[e, LENGTH], tracks[e, WIDTH] = length, width
    tracks[e, KIND], tracks[e, CONFIDENCE] = kind, confidence
    tracks[e, UNSEEN] = tracks[e, AGE] = 0.0
    memory[e, HISTORY] = 1.0
    for p, variance in ((PX, var_x), (PY, var_y)):
        memory[e, p] = variance
        memory[e, p + 1] = 0.0
        memory[e, p + 2] = FASTEST * FASTEST


@kernel
def seen_in(history):
    """Return in how many of the last frames it was seen."""
    count, bits = 0, int(history)
    while bits > 0:
        count += bits & 1
        bits >>= 1
    return count


@kernel
def see(tracks, memory, e, x, y, h, length, width, kind, confidence, var_x, var_y, tracker):
    """Take a detection into a track: of a box's centre with variances [m²], at this instant."""
    if tracks[e, STATE] == NONE:
        begin(tracks, memory, e, x, y, h, length, width, kind, confidence, var_x, var_y)
        if tracker[CONFIRM] <= 1.0:
            tracks[e, STATE] = CONFIRMED
        return
    correct(tracks, memory, e, X, VX, PX, x, var_x)
    correct(tracks, memory, e, Y, VY, PY, y, var_y)
    turn = h - tracks[e, H]
    turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
    tracks[e, H] += SMOOTHING * turn
    tracks[e, LENGTH] += SMOOTHING * (length - tracks[e, LENGTH])
    tracks[e, WIDTH] += SMOOTHING * (width - tracks[e, WIDTH])
    if kind == tracks[e, KIND] or confidence > tracks[e, CONFIDENCE]:
        tracks[e, KIND] = kind
    tracks[e, CONFIDENCE] += SMOOTHING * (confidence - tracks[e, CONFIDENCE])
    tracks[e, UNSEEN] = 0.0
    memory[e, HISTORY] = float(int(memory[e, HISTORY]) << 1 & (1 << int(tracker[OF])) - 1 | 1)
    if tracks[e, STATE] != TENTATIVE or seen_in(memory[e, HISTORY]) >= tracker[CONFIRM]:
        tracks[e, STATE] = CONFIRMED


@kernel
def forget(tracks, e):
    """Drop a track."""
    for i in range(TRACK):
        tracks[e, i] = 0.0


@kernel
def miss(tracks, memory, e, tracker):
    """Update a track that a frame has missed."""
    if tracks[e, STATE] == NONE:
        return
    memory[e, HISTORY] = float(int(memory[e, HISTORY]) << 1 & (1 << int(tracker[OF])) - 1)
    hopeless = seen_in(memory[e, HISTORY]) == 0
    if tracks[e, STATE] != TENTATIVE:
        tracks[e, STATE] = COASTING
        hopeless = tracks[e, UNSEEN] > tracker[COAST]
    if hopeless:
        forget(tracks, e)
