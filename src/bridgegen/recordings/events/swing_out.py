"""Bicycles that swing out: ahead of the ego, from beside its path into it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter
from scipy.spatial import KDTree

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import BICYCLE
from bridgegen.recordings.events.changes import LONGEST, LaneChanges
from bridgegen.recordings.events.event import NO_CHANGE, NOT_WHOLE, Events, events_of
from bridgegen.recordings.events.obstacle import obstacle_ahead
from bridgegen.recordings.events.paths import WINDOW
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.events.steps import fit_steps
from bridgegen.recordings.readers.states import centre_ahead
from bridgegen.recordings.readers.table import wrap

FARTHEST = 90.0
"""Largest distance of the bicycle ahead of the ego [m]."""
EVERY = 0.5
"""Interval between the instants at which pairs near each other are sought [s]."""
ALONG = 30.0
"""Largest angle between the courses of ego and bicycle [deg]."""
SMOOTHED = 40.0
"""Distance before and after a point of the ego's path over which a parabola is fitted there [m]."""
SHORTEST_PATH = 20.0
"""Least length of an ego's path [m]."""
STRAIGHT = 30.0
"""Largest bend of the ego's path until it has passed the bicycle [deg]."""
PASSING_DISTANCE = 10.0
"""Distance beyond the bicycle at which passing ends [m]."""
BEYOND = 60.0
"""Length by which an ego's path is continued straight on at both ends [m]."""
LOOKBACK = 1.0
"""Time before an instant until which the ego's lateral position is the reference [s]: no evasion
yet."""
SPAN = 4.0
"""Time until `LOOKBACK` over which the ego's lateral position is averaged [s]."""
LEAST_MOVE = 0.5
"""Least lateral movement of the bicycle [m]."""
SHORTEST = 0.5
"""Least duration of the bicycle's lateral movement [s]."""
WORST_FIT = 0.15
"""Largest root mean square of the residual offset, as a share of the lateral movement."""
LEAST_SPEED = 1.0
"""Speed that slower egos count as [m/s]."""


