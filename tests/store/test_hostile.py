"""A run's file may be anybody's: whatever it holds is read, or is one StorageError."""

import json
import resource
import sqlite3
from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import StorageError
from bridgegen.results.store import Checkpoint, Store

ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n) "


def make(folder):
    with Store.create(folder, {"seed": 1}, ["a", "b"], ["m"], n_var=2, n_obj=1) as store:
        result = SimpleNamespace(
            messages={1: "no route"},
            findings=None,
            metrics=np.zeros((3, 1)),
            F=np.zeros((3, 1)),
            critical=np.zeros(3, bool),
            status=np.array([0, 7, 0]),
            cause=np.zeros(3, int),
        )
        store.append(np.full((3, 2), 0.5), np.ones((3, 2)), result, 1.0)
        store.save(Checkpoint(3, 0, b"state"))
    return folder


def change(folder, script):
    with closing(sqlite3.connect(folder / "run.sqlite")) as db:
        db.executescript(script)


def read_all(folder, write):
    """Do what the commands do with a run; a resumed one is written, too."""
    with Store.open(folder, write=write) as store:
        rows = store.read()
        found = (len(store), store.n_batches, store.seconds, store.failures(), store.checkpoint())
        if write:
            result = SimpleNamespace(
                messages={0: "x"}, cause=None, findings=None,
                metrics=np.zeros((1, 1)), F=np.zeros((1, 1)),
                critical=np.zeros(1, bool), status=np.zeros(1, int),
            )  # fmt: skip
            store.append(np.zeros((1, 2)), np.zeros((1, 2)), result, 2.0)
            store.keep_notes({"a": 1})
            store.finish("budget")
        return rows, found, store.frame()


def instead(table, columns, select):
    """A view in the place of a table."""
    return f"DROP TABLE {table}; CREATE VIEW {table}({columns}) AS {ENDLESS} {select} FROM n;"


EVALUATIONS = "id, batch, seconds, u, a, b, m, f0, status, critical, cause"
TRIGGER = f"BEGIN INSERT INTO failures {ENDLESS} SELECT i + 9, 'x' FROM n; END;"
BIG = 10**9


def value(key, text):
    return f"UPDATE run SET value = '{text}' WHERE key = '{key}';"


def written_schema(old, new):
    """Change the text of the schema itself."""
    return (
        f"PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = replace(sql, '{old}', "
        f"'{new}'); PRAGMA writable_schema = RESET;"
    )


