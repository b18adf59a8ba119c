"""Ways from one lane to another that change lanes where no lane leads on.

A change takes place within one lane section, along a cubic from the one lane's centre to the
other's that has their directions at its ends.
"""

import heapq
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lanes import (
    Coefficients,
    borders,
    lane_at,
    section_end,
    section_index,
    shifted,
)
from bridgegen.openx.opendrive.model import LaneSection, OpenDrive, Road, RoadMark
from bridgegen.openx.opendrive.routes import (
    Place,
    Route,
    Step,
    Stretch,
    leg,
    next_stretches,
    route_along,
)

USUAL = 60.0
"""Length of a lane change where there is room [m]; ours: 4 to 5 s at 50 km/h."""

SHORTEST = 15.0
"""Shortest length of a lane change [m]; with less room there is none; ours."""

EVERY = 20.0
"""Distance between two places at which a change of the ego's route may begin [m]; ours."""

LEAST = 20.0
"""Length of the way from one lane to the other before an obstruction, where one has waited [m]:
room to see past it; ours."""

_COST = 200.0  # m of detour that a lane change is worth
_SLOPE = 0.1  # m, over which the slope of a lane's centre is taken


def plan_with_changes(model: OpenDrive, places: Sequence[tuple[str, int, float]]) -> Route:
    """Return a route over given places that changes lanes where it must.

    Args:
        model: the road network.
        places: road id, lane id and s [m] of each, the start first.

    Raises:
        InputError: a place is not on the road network, or there is no way from one to the next.
    """
    stops = [Place(*place) for place in places]
    for stop in stops:
        lane_at(model.road(stop.road_id), stop.lane_id, stop.s)
    if leads_round(model, stops):
        return passings(model, stops, USUAL)[0].route
    steps: list[Step] = []
    for start, end in pairwise(stops):
        try:
            # Without a lane change if there is a way: files of others mostly mean that, and it is
            # unique.
            steps += leg(model, start, end)
        except InputError:
            steps += change_lanes(model, start, end)
    return route_along(model, steps)


def change_lanes(model: OpenDrive, start: Place, end: Place) -> list[Step]:
    """Return the steps of the way from one place to another, with as few lane changes as may be.

    Where there is too little room to reach the lane of the other place, it is passed on a lane
    beside that.

    Raises:
        InputError: there is none, or too little room for its lane changes.
    """
    first, last = (
        Stretch(place.road_id, section_index(model.road(place.road_id), place.s), place.lane_id)
        for place in (start, end)
    )
    road = model.road(end.road_id)
    way = road.direction(end.lane_id)
    abreast = {
        last._replace(lane_id=lane.id)
        for lane in road.sections[last.section].lanes
        if lane.drivable and road.direction(lane.id) == way
    }
    try:
        return _steps(model, _chain(model, first, start, end, {last}), start, end)
    except InputError as error:
        try:
            return _steps(model, _chain(model, first, start, end, abreast), start, end)
        except InputError:
            # The first problem is the one to tell: the second search was for a lane that the file
            # did not name.
            raise error from None


@dataclass(frozen=True, slots=True)
class Turning:
    """A route that changes to the lane beside at one of the places where it may.

    Attributes:
        route: all of it.
        begins: where on it the change begins [m].
        length: of the change [m].
        across: how far left it leads [m], to the right negative.
        returns: where on the route it begins to return to its first lane [m]; +inf: it does not.
        back: length of that change [m].
        against: whether the other lane is one of oncoming traffic.
    """

    route: Route
    begins: float
    length: float
    across: float
    returns: float = math.inf
    back: float = 1.0
    against: bool = False


def turnings(model: OpenDrive, places: Sequence[Place], usual: float) -> list[Turning]:
    """Return the routes over four places that change lanes between the second and the third.

    One for every `EVERY` metres at which the change may begin, the first first; the last has just
    changed at the third place.

    Args:
        model: the road network.
        places: start; from where on it may change; by where it must have; end.
        usual: length of the change where there is room [m].

    Raises:
        InputError: there is no lane beside the third place that leads there, or too little room.
    """
    start, begin, by, end = places
    road = model.road(by.road_id)
    to = Stretch(road.id, section_index(road, by.s), by.lane_id)
    before = leg(model, start, begin)
    for item in _beside(model, to):
        entry = begin.s if begin.road_id == road.id else _ends(road, item)[0]
        try:
            before += leg(model, begin, Place(road.id, item.lane_id, entry))
            break
        except InputError:
            continue
    else:
        raise InputError(f"no lane leads from {begin} to a lane beside {by}")
    way = road.direction(by.lane_id)
    room = (by.s - entry) * way
    if room < SHORTEST:
        raise InputError(
            f"a lane change needs {SHORTEST:g} m of road, but there are {room:.3g} m on road "
            f"{road.id} from s={entry:g} m to s={by.s:g} m"
        )
    length = min(usual, room)
    found = []
    for ahead in np.linspace(0.0, room - length, 1 + int((room - length) / EVERY)).tolist():
        first = entry + way * ahead
        lead = [*before, Step(road.id, item.lane_id, entry, first)]
        until = Place(road.id, by.lane_id, first + way * length)
        steps = [*lead, *_change(road, item, to, first, until.s), *leg(model, until, end)]
        route = route_along(model, [step for step in steps if step.s != step.s_end])
        aside = _centre(road, to, first, by.s)[0] - _centre(road, item, first, by.s)[0]
        found.append(Turning(route, route_along(model, lead).length, length, way * aside))
    return found


