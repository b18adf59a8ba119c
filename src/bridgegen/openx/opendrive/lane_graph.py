"""The lanes of a road network as a graph: what follows what, what lies beside, what is nearest.

A node is a lane of one lane section, travelled in one of both directions: overtaking traffic on the
oncoming lane travels it against its own traffic. Nodes are numbered in the order of the file.
"""

import heapq
import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.openx.opendrive.geometry import reference_line, reference_pose
from bridgegen.openx.opendrive.lanes import borders, lane_at, section_end, section_index
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.routes import Route, Step, Stretch, next_stretches, route_along

ONWARD = 1000.0
"""Length of a planned path without a destination [m]; where it ends, the next one begins."""
GROUND_STEP = 1.0  # m, between two points of the ground


class Node(NamedTuple):
    """A lane of a lane section and a direction of travel: 1 along the reference line, or -1."""

    road_id: str
    section: int
    lane_id: int
    way: int


class Ground(NamedTuple):
    """Points of the centres of all drivable lanes, in the direction of their traffic.

    Attributes:
        points: ``(G, 4)`` float64: x, y [m], heading [rad], half the lane's width [m].
        nodes: ``(G,)`` int64, the node that each lies on, -1 for none.
    """

    points: Float
    nodes: Int


class Cells(NamedTuple):
    """All lanes but those of type "none", cut across every ``GROUND_STEP`` along the road.

    Attributes:
        corners: ``(Q, 8)`` float64: x, y [m] of four corners, one after the other around a cell.
        nodes: ``(Q,)`` int64, the node of each, along its lane's traffic.
    """

    corners: Float
    nodes: Int


