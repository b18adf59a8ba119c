"""All events of a recording, and the driving in which they were found."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.mining.events import (
    approach,
    cut_in,
    cut_out,
    following,
    lane_change,
    lead_brakes,
)
from bridgegen.mining.events.changes import LaneChanges, lane_changes
from bridgegen.mining.events.event import Events
from bridgegen.mining.events.scene import Scene
from bridgegen.mining.lanes.find import Located
from bridgegen.recordings.table import RecordedTraffic

DETECTORS: dict[str, Callable[[Scene, LaneChanges], Events]] = {
    "cut-in": cut_in.find,
    "cut-out": cut_out.find,
    "lead-brakes": lead_brakes.find,
    "approach": approach.find,
    "following": following.find,
    "lane-change": lane_change.find,
}
"""By kind; each returns what `bridgegen.odd.event_kinds.EVENT_KINDS` declares."""


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
    """

    recording: str
    source: str
    names: tuple[str, ...]
    kinds: tuple[Events, ...]
    hours: float
    kilometres: float


def find_events(traffic: RecordedTraffic, located: Located) -> FoundEvents:
    """Return the events of a cleaned recording."""
    scene = Scene(traffic, located)
    changes = lane_changes(scene)
    counted = scene.drives & scene.is_ego[scene.participant]
    pairs = counted[1:] & counted[:-1] & (scene.participant[1:] == scene.participant[:-1])
    paths = np.hypot(np.diff(traffic.x), np.diff(traffic.y))
    return FoundEvents(
        traffic.facts.name, traffic.facts.source, traffic.names,
        tuple(find(scene, changes) for find in DETECTORS.values()),
        float(pairs.sum()) * scene.step / 3600.0, float(paths[pairs].sum()) / 1000.0,
    )  # fmt: skip


def named(
    found: Sequence[FoundEvents],
) -> Iterator[tuple[FoundEvents, Events, tuple[str, ...]]]:
    """Yield the events of each kind in each recording with their names, ``cut-in-12`` say.

    They are numbered by kind, through all recordings.
    """
    counts: Counter[str] = Counter()
    for one in found:
        for events in one.kinds:
            kind, first = events.kind.name, counts[events.kind.name] + 1
            yield one, events, tuple(f"{kind}-{first + i}" for i in range(len(events)))
            counts[kind] += len(events)
