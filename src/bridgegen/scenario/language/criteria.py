"""Pass criteria: requirements on a scenario that a formula states, each with an id."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Annotated, Any, Literal

import yaml
from pydantic import Field

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.base.plugins import PlugIns
from bridgegen.scenario.language.parameters import at, nearest
from bridgegen.scenario.language.plain_yaml import MAX_BYTES, Document, entries, read_plain_yaml
from bridgegen.scenario.language.schema_types import (
    ID,
    ShapedSection,
    Text,
    section,
    shape_problems,
)
from bridgegen.scenario.stl import Formula, parse, readings

Severity = Literal["minor", "major", "critical"]

ADDED = PlugIns("criterion", "bridgegen.criteria")

ANY = "any"
"""Name in a formula of any other participant: the least value of all."""

PREFIX = "criterion:"
"""Prefix of a criterion's margin as a quantity, followed by its id: ``criterion:R-12``."""


@dataclass(frozen=True)
class Criterion:
    """A pass criterion.

    Attributes:
        id: of the requirement, ``R-12`` say.
        states: its formula, as written.
        text: the requirement in words; empty: none.
        severity: of a violation.
        tags: words to group it by.
        formula: that of ``states``.
        place: file and line that declare it, for messages.
    """

    id: str
    states: str
    text: str = ""
    severity: Severity = "major"
    tags: tuple[str, ...] = ()
    formula: Formula = field(init=False, repr=False, compare=False)
    place: str = field(default="", compare=False, repr=False)

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "formula", parse(self.states))
        except InputError as error:
            problems = (
                f"criterion {self.id}: {problem}{at(self.place)}" for problem in error.problems
            )
            raise InputError(*problems) from None

    @property
    def quantity(self) -> str:
        """The name of its margin."""
        return PREFIX + self.id

    def to_dict(self) -> dict[str, Any]:
        """Return it as a file declares it, without what is not said."""
        found: dict[str, Any] = {"id": self.id, "formula": self.states}
        if self.text:
            found["text"] = self.text
        if self.severity != "major":
            found["severity"] = self.severity
        if self.tags:
            found["tags"] = list(self.tags)
        return found


Tag = Annotated[str, Field(strict=True, pattern=f"^{ID}$")]


class CriterionSection(ShapedSection):
    """One entry of ``criteria``: a requirement, and the formula that decides whether it is met."""

    id: Annotated[str, Field(strict=True, pattern=f"^{ID}$")]
    """Id of the requirement: letters, digits, '.', '_' and '-'."""
    formula: Text
    """Formula that must hold; see docs/criteria.md."""
    text: Text | None = None
    """Requirement in words."""
    severity: Severity = "major"
    """Severity of a violation."""
    tags: Annotated[list[Tag], Field(default=[])]
    """Tags by which criteria are grouped."""


class CriteriaFile(ShapedSection):
    """A file of criteria, for ``--criterion FILE``."""

    criteria: list[CriterionSection]
    """Pass criteria, each with an id."""


def read_sections(
    given: Sequence[CriterionSection], places: Iterable[str]
) -> tuple[tuple[Criterion, ...], list[str]]:
    """Return the criteria of a file's sections, and what is wrong with others."""
    found, problems = list[Criterion](), list[str]()
    for criterion_section, place in zip(given, places, strict=True):
        try:
            tags = tuple(criterion_section.tags)
            made = Criterion(
                criterion_section.id,
                criterion_section.formula,
                criterion_section.text or "",
                criterion_section.severity,
                tags,
                place,
            )
        except InputError as error:
            problems += error.problems
            continue
        found.append(made)
    return tuple(found), problems + twice(found)


def twice(criteria: Iterable[Criterion]) -> list[str]:
    """Return which ids occur more than once, a sentence each."""
    known: dict[str, Criterion] = {}
    problems = []
    for criterion in criteria:
        if criterion.id in known:
            problems.append(
                f"each criterion has an id of its own, '{criterion.id}' occurs "
                f"twice{at(criterion.place)}"
            )
        known[criterion.id] = criterion
    return problems


def joined(*groups: Iterable[Criterion]) -> tuple[Criterion, ...]:
    """Return the criteria of several sources; the same one said twice is one.

    Raises:
        InputError: different ones have one id.
    """
    found = tuple(dict.fromkeys(criterion for group in groups for criterion in group))
    if problems := twice(found):
        raise InputError(*problems)
    return found


