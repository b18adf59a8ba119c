"""The last resort: full braking where two boxes will meet and nothing else was in time."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import aside_at, pose
from bridgegen.drivers._surroundings_kernels import (
    ACROSS,
    ALONG,
    ASIDE,
    AT,
    COSINE,
    HALF_LENGTH,
    HALF_WIDTH,
    NEAR,
)
from bridgegen.drivers._tracking_kernels import LENGTH, VX, VY, WIDTH, H
from bridgegen.drivers._tracking_kernels import X as TRACK_X
from bridgegen.drivers._tracking_kernels import Y as TRACK_Y

LOOK = 1.6  # s, how far it looks; AEB acts below 1.5 s to collision, UN Regulation No. 152
STEP = 0.2  # s, between two looks
DELAY = 0.3  # s, until full braking
MARGIN = 0.2  # m, around the ego's box
PARALLEL = 0.9  # cosine of the angle to the route below which an actor does not follow its bends


@kernel
def boxes_meet(dx, dy, h, half_length, half_width, other_h, other_length, other_width):
    """Return whether two boxes overlap; the second's centre is at (dx, dy) from the first's.

    Separating axes: both boxes' own directions.
    """
    c, t = elementary.cos(h), elementary.sin(h)
    oc, ot = elementary.cos(other_h), elementary.sin(other_h)
    cosine, sine = abs(c * oc + t * ot), abs(c * ot - t * oc)
    if abs(dx * c + dy * t) > half_length + other_length * cosine + other_width * sine:
        return False
    if abs(dy * c - dx * t) > half_width + other_length * sine + other_width * cosine:
        return False
    if abs(dx * oc + dy * ot) > other_length + half_length * cosine + half_width * sine:
        return False
    return abs(dy * oc - dx * ot) <= other_width + half_length * sine + half_width * cosine


@kernel
def must_brake(path, n, ds, s, v, body, shift, around, tracks, friction_limit):
    """Return whether only full braking is left.

    The ego goes on along its route, or beside it by a ``shift``. Actors along the road are taken to
    follow its bends, all others to go straight on. A body that meets the ego's rear half does not
    count: braking would not help.
    """
    if v < 0.5:
        return False
    length, width, centre = body[0], body[1], body[2]
    # Later than this, braking no longer helps in time.
    look = min(LOOK, DELAY + 0.5 * v / friction_limit)
    for e in range(1, tracks.shape[0]):
        if around[e, NEAR] == 0.0:
            continue
        ahead = around[e, AT] - s - centre
        closing = v - around[e, ALONG]
        reach = around[e, HALF_LENGTH] + 0.5 * length + MARGIN
        room = around[e, HALF_WIDTH] + 0.5 * width + MARGIN
        parallel = abs(around[e, COSINE]) > PARALLEL
        t = STEP
        while t <= look:
            aside = aside_at(shift, s + v * t)
            if parallel:
                along = ahead - closing * t
                beside = around[e, ASIDE] - aside
                meets = abs(along) < reach and abs(beside + around[e, ACROSS] * t) < room
            else:
                px, py, ph = pose(path, n, ds, s + v * t)
                c, sine = elementary.cos(ph), elementary.sin(ph)
                dx = tracks[e, TRACK_X] + tracks[e, VX] * t - px - centre * c + aside * sine
                dy = tracks[e, TRACK_Y] + tracks[e, VY] * t - py - centre * sine - aside * c
                along = dx * c + dy * sine
                meets = dx * dx + dy * dy < (reach + room) ** 2 and boxes_meet(
                    dx,
                    dy,
                    ph,
                    0.5 * length + MARGIN,
                    0.5 * width + MARGIN,
                    tracks[e, H],
                    0.5 * tracks[e, LENGTH],
                    0.5 * tracks[e, WIDTH],
                )
            if meets:
                if along > 0.0:
                    return True
                break
            t += STEP
    return False
