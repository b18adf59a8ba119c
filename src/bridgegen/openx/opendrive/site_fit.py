"""Whether a scenario fits a place of a map: a junction at a rotation of its legs, or a road."""

import math
from collections.abc import Iterator

from bridgegen.base import elementary
from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.openx.opendrive.merges import merges
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.rings import rings
from bridgegen.openx.opendrive.site import ring_sites, stretches, turned_sites, unlikeness
from bridgegen.openx.opendrive.site_adapted import adapted, furnished, has_way
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.story import Arrival, Waypoint
from bridgegen.scenario.ontology.site import Site

# --- What a place of a map lacks of what a scenario uses: lanes, lengths, ways, bends, lights ---


TURN_TOLERANCE = 60.0
"""Largest difference of a turn from the scenario's [deg]: half a T-junction's, and more."""

NARROWEST_LANE = 2.0
"""Least width of what participants drive on [m]; ours, for lanes begin and end at 0 m."""

OVERHANG = 0.5
"""Width by which a participant may exceed the strip that it starts on [m]; ours."""

SHARE_OF_TURN = 0.5
"""Least turning of a map's road, as a share of that of the scenario's road; ours."""


def missing(scenario: LogicalScenario, model: OpenDrive, site: Site) -> list[str]:
    """Return what a place lacks of what a scenario uses: lanes, lengths, ways across, bends.

    Args:
        scenario: what shall take place there.
        model: the road network.
        site: the place, with its legs named as the scenario's.
    """
    if chosen := [participant for participant in scenario.participants if participant.ways]:
        by = f"{chosen[0].place_by} chooses where {chosen[0].name} starts"
        return [f"roads of the scenario's own ({by}, and a map is found for one place only)"]
    scenario, _ = adapted(scenario, model, site)
    found = sorted({_missing(site, *place, False) for place in _places(scenario)} - {""})
    found += sorted({_missing(site, end, 0.0, True) for end in ends_of(scenario)} - {""})
    first, last = within = reach(scenario)
    # A scenario behind a bend (a stopped car that is seen late) is another one on a straight road.
    wanted, there = turning(scenario, *within), site.legs[0].turning(*within)
    if there < SHARE_OF_TURN * wanted:
        found.append(
            f"a bend between {first:.4g} m and {last:.4g} m (the road turns by "
            f"{math.degrees(there):.0f}° there, the scenario's by {math.degrees(wanted):.0f}°)"
        )
    found += [*_crosses(scenario, site), *_unlit(scenario, site), *_works(scenario, site)]
    if found:
        return found
    for participant in scenario.story.participants:
        if (
            participant.end is not None
            and isinstance(participant.start.lane, int)
            and not participant.path
        ):
            found.append(
                _no_way(scenario, model, site, participant.name, participant.start, participant.end)
            )
    return sorted(set(found) - {""})


def _crosses(scenario: LogicalScenario, site: Site) -> Iterator[str]:
    """Yield the crosswalks that pedestrians cross on, and that are not there."""
    for participant in scenario.participants:
        place = participant.start
        if len({(point.leg, point.way) for point in participant.path}) < 2:
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
            yield f"a crosswalk where {participant.name} crosses, {where}"


def _unlit(scenario: LogicalScenario, site: Site) -> Iterator[str]:
    """Yield the legs that a scenario has lights on, and the place has not."""
    if scenario.roads.signals != "none":
        lit = {facility.leg for facility in site.facilities if facility.cls == "TrafficLight"}
        legs = sorted(
            {participant.start.leg for participant in scenario.participants if not participant.path}
            - lit
        )
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
        places = [cone.distance for cone in (works.start, works.sign, *works.cones)]
        farthest = max((place for place in places if not isinstance(place, str)), default=0.0)
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
    if site.kind != "Merge" and (turn := _turn_off(scenario, site, start, end)):
        return f"{way} must turn as in the scenario, and turns by {turn:.0f}° more or less"
    if not has_way(model, site, start, end):
        return f"{way}: no way from lane {start.lane} to lane {end.lane}"
    return ""


def _turn_off(scenario: LogicalScenario, site: Site, start: Waypoint, end: Waypoint) -> float:
    """Return by how much a turn differs from the scenario's [deg]; 0 where it is alike."""
    there = {leg.name: leg.heading_deg for leg in site.legs}
    angle = there[end.leg] - there[start.leg]
    legs = scenario.roads.legs
    wanted = legs[end.leg].heading - legs[start.leg].heading
    off = math.remainder(angle - wanted, 360.0)
    return off if abs(off) > TURN_TOLERANCE else 0.0


