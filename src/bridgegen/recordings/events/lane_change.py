"""Lane changes of the ego, and whom it overtakes by them."""

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import (
    ABSENT,
    NO_CHANGE,
    NOT_WHOLE,
    OVERLAP,
    Events,
    events_of,
)
from bridgegen.recordings.events.scene import Scene


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the lane changes of a recording."""
    picked = np.flatnonzero(scene.is_ego[changes.who])
    ego, state = changes.who[picked], changes.state[picked]
    begin, end, crossing = changes.begin[picked], changes.end[picked], changes.crossing[picked]
    whole = changes.is_whole[picked]
    before = scene.state(ego, begin)
    lead = np.where(before >= 0, scene.leader[before], ABSENT)
    ahead, behind = scene.ahead.state[state], scene.follower[state]
    gap = np.where(lead >= 0, scene.gap(ego, lead, begin), np.nan)
    new_gap = np.where(ahead >= 0, scene.ahead.gap[state], np.nan)
    back_gap = np.where(behind >= 0, scene.ahead.gap[behind], np.nan)
    duration = (end - begin) * scene.step
    return events_of(
        "lane-change",
        ego,
        {
            "lead": lead,
            "new_lead": np.where(ahead >= 0, scene.participant[ahead], ABSENT),
            "follower": np.where(behind >= 0, scene.participant[behind], ABSENT),
        },
        (scene.seconds(begin), scene.seconds(end)),
        {
            "ego_speed": scene.at(scene.speed, ego, begin),
            "lead_speed": np.where(lead >= 0, scene.at(scene.speed, lead, begin), np.nan),
            "gap": gap,
            "new_lead_speed": np.where(ahead >= 0, scene.speed[ahead], np.nan),
            "new_lead_gap": new_gap,
            "follower_speed": np.where(behind >= 0, scene.speed[behind], np.nan),
            "follower_gap": back_gap,
            "change_time": duration,
            "lateral_speed": changes.move[picked] / duration,
            "side": -changes.side[picked],
            "lane_width": scene.lane_width(ego, begin),
            "passing_time": _passing_time(scene, ego, lead, begin, crossing),
        },
        {
            OVERLAP: (gap <= 0.0) | (new_gap <= 0.0) | (back_gap <= 0.0),
            NO_CHANGE: ~changes.is_change[picked],
            NOT_WHOLE: ~whole,
        },
    )


def _passing_time(scene: Scene, ego: Int, lead: Int, begin: Float, crossing: Float) -> Float:
    """Return when the ego is level with its old leader, after the beginning [s]; NaN if never."""
    found = np.full(len(ego), np.nan)
    way, lane = scene.lanes.carriageway, scene.placed.lane
    for i in np.flatnonzero(lead >= 0).tolist():
        last = min(int(scene.clock.end[ego[i]]), int(scene.clock.end[lead[i]]))
        instants = np.arange(int(crossing[i]), last + 1, dtype=np.float64)
        if not len(instants):
            continue
        own = scene.state(np.full(len(instants), ego[i]), instants)
        other = scene.state(np.full(len(instants), lead[i]), instants)
        if other[0] < 0:
            continue
        same = scene.drives[own] & scene.drives[other] & (way[lane[own]] == way[lane[other]])
        level = same & (scene.placed.station[own] >= scene.placed.station[other])
        if level.any() and not level[0]:
            found[i] = (instants[int(level.argmax())] - begin[i]) * scene.step
    return found
