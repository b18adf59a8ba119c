"""Occlusion: rays from the sensors to each body.

Bodies are boxes that stand on the ground, as high as they are. A ray that another body cuts before
it reaches its target hides the target up to where the line of sight over that body meets it.

This frame's geometry is in columns of ``memory`` ``(E, MEMORY)``, relative to the sensors: of
each body its centre's x, y and distance d [m], bearing, the angles from there to its right and left
edge [rad], cosine and sine of its heading; and of each ray at it the direction, where it meets the
body [m], and the share of the body's height that is hidden there.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers import _tracking_kernels as tracking

FIRST = tracking.MEMORY  # the columns before are the tracker's
DX, DY, D, BEARING, LOW, HIGH, COS, SIN = range(FIRST, FIRST + 8)
# Angular intervals, sorted by the distance of centres, hid a pedestrian at a truck's front corner
# behind its rear: those are the scenarios that matter.
RAYS = 5  # across a target
RAY_X, RAY_Y, REACH, HIDDEN = range(SIN + 1, SIN + 1 + 4 * RAYS, RAYS)
LAST = HIDDEN + RAYS


@kernel
def span(memory, e, length, width):
    """Return the angles from its bearing to a box's right and left edge; ±π from inside of it."""
    ux, uy = memory[e, DX] / memory[e, D], memory[e, DY] / memory[e, D]
    c, s = memory[e, COS], memory[e, SIN]
    forward, left = ux * c + uy * s, uy * c - ux * s
    low = high = 0.0
    for i in range(4):
        a = 0.5 * length if i < 2 else -0.5 * length
        b = 0.5 * width if i % 2 else -0.5 * width
        along = memory[e, D] + a * forward + b * left
        if along <= 1e-6:
            return -math.pi, math.pi
        across = (b * forward - a * left) / along
        low, high = min(low, across), max(high, across)
    return elementary.atan(low), elementary.atan(high)


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
def cast(e, memory, bodies):
    """Aim the rays at body e, and note where each meets it."""
    low, high = memory[e, LOW], memory[e, HIGH]
    for ray in range(RAYS):
        angle = memory[e, BEARING] + low + (high - low) * (ray + 0.5) / RAYS
        ux, uy = elementary.cos(angle), elementary.sin(angle)
        memory[e, RAY_X + ray], memory[e, RAY_Y + ray] = ux, uy
        own = entry(memory, e, bodies[e, 0], bodies[e, 1], ux, uy)
        memory[e, REACH + ray] = min(own, memory[e, D])
        memory[e, HIDDEN + ray] = 0.0


@kernel
def visible_share(e, memory, bodies, height):
    """Return the share of body e that no other body hides, 0 to 1.

    Args:
        e: its row.
        memory: as above; the distance is +inf for bodies too far away.
        bodies: ``(E, 8)``: length and width first, height last [m].
        height: of the sensors [m].
    """
    far = memory[e, D] + 0.5 * (bodies[e, 0] + bodies[e, 1])
    is_cast = False
    for o in range(1, memory.shape[0]):
        if o == e or memory[o, D] - 0.5 * (bodies[o, 0] + bodies[o, 1]) > far:
            continue
        turn = memory[o, BEARING] - memory[e, BEARING]
        if turn > math.pi:
            turn -= 2.0 * math.pi
        elif turn < -math.pi:
            turn += 2.0 * math.pi
        if turn + memory[o, LOW] > memory[e, HIGH] or turn + memory[o, HIGH] < memory[e, LOW]:
            continue
        # Rays are cast when the first other body shares the bearing, which few do: occlusion takes
        # 0.5 of the 2.5 ms of thirty bodies.
        if not is_cast:
            cast(e, memory, bodies)
            is_cast = True
        for ray in range(RAYS):
            ux, uy = memory[e, RAY_X + ray], memory[e, RAY_Y + ray]
            before, own = (
                entry(memory, o, bodies[o, 0], bodies[o, 1], ux, uy),
                memory[e, REACH + ray],
            )
            if before < own:
                # Heights count: one sees a bus over a car, but no car behind a car.
                shadow = height + (bodies[o, 7] - height) * own / max(before, 0.1)
                share = min(max(shadow / bodies[e, 7], 0.0), 1.0)
                memory[e, HIDDEN + ray] = max(memory[e, HIDDEN + ray], share)
    if not is_cast:
        return 1.0
    hidden = 0.0
    for ray in range(RAYS):
        hidden += memory[e, HIDDEN + ray]
    return 1.0 - hidden / RAYS
