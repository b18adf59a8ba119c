"""What the sensors do not resolve: bodies close to each other give one detection.

Two bodies are unresolved where their gaps in bearing and in range, between their edges as the
sensors see them, are both within a stated resolution. The greater of the two is then detected, in a
box that grows by a stated share to hold both; the other one is missed, so its track coasts, is
dropped, and begins anew where they part: beyond `SPLIT` times the resolution.

Source: S. Blackman, R. Popoli, Design and Analysis of Modern Tracking Systems (1999), on closely
spaced targets. That the greater one leads, and the hysteresis, are ours.
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
    return (one, -memory[a, D], float(b)) > (other, -memory[b, D], float(a))


@kernel
def grow(own, at, half, extent):
    """Return size and middle of ±own, grown by a share of what it lacks to hold at ± half."""
    low = extent * min(at - half + own, 0.0) - own
    high = extent * max(at + half - own, 0.0) + own
    return high - low, 0.5 * (low + high)


@kernel
def enclose(detections, k, a, b, extent):
    """Enlarge the box that body a is detected with by a share of what it lacks to enclose b's."""
    cosine, sine = (
        elementary.cos(detections[a, k, HEADING]),
        elementary.sin(detections[a, k, HEADING]),
    )
    turn = detections[b, k, HEADING] - detections[a, k, HEADING]
    c, s = abs(elementary.cos(turn)), abs(elementary.sin(turn))
    dx, dy = detections[b, k, X] - detections[a, k, X], detections[b, k, Y] - detections[a, k, Y]
    long, wide = 0.5 * detections[b, k, LENGTH], 0.5 * detections[b, k, WIDTH]
    own = 0.5 * detections[a, k, LENGTH], 0.5 * detections[a, k, WIDTH]
    at = dx * cosine + dy * sine, dy * cosine - dx * sine
    detections[a, k, LENGTH], along = grow(own[0], at[0], long * c + wide * s, extent)
    detections[a, k, WIDTH], across = grow(own[1], at[1], long * s + wide * c, extent)
    detections[a, k, X] += along * cosine - across * sine
    detections[a, k, Y] += along * sine + across * cosine


@kernel
def merge(tracker, bodies, memory, detections, k):
    """Let unresolved bodies lead others: give leaders' detections of instant k their boxes.

    ``memory[e, INTO]`` becomes the body that body e is one with, 0 where it has its own detection.
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
