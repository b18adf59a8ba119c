"""A corridor as a road network of SUMO, and the places of vehicles on it.

SUMO's world is the road straightened: an edge for each section of the corridor, with its lanes, and
one that goes on straight beyond its end, where vehicles that are not on the road are parked. SUMO
numbers lanes from the right, corridors from the left.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.adapters.planners._corridor import Corridor, Section
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.drivers.interface import Observation, Scene

TAIL = 20_000.0
"""Length by which the road goes on straight beyond the corridor [m]."""

PARKED, PARKING_SPACE = 10_000.0, 100.0
"""Position on the tail from which vehicles stand that are not on the road, and distance from one to
the next [m]."""

NO_LIMIT = 100.0
"""Speed limit where none is posted [m/s]: no vehicle is faster."""

SHORTEST = 0.1
"""Least length of an edge [m]: SUMO has none shorter."""


class StraightRoad:
    """A corridor as SUMO sees it.

    Attributes:
        corridor: of which it is made.
        lengths: ``(S,)`` float64 [m], of its edges; the last one is the tail.
        lanes: ``(S,)`` int64, how many lanes each has.
        next: ``(S, L)`` int64, the lane of the next edge that each lane leads to, -1: none.
    """

    def __init__(self, corridor: Corridor) -> None:
        self.corridor = corridor
        sections = (*corridor.sections, corridor.sections[-1])
        spans = [item.end - item.start for item in corridor.sections]
        self.lengths: Float = np.array([*(max(span, SHORTEST) for span in spans), TAIL])
        self.lanes: Int = np.array([len(item.lanes) for item in sections])
        # Lists: a number of an array takes longer.
        self._starts = [*(item.start for item in corridor.sections), corridor.length]
        self._ends: list[float] = self.lengths.tolist()
        self.next: Int = np.full((len(sections), int(self.lanes.max())), -1, dtype=np.int64)
        for k, section in enumerate(sections[:-1]):
            for i, lane in enumerate(section.lanes):
                # All lanes lead on to the tail: SUMO brakes for a lane that ends, and the
                # corridor's end is the end of what is known, not of the road.
                self.next[k, i] = i if k == len(sections) - 2 else lane.next
        self._sections = sections

    def edge_at(self, s: float) -> tuple[int, float]:
        """Return the edge at a station, and the position on it [m]."""
        k = max(bisect_right(self._starts, s) - 1, 0)
        return k, min(max(s - self._starts[k], 0.0), self._ends[k])

    def section(self, edge: int) -> Section:
        """Return the section of an edge; the tail has the lanes of the last one."""
        return self._sections[edge]

    def lane_at(self, edge: int, s: float, d: float) -> tuple[int, bool]:
        """Return the nearest lane at a place, and whether the place is on it."""
        return self.corridor.lane_at(min(edge, len(self._sections) - 2), s, d)


def network_text(roads: Sequence[StraightRoad]) -> str:
    """Return the network of several roads beside each other, as the text of a ``.net.xml``.

    The lane i from the left of the edge k of the road r is called ``r{r}e{k}_{n - 1 - i}``.
    """
    edges, junctions, connections = [], [], []
    for r, road in enumerate(roads):
        x = np.concatenate([[0.0], np.cumsum(road.lengths)])
        links = []
        for k, (n, length) in enumerate(
            zip(road.lanes.tolist(), road.lengths.tolist(), strict=True)
        ):
            edge, lanes = f"r{r}e{k}", road.section(k).lanes
            edges.append(f'<edge id="{edge}" from="r{r}n{k}" to="r{r}n{k + 1}" priority="1">')
            for i in reversed(range(n)):
                lane, index = lanes[i], n - 1 - i
                limit = float(
                    np.where(np.isfinite(lane.speed_limit), lane.speed_limit, NO_LIMIT).max()
                )
                left = "" if lane.may_change_left else ' changeLeft="authority"'
                right = "" if lane.may_change_right else ' changeRight="authority"'
                y = 4.0 * index
                edges.append(
                    f'<lane id="{edge}_{index}" index="{index}" speed="{limit!r}" '
                    f'length="{length!r}" width="{float(lane.width.mean())!r}"{left}{right} '
                    f'shape="{float(x[k])!r},{y!r} {float(x[k + 1])!r},{y!r}"/>'
                )
            edges.append("</edge>")
            arriving = " ".join(f"{edge}_{i}" for i in range(n))
            links = [(i, int(j)) for i, j in enumerate(road.next[k, :n]) if j >= 0]
            if k == 0:
                junctions.append(_junction(f"r{r}n0", 0.0, "", 0))
            junctions.append(_junction(f"r{r}n{k + 1}", float(x[k + 1]), arriving, len(links)))
            for i, j in links:
                to = int(road.lanes[k + 1]) - 1 - j
                connections.append(
                    f'<connection from="{edge}" to="r{r}e{k + 1}" fromLane="{n - 1 - i}" '
                    f'toLane="{to}" dir="s" state="M"/>'
                )
    bounds = "-1000000.00,-1000000.00,1000000.00,1000000.00"
    return "\n".join(
        [
            '<net version="1.20">',
            f'<location netOffset="0.00,0.00" convBoundary="{bounds}" origBoundary="{bounds}" '
            'projParameter="!"/>',
            *edges,
            *junctions,
            *connections,
            "</net>",
        ]
    )


def _junction(name: str, x: float, arriving: str, links: int) -> str:
    """Return a junction that everybody passes: no link of it meets another one."""
    kind = "priority" if links else "dead_end"
    none = "0" * links
    requests = "".join(
        f'<request index="{k}" response="{none}" foes="{none}" cont="0"/>' for k in range(links)
    )
    return (
        f'<junction id="{name}" type="{kind}" x="{x!r}" y="0.0" incLanes="{arriving}" intLanes="" '
        f'shape="{x!r},0.0">{requests}</junction>'
    )


@dataclass(frozen=True)
class Seen:
    """One instant of one scenario, on the straight road.

    Attributes:
        ego: ``(6,)`` float64: edge of the ego's front, position on it [m], speed [m/s],
            acceleration of the last step [m/s²], the speed that it is to drive at most [m/s], and
            the lane that it is nearest to, from the left.
        others: ``(M, 7)`` float64: 1 if it is on the road, edge of its front, position [m], lane
            from the left, speed [m/s], acceleration [m/s²], length [m].
        ahead: ``(L, 6)`` float64, of each lane that the ego's body is on: from the ego's front to
            the rear of the next body that is on it [m], +inf if there is none; that one's speed
            [m/s] and number; the same of the next body whose centre is on another lane, or off the
            road.
        stop: from the ego's front to the place that it is to stop at [m]; +inf: none.
        place: ``(2,)`` float64, station and offset of the ego's rear axle [m].
    """

    ego: Float
    others: Float
    ahead: Float
    stop: float
    place: Float


RED, RED_YELLOW, YELLOW = 1, 2, 3
"""States of a light at which one stops, at yellow only if that can be done by `DECELERATION`."""

REACH = 0.3
"""Distance by which a body must reach into a lane to be on it, too [m]."""

BEFORE_LINE = 1.0
"""Distance before a stop line at which SUMO's vehicles stop [m]."""

