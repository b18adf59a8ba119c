"""The state of a search, beside its evaluations: the newest only."""

import sqlite3
from dataclasses import dataclass
from hashlib import blake2b

from bridgegen.errors import InputError

TABLE = (
    "checkpoint (id INTEGER PRIMARY KEY CHECK (id = 0), evaluations INTEGER NOT NULL, "
    "idle INTEGER NOT NULL, digest BLOB NOT NULL, state BLOB NOT NULL)"
)


@dataclass(frozen=True)
class Checkpoint:
    """What a search was after it had been told some evaluations.

    Attributes:
        evaluations: how many, the first of the run.
        idle: how many batches in a row had brought none.
        state: the algorithm's own account of itself.
    """

    evaluations: int
    idle: int
    state: bytes


def write_checkpoint(connection: sqlite3.Connection, checkpoint: Checkpoint) -> None:
    """Put a checkpoint in the place of the one before; within a transaction."""
    connection.execute(f"CREATE TABLE IF NOT EXISTS {TABLE}")
    connection.execute(
        "INSERT OR REPLACE INTO checkpoint VALUES (0, ?, ?, ?, ?)",
        (checkpoint.evaluations, checkpoint.idle, _digest(checkpoint), checkpoint.state),
    )


def read_checkpoint(connection: sqlite3.Connection) -> Checkpoint | None:
    """Return the checkpoint; None of a run that has none.

    Raises:
        InputError: it is not what was written.
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
    """Return what tells a damaged state; SQLite has no checksums."""
    key = f"{checkpoint.evaluations} {checkpoint.idle}".encode()
    return blake2b(checkpoint.state, digest_size=16, key=key).digest()
