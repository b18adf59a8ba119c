"""``failures.yaml``: the failures that are known, a block each, with the status a person sets.

``bridgegen suite add`` adds blocks with files, a suite's; ``bridgegen dashboard --update`` adds
blocks without. What people write is kept: blocks stay where they are, with status, comment, and the
YAML comments above a block and beside these two keys.
"""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import BeforeValidator, Field

from bridgegen.base.disk import locked, write_whole
from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.scenario.language.criteria import CriterionSection, read_criterion
from bridgegen.scenario.language.plain_yaml import MAX_BYTES, Document, read_plain_yaml
from bridgegen.scenario.language.schema_types import ShapedSection, shape_problems

FILE = "failures.yaml"
"""File of known failures in the folder of a suite or a project."""

OLD_FILE = "failure-modes.yaml"
"""File of the dashboard's statuses before they were in `FILE`; read, and never written."""

Status = Literal["new", "known", "accepted", "fixed"]

STATUSES: tuple[Status, ...] = get_args(Status)

HEAD = """\
# Known failures, a block each. 'bridgegen suite add' and 'bridgegen dashboard --update' add blocks
# and leave the others. Yours are status and comment: new, known, accepted, or fixed. Known and
# accepted failures do not fail a suite; new ones do, and so do fixed ones that fail again.
"""

MOST_TEXT = 2000
"""Largest number of characters of one text."""

_Id = Annotated[str, Field(min_length=1, max_length=200)]
_File = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]{0,99}\.xosc$")]
_Text = Annotated[str, Field(max_length=MOST_TEXT)]
_OrNone = Annotated[_Text, BeforeValidator(lambda value: "" if value is None else value)]
_OWN = ("status", "comment")
"""The keys that people write."""
_OPTIONAL = (*_OWN, "minimal", "note", "violates", "count", "seed")
"""The keys that the block of a suite may lack."""


class ChangedError(StorageError):
    """The file was changed after it was read: nothing is written."""


class Failure(ShapedSection):
    """A failure of the system under test, or a failure mode of a project.

    A block with files is a suite's, and has all keys but `_OPTIONAL`. The keys from scenario on to
    cause are the failure mode; see `bridgegen.search.triage.modes.Key`.
    """

    title: _OrNone = ""
    """Title: the failure in words."""
    status: Status = "new"
    """Status that a person sets."""
    comment: _OrNone = ""
    """Comment of a person."""
    scenario: _OrNone = ""
    """Scenario in which the failure was found."""
    conflict: _Text = ""
    """Conflict: "contact", "near miss", …"""
    type: _Text = ""
    """Type of the conflict."""
    responsible: _Text = ""
    """Party that is responsible for the conflict."""
    rule: _Text = ""
    """Rule that decides on the responsibility."""
    partner: _Text = ""
    """Kind of the other participant."""
    place: _Text = ""
    """Place of the conflict on the ego's route."""
    cause: _Text = ""
    """Root cause of the failure."""
    minimal: _Text = ""
    """Conditions that the minimal scenario needs, in words."""
    note: _Text = ""
    """What makes the verdict doubtful: the time step, or a scenario beyond the validated region."""
    violates: list[CriterionSection] = Field(default_factory=list, max_length=1000)
    """Pass criteria that the failure violates."""
    count: Literal["ego", "any"] = "ego"
    """Party whose conflicts count as harm: the ego alone, or any."""
    driver: _OrNone = ""
    """Driver of the ego that failed."""
    found: _Text = ""
    """Search or suite that found the failure, in words."""
    seed: Annotated[int, Field(ge=0)] | None = None
    """Seed of the search or the suite that found it."""
    version: _Text = ""
    """Version of BridgeGen that verified it."""
    harm: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Harm: how much it is a failure of the ego, 0 to 1; all digits."""
    severity: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Probability of MAIS3+; all digits."""
    files: list[_File] = Field(default_factory=list, min_length=1, max_length=2)
    """Files of a suite: the scenario, then its minimal form if there is one."""

    @property
    def criteria(self) -> list[dict[str, Any]]:
        """The pass criteria that it violates, as `Criterion.to_dict` gives them."""
        return [
            read_criterion(criterion.model_dump(exclude_defaults=True)).to_dict()
            for criterion in self.violates
        ]


class _Failures(ShapedSection):
    failures: Annotated[dict[_Id, Failure], Field(default={})]


class _OldMode(ShapedSection):
    id: _Id
    status: Status
    scenario: _OrNone = ""
    driver: _OrNone = ""
    title: _OrNone = ""
    note: _OrNone = ""


class _OldFile(ShapedSection):
    modes: Annotated[list[_OldMode], Field(default=[])]


