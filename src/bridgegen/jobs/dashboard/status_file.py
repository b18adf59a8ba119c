"""``failure-modes.yaml``: what a person decides about each failure mode of a project.

The file is the person's. BridgeGen adds blocks, and keeps all others as they are, with their
comments. Blocks are sorted by scenario, driver and id, so that git merges what two branches add.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError, StorageError
from bridgegen.jobs.suite.index import Status
from bridgegen.scenario.language.plain_yaml import MAX_BYTES, Document, read_plain_yaml

FILE = "failure-modes.yaml"

STATUSES: tuple[Status, ...] = get_args(Status)

KEYS = ("id", "status", "scenario", "driver", "title", "note")

MOST_TEXT = 2000
"""Characters of a title or a note."""

_LINE = re.compile(
    r"[^\n\r\x85\u2028\u2029]*(?:\r\n|[\n\r\x85\u2028\u2029])|[^\n\r\x85\u2028\u2029]+$"
)
"""A line as YAML counts them."""

_HEAD = """\
# Failure modes of this project. 'bridgegen dashboard --update' adds those that it does not name,
# and changes nothing else. Set the status of each: new, known, accepted, or fixed; add a note.
modes:
"""


@dataclass(frozen=True)
class Decision:
    """A block of the file.

    Attributes:
        id: of the failure mode.
        status: as the person sets it.
        scenario: for people; the id decides.
        driver: likewise.
        title: likewise.
        note: of the person, or "".
    """

    id: str
    status: Status
    scenario: str = ""
    driver: str = ""
    title: str = ""
    note: str = ""


@dataclass(frozen=True)
class StatusFile:
    """What the file says.

    Attributes:
        head: text before the first block.
        blocks: the text of each block, with the comments above it, by id.
        decisions: what each says, by id.
        indent: spaces before the dash of a block.
    """

    head: str
    blocks: Mapping[str, str]
    decisions: Mapping[str, Decision]
    indent: int = 0

    def status(self, mode: str) -> Status:
        """Return the status of a failure mode; "new" if the file does not name it."""
        decision = self.decisions.get(mode)
        return "new" if decision is None else decision.status

    def note(self, mode: str) -> str:
        """Return the person's note on a failure mode, or ""."""
        decision = self.decisions.get(mode)
        return "" if decision is None else decision.note


def read_status_file(path: Path) -> StatusFile:
    """Return what the file says; nothing where there is none.

    Raises:
        FileFormatError: it is not such a file; all that is wrong, with the lines.
        StorageError: it cannot be read.
    """
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        return StatusFile(_HEAD, {}, {})
    except OSError as error:
        raise StorageError(f"{path}: cannot be read: {error.strerror}") from None
    document = read_plain_yaml(data, str(path))
    decisions = _decisions(document)
    if not decisions:
        return StatusFile(_HEAD, {}, {})
    lines = _LINE.findall(data.decode("utf-8-sig"))
    starts = _starts(lines, document, len(decisions))
    ends = [*starts[1:], len(lines)]
    blocks = {
        one.id: "".join(lines[start:end])
        for one, start, end in zip(decisions, starts, ends, strict=True)
    }
    first = lines[document.lines["modes", 0] - 1]
    return StatusFile(
        "".join(lines[: starts[0]]),
        blocks,
        {one.id: one for one in decisions},
        len(first) - len(first.lstrip(" ")),
    )


def add_decisions(path: Path, file: StatusFile, new: Iterable[Decision]) -> int:
    """Add blocks to the file; return how many. What the person wrote stays as it is.

    Args:
        path: of the file.
        file: what it says, as it was read.
        new: decisions whose ids it may name already: these are left alone.

    Raises:
        FileFormatError: it is laid out so that no block can be added.
        StorageError: it cannot be written.
    """
    added = [one for one in new if one.id not in file.blocks]
    if not added:
        return 0
    known = {**file.decisions, **{one.id: one for one in added}}
    texts = {**file.blocks, **{one.id: _block(one, file.indent) for one in added}}
    order = sorted(known, key=lambda name: (known[name].scenario, known[name].driver, name))
    whole = file.head + "".join(_ended(texts[name]) for name in order)
    data = whole.encode()
    try:
        again = [one.id for one in _decisions(read_plain_yaml(data, str(path)))]
    except FileFormatError:
        again = []
    if again != order:
        raise FileFormatError(
            f"{path}: no blocks can be added to it as it is laid out; write each failure mode as a "
            "block that begins with '- id: …', and nothing behind the last"
        )
    write_whole(path, [data])
    return len(added)


