"""Scenarios on maps that were made elsewhere: what a map has for their static parameters."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.merges import RAMP, through
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.openx.opendrive.site_adapted import adapted
from bridgegen.openx.opendrive.site_fit import fitting_sites
from bridgegen.scenario.language.expression import Lookup, lookup
from bridgegen.scenario.language.kinds import MOST_NAMES, Category, slack
from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter
from bridgegen.scenario.language.roads import Quantity
from bridgegen.scenario.language.rules import bend_bounds, speed_bounds
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.space import SearchSpace, probes
from bridgegen.scenario.language.story import LaneChange
from bridgegen.scenario.ontology.site import Site

PLACE = "place"
"""Parameter that states at which place on a map a scenario takes place."""

GENTLE = 1e-4
"""Curvature below which a road is straight [1/m]."""

_LIMIT, _SHARPEST = "place_speed_limit", "place_curvature"
_NO_LIMIT = 1000.0  # m/s, where a road states none
_SHOWN = 3  # places left out that are named


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
    scenario, _ = adapted(scenario, road_map.model, road_map.site)
    moving = [
        participant.start
        for participant in scenario.participants
        if isinstance(participant.start.distance, str)
    ]
    static = [
        parameter for parameter in scenario.parameters.values() if parameter.axis is Axis.STATIC
    ]
    usual = scenario.usual_values()
    found = road_map.site.measures(
        [(waypoint.leg, usual[str(waypoint.distance)]) for waypoint in moving]
    )
    knobs = {name: knob for knob, name in scenario.roads.knobs.items() if isinstance(name, str)}
    here = scenario.measured(
        {
            parameter.name: found.get(knobs.get(parameter.name, parameter.name), parameter.default)
            for parameter in static
        }
    )
    slower = _slower(here, _lowest_limit(road_map.site), _sharpest(road_map.site))
    return replace(here, bounds=(*here.bounds, *slower))


def _slower(
    scenario: LogicalScenario, limit: Quantity | None, curvature: Quantity | None
) -> Iterator[Bound]:
    """Yield what a place's lowest speed limit [m/s] and sharpest bend [1/m] demand of speeds."""
    story, place, parameters = scenario.story, scenario.place, scenario.parameters
    if limit is not None:
        yield from speed_bounds(limit, story, parameters, story.later_weathers, place)
    if isinstance(curvature, str) or (curvature or 0.0) > GENTLE:
        radius = f"1 / max({curvature}, {GENTLE})"
        for participant in story.participants:
            if (
                participant.conduct == "vehicle" and participant.name != "ego"
            ):  # see `bounds_between_layers`
                yield from bend_bounds(
                    radius, participant, story, parameters, story.later_weathers, place
                )


def _sharpest(site: Site) -> float:
    """Return the greatest curvature of a stretch of road [1/m]; 0 of a junction.

    Its turns have bounds of their own.
    """
    roads = [road for leg in site.legs for road in leg.roads] if site.kind is None else []
    return max((bend for road in roads for bend in road.bends), default=0.0)


def _require_room(scenario: LogicalScenario, road_map: RoadMap) -> None:
    """Raise InputError where ranges do not fit a place, or a searched start leaves its road.

    Starts are tried at the corners of the ranges and within, as a scenario file's are.
    """
    here = on_map(scenario, road_map)
    space = here.space(Axis)
    here.space()
    # The decoder keeps all constraints, so what it gives at the corners says how far starts really
    # reach; the declared ranges alone would refuse places that fit.
    X = space.decode(probes(space.n_var))
    queued = {name: jam.participants for jam in here.story.jams for name in jam.participants}
    ranges: dict[str, tuple[float, float]] = {}
    for participant in here.participants:
        at = participant.start.distance
        column = _column(at, space, X)
        ranges[participant.name] = float(column.min()), float(column.max())
    for participant in here.participants:
        leg = road_map.site.leg(participant.start.leg)
        if leg is None or not isinstance(participant.start.distance, str):
            continue
        together = [ranges[name] for name in queued.get(participant.name, (participant.name,))]
        nearest, farthest = min(low for low, _ in together), max(high for _, high in together)
        end = leg.road_end(nearest)
        if farthest > end + slack(end):
            road = leg.roads[leg.road_at(nearest)]
            raise InputError(
                f"{participant.name} starts {nearest:.4g} m to {farthest:.4g} m along its leg; "
                "road "
                f"{road.road_id} ends at {end:.4g} m (a start that is searched stays on one road)"
            )
    if road_map.site.kind == "Merge":
        _require_acceleration_lane(here, road_map, space, X)


