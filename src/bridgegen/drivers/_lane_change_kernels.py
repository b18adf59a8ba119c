"""Passing a standing or much slower actor by the adjacent lane, and returning.

The ego passes an actor in its lane if the adjacent lane of its own direction lasts until it is
back (so it does not pass a queue before a junction), is free ahead, and if no traffic there has to
brake much for it: neither vehicles that it sees behind, nor one that may come from beyond its
sight. It returns as soon as there is room. A change that has begun is completed.

Its state is the shift (``_shift_kernels``), and for how long it has been held up.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers import _control_kernels as control
from bridgegen.drivers._caution_kernels import ENTER, PARKED_SPEED
from bridgegen.drivers._following_kernels import (
    COMFORT_DECELERATION,
    COMING_IN,
    DRIFT,
    SAME_WAY,
    SIDE_GAP,
    STANDS,
    follow,
    keep_distance,
    stop_for,
)
from bridgegen.drivers._path_kernels import aside_at, shift_length
from bridgegen.drivers._speed_kernels import FAST_ROAD, LEFT, LIMIT, RIGHT, sight_speed
from bridgegen.drivers._surroundings_kernels import (
    ACROSS,
    ALONG,
    ASIDE,
    AT,
    COSINE,
    GAINING,
    HALF_LENGTH,
    HALF_WIDTH,
    NEAR,
)
from bridgegen.drivers._tracking_kernels import KIND
from bridgegen.drivers._yielding_kernels import ACROSS as CROSSES
from bridgegen.drivers.kinds import IS_ON_FOOT

BEFORE, AFTER, BEGINS, LENGTH, HELD_UP = range(control.SIZE + 3, control.SIZE + 8)
LAST = control.SIZE + 8
"""Number of slots of ``mind`` with those of lane changes: the shift, and for how long the ego has
been held up [s]."""

SLOW = 0.5  # of the possible speed; an actor that is slower than that, and …
SLOWER = 3.0  # … by so many m/s, holds the ego up
PATIENCE = 0.3  # s, until the ego passes an actor that holds it up: not for a flickering track
LOOK_AHEAD = 8.0  # s, up to which an actor ahead counts
ROOM = 1.0  # m, kept to the side of the passed actor, if the lanes are that wide
TAIL = 5.0  # m, kept to the vehicle behind after a change, …
TAIL_TIME = 0.9  # … and so many seconds of its speed; source: half of what is taught, 1.8 s
YIELDS = 2.0  # m/s², the deceleration that a change may impose: comfortable
WAIT_AT = 10.0  # m, before a standing actor: room to pass it, when the adjacent lane is free
BRAKES = 1.0  # m/s², an actor that brakes harder than this may be about to stop
STEADY = 0.3  # m, by which a lane's distance may vary along the way
STRIDE = 5.0  # m, between the stations at which that is checked
QUEUE = 60.0  # m before a stop line or a crosswalk, in which a standing actor may wait for it
FAR_BEHIND = 250.0  # m, how far back the ego looks before a change: as far as sensors see


@kernel
def shift_of(mind):
    """Return the present shift."""
    return mind[BEFORE], mind[AFTER], mind[BEGINS], mind[LENGTH]


@kernel
def begin(mind, aside, s, length):
    """Begin a shift to an offset, from the present one."""
    mind[BEFORE], mind[AFTER] = mind[AFTER], aside
    mind[BEGINS], mind[LENGTH], mind[HELD_UP] = s, length, 0.0


@kernel
def look_back(mind, near):
    """Return how far behind it looks [m]; no farther than ``near`` while it stays in its lane."""
    return FAR_BEHIND if mind[HELD_UP] > 0.0 or mind[AFTER] != 0.0 else near


@kernel
def pace_of(around, e):
    """Return an actor's speed along the route [m/s], ≥ 0; 0 if it stands."""
    moves = elementary.hypot(around[e, ALONG], around[e, ACROSS]) > STANDS
    return max(around[e, ALONG], 0.0) if moves else 0.0


