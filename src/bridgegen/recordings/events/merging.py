"""Merging: two come to one lane, from the view of the one on it and of the one that merges."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import NO_CHANGE, Events
from bridgegen.recordings.events.joins import Join, lane_joins, path_joins
from bridgegen.recordings.events.meetings import (
    Meeting,
    crossing_speed,
    events_of_meetings,
    meeting,
)
from bridgegen.recordings.events.pace import pace_changes
from bridgegen.recordings.events.scene import Scene

AT_ONCE = 2.0
"""Time within which joins of one vehicle are at one place [s]."""
LEAST_SPEEDING = 1.0
"""Least increase of a speed before joining that counts as speeding up [m/s]."""


@dataclass(frozen=True)
class _Gaps:
    """The gaps ahead of and behind the vehicle that merges, when it joins [m]."""

    lead: float = np.nan
    follower: float = np.nan


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the mergings of a recording, from both views."""
    joins = list(_next_ones(scene, [*path_joins(scene), *lane_joins(scene, changes)]))
    gaps, paces = _gaps(scene, joins), _paces(scene, joins)
    of, met = {}, []
    for join in joins:
        for ego_merges in (False, True):
            view = _view(scene, join, ego_merges)
            of[view] = join
            met.append(view)
    return events_of_meetings(
        "merging",
        scene,
        met,
        lambda item: _more(scene, item, of[item], gaps[of[item]]) | paces[of[item]],
        refused={NO_CHANGE: [not of[item].is_change for item in met]},
    )


def _next_ones(scene: Scene, joins: Iterable[Join]) -> Iterator[Join]:
    """Yield the joins with the next vehicle ahead and the next one behind.

    A pair joins once: by its paths, or else by its lanes.
    """
    kept: dict[tuple[int, bool, bool], list[float]] = {}
    pairs = set[tuple[int, int]]()
    most = AT_ONCE / scene.step
    for group in _by_source(joins):
        before = frozenset(pairs)
        for join in sorted(
            group, key=lambda join: (abs(join.main_at - join.merging_at), join.main_at)
        ):
            is_first = join.merging_at < join.main_at
            places = {
                (join.merging, True, is_first): join.merging_at,
                (join.main, False, is_first): join.main_at,
            }
            if (min(join.main, join.merging), max(join.main, join.merging)) in before:
                continue
            if any(
                abs(at - other) <= most for key, at in places.items() for other in kept.get(key, [])
            ):
                continue
            for key, at in places.items():
                kept.setdefault(key, []).append(at)
            pairs.add((min(join.main, join.merging), max(join.main, join.merging)))
            yield join


def _by_source(joins: Iterable[Join]) -> tuple[list[Join], list[Join]]:
    of_paths, of_lanes = list[Join](), list[Join]()
    for join in joins:
        (of_paths if join.is_of_paths else of_lanes).append(join)
    return of_paths, of_lanes


def _view(scene: Scene, join: Join, ego_merges: bool) -> Meeting:
    main, merging = (join.main, join.main_at), (join.merging, join.merging_at)
    ego, other = (merging, main) if ego_merges else (main, merging)
    found = meeting(scene, ego[0], other[0], ego[1], other[1])
    return replace(found, angle=join.angle, side=-join.side if ego_merges else join.side)


def _gap(scene: Scene, join: Join) -> float:
    """Return the gap between both along their path when the merging one joins [m]."""
    at = min(
        max(join.merging_at, float(scene.clock.begin[join.main])), float(scene.clock.end[join.main])
    )
    way = scene.paths.length(join.main, at) - scene.paths.length(join.main, join.main_at)
    length = scene.traffic.length
    return abs(way) - 0.5 * float(length[join.main] + length[join.merging])


def _gaps(scene: Scene, joins: list[Join]) -> dict[Join, _Gaps]:
    """Return of each join the gaps of the one that merges."""
    most, found = AT_ONCE / scene.step, {}
    of_merging: dict[int, list[Join]] = {}
    for join in joins:
        of_merging.setdefault(join.merging, []).append(join)
    for join in joins:
        gaps = {
            other.main_at < other.merging_at: _gap(scene, other)
            for other in of_merging[join.merging]
            if abs(other.merging_at - join.merging_at) <= most
        }
        found[join] = _Gaps(gaps.get(True, np.nan), gaps.get(False, np.nan))
    return found


def _paces(scene: Scene, joins: list[Join]) -> dict[Join, dict[str, float]]:
    """Return of each join how the one that merges speeds up before, and where both are then."""
    found = pace_changes(
        scene, [join.merging for join in joins], [join.merging_at for join in joins], LEAST_SPEEDING
    )
    paces = {}
    for i, join in enumerate(joins):
        begin = float(found.begin[i]) if found.after[i] > found.before[i] else np.nan
        paces[join] = {
            "speeding_rate": float(found.rate[i]) if np.isfinite(begin) else np.nan,
            "slow_speed": float(found.before[i]) if np.isfinite(begin) else np.nan,
            "fast_speed": float(found.after[i]) if np.isfinite(begin) else np.nan,
            "speeding_distance": _way(scene, join.merging, begin, join.merging_at),
            "speeding_main_distance": _way(scene, join.main, begin, join.main_at),
        }
    return paces


def _way(scene: Scene, who: int, begin: float, end: float) -> float:
    """Return the length of a path between two instants [m]; NaN where it is not recorded."""
    if not scene.clock.begin[who] <= begin <= scene.clock.end[who]:
        return np.nan
    return scene.paths.length(who, end) - scene.paths.length(who, begin)


def _more(scene: Scene, item: Meeting, join: Join, gaps: _Gaps) -> dict[str, float]:
    return {
        "ego_merges": float(item.ego == join.merging),
        "ego_joining_speed": crossing_speed(scene, item.ego, item.ego_at),
        "other_joining_speed": crossing_speed(scene, item.other, item.other_at),
        "gap": _gap(scene, join),
        "lead_gap": gaps.lead,
        "follower_gap": gaps.follower,
        "lane_left": join.lane_left,
        "change_time": join.change_time,
        "change_distance": _way(scene, join.merging, join.change_begin, join.merging_at),
    }
