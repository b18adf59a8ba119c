"""A pedestrian or a bicycle crosses the ego's path ahead of it, perhaps out of hiding."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bridgegen.assess.conflict._geometry_kernels import extent, hidden
from bridgegen.assess.metrics.metric import motion
from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import BICYCLE, PEDESTRIAN
from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import ABSENT, Events
from bridgegen.recordings.events.meetings import Meeting, events_of_meetings, meetings
from bridgegen.recordings.events.pace import stands
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.excerpt import excerpt
from bridgegen.recordings.lanes.placing import WALKS

# --- Whether a vehicle that stands hid somebody from the ego, by the rule of the conflict analysis


LATELY = 2.0
"""Time before somebody crosses the ego's path in which an occlusion counts [s]."""
BESIDE = 10.0
"""Distance from the line of sight beyond which bodies hide nobody [m]."""


class Bodies(NamedTuple):
    """What the kernel of lines of sight looks at; see ``Scene`` of the conflict analysis.

    Attributes:
        half: ``(E, 2)`` [m].
        x, y: ``(E, T)`` centres [m].
        c, s: ``(E, T)`` of the headings.
        distance: ``(E, T)`` from the ego [m].
    """

    half: Float
    x: Float
    y: Float
    c: Float
    s: Float
    distance: Float


@dataclass(frozen=True)
class Hiding:
    """Whom the ego could not see.

    Attributes:
        by: the participant behind which the other was last; `ABSENT` for none.
        gap: along the ego's course, from where the other crosses to the nearest end of that one
            [m], ≥ 0; NaN for none.
    """

    by: int = ABSENT
    gap: float = np.nan

    @property
    def is_hidden(self) -> bool:
        """Whether the other was hidden."""
        return self.by != ABSENT


def hiding(scene: Scene, meeting: Meeting) -> Hiding:
    """Return who hid the other of a meeting within `LATELY` before it crossed the ego's path."""
    end = int(meeting.other_at)
    begin = max(end - round(LATELY / scene.step), int(np.ceil(meeting.begin)))
    if end <= begin:
        return Hiding()
    last, found = -1, Hiding()
    for who in _beside(scene, meeting, begin, end).tolist():
        if not stands(scene, who, begin, end):
            continue
        seen = motion(
            excerpt(scene.traffic, scene.clock, meeting.ego, [meeting.other, who], begin, end)
        )
        bodies = Bodies(
            seen.half, seen.x[0], seen.y[0], seen.cosine[0], seen.sine[0], seen.distance[0]
        )
        hides = [k for k in range(end - begin + 1) if hidden(bodies, 1, k)]
        if hides and hides[-1] > last:
            last, found = hides[-1], Hiding(who, _gap(bodies, meeting.course))
    return found


def _beside(scene: Scene, meeting: Meeting, begin: int, end: int) -> Int:
    """Return the vehicles that are recorded from begin to end, near the line of sight."""
    clock, traffic = scene.clock, scene.traffic
    there = (clock.begin <= begin) & (clock.end >= end) & ~np.isin(traffic.kind, WALKS)
    there[[meeting.ego, meeting.other]] = False
    who = np.flatnonzero(there)
    at = traffic.first[who] + begin - clock.begin[who]
    near = np.ones(len(who), np.bool_)
    for values in (traffic.x, traffic.y):
        ends = [
            values[traffic.first[p] + k - clock.begin[p]]
            for p in (meeting.ego, meeting.other)
            for k in (begin, end)
        ]
        near &= (values[at] >= min(ends) - BESIDE) & (values[at] <= max(ends) + BESIDE)
    return who[near]


def _gap(bodies: Bodies, course: float) -> float:
    """Return the gap along a course from the last place of body 1 to body 2 [m]."""
    c, s = np.cos(course), np.sin(course)
    along = (bodies.x[2, -1] - bodies.x[1, -1]) * c + (bodies.y[2, -1] - bodies.y[1, -1]) * s
    reach = extent(c, s, bodies.c[2, -1], bodies.s[2, -1], bodies.half[2, 0], bodies.half[2, 1])
    return max(abs(float(along)) - float(reach), 0.0)


WALKING = (45.0, 135.0)
"""Angles at which the path of a pedestrian crosses the ego's [deg]."""
RIDING = (20.0, 160.0)
"""Angles at which the path of a bicycle crosses the ego's [deg]: who turns off crosses its path
before having turned far."""


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return who crosses an ego's path on foot or by bicycle, before the ego comes."""
    kind = scene.traffic.kind
    met = [
        meeting
        for meeting in meetings(scene, scene.is_ego, np.isin(kind, (PEDESTRIAN, BICYCLE)))
        if meeting.other_at < meeting.ego_at and _crosses(meeting, int(kind[meeting.other]))
    ]
    hidden = {meeting: hiding(scene, meeting) for meeting in met}
    return events_of_meetings(
        "vru-crossing",
        scene,
        met,
        lambda meeting: _more(meeting, int(kind[meeting.other]), hidden[meeting]),
        {"occluder": [hidden[meeting].by for meeting in met]},
    )


def _crosses(meeting: Meeting, kind: int) -> bool:
    low, high = WALKING if kind == PEDESTRIAN else RIDING
    return low <= meeting.angle <= high


def _more(meeting: Meeting, kind: int, hidden: Hiding) -> dict[str, float]:
    return {
        "ego_turn": meeting.ego_turn,
        "is_bicycle": float(kind == BICYCLE),
        "hidden": float(hidden.is_hidden),
        "occluder_gap": hidden.gap,
    }
