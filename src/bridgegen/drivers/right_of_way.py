"""Right of way where two routes cross: by signs and the map, else priority to the right.

Who goes first at a junction without lights, signs and priorities, the country of the roads says, if
it is known; see `bridgegen.scenario.countries`.

Sources: StVO § 8 (right of way: signs, else priority to the right), § 9 (a left turn waits for
oncoming traffic), § 10 (who comes from off the road), § 38 (blue light and siren; Vienna
Convention, Art. 34); sign numbers of the VzKat, which our own maps use, too.
"""

import math
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bridgegen.base.arrays import Int
from bridgegen.openx.opendrive.furniture import Signal
from bridgegen.openx.opendrive.lanes import borders, lane_pose, section_index
from bridgegen.openx.opendrive.legs import governs, signals_on
from bridgegen.openx.opendrive.model import DRIVABLE, OpenDrive, Road
from bridgegen.openx.opendrive.routes import Route, Step
from bridgegen.scenario.countries import country_of

# --- Why one of two participants goes first: the reasons of a claim (`right_of_way.claim`) ---


BY_MAP, BY_SIGNS, FROM_THE_RIGHT, ONCOMING, SIREN, OFF_ROAD = 1, 2, 3, 4, 5, 6
"""Rules of right of way: the junction's priorities, signs, priority to the right, the rule that a
left turn waits for oncoming traffic, that all give way to an emergency vehicle on a call, or that
who comes from off the road gives way to all on it."""


STOP_SIGN = "206"
WAIT = ("205", STOP_SIGN)
"""Signs: give way, stop."""
PRIORITY = ("301", "306")
"""Signs: right of way at this junction, priority road."""

NOBODY, PASSES = 1, 2
"""Claims of participants against themselves, which add up: of each where the law has no rule at
such a junction; of the ego whose route passes something on the lane of oncoming traffic."""

THEY_WAIT, NO_RULE, WE_WAIT = 1, 0, -1

OF_THE_ROAD = DRIVABLE | {"shoulder", "stop", "parking", "border", "biking", "median", "bus"}
"""Types of lanes from which one does not come onto the road, for one is on it."""

AT_JUNCTION = 40.0
"""Distance before a junction within which a sign is for that junction [m]."""
ASIDE = math.radians(45.0)
"""Largest angle between approaches of one direction; opposite ones differ by 180° less this."""


class Crossing(NamedTuple):
    """How a route goes through a junction."""

    junction: str
    before: Step
    inside: Step


def right_of_way(
    model: OpenDrive, own: Route, other: Route, lights: Collection[str] | None = None
) -> int:
    """Return which route gives way at the first junction that two routes have in common.

    ``THEY_WAIT`` only if a sign or the map makes them; a driver does not rely on priority to the
    right. ``NO_RULE`` where lights control the junction, or where the routes share none.

    Args:
        model: the road network.
        own: a route.
        other: another one.
        lights: ids of the traffic lights that are switched; others are off. None: all of the map's.
    """
    theirs = {crossing.junction: crossing for crossing in reversed(list(crossings(model, other)))}
    for ours in crossings(model, own):
        if ours.junction in theirs:
            return _waiting(model, ours, theirs[ours.junction], lights)
    return NO_RULE


def claim(model: OpenDrive, own: Route, other: Route, lights: Collection[str] | None = None) -> int:
    """Return which of two routes goes first at the first junction that they have in common.

    Unlike ``right_of_way``, on which a driver may rely, this is the law: it is antisymmetric, and
    includes priority to the right in both directions. Where lights control the junction, the claim
    only holds what they leave open: a left turn waits for oncoming traffic.

    Args:
        model: as for `right_of_way`.
        own: likewise.
        other: likewise.
        lights: likewise.

    Returns:
        > 0: the other route gives way; < 0: this one does; 0: no rule applies. The absolute value
        is the reason: ``BY_MAP``, ``BY_SIGNS``, ``FROM_THE_RIGHT`` or ``ONCOMING``.
    """
    theirs = {crossing.junction: crossing for crossing in reversed(list(crossings(model, other)))}
    for ours in crossings(model, own):
        if ours.junction in theirs:
            they = theirs[ours.junction]
            # Antisymmetric by this difference: both cannot have to wait, nor both go.
            return _claim(model, ours, they, lights) - _claim(model, they, ours, lights)
    return 0


