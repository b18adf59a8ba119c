"""The file of a run: how it comes into being, and what must be in it."""

import json
import os
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from bridgegen.errors import StorageError
from bridgegen.store.rows import LAST_OF_SCHEMA, Columns
from bridgegen.store.sqlite import storage_errors, transaction

SCHEMA = 3
READABLE = tuple(LAST_OF_SCHEMA)
"""The schemas that can be read and resumed."""

FILE = "run.sqlite"
LOCK = "run.lock"
DRAFT = "run.sqlite.new"
KEYS = ("schema", "version", "settings", "parameters", "metrics", "n_var", "n_obj")


def refuse_other_names(folder: Path) -> None:
    """Refuse a folder whose path no settings, page or ontology could name.

    Raises:
        StorageError: its path is not valid UTF-8.
    """
    path = str(folder.absolute())
    try:
        path.encode()
    except UnicodeEncodeError:
        shown = path.encode("utf-8", "backslashreplace").decode()
        problem = "its path must be valid UTF-8; choose another folder"
        raise StorageError(f"{shown}: {problem}") from None


def require_there(folder: Path) -> None:
    """Refuse to go on with a run whose file is no longer in its folder.

    Raises:
        StorageError: it was deleted, or moved.
    """
    if not (folder / FILE).is_file():
        raise StorageError(
            f"{folder}: {FILE} was deleted or moved while the run was going on; if it was deleted, "
            "its evaluations are lost"
        )


def refuse_used(folder: Path) -> None:
    """Let a run begin only where nothing can be overwritten.

    Raises:
        StorageError: the folder holds a run, or anything else that no run left behind; or its path
            is not valid UTF-8.
    """
    refuse_other_names(folder)
    ours = {LOCK, DRAFT, f"{DRAFT}-journal"}
    with storage_errors(folder, "read"):
        if (folder / FILE).exists():
            raise StorageError(
                f"{folder}: holds a run already, which is never overwritten; "
                f"go on with it: bridgegen resume {folder}, or choose another --out"
            )
        if folder.is_dir() and any(path.name not in ours for path in folder.iterdir()):
            raise StorageError(
                f"{folder}: is not empty and holds no run, so it is left alone; "
                "choose another --out"
            )


def write_run(folder: Path, columns: Columns, run: Mapping[str, Any]) -> None:
    """Make the run's file: whole or not at all, whenever the process is killed."""
    values = [(key, json.dumps(run[key], allow_nan=False)) for key in KEYS]
    draft = folder / DRAFT
    draft.unlink(missing_ok=True)
    try:
        connect = sqlite3.connect(draft, isolation_level=None)
        with closing(connect) as connection, transaction(connection):
            connection.execute("CREATE TABLE run (key TEXT PRIMARY KEY, value TEXT NOT NULL)")
            connection.execute(columns.create_sql())
            connection.executemany("INSERT INTO run VALUES (?, ?)", values)
        os.replace(draft, folder / FILE)
    except BaseException:
        draft.unlink(missing_ok=True)
        raise


def columns_of(run: Mapping[str, Any]) -> Columns:
    """Return the columns of a run's table.

    Raises:
        InputError: a name that cannot be a column.
        KeyError: a key is missing.
    """
    names = (run["n_var"], run["parameters"], run["metrics"], run["n_obj"])
    return Columns.named(*names, schema=run["schema"])


def read_run(connection: sqlite3.Connection, path: Path) -> dict[str, Any]:
    """Return what :func:`write_run` was given, ``finished`` besides where the run has ended.

    Raises:
        StorageError: not a run, damaged, or of another schema.
    """
    with storage_errors(path, "read"):
        tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master")}
        if not {"run", "evaluations"} <= tables:
            raise StorageError(f"{path}: is not a run: its tables are missing")
        stored = connection.execute("SELECT key, value FROM run").fetchall()
        names = [row[1] for row in connection.execute("PRAGMA table_info(evaluations)")]
    try:
        run = {key: json.loads(value) for key, value in stored}
        schema = run["schema"]
        if schema not in READABLE:
            raise StorageError(
                f"{path}: the store's schema must be at most {SCHEMA}, got {schema!r}: "
                f"it was made by BridgeGen {run.get('version', '(unknown)')}"
            )
        columns = columns_of(run)
        missing = [key for key in KEYS if key not in run]
    except (KeyError, TypeError, ValueError) as error:
        raise StorageError(f"{path}: the file is damaged: bad or missing {error}") from error
    if missing or names != list(columns.all):
        what = f"no {', '.join(missing)}" if missing else "the columns are not the run's"
        raise StorageError(f"{path}: the file is damaged: {what}")
    return run
