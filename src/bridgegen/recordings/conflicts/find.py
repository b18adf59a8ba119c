"""The conflicts of recorded traffic, with every motor vehicle as the ego in turn.

Each is found by the analysis that a search uses (`bridgegen.assess.conflict.analysis`). A pair has
one conflict at most: the more harmful of the two views, and of equal ones that of the participant
which must brake harder. Bodies that touch are far more often boxes or positions that are wrong than
accidents, so a contact is only noted, and the other conflicts of its ego are looked for without it.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.assess.conflict.analysis import CONTACT, NEAR_MISS, analyse
from bridgegen.assess.conflict.findings import KINDS
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.assess.conflict.summary import ConflictSummary, of_pair
from bridgegen.drivers.kinds import BUS, CAR, MOTORCYCLE, TRUCK
from bridgegen.recordings.conflicts._candidate_kernels import mark_pairs
from bridgegen.recordings.excerpt import Clock, clock_of, excerpt
from bridgegen.recordings.readers.table import RecordedTraffic

EGOS = (CAR, TRUCK, BUS, MOTORCYCLE)
"""Kinds that may be the ego."""
MOVES = 1.0
"""Distance from where it began beyond which a participant moves [m]; else it is parked."""
HORIZON = 4.0
"""Prediction horizon of candidate pairs [s], as of the conflict analysis."""
FARTHEST = 150.0
"""Largest distance between two participants that may meet within the horizon [m]: 2 · 67 km/h, or
135 km/h."""
MARGIN = 0.5
"""Distance by which two bodies may miss each other at constant velocity and be analysed [m]."""
BLOCK = 2000
"""Number of instants whose pairs are sought at once: a pair is found anew at each."""
SPAN = 60.0
"""Duration of an ego's path that is analysed at once [s]."""
CONTEXT = 15.0
"""Time before and after `SPAN` that tells how a conflict arose and where paths lead [s]."""
AROUND = 2.0
"""Time before and after a conflict in which its motion has to be plausible [s]."""


@dataclass(frozen=True)
class RecordedConflict:
    """A near miss, or bodies that touch.

    Attributes:
        ego: participant.
        other: participant.
        instant: of a contact, or the most urgent of a near miss, by the recording's clock.
        found: what happened, with its type and who is responsible. Its harm counts whoever is
            responsible.
        doubt: why the motion around it could not happen; "" if it could.
    """

    ego: int
    other: int
    instant: int
    found: ConflictSummary
    doubt: str

    @property
    def is_contact(self) -> bool:
        """Whether bodies touch."""
        return self.found.conflict == KINDS[CONTACT]

    @property
    def urgency(self) -> tuple[float, float]:
        """Harm and the deceleration that the ego needed [m/s²]."""
        return self.found.harm, self.found.needed_deceleration


def conflicts_of(traffic: RecordedTraffic) -> tuple[RecordedConflict, ...]:
    """Return the near misses of a cleaned recording and the contacts, the most harmful first."""
    clock = clock_of(traffic)
    best: dict[tuple[int, int], RecordedConflict] = {}
    for ego, others in candidates(traffic, clock).items():
        for conflict in _of_ego(traffic, clock, ego, others):
            pair = (min(conflict.ego, conflict.other), max(conflict.ego, conflict.other))
            if pair not in best or conflict.urgency > best[pair].urgency:
                best[pair] = conflict
    return tuple(sorted(best.values(), key=order))


def order(recorded_conflict: RecordedConflict) -> tuple[bool, bool, float, int, int]:
    """Return what sorts conflicts: near misses, then doubtful ones, then contacts; by harm."""
    return (
        recorded_conflict.is_contact,
        recorded_conflict.doubt != "",
        -recorded_conflict.found.harm,
        recorded_conflict.ego,
        recorded_conflict.other,
    )


