"""The table of evaluations: its columns, its rows as arrays, and checks before any is read."""

import re
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, fields
from hashlib import sha256
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.findings import COLUMNS, Findings, unpacked
from bridgegen.base.arrays import Bool, Float, Int, as_float
from bridgegen.base.errors import InputError
from bridgegen.results.store import sqlite as checkpoint

FIRST = ("id", "batch", "seconds", "u")
LAST = ("status", "critical", "cause", *COLUMNS)
# Older runs stay as they are and are read as they are: a store is never migrated, so what was
# recorded keeps its bytes.
LAST_OF_SCHEMA = {1: LAST[:2], 2: LAST[:3], 3: LAST[:-1], 4: LAST}
"""The last columns by the schema of the store."""

DIGESTED = 4096
"""Number of rows that are digested at a time."""


class Evaluated(Protocol):
    """The evaluation of n rows: any object with these arrays."""

    @property
    def metrics(self) -> Float:
        """``(n, M)`` float64, NaN or ±inf where the metric defines them."""

    @property
    def F(self) -> Float:
        """``(n, n_obj)`` float64, smaller is more critical."""

    @property
    def critical(self) -> Bool:
        """``(n,)`` bool."""

    @property
    def status(self) -> npt.NDArray[np.integer[Any]]:
        """``(n,)`` integers, 0 is success."""

    @property
    def cause(self) -> npt.NDArray[np.integer[Any]] | None:
        """``(n,)`` integers, a `Cause` each; None where causes are not sought."""

    @property
    def findings(self) -> Findings | None:
        """The decisive conflict of each row; None where conflicts are not recorded."""

    @property
    def messages(self) -> Mapping[int, str]:
        """Details of failures, by row."""


@dataclass(frozen=True)
class Rows:
    """n evaluations as they were recorded.

    Attributes:
        id: ``(n,)`` int64, 0, 1, 2 … in the order of recording.
        batch: ``(n,)`` int64, which transaction recorded them.
        seconds: ``(n,)`` float64 [s], from the start of the run to the end of the row's batch.
        U: ``(n, n_var)`` float64, the unit-cube rows, exact.
        X: ``(n, len(parameters))`` float64, the concrete scenarios, exact (no −0.0).
        metrics: ``(n, M)`` float64.
        F: ``(n, n_obj)`` float64.
        status: ``(n,)`` int64, 0 is success.
        critical: ``(n,)`` bool.
        cause: ``(n,)`` int8, a `Cause` each; NONE in a run that did not determine causes.
        findings: the decisive conflict of each row; empty in a run that recorded none.
    """

    id: Int
    batch: Int
    seconds: Float
    U: Float
    X: Float
    metrics: Float
    F: Float
    status: Int
    critical: Bool
    cause: npt.NDArray[np.int8]
    findings: Findings

    def __len__(self) -> int:
        return len(self.id)

    @property
    def messages(self) -> Mapping[int, str]:
        """Empty: the recorded messages are in `Store.failures`."""
        return {}

    @classmethod
    def join(cls, parts: Sequence["Rows"]) -> "Rows":
        """Concatenate the rows of several parts, at least one."""
        if len(parts) == 1:
            return parts[0]
        names = [field.name for field in fields(cls) if field.name != "findings"]
        return cls(
            **{name: np.concatenate([getattr(p, name) for p in parts]) for name in names},
            findings=Findings.join([part.findings for part in parts]),
        )

    def digest(self) -> str:
        """Return the SHA-256 of inputs and results, without times.

        It depends on the seed only.
        """
        return digest_of(self)

    def take(self, at: Int) -> "Rows":
        """Return the rows at some positions, in that order."""
        names = [field.name for field in fields(self) if field.name != "findings"]
        return Rows(
            **{name: getattr(self, name)[at] for name in names}, findings=self.findings.take(at)
        )


