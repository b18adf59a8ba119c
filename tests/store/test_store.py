import sqlite3
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from tests.approval import refuses

from bridgegen.assess.conflict.findings import COLUMNS, Findings
from bridgegen.base.errors import InputError, StorageError
from bridgegen.results.store import Recorded, Store
from bridgegen.results.store.rows import Columns, quoted

PARAMETERS, METRICS = ["ego_speed", "fog_density"], ["d_min", "v_d", "ttc"]
SETTINGS = {"scenario": "crossroads-s4", "seed": 0, "algorithm": {"name": "pso", "w": 0.8}}


def batch(n, seed=0, n_var=3):
    rng = np.random.default_rng(seed)
    result = SimpleNamespace(
        messages={},
        cause=None,
        findings=None,
        metrics=rng.normal(size=(n, 3)),
        F=rng.normal(size=(n, 2)),
        critical=rng.random(n) < 0.5,
        status=(rng.random(n) < 0.2).astype(np.int8),
    )
    return rng.random((n, n_var)), rng.normal(size=(n, 2)), result


def create(folder, **changes):
    given = {"parameters": PARAMETERS, "metrics": METRICS, "n_var": 3, "n_obj": 2} | changes
    return Store.create(folder, SETTINGS, **given)


def filled(folder, *sizes):
    store = create(folder)
    for k, n in enumerate(sizes):
        store.append(*batch(n, seed=k), seconds=0.5 * (k + 1))
    return store


def test_what_is_recorded_is_read_back(tmp_path):
    with filled(tmp_path / "run", 40, 7) as store:
        assert len(store) == 47
        assert store.n_batches == 2
        assert store.seconds == 1.0
    with Store.open(tmp_path / "run") as store:
        assert store.settings == SETTINGS
        assert store.parameters == tuple(PARAMETERS)
        assert store.metrics == tuple(METRICS)
        assert (store.n_obj, store.columns.n_var) == (2, 3)
        rows = store.read()
    assert rows.id.tolist() == list(range(47))
    assert rows.batch.tolist() == [0] * 40 + [1] * 7
    assert rows.seconds.tolist() == [0.5] * 40 + [1.0] * 7
    for k, part in enumerate((slice(0, 40), slice(40, 47))):
        U, X, result = batch(len(rows.id[part]), seed=k)
        for name, want in (("U", U), ("X", X), ("metrics", result.metrics), ("F", result.F)):
            assert getattr(rows, name)[part].tobytes() == want.tobytes()
        assert rows.status[part].tolist() == result.status.tolist()
        assert rows.critical[part].tolist() == result.critical.tolist()


numbers = hnp.arrays(np.float64, (3, 2), elements=st.floats(width=64))
finite = hnp.arrays(np.float64, (3, 2), elements=st.floats(allow_nan=False, allow_infinity=False))


@given(X=finite, M=numbers, F=numbers, U=hnp.arrays(np.float64, (3, 3), elements=st.floats(0, 1)))
@settings(max_examples=40)
def test_every_float_comes_back_bit_for_bit(X, M, F, U, tmp_path_factory):
    result = SimpleNamespace(
        messages={},
        cause=None,
        findings=None,
        metrics=np.hstack([M, F[:, :1]]),
        F=F,
        critical=np.zeros(3, bool),
        status=np.zeros(3, int),
    )
    with create(tmp_path_factory.mktemp("s") / "run") as store:
        store.append(U, X, result, 0.0)
        rows = store.read()
    assert rows.U.tobytes() == U.tobytes()
    for have, want in ((rows.X, X), (rows.metrics, result.metrics), (rows.F, F)):
        nan = np.isnan(want)
        assert (np.isnan(have) == nan).all()
        # + 0.0: the sign of zero is the one thing that SQLite does not keep.
        assert have[~nan].tobytes() == (want[~nan] + 0.0).tobytes()


def test_people_can_query_it(tmp_path):
    """With nothing but SQLite."""
    U, X, result = batch(30)
    result.metrics[4, 0], result.metrics[5, 0] = np.nan, np.inf
    with create(tmp_path / "run") as store:
        store.append(U, X, result, 2.0)
    db = sqlite3.connect(tmp_path / "run" / "run.sqlite")
    names = [row[1] for row in db.execute("PRAGMA table_info(evaluations)")]
    assert names == [
        "id", "batch", "seconds", "u", "ego_speed", "fog_density", "d_min", "v_d", "ttc",
        "f0", "f1", "status", "critical", "cause", *COLUMNS,
    ]  # fmt: skip
    (n,) = db.execute("SELECT count(*) FROM evaluations WHERE critical AND d_min < 0").fetchone()
    assert n == np.count_nonzero(result.critical & (result.metrics[:, 0] < 0))
    assert db.execute("SELECT id FROM evaluations WHERE d_min IS NULL").fetchall() == [(4,)]
    assert db.execute("SELECT d_min FROM evaluations WHERE id = 5").fetchone() == (np.inf,)
    (u,) = db.execute("SELECT u FROM evaluations WHERE id = 7").fetchone()
    assert u == U[7].astype("<f8").tobytes()
    keys = {key for (key,) in db.execute("SELECT key FROM run")}
    assert keys == {"schema", "version", "settings", "parameters", "metrics", "n_var", "n_obj"}
    db.close()


