"""Where concrete scenarios come from: what a pipeline asks for, and how the ontology answers."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Protocol

from bridgegen.arrays import Float
from bridgegen.errors import InputError
from bridgegen.odd.expression import Lookup, lookup
from bridgegen.odd.kinds import MOST_NAMES, Category
from bridgegen.odd.parameters import Axis, Bound, Derived, Parameter
from bridgegen.odd.rules import speed_bounds
from bridgegen.odd.scenario import LogicalScenario, SearchedScenario
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.individuals import build, build_static
from bridgegen.ontology.site import Site
from bridgegen.openx.file_scenario import FileScenario, FileSource
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.openx.opendrive.site_fit import fitting_sites, shortened
from bridgegen.openx.opendrive.write import to_xml as road_xml
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.openscenario.ranges import MOST_VARIANTS


class ConcreteScenario(Protocol):
    """One row of X as the exported files; each is made on request."""

    @property
    def storyboard(self) -> OpenScenario:
        """The OpenSCENARIO file."""

    @property
    def roads(self) -> OpenDrive:
        """The road network."""

    @property
    def road_data(self) -> bytes:
        """The OpenDRIVE file."""

    @property
    def individuals(self) -> Individuals | None:
        """The ontology's; None where it cannot express another tool's file."""


class Source(Protocol):
    """Makes the concrete scenarios of a logical one."""

    @property
    def road(self) -> str:
        """The road network in words."""

    def junction(self, values: Mapping[str, float]) -> str | None:
        """Return the junction of a map that a row takes place at, if one was chosen."""

    @property
    def static_names(self) -> tuple[str, ...]:
        """The parameters that the road network depends on."""

    @property
    def course_names(self) -> tuple[str, ...]:
        """The parameters that ``courses`` depends on; none without courses."""

    @property
    def unused_names(self) -> tuple[str, ...]:
        """The parameters that nothing depends on: a map defines their values."""

    @property
    def variant_names(self) -> tuple[str, ...]:
        """The parameters whose values each have a storyboard of their own: texts."""

    @property
    def variants(self) -> tuple[tuple[float, ...], ...]:
        """The values of ``variant_names`` that come together."""

    @property
    def constraints(self) -> LogicalScenario | None:
        """The scenario whose constraints its individuals keep; None: the ontology's alone."""

    def bodies(self, values: Mapping[str, float]) -> Mapping[str, str]:
        """Return what the entities of a row are, by name: a car, a pedestrian, a cone."""

    def roads(self, values: Mapping[str, float]) -> OpenDrive:
        """Return the road network, of the values of ``static_names``."""

    def courses(self, values: Mapping[str, float]) -> Mapping[str, Float]:
        """Return who is where when, by name, of those whom each row tells it, of such values.

        Returns:
            ``(V, 4)`` float64 each: time [s], x, y [m], heading [rad] of the reference point.
        """

    def concrete(self, values: Mapping[str, float], road_file: str = "") -> ConcreteScenario:
        """Return one concrete scenario.

        Args:
            values: of every parameter, by name.
            road_file: what its OpenDRIVE file will be called; a map's own name by default.
        """


def source_of(
    scenario: SearchedScenario,
    driver: str | None,
    road_map: RoadMap | None = None,
    ideal: str = "",
) -> Source:
    """Return what makes a scenario's concrete ones.

    Args:
        scenario: of any kind.
        driver: the ego's, by name; the scenario's own choice by default.
        road_map: the map that it takes place on, instead of its own roads.
        ideal: the driver's stages that are ideal, separated by commas.
    """
    if isinstance(scenario, LogicalScenario):
        return OntologySource(scenario, driver or scenario.driver, road_map, ideal)
    if isinstance(scenario, FileScenario):
        return FileSource(scenario, driver, ideal)
    raise TypeError(f"nothing makes concrete scenarios of a {type(scenario).__name__}")


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


JUNCTION = "junction"
"""The parameter that says where on a map a scenario takes place."""

_LIMIT = "junction_speed_limit"
_NO_LIMIT = 1000.0  # m/s, where a road states none


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


def _at_site(scenario: LogicalScenario, site: Site, number: int) -> LogicalScenario:
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