def _require_acceleration_lane(
    scenario: LogicalScenario, road_map: RoadMap, space: SearchSpace, X: Float
) -> None:
    """Raise InputError where somebody may change lane only after the acceleration lane has ended.

    Of an event that begins after a distance travelled.
    """
    room = through(road_map.model, road_map.site) + road_map.site.legs[2].roads[0].length
    starts = {
        participant.name: participant.start
        for participant in scenario.participants
        if participant.start.leg == RAMP
    }
    for event in scenario.story.events:
        start = starts.get(event.participant or "")
        if start is None or not any(isinstance(action, LaneChange) for action in event.actions):
            continue
        for condition in (spec for group in event.when for spec in group):
            if condition.kind == "travelled":
                beyond = _column(condition.value, space, X) - _column(start.distance, space, X)
                if float(beyond.max()) > room:
                    raise InputError(
                        f"{event.participant} changes lane up to {beyond.max():.4g} m after its "
                        f"ramp; the acceleration lane ends {room:.4g} m after it"
                    )


def _column(value: Quantity, space: SearchSpace, X: Float) -> Float:
    return X[:, space.index(value)] if isinstance(value, str) else np.array([float(value)])


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
            _require_room(scenario, road_map.at(site))
        except InputError as error:
            leg = site.legs[0]
            turned = f" with road {leg.roads[0].road_id} as leg {leg.name}" if site.kind else ""
            reasons.append(f"{site.where}{turned} is left out: {error.problems[0]}")
        else:
            left.append(site)
    if not left:
        raise InputError(*reasons)
    return replace(
        road_map,
        site=left[0],
        sites=tuple(left) if len(left) > 1 else (),
        warnings=(*road_map.warnings, *_shortly(list(dict.fromkeys(reasons)))),
    )


def _shortly(reasons: list[str]) -> Iterator[str]:
    """Yield why places are left out: of many the first ones, and how many more."""
    more = len(reasons) - _SHOWN
    yield from reasons if more <= 1 else reasons[:_SHOWN]
    if more > 1:
        yield f"{more} more places are left out; see: bridgegen list places MAP SCENARIO"


def _turned(scenario: LogicalScenario, road_map: RoadMap) -> RoadMap:
    """Return a map at the first place, or rotation of its legs, that a scenario's ranges fit."""
    others: Sequence[Site] = road_map.others
    try:
        _require_room(scenario, road_map)
    except InputError:
        if not others:
            name = road_map.path.name
            others = fitting_sites(scenario, road_map.model, name, road_map.site.place_id)
        for site in others:
            try:
                _require_room(scenario, road_map.at(site))
            except InputError:
                continue
            return road_map.at(site)
        raise
    return road_map


