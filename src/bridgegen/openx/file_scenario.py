"""A scenario file of the user's own, and the distribution of its parameters, to be searched.

`FileScenario` is what is searched; `FileSource` makes its concrete scenarios: the same file with
other values of its parameters, on the same map.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType

from bridgegen.arrays import Float
from bridgegen.errors import FileFormatError, InputError
from bridgegen.odd.objectives import HARM
from bridgegen.odd.parameters import Axis, Parameter
from bridgegen.odd.scenario import SearchedScenario
from bridgegen.ontology.graph import Individuals
from bridgegen.openx.logic_file import logic_path
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read as read_roads
from bridgegen.openx.openscenario import distributions as dst
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters, validate
from bridgegen.openx.openscenario.declarations import DRIVER, IDEAL
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.fixed_texts import fixed_texts
from bridgegen.openx.openscenario.from_owl.scenario import EGO
from bridgegen.openx.openscenario.participant_kinds import kind_of
from bridgegen.openx.openscenario.ranges import ranges_of
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.renaming import rename_entity
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.values import Kind, format_double
from bridgegen.openx.xml import read_bytes

MAX_SEED = 2**32 - 1


@dataclass(frozen=True)
class RoadFile:
    """The map of a scenario file.

    Attributes:
        name: of the file.
        digest: SHA-256 of it, in hexadecimal.
        data: its bytes.
        model: its contents.
    """

    name: str
    digest: str
    data: bytes = field(repr=False)
    model: OpenDrive = field(repr=False, compare=False)


@dataclass(frozen=True)
class FileScenario(SearchedScenario):
    """A logical scenario that is a scenario file and a file with a distribution.

    Attributes:
        storyboard: the scenario file.
        roads: the map that it names.
        definition: the distribution, or None: then nothing varies.
    """

    storyboard: osc.OpenScenario
    roads: RoadFile
    definition: dst.Deterministic | dst.Stochastic | None


def load_file_scenario(path: Path, distribution: Path | None = None) -> FileScenario:
    """Read a scenario file, its map, and the distribution of its parameters.

    Args:
        path: the scenario (``.xosc``).
        distribution: a file with a ParameterValueDistribution that names it. What it names is
            compared and never opened.

    Raises:
        FileFormatError: a file is missing, malformed or inconsistent; or the distribution is
            another scenario's, or does not fit its parameters.
        UnsupportedError: what the readers cannot represent, by name and line.
    """
    storyboard = read(path)
    definition: dst.Deterministic | dst.Stochastic | None = None
    if distribution is not None:
        given = dst.read_distribution(distribution)
        named = distribution.parent / str(given.scenario_file.filepath)
        if named.resolve() != path.resolve():
            raise FileFormatError(
                f"{distribution}: ScenarioFile must name the scenario that is searched, {path}, "
                f"got {given.scenario_file.filepath} (line {given.scenario_file.line})"
            )
        texts, definition = fixed_texts(storyboard, given.definition)
        if texts:
            storyboard = read(path, texts=texts)
    road = logic_path(storyboard, path)
    data = read_bytes(road)
    roads = RoadFile(
        road.name,
        hashlib.sha256(data).hexdigest(),
        data,
        read_roads(data, str(road), may_be_empty=True),
    )
    if problems := validate.problems(storyboard, roads.model):
        raise FileFormatError(*(f"{path}: {problem}" for problem in problems))
    ranges = ranges_of(storyboard, definition, str(distribution))
    varied = {one.axis for one in ranges.parameters.values() if one.low < one.high}
    description = str(storyboard.file_header.description).strip()
    return FileScenario(
        name=path.stem,
        title=description or path.stem,
        description="",
        place=str(distribution or path),
        axes=tuple(axis for axis in Axis if axis in varied),
        parameters=ranges.parameters,
        bounds=ranges.bounds,
        derived=ranges.derived,
        objective=HARM,
        driver=None,
        **_of_draws(definition, str(distribution)),
        storyboard=storyboard,
        roads=roads,
        definition=definition,
    )


def _of_draws(definition: dst.Deterministic | dst.Stochastic | None, place: str) -> dict[str, int]:
    """Return the budget and the seed that a stochastic distribution asks for."""
    if not isinstance(definition, dst.Stochastic):
        return {}
    given = {"budget": definition.number_of_test_runs}
    seed = definition.random_seed
    if seed is not None:
        if not (0.0 <= seed <= MAX_SEED and seed.is_integer()):
            raise FileFormatError(
                f"{place}: randomSeed must be a whole number, 0 to {MAX_SEED}, got {seed:g} "
                f"(line {definition.line})"
            )
        given["seed"] = int(seed)
    return given


class FileSource:
    """A `bridgegen.openx.source.Source` of a scenario file with other values of its parameters.

    Args:
        scenario: the file.
        driver: the ego's, by name; None leaves it to the file.
        ideal: the driver's stages that are ideal, separated by commas.
    """

    static_names: tuple[str, ...] = ()
    course_names: tuple[str, ...] = ()
    unused_names: tuple[str, ...] = ()
    junction = None
    constraints = None

    def __init__(self, scenario: FileScenario, driver: str | None, ideal: str = "") -> None:
        self._scenario = scenario
        self._base = _self_contained(scenario)
        if driver is not None:
            self._base = with_driver(self._base, driver, ideal)

    @property
    def road(self) -> str:
        """See `Source`."""
        return self._scenario.roads.name

    @property
    def bodies(self) -> Mapping[str, str]:
        """See `Source`."""
        return {
            str(one.name): _type_of(one.entity_object)
            for one in self._base.entities.scenario_objects
        }

    def roads(self, values: Mapping[str, float]) -> OpenDrive:
        """See `Source`."""
        return self._scenario.roads.model

    def courses(self, values: Mapping[str, float]) -> Mapping[str, Float]:
        """See `Source`: the file is the same for all rows."""
        return {}

    def concrete(self, values: Mapping[str, float], road_file: str = "") -> "ConcreteFile":
        """See `Source`."""
        road_file = road_file or self._scenario.roads.name
        storyboard = with_values(self._base, values, self._scenario.parameters)
        network = replace(storyboard.road_network, logic_file=osc.File(road_file))
        return ConcreteFile(
            replace(storyboard, road_network=network), self._scenario.roads, road_file
        )


@dataclass(frozen=True)
class ConcreteFile:
    """A `bridgegen.openx.source.ConcreteScenario`."""

    storyboard: osc.OpenScenario
    road: RoadFile
    road_file: str

    @property
    def roads(self) -> OpenDrive:
        """See `ConcreteScenario`."""
        return self.road.model

    @property
    def road_data(self) -> bytes:
        """See `ConcreteScenario`."""
        return self.road.data

    @cached_property
    def individuals(self) -> Individuals | None:
        """See `ConcreteScenario`: all contents of the file, or nothing."""
        try:
            renamed = rename_entity(self.storyboard, ego_of(self.storyboard), EGO)
            return individuals_from_openscenario(renamed, self.roads, self.road_file, "")[0]
        except InputError:
            return None


def ego_of(storyboard: osc.OpenScenario) -> str:
    """Return the name of the entity under test: the one called so, else the first."""
    names = [str(one.name) for one in storyboard.entities.scenario_objects]
    return next((name for name in names if name.lower() == EGO), names[0])


def with_values(
    storyboard: osc.OpenScenario,
    values: Mapping[str, float],
    parameters: Mapping[str, Parameter] = MappingProxyType({}),
) -> osc.OpenScenario:
    """Return a scenario file in which parameters have other values.

    Args:
        storyboard: the file.
        values: by name; those that the file does not declare are passed over.
        parameters: what is known of them; needed of categories.
    """
    declared = storyboard.parameter_declarations
    if declared is None:
        return storyboard
    changed = []
    for one in declared.parameters:
        if one.name in values:
            one = replace(one, value=_literal(one, values[one.name], parameters.get(one.name)))
        changed.append(one)
    return replace(storyboard, parameter_declarations=osc.ParameterDeclarations(tuple(changed)))


def _literal(one: osc.ParameterDeclaration, value: float, known: Parameter | None) -> str:
    if known is not None and known.kind.names:
        return known.kind.text(value, str)
    whole = parameters.kind_of(one.parameter_type) is not Kind.DOUBLE
    return str(int(value)) if whole else format_double(value)


def with_driver(storyboard: osc.OpenScenario, driver: str, ideal: str = "") -> osc.OpenScenario:
    """Return a scenario file whose ego's controller names its driver.

    Args:
        storyboard: the file.
        driver: by name.
        ideal: its stages that are ideal, separated by commas.
    """
    said = (osc.Property(DRIVER, driver), *([osc.Property(IDEAL, ideal)] if ideal else []))
    return _with_drivers(storyboard, {ego_of(storyboard): said})


def with_others(scenario: FileScenario, drivers: Mapping[str, str]) -> FileScenario:
    """Return a scenario file whose participants' controllers name these drivers, and no others.

    Args:
        scenario: the file.
        drivers: by the names of participants other than the ego; the rest has none.
    """
    ego, found = ego_of(scenario.storyboard), {}
    for one in scenario.storyboard.entities.scenario_objects:
        name = str(one.name)
        driver = drivers.get(name)
        named = any(
            each.controller.properties is not None
            and each.controller.properties.get(DRIVER) is not None
            for each in one.object_controllers
        )
        if name != ego and (driver is not None or named):
            found[name] = (osc.Property(DRIVER, driver),) if driver is not None else ()
    return replace(scenario, storyboard=_with_drivers(scenario.storyboard, found))


def _with_drivers(
    storyboard: osc.OpenScenario, drivers: Mapping[str, tuple[osc.Property, ...]]
) -> osc.OpenScenario:
    """Return a scenario file in which the first controllers of some entities say these things."""
    if not drivers:
        return storyboard
    objects = []
    for one in storyboard.entities.scenario_objects:
        if (said := drivers.get(str(one.name))) is not None:
            controllers = one.object_controllers or (
                osc.ObjectController(osc.Controller("driver", osc.Properties())),
            )
            first = controllers[0].controller
            properties = first.properties or osc.Properties()
            others = tuple(o for o in properties.properties if o.name not in (DRIVER, IDEAL))
            first = replace(first, properties=replace(properties, properties=(*said, *others)))
            controllers = (replace(controllers[0], controller=first), *controllers[1:])
            one = replace(one, object_controllers=controllers)
        objects.append(one)
    entities = replace(storyboard.entities, scenario_objects=tuple(objects))
    return replace(storyboard, entities=entities)


def _self_contained(scenario: FileScenario) -> osc.OpenScenario:
    """Return the file without references to files beside it: it is exported elsewhere."""
    network = replace(scenario.storyboard.road_network, scene_graph_file=None)
    return replace(
        scenario.storyboard, road_network=network, catalog_locations=osc.CatalogLocations()
    )


def _type_of(body: Element) -> str:
    kind = kind_of(body)
    if kind is not None:
        return kind.name
    return str(body.vehicle_category) if isinstance(body, osc.Vehicle) else "obstacle"
