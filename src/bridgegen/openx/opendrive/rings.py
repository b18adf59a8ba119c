"""The roundabouts of a map: rings of one-way roads, and the legs that touch them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bridgegen.openx.opendrive.geometry import reference_line
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.routes import Stretch, next_stretches

LONGEST = 400.0
"""Largest length of a ring [m]; ours: a diameter of 127 m."""

_MOST_ROADS = 40  # of a ring
_SLACK = 0.35  # rad, by which the turning around a ring may differ from a whole turn
_STEP = 1.0  # m, between places at which the curvature is looked at


@dataclass(frozen=True, slots=True)
class Ring:
    """A roundabout.

    Attributes:
        roads: ids of those that lead around, in the order of travel.
        junctions: ids of those on it, in that order.
        ends: the ends of the roads that touch it, and are no part of it.
    """

    roads: tuple[str, ...]
    junctions: tuple[str, ...]
    ends: tuple[tuple[Road, str], ...]

    @property
    def id(self) -> str:
        """What it is called: its junctions, ``3+7+9``."""
        return "+".join(self.junctions)


def rings(model: OpenDrive) -> Iterator[Ring]:
    """Yield the roundabouts of a map, each once.

    A ring leads around to the left where traffic drives on the right, and the other way round.
    """
    ways = {road.id: way for road in model.roads if (way := _one_way(road))}
    onward = {road_id: tuple(_onward(model, road_id, ways)) for road_id in ways}
    seen: set[frozenset[str]] = set()
    for road_id in ways:
        for cycle in _cycles(model, road_id, onward):
            key = frozenset(cycle)
            if key in seen:
                continue
            seen.add(key)
            whole = math.tau if model.road(road_id).rule == "RHT" else -math.tau
            # A block of one-way streets is a cycle, too. Around a roundabout the road turns by one
            # turn, to the side on which traffic gives way.
            if abs(sum(_turning(model.road(name), ways[name]) for name in cycle) - whole) < _SLACK:
                ring = _ring(model, cycle)
                if len(ring.ends) > 1:
                    yield ring


def _one_way(road: Road) -> int:
    """Return the way that all traffic of a road takes along its reference line; 0: both."""
    ways = {
        road.direction(lane.id)
        for section in road.sections
        for lane in section.lanes
        if lane.drivable
    }
    return ways.pop() if len(ways) == 1 else 0


def _onward(model: OpenDrive, road_id: str, ways: dict[str, int]) -> Iterator[str]:
    """Yield the one-way roads that a road leads to."""
    road = model.road(road_id)
    last = len(road.sections) - 1 if ways[road_id] > 0 else 0
    found = dict.fromkeys(
        following.road_id
        for lane in road.sections[last].lanes
        if lane.drivable
        for following in next_stretches(model, Stretch(road_id, last, lane.id))
    )
    yield from (name for name in found if name in ways and name != road_id)


def _cycles(
    model: OpenDrive, start: str, onward: dict[str, tuple[str, ...]]
) -> Iterator[tuple[str, ...]]:
    """Yield the ways from a road back to it, over roads that come after it in the file."""
    order = {road.id: number for number, road in enumerate(model.roads)}
    todo: list[tuple[tuple[str, ...], float]] = [((start,), model.road(start).length)]
    while todo:
        path, length = todo.pop()
        for following in onward[path[-1]]:
            if following == start:
                yield path
            elif (
                following not in path
                # Each cycle is found from its first road in the file alone; with the bounds of
                # number and length, the search ends on any map.
                and order[following] > order[start]
                and len(path) < _MOST_ROADS
                and length + model.road(following).length <= LONGEST
            ):
                todo.append(((*path, following), length + model.road(following).length))


def _turning(road: Road, way: int) -> float:
    """Return by how much a road turns in the direction of travel [rad], left positive."""
    s = np.linspace(0.0, road.length, 2 + int(road.length / _STEP))
    return way * float(np.trapezoid(reference_line(road, s).curvature, s))


def _ring(model: OpenDrive, cycle: tuple[str, ...]) -> Ring:
    roads = [model.road(name) for name in cycle]
    junctions: dict[str, None] = {}
    for road in roads:
        if road.is_connecting:
            junctions[road.junction] = None
        for link in (road.predecessor, road.successor):
            if link is not None and link.element_type == "junction":
                junctions[link.element_id] = None
    ends = [
        (road, end)
        for road in model.roads
        if road.id not in cycle and not road.is_connecting
        for end in ("start", "end")
        if any(end in road.ends_at(junction) for junction in junctions)
        and any(lane.drivable for lane in road.section_at(end).lanes)
    ]
    return Ring(cycle, tuple(junctions), tuple(ends))
