"""Who passes the stop line of a traffic light."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from bridgegen.base.arrays import Bool, Float
from bridgegen.recordings.events.paths import Paths
from bridgegen.recordings.readers.table import RecordedLight

BESIDE = 1.75
"""Lateral distance from a lane's middle within which a vehicle's front passes the stop line [m]."""
ASKEW = np.radians(45.0)
"""Largest angle between a vehicle's heading and the lane's direction at the stop line [rad]."""
LOOKED = 12.0
"""Distance from a stop line within which a path must come to pass it [m]."""
FOLLOWED = 20.0
"""Length of a lane beyond its stop line along which a vehicle's path is compared with it [m]."""
LEAST_FOLLOWED = 10.0
"""Least recorded path length beyond a stop line [m]."""
OFF_LANE = 2.0
"""Distance from the lane's middle beyond the line from which on a vehicle takes another lane
[m]."""
SAME_LINE = 2.0
"""Largest time between two passings of one vehicle over the lines of several lights that are one
[s]."""


@dataclass(frozen=True)
class Passing:
    """A vehicle's front passes a stop line.

    Attributes:
        who: participant.
        at: instant.
        light: the light of the lane that it takes.
        off: how far it is from the middle of that lane beyond the line, at its farthest [m].
        followed: how far its path is recorded beyond the line [m].
    """

    who: int
    at: float
    light: RecordedLight
    off: float
    followed: float


def passings(paths: Paths, is_ego: Bool) -> list[Passing]:
    """Return who passes the stop lines of traffic lights, by participant and time.

    Args:
        paths: of a recording.
        is_ego: ``(P,)`` of whom it is looked for.
    """
    traffic = paths.traffic
    lights = [
        recorded_light
        for recorded_light in traffic.facts.lights.values()
        if len(recorded_light.path) >= 2
    ]
    who = traffic.participant[paths.vertices]
    looked = (is_ego & paths.clock.is_whole)[who]
    vertices, who = paths.vertices[looked], who[looked]
    if not lights or not len(who):
        return []
    tree = KDTree(np.column_stack([traffic.x[vertices], traffic.y[vertices]]))
    found = list[Passing]()
    for light in lights:
        near = np.array(tree.query_ball_point(light.path[0], LOOKED), np.int64)
        for item in np.unique(who[near]).tolist():
            found += _passings_of(paths, item, light)
    return list(_taken(found, SAME_LINE / traffic.facts.time_step))


def _passings_of(paths: Paths, who: int, light: RecordedLight) -> Iterator[Passing]:
    traffic = paths.traffic
    states = slice(int(traffic.first[who]), int(traffic.first[who + 1]))
    heading = traffic.heading[states]
    stop, onward = light.path[0], light.path[1] - light.path[0]
    course = onward / np.hypot(*onward)
    heads = np.column_stack([np.cos(heading), np.sin(heading)])
    centre = np.column_stack([traffic.x[states], traffic.y[states]])
    front = centre + 0.5 * traffic.length[who] * heads - stop
    along, aside = front @ course, front @ np.array([-course[1], course[0]])
    beyond = (centre - stop) @ course >= 0.0
    passes = (along[:-1] < 0.0) & (along[1:] >= 0.0) & (np.abs(aside[1:]) <= BESIDE)
    passes &= heads[1:] @ course >= np.cos(ASKEW)
    for k in np.flatnonzero(passes).tolist():
        share = float(along[k] / (along[k] - along[k + 1]))
        over = k + 1 + int(beyond[k + 1 :].argmax())
        off, followed = _off_lane(centre[over:], light.path)
        if off <= OFF_LANE:
            yield Passing(who, float(paths.clock.begin[who]) + k + share, light, off, followed)


def _off_lane(track: Float, path: Float) -> tuple[float, float]:
    """Return how far a track is from a lane's middle at its farthest, and how long it is [m].

    Only its part beside what of the lane is known, and `FOLLOWED`, is looked at.
    """
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(track, axis=0).T))])
    last = int(np.searchsorted(way, FOLLOWED, side="right"))
    station = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    wanted = np.arange(0.0, min(station[-1], FOLLOWED) + 0.5, 0.5)
    lane = np.column_stack([np.interp(wanted, station, path[:, i]) for i in range(2)])
    beside = track[: max(last, 1)][way[: max(last, 1)] <= station[-1]]
    apart = np.hypot(*np.moveaxis(beside[:, None] - lane, -1, 0)).min(axis=1)
    return float(apart.max(initial=0.0)), float(way[-1])


def _taken(found: list[Passing], together: float) -> Iterator[Passing]:
    """Yield of passings over the lines of several lights that of the lane which is taken."""
    group: list[Passing] = []
    for passing in sorted(found, key=lambda passing: (passing.who, passing.at)):
        if group and (passing.who != group[0].who or passing.at - group[0].at > together):
            yield min(group, key=lambda passing: passing.off)
            group = []
        group.append(passing)
    if group:
        yield min(group, key=lambda passing: passing.off)
