"""The latest state of a search, stored with its evaluations."""

import sqlite3
from dataclasses import dataclass
from hashlib import blake2b

from bridgegen.base.errors import InputError

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
    key = f"{checkpoint.evaluations} {checkpoint.idle}".encode()
    return blake2b(checkpoint.state, digest_size=16, key=key).digest()
