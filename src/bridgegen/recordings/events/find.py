"""All events of a recording, and the driving in which they were found."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.recordings.events import (
    approach,
    crossing,
    cut_in,
    cut_out,
    following,
    lane_change,
    lead_brakes,
    merging,
    oncoming_turn,
    red_light,
    right_turn,
    swing_out,
    vru_crossing,
)
from bridgegen.recordings.events.changes import LaneChanges, lane_changes
from bridgegen.recordings.events.event import Events
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.lanes.find import Located
from bridgegen.recordings.readers.table import RecordedTraffic
from bridgegen.scenario.language.event_kinds import EVENT_KINDS

DETECTORS: dict[str, Callable[[Scene, LaneChanges], Events]] = {
    "cut-in": cut_in.find,
    "cut-out": cut_out.find,
    "lead-brakes": lead_brakes.find,
    "approach": approach.find,
    "following": following.find,
    "lane-change": lane_change.find,
    "crossing": crossing.find,
    "oncoming-left-turn": oncoming_turn.find,
    "vru-crossing": vru_crossing.find,
    "merging": merging.find,
    "red-light-violation": red_light.find,
    "right-turn-with-bicycle": right_turn.find,
    "bicycle-swings-out": swing_out.find,
}
"""Detectors by kind of event; each returns what
`bridgegen.scenario.language.event_kinds.EVENT_KINDS` declares."""


@dataclass(frozen=True, eq=False)
class FoundEvents:
    """The events of a recording.

    Attributes:
        recording: its name.
        source: its file.
        names: ``(P,)`` of the participants.
        kinds: the events, a kind each.
        hours: of driving on lanes by all who can be the ego [h].
        kilometres: likewise [km].
        all_hours: of driving and standing anywhere by all who can be the ego [h].
        all_kilometres: likewise [km].
        has_lights: whether it has traffic lights whose stop lines are known.
    """

    recording: str
    source: str
    names: tuple[str, ...]
    kinds: tuple[Events, ...]
    hours: float
    kilometres: float
    all_hours: float
    all_kilometres: float
    has_lights: bool

    def driving(self, kind: str, *, needs_lights: bool = False) -> tuple[float, float]:
        """Return the hours and kilometres in which a kind of event was looked for."""
        if (needs_lights or EVENT_KINDS[kind].needs_lights) and not self.has_lights:
            return 0.0, 0.0
        if EVENT_KINDS[kind].needs_lanes:
            return self.hours, self.kilometres
        return self.all_hours, self.all_kilometres


def find_events(traffic: RecordedTraffic, located: Located) -> FoundEvents:
    """Return the events of a cleaned recording."""
    scene = Scene(traffic, located)
    changes = lane_changes(scene)
    own = scene.is_ego[scene.participant[1:]] & (scene.participant[1:] == scene.participant[:-1])
    pairs = own & scene.drives[1:] & scene.drives[:-1]
    paths = np.hypot(np.diff(traffic.x), np.diff(traffic.y))
    return FoundEvents(
        traffic.facts.name,
        traffic.facts.source,
        traffic.names,
        tuple(find(scene, changes) for find in DETECTORS.values()),
        float(pairs.sum()) * scene.step / 3600.0,
        float(paths[pairs].sum()) / 1000.0,
        float(own.sum()) * scene.step / 3600.0,
        float(paths[own].sum()) / 1000.0,
        any(len(light.path) for light in traffic.facts.lights.values()),
    )


def named(
    found: Sequence[FoundEvents],
) -> Iterator[tuple[FoundEvents, Events, tuple[str, ...]]]:
    """Yield the events of each kind in each recording with their names, ``cut-in-12`` say.

    They are numbered by kind, through all recordings.
    """
    counts: Counter[str] = Counter()
    for found_events in found:
        for events in found_events.kinds:
            kind, first = events.kind.name, counts[events.kind.name] + 1
            yield found_events, events, tuple(f"{kind}-{first + i}" for i in range(len(events)))
            counts[kind] += len(events)
