"""Lanes of lanelets, which come with a recording."""

import math
from collections.abc import Sequence

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.lanes.model import NONE, STEP, Kind, RecordedLanes, Strip, along, assemble
from bridgegen.recordings.readers.table import Lanelet

KINDS: dict[str, Kind] = {"bicycleLane": "bicycle", "sidewalk": "sidewalk"}
PASSED_OVER = frozenset(("crosswalk", "border", "parking", "restricted", "shoulder"))
"""Kinds of lanelets that are no lanes."""
MOST_POINTS = 5_000_000
SHORTEST = 1e-3  # m


def lanes_of_lanelets(lanelets: Sequence[Lanelet]) -> RecordedLanes:
    """Return the lanes of a recording's lanelets; references to others are passed over.

    Raises:
        FileFormatError: they are too long.
    """
    used = [lanelet for lanelet in lanelets if _is_lane(lanelet)]
    length_in_all = sum(along(lanelet.left)[-1] for lanelet in used)
    if length_in_all > MOST_POINTS * STEP:
        raise FileFormatError(
            f"lanelets may have {MOST_POINTS * STEP / 1000:,.0f} km in all, got "
            f"{length_in_all / 1000:,.0f}"
        )
    number = {lanelet.name: index for index, lanelet in enumerate(used)}
    kinds = [_kind(lanelet) for lanelet in used]
    group = _groups(used, number)
    members: dict[int, list[Lanelet]] = {}
    for lanelet, of in zip(used, group, strict=True):
        members.setdefault(of, []).append(lanelet)
    length = {of: _middle_length(some, number) for of, some in members.items()}

    def beside(index: int, name: str) -> int:
        other = number.get(name, NONE)
        return other if other != NONE and kinds[other] == kinds[index] else NONE

    strips = []
    for index, lanelet in enumerate(used):
        share, left, right = _bounds(lanelet)
        strips.append(
            Strip(
                name=lanelet.name,
                kind=kinds[index],
                group=group[index],
                points=0.5 * (left + right),
                width=np.hypot(*(left - right).T),
                station=share * length[group[index]],
                left=beside(index, lanelet.left_same),
                right=beside(index, lanelet.right_same),
                opposite=beside(index, lanelet.left_opposite),
                successors=tuple(number[name] for name in lanelet.successors if name in number),
            )
        )
    is_marked = bool(used) and all(lanelet.is_marked for lanelet in used)
    return assemble("markings" if is_marked else "lanelets", strips)


def _kind(lanelet: Lanelet) -> Kind:
    return next((KINDS[kind] for kind in lanelet.kinds if kind in KINDS), "driving")


def _is_lane(lanelet: Lanelet) -> bool:
    shorter = min(along(side)[-1] for side in (lanelet.left, lanelet.right))
    return not PASSED_OVER.intersection(lanelet.kinds) and shorter > SHORTEST


def _groups(used: Sequence[Lanelet], number: dict[str, int]) -> list[int]:
    """Return the cross-section that each is part of: those side by side in the same direction."""
    group = list(range(len(used)))

    def head(index: int) -> int:
        while group[index] != index:
            group[index] = group[group[index]]
            index = group[index]
        return index

    for index, lanelet in enumerate(used):
        for name in (lanelet.left_same, lanelet.right_same):
            if name in number:
                a, b = sorted((head(index), head(number[name])))
                group[b] = a
    return [head(index) for index in range(len(used))]


def _middle_length(members: list[Lanelet], number: dict[str, int]) -> float:
    """Return the length of the line midway between a cross-section's outer bounds [m]."""
    left = next((member for member in members if member.left_same not in number), members[0])
    right = next((member for member in members if member.right_same not in number), members[0])
    share = np.linspace(0.0, 1.0, 101)
    return float(along(0.5 * (_at(left.left, share) + _at(right.right, share)))[-1])


def _bounds(lanelet: Lanelet) -> tuple[Float, Float, Float]:
    """Return shares of the way along a lanelet, and its bounds there."""
    length = along(lanelet.left)[-1]
    share = np.linspace(0.0, 1.0, math.ceil(length / STEP) + 1)
    return share, _at(lanelet.left, share), _at(lanelet.right, share)


def _at(line: Float, share: Float) -> Float:
    """Return points of a line at shares of its length."""
    station = along(line)
    wanted = share * station[-1]
    return np.column_stack([np.interp(wanted, station, line[:, k]) for k in (0, 1)])
