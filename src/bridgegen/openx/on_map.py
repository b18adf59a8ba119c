"""Scenarios on maps that were made elsewhere: what a map has for their static parameters."""

import re
from dataclasses import replace

from bridgegen.errors import InputError
from bridgegen.odd.expression import Lookup, lookup
from bridgegen.odd.kinds import MOST_NAMES, Category
from bridgegen.odd.parameters import Axis, Bound, Derived, Parameter
from bridgegen.odd.rules import speed_bounds
from bridgegen.odd.scenario import LogicalScenario
from bridgegen.ontology.site import Site
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.openx.opendrive.site_fit import fitting_sites, shortened

JUNCTION = "junction"
"""The parameter that says where on a map a scenario takes place."""

_LIMIT = "junction_speed_limit"
_NO_LIMIT = 1000.0  # m/s, where a road states none


def on_map(scenario: LogicalScenario, road_map: RoadMap) -> LogicalScenario:
    """Return a scenario with its static parameters from a map.

    A start that is searched stays on the road that touches the junction: a position in an
    OpenSCENARIO file is on one road, whatever its parameter's value. The map's lowest speed limit
    bounds speeds, too. Routes end at the latest where their legs end. Where several junctions are
    searched together, one more parameter says which, and the static ones follow from it.

    Raises:
        InputError: too many junctions, or a parameter of that name.
    """
    if road_map.sites:
        return _on_sites(scenario, road_map)
    scenario, _ = shortened(scenario, road_map.site)
    moving = [one.start for one in scenario.participants if isinstance(one.start.distance, str)]
    static = [one for one in scenario.parameters.values() if one.axis is Axis.STATIC]
    found = road_map.site.measures([start.leg for start in moving])
    here = scenario.measured({one.name: found.get(one.name, one.default) for one in static})
    limit = _lowest_limit(road_map.site)
    if limit is None:
        return here
    story = scenario.story
    slower = speed_bounds(limit, story, here.parameters, story.later_weathers, scenario.place)
    return replace(here, bounds=(*here.bounds, *slower))


def searchable(scenario: LogicalScenario, road_map: RoadMap) -> RoadMap:
    """Return a map without the junctions that are too small for a scenario's ranges.

    One that is searched alone is taken at another rotation of its legs, if it must be and can.

    Raises:
        InputError: there is no other.
    """
    if not road_map.sites:
        return _turned(scenario, road_map)
    left, reasons = [], []
    for site in road_map.sites:
        try:
            on_map(scenario, road_map.at(site)).space()
        except InputError as error:
            leg = site.legs[0]
            reasons.append(
                f"junction {site.junction_id} with road {leg.roads[0].road_id} as leg {leg.name} "
                f"is left out: {error.problems[0]}"
            )
        else:
            left.append(site)
    if not left:
        raise InputError(*reasons)
    return replace(
        road_map,
        site=left[0],
        sites=tuple(left) if len(left) > 1 else (),
        warnings=(*road_map.warnings, *dict.fromkeys(reasons)),
    )


def _turned(scenario: LogicalScenario, road_map: RoadMap) -> RoadMap:
    """Return a map at the first rotation of its junction's legs that a scenario's ranges fit."""
    try:
        on_map(scenario, road_map).space()
    except InputError:
        junction, name = road_map.site.junction_id, road_map.path.name
        sites = fitting_sites(scenario, road_map.model, name, junction)
        try:
            left = searchable(scenario, replace(road_map, sites=(road_map.site, *sites)))
        except InputError:
            return road_map  # its own error says why
        return replace(left.at(left.site), warnings=road_map.warnings)
    return road_map


def _on_sites(scenario: LogicalScenario, road_map: RoadMap) -> LogicalScenario:
    """Return a scenario that takes place at one of several junctions; see `on_map`."""
    taken = {*scenario.parameters, *(one.name for one in scenario.derived)} & {JUNCTION, _LIMIT}
    if taken:
        raise InputError(f"{scenario.place}: --junction all needs the name {sorted(taken)[0]}")
    if len(road_map.sites) > MOST_NAMES:
        raise InputError(
            f"{road_map.path}: at most {MOST_NAMES} junctions and rotations can be searched "
            f"together, {scenario.name} fits {len(road_map.sites)}; choose one (--junction)"
        )
    here = [on_map(scenario, road_map.at(site)) for site in road_map.sites]
    found, source = road_map.site.name, f"the map {road_map.path.name}"
    static = {name for name, one in scenario.parameters.items() if one.axis is Axis.STATIC}
    names = site_names(road_map)
    index = Parameter(
        JUNCTION, Axis.STATIC, "1", 0.0, len(names) - 1.0, 0.0, Category(names),
        f"The junction of {found}, and which of its legs is leg A.", source,
    )  # fmt: skip
    why = "The map has it."
    measured = [
        Derived(
            name, Axis.STATIC, one.unit,
            lookup(JUNCTION, [part.parameters[name].default for part in here]), why, source,
            one.description,
        )
        for name, one in scenario.parameters.items()
        if name in static
    ]  # fmt: skip
    limits = [_lowest_limit(site) or _NO_LIMIT for site in road_map.sites]
    slower: tuple[Bound, ...] = ()
    if min(limits) < _NO_LIMIT:
        measured.append(
            Derived(_LIMIT, Axis.STATIC, "m/s", lookup(JUNCTION, limits), why, source,
                    "The lowest speed limit on the legs.")
        )  # fmt: skip
        moving = {name: one for name, one in scenario.parameters.items() if name not in static}
        weathers = scenario.story.later_weathers
        slower = tuple(speed_bounds(_LIMIT, scenario.story, moving, weathers, scenario.place))
    kept = {name: one for name, one in scenario.parameters.items() if name not in static}
    return replace(
        scenario,
        parameters={JUNCTION: index} | kept,
        bounds=(*(one for one in scenario.bounds if one.target not in static), *slower),
        derived=(*measured, *scenario.derived),
        axes=tuple(axis for axis in Axis if axis in {Axis.STATIC, *scenario.axes}),
    )


def site_names(road_map: RoadMap) -> tuple[str, ...]:
    """Return a word for each site: its junction, and the road that is leg A there."""
    words = [
        re.sub(r"[^a-z0-9]", "_", f"j{site.junction_id}_a{site.legs[0].roads[0].road_id}".lower())
        for site in road_map.sites
    ]
    return tuple(
        word[:56] if words.count(word) == 1 and len(word) < 57 else f"{word[:56]}_{k}"
        for k, word in enumerate(words)
    )


def at_site(scenario: LogicalScenario, site: Site, number: int) -> LogicalScenario:
    """Return what `_on_sites` made, as it is at one of the junctions."""
    scenario, _ = shortened(scenario, site)
    parameters, derived = {}, []
    for one in scenario.derived:
        if isinstance(one.value, Lookup) and one.value.names == {JUNCTION} and one.name != _LIMIT:
            value = one.value.values[number]
            parameters[one.name] = Parameter(
                one.name, one.axis, one.unit, value, value, value, description=one.description
            )
        elif one.name != _LIMIT:
            derived.append(one)
    kept = {name: one for name, one in scenario.parameters.items() if name != JUNCTION}
    bounds = tuple(one for one in scenario.bounds if _LIMIT not in one.names)
    return replace(scenario, parameters=parameters | kept, bounds=bounds, derived=tuple(derived))


def _lowest_limit(site: Site) -> float | None:
    """Return the lowest speed limit on the legs of a junction [m/s]; None where there is none."""
    limits = [
        road.speed_limit for leg in site.legs for road in leg.roads if road.speed_limit is not None
    ]
    return min(limits, default=None)
