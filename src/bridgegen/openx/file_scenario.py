"""A scenario file of the user's own, and the distribution of its parameters, to be searched.

`FileScenario` is what is searched; `FileSource` makes its concrete scenarios: the same file with
other values of its parameters, on the same map.
"""

import hashlib
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError, ScenarioError
from bridgegen.openx.opendrive.mirror import as_written, right_hand
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read as read_roads
from bridgegen.openx.opendrive.road_map import as_opendrive, map_bytes
from bridgegen.openx.openscenario import distributions as dst
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters, validate
from bridgegen.openx.openscenario.bodies import kind_of
from bridgegen.openx.openscenario.declarations import DRIVER, IDEAL
from bridgegen.openx.openscenario.element import Element, walk
from bridgegen.openx.openscenario.fixed_texts import fixed_texts
from bridgegen.openx.openscenario.parameters import EGO, ego_of, rename_entity
from bridgegen.openx.openscenario.pruning import read_empty_triggers
from bridgegen.openx.openscenario.ranges import FileParameter, Ranges, ranges_of
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.stated_criteria import stated_criteria
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.values import Kind, format_double
from bridgegen.openx.prepared import logic_path, prepared
from bridgegen.scenario.language.constraints import Constraints
from bridgegen.scenario.language.expression import Expression, parse
from bridgegen.scenario.language.objectives import HARM
from bridgegen.scenario.language.parameters import Axis, Bound
from bridgegen.scenario.language.scenario import SearchedScenario, content_of
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.odd.states import LONG, States, facts_of_types
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.site import Site

MAX_SEED = 2**32 - 1

_STATED: Mapping[type[Element], tuple[tuple[str, str, str], ...]] = {
    osc.Fog: (("visual_range", "{}", "visual_range"),),
    osc.Precipitation: (("rain", "{}", "precipitation_intensity"),),
    osc.RoadCondition: (("friction", "0.85*{}", "friction_scale_factor"),),
    osc.Sun: (
        ("sun_altitude", "{}*180/pi", "elevation"),
        ("illuminance", "100000*max(sin({}), 0)", "elevation"),
    ),
    osc.Weather: (("cloud", "{}", "fractional_cloud_cover"),),
    osc.Wind: (("wind", "{}", "speed"),),
    osc.AbsoluteTargetSpeed: (("ego_speed", "3.6*{}", "value"),),
}
"""Quantities of ODDs (``taxonomy.yaml``) that an element states, their formulas, its attributes."""


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
class Variant:
    """A scenario file with some values of its texts.

    Attributes:
        storyboard: the scenario file.
        roads: the map that it names.
    """

    storyboard: osc.OpenScenario
    roads: RoadFile


