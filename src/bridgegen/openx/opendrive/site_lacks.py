"""What a place of a map lacks of what a scenario uses: lanes, lengths, ways, bends, lights."""

import math
from collections.abc import Iterator

from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.site_adapted import adapted, has_way
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.story import Arrival, Waypoint
from bridgegen.scenario.ontology.site import Site

TURN_TOLERANCE = 60.0
"""How far a turn may differ from the scenario's [deg]: half a T-junction's, and more."""

NARROWEST_LANE = 2.0
"""What participants drive on is nowhere narrower [m]; ours, for lanes begin and end at 0 m."""

OVERHANG = 0.5
"""By how much a participant may be wider than the strip that it starts on [m]; ours."""

SHARE_OF_TURN = 0.5
"""How much of the turning of a scenario's road a map's road must have at least; ours."""


def missing(scenario: LogicalScenario, model: OpenDrive, site: Site) -> list[str]:
    """Return what a place lacks of what a scenario uses: lanes, lengths, ways across, bends.

    Args:
        scenario: what shall take place there.
        model: the road network.
        site: the place, with its legs named as the scenario's.
    """
    if chosen := [one for one in scenario.participants if one.ways]:
        by = f"{chosen[0].place_by} chooses where {chosen[0].name} starts"
        return [f"roads of the scenario's own ({by}, and a map is found for one place only)"]
    scenario, _ = adapted(scenario, model, site)
    found = sorted({_missing(site, *one, False) for one in _places(scenario)} - {""})
    found += sorted({_missing(site, one, 0.0, True) for one in ends_of(scenario)} - {""})
    first, last = within = reach(scenario)
    wanted, there = turning(scenario, *within), site.legs[0].turning(*within)
    if there < SHARE_OF_TURN * wanted:
        found.append(
            f"a bend between {first:.4g} m and {last:.4g} m (the road turns by "
            f"{math.degrees(there):.0f}° there, the scenario's by {math.degrees(wanted):.0f}°)"
        )
    found += [*_crosses(scenario, site), *_unlit(scenario, site), *_works(scenario, site)]
    if found:
        return found
    for one in scenario.story.participants:
        if one.end is not None and isinstance(one.start.lane, int) and not one.path:
            found.append(_no_way(scenario, model, site, one.name, one.start, one.end))
    return sorted(set(found) - {""})


def _crosses(scenario: LogicalScenario, site: Site) -> Iterator[str]:
    """Yield the crosswalks that pedestrians cross on, and that are not there."""
    for one in scenario.participants:
        place = one.start
        if len({(point.leg, point.way) for point in one.path}) < 2:
            continue
        there = [
            walk
            for walk in site.facilities
            if (walk.cls, walk.leg) == ("Crosswalk", place.leg)
            and not isinstance(place.distance, str)
            and abs(walk.distance - place.distance) <= 0.5 * (walk.width or 0.0)
        ]
        if not there:
            where = f"at {place.distance} m on leg {place.leg}"
            yield f"a crosswalk where {one.name} crosses, {where}"


def _unlit(scenario: LogicalScenario, site: Site) -> Iterator[str]:
    """Yield the legs that a scenario has lights on, and the place has not."""
    if scenario.roads.signals != "none":
        lit = {one.leg for one in site.facilities if one.cls == "TrafficLight"}
        legs = sorted({one.start.leg for one in scenario.participants if not one.path} - lit)
        yield from (f"a traffic light on leg {leg}" for leg in legs)


def _works(scenario: LogicalScenario, site: Site) -> Iterator[str]:
    """Yield road works that are longer than their road, or that close another than its last lane.

    The sign stands beside the road: the lane that is closed is the outermost, as in the scenario.
    """
    for works in scenario.story.works:
        start, leg = works.start, site.leg(works.start.leg)
        lanes = len(leg.roads[0].along(start.way)) if leg is not None else 0
        outermost = scenario.roads.lanes(start.leg, start.way)
        if lanes > 0 and start.lane == outermost and start.lane != lanes:
            yield f"{works.name} on the outermost lane (leg {start.leg} {start.way} has {lanes})"
        places = [one.distance for one in (works.start, works.sign, *works.cones)]
        farthest = max((one for one in places if not isinstance(one, str)), default=0.0)
        if leg is not None and farthest > leg.roads[0].length:
            yield (
                f"room for {works.name} on one road, {farthest:g} m (road {leg.roads[0].road_id} "
                f"has {leg.roads[0].length:.4g} m)"
            )