def claims(
    model: OpenDrive,
    routes: Sequence[Route | None],
    ranks: Sequence[int] | Int,
    lights: Collection[str] | None = None,
) -> Int:
    """Return the `claim` of each of E routes against each other, ``(E, E)`` int64.

    Args:
        model: the road network.
        routes: of the participants; None off the lanes, which claims nothing.
        ranks: ``(E,)``: 1 of emergency vehicles on a call, -1 of who comes from off the road, else
            0; who has the lower one gives way, wherever.
        lights: as for `right_of_way`.
    """
    found = np.zeros((len(routes), len(routes)), dtype=np.int64)
    for a, own in enumerate(routes):
        for b, other in enumerate(routes[:a]):
            if ranks[a] != ranks[b]:
                reason = SIREN if max(ranks[a], ranks[b]) > 0 else OFF_ROAD
                found[a, b] = reason if ranks[a] > ranks[b] else -reason
            elif own is not None and other is not None:
                found[a, b] = claim(model, own, other, lights)
            found[b, a] = -found[a, b]
    if any(_nobody_first(road) for road in model.roads):
        np.fill_diagonal(found, NOBODY)
    return found


def is_off_road(road: Road, lane_id: int, s: float, aside: float) -> bool:
    """Return whether a place is beside the road: on a sidewalk or verge, say, or beyond them.

    Args:
        road: the road.
        lane_id: the lane from whose centre it counts.
        s: along the road [m].
        aside: left of that centre, seen along the road [m].
    """
    index = section_index(road, s)
    section = road.sections[index]
    outer = {lane: float(t[0]) for lane, t in borders(road, index, np.array([s])).items()}
    if lane_id == 0 or lane_id not in outer:
        return False
    t = 0.5 * (outer[lane_id] + outer[inner(lane_id)]) + aside
    edges = [
        sorted((outer[lane.id], outer[inner(lane.id)]))
        for lane in (*section.left, *section.right)
        if lane.type in OF_THE_ROAD
    ]
    return not any(low <= t <= high for low, high in edges)


def inner(lane_id: int) -> int:
    """Return the lane that is next to one towards the road's centre."""
    return lane_id - (1 if lane_id > 0 else -1)


def crossings(model: OpenDrive, route: Route) -> Iterator[Crossing]:
    """Yield a route's junctions in its order; not one that it begins in."""
    for before, step in zip(route.steps, route.steps[1:], strict=False):
        road = model.road(step.road_id)
        if road.is_connecting and not model.road(before.road_id).is_connecting:
            yield Crossing(road.junction, before, step)


def _claim(
    model: OpenDrive, ours: Crossing, theirs: Crossing, lights: Collection[str] | None
) -> int:
    """Return the reason why the other gives way at a junction, 0 if there is none."""
    if ours.before.road_id == theirs.before.road_id:
        return 0
    pairs = {(priority.high, priority.low) for priority in model.junction(ours.junction).priorities}
    inside = ours.inside.road_id, theirs.inside.road_id
    if inside in pairs or inside[::-1] in pairs:
        return BY_MAP if inside in pairs else 0
    our_signs, their_signs = _signs(model, ours.before), _signs(model, theirs.before)
    by_lights = _is_lit(model, ours, lights) or _is_lit(model, theirs, lights)
    difference = _priority(our_signs) - _priority(their_signs)
    if difference and not by_lights:
        return BY_SIGNS if difference > 0 else 0
    from_theirs = _turn(_heading(model, theirs.before), _heading(model, ours.before))
    if abs(from_theirs) >= math.pi - ASIDE:
        they_turn_left = _turns_left(model, theirs) and not _turns_left(model, ours)
        return ONCOMING if they_turn_left else 0
    if by_lights or _nobody_first(model.road(ours.before.road_id)):
        return 0
    return FROM_THE_RIGHT if from_theirs > ASIDE else 0


