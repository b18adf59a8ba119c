"""The observation of MetaDrive's PPO expert, of ours: 275 numbers in [0, 1].

Source: metadrive-simulator 0.4.3, ``obs/state_obs.py`` (definition and scales),
``examples/ppo_expert/numpy_expert.py`` (240 beams of 50 m, four others, the two numbers that it
turns round), ``navigation_module/node_network_navigation.py`` (checkpoints).

| numbers | what they are |
|---|---|
| 0, 1 | distance to the left and right border of the carriageway / 18 m |
| 2 | sine of the lane's heading seen from the ego |
| 3 | (speed + 1 km/h) / 81 km/h |
| 4 | (steering of the last action / 60 + 1) / 2 |
| 5, 6 | the last action: steering, throttle |
| 7 | angle turned in the last 0.1 s / 0.1 |
| 8 | offset to the right of the lane's centre / 4.5 m, 0.5 in the centre |
| 9 … 13 | the end of this section of the road: ahead, to the left (50 m); its bend |
| 14 … 18 | the same of the next section |
| 19 … 34 | four vehicles, the nearest first: ahead, left (50 m), speed ahead, left (80 km/h) |
| 35 … 274 | the beams, counter-clockwise from straight ahead: distance / 50 m |

What is given where our world has no such thing: MetaDrive's roads consist of straights and arcs;
here, a section ends where the curvature of the route passes 1/300 1/m or changes its sign. The
carriageway is the lanes of the ego's direction beside it, three at most, as `Lanes` gives them
(and as MetaDrive's roads have them). There is no last section: a route goes straight on.
"""

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.drivers.interface import ROUTE_STEP, Lanes, Observation
from bridgegen.drivers.kinds import BUS, CAR, TRUCK

SIZE, STATE, OTHERS, BEAMS = 275, 19, 4, 240
"""Numbers of an observation; those before the other vehicles; vehicles; beams."""

REACH = 50.0  # m, of beams, others and checkpoints
TOP_SPEED = 80.0  # km/h, at which the vehicle's engine gives no more
ROAD_WIDTH = 4 * 4.5  # m, four lanes of the widest kind
WIDEST_LANE = 4.5  # m
STEERING_SCALE = 60.0
BEND_RADIUS, BEND_ANGLE = 60.0, np.radians(135.0)  # the greatest of its block "curve"
DECISION = 0.1  # s

STRAIGHT = 1.0 / 300.0  # 1/m; ours: less bent is straight
CONFIRMED = 2.0  # the least state of a track that counts

_BEAM = np.arange(BEAMS) * (2.0 * np.pi / BEAMS)


def observed(
    o: Observation, centre: float, turned: Float, last_heading: Float, last_action: Float
) -> Float:
    """Return the observations ``(N, SIZE)``, rounded to float32 as MetaDrive's are.

    Args:
        o: with `Lanes`.
        centre: of the ego's body, ahead of its reference point [m].
        turned: ``(N,)`` [rad], the angle of the present bend that lies behind the ego, ≥ 0.
        last_heading: ``(N,)`` [rad], at the last decision.
        last_action: ``(N, 2)``, steering and throttle of the last decision.
    """
    assert o.lanes is not None  # the driver wants them
    x, y = o.x + centre * np.cos(o.h), o.y + centre * np.sin(o.h)
    out = np.zeros((len(x), SIZE))
    out[:, :9] = _ego(o, o.lanes, centre, x, y, last_heading, last_action)
    out[:, 9:STATE] = _sections(o, o.lanes, x, y, turned)
    out[:, STATE : STATE + 4 * OTHERS] = _others(o, x, y)
    out[:, STATE + 4 * OTHERS :] = beams(x, y, o.h, o.tracks)
    return np.clip(out, 0.0, 1.0).astype(np.float32).astype(np.float64)


def _ego(
    o: Observation,
    lanes: Lanes,
    centre: float,
    x: Float,
    y: Float,
    last_heading: Float,
    last_action: Float,
) -> Float:
    """Return the first nine numbers, of the ego and its lane."""
    rx, ry, rh = _route_at(o, centre)
    left = (y - ry) * np.cos(rh) - (x - rx) * np.sin(rh)  # m, of the route
    centres, widths, there = _same_way(lanes)
    n_lanes = there.sum(axis=1)
    away = np.where(there, np.abs(centres - left[:, None]), np.inf)
    lane = away.argmin(axis=1)
    width = np.take_along_axis(widths, lane[:, None], 1)[:, 0]
    own = np.take_along_axis(centres, lane[:, None], 1)[:, 0]
    to_left = leftmost(centres, there) - left + width / 2
    to_right = n_lanes * width - to_left
    turn = np.arccos(np.clip(np.cos(o.h - last_heading), 0.0, 1.0))
    return np.stack(
        [
            to_left / ROAD_WIDTH,
            to_right / ROAD_WIDTH,
            np.sin(rh - o.h) / 2 + 0.5,
            (o.v * 3.6 + 1.0) / (TOP_SPEED + 1.0),
            (last_action[:, 0] / STEERING_SCALE + 1.0) / 2,
            (last_action[:, 0] + 1.0) / 2,
            (last_action[:, 1] + 1.0) / 2,
            turn / DECISION,
            ((own - left) * 2 / WIDEST_LANE + 1.0) / 2,
        ],
        axis=1,
    )


