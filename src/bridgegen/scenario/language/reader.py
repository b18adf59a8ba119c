"""From scenario files to logical scenarios, with all errors of a file at once."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeVar

from bridgegen.base.errors import FileFormatError, InputError, ScenarioError, UnknownNameError
from bridgegen.scenario.countries import COUNTRIES, in_the_mirror
from bridgegen.scenario.language.adversary import DRIVERS, SCRIPTED, driven
from bridgegen.scenario.language.checks import NEEDED, time_problems, try_out, use_problems
from bridgegen.scenario.language.constraints import problems_of
from bridgegen.scenario.language.criteria import read_criteria_in, unknown_entities
from bridgegen.scenario.language.expression import Expression, parse
from bridgegen.scenario.language.kinds import FLOAT, KEYS, KINDS, Kind
from bridgegen.scenario.language.objectives import HARM, PAPERS, read_objective
from bridgegen.scenario.language.parameters import (
    Axis,
    Bound,
    Derived,
    Parameter,
    at,
    nearest,
    read_axes,
)
from bridgegen.scenario.language.places import Quantities, TemporaryChanges, jam_members
from bridgegen.scenario.language.plain_yaml import MAX_BYTES, Document, entries, read_plain_yaml
from bridgegen.scenario.language.prior import Band, Prior
from bridgegen.scenario.language.protocols import read_clauses_in, read_matrix
from bridgegen.scenario.language.roads import KNOBS, RoadsSpec
from bridgegen.scenario.language.roads_reader import read_roads
from bridgegen.scenario.language.rules import bounds_between_layers
from bridgegen.scenario.language.scenario import LogicalScenario, ObjectiveSpec
from bridgegen.scenario.language.schema import (
    BoundSection,
    DerivedSection,
    FragmentFile,
    ObjectiveSection,
    ParameterSection,
    RoadsSection,
    ScenarioFile,
)
from bridgegen.scenario.language.schema_types import Section, section, shape_problems
from bridgegen.scenario.language.story import Story
from bridgegen.scenario.language.storyboard import Storyboard, read_recorded
from bridgegen.scenario.language.tables import PackTable, read_table

DSL = ".osc"
"""Ending of the names of OpenSCENARIO DSL files."""

_PREFIX = re.compile(r"[a-z][a-z0-9_]{0,30}_")


@cache
def names(kind: str = "scenario") -> tuple[str, ...]:
    """Return the names of the scenarios (or, as ``kind``, the fragments) that ship."""
    folder = resources.files("bridgegen.scenario.catalogue")
    return tuple(
        sorted(
            entry.name.removesuffix(".yaml")
            for entry in folder.iterdir()
            if entry.name.endswith(".yaml")
            and re.search(rf"^{kind}:", entry.read_text("utf-8"), re.MULTILINE)
        )
    )


@cache
def pack_names() -> tuple[str, ...]:
    """Return the names of the scenarios of all packs that ship, each ``PACK/NAME``."""
    folder = resources.files("bridgegen.scenario.packs")
    return tuple(
        sorted(
            f"{pack.name}/{entry.name.removesuffix('.yaml')}"
            for pack in folder.iterdir()
            if pack.is_dir()
            for entry in pack.iterdir()
            if entry.name.endswith(".yaml")
        )
    )


@cache
def pack_tables() -> Mapping[str, PackTable]:
    """Return the packs that ship as tables of clauses, by name."""
    folder = resources.files("bridgegen.scenario.packs")
    files = sorted(item.name for item in folder.iterdir() if item.name.endswith(".yaml"))
    read = [read_plain_yaml(folder.joinpath(file).read_bytes(), file) for file in files]
    tables = [read_table(document, lambda name: _shipped(name).is_file()) for document in read]
    return {table.file.pack: table for table in tables}


@cache
def entry_names() -> tuple[str, ...]:
    """Return the names of the entries of all tables that ship, each ``PACK/NAME``."""
    return tuple(
        f"{pack}/{name}" for pack, table in pack_tables().items() for name in table.entries
    )


def shipped_text(name: str) -> bytes:
    """Return the file of a scenario or fragment that ships.

    Args:
        name: of `names` or `pack_names`.
    """
    return _shipped(name).read_bytes()


def _shipped(name: str) -> Traversable:
    folder = "bridgegen.scenario.packs" if "/" in name else "bridgegen.scenario.catalogue"
    return resources.files(folder).joinpath(f"{name}.yaml")


def load(name_or_path: str | Path) -> LogicalScenario:
    """Read a logical scenario.

    Args:
        name_or_path: a name of the catalogue or of a pack ("r157/cut-in"), or the path of a file
            (ends in .yaml, .yml or, OpenSCENARIO DSL, .osc).

    Raises:
        UnknownNameError: no such name in the catalogue or the packs.
        FileFormatError: the file is missing, unreadable, too large, or no plain YAML.
        ScenarioError: it breaks rules; all of them, with file and line.
    """
    text = str(name_or_path)
    if not isinstance(name_or_path, Path) and text in (*names(), *pack_names()):
        return _load_shipped(text)
    pack, _, entry = text.partition("/")
    if not entry or (table := pack_tables().get(pack)) is None:
        return build(*document_of(name_or_path))
    if entry not in table.entries:
        raise UnknownNameError("scenario", text, entry_names())
    return table.applied(entry, load(table.entries[entry][0]))


@cache
def _load_shipped(name: str) -> LogicalScenario:
    return build(_read_shipped(name), None)


def document_of(name_or_path: str | Path) -> tuple[Document, Path | None]:
    """Return the file of a logical scenario, and the folder that it lies in; None if it ships.

    Args:
        name_or_path: see `load`.

    Raises:
        UnknownNameError: no such name in the catalogue or the packs.
        FileFormatError: the file is missing, unreadable, too large, or no plain YAML.
    """
    text = str(name_or_path)
    path = Path(text)
    if path.suffix.lower() == DSL:
        from bridgegen.scenario.language.dsl.story import read_dsl

        return read_dsl(path), path.parent
    is_path = isinstance(name_or_path, Path) or path.suffix in (".yaml", ".yml")
    # A name with a slash is a pack's only where there is such a pack; any other one is a path, and
    # the message says that the file is missing.
    if not is_path and len(path.parts) > 1:
        is_path = not any(name.startswith(f"{path.parts[0]}/") for name in pack_names())
    if is_path:
        return read_document(path), path.parent
    if text in (known := (*names(), *pack_names())):
        return _read_shipped(text), None
    raise UnknownNameError("scenario", text, known)


def read_document(path: Path) -> Document:
    """Read a YAML file of a user's.

    Raises:
        FileFormatError: missing, unreadable, too large, no plain YAML; all that was found.
    """
    try:
        if not path.is_file():
            raise FileFormatError(f"no such file: {path}")
        with path.open("rb") as file:
            # One byte more than allowed, by which the parser sees that there is too much.
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise FileFormatError(f"cannot be read: {error.strerror} ({path})") from None
    return read_plain_yaml(data, str(path))


def _read_shipped(name: str) -> Document:
    return read_plain_yaml(shipped_text(name), f"{name}.yaml")


class _Declarations:
    """The parameters and constraints of a file and of the fragments that it includes.

    Attributes:
        parameters: those that keep the rules for one.
        bounds: likewise.
        derived: likewise.
        names: all that are declared, rightly or wrongly.
        problems: why the others do not.
        complete: whether every file to include could be read.
        prefixes: under which a fragment was included again ("weather as later_").
    """

    def __init__(self) -> None:
        self.parameters: list[Parameter] = []
        self.bounds: list[Bound] = []
        self.derived: list[Derived] = []
        self.names: set[str] = set()
        self.problems: list[str] = []
        self.complete = True
        self.prefixes: tuple[str, ...] = ()
        self._prefix = ""
        self._renamed: re.Pattern[str] | None = None

    def include(self, document: Document, folder: Path | None) -> None:
        """Take in the fragments that a scenario names."""
        given = document.data.get("include") if isinstance(document.data, dict) else None
        for number, name in enumerate(given if isinstance(given, list) else ()):
            place = at(document.at(("include", number)))
            file, separator, prefix = str(name).partition(" as ")
            if separator and not (_PREFIX.fullmatch(prefix) and prefix not in self.prefixes):
                self.problems.append(
                    "a fragment is included again as 'NAME as PREFIX', a prefix of its own of "
                    f"lower case letters that ends in '_', got '{name}'{place}"
                )
                self.complete = False
                continue
            try:
                fragment = _read_fragment(file, folder)
            except InputError as error:
                self.problems += [problem + place for problem in error.problems]
                self.complete = False
                continue
            self.problems += shape_problems(FragmentFile, fragment)
            self._again(fragment, prefix)
            self.take(fragment)
            self._again(fragment, "")

    def _again(self, fragment: Document, prefix: str) -> None:
        """Take a fragment's own names with a prefix from now on; an empty one ends it."""
        self._prefix, self._renamed = prefix, None
        if prefix:
            self.prefixes += (prefix,)
            own = [name for key in ("parameters", "derived") for name, _ in entries(fragment, key)]
            self._renamed = re.compile(rf"\b({'|'.join(re.escape(str(name)) for name in own)})\b")

    def _formula(self, given: float | str) -> str:
        text = given if isinstance(given, str) else repr(given)
        return self._renamed.sub(rf"{self._prefix}\1", text) if self._renamed else text

    def take(self, document: Document) -> None:
        """Take in what a file declares, as far as it has the right shape."""
        self._take(document, "parameters", ParameterSection, self._parameter)
        self._take(document, "bounds", BoundSection, self._bound)
        self._take(document, "derived", DerivedSection, self._derived)

    def _take(
        self,
        document: Document,
        key: str,
        model: type[Section],
        build: Callable[[str, Section, str], None],
    ) -> None:
        for name, data in entries(document, key):
            if isinstance(name, str):
                self.names.add(self._prefix + name)
            given = section(model, data)
            if given is not None:
                try:
                    build(str(name), given, document.at((key, name)))
                except InputError as error:
                    self.problems += error.problems

    def number_categories(self) -> None:
        """Read the formulas in which categories are compared with their values."""
        # A second pass: a category may be declared after the formula that compares it, or in the
        # file that includes the fragment.
        named = [parameter for parameter in self.parameters if parameter.kind.names]
        categories = {parameter.name: parameter.kind.names for parameter in named}
        self.problems += [
            f"'{value}' is a value of the category {parameter.name}, and cannot name a parameter"
            f"{at(parameter.place)}"
            for parameter in named
            for value in sorted(self.names.intersection(parameter.kind.names))
        ]
        bounds, self.bounds = self.bounds, []
        for bound in bounds:
            with self._noting():
                lo, hi = (_numbered(side, bound, categories) for side in (bound.lo, bound.hi))
                self.bounds.append(replace(bound, lo=lo, hi=hi))
        derived, self.derived = self.derived, []
        for item in derived:
            with self._noting():
                self.derived.append(replace(item, value=_numbered(item.value, item, categories)))

    @contextmanager
    def _noting(self) -> Iterator[None]:
        try:
            yield
        except InputError as error:
            self.problems += error.problems

    def set_defaults(self, document: Document) -> None:
        """Give included parameters the defaults that the scenario wants."""
        own = {name for name, _ in entries(document, "parameters")}
        at_ = {item.name: number for number, item in enumerate(self.parameters)}
        for key, value in entries(document, "defaults"):
            place, name = document.at(("defaults", key)), str(key)
            if name in own:
                self.problems.append(
                    f"{name} is this file's own: its default stands there{at(place)}"
                )
            elif name not in at_:
                if name not in self.names:
                    hint = nearest(name, at_)
                    self.problems.append(
                        f"defaults names the unknown parameter '{name}'{hint}{at(place)}"
                    )
                else:
                    self.problems.append(f"{name} is derived: it has no default{at(place)}")
            # YAML's true is a bool, which is an int in Python.
            elif isinstance(value, int | float | str) and not isinstance(value, bool):
                parameter = self.parameters[at_[name]]
                try:
                    default = parameter.read(value)
                except InputError as error:
                    self.problems += [f"defaults.{text}{at(place)}" for text in error.problems]
                    continue
                with self._noting():
                    self.parameters[at_[name]] = replace(parameter, default=default, place=place)

    def _parameter(self, name: str, given: ParameterSection, place: str) -> None:
        if problems := _key_problems(name, given):
            raise ScenarioError(*(problem + at(place) for problem in problems))
        kind = KINDS[given.kind].declared(given.values or (), given.low, given.high)
        low, high = kind.limits(given.low, given.high)
        default = kind.read(given.default, low, high)
        if default is None:
            raise ScenarioError(
                f"parameters.{name}.default must be {kind.expected()}, got {given.default!r}"
                f"{at(place)}"
            )
        if given.only is not None:
            low = high = default
            if not kind.names or kind.read(given.only, low, high) != default:
                raise ScenarioError(
                    f"parameters.{name}.only must be the default of a category, got {given.only!r}"
                    f"{at(place)}"
                )
        self.parameters.append(
            Parameter(
                self._prefix + name,
                Axis(given.axis),
                given.unit or "1",
                low,
                high,
                default,
                kind,
                given.description,
                given.source,
                place,
                prior=_prior(name, given, kind, low, high, place),
            )
        )

    def _bound(self, _: str, given: BoundSection, place: str) -> None:
        lo, hi = (
            None if side is None else parse(self._formula(side), place)
            for side in (given.lo, given.hi)
        )
        target = self._formula(given.target)
        self.bounds.append(Bound(target, lo, hi, given.why, given.source, place))

    def _derived(self, name: str, given: DerivedSection, place: str) -> None:
        value = parse(self._formula(given.value), place)
        self.derived.append(
            Derived(
                self._prefix + name,
                Axis(given.axis),
                given.unit,
                value,
                given.why,
                given.source,
                given.description,
                place,
            )
        )