def _ended(text: str) -> str:
    return text if text.endswith("\n") else f"{text}\n"


def _starts(lines: list[str], document: Document, count: int) -> list[int]:
    """Return the first line of each block.

    Raises:
        FileFormatError: a block does not begin a line.
    """
    firsts = [document.lines["modes", number] - 1 for number in range(count)]
    problems = [
        "each failure mode must begin on a line of its own with '- id: …' "
        f"({document.at(('modes', number))})"
        for number, first in enumerate(firsts)
        if not lines[first].lstrip(" ").startswith("- ") or first in firsts[:number]
    ]
    if problems:
        raise FileFormatError(*problems)
    return [_start(lines, first) for first in firsts]


def _start(lines: list[str], first: int) -> int:
    """Return the first line of a block: that of the comments directly above it."""
    dash = lines[first].index("-")
    while first:
        above = lines[first - 1]
        indent = len(above) - len(above.lstrip())
        if not above.lstrip().startswith("#") or indent > dash:
            break
        first -= 1
    return first


def _block(one: Decision, indent: int) -> str:
    lines = [f"- id: {one.id}", f"  status: {one.status}"]
    lines += [
        f"  {key}: {_quoted(getattr(one, key))}"
        for key in ("scenario", "driver", "title", "note")
        if getattr(one, key)
    ]
    return "".join(f"{' ' * indent}{line}\n" for line in lines)


def _quoted(text: str) -> str:
    """Return a text as YAML, on one line, in single quotes."""
    plain = "".join(c if c.isprintable() else "\ufffd" for c in text[:MOST_TEXT])
    return "'" + plain.replace("'", "''") + "'"


def _decisions(document: Document) -> list[Decision]:
    data = document.data
    if data is None:
        return []
    modes = data.get("modes") if isinstance(data, dict) else None
    if not isinstance(data, dict) or set(data) - {"modes"} or not isinstance(modes, list | None):
        raise FileFormatError(f"must hold a list 'modes' and nothing else ({document.at(())})")
    found, problems = list[Decision](), list[str]()
    for number, block in enumerate(modes or ()):
        wrong = _problems(block, number, document)
        problems += wrong
        if not wrong:
            assert isinstance(block, dict)
            found.append(_decision(block))
    first: dict[str, int] = {}
    for number, one in enumerate(found if not problems else ()):
        if one.id in first:
            where = document.at(("modes", number))
            problems.append(f"the failure mode '{one.id}' is there twice ({where})")
        first.setdefault(one.id, number)
    if problems:
        raise FileFormatError(*problems)
    return found


def _decision(block: Mapping[str, str | None]) -> Decision:
    """Return a block that breaks no rule."""
    texts = {key: block.get(key) or "" for key in KEYS if key != "status"}
    status = next(one for one in STATUSES if one == block["status"])
    return Decision(status=status, **texts)


def _problems(block: object, number: int, document: Document) -> list[str]:
    """Return what is wrong with a block, with the line."""
    path: tuple[str | int, ...] = ("modes", number)
    if not isinstance(block, dict):
        return [f"a failure mode must be a block of {', '.join(KEYS)} ({document.at(path)})"]
    problems = []
    for key, value in block.items():
        where = document.at((*path, key))
        if key not in KEYS:
            problems.append(f"unknown key '{key}'; known: {', '.join(KEYS)} ({where})")
        elif key == "status" and value not in STATUSES:
            problems.append(f"status must be {_one_of()}, got '{value}' ({where})")
        elif value is not None and not isinstance(value, str):
            problems.append(f"{key} must be a text (in quotes), got {value!r} ({where})")
        elif isinstance(value, str) and len(value) > MOST_TEXT:
            problems.append(f"{key} may have {MOST_TEXT} characters, got {len(value)} ({where})")
    for key in ("id", "status"):
        if not block.get(key):
            problems.append(f"a failure mode needs '{key}' ({document.at(path)})")
    return problems


def _one_of() -> str:
    return ", ".join(STATUSES[:-1]) + f" or {STATUSES[-1]}"