def _same_way(lanes: Lanes) -> tuple[Float, Float, Bool]:
    """Return centre [m, left of the route], width [m] and existence of three lanes beside the ego.

    From the left, ``(N, 3)`` each: the one on the left, the route's own, the one on the right.
    """
    beside = lanes.beside[:, 0]
    none = np.zeros(len(beside))
    centres = np.stack([beside[:, 0, 0], none, beside[:, 1, 0]], axis=1)
    widths = np.stack([beside[:, 0, 1], lanes.width[:, 0], beside[:, 1, 1]], axis=1)
    there = np.stack([beside[:, 0, 2] > 0.5, none == 0.0, beside[:, 1, 2] > 0.5], axis=1)
    return np.where(there, centres, 0.0), np.where(there, widths, 0.0), there


def leftmost(centres: Float, there: Bool) -> Float:
    """Return the centre of the leftmost lane [m, left of the route], ``(N,)``."""
    return np.where(there[:, 0], centres[:, 0], 0.0)


def _route_at(o: Observation, s: float) -> tuple[Float, Float, Float]:
    """Return x, y and heading of the route s [m] ahead of the point beside the ego."""
    k = min(int(s / ROUTE_STEP), o.route.shape[1] - 1)
    point, rest = o.route[:, k], s - k * ROUTE_STEP
    h = point[:, 2] + rest * point[:, 3] / 2
    return (
        point[:, 0] + rest * np.cos(h),
        point[:, 1] + rest * np.sin(h),
        h + rest * point[:, 3] / 2,
    )


def bends(route: Float) -> tuple[Int, Int, Int]:
    """Return of routes ``(N, P, 4)`` the first section's direction and where both sections end.

    Returns:
        ``(N,)`` each: 1 bent to the left, -1 to the right, 0 straight, at the second point, which
        is beside the body; the index of the last point of that section; of the next section.
    """
    bent = np.sign(route[:, :, 3]) * (np.abs(route[:, :, 3]) >= STRAIGHT)
    points = np.arange(bent.shape[1])
    last = bent.shape[1] - 1
    differs = (bent != bent[:, 1:2]) & (points >= 1)
    first = np.where(differs.any(axis=1), differs.argmax(axis=1), last)
    after = np.take_along_axis(bent, first[:, None], 1)
    differs = (bent != after) & (points > first[:, None])
    second = np.where(differs.any(axis=1), differs.argmax(axis=1), last)
    return bent[:, 1].astype(np.int64), first, second


def _sections(o: Observation, lanes: Lanes, x: Float, y: Float, turned: Float) -> Float:
    """Return ten numbers of this section and the next: its end and its bend."""
    _, first, second = bends(o.route)
    centres, widths, there = _same_way(lanes)
    most_left = leftmost(centres, there)
    middle = (most_left + np.where(there[:, 2], centres[:, 2], 0.0)) / 2
    total = (widths * there)[:, 0] + widths[:, 1] + (widths * there)[:, 2]
    c, s = np.cos(o.h), np.sin(o.h)
    rows = np.arange(len(x))
    curvature = np.cumsum(o.route[:, :, 3], axis=1)
    starts = np.ones_like(first)
    out = np.zeros((len(x), 10))
    for at, begin, end, passed in ((0, starts, first, turned), (5, first, second, 0.0)):
        px, py, ph, _ = o.route[rows, end].T
        dx = px - middle * np.sin(ph) - x
        dy = py + middle * np.cos(ph) - y
        scale = REACH / np.maximum(np.hypot(dx, dy), REACH)
        out[:, at] = (scale * (dx * c + dy * s) / REACH + 1.0) / 2
        out[:, at + 1] = (scale * (dy * c - dx * s) / REACH + 1.0) / 2  # to the left
        n_points = end - begin
        bend = curvature[rows, end - 1] - curvature[rows, begin - 1]  # 1/m, their sum
        is_bent = (np.abs(o.route[rows, begin, 3]) >= STRAIGHT) & (n_points > 0)
        mean = np.where(is_bent, bend / np.maximum(n_points, 1), 0.0)
        side = np.sign(mean)
        radius = 1.0 / np.maximum(np.abs(mean), 1e-9) - side * most_left  # of the leftmost lane
        angle = np.abs(bend) * ROUTE_STEP + passed
        out[:, at + 2] = np.where(is_bent, radius / (BEND_RADIUS + total), 0.0)
        out[:, at + 3] = (1.0 - side) / 2  # 1: to the right
        out[:, at + 4] = np.where(is_bent, (angle / BEND_ANGLE + 1.0) / 2, 0.5)
    return out