Side = TypeVar("Side", Expression, Expression | None)


def _numbered(
    formula: Side, rule: Bound | Derived, categories: Mapping[str, Sequence[str]]
) -> Side:
    """Return a formula with the categories that it names, as they are now known."""
    if formula is None or not formula.names & categories.keys():
        return formula
    return parse(formula.source, rule.place, categories)


def _prior(
    name: str, given: ParameterSection, kind: Kind, low: float, high: float, place: str
) -> Prior | None:
    """Return the prior that a parameter declares."""
    if given.prior is None:
        return None
    if kind != FLOAT or Axis(given.axis) is not Axis.WEATHER:  # pages say "weather as it is met"
        raise ScenarioError(
            "only a float of the axis weather can have a prior, got "
            f"parameters.{name} of kind {kind.name}, axis {given.axis}{at(place)}"
        )
    bands = tuple(Band(name, to, share) for name, (to, share) in given.prior.bands.items())
    try:
        return Prior(low, high, bands, given.prior.source)
    except ScenarioError as error:
        raise ScenarioError(f"parameters.{name}.prior: {error}{at(place)}") from None


def _key_problems(name: str, given: ParameterSection) -> list[str]:
    """Return which keys a parameter of its kind lacks, and which it cannot have."""
    kind, found = KINDS[given.kind], []
    for key in KEYS:
        there = getattr(given, key) is not None
        if key in kind.keys and not there:
            found.append(f"parameters.{name} must have the key '{key}'")
        elif there and key not in kind.keys:
            found.append(f"parameters.{name} of kind {kind.name} has no key '{key}'")
    return found