class LaneGraph:
    """The lanes of a road network.

    Attributes:
        model: the road network.
        nodes: S lanes with a direction of travel.
        numbers: their numbers.
        ends: ``(S, 2)`` float64, where a node is entered and left [m along the road].
    """

    def __init__(self, model: OpenDrive) -> None:
        self.model = model
        self.nodes = tuple(
            Node(road.id, index, lane.id, way)
            for road in model.roads
            for index, section in enumerate(road.sections)
            for lane in section.lanes
            for way in (1, -1)
        )
        self.numbers = {node: number for number, node in enumerate(self.nodes)}
        self.ends = np.array([self._ends(node) for node in self.nodes]).reshape(-1, 2)

    def _ends(self, node: Node) -> tuple[float, float]:
        road = self.model.roads_by_id[node.road_id]
        low, high = road.sections[node.section].s, section_end(road, node.section)
        return (low, high) if node.way > 0 else (high, low)

    def node(self, road_id: str, lane_id: int, s: float, *, against: bool = False) -> int:
        """Return the node of a place on a lane, in or against its traffic's direction.

        Raises:
            InputError: it is not on the road network.
        """
        road = self.model.road(road_id)
        lane_at(road, lane_id, s)
        way = road.direction(lane_id) * (-1 if against else 1)
        return self.numbers[Node(road_id, section_index(road, s), lane_id, way)]

    def in_section(self, node: int, lane_id: int) -> int | None:
        """Return the node of another lane beside a node, in the same direction; or None."""
        return self.numbers.get(self.nodes[node]._replace(lane_id=lane_id))

    @cached_property
    def following(self) -> tuple[tuple[int, ...], ...]:
        """Per node those that it leads to, in the order of the file."""
        leads: list[list[int]] = [[] for _ in self.nodes]
        for number, node in enumerate(self.nodes):
            road = self.model.roads_by_id[node.road_id]
            if road.direction(node.lane_id) != node.way:
                continue
            for stretch in next_stretches(self.model, Stretch(*node[:3])):
                there = self.model.roads_by_id[stretch.road_id].direction(stretch.lane_id)
                target = self.numbers.get(Node(*stretch, there))
                if target is not None and target not in leads[number]:
                    leads[number].append(target)
                    # … and traffic in the other direction comes back
                    leads[target ^ 1].append(number ^ 1)
        return tuple(map(tuple, leads))

    @cached_property
    def straight(self) -> Int:
        """``(S,)`` the node that goes straightest on from each, -1 where the road ends.

        Told by the heading where the next node is left; of two alike, the file's first.
        """
        found = np.full(len(self.nodes), -1)
        for number, onward in enumerate(self.following):
            if len(onward) == 1:
                found[number] = onward[0]
            elif onward:
                heading = self._heading(number)
                turns = [
                    abs(math.remainder(self._heading(item) - heading, math.tau)) for item in onward
                ]
                found[number] = onward[int(np.argmin(np.round(turns, 6)))]
        return found

    def _heading(self, number: int) -> float:
        """Return the direction of travel where a node is left [rad]."""
        node = self.nodes[number]
        road = self.model.roads_by_id[node.road_id]
        return reference_pose(road, float(self.ends[number, 1])).h + (
            0.0 if node.way > 0 else math.pi
        )

    def onward(self, node: int, metres: float = ONWARD) -> list[int]:
        """Return the nodes that one comes by going straight on from a node's start."""
        chain, length = [node], self._length(node)
        while length < metres:
            node = int(self.straight[node])
            if node < 0:
                break
            chain.append(node)
            length += self._length(node)
        return chain

    def way(self, start: int, targets: Iterable[int]) -> list[int] | None:
        """Return the nodes of the shortest way from one to any of others (Dijkstra), or None."""
        wanted = frozenset(targets)
        come_from: dict[int, int] = {}
        queue = [(0.0, start, -1)]
        while queue:
            distance, node, before = heapq.heappop(queue)
            if node in come_from:
                continue
            come_from[node] = before
            if node in wanted:
                chain = [node]
                while chain[-1] != start:
                    chain.append(come_from[chain[-1]])
                return chain[::-1]
            for following in self.following[node]:
                if following not in come_from:
                    heapq.heappush(queue, (distance + self._length(node), following, node))
        return None

    def length(self, chain: Sequence[int]) -> float:
        """Return how far it is from the start of the first node to that of the last [m]."""
        return sum(self._length(node) for node in chain[:-1])

    def _length(self, node: int) -> float:
        return abs(float(self.ends[node, 1] - self.ends[node, 0]))

    def route(self, chain: Iterable[int]) -> Route:
        """Return the centre line of nodes that follow one another.

        Raises:
            InputError: a lane folds over in a bend, or the way has no length.
        """
        steps = []
        for number in chain:
            node = self.nodes[number]
            entry, leave = self.ends[number].tolist()
            steps.append(Step(node.road_id, node.lane_id, entry, leave))
        return route_along(self.model, steps)

    @cached_property
    def ground(self) -> Ground:
        """Points on all drivable lanes, at most ``GROUND_STEP`` apart; the first is on none."""
        points, nodes = [np.zeros((1, 4))], [np.array([-1])]
        for road in self.model.roads:
            for index, section in enumerate(road.sections):
                drivable = [lane.id for lane in section.lanes if lane.drivable]
                length = section_end(road, index) - section.s
                if not drivable or length <= 0.0:
                    continue
                s = (
                    np.linspace(0.0, length, max(2, math.ceil(length / GROUND_STEP) + 1))
                    + section.s
                )
                line, edges = reference_line(road, s), borders(road, index, s)
                for lane_id in drivable:
                    inner, outer = edges[lane_id - int(math.copysign(1, lane_id))], edges[lane_id]
                    t, way = 0.5 * (inner + outer), road.direction(lane_id)
                    tilt = elementary.atan2(np.gradient(t, s), 1.0 - line.curvature * t)
                    points.append(
                        np.stack(
                            (
                                line.x - t * elementary.sin(line.h),
                                line.y + t * elementary.cos(line.h),
                                line.h + tilt + (0.0 if way > 0 else math.pi),
                                0.5 * np.abs(outer - inner),
                            ),
                            axis=1,
                        )
                    )
                    number = self.numbers[Node(road.id, index, lane_id, way)]
                    nodes.append(np.full(len(s), number))
        return Ground(np.concatenate(points), np.concatenate(nodes))

    @cached_property
    def cells(self) -> Cells:
        """Where all lanes are, as cells."""
        corners, nodes = [np.empty((0, 8))], [np.empty(0, np.int64)]
        for road in self.model.roads:
            for index, section in enumerate(road.sections):
                length = section_end(road, index) - section.s
                lanes = [lane.id for lane in section.lanes if lane.type != "none"]
                if not lanes or length <= 0.0:
                    continue
                s = section.s + np.linspace(
                    0.0, length, max(2, math.ceil(length / GROUND_STEP) + 1)
                )
                line, edges = reference_line(road, s), borders(road, index, s)
                sine, cosine = elementary.sin(line.h), elementary.cos(line.h)
                for lane_id in lanes:
                    sides = (edges[lane_id - int(math.copysign(1, lane_id))], edges[lane_id])
                    (ax, ay), (bx, by) = ((line.x - t * sine, line.y + t * cosine) for t in sides)
                    around = (ax[:-1], ay[:-1], bx[:-1], by[:-1], bx[1:], by[1:], ax[1:], ay[1:])
                    corners.append(np.stack(around, axis=1))
                    node = Node(road.id, index, lane_id, road.direction(lane_id))
                    nodes.append(np.full(len(s) - 1, self.numbers[node]))
        return Cells(np.concatenate(corners), np.concatenate(nodes))