@dataclass(frozen=True)
class _Pair:
    """A bicycle and an ego in one direction, from one instant to another.

    Attributes:
        ego: participant.
        other: participant.
        begin: first instant.
        apart: ``(n,)`` of the bicycle's centre from the ego's along its path [m], by instant.
        offset: ``(n,)`` of its reference point from the smoothed path [m], left positive.
        own: ``(n,)`` of the ego from it, averaged over `SPAN` until `LOOKBACK` [m].
    """

    ego: int
    other: int
    begin: int
    apart: Float
    offset: Float
    own: Float


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the bicycles of a recording that swing out before an ego."""
    near = _near(scene)
    lines = {ego: _smooth_line(scene, ego) for ego in sorted({ego for ego, _ in near})}
    pairs = [pair for ego, other in near for pair in _together(scene, ego, other, lines[ego])]
    lengths = np.array([len(item.offset) for item in pairs], np.int64)
    first = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    offsets = np.concatenate([np.empty(0), *(item.offset for item in pairs)])
    picked, guess = _guesses(scene, pairs, first)
    low, high = first[picked], first[picked + 1] - 1
    fit = fit_steps(offsets, low, high, guess, scene.step, "cosine")
    return _events(
        scene,
        [pairs[i] for i in picked.tolist()],
        low,
        high,
        np.array([fit.begin, fit.duration, fit.level, fit.height, fit.rms]),
    )


def _near(scene: Scene) -> list[tuple[int, int]]:
    """Return the pairs of an ego and a bicycle that are once near each other."""
    every = max(round(EVERY / scene.step), 1)
    seen = np.flatnonzero(
        (scene.clock.instant % every == 0) & scene.clock.is_whole[scene.participant]
    )
    who, traffic = scene.participant[seen], scene.traffic
    apart = scene.clock.instant[seen] * (2.0 * FARTHEST / every)
    points = np.column_stack([traffic.x[seen], traffic.y[seen], apart])
    egos, rides = scene.is_ego[who], traffic.kind[who] == BICYCLE
    if not egos.any() or not rides.any():
        return []
    near = KDTree(points[egos]).query_ball_point(points[rides], FARTHEST)
    pairs = {
        (int(item), other)
        for other, found in zip(who[rides].tolist(), near, strict=True)
        for item in who[egos][found]
    }
    return sorted(pairs)


def _together(scene: Scene, ego: int, other: int, line: Float | None) -> Iterator[_Pair]:
    """Yield the pair, where both are recorded, near each other and in the same direction."""
    clock, traffic = scene.clock, scene.traffic
    begin = int(max(clock.begin[ego], clock.begin[other]))
    end = int(min(clock.end[ego], clock.end[other]))
    if line is None or (end - begin) * scene.step < 2.0 * SHORTEST:
        return
    own, its = (
        slice(*(int(k - clock.begin[p] + traffic.first[p]) for k in (begin, end + 1)))
        for p in (ego, other)
    )
    ahead = centre_ahead(BICYCLE, float(traffic.length[other]))
    rear = np.column_stack(
        [traffic.x[its] - ahead * scene.cosine[its], traffic.y[its] - ahead * scene.sine[its]]
    )
    ego_way, ego_offset, _ = _beside(line, np.column_stack([traffic.x[own], traffic.y[own]]))
    way, offset, course = _beside(line, rear)
    turned = np.abs(wrap(traffic.heading[its] - course))
    apart, sums = way + ahead - ego_way, np.concatenate([[0.0], np.cumsum(ego_offset)])
    holds = (np.abs(apart) <= FARTHEST) & (turned <= np.radians(2.0 * ALONG))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], holds.astype(np.int8), [0]])))
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if (b - a) * scene.step >= 2.0 * SHORTEST:
            last = np.maximum(np.arange(a, b) - round(LOOKBACK / scene.step), 0)
            since = np.maximum(last - round(SPAN / scene.step), 0)
            own = (sums[last + 1] - sums[since]) / (last + 1 - since)
            yield _Pair(ego, other, begin + a, apart[a:b], offset[a:b], own)


def _smooth_line(scene: Scene, ego: int) -> Float | None:
    """Return a path each metre, smoothed and continued at both ends, ``(n, 2)`` [m]."""
    whole = scene.paths.length(ego, float(scene.clock.end[ego]))
    if whole < SHORTEST_PATH:
        return None
    wanted = np.arange(0.0, whole, 1.0)
    points = np.array([scene.paths.point(ego, float(float64)) for float64 in wanted])
    half = min(round(SMOOTHED), (len(points) - 1) // 2)
    line: Float = savgol_filter(points, 2 * half + 1, 2, axis=0)
    reach = min(round(0.5 * SMOOTHED), half)
    ahead, back = line[-1] - line[-1 - reach], line[0] - line[reach]
    return np.concatenate(
        [
            [line[0] + back / np.hypot(*back) * BEYOND],
            line,
            [line[-1] + ahead / np.hypot(*ahead) * BEYOND],
        ]
    )


def _beside(line: Float, points: Float) -> tuple[Float, Float, Float]:
    """Return where points are along a line, how far to its left [m], and its course there [rad]."""
    steps = np.diff(line, axis=0)
    length = np.hypot(*steps.T)
    way = np.concatenate([[0.0], np.cumsum(length)])
    _, near = KDTree(line).query(points)
    best = np.full((4, len(points)), np.inf)
    for shift in (-1, 0):
        k = np.clip(near + shift, 0, len(steps) - 1)
        along = ((points - line[k]) * steps[k]).sum(axis=1) / length[k]
        along = np.clip(along, 0.0, length[k])
        away = points - line[k] - along[:, None] * steps[k] / length[k][:, None]
        apart = np.hypot(*away.T)
        left = steps[k, 0] * away[:, 1] - steps[k, 1] * away[:, 0]
        course = np.arctan2(steps[k, 1], steps[k, 0])
        better = apart < best[0]
        best[:, better] = np.array([apart, way[k] + along, np.copysign(apart, left), course])[
            :, better
        ]
    return best[1], best[2], best[3]


def _guesses(scene: Scene, pairs: list[_Pair], first: Int) -> tuple[Int, tuple[Float, Float]]:
    """Return the pairs in which the bicycle comes from beside into the path, and a first guess."""
    picked, begin, duration = [], [], []
    half = max(round(SHORTEST / scene.step), 1)
    for i, pair in enumerate(pairs):
        offset = pair.offset - pair.own
        clear = np.abs(offset) > _half_widths(scene, pair)
        low, high = np.arange(len(clear)) - half, np.arange(len(clear)) + half
        inside = ~clear
        enters = np.flatnonzero(clear[:-1] & inside[1:])
        if not len(enters):
            continue
        slope = pair.offset[np.minimum(high, len(clear) - 1)] - pair.offset[np.maximum(low, 0)]
        towards = -slope * np.sign(offset)
        at = int(enters[int(towards[enters].argmax())])
        rate = max(float(towards[at]) / (2.0 * half), 1e-3)
        took = float(
            np.clip(0.5 * np.pi * 2.0 * LEAST_MOVE / rate, 2.0 * half, LONGEST / scene.step)
        )
        picked.append(i)
        begin.append(float(first[i]) + at - 0.5 * took)
        duration.append(took)
    return np.array(picked, np.int64), (np.array(begin), np.array(duration))


def _half_widths(scene: Scene, pair: _Pair) -> float:
    width = scene.traffic.width
    return 0.5 * float(width[pair.ego] + width[pair.other])


def _events(scene: Scene, pairs: list[_Pair], low: Int, high: Int, fit: Float) -> Events:
    begin, duration, level, height, rms = fit
    at = np.clip(begin, low, high)
    centres, own = (
        np.array(
            [
                np.interp(place - origin, np.arange(len(pair.apart)), getattr(pair, column))
                for place, origin, pair in zip(at.tolist(), low.tolist(), pairs, strict=True)
            ]
        )
        for column in ("apart", "own")
    )
    before, after = level - own, level + height - own
    near = np.array([_half_widths(scene, pair) for pair in pairs])
    moves = (np.abs(before) > near) & (np.abs(after) < near) & (np.abs(height) >= LEAST_MOVE)
    ego, other = (
        np.array([getattr(pair, key) for pair in pairs], np.int64) for key in ("ego", "other")
    )
    instant = np.array([pair.begin for pair in pairs], np.float64) - low
    length = scene.traffic.length
    gap = centres - 0.5 * (length[ego] + length[other])
    start = at + instant
    speed, its = (scene.at(scene.speed, who, start) for who in (ego, other))
    soon = (gap > 0.0) & (gap <= WINDOW * np.maximum(speed, LEAST_SPEED))
    seconds = duration * scene.step
    kept = np.array(
        [
            i
            for i in np.flatnonzero(moves & soon).tolist()
            if _bend(scene, int(ego[i]), float(start[i]), float(centres[i])) <= STRAIGHT
        ],
        np.int64,
    )
    standing = [obstacle_ahead(scene, int(other[i]), float(start[i])) for i in kept.tolist()]
    cut = SHORTEST / scene.step
    whole = (begin >= low - cut) & (begin + duration <= high + cut)
    fits = (rms <= WORST_FIT * np.abs(height)) & (seconds >= SHORTEST) & (seconds <= LONGEST)
    return events_of(
        "bicycle-swings-out",
        ego[kept],
        {
            "other": other[kept],
            "obstacle": np.array([obstacle.who for obstacle in standing], np.int64),
        },
        (scene.seconds(start[kept]), scene.seconds((start + duration)[kept])),
        {
            "ego_speed": speed[kept],
            "other_speed": its[kept],
            "relative_speed": (speed - its)[kept],
            "gap": gap[kept],
            "offset_before": before[kept],
            "offset_after": after[kept],
            "change_time": seconds[kept],
            "lateral_speed": np.abs(height / seconds)[kept],
            "side": -np.sign(before[kept]),
            "obstacle_gap": np.array([obstacle.gap for obstacle in standing], np.float64),
            "obstacle_apart": np.array([obstacle.apart for obstacle in standing], np.float64),
        },
        {NO_CHANGE: ~fits[kept], NOT_WHOLE: ~whole[kept]},
    )


def _bend(scene: Scene, ego: int, instant: float, ahead: float) -> float:
    """Return how far an ego's path bends until it is beyond something ahead of it [deg]."""
    length = scene.paths.length(ego, instant)
    a, b = (scene.paths.course(ego, length + way) for way in (0.0, ahead + PASSING_DISTANCE))
    return abs(float(np.degrees(wrap(np.array([b - a]))[0])))
