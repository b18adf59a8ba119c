"""The file of a run and its folder: made, claimed, checked."""

import json
import os
import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from bridgegen.base.errors import InputError, StorageError
from bridgegen.base.records import parse_json
from bridgegen.results.store.rows import (
    FIRST,
    LAST_OF_SCHEMA,
    NEEDED,
    RUN,
    Columns,
    check_columns,
    tables_of,
)
from bridgegen.results.store.sqlite import storage_errors, transaction

SCHEMA = 4
READABLE = tuple(LAST_OF_SCHEMA)
"""The schemas that can be read and resumed."""

FILE = "run.sqlite"
LOCK = "run.lock"
DRAFT = "run.sqlite.new"
MAX_N_VAR = 10**5
KEYS = ("schema", "version", "settings", "parameters", "metrics", "n_var", "n_obj")


def refuse_other_names(folder: Path) -> None:
    """Reject a folder whose path cannot be written in settings, pages or ontologies.

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
    """Check that the file of a run is still in its folder.

    Raises:
        StorageError: it was deleted or moved.
    """
    if not (folder / FILE).is_file():
        raise StorageError(
            f"{folder}: {FILE} was deleted or moved during the run; if it was deleted, "
            "its evaluations are lost"
        )


def refuse_used(folder: Path) -> None:
    """Check that a new run in a folder would not overwrite anything.

    Raises:
        StorageError: the folder contains a run, or files that are not left over from one; or its
            path is not valid UTF-8.
    """
    refuse_other_names(folder)
    # What a run leaves that was killed before its file was there; nothing of a user's is named so.
    ours = {LOCK, DRAFT, f"{DRAFT}-journal"}
    with storage_errors(folder, "read"):
        if (folder / FILE).exists():
            raise StorageError(
                f"{folder}: contains a run already, which is never overwritten; "
                f"resume it: bridgegen resume {folder}, or choose another --out"
            )
        if folder.is_dir() and any(path.name not in ours for path in folder.iterdir()):
            raise StorageError(
                f"{folder}: is not empty and contains no run, so it is not used; "
                "choose another --out"
            )


def write_run(folder: Path, columns: Columns, run: Mapping[str, Any]) -> None:
    """Create the run's file atomically."""
    keys = [key for key in (*KEYS, "labels", "domain") if key in run]
    # JSON and no pickle: a run's folder may come from others, and nothing in it is ever executed.
    values = [(key, json.dumps(run[key], allow_nan=False)) for key in keys]
    draft = folder / DRAFT
    draft.unlink(missing_ok=True)
    try:
        connect = sqlite3.connect(draft, isolation_level=None)
        with closing(connect) as connection, transaction(connection):
            connection.execute(f"CREATE TABLE {RUN}")
            connection.execute(columns.create_sql())
            connection.executemany("INSERT INTO run VALUES (?, ?)", values)
        # A run's file is there whole or not at all: a killed `create` leaves a draft, which the
        # next one removes.
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
    """Return the values of :func:`write_run`, and ``finished`` if the run has ended.

    Raises:
        StorageError: not a run, damaged, or of another schema.
    """
    try:
        with storage_errors(path, "read"):
            if missing := {*NEEDED} - tables_of(connection):
                names = ", ".join(sorted(missing))
                raise StorageError(f"{path}: is not a run: its tables are missing ({names})")
            stored = connection.execute("SELECT key, value FROM run").fetchall()
            found = connection.execute("PRAGMA table_xinfo(evaluations)").fetchall()
        run = {key: _value(key, text) for key, text in stored}
        schema = run["schema"]
        # Before the values are looked at: what a later version writes need not look like ours.
        if type(schema) is not int or schema not in READABLE:
            raise StorageError(
                f"{path}: the store's schema must be at most {SCHEMA}, got {schema!r}: "
                f"it was made by BridgeGen {run.get('version', '(unknown)')}"
            )
        if absent := [key for key in KEYS if key not in run]:
            raise InputError(f"no {', '.join(absent)}")
        _check_values(run, len(found))
        with storage_errors(path, "read"):
            check_columns(connection, "evaluations", columns_of(run).create_sql())
            _check_rows(connection, run["n_var"], len(found))
    except InputError as error:
        raise StorageError(f"{path}: the file is damaged: {'; '.join(error.problems)}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise StorageError(f"{path}: the file is damaged: bad or missing {error}") from error
    return run


def _value(key: str, text: str) -> Any:
    """Return a value that is stored as JSON.

    Raises:
        InputError: it is not JSON of finite numbers.
    """
    try:
        return parse_json(text)
    except (TypeError, ValueError) as error:
        raise InputError(f"bad or missing {key}: {error}") from error


def _check_values(run: Mapping[str, Any], n_columns: int) -> None:
    """Check the types of the values, and that the counts fit the table of evaluations.

    Raises:
        InputError: the first mistake.
    """
    kinds = {
        "version": str,
        "domain": str,
        "settings": dict,
        "notes": dict,
        "labels": dict,
        "n_var": int,
        "n_obj": int,
    }
    for key, kind in kinds.items():
        if key in run and type(run[key]) is not kind:
            raise InputError(f"bad or missing {key}: it is a {type(run[key]).__name__}")
    if not isinstance(run.get("finished", ""), str):
        raise InputError("bad or missing finished: it must be a text")
    for key in ("parameters", "metrics"):
        if type(run[key]) is not list or not all(isinstance(name, str) for name in run[key]):
            raise InputError(f"bad or missing {key}: it must be a list of names")
    for name, record in run.get("labels", {}).items():
        words = record.get("words", []) if isinstance(record, dict) else None
        if (
            name not in run["parameters"]
            or type(words) is not list
            or not all(isinstance(word, str) for word in words)
        ):
            raise InputError(f"bad or missing labels: {name} must be a parameter with its words")
    if not 0 <= run["n_var"] <= MAX_N_VAR:
        raise InputError(f"0 <= n_var <= {MAX_N_VAR} must hold, got {run['n_var']}")
    named = len(FIRST) + len(run["parameters"]) + len(run["metrics"])
    left = n_columns - named - len(LAST_OF_SCHEMA[run["schema"]])
    if run["n_obj"] != left:
        raise InputError(f"the columns are not the run's: n_obj is {run['n_obj']}, not {left}")


def _check_rows(connection: sqlite3.Connection, n_var: int, n_columns: int) -> None:
    """Check that the file has room for its evaluations: their number sizes arrays.

    Raises:
        InputError: a number is negative, or too large for the size of the file.
    """
    last, first = (
        connection.execute(f"SELECT {end}(id) FROM evaluations").fetchone()[0]
        for end in ("max", "min")
    )
    size = connection.execute("PRAGMA page_count").fetchone()[0]
    size *= connection.execute("PRAGMA page_size").fetchone()[0]
    # A hostile file may state the id 2⁶², for which we would allocate arrays: the least size of so
    # many rows, 8 bytes a parameter and one a column, must fit into the file.
    if first is not None and (first < 0 or (last + 1) * (8 * n_var + n_columns) > size):
        raise InputError(
            f"evaluations {first} to {last} cannot be in a file of {size} bytes: they must be "
            "numbered from 0"
        )
