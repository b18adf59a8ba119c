"""Oncoming left turns: two come from opposite directions, and one turns across the other's path."""

from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import Events
from bridgegen.recordings.events.meetings import (
    CROSSING,
    OPPOSITE,
    STRAIGHT,
    Meeting,
    events_of_meetings,
    meetings,
)
from bridgegen.recordings.events.scene import Scene

TURNS = 20.0
"""Least turn angle of the one that turns off, which turns more than the other [deg]: the rest may
be cut off."""


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the oncoming left turns of a recording, from both views."""
    met = [
        meeting
        for meeting in meetings(scene, scene.is_ego, scene.is_ego)
        if CROSSING[0] <= meeting.angle <= CROSSING[1]
        and meeting.approach_angle >= OPPOSITE
        and max(abs(meeting.ego_turn), abs(meeting.other_turn)) > TURNS
        and min(abs(meeting.ego_turn), abs(meeting.other_turn)) <= STRAIGHT
    ]
    return events_of_meetings("oncoming-left-turn", scene, met, _turn)


def _turn(meeting: Meeting) -> dict[str, float]:
    ego_turns = abs(meeting.ego_turn) > abs(meeting.other_turn)
    return {
        "ego_turns": float(ego_turns),
        "turn": abs(meeting.ego_turn if ego_turns else meeting.other_turn),
    }
