"""Chains of cross-sections that follow one another: carriageways."""

import math
from collections import Counter, defaultdict, deque
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from bridgegen.recordings.lanes.model import Strip


def stations_of_groups(strips: "Sequence[Strip]") -> tuple[dict[int, int], dict[int, float]]:
    """Return each group's carriageway, and the station at which it begins on it [m].

    A group is followed by the one to which most of its driving lanes lead, of several by the one
    that turns least; it must be that group's own predecessor by the same rule. A ring is cut where
    its first group begins. A carriageway that begins at a fork or where ways join goes on with the
    station of what leads to it.
    """
    length: dict[int, float] = {}
    turn: dict[int, float] = {}
    for one in strips:
        length[one.group] = max(length.get(one.group, 0.0), float(one.station[-1]))
        turn.setdefault(one.group, _turn(one))
    links: Counter[tuple[int, int]] = Counter(
        (one.group, strips[to].group)
        for one in strips
        for to in one.successors
        if one.kind == "driving" and strips[to].group != one.group
    )
    onward: dict[int, list[int]] = defaultdict(list)
    before: dict[int, list[int]] = defaultdict(list)
    for a, b in links:
        onward[a].append(b)
        before[b].append(a)
    best = {a: min(to, key=lambda b: (-links[a, b], turn[b], b)) for a, to in onward.items()}
    last = {b: min(by, key=lambda a: (-links[a, b], turn[a], a)) for b, by in before.items()}
    following = {a: b for a, b in best.items() if last[b] == a}
    followed = set(following.values())
    carriageway: dict[int, int] = {}
    heads: dict[int, list[int]] = {}
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
    return round(abs(math.remainder(float(courses[-1] - courses[0]), math.tau)), 6)
