"""The lanes of a recording, whatever they were made of, and the chains that they form."""

import math
from collections import Counter, defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.recordings.readers.table import wrap

# --- Chains of cross-sections that follow one another: carriageways ---


def stations_of_groups(strips: "Sequence[Strip]") -> tuple[dict[int, int], dict[int, float]]:
    """Return each group's carriageway, and the station at which it begins on it [m].

    A group is followed by the one to which most of its driving lanes lead, of several by the one
    that turns least; it must be that group's own predecessor by the same rule. A ring is cut where
    its first group begins. A carriageway that begins at a fork or where ways join goes on with the
    station of what leads to it.
    """
    length: dict[int, float] = {}
    turn: dict[int, float] = {}
    for strip in strips:
        length[strip.group] = max(length.get(strip.group, 0.0), float(strip.station[-1]))
        turn.setdefault(strip.group, _turn(strip))
    links: Counter[tuple[int, int]] = Counter(
        (strip.group, strips[to].group)
        for strip in strips
        for to in strip.successors
        if strip.kind == "driving" and strips[to].group != strip.group
    )
    onward: dict[int, list[int]] = defaultdict(list)
    before: dict[int, list[int]] = defaultdict(list)
    for a, b in links:
        onward[a].append(b)
        before[b].append(a)
    # The number comes last in both keys, so that ties are broken in one way, whatever the order of
    # a set.
    best = {a: min(to, key=lambda b: (-links[a, b], turn[b], b)) for a, to in onward.items()}
    last = {b: min(by, key=lambda a: (-links[a, b], turn[a], a)) for b, by in before.items()}
    following = {a: b for a, b in best.items() if last[b] == a}
    followed = set(following.values())
    carriageway: dict[int, int] = {}
    heads: dict[int, list[int]] = {}
    # First the groups that nothing leads to; what is left over then are rings, which begin
    # anywhere.
    for head in [g for g in length if g not in followed] + list(length):
        if head in carriageway:
            continue
        chain, at = [], head
        while at not in carriageway:
            carriageway[at] = len(heads)
            chain.append(at)
            if at not in following:
                break
            at = following[at]
        heads[len(heads)] = chain
    return carriageway, _begin(heads, last, onward, carriageway, length)


def _begin(
    heads: dict[int, list[int]],
    last: dict[int, int],
    onward: dict[int, list[int]],
    carriageway: dict[int, int],
    length: dict[int, float],
) -> dict[int, float]:
    """Return where each group begins: first those that nothing leads to, then what they reach."""
    begin: dict[int, float] = {}
    roots = [chain for chain in heads.values() if chain[0] not in last]
    for root in [*roots, *heads.values()]:
        waiting = deque([(root, 0.0)])
        while waiting:
            chain, station = waiting.popleft()
            if chain[0] in begin:
                continue
            for group in chain:
                begin[group] = station
                station += length[group]
            waiting.extend(
                (heads[carriageway[b]], begin[group] + length[group])
                for group in chain
                for b in onward.get(group, ())
                if heads[carriageway[b]][0] == b and last[b] == group
            )
    return begin


def _turn(strip: "Strip") -> float:
    """Return by how much a lane turns from its beginning to its end [rad], rounded."""
    steps = np.diff(strip.points, axis=0)
    courses = np.arctan2(steps[:, 1], steps[:, 0])
    # Rounded, so that two straight ways tie, and the last digits of a file do not choose between
    # them.
    return round(abs(math.remainder(float(courses[-1] - courses[0]), math.tau)), 6)


Source = Literal["map", "lanelets", "markings", "inferred", "none"]
Kind = Literal["driving", "bicycle", "sidewalk"]
NONE = -1
STEP = 1.0
"""Largest distance between two points of a centre line, where its source allows [m]."""


