"""The states in another tool's recording: a table, or the log of esmini, line by line.

A table has a header that names its columns: those of a trace (`trace.COLUMNS`), in any order, and
any of `trace.MORE`. A line is the state of one entity at one instant.
"""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.xml import read_bytes
from bridgegen.simulation.trace import COLUMNS, MORE

STATES = ("time", "x", "y", "h", "speed")
MAX_PROBLEMS = 20
MOST = 1e9
"""Larger than any place on Earth, and than what may be squared without thinking."""


@dataclass
class Track:
    """What a recording says of one entity, line by line; ``lines`` are their numbers in the file.

    Attributes:
        states: per column of a trace, but for the entity's name, a value for each line.
        lines: the number of each line.
    """

    states: dict[str, list[float]] = field(default_factory=dict)
    lines: list[int] = field(default_factory=list)

    def add(self, line: int, values: dict[str, float]) -> None:
        """Take in a line, all with the same columns."""
        self.lines.append(line)
        for name, value in values.items():
            self.states.setdefault(name, []).append(value)


@dataclass
class Tracks:
    """A file's tracks by entity, in the order of their first lines, and what to say about them."""

    place: str
    tracks: dict[str, Track] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def say(self, line: int, problem: str) -> None:
        """Note a problem; too many end the reading.

        Raises:
            FileFormatError: there are too many.
        """
        self.problems.append(f"{self.place}, line {line}: {problem}")
        if len(self.problems) == MAX_PROBLEMS:
            raise FileFormatError(*self.problems, f"{self.place}: and perhaps more")

    def number(self, line: int, column: str, text: str) -> float:
        """Return a field's number; 0 and a problem if it is none."""
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not isfinite(value) or "_" in text or abs(value) > MOST:
            shown = text if len(text) <= 40 else f"{text[:40]}…"
            self.say(line, f"{column} must be a number within ±{MOST:g}, got '{shown}'")
            return 0.0
        if column == "speed" and value < 0.0:
            self.say(line, f"speed [m/s] must be ≥ 0, got {text} (going backwards is not known)")
        if column in ("length", "width") and value <= 0.0:
            self.say(line, f"{column} [m] must be > 0, got {text}")
        return value


def read_tracks(path: Path) -> Tracks:
    """Read a recording.

    Raises:
        FileFormatError: missing, too large, not text, without the columns that it needs, or with
            values that are no finite numbers; line by line.
    """
    place = str(path)
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{place}: must be UTF-8 text, byte {error.start} is not") from None
    found = Tracks(place)
    if text.startswith("esmini"):
        _read_log(text, found)
    else:
        _read_table(text, found)
    if found.problems:
        raise FileFormatError(*found.problems)
    if not found.tracks:
        raise FileFormatError(f"{place}: holds no line of states")
    return found


def _read_table(text: str, found: Tracks) -> None:
    lines = _csv_lines(text, found)
    _, head = next(lines, (1, []))
    head = [name.strip() for name in head]
    missing = [name for name in COLUMNS if name not in head]
    if missing:
        raise FileFormatError(
            f"{found.place}, line 1: a recording needs the columns {', '.join(COLUMNS)} "
            f"(comma-separated), or to be esmini's --csv_logger's; missing: {', '.join(missing)}"
        )
    wanted = [name for name in (*STATES, *MORE) if name in head]
    twice = sorted({name for name in (*wanted, "entity") if head.count(name) > 1})
    if twice:
        raise FileFormatError(f"{found.place}, line 1: columns twice: {', '.join(twice)}")
    unused = [name for name in head if name not in (*wanted, "entity")]
    if unused:
        found.notes.append(f"columns that are not used: {', '.join(unused)}")
    at = {name: head.index(name) for name in wanted}
    entity = head.index("entity")
    for line, row in lines:
        if len(row) != len(head):
            found.say(line, f"has {len(row)} fields, the header has {len(head)}")
            continue
        name = row[entity].strip()
        if not name:
            found.say(line, "entity must be a name, got nothing")
            continue
        values = {column: found.number(line, column, row[i]) for column, i in at.items()}
        found.tracks.setdefault(name, Track()).add(line, values)


def _csv_lines(text: str, found: Tracks) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that are not empty, with their numbers."""
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        for row in reader:
            if row:
                yield reader.line_num, row
    except csv.Error as error:
        raise FileFormatError(f"{found.place}, line {reader.line_num}: {error}") from None


LOG_HEAD = "Index [-], TimeStamp [s], #1 Entity_Name [-]"
LOG_FIELDS = {
    "speed": 2, "centre": 5, "length": 8, "width": 9, "x": 11, "y": 12, "h": 24,
}  # fmt: skip
"""Where each is among the fields of one entity; esmini's reference point is OpenSCENARIO's."""
LOG_WIDTH = 31
"""Fields of one entity."""


def _read_log(text: str, found: Tracks) -> None:
    """Read the log that esmini writes with --csv_logger: a line an instant, entities side by side.

    Source: esmini 3.6, class CSV_Logger.
    """
    lines = enumerate(text.splitlines(), 1)
    if not any(line.startswith(LOG_HEAD) for _, line in lines):
        raise FileFormatError(f"{found.place}: is esmini's, but not what --csv_logger writes")
    for number, line in lines:
        fields = [text.strip() for text in line.split(",")]
        if fields and not fields[-1]:
            fields.pop()  # every line ends with a comma
        if not fields:
            continue
        if len(fields) < 2 + LOG_WIDTH or (len(fields) - 2) % LOG_WIDTH:
            found.say(number, f"must have 2 fields and {LOG_WIDTH} an entity, got {len(fields)}")
            continue
        time = found.number(number, "time", fields[1])
        for first in range(2, len(fields), LOG_WIDTH):
            values = {"time": time}
            for column, i in LOG_FIELDS.items():
                values[column] = found.number(number, column, fields[first + i])
            found.tracks.setdefault(fields[first], Track()).add(number, values)
