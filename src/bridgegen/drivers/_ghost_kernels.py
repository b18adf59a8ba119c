"""False positives: detections of bodies that are not there, which the tracker takes as any other.

A ghost is a box on or beside the ego's first route. It stands at a place of the route, as the echo
of a bridge, a gantry or a manhole cover does; is born at random ahead of the ego; or is the image
of a body in a guard rail or a wall beside the route, and moves as images do. It has a row of its
own in the tracks and detections, behind those of the entities.

Source: radars that do not resolve elevation report what is above the road as a stationary obstacle
on it: Diewald, Klappstein, Sarholz, Dickmann, Dietmayer, Radar-interference-based bridge
identification for collision avoidance systems, IEEE IV (2011). Mirror images: Kraus, Scheiner,
Ritter, Dietmayer, The Radar Ghost Dataset, IEEE/RSJ IROS (2021).
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers import _physics_kernels as physics
from bridgegen.drivers import _tracking_kernels as tracking
from bridgegen.drivers import kinds as column
from bridgegen.drivers._occlusion_kernels import DX, DY, D
from bridgegen.drivers._path_kernels import pose, project
from bridgegen.drivers._perception_kernels import COLOURED, blank, frame_at
from bridgegen.drivers._random_kernels import block, unit
from bridgegen.drivers._sensor_kernels import BY_LIDAR, LIDAR_ACROSS, LIDAR_ALONG, SIZE, TURN, draw

AT, RATE, APPEARS, VANISHES, LIFETIME, ASIDE, SHARE, LONG, WIDE, WHAT, MIRRORS = range(11)
"""Columns of ``Plan.ghosts`` ``(G, 11)``: slots of the station of its near end after the ego's
start [m], -1 if it has no such place; of births a metre that the ego travels [1/m], -1 if it is not
born at random; of the distances ahead of the ego's front between which it is reported [m]; of its
lifetime, the mean one if it is born at random [s]; of where the mirror is, left of the route [m],
-1 without one; of the share of frames in which it is reported; of its length and width [m]. Then
its kind, and the entity whose image it is, -1 if of none."""

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
    if memory[e, LIVES] == 0.0 and row[RATE] < 0:
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
        memory[e, LIVES] = 2.0 if row[RATE] < 0 else 0.0
    return memory[e, LIVES] == 1.0 and memory[e, BY_LIDAR] < slots[row[SHARE]]


@kernel
def image(k, row, plan, roads, state, record):
    """Return the station [m] and offset [m] of the centre of a body's image.

    The offset is NaN where there is none: the body is out of range, or beyond the mirror from the
    route. The mirror follows the route; in a bend the image is that of a plane along its tangent.
    """
    o, mirror = row[MIRRORS], state.slots[row[ASIDE]]
    path, n, ds = roads.paths[0], roads.counts[0], roads.steps[0]
    ahead = plan.bodies[o, 2]
    x = record.x[o, k] + ahead * elementary.cos(record.h[o, k])
    y = record.y[o, k] + ahead * elementary.sin(record.h[o, k])
    # A first guess by the distance along the tangent: the foot is sought near it.
    guess = state.station[0] + (x - record.x[0, k]) * elementary.cos(record.h[0, k])
    guess += (y - record.y[0, k]) * elementary.sin(record.h[0, k])
    station, aside = project(path, n, ds, guess, x, y)
    if state.sensors[o, D] == math.inf or (mirror - aside) * mirror <= 0.0:
        aside = math.nan
    return station, 2.0 * mirror - aside


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
    tracker = tracking.settings(plan.tracker, state.slots)
    for g in range(plan.ghosts.shape[0]):
        row, e = plan.ghosts[g], record.x.shape[0] + g
        blank(record.detections, e, k, column.MISSED if frame >= 0 else column.NO_FRAME)
        if plan.ideal_perception:
            continue
        offset = 0.0
        if row[MIRRORS] >= 0 and frame >= 0:
            station, offset = image(k, row, plan, roads, state, record)
            memory[e, STATION] = station - 0.5 * state.slots[row[LONG]]
        elif k == 0 and row[AT] >= 0:
            memory[e, STATION] = state.station[0] + state.slots[row[AT]]
        if k > 0:
            tracking.advance(tracks, memory, e, plan.dt)
        if frame < 0:
            continue
        draw(memory, e, state.key[0], frame, renew, keep)
        moved = record.v[0, k] * elapsed
        if (
            math.isnan(offset)
            or state.on[0] != 0
            or not is_reported(frame, moved, row, state.slots, front, state.key[0], e, memory)
        ):
            tracking.miss(tracks, memory, e, tracker)
            continue
        length, width = state.slots[row[LONG]], state.slots[row[WIDE]]
        middle = memory[e, STATION] + 0.5 * length
        x, y, h = pose(roads.paths[0], roads.counts[0], roads.steps[0], middle)
        if row[MIRRORS] >= 0:
            x, y = x - offset * elementary.sin(h), y + offset * elementary.cos(h)
            h = 2.0 * h - record.h[row[MIRRORS], k]
        error, stretch = physics.CAMERA_FLOOR, max(1.0 + physics.BOX_ERROR * memory[e, SIZE], 0.5)
        x, y = x + error * memory[e, LIDAR_ALONG], y + error * memory[e, LIDAR_ACROSS]
        h += physics.HEADING_ERROR * memory[e, TURN]
        length, width, sure = length * stretch, width * stretch, physics.LIDAR_CONFIDENCE
        seen = record.detections[e, k]
        seen[column.SEEN_BY], seen[column.KIND] = column.GHOST, row[WHAT]
        seen[column.CONFIDENCE] = sure
        seen[column.X], seen[column.Y], seen[column.HEADING] = x, y, h
        seen[column.LENGTH], seen[column.WIDTH] = length, width
        var = COLOURED * error * error
        tracking.see(tracks, memory, e, x, y, h, length, width, row[WHAT], sure, var, var, tracker)
