"""What can be wrong with a run's folder, its file, its disk."""

import os
import shutil
import sqlite3
import subprocess
import sys
import textwrap
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import StorageError
from bridgegen.results.store import Recorded, Store, sqlite

HEAD = """
import os, sys
from types import SimpleNamespace
import numpy as np
from bridgegen.base.errors import StorageError
from bridgegen.results.store import Recorded, Store

def append(store, n=40, n_x=50):
    result = SimpleNamespace(messages={}, cause=None, findings=None,
                             metrics=np.zeros((n, 1)), F=np.zeros((n, 1)),
                             critical=np.zeros(n, bool), status=np.zeros(n, int))
    store.append(np.full((n, 2), 0.1), np.random.random((n, n_x)), result, 0.0)

def create(folder, n_x=50):
    return Store.create(folder, {}, [f"p{i}" for i in range(n_x)], ["m"], n_var=2, n_obj=1)
"""


def child(code, *args, prefix=()):
    """Run code in another process; return what it prints."""
    done = subprocess.run(
        [*prefix, sys.executable, "-W", "error", "-c", HEAD + textwrap.dedent(code),
         *map(str, args)],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def create(folder):
    return Store.create(folder, {"seed": 1}, ["a"], ["m"], n_var=1, n_obj=1)


def append(store, n=3):
    result = SimpleNamespace(
        messages={},
        cause=None,
        findings=None,
        metrics=np.zeros((n, 1)),
        F=np.zeros((n, 1)),
        critical=np.zeros(n, bool),
        status=np.zeros(n),
    )
    store.append(np.zeros((n, 1)), np.zeros((n, 1)), result, 0.0)


# ---------------------------------------------------------------------- create


def test_a_run_is_never_overwritten(tmp_path):
    with create(tmp_path / "run") as store:
        append(store)
    before = (tmp_path / "run" / "run.sqlite").read_bytes()
    with refuses(StorageError, "--out"):
        create(tmp_path / "run")
    assert (tmp_path / "run" / "run.sqlite").read_bytes() == before


def test_nor_is_anything_else(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    with refuses(StorageError, "--out"):
        create(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(StorageError, match="File exists"):
        create(tmp_path / "thesis.tex")


def test_an_empty_folder_and_missing_parents_will_do(tmp_path):
    (tmp_path / "empty").mkdir()
    create(tmp_path / "empty").close()
    create(tmp_path / "a" / "b" / "ünï cødé?#%20").close()
    assert Store.open(tmp_path / "a" / "b" / "ünï cødé?#%20").settings == {"seed": 1}


def test_settings_must_be_json(tmp_path):
    with refuses(ValueError):
        Store.create(tmp_path / "run", {"w": float("nan")}, ["a"], ["m"], n_var=1, n_obj=1)
    create(tmp_path / "run").close()  # nothing is left that stands in the way


def test_killed_while_it_is_made(tmp_path):
    """Neither half a run nor an obstacle is left."""
    code = """
        from bridgegen.results.store import run_file
        run_file.os.replace = lambda *_: os.kill(os.getpid(), 9)
        create(sys.argv[1])
    """
    with pytest.raises(AssertionError):
        child(code, tmp_path / "run")
    assert (tmp_path / "run" / "run.sqlite.new").exists()
    with refuses(StorageError):
        Store.open(tmp_path / "run")
    create(tmp_path / "run").close()
    assert len(Store.open(tmp_path / "run")) == 0


# ---------------------------------------------------------------------- open


def test_not_a_run(tmp_path):
    with refuses(StorageError):
        Store.open(tmp_path / "nowhere")
    with refuses(StorageError, "run.sqlite"):
        Store.open(tmp_path)
    with refuses(StorageError, "run.sqlite"):
        Store.open(tmp_path, write=True)
    assert list(tmp_path.iterdir()) == []


def test_another_database(tmp_path):
    with sqlite3.connect(tmp_path / "run.sqlite") as db:
        db.execute("CREATE TABLE friends (name)")
    db.close()
    with refuses(StorageError):
        Store.open(tmp_path)


def change(folder, sql, *values):
    db = sqlite3.connect(folder / "run.sqlite")
    with db:
        db.execute(sql, values)
    db.close()


@pytest.mark.parametrize(
    ("sql", "values", "message"),
    [
        ("UPDATE run SET value = ? WHERE key = 'schema'", ["5"], "schema"),
        ("DELETE FROM run WHERE key = 'schema'", [], "schema"),
        ("DELETE FROM run WHERE key = 'settings'", [], "settings"),
        ("UPDATE run SET value = '{' WHERE key = 'settings'", [], "damaged"),
        ("UPDATE run SET value = '7' WHERE key = 'metrics'", [], "damaged"),
        ("UPDATE run SET value = '3' WHERE key = 'n_obj'", [], "columns"),
        ("ALTER TABLE evaluations DROP COLUMN a", [], "columns"),
    ],
)
def test_a_damaged_run(sql, values, message, tmp_path):
    with create(tmp_path / "run") as store:
        append(store)
    change(tmp_path / "run", sql, *values)
    for write in (False, True):
        with refuses(StorageError, message):
            Store.open(tmp_path / "run", write=write)


@pytest.mark.parametrize(
    ("sql", "message"),
    [
        ("DELETE FROM evaluations WHERE id = 1", "evaluations between 0 and 2 are missing"),
        ("UPDATE evaluations SET a = 'text' WHERE id = 1", "could not convert string"),
        ("UPDATE evaluations SET a = NULL WHERE id = 1", "damaged: a parameter is not finite"),
        ("UPDATE evaluations SET a = 9e999 WHERE id = 1", "damaged: a parameter is not finite"),
        ("UPDATE evaluations SET u = x'00' WHERE id = 1", "damaged"),
        ("UPDATE evaluations SET u = 'text' WHERE id = 1", "damaged"),
    ],
)
def test_damaged_evaluations(sql, message, tmp_path):
    with create(tmp_path / "run") as store:
        append(store)
    change(tmp_path / "run", sql)
    with Store.open(tmp_path / "run") as store, pytest.raises(StorageError, match=message):
        store.read()
    if "SET a" in sql:  # the column alone, too
        with Store.open(tmp_path / "run") as store, pytest.raises(StorageError, match=message):
            Recorded(store).X[:]


def test_a_damaged_file(tmp_path):
    with create(tmp_path / "run") as store:
        append(store, 2000)
    file = tmp_path / "run" / "run.sqlite"
    whole = file.read_bytes()
    file.write_bytes(b"this is not a database, not at all" * 100)
    with refuses(StorageError):
        Store.open(tmp_path / "run")
    file.write_bytes(whole[:4096] + b"\xff" * 4096 + whole[8192:])
    with refuses(StorageError):
        Store.open(tmp_path / "run").read()
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(StorageError, match="damaged"):
        Store.open(tmp_path / "run").read()


# ---------------------------------------------------------------------- the lock


def test_a_writer_waits_for_one_that_is_about_to_end(tmp_path):
    code = "import time; create(sys.argv[1]); print(flush=True); time.sleep(0.5); os._exit(9)"
    words = [sys.executable, "-c", HEAD + code, str(tmp_path / "run")]
    with subprocess.Popen(words, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline()  # it holds the lock
        with Store.open(tmp_path / "run", write=True) as again:
            assert len(again) == 0


def test_two_writers(tmp_path, monkeypatch):
    monkeypatch.setattr(sqlite, "LOCK_SECONDS", 0.0)
    with create(tmp_path / "run") as store:
        append(store)
        with refuses(StorageError):
            Store.open(tmp_path / "run", write=True)
        said = child(
            """
            from bridgegen.results.store import sqlite
            sqlite.LOCK_SECONDS = 0.0
            try:
                Store.open(sys.argv[1], write=True)
            except StorageError as error:
                print(error)
            print(len(Store.open(sys.argv[1])))
            """,
            tmp_path / "run",
        )
        approve(said, "process")
        assert said.endswith("3")  # reading is allowed meanwhile
        append(store)
    with Store.open(tmp_path / "run", write=True) as store:
        assert len(store) == 6


def test_the_lock_dies_with_its_process(tmp_path):
    code = """
        store = create(sys.argv[1])
        append(store)
        append(store)
        os.kill(os.getpid(), 9)
    """
    with pytest.raises(AssertionError):
        child(code, tmp_path / "run")
    assert (tmp_path / "run" / "run.sqlite-wal").stat().st_size > 0
    with Store.open(tmp_path / "run", write=True) as store:
        assert len(store) == 80


def test_a_reader_sees_whole_batches_while_another_writes(tmp_path):
    with create(tmp_path / "run") as writer, Store.open(tmp_path / "run") as reader:
        for k in range(1, 4):
            append(writer)
            assert len(reader) == 3 * k
    with Store.open(tmp_path / "run") as reader:
        assert len(reader) == 9


# ---------------------------------------------------------------------- disks


GO_ON = """
    store = create(sys.argv[1])
    limit(store)
    n = 0
    try:
        while n < 100_000:
            append(store)
            n += 40
    except StorageError as error:
        assert len(store) == n
        store.close()
        print(n, error)
"""


def check_full(folder, said, cause):
    n, message = int(said.split()[0]), said.split(maxsplit=1)[1]
    assert n > 0
    assert cause in message
    approve(message, n, folder)
    with Store.open(folder, write=True) as store:  # there is room again
        assert len(store) == n
        assert store.read().batch[-1] == n // 40 - 1
        result = SimpleNamespace(
            messages={},
            cause=None,
            findings=None,
            metrics=np.zeros((2, 1)),
            F=np.zeros((2, 1)),
            critical=np.zeros(2),
            status=np.zeros(2),
        )
        store.append(np.zeros((2, 2)), np.zeros((2, 50)), result, 0.0)
        assert len(store) == n + 2


def test_full_disk(tmp_path):
    """SQLite's own limit on the file: the same error as a full disk's."""
    limit = "limit = lambda s: s._connection.execute('PRAGMA max_page_count = 100')\n"
    said = child(limit + textwrap.dedent(GO_ON), tmp_path / "run")
    check_full(tmp_path / "run", said, "cannot be written: the disk is full")


def test_file_size_limit(tmp_path):
    """The system refuses the write, in the middle of a batch."""
    limit = (
        "import resource\n"
        "most = (300_000, resource.RLIM_INFINITY)\n"
        "limit = lambda s: resource.setrlimit(resource.RLIMIT_FSIZE, most)\n"
    )
    said = child(limit + textwrap.dedent(GO_ON), tmp_path / "run")
    check_full(tmp_path / "run", said, "cannot be written: reading or writing failed")


def test_no_room_to_begin(tmp_path):
    said = child(
        """
        import resource
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, resource.RLIM_INFINITY))
        try:
            create(sys.argv[1])
        except StorageError as error:
            print(error)
        """,
        tmp_path / "run",
    )
    approve(said, "nothing")
    create(tmp_path / "run").close()


@pytest.fixture
def mortal():
    """The prefix of a command that makes permissions count, for root too."""
    if os.geteuid() != 0:
        return []
    if not shutil.which("setpriv"):
        pytest.skip("root ignores permissions, and there is no setpriv to give that up")
    return ["setpriv", "--bounding-set=-dac_override,-dac_read_search"]


def test_no_permission_to_create(tmp_path, mortal):
    os.chmod(tmp_path, 0o555)
    code = """
        try:
            create(sys.argv[1])
        except StorageError as error:
            print(error)
    """
    approve(child(code, tmp_path / "run", prefix=mortal), "Permission")
    os.chmod(tmp_path, 0o755)
    assert list(tmp_path.iterdir()) == []


def test_read_only_run(tmp_path, mortal):
    """It can be read, not written; nothing is made beside it."""
    with create(tmp_path / "run") as store:
        append(store)
    for path in (*(tmp_path / "run").iterdir(), tmp_path / "run"):
        os.chmod(path, 0o555 if path.is_dir() else 0o444)
    code = """
        store = Store.open(sys.argv[1])
        print(len(store), len(store.frame()), len(store.read()))
        try:
            Store.open(sys.argv[1], write=True)
        except StorageError as error:
            print(error)
    """
    said = child(code, tmp_path / "run", prefix=mortal).splitlines()
    os.chmod(tmp_path / "run", 0o755)
    assert said[0] == "3 3 3"
    assert "cannot be written" in said[1]
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == ["run.lock", "run.sqlite"]


def test_unreadable_folder(tmp_path, mortal):
    create(tmp_path / "run").close()
    os.chmod(tmp_path / "run", 0o000)
    code = """
        for attempt in (Store.open, create):
            try:
                attempt(sys.argv[1])
            except StorageError as error:
                print(error)
    """
    said = child(code, tmp_path / "run", prefix=mortal)
    os.chmod(tmp_path / "run", 0o755)
    assert said.count("Permission denied") == 2


def test_the_settings_are_kept_as_json(tmp_path):
    settings = {"yaml": "name: x\n", "weights": [0.8297, 0.1703], "map": None, "ä": "🚗"}
    with Store.create(tmp_path / "run", settings, ["a"], ["m"], n_var=1, n_obj=1):
        pass
    with Store.open(tmp_path / "run") as store:
        assert store.settings == settings
        assert store.version == version("bridgegen")
