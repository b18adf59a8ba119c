"""Where two vehicles come to one lane: by paths that join, or by lanes that do."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bridgegen.recordings.events.paths import WINDOW, Paths
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.readers.table import wrap

LOOK_BACK = 5.0
"""Before they join, where courses are compared [m]."""
LEAST_SHARED = 10.0
"""Length of the way that both go then [m]."""
MOST_SHARED = 15.0
"""Of it, from which its bend is taken [m]."""
ANGLES = (20.0, 150.0)
"""Between the courses before, of paths that join [deg]."""
CROSSES = 30.0
"""Paths that cross at this angle or more do not join [deg]."""


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
    for one, other, one_at, other_at, one_length, other_length, shared in zip(
        *columns, strict=True
    ):
        if shared < LEAST_SHARED or (one, other) in crossing:
            continue
        if abs(one_at - other_at) * scene.step > WINDOW:
            continue
        who, lengths = (one, other), (one_length, other_length)
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
        bend = np.mean([_degrees(b - a) for a, b in zip(middle, end, strict=True)]) / (0.5 * span)
        first = middle[0] + 0.5 * np.radians(_degrees(middle[1] - middle[0]))
        backwards = first - np.radians(bend) * (0.5 * span + LOOK_BACK)
        merging = int(abs(_degrees(before[1] - backwards)) > abs(_degrees(before[0] - backwards)))
        main = 1 - merging
        at = (one_at, other_at)
        yield Join(
            who[main], who[merging], at[main], at[merging], angle,
            _side(paths, who[main], lengths[main], who[merging], lengths[merging]),
            is_of_paths=True,
        )  # fmt: skip


def _crossing_pairs(scene: Scene) -> set[tuple[int, int]]:
    """Return the pairs whose paths cross at `CROSSES` or more."""
    paths, met, found = scene.paths, scene.crossings, set()
    for one, other, one_at, other_at in zip(
        met.one.tolist(), met.other.tolist(), met.one_at.tolist(), met.other_at.tolist(),
        strict=True,
    ):  # fmt: skip
        courses = [
            paths.course(who, paths.length(who, at))
            for who, at in ((one, one_at), (other, other_at))
        ]
        if CROSSES <= abs(_degrees(courses[1] - courses[0])) <= 180.0 - CROSSES:
            found.add((one, other))
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
