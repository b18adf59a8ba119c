"""From one lane to another along the road network: which lanes, and where their centre runs.

A route keeps to its lane until a lane link leads on: it changes roads, not lanes, unless it is
planned with lane changes (`bridgegen.openx.opendrive.lane_changes`).
"""

import heapq
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lanes import Coefficients, lane_at, section_end, section_index
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.path import LanePath, Piece, joined, pieces_of, sample

NEAR = 1e-3  # m, over which the slope of a curve is taken


class Place(NamedTuple):
    """A place on a lane: OpenSCENARIO's LanePosition without an offset.

    Attributes:
        road_id: OpenDRIVE's id.
        lane_id: OpenDRIVE's id.
        s: along the road [m].
    """

    road_id: str
    lane_id: int
    s: float

    def __str__(self) -> str:
        return f"road {self.road_id}, lane {self.lane_id}, s={self.s:g} m"


class Stretch(NamedTuple):
    """A lane of one lane section: a node of the network."""

    road_id: str
    section: int
    lane_id: int


@dataclass(frozen=True, slots=True)
class Step:
    """A part of a route on one lane section, from ``s`` to ``s_end`` [m along the road].

    Attributes:
        road_id: OpenDRIVE's id.
        lane_id: OpenDRIVE's id.
        s: where it begins.
        s_end: where it ends.
        across: where it leads instead of along the lane's centre: t [m] over the distance from
            the lesser s, in a lane change.
    """

    road_id: str
    lane_id: int
    s: float
    s_end: float
    across: Coefficients | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Route:
    """A chain of lanes.

    Attributes:
        steps: the lanes, in the order of travel.
        length: of the lanes' centre line [m].
        pieces: that centre line, see `bridgegen.openx.opendrive.path`.
    """

    steps: tuple[Step, ...]
    length: float
    pieces: tuple[Piece, ...]

    def sample(self, ds: float) -> LanePath:
        """Return the lanes' centre line at every ``ds`` [m] travelled.

        Raises:
            InputError: the step is not positive, or there would be too many samples.
        """
        return sample(self.pieces, self.length, ds)

    def station(self, road_id: str, s: float) -> tuple[float, float]:
        """Return a, b with: distance travelled on the route = a + b · s around a place.

        Exact at the place, and as long as s stays on the same line or arc of the reference line;
        a place on one of the route's roads before its start or after its end continues the nearest
        piece.

        Raises:
            InputError: the route does not use the road.
        """
        nearest = min(self.on_road(road_id), key=lambda piece: _away(piece, s))
        if nearest.taper is not None:
            here, further = nearest.stations(np.array([s, s + NEAR]))
            b = float(further - here) / NEAR
            return float(here) - b * s, b
        b = nearest.length / (nearest.s_end - nearest.s)
        return nearest.station - b * nearest.s, b

    def stations(self, road_id: str, s: Float) -> Float:
        """Return the distances travelled up to places on a road, ``(P,)`` float64 [m].

        Args:
            road_id: OpenDRIVE's id.
            s: ``(P,)`` along that road [m].

        Raises:
            InputError: the route does not use the road.
        """
        on_road = self.on_road(road_id)
        away = np.array([[_away(piece, item) for piece in on_road] for item in s.tolist()])
        away = away.reshape(len(s), len(on_road))  # also of no places
        nearest, found = away.argmin(axis=1), np.empty(len(s))
        for i, piece in enumerate(on_road):
            found[nearest == i] = piece.stations(s[nearest == i])
        return found

    def is_even(self, road_id: str) -> bool:
        """Whether ``station`` is exact for all places on a road: it is one line or arc."""
        pieces = self.on_road(road_id)
        return len(pieces) == 1 and pieces[0].taper is None

    def on_road(self, road_id: str) -> list[Piece]:
        """Return the pieces on a road; the first of the nearest ones counts.

        Raises:
            InputError: the route does not use the road.
        """
        found = [piece for piece in self.pieces if piece.road_id == road_id]
        if not found:
            roads = ", ".join(dict.fromkeys(step.road_id for step in self.steps))
            raise InputError(f"the route runs over roads {roads}, got road {road_id}")
        return found


def plan_route(
    model: OpenDrive,
    start: tuple[str, int, float],
    via: Sequence[tuple[str, int, float]],
    end: tuple[str, int, float],
) -> Route:
    """Return the shortest route over given places, without a lane change.

    Args:
        model: the road network.
        start: road id, lane id and s [m] of the start.
        via: places to pass, in this order.
        end: where the route ends.

    Raises:
        InputError: a place is not on the road network, or no lane leads from one to the next.
    """
    places = [Place(*place) for place in (start, *via, end)]
    for place in places:
        lane_at(model.road(place.road_id), place.lane_id, place.s)
    steps: list[Step] = []
    for a, b in pairwise(places):
        steps += leg(model, a, b)
    return route_along(model, steps)


