"""Where two vehicles come to one lane: by paths that join, or by lanes that do."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.paths import WINDOW, Paths
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.lanes.model import NONE, RecordedLanes
from bridgegen.recordings.readers.table import wrap

# At 10 m, who enters a small roundabout and who is in it differ by more than 120° already, for the
# ring bends.
LOOK_BACK = 5.0
"""Distance before two paths join at which courses are compared [m]."""
LEAST_SHARED = 10.0
"""Least length of the path that both share after they join [m]."""
MOST_SHARED = 15.0
"""Greatest length of the shared path from which its bend is taken [m]."""
ANGLES = (20.0, 150.0)
"""Angles between the courses before paths join [deg]."""
CROSSES = 30.0
"""Angle from which on paths cross rather than join [deg]."""


@dataclass(frozen=True)
class Join:
    """Two vehicles that come to one lane.

    Attributes:
        main: who is on it.
        merging: who comes into it.
        main_at: instant at which its centre passes the joining point.
        merging_at: instant at which the other's does.
        angle: between their courses before [deg], 0 to 180.
        side: from which side of the main one the other comes: 1 right, -1 left.
        lane_left: from the joining point to the end of the lane that ends [m]; NaN if none does.
        change_begin: instant at which the lane change begins; NaN if there is none.
        change_time: its duration [s].
        is_change: whether the path is that of a lane change that is recorded as a whole.
        is_of_paths: whether their paths show it, not their lanes.
    """

    main: int
    merging: int
    main_at: float
    merging_at: float
    angle: float
    side: float
    lane_left: float = np.nan
    change_begin: float = np.nan
    change_time: float = np.nan
    is_change: bool = True
    is_of_paths: bool = False


def path_joins(scene: Scene) -> Iterator[Join]:
    """Yield where paths join: the courses differ before, and are the same after.

    The one merges that has not come along the bend of the shared part, continued backwards.
    """
    paths, found = scene.paths, scene.joins
    crossing = _crossing_pairs(scene)
    columns = (values.tolist() for values in vars(found).values())
    for item, other, first_at, other_at, first_length, other_length, shared in zip(
        *columns, strict=True
    ):
        # Paths that cross are near one another for a while, too, and are no joining.
        if shared < LEAST_SHARED or (item, other) in crossing:
            continue
        if abs(first_at - other_at) * scene.step > WINDOW:
            continue
        who, lengths = (item, other), (first_length, other_length)
        before = [
            paths.course(p, max(length - LOOK_BACK, 0.0))
            for p, length in zip(who, lengths, strict=True)
        ]
        angle = abs(_degrees(before[1] - before[0]))
        span = min(shared, MOST_SHARED)
        middle, end = (
            [paths.course(p, length + way) for p, length in zip(who, lengths, strict=True)]
            for way in (0.5 * span, span)
        )
        if not ANGLES[0] <= angle <= ANGLES[1] or abs(_degrees(end[1] - end[0])) > ANGLES[0]:
            continue
        # Not "who turns more": in a roundabout that is who is in it. The bend of the shared part,
        # continued backwards, leads along the path of the one that was on it, in a ring as on a
        # straight road.
        bend = np.mean([_degrees(b - a) for a, b in zip(middle, end, strict=True)]) / (0.5 * span)
        first = middle[0] + 0.5 * np.radians(_degrees(middle[1] - middle[0]))
        backwards = first - np.radians(bend) * (0.5 * span + LOOK_BACK)
        merging = int(abs(_degrees(before[1] - backwards)) > abs(_degrees(before[0] - backwards)))
        main = 1 - merging
        at = (first_at, other_at)
        yield Join(
            who[main],
            who[merging],
            at[main],
            at[merging],
            angle,
            _side(paths, who[main], lengths[main], who[merging], lengths[merging]),
            is_of_paths=True,
        )


def _crossing_pairs(scene: Scene) -> set[tuple[int, int]]:
    """Return the pairs whose paths cross at `CROSSES` or more."""
    paths, met, found = scene.paths, scene.crossings, set()
    for item, other, first_at, other_at in zip(
        met.first.tolist(),
        met.other.tolist(),
        met.first_at.tolist(),
        met.other_at.tolist(),
        strict=True,
    ):
        courses = [
            paths.course(who, paths.length(who, at))
            for who, at in ((item, first_at), (other, other_at))
        ]
        if CROSSES <= abs(_degrees(courses[1] - courses[0])) <= 180.0 - CROSSES:
            found.add((item, other))
    return found


def _side(paths: Paths, main: int, main_length: float, merging: int, length: float) -> float:
    """Return 1 if the merging one comes from the right, -1 from the left."""
    x, y = paths.point(main, max(main_length - LOOK_BACK, 0.0))
    u, v = paths.point(merging, max(length - LOOK_BACK, 0.0))
    course = paths.course(main, main_length)
    return 1.0 if (v - y) * np.cos(course) - (u - x) * np.sin(course) < 0.0 else -1.0


def _degrees(angle: float) -> float:
    """Return an angle [rad] in (-180, 180] [deg]."""
    return float(np.degrees(wrap(np.array([angle]))[0]))


# --- Where vehicles come to one lane by their lanes: one that ends, or two that lead into one ---


FARTHEST_END = 400.0
"""Distance to a lane's end beyond which who leaves it changes lane, and does not merge [m]."""


