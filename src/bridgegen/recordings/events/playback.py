"""The closest events of each kind, with the motion around them."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.recordings.events.event import ABSENT, Events
from bridgegen.recordings.events.find import FoundEvents
from bridgegen.recordings.excerpt import Clock, excerpt
from bridgegen.recordings.readers.table import RecordedTraffic
from bridgegen.recordings.replays.scenario import others_near
from bridgegen.scenario.language.event_kinds import EVENT_KINDS
from bridgegen.simulation.rollout import Rollout

SHOWN = 3
"""Number of events of each kind that are shown."""
AROUND = 2.0
"""Time before and after an event that is shown [s]."""
LONGEST = 15.0
"""Longest duration of a moving picture [s]."""
MOST_OTHERS = 12
"""Largest number of participants besides the ego."""
GAPS = {"cut-in": "crossing_gap"}
"""Gaps that rank the events, by kind; events of other kinds are ranked by their gap at the
beginning."""
MEETING = "pet"
"""Quantity that ranks the events of crossing paths instead of a gap: post-encroachment time."""
LEAST_SPEED = 1.0
"""Speed that slower egos count as [m/s]."""


@dataclass(frozen=True, eq=False)
class PlayedEvent:
    """An event with what happened around it.

    Attributes:
        kind: of it.
        name: of it, as in the table of events.
        recording: its name.
        ego: the participant's name.
        time_gap: gap by the ego's speed, or post-encroachment time [s]; inf if there is none.
        motion: from `AROUND` before it on; entity 1 is the other of the event.
        when: its begin, from the motion's [s].
        seconds: of the motion's begin, by the recording's clock [s].
    """

    kind: str
    name: str
    recording: str
    ego: str
    time_gap: float
    motion: Rollout
    when: float
    seconds: float


def closest(
    kept: Sequence[PlayedEvent],
    traffic: RecordedTraffic,
    clock: Clock,
    found: FoundEvents,
    before: "Counter[str]",
) -> list[PlayedEvent]:
    """Return the closest events of each kind, of earlier recordings and of one more.

    Args:
        kept: of earlier recordings.
        traffic: the cleaned recording.
        clock: its own.
        found: its events.
        before: how many events of each kind the earlier ones have.
    """
    made: list[PlayedEvent] = []
    for events in found.kinds:
        kind = events.kind.name
        earlier = [event for event in kept if event.kind == kind]
        gaps = _time_gaps(events)
        worst = max((event.time_gap for event in earlier), default=np.inf)
        limit = worst if len(earlier) >= SHOWN else np.inf
        more = []
        for i in np.argsort(gaps, kind="stable")[:SHOWN].tolist():
            if not gaps[i] > limit:
                name = f"{kind}-{before[kind] + i + 1}"
                more += list(_played(traffic, clock, events, i, name, float(gaps[i])))
        made += sorted([*earlier, *more], key=lambda event: event.time_gap)[:SHOWN]
    return made


def _time_gaps(events: Events) -> Float:
    if MEETING in events.quantities:
        return np.nan_to_num(events.quantities[MEETING], nan=np.inf)
    gap = events.quantities.get(GAPS.get(events.kind.name, "gap"))
    if gap is None:
        return np.full(len(events), np.inf)
    time_gap = gap / np.maximum(events.quantities["ego_speed"], LEAST_SPEED)
    return np.where(np.isnan(time_gap), np.inf, time_gap)


def _played(
    traffic: RecordedTraffic, clock: Clock, events: Events, i: int, name: str, time_gap: float
) -> Iterator[PlayedEvent]:
    """Yield an event, if anyone else is there to be seen."""
    step, ego = traffic.facts.time_step, int(events.ego[i])
    around = round(AROUND / step)
    at = round(float(events.begin[i]) / step)
    begin = max(at - around, int(clock.begin[ego]))
    end = min(
        round(float(events.end[i]) / step) + around,
        int(clock.end[ego]),
        begin + round(LONGEST / step),
    )
    first = list(dict.fromkeys(int(who[i]) for who in events.others.values() if who[i] != ABSENT))
    others = others_near(traffic, clock, ego, first, begin, end)[:MOST_OTHERS]
    if others and end > begin:
        motion = excerpt(traffic, clock, ego, others, begin, end)
        yield PlayedEvent(
            events.kind.name,
            name,
            traffic.facts.name,
            traffic.names[ego],
            time_gap,
            motion,
            (at - begin) * step,
            begin * step,
        )


def caption(played_event: PlayedEvent) -> str:
    """Return what a picture of an event shows: whose, where, and how close it was."""
    quantities = EVENT_KINDS[played_event.kind].quantities
    gap = ""
    if MEETING in quantities:
        gap = f"; {played_event.time_gap:.2f} s between them"
    elif "gap" in quantities:
        gap = (
            f"; {played_event.time_gap:.2f} s behind"
            if np.isfinite(played_event.time_gap)
            else "; no leader"
        )
    return (
        f"{played_event.name}: ego {played_event.ego} of {played_event.recording}, from "
        f"{played_event.seconds:.2f} s by the "
        f"recording's clock{gap}"
    )