@dataclass(frozen=True)
class FileScenario(SearchedScenario):
    """A logical scenario that is a scenario file and a file with a distribution.

    Attributes:
        storyboard: the scenario file.
        roads: the map that it names.
        definition: the distribution, or None: then nothing varies.
        texts: of each text that varies its values; a row holds the number of one.
        variant_names: those of them on which the storyboard depends.
        variants: the file by the values of these.
    """

    storyboard: osc.OpenScenario
    roads: RoadFile
    definition: dst.Deterministic | dst.Stochastic | None
    texts: Mapping[str, tuple[str, ...]] = field(default_factory=dict, repr=False)
    variant_names: tuple[str, ...] = field(default=(), repr=False)
    variants: Mapping[tuple[float, ...], Variant] = field(default_factory=dict, repr=False)

    @property
    def fingerprint(self) -> str:
        """See `SearchedScenario`; that of one storyboard does not depend on there being more."""
        content = content_of(self)
        more = repr((self.texts, self.variant_names, self.variants)) if self.variants else ""
        return hashlib.sha256((content + more).encode()).hexdigest()

    def states(self) -> States:
        """Return what the file states of an ODD at the start: weather, the ego's speed, types.

        Of its map it says nothing, which may have other roads elsewhere.
        """
        ego, others = ego_of(self.storyboard), []
        for obj in self.storyboard.entities.scenario_objects:
            kind = kind_of(obj.entity_object) if str(obj.name) != ego else None
            if kind is not None and kind.takes_part:
                others.append(((kind.name,), ""))
        start = self.storyboard.storyboard.init.actions
        own = [each for each in start.privates if str(each.entity_ref) == ego]
        varies = {*self.parameters, *(each.name for each in self.derived), *self.texts}
        fixed = {k: v for k, v in parameters.values(self.storyboard).items() if k not in varies}
        quantities = dict[str, Expression]()
        for element in (each for part in (*start.global_actions, *own) for each in walk(part)):
            for name, formula, attribute in _STATED.get(type(element), ()):
                value = getattr(element, attribute)
                if isinstance(value, osc.ParameterRef):
                    value = fixed.get(value.name, f"({value.name})")
                if value in OKTAS:
                    value = min(OKTAS.index(value), 8)
                elif isinstance(value, osc.Expr):
                    value = _WORD.sub(
                        lambda word: str(fixed.get(word[0], word[0])),
                        f"({value.expression.source})",
                    )
                with suppress(InputError):  # a name that no formula may have
                    found = None if value is None else parse(formula.format(value), longest=LONG)
                    if found and found.names <= varies and not _is_partial(element):
                        quantities[name] = found
        facts, unread = facts_of_types(others), "not read of an OpenSCENARIO file"
        return States(self, frozenset(facts), quantities, tuple(others), True, unread)

    def variant(self, values: Mapping[str, float]) -> Variant:
        """Return the scenario file with the texts that a row has."""
        if not self.variants:
            return Variant(self.storyboard, self.roads)
        return self.variants[tuple(values[name] for name in self.variant_names)]


OKTAS = [*osc.FractionalCloudCover]
_WORD = re.compile(r"[A-Za-z_]\w*")


def _is_partial(element: Element) -> bool:
    """Return whether an element states a quantity in part only: snow is no rain, a bank no fog."""
    if isinstance(element, osc.Precipitation):
        return element.precipitation_type not in ("rain", "dry")
    return isinstance(element, osc.Fog) and element.bounding_box is not None


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
    texts: dict[str, str] = {}
    if distribution is not None:
        given = dst.read_distribution(distribution)
        named = distribution.parent / str(given.scenario_file.filepath)
        # Compared and never opened: a distribution of a stranger's must not make us read a file of
        # its choice.
        if named.resolve() != path.resolve():
            raise FileFormatError(
                f"{distribution}: ScenarioFile must name the scenario that is searched, {path}, "
                f"got {given.scenario_file.filepath} (line {given.scenario_file.line})"
            )
        texts, definition = fixed_texts(storyboard, given.definition)
        if texts:
            storyboard = read(path, texts=texts)
    ranges = ranges_of(storyboard, definition, str(distribution))
    known: dict[Path, RoadFile] = {}
    roads = _roads_of(path, storyboard, known)
    storyboard = prepared(storyboard, roads.model, str(path))
    variants = {}
    for combination in ranges.combinations:
        codes = zip(ranges.variants, combination, strict=True)
        chosen = {name: ranges.texts[name][int(code)] for name, code in codes}
        variants[combination] = _variant(path, texts | chosen, chosen, known)
    bounds, checks = _kept(ranges)
    varied = {
        parameter.axis for parameter in ranges.parameters.values() if parameter.low < parameter.high
    }
    description = str(storyboard.file_header.description).strip()
    criteria, unknown = stated_criteria(storyboard)
    return FileScenario(
        name=path.stem,
        title=description or path.stem,
        description="",
        place=str(distribution or path),
        axes=tuple(axis for axis in Axis if axis in varied),
        parameters=ranges.parameters,
        bounds=bounds,
        checks=checks,
        derived=ranges.derived,
        objective=HARM,
        driver=None,
        **_of_draws(definition, str(distribution)),
        criteria=criteria,
        storyboard=storyboard,
        roads=roads,
        definition=definition,
        texts=ranges.texts,
        notes=(
            *ranges.notes,
            *(f"{path}: {item}" for item in unknown),
            *(f"{path}: {check}, or an evaluation fails ({check.place})" for check in checks),
        ),
        variant_names=ranges.variants,
        variants=variants,
    )


