"""Who hides whom: rays from the sensors, body by body.

Bodies are boxes that stand on the ground, as high as they are. A ray that another body cuts before
it reaches its target hides the target up to where the line of sight over that body meets it.

The geometry of this frame stands in columns of ``memory`` ``(E, MEMORY)``, relative to the sensors:
of each body its centre's x, y and distance d [m], bearing, half the angle that it takes up [rad],
cosine and sine of its heading.
"""

import math

from bridgegen.compiled import kernel
from bridgegen.ego import _tracking_kernels as tracking

FIRST = tracking.MEMORY  # the columns before are the tracker's
DX, DY, D, BEARING, HALF, COS, SIN = range(FIRST, FIRST + 7)
RAYS = 5  # across a target


@kernel
def half_angle(memory, e, length, width):
    """Return half the angle that a box takes up, seen from the sensors; π where they are inside.

    The wider side counts for both: a few pairs more are looked at, none is missed.
    """
    ux, uy = memory[e, DX] / memory[e, D], memory[e, DY] / memory[e, D]
    c, s = memory[e, COS], memory[e, SIN]
    forward, left = ux * c + uy * s, uy * c - ux * s
    widest = 0.0
    for i in range(4):
        a = 0.5 * length if i < 2 else -0.5 * length
        b = 0.5 * width if i % 2 else -0.5 * width
        along = memory[e, D] + a * forward + b * left
        across = abs(b * forward - a * left)
        if along <= 1e-6:
            return math.pi
        widest = max(widest, across / along)
    return math.atan(widest)


@kernel
def entry(memory, e, length, width, ux, uy):
    """Return the distance at which a ray (ux, uy) from the sensors enters a box; +inf if never."""
    c, s = memory[e, COS], memory[e, SIN]
    # the ray in the box's frame, from where the sensors are
    ox, oy = -(memory[e, DX] * c + memory[e, DY] * s), memory[e, DX] * s - memory[e, DY] * c
    vx, vy = ux * c + uy * s, uy * c - ux * s
    first, last = 0.0, math.inf
    for axis in range(2):
        o = ox if axis == 0 else oy
        v = vx if axis == 0 else vy
        half = 0.5 * length if axis == 0 else 0.5 * width
        if abs(v) < 1e-12:
            if abs(o) > half:
                return math.inf
            continue
        near, far = (-half - o) / v, (half - o) / v
        if near > far:
            near, far = far, near
        first, last = max(first, near), min(last, far)
    return first if first <= last else math.inf


@kernel
def visible_share(e, memory, bodies, height):
    """Return the share of body e that no other body hides, 0 to 1.

    Args:
        e: its row.
        memory: as above; who is too far away has the distance +inf.
        bodies: ``(E, 8)``: length and width first, height last [m].
        height: of the sensors [m].
    """
    half = min(memory[e, HALF], 0.5 * math.pi)
    reach = memory[e, D] + 0.5 * math.hypot(bodies[e, 0], bodies[e, 1])
    hidden0 = hidden1 = hidden2 = hidden3 = hidden4 = 0.0
    for o in range(1, memory.shape[0]):
        if o == e or memory[o, D] - 0.5 * (bodies[o, 0] + bodies[o, 1]) > reach:
            continue
        turn = memory[o, BEARING] - memory[e, BEARING]
        turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
        if abs(turn) > half + memory[o, HALF]:
            continue
        for ray in range(RAYS):
            angle = memory[e, BEARING] + half * ((2.0 * ray + 1.0) / RAYS - 1.0)
            ux, uy = math.cos(angle), math.sin(angle)
            before = entry(memory, o, bodies[o, 0], bodies[o, 1], ux, uy)
            if before == math.inf:
                continue
            own = min(entry(memory, e, bodies[e, 0], bodies[e, 1], ux, uy), memory[e, D])
            if before >= own:
                continue
            shadow = height + (bodies[o, 7] - height) * own / max(before, 0.1)
            share = min(max(shadow / bodies[e, 7], 0.0), 1.0)
            if ray == 0:
                hidden0 = max(hidden0, share)
            elif ray == 1:
                hidden1 = max(hidden1, share)
            elif ray == 2:
                hidden2 = max(hidden2, share)
            elif ray == 3:
                hidden3 = max(hidden3, share)
            else:
                hidden4 = max(hidden4, share)
    return 1.0 - (hidden0 + hidden1 + hidden2 + hidden3 + hidden4) / RAYS