def route_along(model: OpenDrive, steps: Sequence[Step]) -> Route:
    """Return the centre line of lanes that follow one another.

    Raises:
        InputError: the lanes have no length, or one folds over in a bend.
    """
    pieces: list[Piece] = []
    station = 0.0
    for step in steps:
        road = model.road(step.road_id)
        if step.s != step.s_end:
            index = section_index(road, 0.5 * (step.s + step.s_end))
            found = pieces_of(road, index, step.lane_id, step.s, step.s_end, station, step.across)
            pieces += found
            station = sum((piece.length for piece in found), station)
    if not pieces:
        raise InputError(
            "a route must have a length, got one that ends where it starts: "
            f"road {steps[0].road_id}, lane {steps[0].lane_id}, s={steps[0].s:g} m"
        )
    return Route(tuple(steps), station, tuple(joined(pieces)))


def next_stretches(model: OpenDrive, stretch: Stretch) -> Iterator[Stretch]:
    """Yield the lanes that a lane leads to, in the direction of travel."""
    road = model.roads_by_id[stretch.road_id]
    forward = road.direction(stretch.lane_id) > 0
    lane = road.sections[stretch.section].lane(stretch.lane_id)
    if lane is None:
        return
    onward = lane.successors if forward else lane.predecessors
    index = stretch.section + (1 if forward else -1)
    if 0 <= index < len(road.sections):
        yield from (Stretch(road.id, index, lane_id) for lane_id in onward)
        return
    link = road.link("end" if forward else "start")
    if link is None:
        return
    if link.element_type == "road":
        for lane_id in onward:
            yield from _enter(model, link.element_id, link.contact_point, lane_id)
        return
    for connection in model.connections_from.get((link.element_id, road.id), ()):
        for each in connection.lane_links:
            if each.from_lane == lane.id:
                contact = connection.contact_point
                yield from _enter(model, connection.entered_road, contact, each.to_lane)


def _enter(model: OpenDrive, road_id: str, contact: str | None, lane_id: int) -> Iterator[Stretch]:
    """Yield a road's lane at one of its ends, if traffic on it leads away from there."""
    road = model.road(road_id)
    inwards = 1 if contact == "start" else -1
    if road.direction(lane_id) == inwards:
        yield Stretch(road_id, 0 if inwards > 0 else len(road.sections) - 1, lane_id)


def leg(model: OpenDrive, start: Place, end: Place) -> list[Step]:
    """Return the steps of the shortest way from one place to the next (Dijkstra).

    Raises:
        InputError: there is none without a lane change.
    """
    first, last = _stretch(model, start), _stretch(model, end)
    way = model.roads_by_id[start.road_id].direction(start.lane_id)
    if first == last and (end.s - start.s) * way >= 0.0:
        return [Step(start.road_id, start.lane_id, start.s, end.s)]
    # The start counts from its place to the lane's end; it is not "seen", so that a way back to
    # a place behind it is found.
    come_from: dict[Stretch, Stretch | None] = {}
    rest = abs(_ends(model, first)[1] - start.s)
    queue: list[tuple[float, int, Stretch, Stretch | None]] = []
    count = 0
    for following in next_stretches(model, first):
        count += 1
        heapq.heappush(queue, (rest, count, following, None))
    while queue:
        distance, _, stretch, before = heapq.heappop(queue)
        if stretch in come_from:
            continue
        come_from[stretch] = before
        if stretch == last:
            break
        entry, exit_ = _ends(model, stretch)
        for following in next_stretches(model, stretch):
            if following not in come_from:
                count += 1
                heapq.heappush(queue, (distance + abs(exit_ - entry), count, following, stretch))
    else:
        raise InputError(f"no lane leads from {start} to {end} without a lane change")
    chain: list[Stretch] = []
    at: Stretch | None = last
    while at is not None:
        chain.append(at)
        at = come_from[at]
    steps = [Step(start.road_id, start.lane_id, start.s, _ends(model, first)[1])]
    steps += [Step(item.road_id, item.lane_id, *_ends(model, item)) for item in chain[:0:-1]]
    return [*steps, Step(end.road_id, end.lane_id, _ends(model, last)[0], end.s)]


def _stretch(model: OpenDrive, place: Place) -> Stretch:
    road = model.road(place.road_id)
    return Stretch(place.road_id, section_index(road, place.s), place.lane_id)


def _ends(model: OpenDrive, stretch: Stretch) -> tuple[float, float]:
    """Return where traffic enters and leaves a lane of a section [m along the road]."""
    road: Road = model.roads_by_id[stretch.road_id]
    low, high = road.sections[stretch.section].s, section_end(road, stretch.section)
    return (low, high) if road.direction(stretch.lane_id) > 0 else (high, low)


def _away(piece: Piece, s: float) -> float:
    """Return how far a place is outside a piece [m]; 0 within."""
    low, high = min(piece.s, piece.s_end), max(piece.s, piece.s_end)
    return max(low - s, s - high, 0.0)