def _kept(ranges: Ranges) -> tuple[tuple[Bound, ...], tuple[Bound, ...]]:
    """Return the limits that shape the search space, and those that a row may break.

    What a distribution gives does not heed a limit; and limits may leave some combinations nothing.
    """
    parameters = ranges.parameters
    even = {
        name
        for name, parameter in parameters.items()
        if not isinstance(parameter, FileParameter) or parameter.distribution is None
    }
    shape = tuple(bound for bound in ranges.bounds if bound.target in even)
    try:
        # Bounds that leave some combination nothing are no shape of a space; they are kept as
        # checks, so that such a row fails by itself.
        SearchSpace(Constraints(parameters, shape, ranges.derived, tuple(Axis)))
    except ScenarioError:
        shape = ()
    return shape, tuple(bound for bound in ranges.bounds if bound not in shape)


def _roads_of(path: Path, storyboard: osc.OpenScenario, known: dict[Path, RoadFile]) -> RoadFile:
    """Return the map that a scenario file names, once it is found that the two fit.

    Args:
        path: of the scenario file.
        storyboard: its contents.
        known: the maps that have been read; takes another one.

    Raises:
        FileFormatError: see ``load_file_scenario``.
        UnsupportedError: likewise.
    """
    road = logic_path(storyboard, path)
    if road not in known:
        data = map_bytes(road)
        known[road] = RoadFile(
            as_opendrive(road).name,
            hashlib.sha256(data).hexdigest(),
            data,
            right_hand(read_roads(data, str(road), may_be_empty=True), str(road)),
        )
    if problems := validate.problems(storyboard, as_written(known[road].model)):
        raise FileFormatError(*(f"{path}: {problem}" for problem in problems))
    return known[road]


def _variant(
    path: Path, texts: dict[str, str], chosen: dict[str, str], known: dict[Path, RoadFile]
) -> Variant:
    """Return a scenario file with other texts; what is wrong with it says which these are.

    Args:
        path: of the scenario file.
        texts: the values of its texts that are not the declared ones.
        chosen: those of them that vary.
        known: see ``_roads_of``.

    Raises:
        FileFormatError: see ``load_file_scenario``.
        UnsupportedError: likewise.
    """
    try:
        storyboard = read(path, texts=texts)
        roads = _roads_of(path, storyboard, known)
        return Variant(prepared(storyboard, roads.model, str(path)), roads)
    except InputError as error:
        said = ", ".join(f"{name} = '{text}'" for name, text in chosen.items())
        raise type(error)(*(f"{problem} [with {said}]" for problem in error.problems)) from None


def _of_draws(definition: dst.Deterministic | dst.Stochastic | None, place: str) -> dict[str, Any]:
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
    constraints = None

    def __init__(self, scenario: FileScenario, driver: str | None, ideal: str = "") -> None:
        self._scenario, self._driver, self._ideal = scenario, driver, ideal

    @property
    def variant_names(self) -> tuple[str, ...]:
        """See `Source`."""
        return self._scenario.variant_names

    @property
    def variants(self) -> tuple[tuple[float, ...], ...]:
        """See `Source`."""
        return tuple(self._scenario.variants)

    @property
    def road(self) -> str:
        """See `Source`."""
        return self._scenario.roads.name

    def place(self, values: Mapping[str, float]) -> Site | None:
        """See `Source`: none is chosen."""
        return None

    def bodies(self, values: Mapping[str, float]) -> Mapping[str, str]:
        """See `Source`."""
        objects = self._scenario.variant(values).storyboard.entities.scenario_objects
        return {str(obj.name): _type_of(obj.entity_object) for obj in objects}

    def roads(self, values: Mapping[str, float]) -> OpenDrive:
        """See `Source`."""
        return self._scenario.variant(values).roads.model

    def courses(self, values: Mapping[str, float]) -> Mapping[str, Float]:
        """See `Source`: the file is the same for all rows."""
        return {}

    def concrete(self, values: Mapping[str, float], road_file: str = "") -> "ConcreteFile":
        """See `Source`."""
        variant = self._scenario.variant(values)
        road_file = road_file or variant.roads.name
        # An exported file stands elsewhere: references to files beside it would lead nowhere.
        storyboard = with_values(_self_contained(variant.storyboard), values, self._scenario.texts)
        if self._driver is not None:
            storyboard = with_driver(storyboard, self._driver, self._ideal)
        network = replace(storyboard.road_network, logic_file=osc.File(road_file))
        return ConcreteFile(replace(storyboard, road_network=network), variant.roads, road_file)


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