def leads_round(model: OpenDrive, places: Sequence[Place]) -> bool:
    """Return whether a route over places passes something on a lane beside its own, and returns.

    It has six: start; from where on it may change; by where it must have, on the other lane; from
    where on it returns; by where it has, on its own; end.
    """
    if len(places) != 6:
        return False
    leaves, over, until, back = places[1:5]
    road = model.road(leaves.road_id)
    way, number = road.direction(leaves.lane_id), section_index(road, leaves.s)
    beside = [neighbour(road, leaves.lane_id, side) for side in (1, -1)]
    return (
        over.lane_id == until.lane_id in beside
        and back.lane_id == leaves.lane_id
        and all(
            (place.road_id, section_index(road, place.s)) == (road.id, number)
            for place in (over, until, back)
        )
        and all((b.s - a.s) * way >= 0.0 for a, b in pairwise((leaves, over, until, back)))
    )


def passings(model: OpenDrive, places: Sequence[Place], usual: float) -> list[Turning]:
    """Return the routes over six places that pass something, see `leads_round`.

    All have changed lanes by the third place; the first begins where the second is, or ``usual``
    [m] before the third, the others every `EVERY` metres later, the last `LEAST` before it.

    Raises:
        InputError: there is too little room, or no way to the second place or from the fifth.
    """
    start, leaves, over, until, back, end = places
    road = model.road(leaves.road_id)
    number, way = section_index(road, leaves.s), road.direction(leaves.lane_id)
    own = Stretch(road.id, number, leaves.lane_id)
    other = own._replace(lane_id=over.lane_id)
    room = min((over.s - leaves.s) * way, usual)
    for metres, a, b in ((room, leaves, over), ((back.s - until.s) * way, until, back)):
        if metres < SHORTEST:
            raise InputError(
                f"a lane change needs {SHORTEST:g} m of road, but there are {metres:.3g} m on road "
                f"{road.id} from s={a.s:g} m to s={b.s:g} m"
            )
    against = road.direction(over.lane_id) != way
    within = Step(road.id, other.lane_id, over.s, until.s)
    if against:
        within = replace(within, across=_cubic(road, other, other, over.s, until.s))
    returning, after = list(_change(road, other, own, until.s, back.s)), leg(model, back, end)
    found = []
    least = min(LEAST, room)
    for rest in np.linspace(room, least, 1 + int((room - least) / EVERY)).tolist():
        first = over.s - way * rest
        lead = leg(model, start, leaves._replace(s=first))
        steps = [*lead, *_change(road, own, other, first, over.s), within]
        begins, returns = (route_along(model, each).length for each in (lead, steps))
        steps += [*returning, *after]
        if against:
            # It stays one of its own lane, beside which it leads: what the map says of a lane of
            # oncoming traffic is said for the other direction.
            steps = [
                replace(step, lane_id=own.lane_id) if step.across is not None else step
                for step in steps
            ]
        route = route_along(model, [step for step in steps if step.s != step.s_end])
        aside = _centre(road, other, over.s, until.s)[0] - _centre(road, own, over.s, until.s)[0]
        length = abs(back.s - until.s)
        found.append(Turning(route, begins, rest, way * aside, returns, length, against))
    return found


def coming(model: OpenDrive, place: Place, end: Place, back: float) -> Route:
    """Return the way along which traffic comes to the lane section of a place, and goes on.

    It begins ``back`` [m] before the section, if lanes lead there for so long.

    Raises:
        InputError: no lane leads from the place to the end.
    """
    road = model.road(place.road_id)
    at = Stretch(road.id, section_index(road, place.s), place.lane_id)
    entry = _ends(road, at)[0]
    steps = leg(model, Place(road.id, at.lane_id, entry), end)
    every = [
        Stretch(each.id, number, lane.id)
        for each in model.roads
        for number, section in enumerate(each.sections)
        for lane in section.lanes
        if lane.drivable
    ]
    length = 0.0
    while length < back:
        before = next((item for item in every if at in next_stretches(model, item)), None)
        known = {(step.road_id, step.lane_id) for step in steps}
        if before is None or (before.road_id, before.lane_id) in known:
            break
        at, ends = before, _ends(model.road(before.road_id), before)
        length += abs(ends[1] - ends[0])
        steps.insert(0, Step(at.road_id, at.lane_id, *ends))
    return route_along(model, steps)