def candidates(traffic: RecordedTraffic, clock: Clock) -> dict[int, list[int]]:
    """Return, by ego, the participants that may come into conflict with it.

    Fragments of tracks are left out.
    """
    instant = clock.instant
    by_instant = np.lexsort((traffic.x, instant))
    every = np.arange(int(instant.min()), int(instant.max()) + 2)
    first = np.searchsorted(instant[by_instant], every).astype(np.int64)
    reach = 0.5 * np.hypot(traffic.length, traffic.width) + 0.5 * MARGIN
    moves = np.array([_extent(traffic, states) > MOVES for states in traffic.states()])
    parts, participant = [], traffic.participant
    keys = np.empty(1 << 20, np.int64)
    for begin in range(0, len(first) - 1, BLOCK):
        arguments = (
            by_instant,
            first[begin : begin + BLOCK + 1],
            participant,
            traffic.x,
            traffic.y,
            traffic.vx,
            traffic.vy,
            reach,
            moves,
            HORIZON,
            FARTHEST,
        )
        count = mark_pairs(*arguments, keys)
        if count > len(keys):
            keys = np.empty(count, np.int64)
            mark_pairs(*arguments, keys)
        parts.append(np.unique(keys[:count]))
    pairs = np.unique(np.concatenate(parts))
    found: dict[int, list[int]] = defaultdict(list)
    is_ego = np.isin(traffic.kind, EGOS) & moves
    for p, q in zip(*(part.tolist() for part in np.divmod(pairs, len(moves))), strict=True):
        for ego, other in ((p, q), (q, p)):
            if is_ego[ego] and clock.is_whole[ego] and clock.is_whole[other]:
                found[ego].append(other)
    return dict(sorted(found.items()))


def _extent(traffic: RecordedTraffic, states: slice) -> float:
    x, y = traffic.x[states], traffic.y[states]
    return float(np.hypot(x - x[0], y - y[0]).max())


def _of_ego(
    traffic: RecordedTraffic, clock: Clock, ego: int, others: list[int]
) -> Iterator[RecordedConflict]:
    """Yield the conflicts of an ego, part by part of its way, so that memory is bounded."""
    begin, end, step = int(clock.begin[ego]), int(clock.end[ego]), traffic.facts.time_step
    span, context = (max(1, round(seconds / step)) for seconds in (SPAN, CONTEXT))
    for first in range(begin, end + 1, span):
        last = min(first + span - 1, end)
        around = max(first - context, begin), min(last + context, end)
        there = [
            other
            for other in others
            if clock.begin[other] <= around[1] and clock.end[other] >= around[0]
        ]
        for conflict in _of_part(traffic, clock, ego, there, *around):
            if first <= conflict.instant <= last:
                yield conflict


def _of_part(
    traffic: RecordedTraffic, clock: Clock, ego: int, others: list[int], begin: int, end: int
) -> Iterator[RecordedConflict]:
    """Yield conflicts between two instants; those after a contact without the one that touches."""
    left = list(others)
    while left:
        found = analyse(excerpt(traffic, clock, ego, left, begin, end))
        kind = found.kind[0]
        worst = CONTACT if (kind == CONTACT).any() else NEAR_MISS
        by_clock = replace(found, instant=found.instant + begin, decided=found.decided + begin)
        for e in np.flatnonzero(kind == worst).tolist():
            other, instant = left[e - 1], int(by_clock.instant[0, e])
            yield RecordedConflict(
                ego,
                other,
                instant,
                of_pair(by_clock, 0, e, "any"),
                _doubt(traffic, clock, ego, other, instant),
            )
        if worst == NEAR_MISS:
            return
        left = [other for e, other in enumerate(left, 1) if kind[e] != CONTACT]


def _doubt(traffic: RecordedTraffic, clock: Clock, ego: int, other: int, instant: int) -> str:
    """Return why the motion of two could not happen around an instant; "" if it could."""
    around = round(AROUND / traffic.facts.time_step)
    begin = max(instant - around, int(clock.begin[ego]), int(clock.begin[other]))
    end = min(instant + around, int(clock.end[ego]), int(clock.end[other]))
    if end <= begin:
        return ""
    judged = plausibility(excerpt(traffic, clock, ego, [other], begin, end))
    return judged.labels[0]
