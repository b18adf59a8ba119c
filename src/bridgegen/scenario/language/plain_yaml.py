"""YAML from strangers: plain mappings, lists, texts and numbers, each with its line.

No anchors, aliases, tags or merges (so nothing expands and nothing is constructed), no duplicate
keys, bounded size and depth. Numbers and truth values are those of YAML 1.2: ``on`` and ``12:30``
are texts, ``1e-3`` is a number.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import yaml

from bridgegen.base.errors import FileFormatError

MAX_BYTES = 2**20
MAX_DEPTH = 32

Path = tuple[str | int, ...]

_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL: dict[str, float | bool | None] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
    ".nan": math.nan, ".NaN": math.nan, ".NAN": math.nan,
    ".inf": math.inf, ".Inf": math.inf, ".INF": math.inf,
    "+.inf": math.inf, "+.Inf": math.inf, "+.INF": math.inf,
    "-.inf": -math.inf, "-.Inf": -math.inf, "-.INF": -math.inf,
}  # fmt: skip

# The C parser is some ten times faster; which of the two made an event makes no difference.
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class Scalar(NamedTuple):
    """A value in a text.

    Attributes:
        start: its first character, quotes included; without a byte order mark before the text.
        end: the one after its last.
        text: it, without quotes.
    """

    start: int
    end: int
    text: str


@dataclass(frozen=True)
class Document:
    """A file's contents, with their lines.

    Attributes:
        data: mappings, lists, texts, numbers, truth values and ``None``.
        lines: the line of each entry, by its path from the root: ``("parameters", "ego_speed")``.
        place: the file, for messages.
        scalars: where the values stand, by path.
        notes: what a reader of the file should know, a sentence each.
    """

    data: object
    lines: dict[Path, int]
    place: str
    scalars: Mapping[Path, Scalar] = field(default_factory=dict, repr=False)
    notes: tuple[str, ...] = ()

    def at(self, path: Path) -> str:
        """Return file and line of an entry, or of the nearest one around it."""
        while path and path not in self.lines:
            path = path[:-1]
        return f"{self.place}, line {self.lines.get(path, 1)}"

    def below(self, key: str) -> "Document":
        """Return what a top-level key holds, as a document with this one's lines."""
        data = self.data[key] if isinstance(self.data, dict) else None
        lines = {path[1:]: line for path, line in self.lines.items() if path[:1] == (key,)}
        return Document(data, lines, self.place)


def read_plain_yaml(data: bytes, place: str) -> Document:
    """Read a YAML document.

    Args:
        data: UTF-8.
        place: the file, for messages.

    Raises:
        FileFormatError: no YAML, or more than plain YAML; all that was found.
    """
    if len(data) > MAX_BYTES:
        raise FileFormatError(f"a file may have {MAX_BYTES} bytes at most ({place})")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"not UTF-8 at byte {error.start} ({place})") from None
    reader = _Reader(place)
    try:
        # Events and not `safe_load`: aliases and merges would have been expanded by then (a few
        # lines become gigabytes), duplicate keys been lost, and lines, too.
        value = reader.document(yaml.parse(text, Loader=_LOADER))
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"{place}, line {mark.line + 1}" if mark else place
        reason = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise FileFormatError(*reader.problems, f"not YAML: {reason} ({where})") from None
    if reader.problems:
        raise FileFormatError(*reader.problems)
    return Document(value, reader.lines, place, reader.scalars)


def entries(document: Document, key: str) -> list[tuple[str | int, object]]:
    """Return what a top-level mapping or list holds, with its keys; nothing if it is neither."""
    data = document.data.get(key) if isinstance(document.data, dict) else None
    if isinstance(data, dict):
        return list(data.items())
    return list(enumerate(data)) if isinstance(data, list) else []


class _Reader:
    def __init__(self, place: str) -> None:
        self.place = place
        self.lines: dict[Path, int] = {}
        self.scalars: dict[Path, Scalar] = {}
        self.problems: list[str] = []

    def document(self, events: Iterator[yaml.Event]) -> object:
        value: object = None
        documents = 0
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    self.refuse(event, "a file holds one document, here begins a second")
                    break
                value = self.value(next(events), events, ())
        return value

    def value(self, event: yaml.Event, events: Iterator[yaml.Event], path: Path) -> object:
        self.lines.setdefault(path, _line(event))
        if len(path) > MAX_DEPTH:
            self.refuse(event, f"entries may nest {MAX_DEPTH} deep")
            # At once, and not collected as other problems are: going on would recurse as deep as
            # the file says.
            raise FileFormatError(*self.problems)
        if isinstance(event, yaml.AliasEvent):
            self.refuse(event, f"aliases are refused: write out what *{event.anchor} stands for")
            return None
        self.check_plain(event)
        if isinstance(event, yaml.SequenceStartEvent):
            items: list[object] = []
            while not isinstance(event := next(events), yaml.SequenceEndEvent):
                items.append(self.value(event, events, (*path, len(items))))
            return items
        if isinstance(event, yaml.MappingStartEvent):
            return self.mapping(events, path)
        assert isinstance(event, yaml.ScalarEvent)
        if event.start_mark and event.end_mark:
            self.scalars[path] = Scalar(event.start_mark.index, event.end_mark.index, event.value)
        return _scalar(event.value, quoted=bool(event.style))

    def check_plain(self, event: yaml.Event) -> None:
        assert isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent)
        if event.anchor is not None:
            self.refuse(event, f"anchors are refused: &{event.anchor}")
        if event.tag is not None:
            self.refuse(event, f"tags are refused: {event.tag}")

    def mapping(self, events: Iterator[yaml.Event], path: Path) -> dict[str, object]:
        result: dict[str, object] = {}
        while not isinstance(event := next(events), yaml.MappingEndEvent):
            key = self.value(event, events, (*path, ""))
            del self.lines[(*path, "")]
            self.scalars.pop((*path, ""), None)
            if not isinstance(key, str):
                self.refuse(event, f"a key must be a text, got {key!r}")
                key = str(key)
            inside = (*path, key)
            if key in result:
                first = self.lines[inside]
                self.refuse(event, f"the key '{key}' occurs twice, first in line {first}")
            self.lines.setdefault(inside, _line(event))
            result[key] = self.value(next(events), events, inside)
        return result

    def refuse(self, event: yaml.Event, problem: str) -> None:
        self.problems.append(f"{problem} ({self.place}, line {_line(event)})")


def _line(event: yaml.Event) -> int:
    return event.start_mark.line + 1 if event.start_mark else 1


def _scalar(text: str, *, quoted: bool) -> object:
    if quoted:  # or a block of text
        return text
    if text in _SPECIAL:
        return _SPECIAL[text]
    if _INTEGER.fullmatch(text):
        # `int` of a long text takes time that grows with its square, and Python refuses more than
        # 4,300 digits.
        return int(text) if len(text) <= 300 else float(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    return text


def replaced(text: str, values: Mapping[Path, str], place: str) -> str:
    """Return a text in which some values are others; comments and layout stay as they are.

    Args:
        text: of a whole file.
        values: the new ones, by path, as they are to stand in the file.
        place: the file, for messages.

    Raises:
        KeyError: no value stands there.
        FileFormatError: see `read_plain_yaml`.
    """
    found = read_plain_yaml(text.encode(), place).scalars
    mark = len(text) - len(text.removeprefix("\ufeff"))
    # From the last to the first: a replacement does not move those that are still to come.
    for path in sorted(values, key=lambda value: -found[value].start):
        at = found[path]
        text = text[: mark + at.start] + values[path] + text[mark + at.end :]
    return text
