"""Where concrete scenarios come from: what a pipeline asks for, and how the ontology answers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Protocol

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.openx.file_scenario import FileScenario, FileSource
from bridgegen.openx.on_map import PLACE, at_site
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.openx.opendrive.write import to_xml as road_xml
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.openscenario.ranges import MOST_VARIANTS
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.language.story import Participant
from bridgegen.scenario.named_models import MODELS, type_of
from bridgegen.scenario.odd.exit import watched
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build, build_static
from bridgegen.scenario.ontology.site import Site


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

    def place(self, values: Mapping[str, float]) -> Site | None:
        """Return the place of a map that a row takes place at, if one was chosen."""

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
        odd = watched(scenario, on_map=road_map is not None)
        self._odd = odd.text if odd else ""
        if road_map is not None:
            _agree(scenario, road_map)
        self._driver, self._ideal, self._map = driver, ideal, road_map
        static = tuple(
            name for name, parameter in scenario.parameters.items() if parameter.axis is Axis.STATIC
        )
        # A map's roads are what they are, so static parameters leave the search; bounds that depend
        # on them use the map's own values.
        self.static_names = () if road_map else static
        self.unused_names = static if road_map and not road_map.sites else ()
        types = {
            participant.type_by: participant.types
            for participant in scenario.participants
            if participant.type_by
        }
        ways = {
            participant.place_by: participant.ways
            for participant in scenario.participants
            if participant.place_by
        }
        choices: dict[str, Sequence[object]] = {**types, **ways}
        if road_map and road_map.sites:
            choices = {PLACE: road_map.sites} | choices
        self.variant_names = tuple(choices)
        counts = (range(len(choice)) for choice in choices.values())
        self.variants = tuple(tuple(map(float, key)) for key in product(*counts)) if choices else ()
        # Checked here, before anything is read or compiled for them: of so many the user should
        # hear at once.
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
            roads = self._scenario.roads
            side = ", traffic on the left" if roads.left_hand else ""
            return f"generated {roads.template}{side}"
        if self._map.sites:
            places = len({site.place_id for site in self._map.sites})
            if self._map.site.kind is None:
                return f"{self._map.site.name}, {places} stretches of road"
            return f"{self._map.site.name}, {places} junctions in {len(self._map.sites)} ways"
        return f"{self._map.site.name}, {self._map.site.where}"

    def place(self, values: Mapping[str, float]) -> Site | None:
        """See `Source`."""
        if self._map and self._map.sites:
            return self._map.sites[int(values[PLACE])]
        return self._map.site if self._map else None

    def bodies(self, values: Mapping[str, float]) -> Mapping[str, str]:
        """See `Source`."""
        types = {
            participant.name: str(participant.type)
            for participant in self._settled(values).participants
        }
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
            courses: see `bridgegen.scenario.ontology.individuals.build`.
        """
        site, scenario = self.place(values), self._settled(values)
        if site and self._map:
            site = replace(site, left_hand=self._map.model.left_hand)
        if site and self._map and self._map.sites:
            scenario = at_site(scenario, self._map.model, site, int(values[PLACE]))
        if site and road_file:
            site = replace(site, map_file=road_file)
        # By way of the individuals, so that what the checks look at is what the files are made of.
        individuals = build(
            scenario,
            values,
            driver=self._driver,
            ideal=self._ideal,
            odd=self._odd,
            site=site,
            courses=courses,
        )
        return _OfOntology(individuals, road_file or f"{self._scenario.name}.xodr", self._map)

    def _settled(self, values: Mapping[str, float]) -> LogicalScenario:
        """Return the scenario with the types and places that a row gives its participants."""
        if not self.variant_names:
            return self._scenario
        chosen = tuple(_chosen(participant, values) for participant in self._scenario.participants)
        story = replace(self._scenario.story, participants=chosen)
        return replace(self._scenario, story=story)


def _chosen(participant: Participant, values: Mapping[str, float]) -> Participant:
    """Return a participant with the type or model, and at the place, that a row chooses."""
    if participant.type_by:
        name = participant.types[int(values[participant.type_by])]
        participant = replace(participant, type=type_of(name), model=name if name in MODELS else "")
    return (
        participant.at_each_place[int(values[participant.place_by])]
        if participant.place_by
        else participant
    )


def _agree(scenario: LogicalScenario, road_map: RoadMap) -> None:
    """Refuse a map with the other traffic, or of another country, than a scenario states."""
    roads, model = scenario.roads, road_map.model
    if roads.left_hand and not model.left_hand:
        raise InputError(
            f"{scenario.place}: traffic drives on the left, and on the right on {road_map.path} "
            "(the rule of its roads is RHT, or not stated)"
        )
    there = sorted({kind.country or "none" for road in model.roads for kind in road.types})
    if roads.country and there != [roads.country]:
        raise InputError(
            f"{scenario.place}: rules are those of {roads.country}; the roads of {road_map.path} "
            f"must state that country in their type, got {', '.join(there) or 'none'}"
        )


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
