"""The saved state of a search, as SQLite keeps it."""

import sqlite3

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.results.store import Checkpoint
from bridgegen.results.store.sqlite import read_checkpoint, write_checkpoint

ONE = Checkpoint(40, 3, b"state \0\xff")


@pytest.fixture
def database():
    connection = sqlite3.connect(":memory:")
    yield connection
    connection.close()


def test_what_is_written_is_read_and_the_later_replaces_the_earlier(database):
    write_checkpoint(database, ONE)
    assert read_checkpoint(database) == ONE
    later = Checkpoint(80, 0, b"")
    write_checkpoint(database, later)
    assert read_checkpoint(database) == later
    assert database.execute("SELECT count(*) FROM checkpoint").fetchone() == (1,)


def test_a_run_without_one_has_none(database):
    assert read_checkpoint(database) is None
    write_checkpoint(database, ONE)
    database.execute("DELETE FROM checkpoint")
    assert read_checkpoint(database) is None


@pytest.mark.parametrize(
    "damage",
    ["evaluations = 41", "idle = 2", "state = x'00'", "digest = x'00'", "idle = 'three'",
     "evaluations = 'forty'", "state = 'text'"],
)  # fmt: skip
def test_a_damaged_one_is_refused(damage, database):
    write_checkpoint(database, ONE)
    database.execute(f"UPDATE checkpoint SET {damage}")
    with refuses(InputError):
        read_checkpoint(database)