def test_rows_stream_in_chunks(tmp_path):
    with filled(tmp_path / "run", 40, 40, 40) as store:
        parts = list(store.rows(5, 100, chunk=30))
        assert [len(p) for p in parts] == [30, 30, 30, 5]
        assert np.concatenate([p.id for p in parts]).tolist() == list(range(5, 100))
        assert [len(p) for p in store.rows(chunk=100)] == [100, 20]
        assert list(store.rows(120)) == []
        store.append(*batch(1), seconds=9.0)  # a reader in progress is no obstacle
        assert len(store.read(118, 500)) == 3


@pytest.mark.parametrize("n", [4095, 4096, 4097, 8193])
def test_the_last_evaluation_is_read_whatever_their_number(n, tmp_path):
    """Long runs are read some thousands at a time: one more than such a part is one more row."""
    with filled(tmp_path / "run", n) as store:
        assert store.read().id.tolist() == list(range(n))
        assert store.read(1).id.tolist() == list(range(1, n))
        assert [part.id[-1] for part in store.rows()][-1] == n - 1
        assert store.frame().index.tolist() == list(range(n))
        for chunk in (n - 1, n, n + 1):
            assert sum(len(part) for part in store.rows(chunk=chunk)) == n


def test_causes_are_recorded_by_name_and_read_back(tmp_path):
    U, X, result = batch(30)
    result.cause = np.arange(30) % 5
    with create(tmp_path / "run") as store:
        store.append(U, X, result, 1.0)
        del result.cause
        store.append(*batch(3, seed=1), seconds=2.0)  # nobody sought any
    with Store.open(tmp_path / "run") as store:
        rows, frame = store.read(), store.frame()
    assert rows.cause.tolist() == [*(k % 5 for k in range(30)), 0, 0, 0]
    names = ["", "perception", "planning", "control", "unavoidable"]
    found = frame["cause"].where(frame["cause"].notna(), "").tolist()
    assert found == [*(names[k % 5] for k in range(30)), "", "", ""]
    db = sqlite3.connect(tmp_path / "run" / "run.sqlite")
    query = "SELECT cause, count(*) FROM evaluations WHERE cause NOT NULL GROUP BY cause"
    assert dict(db.execute(query)) == {name: 6 for name in names if name}
    db.close()


def test_a_run_of_the_first_schema_has_no_causes_and_goes_on(tmp_path):
    with create(tmp_path / "run", parameters=["cause", "b"]) as store:
        store.append(*batch(4), seconds=1.0)
    db = sqlite3.connect(tmp_path / "run" / "run.sqlite")
    for name in ("cause", *COLUMNS):
        db.execute(f"ALTER TABLE evaluations DROP COLUMN {name}")
    db.execute("ALTER TABLE evaluations RENAME COLUMN cause_parameter TO cause")
    db.execute("UPDATE run SET value = '1' WHERE key = 'schema'")
    db.commit()
    db.close()
    with Store.open(tmp_path / "run", write=True) as store:
        U, X, result = batch(2, seed=1)
        result.cause = np.array([1, 2])
        store.append(U, X, result, 2.0)
        rows = store.read()
        assert rows.cause.tolist() == [0] * 6
        assert (rows.X[4:] == X).all()
        assert "cause" in store.frame()  # the parameter
        assert store.frame()["cause"].dtype == float


def test_a_run_of_the_second_schema_has_no_findings_and_is_resumed(tmp_path):
    with create(tmp_path / "run") as store:
        store.append(*batch(4), seconds=1.0)
    db = sqlite3.connect(tmp_path / "run" / "run.sqlite")
    for name in COLUMNS:
        db.execute(f"ALTER TABLE evaluations DROP COLUMN {name}")
    db.execute("UPDATE run SET value = '2' WHERE key = 'schema'")
    db.commit()
    db.close()
    with Store.open(tmp_path / "run", write=True) as store:
        store.append(*batch(2, seed=1), seconds=2.0)
        assert set(store.read().findings.conflict.tolist()) == {""}
        assert not {*COLUMNS} & {*store.frame()}