def lane_joins(scene: Scene, changes: LaneChanges) -> Iterator[Join]:
    """Yield where vehicles leave a lane that ends, and where two lanes lead into one.

    Each with the vehicle ahead and the one behind in the other lane.
    """
    yield from _from_ending_lanes(scene, changes)
    yield from _of_two_lanes(scene)


def length_left(lanes: RecordedLanes, lane: int) -> float:
    """Return how far a lane leads from its beginning until it ends beside one that goes on [m].

    NaN where it goes on, forks, or where all lanes beside it end, too (the map does).
    """
    length, seen = 0.0, set[int]()
    while lane not in seen:
        seen.add(lane)
        ends = lanes.station[lanes.points(lane)]
        length += float(ends[-1] - ends[0])
        onward = lanes.successors[lane]
        if not onward:
            # Where all lanes end, the map does. A weaving lane between an entry and an exit does
            # not end, so it has lane changes and no mergings.
            beside = [int(array[lane]) for array in (lanes.left, lanes.right)]
            goes_on = any(number != NONE and lanes.successors[number] for number in beside)
            return length if goes_on else np.nan
        if len(onward) > 1 or length > FARTHEST_END:
            return np.nan
        lane = onward[0]
    return np.nan


def _from_ending_lanes(scene: Scene, changes: LaneChanges) -> Iterator[Join]:
    lanes, placed, step = scene.lanes, scene.placed, scene.step
    left_of = lru_cache(None)(lambda lane: length_left(lanes, lane))
    for i, state in enumerate(changes.state.tolist()):
        lane = int(placed.lane[state - 1])
        left = left_of(lane)
        if np.isnan(left):
            continue
        left -= float(placed.station[state] - lanes.station[lanes.points(lane)][0])
        merging, at = int(changes.who[i]), float(changes.crossing[i])
        if left > FARTHEST_END or not scene.is_ego[merging]:
            continue
        for beside in (int(scene.ahead.state[state]), int(scene.follower[state])):
            main = int(scene.participant[beside]) if beside != NONE else NONE
            if main == NONE or not scene.is_ego[main]:
                continue
            main_at = _passes(scene, main, int(placed.lane[state]), placed.station[state], at)
            if np.isfinite(main_at):
                yield Join(
                    main,
                    merging,
                    main_at,
                    at,
                    0.0,
                    float(changes.side[i]),
                    left,
                    float(changes.begin[i]),
                    float(changes.end[i] - changes.begin[i]) * step,
                    bool(changes.is_change[i] and changes.is_whole[i]),
                )


