"""What SQLite and the system refuse, in a sentence."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.errors import StorageError
from bridgegen.results.store.rows import Columns
from bridgegen.results.store.run_file import KEYS, write_run
from bridgegen.results.store.sqlite import storage_errors


def test_an_error_of_sqlite_has_its_name():
    words = r"run\.sqlite.*no such table: none, SQLITE_ERROR"
    with (
        closing(sqlite3.connect(":memory:")) as connection,
        pytest.raises(StorageError, match=words),
        storage_errors(Path("run.sqlite"), "read"),
    ):
        connection.execute("SELECT * FROM none")


def test_an_error_of_python_s_wrapper_has_none():
    with pytest.raises(StorageError) as error, storage_errors(Path("run.sqlite"), "read"):
        raise sqlite3.ProgrammingError("closed")
    assert str(error.value).count("closed") == 1
    assert ", " not in str(error.value).partition("closed")[2]


def test_a_file_that_cannot_be_begun_says_why(tmp_path, monkeypatch):
    """The first error, not that there is no draft to remove."""

    def refuse(*_given, **_more):
        raise sqlite3.OperationalError("unable to open database file")

    monkeypatch.setattr(sqlite3, "connect", refuse)
    columns = Columns.named(1, ["a"], ["m"], 1)
    with refuses(sqlite3.OperationalError):
        write_run(tmp_path, columns, dict.fromkeys(KEYS, 0))
    assert list(tmp_path.iterdir()) == []
