"""The index of a suite that grows: its failures, a block each, in a text file for people and git.

What people write in it is kept: status, comment, and YAML comments above a block and beside these
two keys.
"""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.scenario.language.criteria import CriterionSection, read_criterion
from bridgegen.scenario.language.plain_yaml import MAX_BYTES, read_plain_yaml
from bridgegen.scenario.language.shape import ShapedSection, shape_problems

FILE = "failures.yaml"
"""Its name in the suite's folder."""

Status = Literal["new", "known", "accepted", "fixed"]

HEAD = """\
# The failures of this suite, a block each; 'bridgegen suite add' adds blocks and leaves the others.
# Yours are status (new, known, accepted or fixed) and comment: known and accepted failures do not
# fail the suite, new ones do, and so do fixed ones that fail again.
"""

ID = r"[a-z0-9][a-z0-9-]{0,99}"
_File = Annotated[str, Field(pattern=rf"^{ID}\.xosc$")]
MOST_TEXT = 2000
"""Characters of one text."""

_Text = Annotated[str, Field(max_length=MOST_TEXT)]
_OWN = ("status", "comment")
"""The keys that people write."""


class Failure(ShapedSection):
    """A failure of the system under test that a suite keeps.

    The first keys are the failure mode; see `bridgegen.search.triage.modes.Key`.
    """

    title: _Text
    """The failure in words."""
    status: Status = "new"
    """Set by a person."""
    comment: _Text = ""
    """A person's."""
    scenario: _Text
    """The scenario in which it was found."""
    conflict: _Text
    """"contact", "near miss", …"""
    type: _Text
    """Of the conflict."""
    responsible: _Text
    """The responsible party."""
    rule: _Text
    """That decides on the responsibility."""
    partner: _Text
    """Kind of the other participant."""
    place: _Text
    """On the ego's route."""
    cause: _Text
    """Of the failure."""
    minimal: _Text = ""
    """What the minimal scenario needs."""
    violates: Annotated[list[CriterionSection], Field(max_length=1000, default=[])]
    """The pass criteria that it violates."""
    count: Literal["ego", "any"] = "ego"
    """Whose conflicts count as harm."""
    driver: _Text
    """That failed."""
    found: _Text
    """Where."""
    seed: Annotated[int, Field(ge=0)] | None = None
    """Of the search or the suite that found it."""
    version: _Text
    """Of BridgeGen that verified it."""
    harm: Annotated[float, Field(ge=0.0, le=1.0)]
    """How much it is a failure of the ego; all digits."""
    severity: Annotated[float, Field(ge=0.0, le=1.0)]
    """Probability of MAIS3+; all digits."""
    files: Annotated[list[_File], Field(min_length=1, max_length=2)]
    """The scenario, then its minimal form if there is one."""

    @property
    def criteria(self) -> list[dict[str, Any]]:
        """The pass criteria that it violates, as `Criterion.to_dict` gives them."""
        return [read_criterion(one.model_dump(exclude_defaults=True)).to_dict()
                for one in self.violates]  # fmt: skip


class IndexFile(ShapedSection):
    """The index."""

    failures: Annotated[dict[Annotated[str, Field(pattern=f"^{ID}$")], Failure], Field(default={})]
    """By id."""


@dataclass(frozen=True)
class Index:
    """An index as it was read.

    Attributes:
        failures: by id.
        head: the text before the first block.
        blocks: the text of each block, by id; empty where texts are not one block after another.
    """

    failures: Mapping[str, Failure]
    head: str = f"{HEAD}failures:\n"
    blocks: Mapping[str, str] | None = None

    def of_file(self, name: str) -> tuple[str, Failure] | None:
        """Return id and failure that a file of the folder belongs to."""
        return next(((id, one) for id, one in self.failures.items() if name in one.files), None)


def read_index(folder: Path) -> Index | None:
    """Return the index of a suite's folder; None if it has none.

    Raises:
        FileFormatError: it cannot be read, or is no index; all that is wrong, with lines.
    """
    path = folder / FILE
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    document = read_plain_yaml(data, str(path))
    if isinstance(document.data, dict) and document.data.get("failures", 0) is None:
        document.data["failures"] = {}  # its last block was removed
    if problems := shape_problems(IndexFile, document):
        raise FileFormatError(*problems)
    failures = IndexFile.model_validate(document.data).failures
    problems = []
    for id, one in failures.items():
        try:
            _ = one.criteria
        except InputError as error:
            problems += [f"{text} ({document.at(('failures', id))})" for text in error.problems]
    names = [name for one in failures.values() for name in one.files]
    problems += [
        f"{path}: two failures have the file {name}"
        for name in sorted({name for name in names if names.count(name) > 1})
    ]
    if problems:
        raise FileFormatError(*problems)
    lines = data.decode("utf-8-sig").splitlines(keepends=True)
    starts = {id: document.lines["failures", id] - 1 for id in failures}
    return _cut(failures, lines, starts)


