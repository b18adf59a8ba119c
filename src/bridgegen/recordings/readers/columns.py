"""Columns of large comma-separated files, read in chunks of bounded size."""

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.openx.xml import read_bytes

# Large enough that NumPy's start does not count, small enough that the lines as Python's objects
# fit beside the columns of a file of gigabytes.
CHUNK = 2**24  # bytes
MOST_BYTES = 8 * 2**30
LONGEST_LINE = 2**16  # bytes
MOST_LINES = 40_000_000
MOST_TEXTS = 1_000_000


@dataclass
class Columns:
    """Columns of a file.

    Attributes:
        numbers: by name ``(S,)``; NaN where a field is empty.
        texts: by name: the distinct texts in the order of appearance, and ``(S,)`` their numbers.
    """

    numbers: dict[str, Float]
    texts: dict[str, tuple[list[str], Int]]


def header(line: bytes) -> list[str]:
    """Return the names in the first line of a comma-separated file."""
    text = line.decode("utf-8", errors="replace").lstrip("\ufeff")
    return [name.strip().strip('"') for name in text.rstrip("\r\n").split(",")]


def read_columns(
    path: Path,
    numbers: Sequence[str],
    texts: Sequence[str] = (),
    *,
    optional: Sequence[str] = (),
    names: Sequence[str] | None = None,
) -> Columns:
    """Read columns by name.

    Args:
        path: the file; its first line names its columns.
        numbers: columns of numbers that it must have.
        texts: columns of texts that it must have.
        optional: columns of numbers that it may have; only those that it has are returned.
        names: the columns of a file without such a line, of fields between spaces.

    Raises:
        FileFormatError: unreadable, too large, without the columns, with lines of another number
            of fields, or fields that are no numbers; with the line.
    """
    # `read_bytes` has the messages for folders, devices and files that are missing.
    read_bytes(path, limit=MOST_BYTES) if not path.is_file() else None
    try:
        with path.open("rb") as file:
            head = list(names or ())
            if names is None:
                first = file.readline(LONGEST_LINE)
                head = header(first)
                _check(path, head, [*numbers, *texts])
            wanted = [*numbers, *(name for name in optional if name in head)]
            reading = _Reading(path, head, wanted, list(texts), "," if names is None else None)
            rest = b""
            while chunk := file.read(CHUNK):
                whole, cut, rest = (rest + chunk).rpartition(b"\n")
                if len(rest) > LONGEST_LINE:
                    raise FileFormatError(
                        f"{path}: a line may have {LONGEST_LINE} bytes, one has more"
                    )
                if cut:
                    reading.add(whole)
            if rest:
                reading.add(rest)
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    return reading.columns()


def _check(path: Path, head: list[str], wanted: list[str]) -> None:
    missing = [name for name in wanted if name not in head]
    if missing:
        raise FileFormatError(f"{path}, line 1: columns are missing: {', '.join(missing)}")
    twice = sorted({name for name in wanted if head.count(name) > 1})
    if twice:
        raise FileFormatError(f"{path}, line 1: columns twice: {', '.join(twice)}")


