"""Whether a scenario fits a place of a map: a junction at a rotation of its legs, or a road."""

import math
from collections.abc import Iterator

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.openx.opendrive.merges import merges
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.rings import rings
from bridgegen.openx.opendrive.site import ring_sites, turned_sites, unlikeness
from bridgegen.openx.opendrive.site_furniture import furnished
from bridgegen.openx.opendrive.site_lacks import all_places, missing, reach, turning, value
from bridgegen.openx.opendrive.stretches import stretches
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.site import Site

INTERSECTIONS = ("crossroads", "t-junction")
"""Templates whose scenarios take place at a junction of a map."""

ROAD = "road"
"""The template whose scenarios take place on a stretch of a map's road."""

ROUNDABOUT = "roundabout"
"""The template whose scenarios take place at a roundabout of a map."""

MERGE = "merge"
"""The template whose scenarios take place at an entry of a map."""

BEST = "best"
"""Stands for the place on a map that fits and is most like the scenario's."""

ALL = "all"
"""Stands for every place that fits, at every rotation at which it does."""


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
        "what each lacks: bridgegen places MAP SCENARIO"
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
    farthest = max((value(one.distance, values) for one in all_places(scenario)), default=0.0)
    short = max(0.0, 1.0 - site.legs[0].length / max(farthest, 1.0))
    wanted = value(scenario.roads.knobs["speed_limit"], values)
    limit = math.log2(max(road.speed_limit or wanted, 1.0) / wanted)
    within = reach(scenario)
    turned = abs(site.legs[0].turning(*within) - turning(scenario, *within))
    return lanes + short + abs(limit) + turned