def _steps(model: OpenDrive, chain: list[Stretch], start: Place, end: Place) -> list[Step]:
    steps: list[Step] = []
    groups = [list(same) for _, same in groupby(chain, key=lambda stretch: stretch[:2])]
    for number, lanes in enumerate(groups):
        road = model.road(lanes[0].road_id)
        entry, leave = _ends(road, lanes[0])
        entry = start.s if number == 0 else entry
        leave = end.s if number == len(groups) - 1 else leave
        steps += _within(road, lanes, entry, leave)
    return steps


def _chain(
    model: OpenDrive, first: Stretch, start: Place, end: Place, targets: set[Stretch]
) -> list[Stretch]:
    """Return the lanes of the cheapest way, those beside each other where it changes (Dijkstra).

    A change costs the more, the less room there is for it.
    """
    sections = {target[:2] for target in targets}
    come_from: dict[Stretch, Stretch | None] = {}
    queue: list[tuple[float, int, Stretch, Stretch | None]] = [(0.0, 0, first, None)]
    count, found = 0, None
    while queue and found is None:
        cost, _, stretch, before = heapq.heappop(queue)
        if stretch in come_from:
            continue
        come_from[stretch] = before
        if stretch in targets:
            found = stretch
        entry, leave = _ends(model.road(stretch.road_id), stretch)
        entry = start.s if stretch[:2] == first[:2] else entry
        rest = abs(leave - entry)
        room = abs(end.s - entry) if stretch[:2] in sections else rest
        onward = [(rest, item) for item in next_stretches(model, stretch)]
        if room >= SHORTEST:
            # With little room a change costs more, so that it takes place where there is much.
            change = _COST * (1.0 + 2.0 * USUAL / room)
            onward += [(change, item) for item in _beside(model, stretch)]
        for more, following in onward:
            if following not in come_from:
                count += 1
                # The count breaks ties in the order of discovery, so that equal ways do not depend
                # on how lanes compare, and one file always gives one route.
                heapq.heappush(queue, (cost + more, count, following, stretch))
    if found is None:
        raise InputError(f"no lane leads from {start} to {end}, not with lane changes either")
    chain: list[Stretch] = []
    at: Stretch | None = found
    while at is not None:
        chain.append(at)
        at = come_from[at]
    return chain[::-1]


def _beside(model: OpenDrive, stretch: Stretch) -> Iterator[Stretch]:
    """Yield the driving lanes beside one, in its direction."""
    road = model.road(stretch.road_id)
    for lane in road.sections[stretch.section].lanes:
        # Lanes of one sign only: a route never leads over the oncoming lane.
        near = abs(lane.id - stretch.lane_id) == 1 and lane.id * stretch.lane_id > 0
        if near and lane.drivable:
            yield stretch._replace(lane_id=lane.id)


def _ends(road: Road, stretch: Stretch) -> tuple[float, float]:
    low, high = road.sections[stretch.section].s, section_end(road, stretch.section)
    return (low, high) if road.direction(stretch.lane_id) > 0 else (high, low)


def _within(road: Road, lanes: list[Stretch], entry: float, leave: float) -> Iterator[Step]:
    """Yield the steps through a lane section: one change after the other, then straight on."""
    room = abs(leave - entry) / max(len(lanes) - 1, 1)
    way = math.copysign(1.0, leave - entry)
    at = entry
    ahead = (leave - entry) * road.direction(lanes[0].lane_id) > 0.0
    if len(lanes) > 1 and not (ahead and room >= SHORTEST):
        raise InputError(
            f"a lane change needs {SHORTEST:g} m of road, but there are {room:.3g} m on road "
            f"{road.id} from s={entry:g} m to s={leave:g} m"
        )
    for stretch, other in pairwise(lanes):
        until = at + way * min(USUAL, room)
        yield from _change(road, stretch, other, at, until)
        at = until
    if at != leave or len(lanes) == 1:
        yield Step(road.id, lanes[-1].lane_id, at, leave)