def read_criteria_in(document: Document) -> tuple[tuple[Criterion, ...], list[str]]:
    """Return the criteria of a scenario file, and what is wrong with others.

    What has not the shape of a criterion is left to the check of the file's shape.
    """
    shaped = [
        (given, document.at(("criteria", number)))
        for number, data in entries(document, "criteria")
        if (given := section(CriterionSection, data)) is not None
    ]
    return read_sections([given for given, _ in shaped], [place for _, place in shaped])


def unknown_entities(criteria: Iterable[Criterion], names: Sequence[str]) -> list[str]:
    """Return which formulas name a participant that a scenario has not, a sentence each."""
    known = (*names, ANY)
    return [
        f"criterion {criterion.id}: unknown participant "
        f"'{name}'{nearest(name, known)}{at(criterion.place)}"
        for criterion in criteria
        for reading in readings(criterion.formula)
        for name in reading.of
        if name not in known
    ]


def read_criterion(given: Mapping[str, Any], place: str = "") -> Criterion:
    """Return a criterion of plain data, as ``Criterion.to_dict`` gives them.

    Raises:
        InputError: a key is unknown or missing, a value has another type, or no formula.
    """
    document = Document({"criteria": [dict(given)]}, {}, place or "a criterion")
    if problems := shape_problems(CriteriaFile, document):
        raise InputError(*problems)
    shaped = CriterionSection.model_validate(given)
    found, problems = read_sections([shaped], [place])
    if problems:
        raise InputError(*problems)
    return found[0]


def read_criteria(texts: Sequence[str]) -> tuple[Criterion, ...]:
    """Return the criteria that a user names.

    Args:
        texts: each ``ID: FORMULA``; or a YAML mapping in braces with the keys of a criterion; or
            the path of a YAML file with a list ``criteria``; or the name of an entry point of
            installed packages.

    Raises:
        InputError: all that is wrong.
    """
    found, problems = list[Criterion](), list[str]()
    for text in texts:
        try:
            found += _of_text(text)
        except InputError as error:
            problems += error.problems
    problems += [] if problems else twice(dict.fromkeys(found))
    if problems:
        raise InputError(*problems)
    return tuple(dict.fromkeys(found))


def _of_text(text: str) -> tuple[Criterion, ...]:
    if text.lower().endswith((".yaml", ".yml")):
        return read_criteria_file(FilePath(text))
    if text.startswith("{"):
        document = read_plain_yaml(text.encode(), "--criterion")
        if not isinstance(document.data, dict):
            raise InputError(f"--criterion must be a mapping in braces, got '{text}'")
        return (read_criterion(document.data, "--criterion"),)
    # The first colon ends the id: ids have none, and formulas may (`[0:3]`).
    name, colon, formula = text.partition(":")
    if not colon and name in ADDED.names(()):
        return _of_package(name)
    if not colon or not formula.strip():
        raise InputError(f"--criterion must read ID: FORMULA, or name a YAML file, got '{text}'")
    return (read_criterion({"id": name.strip(), "formula": formula.strip()}, "--criterion"),)


def _of_package(name: str) -> tuple[Criterion, ...]:
    """Return the criteria that an installed package offers by a name.

    Raises:
        InputError: it is no criterion, nor a sequence of them.
    """
    found = ADDED.load(name, ())
    several = (found,) if isinstance(found, Criterion) else found
    if not isinstance(several, list | tuple) or not all(isinstance(c, Criterion) for c in several):
        raise InputError(
            f"{ADDED.place(name)} must be a bridgegen.scenario.language.criteria.Criterion, "
            f"or a list of them, got {type(found).__name__}"
        )
    return tuple(several)


def read_criteria_file(path: FilePath) -> tuple[Criterion, ...]:
    """Return the criteria of a YAML file.

    Raises:
        FileFormatError: it cannot be read, or is no plain YAML.
        InputError: it breaks rules; all of them, with lines.
    """
    try:
        with path.open("rb") as file:
            # One byte more than allowed, by which the parser sees that there is too much.
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise FileFormatError(f"cannot be read: {error.strerror} ({path})") from None
    document = read_plain_yaml(data, str(path))
    problems = shape_problems(CriteriaFile, document)
    found, wrong = read_criteria_in(document)
    if problems + wrong:
        raise InputError(*problems, *wrong)
    return found


def in_words(criterion: Criterion) -> str:
    """Return a criterion as one word of a command line, which ``read_criteria`` reads."""
    given = criterion.to_dict()
    if given.keys() == {"id", "formula"}:
        return f"{criterion.id}: {criterion.states}"
    # In one line, however long it is: it is one word of a command line.
    text: str = yaml.safe_dump(
        given, default_flow_style=True, allow_unicode=True, sort_keys=False, width=10**6
    )
    return text.strip()