@kernel
def slow_ahead(around, tracks, s, front, half_width, aside, pace):
    """Return (the next actor that holds the ego up, the station of the last one's front).

    The strip is ``aside`` of the route, the possible ``pace`` in m/s. The actor is -1 if there is
    none, or if the ego does not pass it, because it will leave the strip.
    """
    slow, at, last = -1, math.inf, -math.inf
    for e in range(1, around.shape[0]):
        if around[e, NEAR] == 0.0 or around[e, AT] < s + front:
            continue
        if abs(around[e, ASIDE] - aside) - around[e, HALF_WIDTH] - half_width > SIDE_GAP:
            continue
        speed = elementary.hypot(around[e, ALONG], around[e, ACROSS])
        along = pace_of(around, e)
        if along > SLOW * pace or along > pace - SLOWER:
            continue
        rear = around[e, AT] - around[e, HALF_LENGTH]
        last = max(last, around[e, AT] + around[e, HALF_LENGTH])
        if rear < at:
            goes = speed > STANDS and around[e, COSINE] < SAME_WAY
            at, slow = rear, -1 if goes or IS_ON_FOOT[int(tracks[e, KIND])] else e
    return slow, last


@kernel
def lane_lasts(road, n, ds, s, side, aside):
    """Return the station [m] up to which the adjacent lane keeps its distance."""
    i, stride = int(s / ds), max(int(STRIDE / ds), 1)
    while i < n and abs(road[i, side] - aside) < STEADY:
        i += stride
    return min(i - stride, n - 1) * ds


@kernel
def is_free(around, tracks, s, v, front, rear, half_width, aside, seen, fastest):
    """Return whether the ego could drive on the strip ``aside`` of the route now.

    Neither it nor an actor ahead, beside or behind on the strip would have to brake much, nor one
    beyond the ``seen`` distance [m] that comes at ``fastest`` [m/s].
    """
    there = (aside, aside, 0.0, 0.0)
    if keep_distance(around, tracks, s, front, rear, half_width, there, v) < -YIELDS:
        return False
    if fastest > v and follow(max(seen - rear, 0.0), fastest, v, 0.0) < -YIELDS:
        return False
    for e in range(1, around.shape[0]):
        if around[e, NEAR] == 0.0 or around[e, AT] > s + front + around[e, HALF_LENGTH] + TAIL:
            continue
        beside = around[e, ASIDE] - aside
        space = abs(beside) - around[e, HALF_WIDTH] - half_width
        nearing = -around[e, ACROSS] if beside > 0.0 else around[e, ACROSS]
        if space > SIDE_GAP and (nearing < DRIFT or space - nearing * COMING_IN > SIDE_GAP):
            continue
        gap = s - rear - around[e, AT] - around[e, HALF_LENGTH]
        w = pace_of(around, e)
        if gap < TAIL + TAIL_TIME * w or (w > v and follow(gap, w, v, 0.0) < -YIELDS):
            return False
    return True


@kernel
def waits_for_something(crosswalks, stop_stations, at):
    """Return whether an actor standing at a station may wait for a light or at a crosswalk."""
    waits = False
    for i in range(stop_stations.shape[0]):
        waits = waits or -TAIL < stop_stations[i] - at < QUEUE
    for i in range(crosswalks.shape[0]):
        waits = waits or -TAIL < crosswalks[i, ENTER] - at < QUEUE
    return waits


@kernel
def actor_crosses(passages, n_passages, s, until):
    """Return whether a passage is expected across the route up to a station."""
    for i in range(n_passages):
        if passages[i, 4] == CROSSES and passages[i, 1] > s and passages[i, 0] < until:
            return True
    return False