@dataclass(frozen=True)
class Columns:
    """The columns of the table, named when the run is created.

    SQL ignores case, and the table has columns besides the user's, so a name that is in use gets a
    suffix: a parameter "status" is in the column "status_parameter".

    Attributes:
        n_var: searched parameters.
        X: the column of each parameter.
        metrics: the column of each metric.
        F: the column of each objective: f0, f1 …
        last: the last columns, see ``LAST_OF_SCHEMA``.
    """

    n_var: int
    X: tuple[str, ...]
    metrics: tuple[str, ...]
    F: tuple[str, ...]
    last: tuple[str, ...] = LAST

    @classmethod
    def named(
        cls,
        n_var: int,
        parameters: Sequence[str],
        metrics: Sequence[str],
        n_obj: int,
        *,
        schema: int = max(LAST_OF_SCHEMA),
    ) -> "Columns":
        """Choose the columns' names.

        Raises:
            InputError: a name that is empty, given twice, or cannot be written in SQL.
        """
        problems = []
        for kind, given in (("parameter", parameters), ("metric", metrics)):
            for name in dict.fromkeys(given):
                # SQL ends at NUL; a lone surrogate is not a character.
                if not name.strip() or "\0" in name or any("\ud800" <= c <= "\udfff" for c in name):
                    problems.append(f"a {kind}'s name must be a non-empty text, got {name!r}")
                if given.count(name) > 1:
                    problems.append(f"a {kind}'s name must be unique, got {name!r} twice")
        if problems:
            raise InputError(*problems)
        F = tuple(f"f{i}" for i in range(n_obj))
        last = LAST_OF_SCHEMA[schema]
        taken = {name.lower() for name in (*FIRST, *F, *last)}
        X = _free(parameters, "parameter", taken)
        return cls(n_var, X, _free(metrics, "metric", taken), F, last)

    @property
    def all(self) -> tuple[str, ...]:
        """Every column, in the table's order."""
        return (*FIRST, *self.X, *self.metrics, *self.F, *self.last)

    def create_sql(self) -> str:
        """Return the statement that creates the table."""
        kinds = {"id": "INTEGER PRIMARY KEY", "batch": "INTEGER NOT NULL", "u": "BLOB NOT NULL"}
        kinds |= {"status": "INTEGER NOT NULL", "critical": "INTEGER NOT NULL"}
        kinds |= dict.fromkeys(self.last[2:], "TEXT")
        columns = ", ".join(f"{quoted(name)} {kinds.get(name, 'REAL')}" for name in self.all)
        return f"CREATE TABLE evaluations ({columns})"

    def insert_sql(self) -> str:
        """Return the statement that records one row."""
        marks = ", ".join("?" * len(self.all))
        return f"INSERT INTO evaluations VALUES ({marks})"

    def pack(
        self, start: int, batch: int, seconds: float, U: Float, X: Float, result: Evaluated
    ) -> list[tuple[Any, ...]]:
        """Return a batch as the values to insert.

        Raises:
            ValueError: an array has the wrong shape, or U or X is not finite.
        """
        n = len(U)
        U = as_float("U", U, (n, self.n_var))
        # A blob, little-endian on every machine: a search that is resumed compares what its
        # algorithm asks for with what is stored, bit for bit, and REAL loses the sign of −0.0.
        blobs = [row.tobytes() for row in U.astype("<f8")]
        numbers = np.hstack(
            [
                as_float("X", X, (n, len(self.X))),
                as_float("metrics", result.metrics, (n, len(self.metrics)), finite=False),
                as_float("F", result.F, (n, len(self.F)), finite=False),
            ]
        )
        status, critical = np.asarray(result.status), np.asarray(result.critical)
        cause = np.zeros(n, np.int8) if result.cause is None else np.asarray(result.cause)
        for name, array in (("status", status), ("critical", critical), ("cause", cause)):
            if array.shape != (n,):
                raise ValueError(f"{name} must have shape ({n},), got {array.shape}")
        findings = result.findings or Findings.none(n)
        if len(findings) != n:
            raise ValueError(f"findings must be those of {n} rows, got {len(findings)}")
        parts = zip(
            blobs,
            numbers.tolist(),
            status.astype(np.int64).tolist(),
            critical.astype(np.int64).tolist(),
            [Cause(item).label or None for item in cause.tolist()],
            *([item or None for item in texts.tolist()] for texts in findings.columns().values()),
            strict=True,
        )
        width = len(self.last)
        return [
            (start + k, batch, seconds, blob, *row, *last[:width])
            for k, (blob, row, *last) in enumerate(parts)
        ]

    def unpack(self, rows: Sequence[tuple[Any, ...]]) -> Rows:
        """Convert rows that SQL has read to arrays.

        Raises:
            ValueError, TypeError, InputError: values that this table cannot hold.
        """
        n, first, names = len(rows), len(FIRST), self.all
        n_float = len(self.X) + len(self.metrics) + len(self.F)
        # NULL arrives as None, which float64 takes as NaN.
        numbers = np.array([row[first : first + n_float] for row in rows], dtype=np.float64)
        numbers = numbers.reshape(n, n_float)
        X, metrics, F = np.split(
            numbers, np.cumsum([len(self.X), len(self.metrics)]).tolist(), axis=1
        )
        finite("a parameter", X)
        last = first + n_float
        causes = [row[last + 2] if len(self.last) > 2 else None for row in rows]
        return Rows(
            id=column(rows, names[0], 0, np.int64),
            batch=column(rows, names[1], 1, np.int64),
            seconds=column(rows, names[2], 2, np.float64),
            U=unit_rows(rows, 3, self.n_var),
            X=np.ascontiguousarray(X),
            metrics=np.ascontiguousarray(metrics),
            F=np.ascontiguousarray(F),
            status=column(rows, names[last], last, np.int64),
            critical=column(rows, names[last + 1], last + 1, np.bool_),
            cause=np.array(
                [Cause.named(cause) if cause else Cause.NONE for cause in causes], np.int8
            ),
            findings=unpacked([row[last + 3 :] for row in rows])
            if len(self.last) > 3
            else Findings.none(n),
        )


