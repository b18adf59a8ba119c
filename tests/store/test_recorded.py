"""Evaluations that are read when they are asked for are those that a whole read has in memory."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.assess.cause import CAUSES, Cause
from bridgegen.assess.conflict.findings import COLUMNS, Findings
from bridgegen.base.errors import StorageError
from bridgegen.results.store import Recorded, Store
from bridgegen.results.store import store as module

NAMES = ("batch", "status", "critical", "cause", "F")


def append(store, n, seed):
    rng = np.random.default_rng(seed)
    texts = np.array(["", "contact", "a\u00e9"], object)
    metrics = rng.normal(size=(n, 3))
    metrics[::7, 1], metrics[::5, 2] = np.nan, -np.inf
    result = SimpleNamespace(
        metrics=metrics, F=rng.random((n, 2)), critical=rng.random(n) < 0.3,
        status=rng.integers(0, 3, n), messages={},
        cause=rng.choice([Cause.NONE, *CAUSES], n).astype(np.int8),
        findings=Findings(*(rng.choice(texts, n) for _ in COLUMNS)),
    )  # fmt: skip
    store.append(rng.random((n, 2)), rng.normal(size=(n, 4)), result, 1.0 * seed)


@pytest.fixture
def store(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "CHUNK", 16)
    monkeypatch.setattr(module, "MARKS", 5)
    names = (("a", "b", "c", "d"), ("m", "n", "o"))
    with Store.create(tmp_path / "run", {}, *names, n_var=2, n_obj=2) as store:
        for k, n in enumerate((20, 1, 40)):
            append(store, n, k)
        yield store


def check(found, rows):
    assert len(found) == len(rows)
    for name in (*NAMES, "id"):
        got, want = getattr(found, name), getattr(rows, name)
        assert (got.dtype, got.shape) == (want.dtype, want.shape)
        assert np.array_equal(got, want)
    for name, texts in rows.findings.columns().items():
        assert found.findings.columns()[name].tolist() == texts.tolist()
    for name in ("U", "X", "metrics"):
        np.testing.assert_array_equal(getattr(found, name)[:], getattr(rows, name))
    assert found.digest() == rows.digest()


def test_it_is_what_is_read_whole(store):
    check(Recorded(store), store.read())


@pytest.mark.parametrize("name", ["U", "X", "metrics"])
@pytest.mark.parametrize(
    "at",
    [
        3, -1, np.int64(60), slice(None), slice(10, 37), slice(50, 2, -3), slice(5, 5),
        np.array([7, 7, 0, 60, -2]), np.array([], np.int64), np.arange(61) % 3 == 0, [4, 2],
        (slice(None), 1), (slice(3, 20), 0), (np.array([9, 1]), -1), (5, 1),
        (np.arange(61) > 50, 0),
    ],
)  # fmt: skip
def test_it_is_indexed_as_an_array(store, name, at):
    want = getattr(store.read(), name)[at]
    for whole in ((), ("n", "o")):  # columns that are in memory, too
        got = getattr(Recorded(store, whole=whole), name)[at]
        assert got.shape == want.shape
        np.testing.assert_array_equal(got, want)


def test_positions_beyond_its_end_are_refused(store):
    found = Recorded(store)
    append(store, 3, 9)
    assert len(found) == 61
    for at in ([61], [0, -62], 61):
        with pytest.raises(IndexError):
            found.X[at]


def test_some_rows_come_in_the_order_asked_for(store):
    at = np.array([40, 3, 3, 60, 0])
    got, want = Recorded(store).take(at), store.read().take(at)
    assert got.id.tolist() == at.tolist()
    assert got.digest() == want.digest()
    assert len(Recorded(store).take(np.array([], np.int64))) == 0
    assert Recorded(store).take(np.arange(61) > 58).id.tolist() == [59, 60]


def test_what_is_known_is_not_read_again(store, monkeypatch):
    first = Recorded(store, whole=("o", "n"))
    check(first, store.read())
    append(store, 30, 5)
    append(store, 2, 6)
    asked = []
    select = Store.select
    monkeypatch.setattr(Store, "select", lambda self, *of: (asked.append(of), select(self, *of))[1])
    second = Recorded(store, first, whole=("o", "n", "p"))
    use(second)
    assert [of[1:] for of in asked] == [(61, 93)]
    asked.clear()
    third = Recorded(store, Recorded(store, second, whole=("o", "n")), whole=("o", "n"))
    use(third)
    assert not asked
    check(third, store.read())
    use(Recorded(store, third, whole=("m",)))  # has not got all in memory
    assert asked[0][1:] == (0, 93)
    assert len(first.F) == len(first.metrics[:, 1]) == 61


def use(found):
    for name in (*NAMES, "findings"):
        getattr(found, name)
    if found._whole == ("o", "n"):
        assert found.metrics[:, 1].shape == found.metrics[:, -1].shape == (len(found),)


def test_the_digest_of_as_many_rows_is_known(store, monkeypatch):
    first = Recorded(store)
    want = first.digest()
    monkeypatch.setattr("bridgegen.results.store.recorded.digest_of", lambda rows: "anew")
    assert Recorded(store, first).digest() == want
    append(store, 1, 8)
    assert Recorded(store, first).digest() == "anew"


def test_another_shorter_run_in_its_place_is_read_anew(store, tmp_path):
    first = Recorded(store)
    check(first, store.read())
    names = (("a", "b", "c", "d"), ("m", "n", "o"))
    with Store.create(tmp_path / "other", {}, *names, n_var=2, n_obj=2) as other:
        append(other, 7, 77)
        check(Recorded(other, first), other.read())


def test_an_empty_run(tmp_path):
    with Store.create(tmp_path / "run", {}, ("a",), ("m",), n_var=2, n_obj=1) as store:
        found = Recorded(store)
        check(found, store.read())
        assert found.U[found.critical].shape == (0, 2)


@pytest.mark.parametrize(
    ("sql", "read"),
    [
        ("UPDATE evaluations SET status = 'x' WHERE id = 30", lambda r: r.status),
        ("UPDATE evaluations SET cause = 'x' WHERE id = 30", lambda r: r.cause),
        ("UPDATE evaluations SET conflict = x'00' WHERE id = 30", lambda r: r.findings),
        ("UPDATE evaluations SET u = x'00' WHERE id = 30", lambda r: r.U[25:35]),
        ("UPDATE evaluations SET a = 'x' WHERE id = 30", lambda r: r.X[[30]]),
        ("UPDATE evaluations SET f1 = 'x' WHERE id = 30", lambda r: r.F),
        ("DELETE FROM evaluations WHERE id = 30", lambda r: r.metrics[:, 0]),
        ("DELETE FROM evaluations WHERE id = 30", lambda r: r.X[np.array([2, 30])]),
    ],
)
def test_damage_is_told(store, sql, read):
    store._connection.execute(sql)
    with refuses(StorageError):
        read(Recorded(store))