@dataclass(frozen=True)
class FailureFile:
    """The file as it was read; empty if there is none.

    Attributes:
        path: of the file.
        failures: by id, in the order of the file.
        text: of the file.
        lines: the line of each entry, see `Document`.
    """

    path: Path
    failures: Mapping[str, Failure] = field(default_factory=dict)
    text: str = f"{HEAD}failures:\n"
    lines: Mapping[tuple[str | int, ...], int] = field(default_factory=dict, repr=False)

    def of_file(self, name: str) -> tuple[str, Failure] | None:
        """Return id and failure that a scenario of the folder belongs to."""
        return next(
            ((id, failure) for id, failure in self.failures.items() if name in failure.files), None
        )


def read_failures(folder: Path) -> FailureFile:
    """Return what the file of a folder says.

    Raises:
        FileFormatError: it is no such file; all that is wrong, with lines.
        StorageError: it cannot be read.
    """
    path = folder / FILE
    data = _bytes(path)
    return FailureFile(path) if data is None else _parsed(data, path)


def read_old_file(folder: Path) -> dict[str, Failure]:
    """Return what `OLD_FILE` of a folder says, by id; nothing where there is none.

    Raises:
        FileFormatError: it is no such file; all that is wrong, with lines.
        StorageError: it cannot be read.
    """
    path = folder / OLD_FILE
    data = _bytes(path)
    if data is None:
        return {}
    document = read_plain_yaml(data, str(path))
    found: dict[str, Failure] = {}
    for number, mode in enumerate(_shaped(_OldFile, document, "modes").modes):
        if mode.id in found:
            where = document.at(("modes", number))
            raise FileFormatError(f"the failure mode '{mode.id}' is there twice ({where})")
        texts = mode.model_dump(exclude={"id", "note"})
        found[mode.id] = Failure(comment=mode.note, **texts)
    return found


def write_failures(file: FailureFile, changed: Mapping[str, Failure]) -> None:
    """Add blocks to a file, or change them; all else stays as it is.

    A new block stands before the first one with a greater id. Of a block that is there, only the
    values that differ are written anew.

    Args:
        file: as it was read.
        changed: by id.

    Raises:
        ChangedError: it is not what was read any more.
        StorageError: it cannot be written.
        FileFormatError: it is laid out so that no block can be added, or would be too large.
    """
    text = _edited(file, changed)
    data = text.encode()
    if len(data) > MAX_BYTES:
        raise FileFormatError(
            f"{file.path}: may have {MAX_BYTES} bytes at most, got {len(data)}; "
            "begin another folder"
        )
    try:
        # The text is edited by lines, not written anew, to keep people's comments. So it is read
        # again before it replaces theirs: whatever layout the edit did not foresee is refused, and
        # nothing is written.
        again, why = _parsed(data, file.path).failures, ""
    except FileFormatError as error:
        again, why = {}, f" ({error.problems[0]})"
    if again != {**file.failures, **changed}:
        raise FileFormatError(
            f"{file.path}: no block can be added to it as it is laid out; write each failure as "
            f"lines of its own below 'failures:', and nothing behind the last{why}"
        )
    with locked(file.path.parent):
        # People edit it, too: what they saved since it was read stays.
        if read_failures(file.path.parent).text != file.text:
            raise ChangedError(f"{file.path}: was changed meanwhile; nothing is written: try again")
        write_whole(file.path, [data])


def failure_of(
    scenario: str, distribution: str | None, read: dict[Path, FailureFile]
) -> tuple[str, Failure] | None:
    """Return the failure, with its id, that a scenario's folder states for it.

    Args:
        scenario: a path, or a name of the catalogue.
        distribution: the file with its variations, if there is one.
        read: files by folder; those that are read are added.

    Raises:
        FileFormatError: the file is damaged.
        StorageError: it cannot be read.
    """
    path = Path(scenario)
    if distribution or path.suffix.lower() != ".xosc":
        return None
    if path.parent not in read:
        read[path.parent] = read_failures(path.parent)
    return read[path.parent].of_file(path.name)


# --- Bytes → failures ---

_Shape = TypeVar("_Shape", bound=ShapedSection)


def _bytes(path: Path) -> bytes | None:
    try:
        with path.open("rb") as file:
            # One byte more than allowed, by which the reader of YAML sees that it is too large.
            return file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StorageError(f"{path}: cannot be read: {error.strerror}") from None


def _shaped(shape: type[_Shape], document: Document, key: str) -> _Shape:
    data = {} if document.data is None else document.data
    if isinstance(data, dict) and data.get(key, 0) is None:
        data = {name: value for name, value in data.items() if name != key}  # no block is left
    document = Document(data, document.lines, document.place)
    if problems := shape_problems(shape, document):
        raise FileFormatError(*problems)
    return shape.model_validate(data)


