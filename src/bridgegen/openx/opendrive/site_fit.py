"""Whether a scenario fits an intersection of a map, and at which rotation of its legs."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from bridgegen.errors import InputError, UnsupportedError
from bridgegen.odd.scenario import LogicalScenario
from bridgegen.odd.story import Arrival, Waypoint
from bridgegen.ontology.site import Site
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.routes import plan_route
from bridgegen.openx.opendrive.site import turned_sites, unlikeness

TEMPLATES = ("crossroads", "t-junction")
"""Templates whose scenarios can take place on a map."""

BEST = "best"
"""Stands for the junction of a map that fits and is most like the scenario's."""

ALL = "all"
"""Stands for every junction that fits, at every rotation at which it does."""

TURN_TOLERANCE = 60.0
"""How far a turn may differ from the scenario's [deg]: half a T-junction's, and more."""

END_MARGIN = 1.0
"""How far before the end of its leg a shortened route ends [m]."""


def site_for(
    scenario: LogicalScenario,
    model: OpenDrive,
    junction_id: str | None = None,
    map_name: str | None = None,
) -> Site:
    """Return a junction that has the legs and lanes of a scenario; see `find_site`.

    Raises:
        InputError: as `find_site`.
        UnsupportedError: as `find_site`; or the scenario is not one of an intersection, or the
            junction lacks lanes that participants stand on or drive to, or these are too short
            (all of them are named).
    """
    require_intersection(scenario)
    headings = {name: leg.heading for name, leg in scenario.roads.legs.items()}
    if junction_id == BEST:
        return _best_site(scenario, model, map_name, headings)
    sites = turned_sites(model, junction_id, map_name, headings)
    lacks = [missing(scenario, model, site) for site in sites]
    for site, lack in zip(sites, lacks, strict=True):
        if not lack:
            return site
    site = sites[0]
    raise UnsupportedError(
        f"junction {site.junction_id} of {site.name} must have the lanes that {scenario.name} "
        f"uses, at one of {len(sites)} rotations; it has {len(site.legs)} legs; missing: "
        f"{'; '.join(lacks[0])}"
    )


def require_intersection(scenario: LogicalScenario) -> None:
    """Raise UnsupportedError of a scenario that is not one of an intersection."""
    template = scenario.roads.template
    if template not in TEMPLATES:
        raise UnsupportedError(
            f"{scenario.name} takes place on the template {template}; on a map, scenarios of "
            f"the templates {' and '.join(TEMPLATES)} can"
        )


def _best_site(
    scenario: LogicalScenario,
    model: OpenDrive,
    map_name: str | None,
    headings: Mapping[str, float],
) -> Site:
    """Return the fitting junction of a map that is most like the scenario's."""
    found = fitting_sites(scenario, model, map_name)
    return min(found, key=lambda site: unlikeness(headings, site))


def fitting_sites(
    scenario: LogicalScenario,
    model: OpenDrive,
    map_name: str | None = None,
    junction_id: str | None = None,
) -> list[Site]:
    """Return every junction of a map that a scenario fits, once per rotation at which it does.

    Args:
        scenario: one of an intersection.
        model: the road network.
        map_name: of its file.
        junction_id: the only junction to look at.

    Raises:
        UnsupportedError: the scenario is not one of an intersection, or fits none.
    """
    require_intersection(scenario)
    headings = {name: leg.heading for name, leg in scenario.roads.legs.items()}
    found = []
    for junction in model.junctions:
        if junction_id not in (None, junction.id):
            continue
        try:
            sites = turned_sites(model, junction.id, map_name, headings)
        except UnsupportedError:
            continue
        found += [site for site in sites if not missing(scenario, model, site)]
    if found:
        return found
    raise UnsupportedError(
        f"{scenario.name} fits no junction of {map_name or 'the map'}; "
        "what each lacks: bridgegen junctions MAP SCENARIO"
    )


