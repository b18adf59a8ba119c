"""The store of a run: a folder with ``run.sqlite``, one transaction per batch."""

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError, StorageError
from bridgegen.base.extras import require
from bridgegen.results.store.rows import FAILURES, Evaluated, Rows, quoted
from bridgegen.results.store.run_file import (
    FILE,
    LOCK,
    SCHEMA,
    columns_of,
    read_run,
    refuse_other_names,
    refuse_used,
    require_there,
    write_run,
)
from bridgegen.results.store.sqlite import (
    Checkpoint,
    Lock,
    connect,
    read_checkpoint,
    storage_errors,
    transaction,
    write_checkpoint,
)

if TYPE_CHECKING:
    import pandas as pd


CHUNK = 4096
"""Number of rows that are read from SQL at a time."""

MARKS = 900
"""Number of rows that are asked for by their ids at a time; SQLite takes at least 999."""


class Store:
    """A run's settings and its evaluations, in the order of recording; append-only.

    Table ``evaluations``: id, batch, seconds, u (the unit-cube row, float64 little endian), one
    column per parameter, metric and objective (f0, f1 …), status, critical, cause, and those of
    `Findings`. NaN is NULL, and so is the cause of what is not critical. SQLite keeps no sign of
    zero: −0.0 comes back as 0.0; every other float64 comes back bit for bit.
    Table ``run``: key and value (JSON); the algorithm's notes are under "notes".
    Table ``failures``, if there are messages: id, message.
    Table ``checkpoint``, if the algorithm can be saved: its state after its latest batch.

    Created by :meth:`create` or :meth:`open`; a context manager.

    Attributes:
        folder: the run's folder.
        settings: of the run, as passed to ``create``.
        parameters: names of X's columns.
        metrics: names of the metrics.
        columns: their names in the table.
        labels: how to read the values of parameters that are not plain numbers, by name
            (`bridgegen.scenario.language.kinds.Kind.labels`).
        domain: a note on the domain of the ego's driver; "" without one.
    """

    def __init__(
        self, folder: Path, connection: sqlite3.Connection, run: dict[str, Any], lock: Lock | None
    ) -> None:
        self.folder = folder
        self.settings: dict[str, Any] = run["settings"]
        self.parameters: tuple[str, ...] = tuple(run["parameters"])
        self.metrics: tuple[str, ...] = tuple(run["metrics"])
        self.version: str = run["version"]
        self.columns = columns_of(run)
        self.labels: dict[str, dict[str, Any]] = run.get("labels", {})
        self.domain: str = run.get("domain", "")
        self._connection = connection
        self._lock = lock
        self._finished: str | None = run.get("finished")
        self._notes: dict[str, Any] = run.get("notes", {})

    @classmethod
    def create(
        cls,
        folder: Path | str,
        settings: Mapping[str, Any],
        parameters: Sequence[str],
        metrics: Sequence[str],
        *,
        n_var: int,
        n_obj: int,
        labels: Mapping[str, Any] | None = None,
        domain: str = "",
    ) -> Self:
        """Create a run in a new or empty folder, and open it for writing.

        Args:
            folder: created with its parents if needed.
            settings: everything that resuming the run needs; JSON values, no NaN.
            parameters: names of X's columns.
            metrics: names of the metrics.
            n_var: searched parameters, the width of U.
            n_obj: objectives.
            labels: how to read the values of parameters that are not plain numbers, by name.
            domain: a note on the domain of the ego's driver, if there is one.

        Raises:
            StorageError: the folder contains a run or other files, or is not writable.
            InputError: a name that cannot be a column.
        """
        folder = Path(folder)
        run = {
            "schema": SCHEMA,
            "version": version("bridgegen"),
            "settings": settings,
            "parameters": list(parameters),
            "metrics": list(metrics),
            "n_var": n_var,
            "n_obj": n_obj,
        }
        if labels:
            run["labels"] = labels
        if domain:
            run["domain"] = domain
        columns = columns_of(run)
        refuse_used(folder)
        with storage_errors(folder, "made"):
            folder.mkdir(parents=True, exist_ok=True)
        lock = Lock(folder / LOCK)
        try:
            refuse_used(folder)  # again, now that no other process can create one
            with storage_errors(folder, "written", "nothing was written"):
                write_run(folder, columns, run)
            return cls._connected(folder, lock)
        except BaseException:
            lock.release()
            raise

    @classmethod
    def open(cls, folder: Path | str, *, write: bool = False) -> Self:
        """Open an existing run, to read it (the default, also while it is being written).

        Args:
            folder: the run's folder.
            write: resume it; no other process may be writing it.

        Raises:
            StorageError: not a run, damaged, of another schema, locked, or not readable.
        """
        folder = Path(folder)
        refuse_other_names(folder)
        with storage_errors(folder, "read"):
            if not (folder / FILE).is_file():
                what = "contains no run" if folder.is_dir() else "there is no such folder"
                raise StorageError(f"{folder}: {what} ({FILE} is missing)")
        lock = Lock(folder / LOCK) if write else None
        try:
            return cls._connected(folder, lock)
        except BaseException:
            if lock:
                lock.release()
            raise

    @classmethod
    def _connected(cls, folder: Path, lock: Lock | None) -> Self:
        path = folder / FILE
        with storage_errors(path, "opened"):
            connection = connect(path, write=lock is not None)
        try:
            store = cls(folder, connection, read_run(connection, path), lock)
            if lock:
                with storage_errors(path, "written"):
                    # Where the file system has no shared memory SQLite keeps its rollback journal:
                    # as safe, slower. NORMAL survives a killed process; a power cut can cost the
                    # last batches, never consistency.
                    connection.execute("PRAGMA journal_mode = WAL")
                    connection.execute("PRAGMA synchronous = NORMAL")
            return store
        except BaseException:
            connection.close()
            raise

    def close(self) -> None:
        """Close the files and release the lock."""
        if self._lock:
            # One plain file, readable from read-only media. This fails while another process reads,
            # or if the disk is full; then the log stays beside the file, which is as good.
            with suppress(sqlite3.Error):
                self._connection.execute("PRAGMA busy_timeout = 0")
                self._connection.execute("PRAGMA journal_mode = DELETE")
        self._connection.close()
        if self._lock:
            self._lock.release()
            self._lock = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def append(self, U: Float, X: Float, result: Evaluated, seconds: float) -> None:
        """Record one batch atomically.

        Args:
            U: ``(n, n_var)`` float64, unit-cube rows.
            X: ``(n, len(parameters))`` float64, the decoded rows.
            result: the results of the n rows.
            seconds: [s] since the start of the run.

        Raises:
            StorageError: the disk is full or fails; what was recorded before is kept.
            ValueError: an array has the wrong shape.
        """
        start, batch = len(self), self.n_batches
        kept = f"{start} evaluations are kept; resume with: bridgegen resume {self.folder}"
        rows = self.columns.pack(start, batch, seconds, U, X, result)
        with self._writing(kept):
            # A run that goes on is not finished; in the same transaction, so that no instant says
            # both.
            if self._finished is not None:
                self._connection.execute("DELETE FROM run WHERE key = 'finished'")
            # A batch and its messages are one transaction: whatever ends the process, the store
            # holds a beginning of the run, whole batches of it.
            self._connection.executemany(self.columns.insert_sql(), rows)
            if result.messages:
                messages = [(start + row, text) for row, text in sorted(result.messages.items())]
                self._connection.execute(f"CREATE TABLE IF NOT EXISTS {FAILURES}")
                self._connection.executemany("INSERT INTO failures VALUES (?, ?)", messages)
        self._finished = None

    def finish(self, reason: str) -> None:
        """Mark the run as finished, with the reason; ``append`` removes the mark.

        Raises:
            StorageError: the disk is full or fails; every evaluation is kept.
        """
        with self._writing("every evaluation is kept"):
            self._connection.execute(
                "INSERT OR REPLACE INTO run VALUES ('finished', ?)", (json.dumps(reason),)
            )
        self._finished = reason

    @property
    def notes(self) -> dict[str, Any]:
        """The algorithm's notes on the run; empty by default."""
        return self._notes

    def keep_notes(self, notes: Mapping[str, Any]) -> None:
        """Replace the algorithm's notes on the run.

        Raises:
            InputError: they are not JSON, or contain NaN or inf.
            StorageError: the disk is full or fails; every evaluation is kept.
        """
        try:
            text = json.dumps(notes, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise InputError(f"an algorithm's notes must be JSON: {error}") from None
        with self._writing("every evaluation is kept"):
            self._connection.execute("INSERT OR REPLACE INTO run VALUES ('notes', ?)", (text,))
        self._notes = json.loads(text)

    def save(self, checkpoint: Checkpoint) -> None:
        """Replace the saved state of the search.

        Raises:
            StorageError: the disk is full or fails; every evaluation is kept.
        """
        with self._writing("every evaluation is kept"):
            write_checkpoint(self._connection, checkpoint)

    def checkpoint(self) -> Checkpoint | None:
        """Return the saved state of the search, or None.

        Raises:
            StorageError: it is damaged.
        """
        try:
            with self._reading():
                found = read_checkpoint(self._connection)
        except InputError as error:
            raise self._damaged(str(error)) from error
        # Behind is possible: after a kill between a batch and its state, the last batch is asked
        # again on the state before it. Ahead is not, for a state is written after its batch.
        if found and found.evaluations > len(self):
            raise self._damaged("the saved state of the search is ahead of the evaluations")
        return found

    @contextmanager
    def _writing(self, kept: str) -> Iterator[None]:
        if self._lock is None:
            raise StorageError(f"{self.folder}: this run was opened for reading only")
        self.require_there()  # SQLite would write to a deleted file
        with storage_errors(self.folder / FILE, "written", kept), transaction(self._connection):
            yield

    def require_there(self) -> None:
        """Check that the run's file still exists.

        Raises:
            StorageError: the run's file was deleted or moved.
        """
        require_there(self.folder)

    def failures(self) -> dict[int, str]:
        """Return the messages of failed evaluations, by id.

        Raises:
            StorageError: the database is damaged.
        """
        with self._reading():
            there = self._connection.execute(
                "SELECT count(*) FROM sqlite_master WHERE name = 'failures'"
            ).fetchone()[0]
            found = dict(self._connection.execute("SELECT * FROM failures") if there else ())
        if not all(isinstance(text, str) for text in found.values()):
            raise self._damaged("a message of a failed evaluation is not a text")
        return found

    @property
    def finished(self) -> str | None:
        """Why the run ended, or None if it has not."""
        return self._finished

    @property
    def n_obj(self) -> int:
        """The number of objectives."""
        return len(self.columns.F)

    def __len__(self) -> int:
        """The number of recorded evaluations."""
        # Not count(*), which reads the whole table; ids are 0, 1, 2 without gaps, which each read
        # checks.
        return self._number("SELECT coalesce(max(id) + 1, 0) FROM evaluations")

    @property
    def n_critical(self) -> int:
        """The number of critical evaluations."""
        return self._number("SELECT COUNT(*) FROM evaluations WHERE critical AND status = 0")

    @property
    def n_batches(self) -> int:
        """The number of recorded batches."""
        last = "(SELECT max(id) FROM evaluations)"
        return self._number(
            f"SELECT coalesce((SELECT batch + 1 FROM evaluations WHERE id = {last}), 0)"
        )

    @property
    def seconds(self) -> float:
        """Time from the start of the run to the last recorded batch [s]; 0 if there is none."""
        with self._reading():
            row = self._connection.execute(
                "SELECT seconds FROM evaluations ORDER BY id DESC LIMIT 1"
            ).fetchone()
        if row and not isinstance(row[0], int | float):
            raise self._damaged("the time of the last evaluation is not a number")
        return float(row[0]) if row else 0.0

    def read(self, start: int = 0, stop: int | None = None) -> Rows:
        """Return the evaluations with ``start <= id < stop``.

        Raises:
            StorageError: the database is damaged.
        """
        n = len(self)
        stop = n if stop is None else min(stop, n)
        # A part at a time: SQL's rows are Python objects, ten times the size of the arrays.
        return self._joined(self.select(self.columns.all, start, stop), range(start, stop))

    def at(self, ids: Int) -> Rows:
        """Return the evaluations of some ids, in that order.

        Args:
            ids: ``(n,)`` int64, each recorded; one may be given more than once.

        Raises:
            StorageError: the database is damaged.
        """
        wanted, places = np.unique(ids, return_inverse=True)
        return self._joined(self.select_at(self.columns.all, wanted), wanted.tolist()).take(places)

    def _joined(self, found: Iterable[list[tuple[Any, ...]]], ids: Sequence[int]) -> Rows:
        parts, at = [], 0
        for some in found:
            with self.damage():
                parts.append(self.columns.unpack(some))
            if parts[-1].id.tolist() != list(ids[at : at + len(some)]):
                raise self._damaged(f"evaluations between {ids[0]} and {ids[-1]} are missing")
            at += len(some)
        return Rows.join(parts) if parts else self.columns.unpack([])

    def select(
        self, columns: Sequence[str], start: int, stop: int
    ) -> Iterator[list[tuple[Any, ...]]]:
        """Yield columns of the evaluations with ``start <= id < stop``, as SQL has them.

        They come in the order of ids, at most ``CHUNK`` at a time.

        Args:
            columns: names of the table's columns.
            start: the first id.
            stop: behind the last one, all of them recorded.

        Raises:
            StorageError: the database is damaged.
        """
        sql = f"SELECT {_names(columns)} FROM evaluations WHERE id >= ? AND id < ? ORDER BY id"
        for at in range(start, stop, CHUNK):
            end = min(at + CHUNK, stop)
            yield self._found(sql, (at, end), end - at, (at, end - 1))

    def select_at(self, columns: Sequence[str], ids: Int) -> Iterator[list[tuple[Any, ...]]]:
        """Yield columns of the evaluations of some ids, as `select` does.

        Args:
            columns: names of the table's columns.
            ids: ``(n,)`` int64, ascending, each recorded.

        Raises:
            StorageError: the database is damaged.
        """
        if len(ids) and ids[-1] - ids[0] == len(ids) - 1:  # all that are between
            yield from self.select(columns, int(ids[0]), int(ids[-1]) + 1)
            return
        for at in range(0, len(ids), MARKS):
            some = ids[at : at + MARKS].tolist()
            marks = ", ".join("?" * len(some))
            sql = f"SELECT {_names(columns)} FROM evaluations WHERE id IN ({marks}) ORDER BY id"
            yield self._found(sql, some, len(some), (some[0], some[-1]))

    def _found(
        self, sql: str, values: Sequence[int], n: int, ends: tuple[int, int]
    ) -> list[tuple[Any, ...]]:
        with self._reading():
            found = self._connection.execute(sql, values).fetchall()
        if len(found) != n:
            raise self._damaged(f"evaluations between {ends[0]} and {ends[1]} are missing")
        return found

    @contextmanager
    def damage(self) -> Iterator[None]:
        """Turn what is raised by values that no store writes into a StorageError."""
        try:
            yield
        except (TypeError, ValueError, OverflowError, InputError) as error:
            raise self._damaged(str(error)) from error

    def rows(self, start: int = 0, stop: int | None = None, chunk: int = CHUNK) -> Iterator[Rows]:
        """Yield the evaluations with ``start <= id < stop``, ``chunk`` at a time.

        Memory is bounded for any length of the run, and the run may grow meanwhile.
        """
        stop = len(self) if stop is None else min(stop, len(self))
        for at in range(start, stop, chunk):
            yield self.read(at, min(at + chunk, stop))

    def frame(self) -> "pd.DataFrame":
        """Return every evaluation as a table, without u; the index is id.

        Raises:
            InputError: pandas is not installed.
        """
        require("pandas", "a data frame")
        import pandas as pd

        n, columns = len(self), self.columns
        names = ["batch", "seconds", *columns.X, *columns.metrics, *columns.F, *columns.last]
        data = {name: np.empty(n) for name in names}
        data |= {"batch": np.empty(n, np.int64), "status": np.empty(n, np.int64)}
        data |= {"critical": np.empty(n, np.bool_)}
        texts = columns.last[2:]
        data |= {name: np.empty(n, dtype=object) for name in texts}
        for rows in self.rows(0, n):
            at = slice(int(rows.id[0]), int(rows.id[-1]) + 1)
            for name in ("batch", "seconds", "status", "critical"):
                data[name][at] = getattr(rows, name)
            labels: dict[str, Any] = {
                name: [text or None for text in array.tolist()]
                for name, array in rows.findings.columns().items()
            }
            labels["cause"] = [Cause(item).label or None for item in rows.cause.tolist()]
            for name in texts:
                data[name][at] = labels[name]
            for part, values in (
                (columns.X, rows.X),
                (columns.metrics, rows.metrics),
                (columns.F, rows.F),
            ):
                for name, column in zip(part, values.T, strict=True):
                    data[name][at] = column
        return pd.DataFrame(data, index=pd.RangeIndex(n, name="id"), columns=names)

    def _damaged(self, detail: str) -> StorageError:
        return StorageError(f"{self.folder / FILE}: the file is damaged: {detail}")

    def _reading(self) -> AbstractContextManager[None]:
        return storage_errors(self.folder / FILE, "read")

    def _number(self, sql: str) -> int:
        with self._reading():
            found = self._connection.execute(sql).fetchone()[0]
        if not isinstance(found, int) or found < 0:
            raise self._damaged(f"a number of evaluations or batches is {found!r}")
        return found


def _names(columns: Sequence[str]) -> str:
    return ", ".join(map(quoted, columns))
