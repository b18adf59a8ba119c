"""Right turns with a bicycle: it goes straight on, on the right of an ego that turns right."""

import numpy as np

from bridgegen.drivers.kinds import BICYCLE
from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import Events
from bridgegen.recordings.events.meetings import (
    STRAIGHT,
    Meeting,
    events_of_meetings,
    meetings,
    paces_of,
)
from bridgegen.recordings.events.scene import Scene

TURNS = 45.0
"""Least angle of the ego's right turn [deg]."""
SAME_WAY = 45.0
"""Largest angle between their courses before [deg]."""
ANGLES = (15.0, 160.0)
"""Angles between their courses where they cross [deg]; flat where the turn has just begun."""


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the right turns of a recording across the path of a bicycle."""
    met = [
        meeting
        for meeting in meetings(scene, scene.is_ego, scene.traffic.kind == BICYCLE)
        if meeting.ego_turn < -TURNS
        and abs(meeting.other_turn) <= STRAIGHT
        and meeting.approach_angle <= SAME_WAY
        and ANGLES[0] <= meeting.angle <= ANGLES[1]
    ]
    paces = paces_of(scene, met)
    return events_of_meetings(
        "right-turn-with-bicycle",
        scene,
        met,
        lambda meeting: _more(scene, meeting) | paces[meeting],
    )


def _more(scene: Scene, meeting: Meeting) -> dict[str, float]:
    """Return the quantities that only these have; places hold at the beginning."""
    who, at = np.array([meeting.ego, meeting.other]), np.full(2, meeting.begin)
    x, y = (scene.at(values, who, at) for values in (scene.traffic.x, scene.traffic.y))
    course = scene.paths.course(meeting.ego, scene.paths.length(meeting.ego, meeting.begin))
    dx, dy = float(x[1] - x[0]), float(y[1] - y[0])
    return {
        "ego_turn": meeting.ego_turn,
        "ahead": dx * np.cos(course) + dy * np.sin(course),
        "aside": dx * np.sin(course) - dy * np.cos(course),
    }