class Indexes:
    """Reads the indexes of folders, each once."""

    def __init__(self) -> None:
        self._read: dict[Path, Index | None] = {}

    def failure_of(self, scenario: str, distribution: str | None) -> tuple[str, Failure] | None:
        """Return the failure, with its id, that a scenario's folder states for it.

        Raises:
            FileFormatError: the index is damaged.
        """
        path = Path(scenario)
        if distribution or path.suffix.lower() != ".xosc":
            return None
        if path.parent not in self._read:
            self._read[path.parent] = read_index(path.parent)
        index = self._read[path.parent]
        return None if index is None else index.of_file(path.name)


def _cut(failures: Mapping[str, Failure], lines: list[str], starts: Mapping[str, int]) -> Index:
    """Return an index with its texts: a block begins with the comments right above its key."""
    if not starts:
        return Index(failures)
    first = min(starts.values())
    begins = {}
    for id, start in starts.items():
        while start > 0 and lines[start - 1].lstrip().startswith("#") and (
            starts[id] != first or lines[start - 1].startswith(" ")
        ):  # fmt: skip
            start -= 1
        begins[id] = start
    order = sorted(begins, key=begins.__getitem__)
    ends = [*(begins[id] for id in order[1:]), len(lines)]
    blocks = {
        id: "".join(lines[begins[id] : end]).rstrip("\n") + "\n"
        for id, end in zip(order, ends, strict=True)
    }
    return Index(failures, "".join(lines[: begins[order[0]]]), blocks)


def write_index(folder: Path, before: Index, failures: Mapping[str, Failure]) -> None:
    """Write an index.

    Blocks of unchanged failures keep their text, and those of others what people wrote.

    Args:
        folder: of the suite.
        before: what it was, an empty one if there was none.
        failures: by id.

    Raises:
        StorageError: it cannot be written.
        FileFormatError: it would be larger than a file may be.
    """
    text = before.head + "".join(
        _block(before, id, failures[id]) for id in sorted(failures)
    )  # fmt: skip
    if before.blocks is None or not _holds(text, failures):  # another layout than ours
        text = Index({}).head + "".join(_emitted(id, failures[id]) for id in sorted(failures))
    data = text.encode()
    if len(data) > MAX_BYTES:
        raise FileFormatError(
            f"{folder / FILE}: may have {MAX_BYTES} bytes at most, got {len(data)}; "
            "begin another suite"
        )
    write_whole(folder / FILE, [data])


def _holds(text: str, failures: Mapping[str, Failure]) -> bool:
    """Return whether a text is the index of these failures."""
    try:
        document = read_plain_yaml(text.encode(), FILE)
        return dict(IndexFile.model_validate(document.data).failures) == dict(failures)
    except (ValueError, InputError):
        return False


def _block(before: Index, id: str, failure: Failure) -> str:
    old = (before.blocks or {}).get(id)
    if old is None:
        return _emitted(id, failure)
    if before.failures[id] == failure:
        return old
    lines = old.splitlines(keepends=True)
    above = "".join(line for line in lines if line.lstrip().startswith("#"))
    own = {key: line for line in lines for key in _OWN if line.strip().startswith(f"{key}:")}
    text = above + _emitted(id, failure, own)
    return text if _holds(f"failures:\n{text}", {id: failure}) else above + _emitted(id, failure)


def _emitted(id: str, failure: Failure, own: Mapping[str, str] | None = None) -> str:
    """Return a failure as a block of YAML."""
    lines = [f"  {_flow(id)}:\n"]
    defaults = {name: one.default for name, one in type(failure).model_fields.items()}
    for name, value in failure.model_dump(exclude_none=True).items():
        if own and name in own:
            lines.append(own[name])
        elif name == "violates":
            lines += ["    violates:\n"] if value else []
            lines += [f"      - {_flow(one)}\n" for one in failure.criteria]
        elif name in _OWN or value != defaults[name]:
            lines.append(f"    {name}: {_flow(value)}\n")
    return "".join(lines)


_PLAIN = re.compile(r"[A-Za-z]([A-Za-z0-9_./;()%=<>+ -]*[A-Za-z0-9_.)%])?", re.ASCII)
_UNPRINTABLE = re.compile("[\x7f-\x9f\u2028\u2029\ufeff\ufffe\uffff]")
_WORDS = ("true", "false", "null", "yes", "no", "on", "off", "y", "n")


def _flow(value: Any) -> str:
    """Return a value as YAML in one line: plain text where nothing could read it otherwise."""
    if isinstance(value, str) and _PLAIN.fullmatch(value) and value.lower() not in _WORDS:
        return value
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_quoted(one)}" for key, one in value.items()) + "}"
    if isinstance(value, Iterable) and not isinstance(value, str):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return _quoted(value)


def _quoted(value: Any) -> str:
    """Return a value as JSON that is YAML, too: characters that YAML has not are escaped."""
    text = json.dumps(value, ensure_ascii=False)
    return _UNPRINTABLE.sub(lambda one: f"\\u{ord(one[0]):04x}", text)