class OntologySource:
    """A `Source` by way of the ontology: parameters to individuals to files.

    Args:
        scenario: of five layers.
        driver: the ego's, by name.
        road_map: the map that it takes place on; by default the network is generated.
        ideal: the driver's stages that are ideal, separated by commas.
    """

    course_names: tuple[str, ...] = ()

    def __init__(
        self,
        scenario: LogicalScenario,
        driver: str,
        road_map: RoadMap | None = None,
        ideal: str = "",
    ) -> None:
        self.constraints = self._scenario = scenario
        self._driver, self._ideal, self._map = driver, ideal, road_map
        static = tuple(name for name, one in scenario.parameters.items() if one.axis is Axis.STATIC)
        self.static_names = () if road_map else static
        self.unused_names = static if road_map and not road_map.sites else ()
        types = {one.type_by: one.types for one in scenario.participants if one.type_by}
        choices: dict[str, Sequence[object]] = dict(types)
        if road_map and road_map.sites:
            choices = {JUNCTION: road_map.sites} | choices
        self.variant_names = tuple(choices)
        counts = (range(len(one)) for one in choices.values())
        self.variants = tuple(tuple(map(float, key)) for key in product(*counts)) if choices else ()
        if len(self.variants) > MOST_VARIANTS:
            together = ", ".join(choices)
            raise InputError(
                f"{scenario.place}: the values of {together} may come together in at most "
                f"{MOST_VARIANTS} ways, for each is a storyboard of its own, got "
                f"{len(self.variants)}"
            )

    @property
    def road(self) -> str:
        """See `Source`."""
        if self._map is None:
            return f"generated {self._scenario.roads.template}"
        if self._map.sites:
            junctions = len({site.junction_id for site in self._map.sites})
            return f"{self._map.site.name}, {junctions} junctions in {len(self._map.sites)} ways"
        return f"{self._map.site.name}, junction {self._map.site.junction_id}"

    def junction(self, values: Mapping[str, float]) -> str | None:
        """See `Source`."""
        site = self._site(values)
        return site.junction_id if site else None

    def _site(self, values: Mapping[str, float]) -> Site | None:
        """Return where on its map a row takes place, None without a map."""
        if self._map and self._map.sites:
            return self._map.sites[int(values[JUNCTION])]
        return self._map.site if self._map else None

    def bodies(self, values: Mapping[str, float]) -> Mapping[str, str]:
        """See `Source`."""
        types = {one.name: str(one.type) for one in self._typed(values).participants}
        for works in self._scenario.story.works:
            types |= {f"{works.name}_cone_{k}": "cone" for k in range(1, len(works.cones) + 1)}
            types[f"{works.name}_sign"] = "sign"
        return types

    def roads(self, values: Mapping[str, float]) -> OpenDrive:
        """See `Source`."""
        if self._map is not None:
            return self._map.model
        return opendrive_from_owl(build_static(dict(values), self._scenario.roads))

    def courses(self, values: Mapping[str, float]) -> Mapping[str, Float]:
        """See `Source`: there are none."""
        return {}

    def concrete(
        self,
        values: Mapping[str, float],
        road_file: str = "",
        courses: Mapping[str, Float] | None = None,
    ) -> ConcreteScenario:
        """See `Source`.

        Args:
            values: of every parameter, by name.
            road_file: what its OpenDRIVE file will be called.
            courses: see `bridgegen.ontology.individuals.build`.
        """
        site, scenario = self._site(values), self._typed(values)
        if site and self._map and self._map.sites:
            scenario = _at_site(scenario, site, int(values[JUNCTION]))
        if site and road_file:
            site = replace(site, map_file=road_file)
        individuals = build(
            scenario,
            values,
            driver=self._driver,
            ideal=self._ideal,
            site=site,
            courses=courses,
        )
        return _OfOntology(individuals, road_file or f"{self._scenario.name}.xodr", self._map)

    def _typed(self, values: Mapping[str, float]) -> LogicalScenario:
        """Return the scenario with the types that a row gives its participants."""
        if not self.variant_names:
            return self._scenario
        chosen = tuple(
            replace(one, type=one.types[int(values[one.type_by])]) if one.type_by else one
            for one in self._scenario.participants
        )
        story = replace(self._scenario.story, participants=chosen)
        return replace(self._scenario, story=story)


@dataclass(frozen=True)
class _OfOntology:
    individuals: Individuals
    road_file: str
    road_map: RoadMap | None

    @cached_property
    def storyboard(self) -> OpenScenario:
        return openscenario_from_owl(self.individuals, self.road_file)

    @cached_property
    def roads(self) -> OpenDrive:
        return self.road_map.model if self.road_map else opendrive_from_owl(self.individuals)

    @property
    def road_data(self) -> bytes:
        return self.road_map.data if self.road_map else road_xml(self.roads)