def test_a_run_of_the_third_schema_keeps_its_digest_and_is_resumed(tmp_path):
    """What happened is not part of the digest, which the records beside a run repeat."""
    with create(tmp_path / "run") as store:
        U, X, result = batch(4)
        result.findings = replace(Findings.none(4), happened=np.array(["{}"] * 4, dtype=object))
        store.append(U, X, result, 1.0)
        digest = store.read().digest()
    db = sqlite3.connect(tmp_path / "run" / "run.sqlite")
    db.execute("ALTER TABLE evaluations DROP COLUMN happened")
    db.execute("UPDATE run SET value = '3' WHERE key = 'schema'")
    db.commit()
    db.close()
    with Store.open(tmp_path / "run", write=True) as store:
        assert store.read().digest() == digest
        assert Recorded(store).digest() == digest
        store.append(*batch(2, seed=1), seconds=2.0)
        assert store.read().findings.happened.tolist() == [""] * 6


def test_findings_come_back_and_are_part_of_the_digest(tmp_path):
    U, X, result = batch(3)
    texts = [
        ["near miss", "", "contact"],
        ["crossing", "", "head-on"],
        ["ego", "", "other"],
        ["signs", "", "left its lane"],
        ["bv", "", "bv"],
        ["", "others collide", ""],
        ['{"began":{}}', "", ""],
    ]
    result.findings = Findings(*(np.array(one, dtype=object) for one in texts))
    with create(tmp_path / "run") as store:
        store.append(U, X, result, 1.0)
        rows, frame = store.read(), store.frame()
    assert [one.tolist() for one in rows.findings.columns().values()] == texts
    assert frame["responsible"].fillna("").tolist() == ["ego", "", "other"]
    changed = replace(rows, findings=replace(rows.findings, rule=rows.findings.rule[::-1]))
    assert changed.digest() != rows.digest()
    assert rows.take(np.array([2])).findings.row(0) == {
        "conflict": "contact", "conflict_type": "head-on", "responsible": "other",
        "rule": "left its lane", "partner": "bv", "implausible": None, "happened": None,
    }  # fmt: skip


def test_an_empty_run_can_be_read(tmp_path):
    with create(tmp_path / "run") as store:
        assert (len(store), store.n_batches, store.seconds) == (0, 0, 0.0)
        rows = store.read()
        shapes = [a.shape for a in (rows.U, rows.X, rows.metrics, rows.F, rows.status)]
        assert shapes == [(0, 3), (0, 2), (0, 3), (0, 2), (0,)]
        assert list(store.rows()) == []
        assert len(store.frame()) == 0


def test_frame(tmp_path):
    with filled(tmp_path / "run", 40, 7) as store:
        frame, rows = store.frame(), store.read()
    assert frame.index.name == "id"
    assert list(frame) == [
        "batch", "seconds", *PARAMETERS, *METRICS, "f0", "f1", "status", "critical", "cause",
        *COLUMNS,
    ]  # fmt: skip
    assert frame["v_d"].to_numpy().tobytes() == rows.metrics[:, 1].tobytes()
    assert frame["f1"].to_numpy().tobytes() == rows.F[:, 1].tobytes()
    assert frame["critical"].dtype == bool
    assert frame.loc[46, "batch"] == 1
    assert frame["critical"].sum() == rows.critical.sum()


# ---------------------------------------------------------------------- names

NASTY = ['"; DROP TABLE evaluations; --', "id", "ID", "status", "F0", "select", "größe [m]", "a b",
         "d_min", "''", "🚗", "x?", ":y", "%s"]  # fmt: skip


def test_any_name_is_a_column(tmp_path):
    n = len(NASTY)
    X = np.arange(2.0 * n).reshape(2, n)
    result = SimpleNamespace(
        messages={},
        cause=None,
        findings=None,
        metrics=X[:, :4] + 100,
        F=np.zeros((2, 1)),
        critical=np.zeros(2, bool),
        status=np.zeros(2),
    )
    metrics = ["d_min", "status", "critical_metric", "critical"]
    given = {"parameters": NASTY, "metrics": metrics, "n_obj": 1}
    with create(tmp_path / "run", **given) as store:
        store.append(np.zeros((2, 3)), X, result, 0.0)
    with Store.open(tmp_path / "run") as store:
        rows, frame = store.read(), store.frame()
        assert store.parameters == tuple(NASTY)
        assert store.columns.X[1:4] == ("id_parameter", "ID_parameter_2", "status_parameter")
        assert store.columns.metrics == (
            "d_min_metric", "status_metric", "critical_metric", "critical_metric_2",
        )  # fmt: skip
    np.testing.assert_array_equal(rows.X, X)
    np.testing.assert_array_equal(rows.metrics, result.metrics)
    assert frame[NASTY[0]].tolist() == [0.0, float(n)]