def quoted(name: str) -> str:
    """Return ``name`` as an SQL identifier, whatever it contains."""
    return '"' + name.replace('"', '""') + '"'


def column(rows: Sequence[tuple[Any, ...]], name: str, at: int, kind: type[Any]) -> Any:
    """Return a column of what SQL read, ``(n,)``.

    Args:
        rows: n of them.
        name: of the column, for the message.
        at: its place in a row.
        kind: of the array.

    Raises:
        TypeError: a value is not a number of that kind.
    """
    values = [row[at] for row in rows]
    wanted = {int, float} if kind is np.float64 else {int}
    # SQLite's columns take values of any type, whatever their declaration; `bool` is a subclass of
    # `int`, hence the types themselves.
    if odd := {*map(type, values)} - wanted:
        what = "a number" if kind is np.float64 else "a whole number"
        raise TypeError(f"{name} must be {what}, got a {odd.pop().__name__}")
    return np.array(values, dtype=kind)


def unit_rows(rows: Sequence[tuple[Any, ...]], at: int, n_var: int) -> Float:
    """Return the unit-cube rows of what SQL read, ``(n, n_var)``.

    Args:
        rows: n of them.
        at: the place of ``u`` in a row.
        n_var: searched parameters.

    Raises:
        ValueError: a value is not n_var finite numbers.
    """
    if any(type(row[at]) is not bytes or len(row[at]) != 8 * n_var for row in rows):
        raise ValueError(f"a row of the unit cube is not {n_var} numbers")
    blob = b"".join(row[at] for row in rows)
    U = np.frombuffer(blob, dtype="<f8").reshape(len(rows), n_var)
    if not np.isfinite(U).all():
        raise ValueError("a row of the unit cube is not finite")
    return U.astype(np.float64)


def finite(what: str, values: Float) -> Float:
    """Return values that must be finite.

    Args:
        what: they are, for the message.
        values: of any shape.

    Raises:
        ValueError: one is NaN or infinite.
    """
    if not np.isfinite(values).all():
        raise ValueError(f"{what} is not finite")
    return values