@dataclass(frozen=True, eq=False)
class Strip:
    """One lane as a source knows it, in the direction of its traffic.

    Attributes:
        name: the source's own.
        kind: what it is for.
        group: number of the cross-section that it is part of: lanes of one direction side by side.
        points: ``(n, 2)`` of its centre line [m], two at least.
        width: ``(n,)`` [m].
        station: ``(n,)`` along the group's reference line [m], from 0, increasing.
        left: number of the strip to its left in the same direction; -1 for none.
        right: to its right.
        opposite: to its left, or in left-hand traffic to its right, in the other direction.
        successors: numbers of the strips that it leads to.
    """

    name: str
    kind: Kind
    group: int
    points: Float
    width: Float
    station: Float
    left: int = NONE
    right: int = NONE
    opposite: int = NONE
    successors: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class RecordedLanes:
    """The lanes of a recording: L lanes with V points of centre lines in all.

    A centre line runs in the direction of travel. A *carriageway* is a chain of cross-sections
    that follow one another; each cross-section is all lanes of one direction side by side. Its
    stations go on from one to the next, are those of one reference line in the middle of the
    driving lanes, and are the same for all lanes of a cross-section. So differences of stations on
    a carriageway are distances along it. Where a way forks, the station goes on in both ways;
    where ways join, it is that of the straighter one.

    Attributes:
        source: "map" (OpenDRIVE), "lanelets", "markings" (of the recording), "inferred" from its
            paths, or "none".
        names: ``(L,)`` the source's own; of a map "road:section:lane".
        kinds: ``(L,)``.
        carriageway: ``(L,)`` int64, numbered from 0.
        number: ``(L,)`` int64, of driving lanes from the right, 1 first; 0 of others.
        left: ``(L,)`` int64, neighbour of the same kind and direction; -1 for none.
        right: ``(L,)`` int64.
        opposite: ``(L,)`` int64, driving lane of the other direction beside it; -1 for none.
        successors: ``(L,)`` numbers of the lanes that each leads to.
        first: ``(L + 1,)`` int64; the points of lane l are ``first[l]:first[l + 1]``.
        x: ``(V,)`` [m].
        y: ``(V,)`` [m].
        heading: ``(V,)`` [rad], direction of travel.
        width: ``(V,)`` [m].
        station: ``(V,)`` along the carriageway [m], increasing along a lane.
        notes: what was assumed or is missing, in sentences.
    """

    source: Source
    names: tuple[str, ...]
    kinds: tuple[Kind, ...]
    carriageway: Int
    number: Int
    left: Int
    right: Int
    opposite: Int
    successors: tuple[tuple[int, ...], ...]
    first: Int
    x: Float
    y: Float
    heading: Float
    width: Float
    station: Float
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def __len__(self) -> int:
        return len(self.names)

    def points(self, lane: int) -> slice:
        """Return the points of a lane, as a slice of the columns."""
        return slice(int(self.first[lane]), int(self.first[lane + 1]))


def assemble(source: Source, strips: Sequence[Strip], notes: Sequence[str] = ()) -> RecordedLanes:
    """Make the lanes of strips: number them, and chain cross-sections to carriageways."""
    carriageway, begin = stations_of_groups(strips)
    counts = [len(strip.points) for strip in strips]
    points = np.concatenate([np.empty((0, 2)), *(strip.points for strip in strips)])
    station = [strip.station + begin[strip.group] for strip in strips]
    return RecordedLanes(
        source=source,
        names=tuple(strip.name for strip in strips),
        kinds=tuple(strip.kind for strip in strips),
        carriageway=np.array([carriageway[strip.group] for strip in strips], np.int64),
        number=_numbers(strips),
        left=np.array([strip.left for strip in strips], np.int64),
        right=np.array([strip.right for strip in strips], np.int64),
        opposite=np.array([strip.opposite for strip in strips], np.int64),
        successors=tuple(strip.successors for strip in strips),
        first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        x=points[:, 0].copy(),
        y=points[:, 1].copy(),
        heading=np.concatenate([np.empty(0), *(headings_along(strip.points) for strip in strips)]),
        width=np.concatenate([np.empty(0), *(strip.width for strip in strips)]),
        station=np.concatenate([np.empty(0), *station]),
        notes=tuple(notes),
    )


def headings_along(points: Float) -> Float:
    """Return the directions of a line at its points, of second order [rad]; ``(n,)``."""
    steps = np.diff(points, axis=0)
    length = np.maximum(np.hypot(steps[:, 0], steps[:, 1]), 1e-9)
    course = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    if len(course) == 1:
        return wrap(np.repeat(course, 2))
    share = length[:-1] / (length[:-1] + length[1:])
    turn = np.diff(course)
    inner = course[:-1] + turn * share
    ends = (2.0 * course[0] - inner[0], 2.0 * course[-1] - inner[-1])
    return wrap(np.concatenate([ends[:1], inner, ends[1:]]))


def along(points: Float) -> Float:
    """Return the distances along a line of its points [m]; ``(n,)`` from 0."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def _numbers(strips: Sequence[Strip]) -> Int:
    """Return the numbers of driving lanes from the right."""
    found = np.zeros(len(strips), np.int64)
    for index, strip in enumerate(strips):
        if strip.kind == "driving" and strip.right == NONE:
            at, number = index, 1
            while at != NONE and not found[at]:
                found[at] = number
                at, number = strips[at].left, number + 1
    return found
