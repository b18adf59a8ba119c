"""Cut-outs: the ego's leader leaves the lane, and reveals what is ahead of it."""

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


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the cut-outs of a recording."""
    state = scene.follower[changes.state - 1]
    ego = np.where(state >= 0, scene.participant[state], ABSENT)
    picked = np.flatnonzero((state >= 0) & scene.is_ego[ego])
    ego, lead = ego[picked], changes.who[picked]
    begin, end = changes.begin[picked], changes.end[picked]
    after = scene.state(ego, changes.crossing[picked])
    revealed = np.where(after >= 0, scene.leader[after], ABSENT)
    gap = scene.gap(ego, lead, begin)
    revealed_gap = scene.gap(lead, revealed, begin)
    duration = (end - begin) * scene.step
    there = revealed >= 0
    return events_of(
        "cut-out",
        ego,
        {"lead": lead, "revealed": revealed},
        (scene.seconds(begin), scene.seconds(end)),
        {
            "ego_speed": scene.at(scene.speed, ego, begin),
            "lead_speed": scene.at(scene.speed, lead, begin),
            "gap": gap,
            "revealed_speed": np.where(there, scene.at(scene.speed, revealed, begin), np.nan),
            "revealed_gap": np.where(there, revealed_gap, np.nan),
            "change_time": duration,
            "lateral_speed": changes.move[picked] / duration,
            "side": -changes.side[picked],
            "lane_width": scene.lane_width(ego, begin),
            "lead_time": scene.led_time(ego, lead, begin),
        },
        {
            OVERLAP: (gap <= 0.0) | (there & (revealed_gap <= 0.0)),
            NO_CHANGE: ~changes.is_change[picked],
            NOT_WHOLE: ~changes.is_whole[picked]
            | (after < 0)
            | np.isnan(gap)
            | (there & np.isnan(revealed_gap)),
            EGO_CHANGES: changes.meanwhile(ego, begin, end),
            "the ego has had another leader": np.isnan(scene.led_time(ego, lead, begin)),
        },
    )