def digest_of(rows: Any) -> str:
    """Return `Rows.digest` of evaluations, be they in memory or not.

    Args:
        rows: with the arrays of `Rows`, or what reads stretches of them.
    """
    digest, n = sha256(), len(rows)
    # Without batches and seconds, which depend on the machine: the digest is the seed's alone.
    for name in ("U", "X", "metrics", "F", "status", "critical", "cause"):
        values = getattr(rows, name)
        for start in range(0, n, DIGESTED):
            part = values[start : start + DIGESTED]
            digest.update(part.astype(part.dtype.newbyteorder("<")).tobytes())
    # What happened is left out: the digests of runs that did not record it stay as they were.
    for texts in [texts for name, texts in rows.findings.columns().items() if name != "happened"]:
        for start in range(0, n, DIGESTED):
            said = "\0".join(texts[start : start + DIGESTED].tolist())
            # The separator between parts makes the digest that of one text, whatever the size of a
            # part.
            digest.update(("\0" * (start > 0) + said).encode())
    return digest.hexdigest()


def _free(names: Iterable[str], kind: str, taken: set[str]) -> tuple[str, ...]:
    """Return a column for each name, and add it to those ``taken`` (in lower case)."""
    columns = []
    for name in names:
        column, count = name, 1
        while column.lower() in taken:
            column = f"{name}_{kind}" + (f"_{count}" if count > 1 else "")
            count += 1
        taken.add(column.lower())
        columns.append(column)
    return tuple(columns)


# --- Checks of the tables of a run's file before any row is read ---
# The file is untrusted. SQLite executes parts of a schema (views, triggers, generated columns,
# defaults), so a file with another schema than the store writes is rejected.


RUN = "run (key TEXT PRIMARY KEY, value TEXT NOT NULL)"
FAILURES = "failures (id INTEGER PRIMARY KEY, message TEXT NOT NULL)"

NEEDED = ("run", "evaluations")
_FIXED = {"run": RUN, "failures": FAILURES, "checkpoint": checkpoint.TABLE}
_OWN = (*_FIXED, "evaluations")

_HARMLESS = ("CREATE TABLE ", "CREATE INDEX ", "CREATE UNIQUE INDEX ", "CREATE VIEW ")
"""Permitted beginnings of schema entries; views of other names are never read."""


def tables_of(connection: sqlite3.Connection) -> set[str]:
    """Return the names of all tables, after a check that those of a run are plain tables.

    Raises:
        InputError: a trigger, a virtual table, or a view instead of a table.
    """
    found = connection.execute("SELECT name, sql FROM sqlite_master").fetchall()
    for name, sql in found:
        if sql is not None and not str(sql).startswith(_HARMLESS):
            raise InputError(f"it contains '{str(sql)[:40]}', which no run does")
        # SQLite uses the statement, not the name or the kind beside it.
        if str(name).lower() in _OWN and not re.match(
            rf'CREATE TABLE ("?){re.escape(str(name).lower())}\1\s*\(', str(sql), re.IGNORECASE
        ):
            raise InputError(f"'{name}' is not a plain table")
    names = {str(name).lower() for name, _ in found}
    for name in names & _FIXED.keys():
        check_columns(connection, name, f"CREATE TABLE {_FIXED[name]}")
    return names


def check_columns(connection: sqlite3.Connection, table: str, sql: str) -> None:
    """Check that a table has the columns that a statement creates.

    Names, types, constraints, default values and whether they are computed must be the same.

    Args:
        connection: to the file.
        table: its name.
        sql: the statement that creates it.

    Raises:
        InputError: its columns differ.
    """
    # SQLite itself says what columns a statement makes: no parser of ours can differ from it.
    with closing(sqlite3.connect(":memory:")) as model:
        model.execute(sql)
        if _columns(model, table) != _columns(connection, table):
            raise InputError(f"the columns are not the run's (table {table})")


def _columns(connection: sqlite3.Connection, table: str) -> list[tuple[object, ...]]:
    return connection.execute(f"PRAGMA table_xinfo({table})").fetchall()