HOSTILE = {
    "a view for run": instead("run", "key, value", "SELECT i, i"),
    "a view for evaluations": instead(
        "evaluations", EVALUATIONS, "SELECT i, 0, 0.0, x'00', 0, 0, 0, 0, 0, 0, NULL"
    ),
    "a view for failures": instead("failures", "id, message", "SELECT i, 'x'"),
    "a view for checkpoint": instead(
        "checkpoint", "evaluations, idle, digest, state", "SELECT i, i, i, zeroblob(1000000)"
    ),
    "a trigger": f"CREATE TRIGGER t AFTER INSERT ON evaluations {TRIGGER}",
    "a trigger on run": f"CREATE TRIGGER t AFTER INSERT ON run {TRIGGER}",
    "a virtual table": "DROP TABLE failures; CREATE VIRTUAL TABLE failures USING fts5(id, message)",
    "a computed column": "DROP TABLE failures; CREATE TABLE failures (id INTEGER PRIMARY KEY, "
    "message TEXT NOT NULL AS (hex(zeroblob(400000000))))",
    "a default value": written_schema(
        '"u" BLOB NOT NULL', '"u" BLOB NOT NULL DEFAULT (zeroblob(9))'
    ),
    "another type of a column": written_schema('"status" INTEGER', '"status" BLOB'),
    "a missing table": "DROP TABLE evaluations;",
    "a missing column": "ALTER TABLE evaluations DROP COLUMN m;",
    "n_obj of 10**9": value("n_obj", BIG),
    "n_obj of -1": value("n_obj", -1),
    "n_obj true": value("n_obj", "true"),
    "n_obj 1.0": value("n_obj", "1.0"),
    "n_obj 1e999": value("n_obj", "1e999"),
    "n_obj a text": value("n_obj", '"1"'),
    "n_var of 10**9": value("n_var", BIG),
    "n_var of 3": value("n_var", 3),
    "n_var of -2": value("n_var", -2),
    "n_var 1e300": value("n_var", "1e300"),
    "schema true": value("schema", "true"),
    "schema a list": value("schema", "[]"),
    "schema 1e999": value("schema", "1e999"),
    "settings a list": value("settings", "[]"),
    "settings 1e999": value("settings", '{"seed": 1e999}'),
    "settings NaN": value("settings", '{"seed": NaN}'),
    "settings of many digits": value("settings", '{"seed": ' + "9" * 400 + "}"),
    "a lone surrogate": value("settings", r'{"seed": "\ud800"}'),
    "deep settings": value("settings", '{"a": ' + "[" * 10**5 + "]" * 10**5 + "}"),
    "parameters a text": value("parameters", '"ab"'),
    "parameters numbers": value("parameters", "[1, 2]"),
    "metrics an object": value("metrics", '{"m": 1}'),
    "version null": value("version", "null"),
    "a value in bytes": "UPDATE run SET value = x'ff00' WHERE key = 'settings';",
    "notes a list": "INSERT INTO run VALUES ('notes', '[]');",
    "finished a list": "INSERT INTO run VALUES ('finished', '[]');",
    "an id of 2**62": f"UPDATE evaluations SET id = {2**62} WHERE id = 2;",
    "the greatest id": f"UPDATE evaluations SET id = {2**63 - 1} WHERE id = 2;",
    "an id of 10**9": f"UPDATE evaluations SET id = {BIG} WHERE id = 2;",
    "a negative id": "UPDATE evaluations SET id = -5 WHERE id = 0;",
    "only a negative id": "DELETE FROM evaluations WHERE id > 0; UPDATE evaluations SET id = -5;",
    "text in u": "UPDATE evaluations SET u = '0123456789abcdef';",
    "u of another length": "UPDATE evaluations SET u = zeroblob(8 + 16 * (id > 1) - 8 * (id = 1));",
    "u not finite": "UPDATE evaluations SET u = x'000000000000f07f000000000000f07f';",
    "text in a": "UPDATE evaluations SET a = 'text' WHERE id = 1;",
    "text in batch": "UPDATE evaluations SET batch = 'text';",
    "text in seconds": "UPDATE evaluations SET seconds = 'text';",
    "text in status": "UPDATE evaluations SET status = 'text';",
    "status 1e300": "UPDATE evaluations SET status = 1e300;",
    "status 1e999": "UPDATE evaluations SET status = 1e999;",
    "critical a text": "UPDATE evaluations SET critical = 'no';",
    "an unknown cause": "UPDATE evaluations SET cause = 'witchcraft';",
    "cause in bytes": "UPDATE evaluations SET cause = x'00';",
    "a conflict in bytes": "UPDATE evaluations SET conflict = x'00';",
    "a message in bytes": "UPDATE failures SET message = x'00ff';",
    "a saved state ahead": "UPDATE checkpoint SET evaluations = 10;",
    "a saved state of another kind": "UPDATE checkpoint SET state = 'text';",
    "a saved state's negative count": "UPDATE checkpoint SET evaluations = -1, idle = -1;",
}


@pytest.mark.parametrize("write", [False, True], ids=["read", "resumed"])
@pytest.mark.parametrize("script", HOSTILE.values(), ids=HOSTILE)
def test_it_is_one_error(script, write, tmp_path):
    folder = make(tmp_path / "run")
    change(folder, script)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with refuses(StorageError) as e:
        read_all(folder, write)
    assert "\n" not in str(e.value)
    assert str(folder / "run.sqlite") in str(e.value)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 200_000  # KiB


def test_a_schema_that_changes_after_the_file_was_opened(tmp_path):
    """The tables are looked at once, the statements at each time."""
    folder = make(tmp_path / "run")
    with Store.open(folder) as store:
        change(folder, HOSTILE["a view for failures"])
        with refuses(StorageError):
            store.failures()


def test_an_owner_may_add_indices_tables_and_views(tmp_path):
    """It is a file that anybody may query; only what the store reads and writes must be its own."""
    folder = make(tmp_path / "run")
    want = read_all(make(tmp_path / "same"), write=True)
    change(
        folder,
        "CREATE INDEX by_a ON evaluations (a); CREATE TABLE mine (x); CREATE VIEW best AS "
        "SELECT * FROM evaluations ORDER BY m;",
    )
    have = read_all(folder, write=True)
    assert have[1] == want[1]
    assert have[0].digest() == want[0].digest()


def test_what_is_whole_is_read_after_it_was_written_out_and_in_again(tmp_path):
    """`sqlite3 run.sqlite .dump` and back."""
    folder = make(tmp_path / "run")
    with closing(sqlite3.connect(folder / "run.sqlite")) as db:
        text = "\n".join(db.iterdump())
    (folder / "run.sqlite").unlink()
    change(folder, text)
    with Store.open(folder) as store:
        assert len(store.read()) == 3
        assert json.loads(json.dumps(store.settings)) == {"seed": 1}