@kernel
def passes_round(around, slow, s, v, front, half_width, shift):
    """Return whether a shift that begins at s leads past the slow actor, with room to spare.

    A braking actor is expected to stop where it is.
    """
    w = pace_of(around, slow) if around[slow, GAINING] > -BRAKES else 0.0
    rear = around[slow, AT] - around[slow, HALF_LENGTH] - front
    wide = abs(around[slow, ASIDE] - shift[1]) - around[slow, HALF_WIDTH] - half_width
    there = rear + (max(rear - s, 0.0) * w / (v - w) if v > w else math.inf)
    beside = abs(around[slow, ASIDE] - aside_at(shift, there))
    return beside - around[slow, HALF_WIDTH] - half_width > min(ROOM, wide - SIDE_GAP)


@kernel
def change_lane(
    road, n, ds, s, v, pace, front, rear, half_width, around, tracks, passages, n_passages,
    crosswalks, stop_stations, seen, friction_limit, elapsed, mind,
):  # fmt: skip
    """Begin a lane change if it is time; return the acceleration [m/s²] that waiting requires.

    +inf if none. ``pace`` is the possible speed of the ego [m/s], ``elapsed`` the time since the
    last call [s]; the rest as for `bridgegen.drivers._reference_kernels.plan`.
    ``mind`` is changed in place.
    """
    i, out = min(int(s / ds), n - 1), mind[AFTER]
    if s < mind[BEGINS] + mind[LENGTH]:
        return math.inf
    mind[HELD_UP] += elapsed
    if out == 0.0 and road[i, LEFT] == 0.0 and road[i, RIGHT] == 0.0:
        mind[HELD_UP] = 0.0
        return math.inf
    slow, last = slow_ahead(around, tracks, s, front, half_width, 0.0, pace)
    w = pace_of(around, slow) if slow > 0 else 0.0
    gap = around[slow, AT] - around[slow, HALF_LENGTH] - s - front if slow > 0 else math.inf
    if out != 0.0:
        length = shift_length(out, v, friction_limit)
        clear = gap > length + LOOK_AHEAD * max(v - w, 0.0)
        if clear and is_free(around, tracks, s, v, front, rear, half_width, 0.0, math.inf, 0.0):
            begin(mind, 0.0, s, length)
            return math.inf
        lasts = lane_lasts(road, n, ds, s, LEFT if out > 0.0 else RIGHT, out)
        return stop_for(lasts - s - front - length, v)
    if slow < 0 or gap > max(LOOK_AHEAD * (v - w), 3.0 * WAIT_AT):
        mind[HELD_UP] = 0.0
        return math.inf
    if mind[HELD_UP] < PATIENCE or waits_for_something(crosswalks, stop_stations, last):
        return math.inf
    # It passes the last of the slow actors, and is back before the adjacent lane ends.
    home = s + (last + rear + TAIL - s) * pace / (pace - w)
    home += shift_length(max(road[i, LEFT], -road[i, RIGHT]), pace, friction_limit)
    if actor_crosses(passages, n_passages, s, home):
        return math.inf
    # Who comes from beyond the sight is as fast as limit and fog allow: so in fog the ego stays
    # behind the jam that it passes with ideal perception.
    fastest = min(road[i, LIMIT], sight_speed(seen, friction_limit))
    past = min(v, PARKED_SPEED) if w == 0.0 and road[i, LIMIT] <= FAST_ROAD else v
    possible = False
    for side in (LEFT, RIGHT):
        aside = road[i, side]
        # On a fast road a moving vehicle is not passed on the right.
        if aside == 0.0 or (side == RIGHT and w > 0.0 and road[i, LIMIT] > FAST_ROAD):
            continue
        if lane_lasts(road, n, ds, s, side, aside) < home:
            continue
        possible = True
        length = shift_length(aside, v, friction_limit)
        other, _ = slow_ahead(around, tracks, s, front, half_width, aside, pace)
        if (
            (other < 0 or around[other, AT] - around[other, HALF_LENGTH] > home)
            and passes_round(around, slow, s, v, front, half_width, (0.0, aside, s, length))
            and is_free(around, tracks, s, past, front, rear, half_width, aside, seen, fastest)
        ):
            begin(mind, aside, s, length)
            return math.inf
    if possible and w == 0.0:
        return max(stop_for(gap - WAIT_AT, v), -COMFORT_DECELERATION)
    return math.inf
