"""Approaches: the ego comes nearer to a slower or standing leader."""

import numpy as np

from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import OVERLAP, Events, events_of
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.events.steps import least_of, runs_of

LEAST_CLOSING = 2.0
"""Least closing speed of an approach [m/s]."""
HORIZON = 10.0
"""Largest time to collision at present speeds of an approach [s]."""
LEAST_TIME = 0.5
"""Least duration of an approach [s]."""
STEADY = 1.0
"""Largest acceleration and deceleration of the leader at the beginning [m/s²]."""


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the approaches of a recording; of one leader, the first."""
    ahead = scene.ahead
    closing = np.where(ahead.state >= 0, scene.speed - scene.speed[ahead.state], 0.0)
    near = (closing >= LEAST_CLOSING) & (ahead.gap <= HORIZON * closing)
    near &= scene.is_ego[scene.participant]
    first, last = runs_of(scene, near, round(LEAST_TIME / scene.step))
    first, last = first[scene.leader[first] >= 0], last[scene.leader[first] >= 0]
    _, once = np.unique(scene.led_since[first], return_index=True)
    first, last = first[once], last[once]
    lead_state = ahead.state[first]
    steady = np.abs(scene.acceleration[lead_state]) <= STEADY
    first, last, lead_state = first[steady], last[steady], lead_state[steady]
    ego, lead = scene.participant[first], scene.participant[lead_state]
    begin = scene.clock.instant[first].astype(np.float64)
    end = scene.clock.instant[last].astype(np.float64)
    return events_of(
        "approach",
        ego,
        {"lead": lead},
        (scene.seconds(begin), scene.seconds(end)),
        {
            "ego_speed": scene.speed[first],
            "lead_speed": scene.speed[lead_state],
            "relative_speed": scene.speed[first] - scene.speed[lead_state],
            "gap": ahead.gap[first],
            "lead_offset": scene.placed.offset[lead_state],
            "lane_width": scene.lane_width(ego, begin),
            "lead_time": scene.led_time(ego, lead, begin),
        },
        {OVERLAP: least_of(ahead.gap, first, last) <= 0.0},
    )