def ends_of(scenario: LogicalScenario) -> Iterator[Waypoint]:
    """Yield where routes end."""
    for participant in scenario.story.participants:
        if participant.end is not None:
            yield participant.end


def all_places(scenario: LogicalScenario) -> Iterator[Waypoint]:
    """Yield every place of a scenario."""
    yield from (place for place, _ in _places(scenario))
    yield from ends_of(scenario)


def _places(scenario: LogicalScenario) -> Iterator[tuple[Waypoint, float]]:
    """Yield where participants and things stand, and how wide they are [m]."""
    story = scenario.story
    for participant in story.participants:
        yield participant.start, max(body.width for body in participant.bodies)
        for point in participant.path:
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
            strip
            for strip in road.strips
            if (strip.type, strip.direction) == (place.lane, place.way)
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
    starts = [value(participant.start.distance, values) for participant in scenario.participants]
    return min(starts, default=0.0), max(starts, default=0.0)


def turning(scenario: LogicalScenario, first: float, last: float) -> float:
    """Return by how much the scenario's own road turns between two distances, at the defaults.

    Bend by bend [rad]; its curvature is linear along each segment.
    """
    values, found, begin = scenario.usual_values(), 0.0, 0.0
    for segment in scenario.roads.segments:
        length = value(segment.length, values)
        low, high = max(first, begin), min(last, begin + length)
        if low < high:
            ends = (value(segment.curvature, values), value(segment.end_curvature, values))
            middle = (0.5 * (low + high) - begin) / length
            found += (high - low) * abs(ends[0] + middle * (ends[1] - ends[0]))
        begin += length
    return found


INTERSECTIONS = ("crossroads", "t-junction")
"""Templates whose scenarios take place at a junction of a map."""

ROAD = "road"
"""The template whose scenarios take place on a stretch of a map's road."""

ROUNDABOUT = "roundabout"
"""The template whose scenarios take place at a roundabout of a map."""

MERGE = "merge"
"""The template whose scenarios take place at an entry of a map."""

BEST = "best"
"""Name of the place on a map that fits and is most like the scenario's."""

ALL = "all"
"""Name of all places that fit, at every rotation at which they do."""


def site_for(
    scenario: LogicalScenario,
    model: OpenDrive,
    place_id: str | None = None,
    map_name: str | None = None,
) -> Site:
    """Return a place that has the legs and lanes of a scenario; see `find_site`, `stretches`.

    Raises:
        InputError: as `find_site`; no stretch of road is named.
        UnsupportedError: as `find_site`; or scenarios of this template cannot take place on a map,
            or the place lacks lanes that participants stand on or drive to, or these are too short
            (all of them are named).
    """
    if place_id == BEST:
        return alike(scenario, fitting_sites(scenario, model, map_name))[0]
    sites = sites_at(scenario, model, place_id, map_name)
    lacks = [missing(scenario, model, site) for site in sites]
    for site, lack in zip(sites, lacks, strict=True):
        if not lack:
            return site
    site = sites[0]
    turned = f", at one of {len(sites)} rotations; it has {len(site.legs)} legs"
    raise UnsupportedError(
        f"{site.where} of {site.name} must have what {scenario.name} uses"
        f"{turned if site.kind else ''}; missing: {'; '.join(lacks[0])}"
    )


def sites_at(
    scenario: LogicalScenario,
    model: OpenDrive,
    place_id: str | None = None,
    map_name: str | None = None,
) -> list[Site]:
    """Return a place of a map, once per rotation of the legs' names, that most alike first.

    Raises:
        InputError: as `site_for`.
        UnsupportedError: as `site_for`, but for what the place lacks.
    """
    if scenario.roads.template in INTERSECTIONS:
        headings = {name: leg.heading for name, leg in scenario.roads.legs.items()}
        sites = turned_sites(model, place_id, map_name, headings)
        return [furnished(model, site, scenario.roads) for site in sites]
    if scenario.roads.template == ROUNDABOUT:
        return _around(scenario, model, place_id, map_name)
    if scenario.roads.template == MERGE:
        found = {site.place_id: site for site in merges(model, map_name)}
    else:
        found = {site.place_id: site for site in stretches(model, map_name)}
    place_id = _named(scenario, list(found), place_id, map_name)
    return [furnished(model, found[place_id], scenario.roads)]