DECELERATION = 4.5
"""Deceleration of passenger cars [m/s²]; SUMO's ``decel``."""


class Eyes:
    """Places the ego and the others of one scenario on a straight road, instant by instant.

    Args:
        road: the road.
        scene: of the batch.
    """

    def __init__(self, road: StraightRoad, scene: Scene) -> None:
        self._road, self._scene = road, scene
        self._speeds: Float | None = None
        self._seen: Bool = np.zeros(len(scene.names), dtype=np.bool_)

    def see(self, o: Observation, i: int) -> Seen:
        """Return what of row i is on the road."""
        scene, road, tracks = self._scene, self._road, o.tracks[i]
        s, d, h = road.corridor.places(
            np.append(o.x[i], tracks[:, 1]), np.append(o.y[i], tracks[:, 2])
        )
        station, aside = float(s[0]), float(d[0])
        front = station + scene.centre + 0.5 * scene.length
        edge, position = road.edge_at(front)
        on, _ = road.lane_at(edge, front, aside)
        lanes = road.section(edge).lanes
        most = max(min(float(o.target_speed[i]), lanes[on].at(front)[2]), 0.01)
        # The part along the road: who crosses has none, and who comes towards the ego would have a
        # negative one. Both stand for SUMO, which knows neither.
        along = tracks[:, 4] * np.cos(h[1:]) + tracks[:, 5] * np.sin(h[1:])
        there = tracks[:, 0] >= 2.0
        speeds = np.where(there, np.maximum(along, 0.0), 0.0)
        changes = np.zeros_like(speeds)
        if self._speeds is not None:
            known = there & self._seen
            changes = np.where(known, (speeds - self._speeds) / scene.time_step, 0.0)
        self._speeds, self._seen = speeds, there
        # From here on numbers of Python: a number of an array takes several times as long.
        others = [[0.0] * 7 for _ in tracks]
        ahead = [[math.inf, 0.0, -1.0] * 2 for _ in range(road.next.shape[1])]
        covered = [
            (ahead[n], lane)
            for n, lane in enumerate(lanes)
            if _reach(lane.at(front), aside, scene.width) > 0.0
        ]
        bodies = np.column_stack([s[1:], d[1:], speeds, changes, tracks[:, 6:8]]).tolist()
        for j in np.flatnonzero(there).tolist():
            place, offset, speed, change, length, width = bodies[j]
            length = max(length, 0.1)
            nose, gap = place + 0.5 * length, place - 0.5 * length - front
            k, at = road.edge_at(nose)
            lane, is_on = road.lane_at(k, nose, offset)
            if is_on and nose >= 0.0:
                others[j] = [1.0, k, at, lane, speed, change, length]
            if place <= station:
                continue
            for found, corridor_lane in covered:
                if gap >= found[3] and gap >= found[0]:
                    continue
                here = corridor_lane.at(place)
                if _reach(here, offset, width) <= REACH:
                    continue
                if gap < found[0]:
                    found[:3] = gap, speed, j
                # In SUMO a vehicle is on the lane of its centre. Bodies that reach into the lane
                # from beside it are kept apart, since the model must be asked about them by
                # themselves.
                if gap < found[3] and abs(offset - here[0]) > 0.5 * here[1]:
                    found[3:] = gap, speed, j
        ego = np.array([edge, position, max(o.v[i], 0.0), o.a[i], most, on])
        place_of_axle = np.array([station, aside])
        return Seen(
            ego,
            np.array(others, dtype=np.float64).reshape(-1, 7),
            np.array(ahead),
            self._stop(o, i),
            place_of_axle,
        )

    def _stop(self, o: Observation, i: int) -> float:
        """Return the distance to the place that the ego is to stop at [m]; +inf: none."""
        distance, v = float(o.stop_distance[i]) - BEFORE_LINE, float(o.v[i])
        can = v * v / (2.0 * DECELERATION) <= distance + v * self._scene.time_step
        light = int(o.light[i])
        return distance if light in (RED, RED_YELLOW) or (light == YELLOW and can) else np.inf


def _reach(lane: tuple[float, float, float], d: float, width: float) -> float:
    """Return how far a body of a width, at an offset d, reaches into a lane [m]."""
    return 0.5 * (lane[1] + width) - abs(d - lane[0])


Arrays = dict[str, npt.NDArray[Any]]
