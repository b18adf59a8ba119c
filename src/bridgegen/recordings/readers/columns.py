"""Columns of large comma-separated files, read in chunks of bounded size."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.openx.xml import read_bytes
from bridgegen.recordings.readers._csv_kernels import (
    BAD_QUOTE,
    COMMA,
    FEW_FIELDS,
    MANY_FIELDS,
    NOT_A_NUMBER,
    SPACE,
    read_lines,
)

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
    read_bytes(path, limit=MOST_BYTES) if not path.is_file() else None
    try:
        with path.open("rb") as file:
            head = list(names or ())
            if names is None:
                first = file.readline(LONGEST_LINE)
                head = header(first)
                _check(path, head, [*numbers, *texts])
            wanted = [*numbers, *(name for name in optional if name in head)]
            reading = _Reading(path, head, wanted, list(texts), COMMA if names is None else SPACE)
            rest = b""
            while chunk := file.read(CHUNK):
                whole, cut, rest = (rest + chunk).rpartition(b"\n")
                if len(rest) > LONGEST_LINE:
                    raise FileFormatError(
                        f"{path}: a line may have {LONGEST_LINE} bytes, one has more"
                    )
                reading.add(whole + cut)
            reading.add(rest + b"\n" if rest else b"")
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
    """The lines of a file, chunk by chunk."""

    def __init__(
        self, path: Path, head: list[str], numbers: list[str], texts: list[str], separator: int
    ) -> None:
        self.path, self.head, self.separator = path, head, separator
        self.numbers, self.texts = numbers, texts
        self.slot = np.full(len(head), -1, dtype=np.int64)
        for k, name in enumerate(numbers):
            self.slot[head.index(name)] = k
        for k, name in enumerate(texts):
            self.slot[head.index(name)] = -2 - k
        self.values: list[list[Float]] = [[] for _ in numbers]
        self.codes: list[list[Int]] = [[] for _ in texts]
        self.known: list[dict[str, int]] = [{} for _ in texts]
        self.lines = 1 if separator == COMMA else 0
        self.rows = 0

    def add(self, chunk: bytes) -> None:
        if not chunk:
            return
        data = np.frombuffer(chunk, dtype=np.uint8)
        most = chunk.count(b"\n")
        values = np.empty((most, len(self.numbers)))
        hashes = np.empty((most, len(self.texts)), dtype=np.int64)
        spans = np.empty((most, len(self.texts), 2), dtype=np.int64)
        found = np.zeros(4, dtype=np.int64)
        read_lines(data, self.separator, len(self.head), self.slot, values, hashes, spans, found)
        rows, lines, code, field = found.tolist()
        if code:
            raise FileFormatError(self._problem(chunk, lines, code, field))
        self.lines += lines
        self.rows += rows
        if self.rows > MOST_LINES:
            raise FileFormatError(f"{self.path}: may hold {MOST_LINES:,} lines, got more")
        for k in range(len(self.numbers)):
            self.values[k].append(values[:rows, k].copy())
        for k in range(len(self.texts)):
            self.codes[k].append(self._coded(k, chunk, hashes[:rows, k], spans[:rows, k]))

    def _coded(self, k: int, chunk: bytes, hashes: Int, spans: Int) -> Int:
        _, at, inverse = np.unique(hashes, return_index=True, return_inverse=True)
        numbers = np.empty(len(at), dtype=np.int64)
        for j in np.argsort(at):
            begin, end = spans[at[j]].tolist()
            text = chunk[begin:end].decode("utf-8", errors="replace").strip()
            if len(self.known[k]) >= MOST_TEXTS:
                raise FileFormatError(
                    f"{self.path}: {self.texts[k]} may have {MOST_TEXTS:,} values, got more"
                )
            numbers[j] = self.known[k].setdefault(text, len(self.known[k]))
        return numbers[inverse]

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

    def _problem(self, chunk: bytes, line: int, code: int, field: int) -> str:
        place = f"{self.path}, line {self.lines + line}"
        if code in (FEW_FIELDS, MANY_FIELDS):
            more = "more" if code == MANY_FIELDS else str(field)
            return f"{place}: must have {len(self.head)} fields, got {more}"
        if code == BAD_QUOTE:
            return f"{place}: a quotation mark is not closed"
        assert code == NOT_A_NUMBER
        text = chunk.split(b"\n", line)[line - 1].decode("utf-8", errors="replace")
        parts = text.split(",") if self.separator == COMMA else text.split()
        shown = parts[field].strip()[:40] if field < len(parts) else ""
        return f"{place}: {self.head[field]} must be a number, got '{shown}'"


def whole_numbers(path: Path, name: str, values: Float, head: int = 1) -> npt.NDArray[np.int64]:
    """Return a column of ids or frames as integers.

    Raises:
        FileFormatError: a value is not a whole number.
    """
    bad = np.flatnonzero(~((values == np.rint(values)) & (np.abs(values) < 2**53)))
    if len(bad):
        raise FileFormatError(
            f"{path}, line {int(bad[0]) + head + 1}: {name} must be a whole number, got "
            f"{values[bad[0]]:g}"
        )
    return values.astype(np.int64)