def _read_fragment(name: str, folder: Path | None) -> Document:
    """Read a fragment of the catalogue, or one beside a user's own scenario."""
    if not name.endswith((".yaml", ".yml")):
        known = names("fragment")
        if name not in known:
            raise UnknownNameError("fragment", name, known)
        return _read_shipped(name)
    # A scenario may come from a stranger: what it includes must not lead out of its folder.
    if folder is None or Path(name).is_absolute() or ".." in Path(name).parts:
        raise ScenarioError(f"a file to include lies beside the scenario, got '{name}'")
    return read_document(folder / name)


_USING = ("roads", "participants", "events", "jams", "road_works", "ghosts", "tracker")


def _texts(data: object) -> set[str]:
    """Return all texts that are values within data."""
    if isinstance(data, dict):
        data = list(data.values())
    if isinstance(data, list):
        return set().union(*map(_texts, data))
    return {data} if isinstance(data, str) else set()


def build(document: Document, folder: Path | None) -> LogicalScenario:
    """Return the logical scenario of a file.

    Args:
        document: the file.
        folder: where files lie that it includes; None: of a user's own, nowhere.

    Raises:
        ScenarioError: it breaks rules; all of them, with file and line.
    """
    if isinstance(document.data, dict) and "exposure_of" in document.data:
        raise ScenarioError(
            f"a scenario is needed, and this is an exposure of {document.data['exposure_of']}: "
            f"name the scenario, and the exposure by --exposure ({document.at(('exposure_of',))})"
        )
    problems = shape_problems(ScenarioFile, document)
    declarations = _Declarations()
    declarations.include(document, folder)
    declarations.take(document)
    declarations.set_defaults(document)
    if not declarations.complete or not isinstance(document.data, dict):
        raise ScenarioError(*problems, *declarations.problems)  # others would be consequences
    declarations.number_categories()
    if document.data.get("priors") == "even":
        declarations.parameters = [replace(item, prior=None) for item in declarations.parameters]
    parameters = {parameter.name: parameter for parameter in declarations.parameters}
    derived = {item.name: item for item in declarations.derived}
    declared: dict[str, Parameter | Derived] = {**derived, **parameters}
    quantities = Quantities(document, parameters, derived, declarations.names)
    roads = _roads(document, quantities)
    if roads is None:
        raise ScenarioError(
            *problems, *declarations.problems
        )  # no place can be checked without them
    board = Storyboard(quantities, roads, declarations.prefixes, jam_members(quantities))
    changes = TemporaryChanges(quantities, roads)
    said_of_others = document.data.get("others")
    # A wrong word is reported with the shape.
    others = said_of_others if said_of_others in DRIVERS else SCRIPTED
    participants = driven((*board.participants, *changes.participants), board.events, others)
    story = Story(participants, board.events, changes.jams, changes.works, *board.perception)
    objective = _objective(document.data.get("objective", "harm"), quantities)
    criteria, wrong = read_criteria_in(document)
    problems += wrong + unknown_entities(
        criteria, [participant.name for participant in story.participants]
    )
    matrix = read_matrix(document, parameters, derived, quantities.report)
    clauses, wrong = read_clauses_in(document, criteria)
    problems += wrong
    recorded, wrong = read_recorded(document, parameters, derived)
    problems += wrong
    more = [*changes.derived, *board.derived]
    declarations.derived += more
    derived |= {item.name: item for item in more}
    between = bounds_between_layers(roads, story, parameters, declarations.prefixes, document.place)
    if not quantities.problems:
        declarations.bounds += between
    used = quantities.used | roads.parameters | {item.name for item in more}
    used |= {prefix + name for prefix in story.later_weathers for name in NEEDED}
    if problems or quantities.problems:  # a section that cannot be read uses what it names
        used |= _texts([document.data.get(key) for key in _USING])
    problems += declarations.problems + quantities.problems
    problems += problems_of(
        declarations.parameters, declarations.bounds, declarations.derived, declarations.names
    )
    problems += use_problems(
        declared | derived, declarations.bounds, declarations.names, used, document.place
    )
    problems += time_problems(document)
    given = section(ScenarioFile, document.data)
    if problems or given is None or objective is None:
        raise ScenarioError(*problems)
    if roads.left_hand:
        said = {name: _told(item) for name, item in parameters.items()}
        declarations.derived = [_told(item) for item in declarations.derived]
        declarations.bounds = [
            replace(bound, why=in_the_mirror(bound.why)) for bound in declarations.bounds
        ]
        parameters = said
    told = in_the_mirror if roads.left_hand else str
    scenario = LogicalScenario(
        name=given.scenario,
        title=told(given.title),
        description=told(given.description),
        source=given.source,
        place=document.place,
        duration=given.duration,
        time_step=given.time_step,
        road_end=given.road_end,
        roads=roads,
        story=story,
        driver="" if given.driver == "storyboard" else given.driver,
        effects=tuple(effect.function for effect in given.effects),
        axes=read_axes(given.axes),
        parameters=parameters,
        bounds=tuple(declarations.bounds),
        derived=tuple(declarations.derived),
        objective=objective,
        criteria=criteria,
        matrix=matrix,
        clauses=clauses,
        recorded=recorded,
        domain=document.below("odd") if given.odd else None,
        exposure=document.below("exposure") if given.exposure is not None else None,
        notes=document.notes,
    )
    try_out(scenario)
    return scenario


