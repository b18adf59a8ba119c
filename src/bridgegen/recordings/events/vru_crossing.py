"""A pedestrian or a bicycle crosses the ego's path ahead of it, perhaps out of hiding."""

import numpy as np

from bridgegen.drivers.kinds import BICYCLE, PEDESTRIAN
from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import Events
from bridgegen.recordings.events.meetings import Meeting, events_of_meetings, meetings
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.events.sight import Hiding, hiding

WALKING = (45.0, 135.0)
"""Angles at which the path of a pedestrian crosses the ego's [deg]."""
RIDING = (20.0, 160.0)
"""Likewise of a bicycle: who turns off crosses its path before having turned far."""


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return who crosses an ego's path on foot or by bicycle, before the ego comes."""
    kind = scene.traffic.kind
    met = [
        one for one in meetings(scene, scene.is_ego, np.isin(kind, (PEDESTRIAN, BICYCLE)))
        if one.other_at < one.ego_at and _crosses(one, int(kind[one.other]))
    ]  # fmt: skip
    hidden = {one: hiding(scene, one) for one in met}
    return events_of_meetings(
        "vru-crossing", scene, met, lambda one: _more(one, int(kind[one.other]), hidden[one]),
        {"occluder": [hidden[one].by for one in met]},
    )  # fmt: skip


def _crosses(one: Meeting, kind: int) -> bool:
    low, high = WALKING if kind == PEDESTRIAN else RIDING
    return low <= one.angle <= high


def _more(one: Meeting, kind: int, hidden: Hiding) -> dict[str, float]:
    return {
        "ego_turn": one.ego_turn, "is_bicycle": float(kind == BICYCLE),
        "hidden": float(hidden.is_hidden), "occluder_gap": hidden.gap,
    }  # fmt: skip
