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
from bridgegen.drivers import _physics_kernels as physics
from bridgegen.drivers import _tracking_kernels as tracking
from bridgegen.drivers import kinds as column
from bridgegen.drivers._occlusion_kernels import DX, DY, D
from bridgegen.drivers._path_kernels import pose
from bridgegen.drivers._perception_kernels import COLOURED, blank, frame_at
from bridgegen.drivers._random_kernels import block, unit
from bridgegen.drivers._sensor_kernels import LIDAR_ACROSS, LIDAR_ALONG, SIZE, TURN, draw

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

    ``moved`` [m] is the ego's way since the frame before, ``front`` the station of its front [m].
    """
    now = frame * physics.FRAME
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
    tracks, memory, frame = state.tracks, state.sensors, frame_at(k, plan.dt)
    elapsed = max(plan.dt, physics.FRAME)
    renew = 1.0 - elementary.exp(-elapsed / physics.DROPOUT_TIME)
    keep = elementary.exp(-elapsed / physics.ERROR_TIME)
    front = state.station[0] + plan.bodies[0, 2] + 0.5 * plan.bodies[0, 0]
    for g in range(plan.ghosts.shape[0]):
        row, e = plan.ghosts[g], record.x.shape[0] + g
        blank(record.detections, e, k, column.MISSED if frame >= 0 else column.NO_FRAME)
        if plan.ideal_perception:
            continue
        if k == 0 and row[AT] >= 0:
            memory[e, STATION] = state.station[0] + state.slots[row[AT]]
        elif k > 0:
            tracking.advance(tracks, memory, e, plan.dt)
        if frame < 0:
            continue
        draw(memory, e, state.key[0], frame, renew, keep)
        moved = record.v[0, k] * elapsed
        if state.on[0] != 0 or not is_reported(
            frame, moved, row, state.slots, front, state.key[0], e, memory
        ):
            tracking.miss(tracks, memory, e)
            continue
        length, width = state.slots[row[LONG]], state.slots[row[WIDE]]
        middle = memory[e, STATION] + 0.5 * length
        x, y, h = pose(roads.paths[0], roads.counts[0], roads.steps[0], middle)
        error, stretch = physics.CAMERA_FLOOR, max(1.0 + physics.BOX_ERROR * memory[e, SIZE], 0.5)
        x, y = x + error * memory[e, LIDAR_ALONG], y + error * memory[e, LIDAR_ACROSS]
        h += physics.HEADING_ERROR * memory[e, TURN]
        length, width, sure = length * stretch, width * stretch, physics.LIDAR_CONFIDENCE
        seen = record.detections[e, k]
        seen[column.SEEN_BY], seen[column.KIND] = column.GHOST, row[WHAT]
        seen[column.CONFIDENCE] = sure
        seen[column.X], seen[column.Y], seen[column.HEADING] = x, y, h
        seen[column.LENGTH], seen[column.WIDTH] = length, width
        variance = COLOURED * error * error
        tracking.see(tracks, memory, e, x, y, h, length, width, row[WHAT], sure, variance, variance)