Told = TypeVar("Told", Parameter, Derived)


def _told(item: Told) -> Told:
    """Return a parameter with its description in the mirror."""
    return replace(item, description=in_the_mirror(item.description))


def _objective(data: Any, quantities: Quantities) -> ObjectiveSpec | None:
    """Return what the file optimises; None if that is not of the right shape."""
    if data in ("harm", "paper"):
        return HARM if data == "harm" else PAPERS
    raw = section(ObjectiveSection, data)
    return None if raw is None else read_objective(raw, quantities.report)


def _roads(document: Document, quantities: Quantities) -> RoadsSpec | None:
    """Return the file's roads; None if that section is not of the right shape."""
    data = document.data if isinstance(document.data, dict) else {}
    template = data.get("template")
    kind = next((knob for knob in KNOBS if knob == template), None)
    given = section(RoadsSection, data.get("roads", {}))
    if kind is None or given is None:
        return None
    roads = read_roads(
        kind,
        given,
        quantities.parameters,
        quantities.derived,
        quantities.declared,
        quantities.report,
    )
    country = COUNTRIES.get(str(data.get("rules")))
    side = data.get("traffic") or (country.traffic if country else "right")
    if country and side != country.traffic:
        quantities.report(
            f"traffic must be {country.traffic}, as the rules of {data['rules']} have it, "
            f"got {side}",
            ("traffic",),
        )
    return replace(roads, left_hand=side == "left", country=country.code if country else "")