def _change(road: Road, item: Stretch, other: Stretch, s: float, s_end: float) -> Iterator[Step]:
    """Yield a change from one lane to the next: half of it on either."""
    low, cubic = min(s, s_end), _cubic(road, item, other, s, s_end)
    # Half of the change counts as on each lane, so that who is asked which lane the entity is on
    # gets the nearer one.
    middle = 0.5 * (s + s_end)
    for stretch, first, last in ((item, s, middle), (other, middle, s_end)):
        across = shifted(cubic, min(first, last) - low)
        yield Step(road.id, stretch.lane_id, first, last, across)


def _cubic(road: Road, item: Stretch, other: Stretch, s: float, s_end: float) -> Coefficients:
    """Return the t of a way from one lane to the next, over the distance from the lesser s."""
    low, high = min(s, s_end), max(s, s_end)
    at_low, at_high = (item, other) if s < s_end else (other, item)
    a, b = _centre(road, at_low, low, high)
    c, d = _centre(road, at_high, high, low)
    span = high - low
    # The cubic with both lanes' places and slopes at its ends: without the slopes, a change in a
    # taper would begin and end with a kink.
    return (
        a,
        b,
        (3.0 * (c - a) / span - 2.0 * b - d) / span,
        (2.0 * (a - c) / span + b + d) / span**2,
    )


def _centre(road: Road, stretch: Stretch, s: float, towards: float) -> tuple[float, float]:
    """Return the t of a lane's centre [m] at one end of a change, and its slope there."""
    near = s + math.copysign(_SLOPE, towards - s)
    edges = borders(road, stretch.section, np.array([s, near]))
    lane = stretch.lane_id
    t = 0.5 * (edges[lane - (1 if lane > 0 else -1)] + edges[lane])
    return float(t[0]), float((t[1] - t[0]) / (near - s))


# --- The markings between lanes, and which changes of lane they allow ---
# Source: ASAM OpenDRIVE 1.7, section 9.6 (road markings): a lane's record describes its outer
# border, lane 0's the line between both sides; of a double line the inner one is named first, of
# lane 0's the left one.


NONE = "none"

CROSSED = frozenset(("none", "broken", "botts dots", "custom"))
"""Types of line that one may cross."""

UPWARDS, DOWNWARDS = ("increase", "both"), ("decrease", "both")
"""Values of laneChange that allow a change to a lane of a higher id, and of a lower one."""


def neighbour(road: Road, lane_id: int, side: int) -> int:
    """Return the id that a lane beside another has, whether or not there is one.

    Args:
        road: the road.
        lane_id: of the other, not 0.
        side: 1: to the left of its traffic, -1: to the right.
    """
    found = lane_id + side * road.direction(lane_id)
    return found if found else found + side * road.direction(lane_id)


def between(lane_id: int, other: int) -> int:
    """Return the lane whose outer border lies between two lanes beside each other; 0: the centre.

    The lanes are neighbours, see `neighbour`.
    """
    return 0 if lane_id * other < 0 else min(lane_id, other, key=abs)


def marking(section: LaneSection, lane_id: int, s: float) -> RoadMark | None:
    """Return the marking of a lane's outer border, if there is one.

    Args:
        section: of lanes.
        lane_id: the lane; 0: the centre.
        s: from the start of the section [m].
    """
    lane = section.lane(lane_id) if lane_id else next(iter(section.center), None)
    held = None
    for mark in sorted(lane.road_marks if lane else (), key=lambda each: each.s):
        if mark.s <= s or held is None:
            held = mark
    return held


def changes(section: LaneSection) -> list[float]:
    """Return where any marking of a section changes [m from its start]."""
    lanes = (*section.lanes, *section.center)
    return sorted({mark.s for lane in lanes for mark in lane.road_marks if mark.s > 0.0})


def allows_change(mark: RoadMark | None, border: int, lane_id: int, other: int) -> bool:
    """Return whether a marking allows to change from a lane to the one beside it.

    The attribute ``laneChange`` decides where the file has it, else the type: one may cross a line
    that is not solid, and of a double line if the one on one's own side is not.

    Args:
        mark: between both lanes; None: there is none.
        border: the lane whose outer border it marks, see `between`.
        lane_id: the lane.
        other: the lane beside it.
    """
    if mark is None:
        return True
    if mark.lane_change is not None:
        return mark.lane_change in (UPWARDS if other > lane_id else DOWNWARDS)
    lines = mark.type.split() if mark.type not in CROSSED else [mark.type]
    is_first = lane_id > other if border == 0 else lane_id == border
    return lines[0 if is_first else -1] in CROSSED


def marked_stretches(road: Road, number: int) -> list[tuple[float, float]]:
    """Return the stretches of a lane section on which no marking changes [m along the road]."""
    section, end = road.sections[number], section_end(road, number)
    cuts = [section.s, *(section.s + s for s in changes(section) if section.s + s < end), end]
    return list(pairwise(cuts))