def with_values(
    storyboard: osc.OpenScenario,
    values: Mapping[str, float],
    texts: Mapping[str, tuple[str, ...]] = MappingProxyType({}),
) -> osc.OpenScenario:
    """Return a scenario file in which parameters have other values.

    Args:
        storyboard: the file.
        values: by name; those that the file does not declare are passed over.
        texts: what the numbers of those that are texts stand for.
    """
    declared = storyboard.parameter_declarations
    if declared is None:
        return storyboard
    changed = []
    for parameter in declared.parameters:
        if parameter.name in values:
            parameter = replace(
                parameter,
                value=_literal(parameter, values[parameter.name], texts.get(parameter.name)),
            )
        changed.append(parameter)
    return replace(storyboard, parameter_declarations=osc.ParameterDeclarations(tuple(changed)))


def _literal(
    declaration: osc.ParameterDeclaration, value: float, texts: tuple[str, ...] | None
) -> str:
    if texts is not None:
        return texts[int(value)]
    whole = parameters.kind_of(declaration.parameter_type) is not Kind.DOUBLE
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
    for obj in scenario.storyboard.entities.scenario_objects:
        name = str(obj.name)
        driver = drivers.get(name)
        named = any(
            each.controller.properties is not None
            and each.controller.properties.get(DRIVER) is not None
            for each in obj.object_controllers
        )
        if name != ego and (driver is not None or named):
            found[name] = (osc.Property(DRIVER, driver),) if driver is not None else ()
    return _changed(scenario, lambda storyboard: _with_drivers(storyboard, found))


def with_triggers(scenario: FileScenario, reading: str) -> FileScenario:
    """Return a scenario file in which empty StartTriggers are read so; see `read_empty_triggers`.

    Raises:
        UnknownNameError: no such reading.
    """
    return _changed(scenario, lambda storyboard: read_empty_triggers(storyboard, reading))


def _changed(
    scenario: FileScenario, change: Callable[[osc.OpenScenario], osc.OpenScenario]
) -> FileScenario:
    """Return a scenario file with a change of its storyboard, whatever texts it has."""
    return replace(
        scenario,
        storyboard=change(scenario.storyboard),
        variants={
            key: replace(variant, storyboard=change(variant.storyboard))
            for key, variant in scenario.variants.items()
        },
    )


def _with_drivers(
    storyboard: osc.OpenScenario, drivers: Mapping[str, tuple[osc.Property, ...]]
) -> osc.OpenScenario:
    """Return a scenario file in which the first controllers of some entities say these things."""
    if not drivers:
        return storyboard
    objects = []
    for obj in storyboard.entities.scenario_objects:
        if (said := drivers.get(str(obj.name))) is not None:
            controllers = obj.object_controllers or (
                osc.ObjectController(osc.Controller("driver", osc.Properties())),
            )
            first = controllers[0].controller
            properties = first.properties or osc.Properties()
            others = tuple(o for o in properties.properties if o.name not in (DRIVER, IDEAL))
            first = replace(first, properties=replace(properties, properties=(*said, *others)))
            controllers = (replace(controllers[0], controller=first), *controllers[1:])
            obj = replace(obj, object_controllers=controllers)
        objects.append(obj)
    entities = replace(storyboard.entities, scenario_objects=tuple(objects))
    return replace(storyboard, entities=entities)


def _self_contained(storyboard: osc.OpenScenario) -> osc.OpenScenario:
    """Return a file without references to files beside it: it is exported elsewhere."""
    network = replace(storyboard.road_network, scene_graph_file=None)
    return replace(storyboard, road_network=network, catalog_locations=osc.CatalogLocations())


def _type_of(body: Element) -> str:
    kind = kind_of(body)
    if kind is not None:
        return kind.name
    return str(body.vehicle_category) if isinstance(body, osc.Vehicle) else "obstacle"
