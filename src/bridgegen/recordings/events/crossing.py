"""Crossings: the ego goes straight on, and another motor vehicle crosses its path."""

from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import Events
from bridgegen.recordings.events.meetings import (
    CROSSING,
    OPPOSITE,
    STRAIGHT,
    Meeting,
    events_of_meetings,
    meetings,
    paces_of,
)
from bridgegen.recordings.events.red_light import ran_red
from bridgegen.recordings.events.scene import Scene


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the crossings of a recording; of two that go straight on, from both views."""
    met = [
        meeting
        for meeting in meetings(scene, scene.is_ego, scene.is_ego)
        if CROSSING[0] <= meeting.angle <= CROSSING[1]
        and meeting.approach_angle < OPPOSITE
        and abs(meeting.ego_turn) <= STRAIGHT
    ]
    paces = paces_of(scene, met)
    return events_of_meetings(
        "crossing", scene, met, lambda meeting: _more(scene, meeting) | paces[meeting]
    )


def _more(scene: Scene, meeting: Meeting) -> dict[str, float]:
    return {
        "other_turn": meeting.other_turn,
        "ego_ran_red": ran_red(scene, meeting.ego, meeting.ego_at),
        "other_ran_red": ran_red(scene, meeting.other, meeting.other_at),
    }