def _on_sites(scenario: LogicalScenario, road_map: RoadMap) -> LogicalScenario:
    """Return a scenario that takes place at one of several junctions; see `on_map`."""
    taken = {*scenario.parameters, *(derived.name for derived in scenario.derived)} & {
        PLACE,
        _LIMIT,
        _SHARPEST,
    }
    if taken:
        raise InputError(f"{scenario.place}: --place all needs the name {sorted(taken)[0]}")
    if len(road_map.sites) > MOST_NAMES:
        raise InputError(
            f"{road_map.path}: at most {MOST_NAMES} places and rotations can be searched "
            f"together, {scenario.name} fits {len(road_map.sites)}; choose one (--place)"
        )
    here = [on_map(scenario, road_map.at(site)) for site in road_map.sites]
    found, source = road_map.site.name, f"the map {road_map.path.name}"
    static = {
        name for name, parameter in scenario.parameters.items() if parameter.axis is Axis.STATIC
    }
    names = site_names(road_map)
    # A category, static as the roads are: values that follow from the place are tables by its
    # number, so that one search has rows of many junctions.
    index = Parameter(
        PLACE,
        Axis.STATIC,
        "1",
        0.0,
        len(names) - 1.0,
        0.0,
        Category(names),
        f"The place on {found}: a road, or a junction and the road that is leg A.",
        source,
    )
    why = "The map has it."
    measured = [
        Derived(
            name,
            Axis.STATIC,
            parameter.unit,
            lookup(PLACE, [part.parameters[name].default for part in here]),
            why,
            source,
            parameter.description,
        )
        for name, parameter in scenario.parameters.items()
        if name in static
    ]
    # A table needs a number for each place; one that no speed reaches bounds nothing.
    limits = [_lowest_limit(site) or _NO_LIMIT for site in road_map.sites]
    sharpest = [_sharpest(site) for site in road_map.sites]
    limit = _LIMIT if min(limits) < _NO_LIMIT else None
    if limit:
        measured.append(
            Derived(
                _LIMIT,
                Axis.STATIC,
                "m/s",
                lookup(PLACE, limits),
                why,
                source,
                "The lowest speed limit there.",
            )
        )
    curvature = _SHARPEST if max(sharpest) > GENTLE else None
    if curvature:
        measured.append(
            Derived(
                _SHARPEST,
                Axis.STATIC,
                "1/m",
                lookup(PLACE, sharpest),
                why,
                source,
                "The greatest curvature of the road there.",
            )
        )
    slower = tuple(
        _slower(
            replace(
                scenario,
                parameters={
                    name: parameter
                    for name, parameter in scenario.parameters.items()
                    if name not in static
                },
            ),
            limit,
            curvature,
        )
    )
    kept = {
        name: parameter for name, parameter in scenario.parameters.items() if name not in static
    }
    return replace(
        scenario,
        parameters={PLACE: index} | kept,
        bounds=(*(bound for bound in scenario.bounds if bound.target not in static), *slower),
        derived=(*measured, *scenario.derived),
        axes=tuple(axis for axis in Axis if axis in {Axis.STATIC, *scenario.axes}),
    )


def site_names(road_map: RoadMap) -> tuple[str, ...]:
    """Return a word for each site: its road; or its junction, and the road that is leg A there."""
    words = [re.sub(r"[^a-z0-9]", "_", _word(site).lower()) for site in road_map.sites]
    return tuple(
        # Cut to a length that a category's names may have; the number keeps those apart that are
        # then alike.
        word[:56] if words.count(word) == 1 and len(word) < 57 else f"{word[:56]}_{k}"
        for k, word in enumerate(words)
    )


def _word(site: Site) -> str:
    if site.kind is None:
        return f"r{site.place_id}"
    return f"j{site.place_id}_a{site.legs[0].roads[0].road_id}"


def at_site(
    scenario: LogicalScenario, model: OpenDrive, site: Site, number: int
) -> LogicalScenario:
    """Return what `_on_sites` made, as it is at one of the junctions."""
    scenario, _ = adapted(scenario, model, site)
    parameters, derived, helpers = {}, [], {_LIMIT, _SHARPEST}
    for item in scenario.derived:
        if (
            isinstance(item.value, Lookup)
            and item.value.names == {PLACE}
            and item.name not in helpers
        ):
            value = item.value.values[number]
            parameters[item.name] = Parameter(
                item.name, item.axis, item.unit, value, value, value, description=item.description
            )
        elif item.name not in helpers:
            derived.append(item)
    kept = {name: parameter for name, parameter in scenario.parameters.items() if name != PLACE}
    bounds = tuple(bound for bound in scenario.bounds if helpers.isdisjoint(bound.names))
    return replace(scenario, parameters=parameters | kept, bounds=bounds, derived=tuple(derived))


def _lowest_limit(site: Site) -> float | None:
    """Return the lowest speed limit on the legs of a junction [m/s], or None."""
    limits = [
        road.speed_limit for leg in site.legs for road in leg.roads if road.speed_limit is not None
    ]
    return min(limits, default=None)
