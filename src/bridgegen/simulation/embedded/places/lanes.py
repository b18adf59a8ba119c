"""The lanes of one road network as tables, and ways along them that are planned on demand.

The rollout requests a way by two numbers, a route and the node where the way begins; the result
depends on nothing else, so neither the time of planning nor the thread or row matters.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.geometry import reference_line
from bridgegen.openx.opendrive.lane_changes import change_lanes, leads_round
from bridgegen.openx.opendrive.lane_graph import LaneGraph
from bridgegen.openx.opendrive.lanes import borders, lane_along, lane_at, section_index
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.path import Piece
from bridgegen.openx.opendrive.routes import Place, Route
from bridgegen.simulation.embedded.places.slopes import LEVEL, slopes
from bridgegen.simulation.embedded.program import (
    LaneSpot,
    RoadSpot,
    RouteSpot,
    Spot,
    WorldSpot,
)

# Half of a rollout's own time with 30 actors is two loads, for each reads a table of its own, 48
# bytes every 0.2 m. A coarser step would end that, and change every result.
STEP = 0.2
"""Distance between two samples of a path [m]: 0.6 mm from the arc in a bend of 8 m radius."""
DETOUR = 50.0  # m, by which a way on the very lane may be longer than one on a lane beside it
AHEAD = 4  # nodes of its route among which one looks for those that one's own lane leads to
SPAN = 5.0  # m, the longest span: what changes along a lane is taken as linear within it


class Path(NamedTuple):
    """A way as the rollout reads it.

    Attributes:
        table: ``(L, 6)`` float64: x, y [m], heading [rad], its cosine and sine, curvature [1/m].
        step: between two samples [m].
        spans: ``(J, 11)`` float64, which lanes it leads along; see ``_lane_kernels``.
        follows: the node that continues where it ends; -1: the road ends there.
        slopes: ``(L, 3)`` float64, what gravity does along it, see ``slopes``; or no rows.
    """

    table: Float
    step: float
    spans: Float
    follows: int
    slopes: Float = LEVEL


def sampled(route: Route) -> tuple[Float, float]:
    """Return a route's samples, ``(L, 6)`` as `Path` has them, and their distance [m]."""
    step = route.length / math.ceil(route.length / STEP)
    path = route.sample(step)
    columns = (
        path.x,
        path.y,
        path.h,
        elementary.cos(path.h),
        elementary.sin(path.h),
        path.curvature,
    )
    return np.stack(columns, axis=1), step


