"""Tables of numbers from files of strangers: CSV with a header, one row per event."""

import csv
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.scenario.language.parameters import Parameter

MAX_BYTES, MAX_ROWS, MAX_COLUMNS = 2**28, 10**6, 1000
_MOST_PROBLEMS = 10


@dataclass(frozen=True)
class Table:
    """Columns of a table.

    Attributes:
        columns: ``(n,)`` by name, finite.
        lines: ``(n,)`` the line of each row in the file.
    """

    columns: dict[str, Float]
    lines: Float


def cell_reader(parameter: Parameter) -> Callable[[str], float]:
    """Return what turns a cell into a value of a parameter: a number, with or without a unit."""

    def read(text: str) -> float:
        if parameter.kind.names:
            return parameter.read(text)
        try:
            return parameter.read(float(text))
        except ValueError:
            return parameter.read(text)

    return read


def read_header(path: Path) -> tuple[str, ...]:
    """Return the names of a table's columns.

    Raises:
        FileFormatError: missing, unreadable, too large, not CSV, no or the same names.
    """
    with _opened(path) as file:
        return _header(csv.reader(file, strict=True), path)


def read_table(path: Path, readers: Mapping[str, Callable[[str], float]]) -> Table:
    """Read some columns of a table.

    Args:
        path: UTF-8, with a header.
        readers: by column: what turns a text into a number, or raises an ``InputError``.

    Raises:
        FileFormatError: missing, unreadable, too large, not CSV, a column that is not there, or
            cells that are no finite number, each with its line.
    """
    problems: list[str] = []
    rows: list[list[float]] = []
    lines: list[int] = []
    with _opened(path) as file:
        reader = csv.reader(file, strict=True)
        header = _header(reader, path)
        if missing := [name for name in readers if name not in header]:
            raise FileFormatError(
                f"{path}: the table must have the column '{missing[0]}', got {', '.join(header)}"
            )
        places = [header.index(name) for name in readers]
        try:
            for cells in reader:
                if not cells:
                    continue
                if len(cells) != len(header):
                    problems.append(
                        f"a row must have {len(header)} cells, got {len(cells)} "
                        f"({path}, line {reader.line_num})"
                    )
                else:
                    rows.append(
                        [
                            _number(
                                cells[place],
                                name,
                                read,
                                f"{path}, line {reader.line_num}",
                                problems,
                            )
                            for place, (name, read) in zip(places, readers.items(), strict=True)
                        ]
                    )
                    lines.append(reader.line_num)
                if len(problems) >= _MOST_PROBLEMS:
                    break
                if len(rows) > MAX_ROWS:
                    raise FileFormatError(f"{path}: a table may have {MAX_ROWS:,} rows")
        except (csv.Error, UnicodeDecodeError) as error:
            raise FileFormatError(*problems, _unreadable(error, path)) from None
    if problems:
        raise FileFormatError(*problems)
    values = np.array(rows, dtype=np.float64).reshape(len(rows), len(readers))
    columns = {name: np.ascontiguousarray(values[:, k]) for k, name in enumerate(readers)}
    return Table(columns, np.array(lines, dtype=np.float64))


def _opened(path: Path) -> TextIO:
    try:
        if not path.is_file():
            raise FileFormatError(f"no such file: {path}")
        if path.stat().st_size > MAX_BYTES:
            raise FileFormatError(f"{path}: a table may have {MAX_BYTES:,} bytes")
        return path.open(encoding="utf-8-sig", newline="")
    except OSError as error:
        raise FileFormatError(f"cannot be read: {error.strerror} ({path})") from None


def _header(reader: Iterator[list[str]], path: Path) -> tuple[str, ...]:
    try:
        header = tuple(name.strip() for name in next(reader, []))
    except (csv.Error, UnicodeDecodeError) as error:
        raise FileFormatError(_unreadable(error, path)) from None
    if not header or len(header) > MAX_COLUMNS:
        raise FileFormatError(f"{path}: a table must begin with the names of its columns")
    for name in header:
        if not name or header.count(name) > 1:
            raise FileFormatError(
                f"{path}: the columns must have names, each its own, got '{name[:60]}' (line 1)"
            )
    return header


def _number(
    text: str, name: str, read: Callable[[str], float], place: str, problems: list[str]
) -> float:
    try:
        value = read(text.strip())
        if math.isfinite(value):
            return value
    except (ValueError, InputError):
        pass
    shown = text if len(text) <= 40 else text[:37] + "..."
    problems.append(f"{name} must be a finite value of that parameter, got '{shown}' ({place})")
    return math.nan


def _unreadable(error: csv.Error | UnicodeDecodeError, path: Path) -> str:
    if isinstance(error, UnicodeDecodeError):
        return f"{path}: not UTF-8"
    return f"{path}: not CSV: {error}"