def test_each_schema_has_its_last_columns():
    """The first had no causes, the second no findings, the third not what happened."""
    named = [Columns.named(1, ["a"], ["m"], 1, schema=k).last for k in (1, 2, 3, 4)]
    assert named[0] == ("status", "critical")
    assert named[1] == ("status", "critical", "cause")
    assert named[3] == ("status", "critical", "cause", *COLUMNS)
    assert named[2] == named[3][:-1]
    assert named[3][-1] == "happened"
    assert Columns.named(1, ["a"], ["m"], 1).last == named[3]


def test_a_run_of_the_second_schema_has_its_causes():
    columns = Columns.named(1, ["a"], ["m"], 1, schema=2)
    u = np.array([0.5]).tobytes()
    rows = columns.unpack([(0, 0, 1.5, u, 2.0, 3.0, 4.0, 0, 1, "planning"),
                           (1, 0, 1.5, u, 2.5, 3.5, 4.5, 2, 0, None)])  # fmt: skip
    assert rows.cause.tolist() == [2, 0]
    assert rows.status.tolist() == [0, 2]
    assert rows.critical.tolist() == [True, False]
    assert (rows.X.tolist(), rows.metrics.tolist()) == ([[2.0], [2.5]], [[3.0], [3.5]])
    assert (rows.F.tolist(), rows.U.tolist()) == ([[4.0], [4.5]], [[0.5], [0.5]])
    assert len(rows.findings) == 2


text = st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), min_size=1)
name_lists = st.lists(text.filter(str.strip), unique=True, max_size=8)


@given(parameters=name_lists, metrics=name_lists)
def test_columns_never_clash(parameters, metrics):
    columns = Columns.named(1, parameters, metrics, 2)
    db = sqlite3.connect(":memory:")
    db.execute(columns.create_sql())
    assert tuple(row[1] for row in db.execute("PRAGMA table_info(evaluations)")) == columns.all
    names = ", ".join(map(quoted, columns.all))
    assert db.execute(f"SELECT {names} FROM evaluations").fetchall() == []
    db.close()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ([""], "non-empty"),
        (["a\0b"], "non-empty text"),
        (["\ud800"], "non-empty text"),
        (["a\ud800b"], "non-empty text"),
        ([" "], "non-empty text"),
        (["a", "a"], "parameter's"),
    ],
)
def test_names_that_cannot_be(parameters, message, tmp_path):
    with refuses(InputError, message):
        create(tmp_path / "run", parameters=parameters)
    assert not (tmp_path / "run").exists()


# ---------------------------------------------------------------------- one batch, one transaction


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"X": np.zeros((4, 3))}, "shape"),
        ({"U": np.full((4, 3), np.nan)}, "finite"),
        ({"X": np.full((4, 2), np.inf)}, "finite"),
        ({"metrics": np.zeros((4, 2))}, "metrics"),
        ({"F": np.zeros(4)}, "shape"),
        ({"status": np.zeros(3)}, "status"),
        ({"critical": np.zeros((4, 1))}, "critical"),
    ],
)
def test_wrong_shapes_are_refused_whole(change, message, tmp_path):
    U, X, result = batch(4)
    arrays = {"U": U, "X": X} | vars(result) | change
    with filled(tmp_path / "run", 5) as store:
        with refuses(ValueError, message):
            store.append(arrays.pop("U"), arrays.pop("X"), SimpleNamespace(**arrays), 1.0)
        assert len(store) == 5


def test_an_interrupted_batch_leaves_nothing(tmp_path, monkeypatch):
    """Ctrl-C in the middle of the rows."""
    with filled(tmp_path / "run", 5) as store:
        pack = Columns.pack

        def interrupted(*args):
            yield from pack(*args)[:3]
            raise KeyboardInterrupt

        monkeypatch.setattr(Columns, "pack", interrupted)
        with pytest.raises(KeyboardInterrupt):
            store.append(*batch(40), seconds=1.0)
        monkeypatch.undo()
        assert len(store) == 5
        store.append(*batch(2), seconds=1.0)
        assert store.read().batch.tolist() == [0] * 5 + [1] * 2


def test_finished_and_going_on(tmp_path):
    with filled(tmp_path / "run", 5) as store:
        assert store.finished is None
        store.finish("budget")
        assert store.finished == "budget"
    with Store.open(tmp_path / "run", write=True) as store:
        assert store.finished == "budget"
        store.append(*batch(3), seconds=1.0)
        assert store.finished is None
    with Store.open(tmp_path / "run") as store:
        assert store.finished is None
        with refuses(StorageError):
            store.append(*batch(3), seconds=1.0)
        with refuses(StorageError):
            store.finish("budget")


def test_a_run_is_one_plain_file_when_closed(tmp_path):
    filled(tmp_path / "run", 5).close()
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == ["run.lock", "run.sqlite"]
