"""SQLite for the store: connections, a lock, clear errors; and the latest state of a search."""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from urllib.parse import quote

from bridgegen.base.errors import InputError, StorageError

LOCK_SECONDS = 5.0
"""Time that a writer waits for another [s]: a killed process's workers end moments after it."""

CAUSES = {
    sqlite3.SQLITE_FULL: "the disk is full",
    sqlite3.SQLITE_READONLY: "it is read-only",
    sqlite3.SQLITE_CANTOPEN: "it cannot be opened (a missing folder, or no permission)",
    sqlite3.SQLITE_PERM: "no permission",
    sqlite3.SQLITE_IOERR: "reading or writing failed",
    sqlite3.SQLITE_CORRUPT: "the file is damaged",
    sqlite3.SQLITE_NOTADB: "it is not an SQLite database",
    sqlite3.SQLITE_AUTH: "the file is damaged: it holds a view or a trigger",
    sqlite3.SQLITE_BUSY: "another process holds it",
}


@contextmanager
def storage_errors(path: Path, doing: str, kept: str = "") -> Iterator[None]:
    """Convert errors of SQLite and of the system to a StorageError with the cause.

    Args:
        path: the file, for the message.
        doing: the operation, as a participle ("written").
        kept: what is not lost, a sentence.
    """
    try:
        yield
    except sqlite3.Error as error:
        # The low byte is the primary code; errors of Python's own wrapper have none.
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF
        name = getattr(error, "sqlite_errorname", "")
        detail = f"{error}, {name}" if name else str(error)
        cause = f"{CAUSES[code]} ({detail})" if code in CAUSES else detail
        raise StorageError(_sentence(path, doing, cause, kept)) from error
    except OSError as error:
        raise StorageError(_sentence(path, doing, str(error.strerror or error), kept)) from error


def _sentence(path: Path, doing: str, cause: str, kept: str) -> str:
    return f"{path}: cannot be {doing}: {cause}" + (f"; {kept}" if kept else "")


def connect(path: Path, *, write: bool) -> sqlite3.Connection:
    """Open an existing database, with explicit transactions only.

    A reader never writes, and works on read-only media too.
    """
    # Never "rwc": a file that is gone must not come back empty.
    mode = "rw"
    if not write and not os.access(path.parent, os.W_OK):
        # SQLite reads a WAL database only where it can create a -shm file, unless the URI says that
        # the file is immutable. It is if there is no log.
        mode = "ro" if path.with_name(path.name + "-wal").exists() else "ro&immutable=1"
    uri = f"file:{quote(str(path.absolute()))}?mode={mode}"
    connection = sqlite3.connect(uri, uri=True, isolation_level=None, timeout=10.0)
    try:
        # The file is untrusted: its schema must not call functions with side effects, and every
        # page is checked before it is used.
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA cell_size_check = ON")
        if not write:
            connection.execute("PRAGMA query_only = ON")
        connection.set_authorizer(_authorize)
    except BaseException:
        connection.close()
        raise
    return connection


_FORBIDDEN = {
    sqlite3.SQLITE_ATTACH,
    sqlite3.SQLITE_CREATE_TRIGGER,
    sqlite3.SQLITE_CREATE_VIEW,
    sqlite3.SQLITE_CREATE_VTABLE,
    sqlite3.SQLITE_RECURSIVE,
}


def _authorize(
    action: int, _first: str | None, _second: str | None, _base: str | None, inside: str | None
) -> int:
    """Deny what no statement of the store needs: views, triggers and recursion of the file.

    Args:
        action: the requested operation.
        inside: the view or trigger that requests it, or None.
    """
    refused = inside is not None or action in _FORBIDDEN
    return sqlite3.SQLITE_DENY if refused else sqlite3.SQLITE_OK


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Commit everything or nothing, also after Ctrl-C."""
    # The lock of a writer at once: a deferred one may fail after the first reads, amid a batch.
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        # SQLite has rolled back by itself after some errors; a full disk may refuse this too.
        if connection.in_transaction:
            with suppress(sqlite3.Error):
                connection.execute("ROLLBACK")
        raise


class Lock:
    """At most one writer per run, in this process or any other.

    It is an exclusive transaction on an empty SQLite database: SQLite's file locks work on every
    system and within one process, and end when the process ends, for whatever reason.

    Raises:
        StorageError: another process still holds it after `LOCK_SECONDS`, or the folder is not
            writable.
    """

    def __init__(self, path: Path) -> None:
        with storage_errors(path.parent, "written"):
            connection = sqlite3.connect(path, isolation_level=None, timeout=LOCK_SECONDS)
            try:
                connection.execute("PRAGMA journal_mode = MEMORY")  # nothing is ever written
                connection.execute("BEGIN EXCLUSIVE")
            except sqlite3.OperationalError as error:
                connection.close()
                if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY:
                    raise
                raise StorageError(
                    f"{path.parent}: another process is writing this run; "
                    "wait for it, or stop it first"
                ) from None
        self._connection = connection

    def release(self) -> None:
        """Release the lock."""
        self._connection.close()


# --- The latest state of a search, stored with its evaluations ---


TABLE = (
    "checkpoint (id INTEGER PRIMARY KEY CHECK (id = 0), evaluations INTEGER NOT NULL, "
    "idle INTEGER NOT NULL, digest BLOB NOT NULL, state BLOB NOT NULL)"
)


@dataclass(frozen=True)
class Checkpoint:
    """The state of a search after a number of evaluations.

    Attributes:
        evaluations: how many, from the start of the run.
        idle: how many consecutive batches before it were empty.
        state: the serialised state of the algorithm.
    """

    evaluations: int
    idle: int
    state: bytes


def write_checkpoint(connection: sqlite3.Connection, checkpoint: Checkpoint) -> None:
    """Replace the checkpoint; within a transaction."""
    connection.execute(f"CREATE TABLE IF NOT EXISTS {TABLE}")
    connection.execute(
        # One row: only the newest state is kept. PPO's has 150 kB, others below 1 MB.
        "INSERT OR REPLACE INTO checkpoint VALUES (0, ?, ?, ?, ?)",
        (checkpoint.evaluations, checkpoint.idle, _digest(checkpoint), checkpoint.state),
    )


def read_checkpoint(connection: sqlite3.Connection) -> Checkpoint | None:
    """Return the checkpoint; None if the run has none.

    Raises:
        InputError: it is damaged.
    """
    there = connection.execute("SELECT count(*) FROM sqlite_master WHERE name = 'checkpoint'")
    if not there.fetchone()[0]:
        return None
    row = connection.execute("SELECT evaluations, idle, digest, state FROM checkpoint").fetchone()
    if row is None:
        return None
    evaluations, idle, digest, state = row
    whole = isinstance(evaluations, int) and isinstance(idle, int)
    if whole and min(evaluations, idle) >= 0 and isinstance(state, bytes):
        checkpoint = Checkpoint(evaluations, idle, state)
        if digest == _digest(checkpoint):
            return checkpoint
    raise InputError("the saved state of the search is not what was written")


def _digest(checkpoint: Checkpoint) -> bytes:
    """Return a checksum of the state; SQLite has none."""
    # The numbers are the key, so a state beside other numbers does not match, either.
    key = f"{checkpoint.evaluations} {checkpoint.idle}".encode()
    return blake2b(checkpoint.state, digest_size=16, key=key).digest()
