"""Red-light violations: a vehicle passes the stop line of a lane whose light is red."""

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import NOT_WHOLE, Events, events_of
from bridgegen.recordings.events.meetings import AHEAD, LEAST_SEEN
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.events.stop_lines import LEAST_FOLLOWED, Passing
from bridgegen.recordings.readers.table import wrap

RED_FOR = 0.3
"""Time after the light has turned red within which who passes is not counted [s]."""
TURNS = 45.0
"""Least angle of a right turn [deg]."""
BEFORE, BEYOND = 5.0, 25.0
"""Path length before and after the stop line over which the turn angle is measured [m]."""
HALTS = 0.5
"""Speed below which who was slower within `AHEAD` before the line has stopped there [m/s]."""
JUNCTION = 60.0
"""Greatest path length from a stop line to where paths cross [m]."""
RIGHT_ON_RED = "it turns right after a stop, which is legal in places"


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the red-light violations of a recording."""
    ran = [passing for passing in scene.passings if red_time(scene, passing) > RED_FOR]
    ego = np.array([passing.who for passing in ran], np.int64)
    at = np.array([passing.at for passing in ran], np.float64)
    begin = np.maximum(at - AHEAD / scene.step, scene.clock.begin[ego])
    red = np.array([red_time(scene, passing) for passing in ran], np.float64)
    turned = at - red / scene.step
    seen = np.array(
        [
            passing.light.is_seen_to_turn_red(passing.light.red_since(passing.at * scene.step))
            for passing in ran
        ],
        np.bool_,
    )
    turn = np.array([_turn(scene, passing) for passing in ran], np.float64)
    least = np.array(
        [
            _least_speed(scene, who, a, b)
            for who, a, b in zip(ego.tolist(), begin.tolist(), at.tolist(), strict=True)
        ],
        np.float64,
    )
    return events_of(
        "red-light-violation",
        ego,
        {},
        (scene.seconds(begin), scene.seconds(at)),
        {
            "ego_speed": scene.at(scene.speed, ego, begin),
            "ego_distance": _ways(scene, ego, begin, at),
            "line_speed": scene.at(scene.speed, ego, at),
            "least_speed": least,
            "red_time": red,
            "red_seen": seen,
            "red_speed": np.where(seen, scene.at(scene.speed, ego, turned), np.nan),
            "red_distance": np.where(seen, _ways(scene, ego, turned, at), np.nan),
            "turn": turn,
        },
        {
            NOT_WHOLE: ((at - begin) * scene.step < LEAST_SEEN)
            | np.array([passing.followed < LEAST_FOLLOWED for passing in ran], np.bool_),
            RIGHT_ON_RED: (turn < -TURNS) & (least < HALTS),
        },
    )


def red_time(scene: Scene, passing: Passing) -> float:
    """Return for how long the light had been red [s]; NaN if it was not."""
    time = passing.at * scene.step
    return time - passing.light.red_since(time)


def ran_red(scene: Scene, who: int, at: float) -> float:
    """Return 1 if somebody has run a red light shortly before an instant, else 0.

    NaN where no light is recorded with its stop line.
    """
    if not any(len(light.path) for light in scene.traffic.facts.lights.values()):
        return np.nan
    return float(
        any(
            passing.who == who
            and passing.at <= at
            and red_time(scene, passing) > RED_FOR
            and scene.paths.length(who, at) - scene.paths.length(who, passing.at) <= JUNCTION
            for passing in scene.passings
        )
    )


def _ways(scene: Scene, who: Int, begin: Float, end: Float) -> Float:
    """Return lengths of paths between two instants [m]; NaN where one is not recorded."""
    found = np.full(len(who), np.nan)
    there = begin >= scene.clock.begin[who]
    for i in np.flatnonzero(there).tolist():
        p = int(who[i])
        found[i] = scene.paths.length(p, float(end[i])) - scene.paths.length(p, float(begin[i]))
    return found


def _turn(scene: Scene, passing: Passing) -> float:
    """Return by how much it turns at the junction, to the left positive [deg]."""
    length = scene.paths.length(passing.who, passing.at)
    before, after = (
        scene.paths.course(passing.who, max(length + way, 0.0)) for way in (-BEFORE, BEYOND)
    )
    return float(np.degrees(wrap(np.array([after - before]))[0]))


def _least_speed(scene: Scene, who: int, begin: float, end: float) -> float:
    low = int(np.ceil(begin)) - int(scene.clock.begin[who]) + int(scene.traffic.first[who])
    high = int(end) - int(scene.clock.begin[who]) + int(scene.traffic.first[who])
    return float(scene.speed[low : high + 1].min())