def missing(scenario: LogicalScenario, model: OpenDrive, site: Site) -> list[str]:
    """Return what a junction lacks of what a scenario uses: lanes, lengths, ways across.

    Args:
        scenario: one of an intersection.
        model: the road network.
        site: the junction, with its legs named as the scenario's.
    """
    found = sorted({_missing(site, one, False) for one in _places(scenario)} - {""})
    found += sorted({_missing(site, one, True) for one in _ends_of(scenario)} - {""})
    if found:
        return found
    for one in scenario.story.participants:
        if one.end is not None and isinstance(one.start.lane, int) and not one.path:
            found.append(_no_way(scenario, model, site, one.name, one.start, one.end))
    return sorted(set(found) - {""})


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
    there = {leg.name: leg.heading_deg for leg in site.legs}
    angle = there[end.leg] - there[start.leg]
    legs = scenario.roads.legs
    wanted = legs[end.leg].heading - legs[start.leg].heading
    if _is_lht(model, site):
        wanted = -wanted
    off = math.remainder(angle - wanted, 360.0)
    way = f"{name} from leg {start.leg} to leg {end.leg}"
    if abs(off) > TURN_TOLERANCE:
        return f"{way} must turn as in the scenario, and turns by {off:.0f}° more or less"
    try:
        plan_route(model, _on_lane(site, start), (), _on_lane(site, end))
    except InputError:
        return f"{way}: no way from lane {start.lane} to lane {end.lane}"
    return ""


def _is_lht(model: OpenDrive, site: Site) -> bool:
    return all(model.road(leg.roads[0].road_id).rule == "LHT" for leg in site.legs)


def _on_lane(site: Site, place: Waypoint) -> tuple[str, int, float]:
    """Return a lane of the road that touches the junction, halfway along that road."""
    leg = site.leg(place.leg)
    assert leg is not None  # `_missing` says so
    assert isinstance(place.lane, int)
    road = leg.roads[0]
    return road.road_id, road.along(place.way)[place.lane - 1].lane_id, 0.5 * road.length


def shortened(scenario: LogicalScenario, site: Site) -> tuple[LogicalScenario, list[str]]:
    """Return a scenario whose routes end on the legs of a site, and a sentence for each change.

    Args:
        scenario: one of an intersection.
        site: the junction, with its legs named as the scenario's.
    """
    notes, participants = [], []
    for one in scenario.story.participants:
        end = one.end
        leg = site.leg(end.leg) if end is not None else None
        if end is not None and leg is not None and not isinstance(end.distance, str):
            last = max(leg.length - END_MARGIN, 0.5 * leg.length)
            if end.distance > last:
                notes.append(
                    f"the route of {one.name} ends {last:.4g} m along leg {leg.name} instead of "
                    f"{end.distance:g} m: the leg has {leg.length:.4g} m"
                )
                one = replace(one, end=replace(end, distance=last))
        participants.append(one)
    if not notes:
        return scenario, notes
    story = replace(scenario.story, participants=tuple(participants))
    return replace(scenario, story=story), notes


def _ends_of(scenario: LogicalScenario) -> Iterator[Waypoint]:
    """Yield where routes end."""
    for one in scenario.story.participants:
        if one.end is not None:
            yield one.end


def _places(scenario: LogicalScenario) -> Iterator[Waypoint]:
    """Yield where a scenario's participants and things stand."""
    story = scenario.story
    for one in story.participants:
        yield one.start
        yield from one.path
    for jam in story.jams:
        yield jam.tail
    for works in story.works:
        yield from (works.start, works.sign, *works.cones)
    for event in story.events:
        for action in event.actions:
            if isinstance(action, Arrival):
                yield from (action.at, action.place)


def _missing(site: Site, place: Waypoint, ends: bool) -> str:
    """Return what is not there of a place, for a message; empty where nothing is missing.

    A route that ends there may end sooner.
    """
    leg = site.leg(place.leg)
    if leg is None:
        return f"leg {place.leg}"
    road = leg.roads[0]
    if not isinstance(place.lane, int):
        there = any((one.type, one.direction) == (place.lane, place.way) for one in road.strips)
        return "" if there else f"{place} (road {road.road_id})"
    count = len(road.along(place.way))
    if place.lane > count:
        return f"{place} (road {road.road_id} has {count})"
    if not ends and not isinstance(place.distance, str) and place.distance > leg.length:
        return f"{place}, {place.distance:g} m away (the leg has {leg.length:.4g} m)"
    return ""
