"""The lanes of an OpenDRIVE map, junctions included."""

import math
from collections.abc import Iterator

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lane_graph import LaneGraph, Node
from bridgegen.openx.opendrive.lanes import borders, points, section_end
from bridgegen.openx.opendrive.model import DRIVABLE, Lane, OpenDrive, Road
from bridgegen.recordings.lanes.model import NONE, STEP, Kind, RecordedLanes, Strip, along, assemble

KINDS: dict[str, Kind] = {
    **dict.fromkeys(DRIVABLE, "driving"),
    "biking": "bicycle",
    "sidewalk": "sidewalk",
    "walking": "sidewalk",
}
"""Kinds of lanes by OpenDRIVE's type; lanes of other types are left out."""
MOST_POINTS = 5_000_000
SHORTEST = 1e-3  # m; shorter lane sections are passed over


def lanes_of_map(model: OpenDrive, place: str) -> RecordedLanes:
    """Return the lanes of a map, in its coordinates.

    Args:
        model: the road network.
        place: what to call it in messages.

    Raises:
        InputError: it has no driving lane, or is too large.
    """
    most = (
        road.length * max(len(section.lanes) for section in road.sections) for road in model.roads
    )
    if sum(most) > MOST_POINTS * STEP:
        raise InputError(f"{place}: a map may have {MOST_POINTS * STEP / 1000:,.0f} km of lanes")
    graph = LaneGraph(model)
    known: dict[Node, int] = {}
    found: list[tuple[Node, Lane, int, Float, Float, Float]] = []
    group = 0
    for road in model.roads:
        for index in range(len(road.sections)):
            for way in (1, -1):
                made = list(_section(road, index, way))
                for lane, centre, width, station in made:
                    node = Node(road.id, index, lane.id, way)
                    known[node] = len(found)
                    found.append((node, lane, group, centre, width, station))
                group += bool(made)
    strips = [
        Strip(
            name=f"{node.road_id}:{node.section}:{node.lane_id}",
            kind=KINDS[lane.type],
            group=of,
            points=centre,
            width=width,
            station=station,
            left=_beside(model, node, lane, known, 1),
            right=_beside(model, node, lane, known, -1),
            opposite=_opposite(model, node, lane, known),
            successors=tuple(_onward(graph, node, known)),
        )
        for node, lane, of, centre, width, station in found
    ]
    if not any(strip.kind == "driving" for strip in strips):
        raise InputError(f"{place}: the map has no driving lane")
    return assemble("map", strips)


def _section(road: Road, index: int, way: int) -> Iterator[tuple[Lane, Float, Float, Float]]:
    """Yield the lanes of one direction of a section: centre, width, station along their middle."""
    section = road.sections[index]
    lanes = [
        lane for lane in section.lanes if lane.type in KINDS and road.direction(lane.id) == way
    ]
    length = section_end(road, index) - section.s
    if not lanes or length < SHORTEST:
        return
    s = section.s + np.linspace(0.0, length, max(2, math.ceil(length / STEP) + 1))
    edges = borders(road, index, s)
    sides = {
        lane.id: (edges[lane.id - int(math.copysign(1, lane.id))], edges[lane.id]) for lane in lanes
    }
    driving = [lane.id for lane in lanes if KINDS[lane.type] == "driving"] or list(sides)
    outer = np.array([side for number in driving for side in sides[number]])
    middle = points(road, s, 0.5 * (outer.min(axis=0) + outer.max(axis=0)))
    station = along(middle[::way])
    for lane in lanes:
        inner, border = sides[lane.id]
        centre = points(road, s, 0.5 * (inner + border))
        if along(centre)[-1] > SHORTEST:
            yield lane, centre[::way], np.abs(border - inner)[::way], station


def _beside(model: OpenDrive, node: Node, lane: Lane, known: dict[Node, int], side: int) -> int:
    """Return the lane to the left (1) or right (-1) of one, of its kind and direction."""
    beside = node.lane_id + side * node.way
    found = known.get(node._replace(lane_id=beside), NONE) if beside else NONE
    if found == NONE:
        return NONE
    other = model.roads_by_id[node.road_id].sections[node.section].lane(beside)
    return found if other is not None and KINDS[other.type] == KINDS[lane.type] else NONE


def _opposite(model: OpenDrive, node: Node, lane: Lane, known: dict[Node, int]) -> int:
    """Return the driving lane across the line between both directions."""
    if abs(node.lane_id) != 1 or KINDS[lane.type] != "driving":
        return NONE
    other = model.roads_by_id[node.road_id].sections[node.section].lane(-node.lane_id)
    if other is None or KINDS.get(other.type) != "driving":
        return NONE
    return known.get(node._replace(lane_id=-node.lane_id, way=-node.way), NONE)


def _onward(graph: LaneGraph, node: Node, known: dict[Node, int]) -> Iterator[int]:
    for number in graph.following[graph.numbers[node]]:
        following = graph.nodes[number]
        if following in known:
            yield known[following]