def _parsed(data: bytes, path: Path) -> FailureFile:
    document = read_plain_yaml(data, str(path))
    failures = _shaped(_Failures, document, "failures").failures
    problems, names = list[str](), set[str]()
    for id, failure in failures.items():
        where = document.at(("failures", id))
        try:
            _ = failure.criteria
        except InputError as error:
            problems += [f"{text} ({where})" for text in error.problems]
        required = Failure.model_fields.keys() - {*_OPTIONAL} if failure.files else set()
        problems += [
            f"failures.{id} must have the key '{name}' ({where})"
            for name in sorted(required - failure.model_fields_set)
        ]
        for name in failure.files:
            if name in names:
                problems.append(f"two failures have the file {name} ({where})")
            names.add(name)
    if problems:
        raise FileFormatError(*problems)
    text = data.decode("utf-8-sig")
    if document.data is None:  # comments at most
        text = f"{text}\nfailures:\n" if text else FailureFile(path).text
    return FailureFile(path, failures, text, document.lines)


# --- Failures → text ---


def _edited(file: FailureFile, changed: Mapping[str, Failure]) -> str:
    """Return the text with blocks added, and with other values in those that are there."""
    lines = file.text.splitlines(keepends=True)  # the lines of YAML, which has no \v, \f or \x1c
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += "\n"
    blocks, indent = _spans(file, lines, ("failures",), len(lines))
    edits = []
    for id, failure in changed.items():
        values = _values(failure)
        if id not in blocks:
            at = next((start for item, (start, _) in blocks.items() if item > id), len(lines))
            text = "".join(_entry(name, value, indent + 2) for name, value in values.items())
            edits.append((at, at, id, f"{' ' * indent}{_flow(id)}:\n{text}"))
            continue
        old = _values(file.failures[id])
        keys, inner = _spans(file, lines, ("failures", id), blocks[id][1])
        for number, name in enumerate(names := [*Failure.model_fields]):
            if old.get(name) == values.get(name):
                continue
            later = (keys[item][0] for item in names[number:] if item in keys)
            start, end = keys.get(name) or (next(later, blocks[id][1]),) * 2
            # Comments above a value that is written anew stay above it.
            text = "".join(line for line in lines[start:end] if line.lstrip().startswith("#"))
            text += _entry(name, values[name], inner) if name in values else ""
            edits.append((start, end, f"{number:02}", text))
    # From the last line to the first: an edit does not move those that are still to come.
    for start, end, _, text in sorted(edits, reverse=True):
        lines[start:end] = [text]
    return "".join(lines)


def _spans(
    file: FailureFile, lines: list[str], path: tuple[str, ...], end: int
) -> tuple[dict[str, tuple[int, int]], int]:
    """Return the lines of each entry of a mapping, with the comments above it, and the indent."""
    keys = {str(name[-1]): line - 1 for name, line in file.lines.items() if name[:-1] == path}
    starts = []
    for key in keys.values():
        start = key
        while (
            start
            and lines[start - 1].lstrip().startswith("#")
            and (
                _indent(lines[start - 1]) <= _indent(lines[key])  # else of the entry before
            )
        ):
            start -= 1
        starts.append(start)
    indents = [_indent(lines[key]) for key in keys.values()]
    return dict(zip(keys, pairwise([*starts, end]), strict=True)), min(indents, default=2)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _values(failure: Failure) -> dict[str, Any]:
    """Return what a block states."""
    defaults = Failure().model_dump()
    required = {*_OWN, *(defaults.keys() - {*_OPTIONAL} if failure.files else ())}
    found = {**failure.model_dump(), "violates": failure.criteria}
    return {
        name: item for name, item in found.items() if name in required or item != defaults[name]
    }


def _entry(name: str, value: Any, indent: int) -> str:
    """Return a key with its value as YAML; pass criteria on lines of their own."""
    before = " " * indent
    if name == "violates":
        return f"{before}violates:\n" + "".join(f"{before}  - {_flow(item)}\n" for item in value)
    return f"{before}{name}: {_flow(value)}\n"


_PLAIN = re.compile(r"[A-Za-z]([A-Za-z0-9_./;()%=<>+ -]*[A-Za-z0-9_.)%])?", re.ASCII)
_UNPRINTABLE = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")
# YAML 1.1 reads these as truths or nothing, and readers of 1.1 are still common; quoted, they are
# texts to all.
_WORDS = ("true", "false", "null", "yes", "no", "on", "off", "y", "n")


def _flow(value: Any) -> str:
    """Return a value as YAML in one line: plain text where nothing could read it otherwise."""
    if isinstance(value, str) and _PLAIN.fullmatch(value) and value.lower() not in _WORDS:
        return value
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_quoted(item)}" for key, item in value.items()) + "}"
    if isinstance(value, Iterable) and not isinstance(value, str):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return _quoted(value)


def _quoted(value: Any) -> str:
    """Return a value as JSON that is YAML, too: characters that YAML has not are escaped."""
    text = json.dumps(value, ensure_ascii=False)
    return _UNPRINTABLE.sub(lambda item: f"\\u{ord(item[0]):04x}", text)
