"""What the sensors do not resolve: bodies close to each other give one detection.

Two bodies are unresolved where their gaps in bearing and in range, between their edges as the
sensors see them, are both within a stated resolution. The greater of the two is then detected, with
a box round both or, as the scenario states, less of it down to its own, which masks the other one;
that is missed: so its track coasts and is dropped, and begins anew where they part. Once one, they
part only beyond `SPLIT` times the resolution.

Source: S. Blackman, R. Popoli, Design and Analysis of Modern Tracking Systems (1999), on closely
spaced targets; that resolution is by cells of range and angle, M. I. Skolnik, Introduction to Radar
Systems (2001). That the greater one stands for both, and the hysteresis, are ours.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._occlusion_kernels import BEARING, COS, DX, DY, HIGH, LOW, SIN, D
from bridgegen.drivers._sensor_kernels import INTO
from bridgegen.drivers._tracking_kernels import ANGLE, EXTENT, RANGE
from bridgegen.drivers.kinds import HEADING, LENGTH, MISSED, SEEN_BY, WIDTH, X, Y

SPLIT = 1.5  # of the resolution: those that are one part beyond it


@kernel
def deep(memory, bodies, e):
    """Return half of a body's extent along the line of sight [m]."""
    ux, uy = memory[e, DX] / memory[e, D], memory[e, DY] / memory[e, D]
    c, s = memory[e, COS], memory[e, SIN]
    return 0.5 * (bodies[e, 0] * abs(ux * c + uy * s) + bodies[e, 1] * abs(uy * c - ux * s))


@kernel
def gaps(memory, bodies, a, b):
    """Return the gaps between two bodies in bearing [rad] and range [m]; 0 where they overlap."""
    turn = memory[b, BEARING] - memory[a, BEARING]
    turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
    angle = max(turn + memory[b, LOW] - memory[a, HIGH], memory[a, LOW] - turn - memory[b, HIGH])
    apart = abs(memory[b, D] - memory[a, D]) - deep(memory, bodies, a) - deep(memory, bodies, b)
    return max(angle, 0.0), max(apart, 0.0)


@kernel
def leads(memory, bodies, a, b):
    """Return whether body a stands for both: the greater one; of equal ones the nearer one."""
    one, other = bodies[a, 0] * bodies[a, 1], bodies[b, 0] * bodies[b, 1]
    if one != other:
        return one > other
    if memory[a, D] != memory[b, D]:
        return memory[a, D] < memory[b, D]
    return a < b


@kernel
def enclose(detections, k, a, b, extent):
    """Enlarge the box that body a is detected with by a share of what it lacks to enclose b's."""
    cosine, sine = (
        elementary.cos(detections[a, k, HEADING]),
        elementary.sin(detections[a, k, HEADING]),
    )
    turn = detections[b, k, HEADING] - detections[a, k, HEADING]
    c, s = abs(elementary.cos(turn)), abs(elementary.sin(turn))
    dx = detections[b, k, X] - detections[a, k, X]
    dy = detections[b, k, Y] - detections[a, k, Y]
    length, width = detections[b, k, LENGTH], detections[b, k, WIDTH]
    shifts = 0.0, 0.0
    for axis in range(2):
        at = dx * cosine + dy * sine if axis == 0 else dy * cosine - dx * sine
        half = 0.5 * (length * c + width * s) if axis == 0 else 0.5 * (length * s + width * c)
        column = LENGTH if axis == 0 else WIDTH
        own = 0.5 * detections[a, k, column]
        low = extent * min(at - half + own, 0.0) - own
        high = extent * max(at + half - own, 0.0) + own
        detections[a, k, column] = high - low
        middle = 0.5 * (low + high)
        shifts = (middle, 0.0) if axis == 0 else (shifts[0], middle)
    detections[a, k, X] += shifts[0] * cosine - shifts[1] * sine
    detections[a, k, Y] += shifts[0] * sine + shifts[1] * cosine


@kernel
def merge(tracker, bodies, memory, detections, k):
    """Give bodies that are not resolved one detection, and mark the others as missed.

    Args:
        tracker: see ``_tracking_kernels.settings``.
        bodies: ``(E, 8)``.
        memory: ``(E, MEMORY)``; the geometry is this frame's.
        detections: ``(E, T, DETECTION)``, of instant k, in the world.
        k: the instant.
    """
    for e in range(1, memory.shape[0]):
        before, memory[e, INTO] = memory[e, INTO], 0.0
        if detections[e, k, SEEN_BY] == MISSED:
            continue
        leader = 0
        for o in range(1, memory.shape[0]):
            if detections[o, k, SEEN_BY] == MISSED or o == e or not leads(memory, bodies, o, e):
                continue
            angle, apart = gaps(memory, bodies, e, o)
            wide = SPLIT if before == o else 1.0
            one = angle <= wide * tracker[ANGLE] and apart <= wide * tracker[RANGE]
            if one and (leader == 0 or leads(memory, bodies, o, leader)):
                leader = o
        memory[e, INTO] = leader
    for e in range(1, memory.shape[0]):
        root = e
        while memory[root, INTO] > 0.0:
            root = int(memory[root, INTO])
        if root != e:
            enclose(detections, k, root, e, tracker[EXTENT])
    for e in range(1, memory.shape[0]):
        if memory[e, INTO] > 0.0:
            detections[e, k, SEEN_BY] = MISSED
            for i in range(1, detections.shape[2]):
                detections[e, k, i] = 0.0
