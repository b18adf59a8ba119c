"""Cut-ins: a vehicle changes into the ego's lane, closely before it."""

import numpy as np

from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import (
    ABSENT,
    EGO_CHANGES,
    NO_CHANGE,
    NOT_WHOLE,
    OVERLAP,
    Events,
    events_of,
)
from bridgegen.recordings.events.scene import Scene

FARTHEST = 150.0
"""Largest distance ahead of the ego at which the other crosses the line [m]."""


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the cut-ins of a recording."""
    state = scene.follower[changes.state]
    gap = np.where(state >= 0, scene.ahead.gap[state], np.inf)
    ego = np.where(state >= 0, scene.participant[state], ABSENT)
    near = (state >= 0) & scene.is_ego[ego] & (gap <= FARTHEST)
    picked = np.flatnonzero(near)
    ego, gap, other = ego[picked], gap[picked], changes.who[picked]
    begin, end = changes.begin[picked], changes.end[picked]
    at_begin = scene.gap(ego, other, begin)
    speed, other_speed = (scene.at(scene.speed, who, begin) for who in (ego, other))
    duration = (end - begin) * scene.step
    x, y = scene.traffic.x, scene.traffic.y
    dx = scene.at(x, other, begin) - scene.at(x, ego, begin)
    dy = scene.at(y, other, begin) - scene.at(y, ego, begin)
    own = scene.state(ego, begin)
    course = scene.traffic.heading[own] - np.asarray(scene.placed.heading, np.float64)[own]
    return events_of(
        "cut-in",
        ego,
        {"other": other},
        (scene.seconds(begin), scene.seconds(end)),
        {
            "ego_speed": speed,
            "other_speed": other_speed,
            "relative_speed": speed - other_speed,
            "gap": at_begin,
            "crossing_gap": gap,
            "lateral_distance": np.abs(dy * np.cos(course) - dx * np.sin(course)),
            "change_time": duration,
            "lateral_speed": changes.move[picked] / duration,
            "side": -changes.side[picked],
            "lane_width": scene.lane_width(ego, begin),
            "lead_time": scene.together(ego, other, begin),
        },
        {
            OVERLAP: gap <= 0.0,
            NO_CHANGE: ~changes.is_change[picked],
            NOT_WHOLE: ~changes.is_whole[picked] | np.isnan(at_begin),
            EGO_CHANGES: changes.meanwhile(ego, begin, end),
        },
    )