def _others(o: Observation, x: Float, y: Float) -> Float:
    """Return sixteen numbers of the four nearest vehicles within reach; 0 where there are fewer."""
    t = o.tracks
    c, s = np.cos(o.h)[:, None], np.sin(o.h)[:, None]
    dx, dy = t[:, :, 1] - x[:, None], t[:, :, 2] - y[:, None]
    vx, vy = (t[:, :, 4] - o.v[:, None] * c) * 3.6, (t[:, :, 5] - o.v[:, None] * s) * 3.6
    is_vehicle = np.isin(t[:, :, 8], (CAR, TRUCK, BUS)) & (t[:, :, 0] >= CONFIRMED)
    is_vehicle &= _clearance(t, x, y) <= REACH
    distance = np.where(is_vehicle, np.hypot(dx, dy), np.inf)
    features = np.stack(
        [
            ((dx * c + dy * s) / REACH + 1.0) / 2,
            ((dy * c - dx * s) / REACH + 1.0) / 2,
            ((vx * c + vy * s) / TOP_SPEED + 1.0) / 2,
            ((vy * c - vx * s) / TOP_SPEED + 1.0) / 2,
        ],
        axis=2,
    )
    features = np.where(is_vehicle[:, :, None], np.clip(features, 0.0, 1.0), 0.0)
    nearest = np.argsort(distance, axis=1, kind="stable")[:, :OTHERS]
    features = np.take_along_axis(features, nearest[:, :, None], axis=1)
    out = np.zeros((len(x), OTHERS, 4))
    out[:, : features.shape[1]] = features
    return out.reshape(len(x), 4 * OTHERS)


def _clearance(tracks: Float, x: Float, y: Float) -> Float:
    """Return the distance of points from the boxes of tracks [m], ``(N, M)``; 0 inside."""
    c, s = np.cos(tracks[:, :, 3]), np.sin(tracks[:, :, 3])
    dx, dy = x[:, None] - tracks[:, :, 1], y[:, None] - tracks[:, :, 2]
    along = np.abs(dx * c + dy * s) - tracks[:, :, 6] / 2
    across = np.abs(dy * c - dx * s) - tracks[:, :, 7] / 2
    return np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))


def beams(x: Float, y: Float, h: Float, tracks: Float) -> Float:
    """Cast ``BEAMS`` rays from points, against the boxes of confirmed tracks.

    Args:
        x: ``(N,)`` [m].
        y: ``(N,)`` [m].
        h: ``(N,)`` [rad], direction of the first ray; the others follow counter-clockwise.
        tracks: ``(N, M, 13)``, see `Observation`.

    Returns:
        ``(N, BEAMS)``, distance / 50 m to the nearest box; 1 where there is none, or where the
        point is inside of it.
    """
    out = np.ones((len(x), BEAMS))
    near = (tracks[:, :, 0] >= CONFIRMED) & (_clearance(tracks, x, y) <= REACH)
    for m in range(tracks.shape[1]):
        rows = np.flatnonzero(near[:, m])
        if len(rows):
            box = tracks[rows, m]
            out[rows] = np.minimum(out[rows], _cast(x[rows], y[rows], h[rows], box))
    return out


def _cast(x: Float, y: Float, h: Float, boxes: Float) -> Float:
    """Return where rays enter one box of each row, as a share of their reach; 1 where not."""
    c, s = np.cos(boxes[:, 3]), np.sin(boxes[:, 3])
    dx, dy = x - boxes[:, 1], y - boxes[:, 2]
    angle = (h - boxes[:, 3])[:, None] + _BEAM
    enters, leaves = np.full(angle.shape, -np.inf), np.full(angle.shape, np.inf)
    for start, direction, half in (
        (dx * c + dy * s, np.cos(angle), boxes[:, 6] / 2),
        (dy * c - dx * s, np.sin(angle), boxes[:, 7] / 2),
    ):
        direction = np.where(np.abs(direction) < 1e-12, 1e-12, direction)
        array = (-half - start)[:, None] / direction
        other = (half - start)[:, None] / direction
        enters = np.maximum(enters, np.minimum(array, other))
        leaves = np.minimum(leaves, np.maximum(array, other))
    hits = (enters <= leaves) & (enters >= 0.0)
    return np.where(hits, np.minimum(enters / REACH, 1.0), 1.0)