def _no_way(
    scenario: LogicalScenario,
    model: OpenDrive,
    site: Site,
    name: str,
    start: Waypoint,
    end: Waypoint,
) -> str:
    """Return why a participant cannot drive from its start to its end; empty where it can."""
    if start.leg == end.leg:
        return ""
    way = f"{name} from leg {start.leg} to leg {end.leg}"
    if site.kind != "Merge" and (turn := _turn_off(scenario, model, site, start, end)):
        return f"{way} must turn as in the scenario, and turns by {turn:.0f}° more or less"
    if not has_way(model, site, start, end):
        return f"{way}: no way from lane {start.lane} to lane {end.lane}"
    return ""


def _turn_off(
    scenario: LogicalScenario, model: OpenDrive, site: Site, start: Waypoint, end: Waypoint
) -> float:
    """Return by how much a turn differs from the scenario's [deg]; 0 where it is alike."""
    there = {leg.name: leg.heading_deg for leg in site.legs}
    angle = there[end.leg] - there[start.leg]
    legs = scenario.roads.legs
    wanted = legs[end.leg].heading - legs[start.leg].heading
    if _is_lht(model, site):
        wanted = -wanted
    off = math.remainder(angle - wanted, 360.0)
    return off if abs(off) > TURN_TOLERANCE else 0.0


def _is_lht(model: OpenDrive, site: Site) -> bool:
    return all(model.road(leg.roads[0].road_id).rule == "LHT" for leg in site.legs)


def ends_of(scenario: LogicalScenario) -> Iterator[Waypoint]:
    """Yield where routes end."""
    for one in scenario.story.participants:
        if one.end is not None:
            yield one.end


def all_places(scenario: LogicalScenario) -> Iterator[Waypoint]:
    """Yield every place of a scenario."""
    yield from (place for place, _ in _places(scenario))
    yield from ends_of(scenario)


def _places(scenario: LogicalScenario) -> Iterator[tuple[Waypoint, float]]:
    """Yield where participants and things stand, and how wide they are [m]."""
    story = scenario.story
    for one in story.participants:
        yield one.start, max(body.width for body in one.bodies)
        for point in one.path:
            yield point, 0.0
    for jam in story.jams:
        yield jam.tail, 0.0
    for works in story.works:
        for place in (works.start, works.sign, *works.cones):
            yield place, 0.0
    for event in story.events:
        for action in event.actions:
            if isinstance(action, Arrival):
                yield action.at, 0.0
                yield action.place, 0.0


def _missing(site: Site, place: Waypoint, width: float, ends: bool) -> str:
    """Return what is not there of a place, for a message; empty where nothing is missing.

    A route that ends there may end sooner.
    """
    leg = site.leg(place.leg)
    if leg is None:
        return f"leg {place.leg}"
    road = leg.roads[0]
    if not isinstance(place.lane, int):
        strips = [
            one for one in road.strips if (one.type, one.direction) == (place.lane, place.way)
        ]
        if not strips:
            return f"{place} (road {road.road_id})"
        if strips[0].width < width - OVERHANG:
            return f"{place}, {width:.3g} m wide (road {road.road_id}: {strips[0].width:.3g} m)"
    else:
        lanes = road.along(place.way)
        if place.lane > len(lanes):
            return f"{place} (road {road.road_id} has {len(lanes)})"
        if lanes[place.lane - 1].width < NARROWEST_LANE:
            narrow = lanes[place.lane - 1].width
            return f"{place}, {NARROWEST_LANE:g} m wide (road {road.road_id}: {narrow:.3g} m)"
    if not ends and not isinstance(place.distance, str) and place.distance > leg.length:
        return f"{place}, {place.distance:g} m away (the leg has {leg.length:.4g} m)"
    return ""


def value(quantity: str | float, values: dict[str, float]) -> float:
    """Return a quantity's value among those of the parameters."""
    return values[quantity] if isinstance(quantity, str) else quantity


def reach(scenario: LogicalScenario) -> tuple[float, float]:
    """Return the nearest and the farthest place at which somebody starts, at the defaults [m]."""
    values = scenario.usual_values()
    starts = [value(one.start.distance, values) for one in scenario.participants]
    return min(starts, default=0.0), max(starts, default=0.0)


def turning(scenario: LogicalScenario, first: float, last: float) -> float:
    """Return by how much the scenario's own road turns between two distances, at the defaults.

    Bend by bend [rad]; its curvature is linear along each segment.
    """
    values, found, begin = scenario.usual_values(), 0.0, 0.0
    for one in scenario.roads.segments:
        length = value(one.length, values)
        low, high = max(first, begin), min(last, begin + length)
        if low < high:
            ends = (value(one.curvature, values), value(one.end_curvature, values))
            middle = (0.5 * (low + high) - begin) / length
            found += (high - low) * abs(ends[0] + middle * (ends[1] - ends[0]))
        begin += length
    return found