def _nobody_first(road: Road) -> bool:
    """Return whether nobody has priority by law where a road meets others without a sign."""
    countries = (country_of(kind.country or "") for kind in road.types)
    return any(country is not None and country.first is None for country in countries)


def _waiting(
    model: OpenDrive, ours: Crossing, theirs: Crossing, lights: Collection[str] | None
) -> int:
    if ours.before.road_id == theirs.before.road_id:
        return NO_RULE
    for priority in model.junction(ours.junction).priorities:
        if (priority.high, priority.low) == (ours.inside.road_id, theirs.inside.road_id):
            return THEY_WAIT
        if (priority.low, priority.high) == (ours.inside.road_id, theirs.inside.road_id):
            return WE_WAIT
    our_signs, their_signs = _signs(model, ours.before), _signs(model, theirs.before)
    # Lights go before signs (StVO § 37), and signs before the right.
    if _is_lit(model, ours, lights) or _is_lit(model, theirs, lights):
        return NO_RULE
    difference = _priority(our_signs) - _priority(their_signs)
    if difference:
        return THEY_WAIT if difference > 0 else WE_WAIT
    # Priority to the right makes the ego wait, and never the other: a driver does not rely on it.
    from_ours = _turn(_heading(model, ours.before), _heading(model, theirs.before))
    from_the_right = ASIDE < from_ours < math.pi - ASIDE
    towards = abs(from_ours) >= math.pi - ASIDE
    we_turn_left = towards and _turns_left(model, ours) and not _turns_left(model, theirs)
    return WE_WAIT if from_the_right or we_turn_left else NO_RULE


def _signs(model: OpenDrive, step: Step) -> list[Signal]:
    """Return the signals that a lane passes just before a junction."""
    road = model.road(step.road_id)
    by_id = {signal.id: signal for each in model.roads for signal in each.signals}
    return [
        by_id[item.id]
        for item in signals_on(road)
        if item.id in by_id
        and governs(road, item, step.lane_id)
        and abs(item.s - step.s_end) <= AT_JUNCTION
    ]


def _is_lit(model: OpenDrive, crossing: Crossing, lights: Collection[str] | None) -> bool:
    """Return whether a light that is switched controls a way through a junction.

    It stands before the junction or on the way itself.
    """
    way = model.road(crossing.inside.road_id)
    within = [
        signal.id for signal in signals_on(way) if governs(way, signal, crossing.inside.lane_id)
    ]
    ids = {sign.id for sign in _signs(model, crossing.before) if sign.dynamic == "yes"}
    if within:
        ids |= {
            signal.id
            for road in model.roads
            for signal in road.signals
            if signal.dynamic == "yes" and signal.id in within
        }
    return bool(ids if lights is None else ids.intersection(lights))


def _priority(signs: list[Signal]) -> int:
    """Return 1 with priority signs, -1 with signs to give way, 0 without signs."""
    types = {sign.type for sign in signs}
    return int(not types.isdisjoint(PRIORITY)) - int(not types.isdisjoint(WAIT))


def _heading(model: OpenDrive, step: Step) -> float:
    """Return the heading of a lane at the end of a step [rad]."""
    return lane_pose(model.road(step.road_id), step.lane_id, step.s_end).h


def _turn(a: float, b: float) -> float:
    """Return b − a within ±π [rad]."""
    return math.remainder(b - a, 2.0 * math.pi)


def _turns_left(model: OpenDrive, crossing: Crossing) -> bool:
    return _turn(_heading(model, crossing.before), _heading(model, crossing.inside)) > ASIDE