def _named(
    scenario: LogicalScenario, known: list[str], place_id: str | None, map_name: str | None
) -> str:
    """Return which of some places is meant: the one that is named, or the only one.

    Raises:
        InputError: it is open, or there is none of that name.
    """
    if place_id is None and len(known) == 1:
        return known[0]
    if place_id is None or place_id not in known:
        few = ", ".join(known[:8]) + (", …" if len(known) > 8 else "")
        raise InputError(
            f"{scenario.name} takes place at a {kind_of_place(scenario)}; "
            f"{map_name or 'the map'} has {len(known)}, one of them must be named, or best: "
            f"{few or 'none'}" + (f"; got '{place_id}'" if place_id else "")
        )
    return place_id


def _around(
    scenario: LogicalScenario, model: OpenDrive, place_id: str | None, map_name: str | None
) -> list[Site]:
    """Return a roundabout, as `sites_at`."""
    found = {ring.id: ring for ring in rings(model)}
    place_id = _named(scenario, list(found), place_id, map_name)
    headings = {name: leg.heading for name, leg in scenario.roads.legs.items()}
    sites = ring_sites(model, found[place_id], map_name, headings)
    return [furnished(model, site, scenario.roads) for site in sites]


def kind_of_place(scenario: LogicalScenario) -> str:
    """Return what a scenario takes place at: a "junction", "roundabout", "merge" or "road"."""
    template = scenario.roads.template
    return "junction" if template in INTERSECTIONS else template


def fitting_sites(
    scenario: LogicalScenario,
    model: OpenDrive,
    map_name: str | None = None,
    place_id: str | None = None,
) -> list[Site]:
    """Return every place of a map that a scenario fits, once per rotation at which it does.

    Args:
        scenario: what shall take place there.
        model: the road network.
        map_name: of its file.
        place_id: the only place to look at.

    Raises:
        UnsupportedError: the scenario cannot take place on a map, or fits none of its places.
    """
    found = [
        site
        for sites in candidates(scenario, model, map_name)
        for site in sites
        if place_id in (None, site.place_id) and not missing(scenario, model, site)
    ]
    if found:
        return found
    raise UnsupportedError(
        f"{scenario.name} fits no {kind_of_place(scenario)} of {map_name or 'the map'}; "
        "what each lacks: bridgegen list places MAP SCENARIO"
    )


def candidates(
    scenario: LogicalScenario, model: OpenDrive, map_name: str | None = None
) -> Iterator[list[Site]]:
    """Yield the places of a map that have as many legs as a scenario's, in their rotations."""
    if scenario.roads.template in (ROAD, MERGE):
        one_way = merges if scenario.roads.template == MERGE else stretches
        for site in one_way(model, map_name):
            yield [furnished(model, site, scenario.roads)]
        return
    if scenario.roads.template == ROUNDABOUT:
        ids = [ring.id for ring in rings(model)]
    else:
        ids = [junction.id for junction in model.junctions]
    for place_id in ids:
        try:
            # A junction with another number of legs is no candidate, which is no error of the map.
            yield sites_at(scenario, model, place_id, map_name)
        except UnsupportedError:
            continue


def alike(scenario: LogicalScenario, sites: list[Site]) -> list[Site]:
    """Return places of a map, that most like a scenario's own first."""
    return sorted(sites, key=lambda site: _unlikeness(scenario, site))


def _unlikeness(scenario: LogicalScenario, site: Site) -> float:
    """Return how little a place is like the scenario's own; smaller is more alike.

    Of a road: a difference of one lane counts as much as a leg that is too short by all its
    length, or a speed limit that is twice too high.
    """
    if site.kind == "Merge":
        return -min(leg.length for leg in site.legs)  # the longer, the better
    if site.kind is not None:
        headings = {name: leg.heading for name, leg in scenario.roads.legs.items()}
        return unlikeness(headings, site)
    road, values = site.legs[0].roads[0], scenario.usual_values()
    lanes = sum(
        abs(len(road.along(way)) - value(scenario.roads.lanes("main", way), values))
        for way in ("in", "out")
    )
    farthest = max((value(place.distance, values) for place in all_places(scenario)), default=0.0)
    short = max(0.0, 1.0 - site.legs[0].length / max(farthest, 1.0))
    wanted = value(scenario.roads.knobs["speed_limit"], values)
    # By the ratio: 50 where 30 was meant is as far off as 120 where 72 was. A road without a limit
    # is taken to have the wanted one.
    limit = elementary.log2(max(road.speed_limit or wanted, 1.0) / wanted)
    within = reach(scenario)
    turned = abs(site.legs[0].turning(*within) - turning(scenario, *within))
    return lanes + short + abs(limit) + turned
