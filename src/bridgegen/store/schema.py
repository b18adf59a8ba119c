"""The tables of a run's file: what they must be before a row of them is read.

The file may be anybody's. SQLite runs what a schema says (views, triggers, generated columns,
defaults), so a file whose schema is not the one that the store writes is refused.
"""

import re
import sqlite3
from contextlib import closing

from bridgegen.errors import InputError
from bridgegen.store import checkpoint

RUN = "run (key TEXT PRIMARY KEY, value TEXT NOT NULL)"
FAILURES = "failures (id INTEGER PRIMARY KEY, message TEXT NOT NULL)"

NEEDED = ("run", "evaluations")
_FIXED = {"run": RUN, "failures": FAILURES, "checkpoint": checkpoint.TABLE}
_OWN = (*_FIXED, "evaluations")

_HARMLESS = ("CREATE TABLE ", "CREATE INDEX ", "CREATE UNIQUE INDEX ", "CREATE VIEW ")
"""How an entry of a schema may begin, as SQLite writes them; views of other names are not read."""


def tables_of(connection: sqlite3.Connection) -> set[str]:
    """Return the names of all tables, once those of a run are known to be plain ones.

    Raises:
        InputError: a trigger, a virtual table, or a view in the place of a table.
    """
    found = connection.execute("SELECT name, sql FROM sqlite_master").fetchall()
    for name, sql in found:
        if sql is not None and not str(sql).startswith(_HARMLESS):
            raise InputError(f"it holds '{str(sql)[:40]}', which no run does")
        # SQLite goes by the statement, not by the name or the kind beside it.
        if str(name).lower() in _OWN and not re.match(
            rf'CREATE TABLE ("?){re.escape(str(name).lower())}\1\s*\(', str(sql), re.IGNORECASE
        ):
            raise InputError(f"'{name}' is not a plain table")
    names = {str(name).lower() for name, _ in found}
    for name in names & _FIXED.keys():
        check_columns(connection, name, f"CREATE TABLE {_FIXED[name]}")
    return names


def check_columns(connection: sqlite3.Connection, table: str, sql: str) -> None:
    """Refuse a table whose columns are not those that a statement would make.

    Names, types, constraints, default values and whether they are computed must be the same.

    Args:
        connection: to the file.
        table: its name.
        sql: the statement that the store makes it by.

    Raises:
        InputError: they are not.
    """
    with closing(sqlite3.connect(":memory:")) as model:
        model.execute(sql)
        if _columns(model, table) != _columns(connection, table):
            raise InputError(f"the columns are not the run's (table {table})")


def _columns(connection: sqlite3.Connection, table: str) -> list[tuple[object, ...]]:
    return connection.execute(f"PRAGMA table_xinfo({table})").fetchall()
