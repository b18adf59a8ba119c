"""Two whose paths cross, from the view of the one or the other: what crossing events share."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from bridgegen.assess.metrics.times import pet
from bridgegen.base.arrays import Bool
from bridgegen.recordings.events.event import NOT_WHOLE, Events, events_of
from bridgegen.recordings.events.pace import apart, pace_changes, set_off_instants
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.excerpt import excerpt
from bridgegen.recordings.readers.table import wrap
from bridgegen.scenario.language.event_kinds import EVENT_KINDS

# Not where one could see the other: sight needs a map of buildings, which no recording has.
AHEAD = 6.0
"""Time before the first of both passes at which a meeting begins, unless both are recorded later
[s]."""
LEAST_SEEN = 1.0
"""Least time for which both are recorded before the first passes [s]."""
AFTER = 1.0
"""Time after the second passes until which the bodies are compared [s]."""
AVERAGED = 1.0
"""Time before and after the crossing point over which a speed is averaged [s]."""
LEAST_PACE = 0.5
"""Least change of the other participant's speed that counts as a change of pace [m/s]."""
STRAIGHT = 30.0
"""Turn angle below which a participant goes straight on [deg]."""
CROSSING = (30.0, 150.0)
"""Angles at which paths cross [deg]."""
OPPOSITE = 145.0
"""Angle between their courses before, from which on two come from opposite directions [deg]."""
TOUCH = "bodies touch"


@dataclass(frozen=True)
class Meeting:
    """An ego and another whose paths cross.

    Attributes:
        ego: participant.
        other: participant.
        ego_at: instant at which the ego's centre passes the point.
        other_at: instant at which the other's does.
        begin: instant.
        angle: between the courses there [deg], 0 to 180.
        approach_angle: between the courses before [deg], 0 to 180.
        ego_turn: by how much the ego turns [deg], to the left positive.
        other_turn: by how much the other turns [deg].
        side: from which side of the ego the other comes: 1 right, -1 left.
        course: of the ego there [rad].
    """

    ego: int
    other: int
    ego_at: float
    other_at: float
    begin: float
    angle: float
    approach_angle: float
    ego_turn: float
    other_turn: float
    side: float
    course: float

    @property
    def first_at(self) -> float:
        """Instant at which the first of both passes."""
        return min(self.ego_at, self.other_at)

    @property
    def last_at(self) -> float:
        """Instant at which the second passes."""
        return max(self.ego_at, self.other_at)


def meetings(scene: Scene, egos: Bool, others: Bool) -> list[Meeting]:
    """Return the meetings of some with others; of two that may be the ego, from both views.

    Args:
        scene: the recording.
        egos: ``(P,)`` who can be the ego.
        others: ``(P,)`` who can be the other.
    """
    met, found = scene.crossings, []
    for item, other, first_at, other_at in zip(
        met.first.tolist(),
        met.other.tolist(),
        met.first_at.tolist(),
        met.other_at.tolist(),
        strict=True,
    ):
        # Which of two is the ego is not in a recording, so both views count where both are
        # possible.
        if egos[item] and others[other]:
            found.append(meeting(scene, item, other, first_at, other_at))
        if egos[other] and others[item]:
            found.append(meeting(scene, other, item, other_at, first_at))
    return found


def meeting(scene: Scene, ego: int, other: int, ego_at: float, other_at: float) -> Meeting:
    """Return the meeting of an ego and another that pass a point at two instants."""
    paths, clock = scene.paths, scene.clock
    lengths = paths.length(ego, ego_at), paths.length(other, other_at)
    own, its = paths.course(ego, lengths[0]), paths.course(other, lengths[1])
    (before, turn), (its_before, its_turn) = (
        paths.turn(who, length) for who, length in zip((ego, other), lengths, strict=True)
    )
    both = float(max(clock.begin[ego], clock.begin[other]))
    begin = max(min(ego_at, other_at) - AHEAD / scene.step, both)
    return Meeting(
        ego,
        other,
        ego_at,
        other_at,
        begin,
        float(np.degrees(abs(_wrapped(its - own)))),
        float(np.degrees(abs(_wrapped(its_before - before)))),
        float(np.degrees(turn)),
        float(np.degrees(its_turn)),
        1.0 if np.sin(its - own) > 0.0 else -1.0,
        own,
    )


def _wrapped(angle: float) -> float:
    return float(wrap(np.array([angle]))[0])


