"""False positives: detections of bodies that are not there, which the tracker takes as any other.

A ghost is a box on the ego's first route. It stands at a place of the route, as the echo of a
bridge, a gantry or a manhole cover does, or is born at random ahead of the ego. It has a row of its
own in the tracks and detections, behind those of the entities.

Source: radars that do not resolve elevation report what is above the road as a stationary obstacle
on it: Diewald, Klappstein, Sarholz, Dickmann, Dietmayer, Radar-interference-based bridge
identification for collision avoidance systems, IEEE IV (2011).
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers import _tracking_kernels as tracking
from bridgegen.drivers._occlusion_kernels import DX, DY, D
from bridgegen.drivers._path_kernels import pose
from bridgegen.drivers._perception_kernels import COLOURED, blank, frame_at
from bridgegen.drivers._physics_kernels import (
    BOX_ERROR,
    CAMERA_FLOOR,
    DROPOUT_TIME,
    ERROR_TIME,
    FRAME,
    HEADING_ERROR,
    LIDAR_CONFIDENCE,
)
from bridgegen.drivers._random_kernels import block, unit
from bridgegen.drivers._sensor_kernels import LIDAR_ACROSS, LIDAR_ALONG, SIZE, TURN, draw
from bridgegen.drivers.kinds import (
    CONFIDENCE,
    GHOST,
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

AT, RATE, APPEARS, VANISHES, LIFETIME, LONG, WIDE, WHAT = range(8)
"""Columns of ``Plan.ghosts`` ``(G, 8)``: slots of the station of its near end after the ego's start
[m], -1 if it is born at random; of births a metre that the ego travels [1/m], -1 if it stands at a
place; of the distances ahead of the ego's front between which it is reported [m]; of its lifetime,
the mean one if it is born at random [s]; of its length and width [m]. Then its kind."""

LIVES, STATION, UNTIL = D, DX, DY
"""Columns of ``sensors`` that a ghost, which has no geometry, uses otherwise: 1 while it is
reported, 2 once it is over for good; the station of its near end [m]; until when it lives [s]."""

BIRTHS = 3  # a stream of random numbers, after those of `_sensor_kernels`


@kernel
def is_reported(frame, moved, row, slots, front, key, e, memory):
    """Return whether a ghost is reported in a frame; bear it, or let it go.

    ``moved`` [m] is how far the ego has come since the frame before, ``front`` the station [m] of
    its front.
    """
    now = frame * FRAME
    nearest, farthest = slots[row[VANISHES]], slots[row[APPEARS]]
    if memory[e, LIVES] == 0.0 and row[AT] >= 0:
        if nearest <= memory[e, STATION] - front <= farthest:
            memory[e, LIVES], memory[e, UNTIL] = 1.0, now + slots[row[LIFETIME]]
    elif memory[e, LIVES] == 0.0:
        birth, place, life, _ = block(key, e, BIRTHS, frame)
        if unit(birth) < 1.0 - elementary.exp(-slots[row[RATE]] * moved):
            memory[e, STATION] = front + nearest + unit(place) * (farthest - nearest)
            memory[e, LIVES] = 1.0
            memory[e, UNTIL] = now - slots[row[LIFETIME]] * elementary.log(unit(life))
    if memory[e, LIVES] == 1.0 and (
        now >= memory[e, UNTIL] or memory[e, STATION] - front < nearest
    ):
        memory[e, LIVES] = 2.0 if row[AT] >= 0 else 0.0
    return memory[e, LIVES] == 1.0


@kernel
def haunt(k, plan, roads, state, record):
    """Add the ghosts to the tracks and detections of instant k, after `perceive`.

    Ideal perception has none. Off its first route the ego meets none.
    """
    body, tracks, memory = plan.bodies[0], state.tracks, state.sensors
    for g in range(plan.ghosts.shape[0]):
        row, e = plan.ghosts[g], record.x.shape[0] + g
        frame = frame_at(k, plan.dt)
        blank(record.detections, e, k, MISSED if frame >= 0 else NO_FRAME)
        if plan.ideal_perception:
            continue
        if k > 0:
            tracking.advance(tracks, memory, e, plan.dt)
        if frame < 0:
            continue
        elapsed = max(plan.dt, FRAME)
        renew = 1.0 - elementary.exp(-elapsed / DROPOUT_TIME)
        draw(memory, e, state.key[0], frame, renew, elementary.exp(-elapsed / ERROR_TIME))
        front = state.station[0] + body[2] + 0.5 * body[0]
        if k == 0 and row[AT] >= 0:
            memory[e, STATION] = state.station[0] + state.slots[row[AT]]
        moved = record.v[0, k] * elapsed
        if state.on[0] != 0 or not is_reported(
            frame, moved, row, state.slots, front, state.key[0], e, memory
        ):
            tracking.miss(tracks, memory, e)
            continue
        length, width = state.slots[row[LONG]], state.slots[row[WIDE]]
        x, y, h = pose(
            roads.paths[0], roads.counts[0], roads.steps[0], memory[e, STATION] + 0.5 * length
        )
        stretch = max(1.0 + BOX_ERROR * memory[e, SIZE], 0.5)
        seen = record.detections[e, k]
        seen[SEEN_BY], seen[KIND], seen[CONFIDENCE] = GHOST, row[WHAT], LIDAR_CONFIDENCE
        seen[X] = x + CAMERA_FLOOR * memory[e, LIDAR_ALONG]
        seen[Y] = y + CAMERA_FLOOR * memory[e, LIDAR_ACROSS]
        seen[HEADING] = h + HEADING_ERROR * memory[e, TURN]
        seen[LENGTH], seen[WIDTH] = length * stretch, width * stretch
        variance = COLOURED * CAMERA_FLOOR * CAMERA_FLOOR
        tracking.see(
            tracks, memory, e, seen[X], seen[Y], seen[HEADING], seen[LENGTH], seen[WIDTH],
            seen[KIND], seen[CONFIDENCE], variance, variance,
        )  # fmt: skip