class Lanes:
    """The lane graph of a road network, and the ways that were planned on it so far.

    Attributes:
        graph: the lane graph.
        nodes: ``(S, 7)`` int64, see ``_lane_kernels``.
        ways: per route the nodes that it leads along; number 0 is no route: straight on.
    """

    def __init__(self, model: OpenDrive) -> None:
        self.graph = LaneGraph(model)
        self.nodes = self._nodes()
        self.ways: list[list[int]] = [[]]

    def add_route(self, spots: Sequence[Spot]) -> None:
        """Add the route that passes some positions.

        Raises:
            InputError: one is not on a lane, or no lane leads from one to the next.
        """
        places = [self._on_lane(spot) for spot in spots]
        # One that passes something on the lane beside is back on its own.
        self.ways.append(
            self._way(places[::5] if leads_round(self.graph.model, places) else places)
        )

    def locate(self, spot: Spot) -> tuple[int, int, float, float, int]:
        """Return number of the road, lane id, s, how far left of the lane's centre [m], and a way.

        Left is that of the reference line. s is NaN where rows may vary it. The way is the one
        from which headings count: 1 along the reference line, or -1; along a route, the route's.

        Raises:
            InputError: it is not on the road network.
        """
        model, way = self.graph.model, 1
        if isinstance(spot, LaneSpot):
            road, lane, s, aside = model.road(spot.road), spot.lane, spot.s, 0.0
            if s is not None:
                lane_at(road, lane, s)
        elif isinstance(spot, WorldSpot):
            road, lane, s, aside = self._under(spot)
        else:
            road, s, way = self._along(spot)
            t = spot.t if isinstance(spot, RoadSpot) else spot.aside
            lane, aside = self._beside(road, s, t)
            if isinstance(spot, RouteSpot) and spot.lane is not None:
                # Where a route runs against the reference line, esmini's files name the road's lane
                # and Vector's Euro NCAP files count from the route: it is the one of both that
                # leads along the route. Read as the road's, the parked cars of CBNA stood behind
                # the bicyclist whom they are to hide.
                lane = lane_along(road, spot.lane, s, way)
                aside = spot.aside if lane == spot.lane else -spot.aside
        return model.roads.index(road), lane, math.nan if s is None else s, aside, way

    def _on_lane(self, spot: Spot) -> Place:
        road, lane, s, _, _ = self.locate(spot)
        return Place(self.graph.model.roads[road].id, lane, s)

    def _along(self, spot: RoadSpot | RouteSpot) -> tuple[Road, float, int]:
        """Return the road of a position, its s, and which way a route leads there."""
        if isinstance(spot, RoadSpot):
            road = self.graph.model.road(spot.road)
            if not 0.0 <= spot.s <= road.length:
                raise InputError(f"road {road.id} is {road.length:g} m long, got s={spot.s:g} m")
            return road, spot.s, 1
        places = [self._on_lane(waypoint) for waypoint in spot.waypoints]
        left, s = spot.path_s, places[0].s
        for i, number in enumerate(self._way(places)):
            node, (entry, leave) = self.graph.nodes[number], self.graph.ends[number].tolist()
            s = entry if i else s
            if left <= abs(leave - s):
                return self.graph.model.road(node.road_id), s + left * node.way, node.way
            left -= abs(leave - s)
        raise InputError(f"the route is shorter than pathS={spot.path_s:g} m")

    def _beside(self, road: Road, s: float, t: float) -> tuple[int, float]:
        """Return the lane at, or nearest to, some t [m], and how far left of its centre that is."""
        index = section_index(road, s)
        edges = borders(road, index, np.array([s]))
        best = (math.inf, 0, 0.0)
        for lane in road.sections[index].lanes:
            inner, outer = edges[lane.id - (1 if lane.id > 0 else -1)][0], edges[lane.id][0]
            beyond = max(t - max(inner, outer), min(inner, outer) - t, 0.0)
            best = min(best, (beyond, lane.id, t - 0.5 * (inner + outer)), key=lambda pair: pair[0])
        if not best[1]:
            raise InputError(f"road {road.id} has no lanes at s={s:g} m")
        return best[1], best[2]

    def _under(self, spot: WorldSpot) -> tuple[Road, int, float, float]:
        """Return road, lane, s and offset of the lane that a point of the world is on."""
        from bridgegen.simulation.embedded.places._lane_kernels import nearest_lane  # numba is slow

        points, nodes = self.graph.ground
        number = nearest_lane(points, nodes, spot.x, spot.y, spot.h)
        if number < 0:
            raise InputError(f"no lane leads past x={spot.x:g} m, y={spot.y:g} m")
        at = np.flatnonzero((nodes == number) | (nodes == number ^ 1))
        away = elementary.hypot(points[at, 0] - spot.x, points[at, 1] - spot.y)
        low, high = sorted(self.graph.ends[number].tolist())
        node = self.graph.nodes[number]
        s = low + (high - low) * int(np.argmin(away)) / (len(at) - 1)
        return self.graph.model.road(node.road_id), node.lane_id, s, 0.0

    def _nodes(self) -> Int:
        graph = self.graph
        roads = {road.id: number for number, road in enumerate(graph.model.roads)}
        sections = [node[:2] for node in graph.nodes]
        first: dict[tuple[str, int], int] = {}
        past: dict[tuple[str, int], int] = {}
        for number, section in enumerate(sections):
            first.setdefault(section, number)
            past[section] = number + 1
        rows = [
            (
                roads[node.road_id],
                first[node[:2]],
                past[node[:2]],
                node.lane_id,
                node.way,
                straight,
                graph.model.roads_by_id[node.road_id].direction(node.lane_id),
            )
            for node, straight in zip(graph.nodes, graph.straight.tolist(), strict=True)
        ]
        return np.array(rows, dtype=np.int64).reshape(-1, 7)

    def _way(self, places: Sequence[Place]) -> list[int]:
        """Return the nodes of the shortest way over places.

        A place on a lane that no lane link leads to is passed on the lane beside it that is
        reached soonest; where no lane leads there at all, lanes change on the way.
        """
        numbers = [self.graph.node(*place) for place in places]
        way = numbers[:1]
        for place, number in zip(places[1:], numbers[1:], strict=True):
            leg = self._leg(way[-1], number)
            way += self._changing(way[-1], place) if leg is None else leg[1:]
        return way

    def _changing(self, node: int, place: Place) -> list[int]:
        """Return the nodes after one on the way to a place, with lane changes.

        Raises:
            InputError: there is no such way.
        """
        graph = self.graph
        last = graph.nodes[node]
        start = Place(last.road_id, last.lane_id, float(graph.ends[node, 0]))
        steps = change_lanes(graph.model, start, place)
        middles = (Place(step.road_id, step.lane_id, 0.5 * (step.s + step.s_end)) for step in steps)
        nodes = [graph.node(*middle) for middle in middles]
        return [number for k, number in enumerate(nodes) if number != (nodes[k - 1] if k else node)]

    def _changes(self, way: Sequence[int]) -> bool:
        """Return whether a way leads from one lane to another beside it."""
        nodes = [self.graph.nodes[number] for number in way]
        return any(
            node[:2] == other[:2] and node.lane_id != other.lane_id
            for node, other in pairwise(nodes)
        )

    def _leg(self, start: int, end: int) -> list[int] | None:
        """Return the shortest way to a node, or to one abreast of it if that saves a detour."""
        near = self.graph.way(start, self._abreast(end))
        if near is None or near[-1] == end:
            return near
        exact = self.graph.way(start, [end])
        if exact and self.graph.length(exact) <= self.graph.length(near) + DETOUR:
            return exact
        return near

    def _abreast(self, node: int) -> list[int]:
        """Return the nodes of all lanes of a node's section in its direction."""
        first, past = self.nodes[node, 1:3].tolist()
        return [
            number for number in range(first, past) if self.nodes[number, 4] == self.nodes[node, 4]
        ]

    def plan(self, route: int, node: int) -> Path | None:
        """Return the way that begins where a node does; None: it does not come to the route.

        Along the rest of the route, if the node is on it or beside it; else by the shortest way
        to the route's first place that can be reached. Then straight on.
        """
        chain = self._joins(route, node) if route else [node]
        if chain is None:
            return None
        chain += self.graph.onward(chain[-1])[1:]
        try:
            made = self.graph.route(chain)
        except InputError:
            return None
        table, step = sampled(made)
        spans, follows = self.spans(made, chain), int(self.graph.straight[chain[-1]])
        rises = slopes(self.graph.model, made, step, len(table))
        return Path(table, step, spans, follows, rises)

    def _joins(self, route: int, node: int) -> list[int] | None:
        way = self.ways[route]
        on = [i for i, number in enumerate(way) if number == node] or [
            i for i, number in enumerate(way) if number in self._abreast(node)
        ]
        if on:
            return self._follow(node, way[on[0] :])
        for i, number in enumerate(way):
            leg = self._leg(node, number)
            if leg is not None:
                return leg[:-1] + self._follow(leg[-1], way[i:])
        return None

    def _follow(self, node: int, way: Sequence[int]) -> list[int]:
        """Return the nodes along a way from its first node, or from one abreast of it."""
        chain, i = [node], 0
        while i + 1 < len(way):
            for j in range(i + 1, min(i + 1 + AHEAD, len(way))):
                leg: Sequence[int] | None = way[i : j + 1]
                if chain[-1] != way[i] or self._changes(way[i : j + 1]):
                    leg = self._leg(chain[-1], way[j])
                if leg and self.graph.length(leg) <= self.graph.length(way[i : j + 1]) + DETOUR:
                    chain += leg[1:]
                    i = j
                    break
            else:
                break
        return chain

    def spans(self, route: Route, chain: Sequence[int]) -> Float:
        """Return the spans of a route along nodes, ``(J, 11)``."""
        rows: list[tuple[float, ...]] = []
        pieces = list(route.pieces)
        for step, number in zip(route.steps, chain, strict=True):
            low, high = min(step.s, step.s_end), max(step.s, step.s_end)
            while (
                pieces
                and pieces[0].road_id == step.road_id
                and (low <= 0.5 * (pieces[0].s + pieces[0].s_end) <= high)
            ):
                rows += self._spans_of(pieces.pop(0), number)
        return np.array(rows).reshape(-1, 11)

    def _spans_of(self, piece: Piece, number: int) -> list[tuple[float, ...]]:
        """Return the spans of a piece of a node's lane."""
        node = self.graph.nodes[number]
        road = self.graph.model.roads_by_id[node.road_id]
        station = np.linspace(0.0, piece.length, max(2, math.ceil(piece.length / SPAN) + 1))
        s = piece.s + piece.rate * station
        if piece.taper is not None:
            s = piece.s + (piece.taper.at(station)[4] - piece.taper.entry)
        s[-1] = piece.s_end
        edges = borders(road, node.section, s)
        inner = edges[node.lane_id - (1 if node.lane_id > 0 else -1)]
        t = 0.5 * (inner + edges[node.lane_id])
        if piece.is_aside and piece.taper is not None:
            a, b, c, d = piece.taper.t
            local = s - min(piece.s, piece.s_end)
            t = a + local * (b + local * (c + local * d))
        elif piece.is_aside:  # at a constant t
            line = reference_line(road, s[:1])
            x, y = piece.x - line.x, piece.y - line.y
            t = t * 0.0 + y * elementary.cos(line.h) - x * elementary.sin(line.h)
        drivable = [lane.id for lane in road.sections[node.section].lanes if lane.drivable]
        sides = [edges[0], *(edges[item] for item in drivable)]
        up, down = np.max(sides, axis=0) - t, t - np.min(sides, axis=0)
        left, right = (up, down) if node.way > 0 else (down, up)
        at = piece.station + station
        number_s = np.full(len(s) - 1, float(number))
        pairs = ((array[:-1], array[1:]) for array in (at, s, t, left, right))
        (begins, ends), (enters, leaves), *others = pairs
        columns = (
            begins,
            ends,
            enters,
            leaves,
            number_s,
            *(side for pair in others for side in pair),
        )
        return list(zip(*(column.tolist() for column in columns), strict=True))