def events_of_meetings(
    kind: str,
    scene: Scene,
    met: Sequence[Meeting],
    more: Callable[[Meeting], dict[str, float]],
    roles: Mapping[str, Sequence[int]] = MappingProxyType({}),
    refused: Mapping[str, Sequence[bool]] = MappingProxyType({}),
) -> Events:
    """Return meetings as events of a kind, with the quantities that all of them have.

    Args:
        kind: name.
        scene: the recording.
        met: in any order.
        more: the quantities that this kind has besides.
        roles: participants besides the other, by role.
        refused: further reasons for which meetings are no events.
    """
    off = set_off_instants(scene, [item.other for item in met], [item.other_at for item in met])
    rows = [
        dict(_quantities(scene, item, at)) | more(item)
        for item, at in zip(met, off.tolist(), strict=True)
    ]
    table = {
        name: np.array([row[name] for row in rows], np.float64)
        for name in EVENT_KINDS[kind].quantities
    }
    ego, other = (
        np.array([getattr(item, key) for item in met], np.int64) for key in ("ego", "other")
    )
    begin, first, last = (
        np.array([getattr(item, key) for item in met], np.float64)
        for key in ("begin", "first_at", "last_at")
    )
    return events_of(
        kind,
        ego,
        {"other": other} | {name: np.array(who, np.int64) for name, who in roles.items()},
        (scene.seconds(begin), scene.seconds(last)),
        table,
        {
            NOT_WHOLE: (first - begin) * scene.step < LEAST_SEEN,
            TOUCH: table["pet"] <= 0.0,
        }
        | {reason: np.array(mask, np.bool_) for reason, mask in refused.items()},
    )


def paces_of(scene: Scene, met: Sequence[Meeting]) -> dict[Meeting, dict[str, float]]:
    """Return of meetings how the other changes its pace before it passes the point."""
    found = pace_changes(
        scene, [item.other for item in met], [item.other_at for item in met], LEAST_PACE
    )
    paces = {}
    for i, item in enumerate(met):
        begin = float(found.begin[i])
        ways, distance = _ways_left(scene, item, begin)
        paces[item] = {
            "pace_before": float(found.before[i]),
            "pace_after": float(found.after[i]),
            "pace_distance": ways[0],
            "pace_ego_distance": ways[1],
            "pace_apart": distance,
        }
    return paces


def _ways_left(scene: Scene, item: Meeting, at: float) -> tuple[list[float], float]:
    """Return how far other and ego have to go at an instant, and how far apart they are [m]."""
    paths, clock = scene.paths, scene.clock
    if not clock.begin[item.ego] <= at <= clock.end[item.ego]:
        return [np.nan, np.nan], np.nan
    ways = [
        paths.length(who, end) - paths.length(who, at)
        for who, end in ((item.other, item.other_at), (item.ego, item.ego_at))
    ]
    return ways, apart(scene, item.ego, item.other, at)


def _quantities(scene: Scene, item: Meeting, set_off: float) -> Iterator[tuple[str, float]]:
    paths = scene.paths
    for name, who, at in (("ego", item.ego, item.ego_at), ("other", item.other, item.other_at)):
        yield f"{name}_speed", _speed(scene, who, item.begin)
        yield f"{name}_crossing_speed", crossing_speed(scene, who, at)
        yield f"{name}_distance", paths.length(who, at) - paths.length(who, item.begin)
    yield "time_gap", (item.last_at - item.first_at) * scene.step
    yield "pet", _pet(scene, item)
    yield "angle", item.angle
    yield "approach_angle", item.approach_angle
    yield "side", item.side
    yield "ego_first", float(item.ego_at < item.other_at)
    yield "seen_time", (item.first_at - item.begin) * scene.step
    ways, distance = _ways_left(scene, item, set_off)
    yield "set_off_distance", ways[0]
    yield "set_off_ego_distance", ways[1]
    yield "set_off_apart", distance


def _speed(scene: Scene, who: int, instant: float) -> float:
    low, high = float(scene.clock.begin[who]), float(scene.clock.end[who])
    at = np.array([min(max(instant, low), high)])
    return float(scene.at(scene.speed, np.array([who]), at)[0])


def crossing_speed(scene: Scene, who: int, at: float) -> float:
    """Return a speed by the length of the path, which noise makes longer by little [m/s]."""
    around, clock = AVERAGED / scene.step, scene.clock
    low, high = max(at - around, float(clock.begin[who])), min(at + around, float(clock.end[who]))
    way = scene.paths.length(who, high) - scene.paths.length(who, low)
    return way / ((high - low) * scene.step)


def _pet(scene: Scene, item: Meeting) -> float:
    """Return the least time between the instants at which both bodies cover a point [s]."""
    late, early = (item.ego, item.other) if item.ego_at > item.other_at else (item.other, item.ego)
    begin = int(np.ceil(item.begin))
    end = min(int(item.last_at + AFTER / scene.step) + 1, int(scene.clock.end[late]))
    if end <= begin:
        return np.nan
    return float(pet(excerpt(scene.traffic, scene.clock, late, [early], begin, end))[0])
