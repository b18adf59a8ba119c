"""From scenario files to logical scenarios, and every reason why a file is none, at once."""

import re
from collections.abc import Callable
from importlib import resources
from pathlib import Path

from bridgegen.errors import FileFormatError, InputError, ScenarioError, UnknownNameError
from bridgegen.odd.checks import try_out, use_problems
from bridgegen.odd.constraints import problems_of
from bridgegen.odd.expression import parse
from bridgegen.odd.parameters import Axis, Bound, Derived, Parameter, at, read_axes
from bridgegen.odd.plain_yaml import MAX_BYTES, Document, entries, read_plain_yaml
from bridgegen.odd.scenario import LogicalScenario
from bridgegen.odd.schema import (
    BoundSection,
    DerivedSection,
    FragmentFile,
    ParameterSection,
    ScenarioFile,
    Section,
    section,
    shape_problems,
)
from bridgegen.odd.storyboard import Storyboard


def names(kind: str = "scenario") -> tuple[str, ...]:
    """Return the names of the scenarios (or, as ``kind``, the fragments) that ship."""
    folder = resources.files("bridgegen.catalogue")
    return tuple(
        sorted(
            entry.name.removesuffix(".yaml")
            for entry in folder.iterdir()
            if entry.name.endswith(".yaml")
            and re.search(rf"^{kind}:", entry.read_text("utf-8"), re.MULTILINE)
        )
    )


def load(name_or_path: str | Path) -> LogicalScenario:
    """Read a logical scenario.

    Args:
        name_or_path: a name of the catalogue, or the path of a file (ends in .yaml or .yml).

    Raises:
        UnknownNameError: no such name in the catalogue.
        FileFormatError: the file is missing, unreadable, too large, or no plain YAML.
        ScenarioError: what it says breaks a rule; all that does, with file and line.
    """
    text = str(name_or_path)
    path = Path(text)
    if isinstance(name_or_path, Path) or path.suffix in (".yaml", ".yml") or len(path.parts) > 1:
        document, folder = _read_file(path), path.parent
    elif text in names():
        document, folder = _read_catalogue(text), None
    else:
        raise UnknownNameError("scenario", text, names())
    return _build(document, folder)


def _read_file(path: Path) -> Document:
    try:
        if not path.is_file():
            raise FileFormatError(f"no such file: {path}")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise FileFormatError(f"cannot be read: {error.strerror} ({path})") from None
    return read_plain_yaml(data, str(path))


def _read_catalogue(name: str) -> Document:
    data = resources.files("bridgegen.catalogue").joinpath(f"{name}.yaml").read_bytes()
    return read_plain_yaml(data, f"{name}.yaml")


class _Declarations:
    """The parameters and constraints of a file and of the fragments that it includes.

    Attributes:
        parameters: those that keep the rules for one.
        bounds: likewise.
        derived: likewise.
        names: all that are declared, rightly or wrongly.
        problems: why the others do not.
        complete: whether every file to include could be read.
    """

    def __init__(self) -> None:
        self.parameters: list[Parameter] = []
        self.bounds: list[Bound] = []
        self.derived: list[Derived] = []
        self.names: set[str] = set()
        self.problems: list[str] = []
        self.complete = True

    def include(self, document: Document, folder: Path | None) -> None:
        """Take in the fragments that a scenario names."""
        given = document.data.get("include") if isinstance(document.data, dict) else None
        for number, name in enumerate(given if isinstance(given, list) else ()):
            try:
                fragment = _read_fragment(str(name), folder)
            except InputError as error:
                place = at(document.at(("include", number)))
                self.problems += [problem + place for problem in error.problems]
                self.complete = False
                continue
            self.problems += shape_problems(FragmentFile, fragment)
            self.take(fragment)

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
                self.names.add(name)
            given = section(model, data)
            if given is not None:
                try:
                    build(str(name), given, document.at((key, name)))
                except InputError as error:
                    self.problems += error.problems

    def _parameter(self, name: str, given: ParameterSection, place: str) -> None:
        values = given.model_dump(exclude={"axis"})
        self.parameters.append(Parameter(name, Axis(given.axis), **values, place=place))

    def _bound(self, _: str, given: BoundSection, place: str) -> None:
        lo, hi = (
            None if side is None else parse(_formula(side), place) for side in (given.lo, given.hi)
        )
        self.bounds.append(Bound(given.target, lo, hi, given.why, given.source, place))

    def _derived(self, name: str, given: DerivedSection, place: str) -> None:
        value = parse(_formula(given.value), place)
        self.derived.append(
            Derived(
                name, Axis(given.axis), given.unit, value,
                given.why, given.source, given.description, place,
            )
        )  # fmt: skip


def _formula(given: float | str) -> str:
    return given if isinstance(given, str) else repr(given)


def _read_fragment(name: str, folder: Path | None) -> Document:
    """Read a fragment of the catalogue, or one beside a user's own scenario."""
    if not name.endswith((".yaml", ".yml")):
        known = names("fragment")
        if name not in known:
            raise UnknownNameError("fragment", name, known)
        return _read_catalogue(name)
    if folder is None or Path(name).is_absolute() or ".." in Path(name).parts:
        raise ScenarioError(f"a file to include lies beside the scenario, got '{name}'")
    return _read_file(folder / name)


def _build(document: Document, folder: Path | None) -> LogicalScenario:
    problems = shape_problems(ScenarioFile, document)
    said = _Declarations()
    said.include(document, folder)
    said.take(document)
    if not said.complete or not isinstance(document.data, dict):
        raise ScenarioError(*problems, *said.problems)  # the rest would only say what follows
    parameters = {one.name: one for one in said.parameters}
    derived = {one.name: one for one in said.derived}
    declared: dict[str, Parameter | Derived] = {**derived, **parameters}
    story = Storyboard(document, parameters, derived, said.names)
    problems += said.problems + story.problems
    problems += problems_of(said.parameters, said.bounds, said.derived, said.names)
    problems += use_problems(declared, said.bounds, said.names, story.used, document.place)
    given = section(ScenarioFile, document.data)
    if problems or given is None or story.objective is None:
        raise ScenarioError(*problems)
    scenario = LogicalScenario(
        name=given.scenario,
        title=given.title,
        description=given.description,
        source=given.source,
        place=document.place,
        duration=given.duration,
        time_step=given.time_step,
        template=given.template,
        participants=story.participants,
        events=story.events,
        axes=read_axes(given.axes),
        parameters=parameters,
        bounds=tuple(said.bounds),
        derived=tuple(said.derived),
        objective=story.objective,
    )
    try_out(scenario)
    return scenario