class _Reading:
    """The lines of a file, chunk by chunk; the separator None is any run of spaces and tabs."""

    def __init__(
        self,
        path: Path,
        head: list[str],
        numbers: list[str],
        texts: list[str],
        separator: str | None,
    ) -> None:
        self.path, self.head, self.separator = path, head, separator
        self.numbers, self.texts = numbers, texts
        self.at = [head.index(name) for name in numbers]
        self.at_texts = [head.index(name) for name in texts]
        self.values: list[list[Float]] = [[] for _ in numbers]
        self.codes: list[list[Int]] = [[] for _ in texts]
        self.known: list[dict[str, int]] = [{} for _ in texts]
        self.lines = 1 if separator else 0
        self.rows = 0

    def add(self, chunk: bytes) -> None:
        """Add whole lines, without the last line's break."""
        lines = chunk.decode("utf-8", errors="replace").replace("\r\n", "\n").split("\n")
        count = len(lines)
        while lines and not lines[-1].strip():
            lines.pop()
        if lines:
            if self.lines > self.rows + bool(self.separator):  # an empty line is before these
                self._check_count([], 1 + self.rows + bool(self.separator))
            values, texts = self._fast(lines) or self._line_by_line(lines)
            self.rows += len(lines)
            if self.rows > MOST_LINES:
                raise FileFormatError(f"{self.path}: may hold {MOST_LINES:,} lines, got more")
            for k in range(len(self.numbers)):
                self.values[k].append(values[:, k].copy())
            for k, column in enumerate(texts):
                self.codes[k].append(self._coded(k, column))
        self.lines += count

    def _fast(self, lines: list[str]) -> tuple[Float, list[list[str]]] | None:
        """Return numbers and texts; None where a line may be wrong or has quotation marks."""
        fields, separator = len(self.head), self.separator
        if separator:
            # `numpy.loadtxt` with chosen columns takes lines of any length, so fields are counted
            # here.
            if {line.count(separator) for line in lines} != {fields - 1}:
                return None
        elif {len(line.split()) for line in lines} != {fields}:
            return None
        if any('"' in line for line in lines):
            return None
        try:
            try:
                values = self._loaded(lines)
            except ValueError:
                # Empty fields are rare and cost half as much time again; they are filled in where
                # NumPy refused.
                values = self._loaded([_filled(line) for line in lines])
        except ValueError:
            return None
        # NumPy passes over empty lines, and reads 7e999 as infinite; whoever reads line by line
        # names the line.
        if len(values) != len(lines) or np.isinf(values).any():
            return None
        return values, [[line.split(separator, k + 1)[k] for line in lines] for k in self.at_texts]

    def _loaded(self, lines: list[str]) -> Float:
        # It rounds correctly to the last digit. A table of 173 MB takes 1.5 s; `pandas` (1.0 s) and
        # `pyarrow` (0.6 s) are not among the base's packages.
        return np.loadtxt(lines, delimiter=self.separator, usecols=self.at, comments=None, ndmin=2)

    def _line_by_line(self, lines: list[str]) -> tuple[Float, list[list[str]]]:
        """Return numbers and texts of lines.

        Raises:
            FileFormatError: one has too few or many fields, or a field is no number.
        """
        values = np.empty((len(lines), len(self.at)))
        texts: list[list[str]] = [[] for _ in self.at_texts]
        for row, line in enumerate(lines):
            number = self.lines + row + 1
            try:
                fields = next(csv.reader([line], strict=True)) if self.separator else line.split()
            except csv.Error as error:
                raise FileFormatError(
                    f"{self.path}, line {number}: a quotation mark is not closed, or stands amid "
                    f"a field ({error})"
                ) from None
            self._check_count(fields, number)
            for k, at in enumerate(self.at):
                try:
                    values[row, k] = _number(fields[at])
                except ValueError:
                    raise FileFormatError(
                        f"{self.path}, line {number}: {self.head[at]} must be a number, got "
                        f"'{fields[at].strip()[:40]}'"
                    ) from None
            for column, at in zip(texts, self.at_texts, strict=True):
                column.append(fields[at])
        return values, texts

    def _check_count(self, fields: list[str], number: int) -> None:
        if len(fields) != len(self.head):
            raise FileFormatError(
                f"{self.path}, line {number}: must have {len(self.head)} fields, got {len(fields)}"
            )

    def _coded(self, k: int, column: list[str]) -> Int:
        known = self.known[k]
        codes = [known.setdefault(text.strip(), len(known)) for text in column]
        if len(known) > MOST_TEXTS:
            raise FileFormatError(
                f"{self.path}: {self.texts[k]} may have {MOST_TEXTS:,} values, got more"
            )
        return np.array(codes, dtype=np.int64)

    def columns(self) -> Columns:
        if not self.rows:
            raise FileFormatError(f"{self.path}: holds no states")
        numbers: dict[str, Float] = {}
        for k, name in enumerate(self.numbers):
            numbers[name] = np.concatenate(self.values[k])
            self.values[k].clear()  # a large file's columns are held once
        texts = {
            name: (list(self.known[k]), np.concatenate(self.codes[k]))
            for k, name in enumerate(self.texts)
        }
        return Columns(numbers, texts)


def _filled(line: str) -> str:
    """Return a line with "nan" in its empty fields."""
    if ",," in line:
        line = line.replace(",,", ",nan,").replace(",,", ",nan,")
    return f"{'nan' * line.startswith(',')}{line}{'nan' * line.endswith(',')}"


def _number(text: str) -> float:
    """Return a finite number; NaN for an empty field.

    Raises:
        ValueError: it is none.
    """
    text = text.strip()
    value = float(text) if text else math.nan
    # Python's `float` takes 1_000 and digits of all scripts, NumPy does not: both readers must
    # agree.
    if math.isinf(value) or "_" in text or not text.isascii():
        raise ValueError
    return value


def whole_numbers(path: Path, name: str, values: Float, head: int = 1) -> npt.NDArray[np.int64]:
    """Return a column of ids or frames as integers.

    Raises:
        FileFormatError: a value is not a whole number.
    """
    # From 2⁵³ on two ids may be one float64.
    bad = np.flatnonzero(~((values == np.rint(values)) & (np.abs(values) < 2**53)))
    if len(bad):
        raise FileFormatError(
            f"{path}, line {int(bad[0]) + head + 1}: {name} must be a whole number, got "
            f"{values[bad[0]]:g}"
        )
    return values.astype(np.int64)