def _passes(scene: Scene, who: int, lane: int, station: float, near: float) -> float:
    """Return when a centre passes a station of a lane's carriageway, NaN if not within `WINDOW`."""
    clock, placed, way = scene.clock, scene.placed, scene.lanes.carriageway
    window = round(WINDOW / scene.step)
    low = max(round(near) - window, int(clock.begin[who]))
    high = min(round(near) + window, int(clock.end[who]))
    at = np.arange(low, high + 1) - int(clock.begin[who]) + int(scene.traffic.first[who])
    on = (placed.lane[at] != NONE) & (way[placed.lane[at]] == way[lane])
    stations = np.where(on, placed.station[at], np.nan)
    passes = np.flatnonzero((stations[:-1] < station) & (stations[1:] >= station))
    if not len(passes):
        return np.nan
    k = int(passes[-1])
    return low + k + float((station - stations[k]) / (stations[k + 1] - stations[k]))


def _of_two_lanes(scene: Scene) -> Iterator[Join]:
    """Yield who comes to a lane from a lane other than the one before or after it did."""
    lanes, lane, who = scene.lanes, scene.placed.lane.astype(np.int64), scene.participant
    led = np.zeros(len(lanes), np.int64)
    for number, onward in enumerate(lanes.successors):
        if lanes.kinds[number] == "driving":
            led[list(onward)] += 1
    moves = (lane[1:] != lane[:-1]) & (who[1:] == who[:-1]) & scene.drives[1:] & scene.drives[:-1]
    steps = np.flatnonzero(moves & scene.is_ego[who[1:]])
    onto = [
        led[b] > 1 and b in lanes.successors[a]
        for a, b in zip(lane[steps].tolist(), lane[steps + 1].tolist(), strict=True)
    ]
    steps = steps[np.array(onto, np.bool_)]
    instant = _entered(scene, steps)
    # By lane and time, so that two that follow one another into a lane are neighbours.
    order = np.lexsort((instant, lane[steps + 1]))
    for i, j in zip(order[:-1].tolist(), order[1:].tolist(), strict=True):
        a, b = int(steps[i]), int(steps[j])
        if lane[a + 1] != lane[b + 1] or lane[a] == lane[b]:
            continue
        if (instant[j] - instant[i]) * scene.step > WINDOW:
            continue
        main, merging = (i, j) if _is_main(lanes, lane[a], lane[b], lane[a + 1]) else (j, i)
        heading = scene.lanes.heading
        before = [float(heading[lanes.points(int(lane[steps[k]]))][0]) for k in (main, merging)]
        turned = float(np.remainder(before[1] - before[0] + np.pi, 2.0 * np.pi) - np.pi)
        yield Join(
            int(who[steps[main]]),
            int(who[steps[merging]]),
            float(instant[main]),
            float(instant[merging]),
            abs(float(np.degrees(turned))),
            1.0 if turned > 0.0 else -1.0,
        )


def _entered(scene: Scene, steps: Int) -> Float:
    """Return when centres pass the beginning of the lane on which they are a state later."""
    lanes, placed = scene.lanes, scene.placed
    begin = lanes.station[lanes.first[placed.lane[steps + 1]]]
    beyond = placed.station[steps + 1] - begin
    speed = np.maximum(np.asarray(placed.along, np.float64)[steps + 1] * scene.step, 1e-6)
    back = np.clip(beyond / speed, 0.0, 1.0)
    return scene.clock.instant[steps + 1] - back


def _is_main(lanes: RecordedLanes, number: int, other: int, onward: int) -> bool:
    """Return whether the first of two lanes is the one that goes on, and the other joins it."""
    same = [bool(lanes.carriageway[lane] == lanes.carriageway[onward]) for lane in (number, other)]
    if same[0] != same[1]:
        return same[0]
    turns = [_turn(lanes, lane) for lane in (number, other)]
    return turns[0] <= turns[1]


def _turn(lanes: RecordedLanes, lane: int) -> float:
    heading = np.unwrap(lanes.heading[lanes.points(lane)])
    return abs(float(heading[-1] - heading[0]))
