"""Checks of the tables of a run's file before any row is read.

The file is untrusted. SQLite executes parts of a schema (views, triggers, generated columns,
defaults), so a file with another schema than the store writes is rejected.
"""

import re
import sqlite3
from contextlib import closing

from bridgegen.base.errors import InputError
from bridgegen.results.store import checkpoint

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
    with closing(sqlite3.connect(":memory:")) as model:
        model.execute(sql)
        if _columns(model, table) != _columns(connection, table):
            raise InputError(f"the columns are not the run's (table {table})")


def _columns(connection: sqlite3.Connection, table: str) -> list[tuple[object, ...]]:
    return connection.execute(f"PRAGMA table_xinfo({table})").fetchall()
