"""Following: the ego keeps behind a leader at about its speed."""

import numpy as np

from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import OVERLAP, Events, events_of
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.events.steps import least_of, mean_of, runs_of

LONGEST_HEADWAY = 4.0
"""Largest headway that counts as following [s]."""
LEAST_SPEED = 1.0
"""Speed below which a vehicle stands and does not follow [m/s]."""
LARGEST_DIFFERENCE = 2.0
"""Largest speed difference that counts as following [m/s]."""
LEAST_TIME = 3.0
"""Least duration of following [s]."""


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return where the ego follows."""
    ahead, speed = scene.ahead, scene.speed
    lead_speed = np.where(ahead.state >= 0, speed[ahead.state], np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        headway = ahead.gap / speed
        follows = (speed >= LEAST_SPEED) & (headway <= LONGEST_HEADWAY)
        follows &= np.abs(speed - lead_speed) <= LARGEST_DIFFERENCE
    follows &= scene.is_ego[scene.participant]
    first, last = runs_of(scene, follows, round(LEAST_TIME / scene.step))
    ego, lead = scene.participant[first], scene.leader[first]
    begin = scene.clock.instant[first].astype(np.float64)
    end = scene.clock.instant[last].astype(np.float64)
    return events_of(
        "following",
        ego,
        {"lead": lead},
        (scene.seconds(begin), scene.seconds(end)),
        {
            "ego_speed": mean_of(speed, first, last),
            "lead_speed": mean_of(lead_speed, first, last),
            "gap": mean_of(ahead.gap, first, last),
            "headway": mean_of(headway, first, last),
            "least_headway": least_of(headway, first, last),
            "following_time": (end - begin) * scene.step,
            "lane_width": scene.lane_width(ego, begin),
        },
        {OVERLAP: least_of(ahead.gap, first, last) <= 0.0},
    )
