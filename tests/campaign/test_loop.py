import random
import signal
import subprocess
import sys
import time
from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError, StorageError
from bridgegen.jobs.search.loop import Progress, Reason, run_loop
from bridgegen.results.store import Store
from bridgegen.search.algorithms import Problem, Results, get

RESULT = ("id", "batch", "U", "X", "metrics", "F", "status", "critical")


class Scripted:
    """Asks for given batches, and keeps what it is told."""

    name = "scripted"

    def __init__(self, *batches):
        self.batches = [np.array(batch, float).reshape(len(batch), -1) for batch in batches]
        self.told, self.results = [], []

    def ask(self):
        return self.batches.pop(0) if self.batches else np.empty((0, 1))

    def tell(self, U, results):
        F, ok = results.F[:, 0].tolist(), results.ok.tolist()
        self.told.append((U[:, 0].tolist(), F, ok))
        self.results.append(results)


class Simulator:
    """f = (x − 0.5)², fails below 0.1; counts its work."""

    def __init__(self):
        self.seen = []

    def __call__(self, X):
        self.seen += X[:, 0].tolist()
        F = (X[:, :1] - 0.5) ** 2
        status = np.where(X[:, 0] < 0.1, 2, 0)
        F[status == 2] = np.nan
        return SimpleNamespace(
            messages={},
            cause=None,
            findings=None,
            metrics=F * 2,
            F=F,
            critical=F[:, 0] < 0.01,
            status=status,
        )


def decode(U):
    """Thousandths, so that different rows of U can be one row of X."""
    return np.round(U, 3)


@pytest.fixture
def open_store(tmp_path):
    stores = []

    def opened(name="run", n_var=1):
        folder = tmp_path / name
        if folder.exists():
            store = Store.open(folder, write=True)
        else:
            names = [f"x{i}" for i in range(n_var)]
            store = Store.create(folder, {}, names, ["m"], n_var=n_var, n_obj=1)
        stores.append(store)
        return store

    yield opened
    for store in stores:
        store.close()


def go(store, algorithm, budget, **given):
    return run_loop(algorithm, decode, given.pop("simulate", Simulator()), store, budget, **given)


def same(a, b):
    for name in RESULT:
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name


# ---------------------------------------------------------------------- one run


def test_what_is_told_and_recorded(open_store):
    search, simulate, store = Scripted([0.5, 0.7], [0.05, 0.6]), Simulator(), open_store()
    result = go(store, search, 100, simulate=simulate)
    assert result.reason is Reason.EXHAUSTED
    assert (result.evaluations, result.simulated, result.batches, result.repeated) == (4, 4, 2, 0)
    (U1, F1, ok1), (U2, F2, ok2) = search.told
    assert (U1, ok1) == ([0.5, 0.7], [True, True])
    np.testing.assert_allclose(F1, [0.0, 0.04], atol=1e-15)
    assert (U2, ok2) == ([0.05, 0.6], [False, True])
    assert np.isnan(F2[0])
    rows = store.read()
    assert rows.X[:, 0].tolist() == [0.5, 0.7, 0.05, 0.6]
    assert rows.batch.tolist() == [0, 0, 1, 1]
    assert rows.status.tolist() == [0, 0, 2, 0]
    assert store.finished == "exhausted"


def test_known_rows_cost_nothing(open_store):
    # 0.7001 decodes to 0.7; 0.5 is known from the batch before, 0.7 from its own.
    search = Scripted([0.5, 0.2], [0.5, 0.7, 0.7001], [0.7, 0.9])
    simulate, store = Simulator(), open_store()
    result = go(store, search, 4, simulate=simulate)
    assert simulate.seen == [0.5, 0.2, 0.7, 0.9]
    assert (result.reason, result.repeated, result.simulated) == (Reason.BUDGET, 3, 4)
    assert search.told[1][1] == pytest.approx([0.0, 0.04, 0.04])
    assert store.read().U[:, 0].tolist() == [0.5, 0.2, 0.7, 0.9]


def test_the_budget_cuts_a_batch_and_counts_new_rows_only(open_store):
    search, simulate, store = Scripted([0.1, 0.2], [0.1, 0.3, 0.4, 0.5]), Simulator(), open_store()
    assert go(store, search, 4, simulate=simulate).reason is Reason.BUDGET
    assert simulate.seen == [0.1, 0.2, 0.3, 0.4]
    assert len(search.told) == 1


def test_a_hundred_batches_without_a_new_row_are_converged(open_store):
    search, store = Scripted([0.5], *[[0.5, 0.5]] * 105), open_store()
    result = go(store, search, 10)
    assert result.reason is Reason.CONVERGED
    assert (result.evaluations, result.batches) == (1, 101)
    assert store.finished == "converged"


def test_one_new_row_is_not_converged(open_store):
    quiet = [[0.5]] * 99
    search, store = Scripted([0.5], *quiet, [0.6], *quiet), open_store()
    assert go(store, search, 10).reason is Reason.EXHAUSTED


def test_no_negative_zero(open_store):
    """What is simulated is what the store can keep."""
    store, signs = open_store(), []

    def simulate(X):
        signs.extend(np.signbit(X[:, 0]).tolist())
        return Simulator()(X + 0.5)

    run_loop(Scripted([0.0, 0.25]), lambda U: -U, simulate, store, 5)
    assert signs == [False, True]
    assert store.read().X.tobytes() == np.array([[0.0], [-0.25]]).tobytes()


def test_an_objective_that_is_not_finite_is_not_ok(open_store):
    def simulate(X):
        result = Simulator()(X)
        result.F[0], result.F[1] = np.inf, np.nan
        return result

    search, store = Scripted([0.3, 0.4, 0.6]), open_store()
    go(store, search, 10, simulate=simulate)
    assert search.told[0][2] == [False, False, True]
    assert store.read().F[0, 0] == np.inf  # recorded as it is


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([[0.5, 0.5]], r"its rows must have shape \(·, 1\)"),
        ([[1.5]], r"must be in \[0, 1\], got 1.5 .. 1.5"),
        ([[-0.1]], r"must be in \[0, 1\]"),
        ([[np.nan]], "must be finite"),
    ],
)
def test_an_algorithm_that_leaves_the_cube_is_named(rows, message, open_store):
    with pytest.raises(InputError, match=f"algorithm 'scripted': {message}|{message}"):
        go(open_store(), Scripted(rows), 10)


def test_progress(open_store):
    said: list[Progress] = []
    store = open_store()
    go(store, Scripted([0.5, 0.6], [0.5], [0.7, 0.8, 0.9]), 4, on_batch=said.append)
    assert [(p.evaluations, p.budget, p.replayed) for p in said] == [(2, 4, False), (4, 4, False)]
    assert [len(p.result.F) for p in said] == [2, 2]
    assert 0 <= said[0].seconds <= said[1].seconds
    assert store.read().seconds[0] <= said[0].seconds


# ---------------------------------------------------------------------- stop and go on


def test_stop_ends_between_batches(open_store):
    answers, store = iter([False, False, True]), open_store()
    result = go(store, Scripted([0.5], [0.6], [0.7]), 10, stop=lambda: next(answers))
    assert (result.reason, result.evaluations) == (Reason.STOPPED, 2)
    assert store.finished is None


@pytest.mark.parametrize("where", ["simulate", "on_batch", "tell", "ask"])
def test_ctrl_c_keeps_finished_batches(where, open_store):
    search, simulate, calls = get("random")(Problem.unnamed(1), 0), Simulator(), []

    def interrupt_third(work):
        def interrupting(*args):
            calls.append(0)
            if len(calls) == 3:
                raise KeyboardInterrupt
            return work(*args)

        return interrupting

    on_batch = None
    if where == "simulate":
        simulate = interrupt_third(simulate)
    elif where == "on_batch":
        on_batch = interrupt_third(lambda progress: None)
    else:
        setattr(search, where, interrupt_third(getattr(search, where)))
    store = open_store()
    result = run_loop(search, lambda U: U, simulate, store, 200, on_batch)
    assert result.reason is Reason.INTERRUPTED
    assert result.evaluations == len(store) == (120 if where in ("on_batch", "tell") else 80)
    run_loop(get("random")(Problem.unnamed(1), 0), lambda U: U, Simulator(), store, 200)
    whole = open_store("whole")
    run_loop(get("random")(Problem.unnamed(1), 0), lambda U: U, Simulator(), whole, 200)
    same(store.read(), whole.read())


@pytest.mark.parametrize("name", ["random", "pso"])
@pytest.mark.parametrize("first", [1, 39, 40, 77, 120])
def test_a_larger_budget_goes_on_as_if_it_had_always_been(name, first, open_store):
    """Even from the middle of a batch."""
    whole, parts, simulate = open_store("whole", 2), open_store("parts", 2), Simulator()
    go(whole, get(name)(Problem.unnamed(2), 5), 200)
    go(parts, get(name)(Problem.unnamed(2), 5), first, simulate=simulate)
    assert (len(parts), parts.finished) == (first, "budget")
    result = go(parts, get(name)(Problem.unnamed(2), 5), 200, simulate=simulate)
    assert (result.evaluations, result.simulated) == (200, 200 - first)
    assert len(simulate.seen) == 200
    a, b = whole.read(), parts.read()
    for field in ("U", "X", "F", "status"):
        assert getattr(a, field).tobytes() == getattr(b, field).tobytes()


def test_a_finished_run_needs_no_replay(open_store):
    store = open_store()
    go(store, get("random")(Problem.unnamed(1), 0), 60)
    result = go(store, Scripted([0.5]), 60)  # not even the right algorithm is asked
    assert (result.reason, result.batches, result.simulated) == (Reason.BUDGET, 0, 0)
    assert go(store, Scripted([0.5]), 30).evaluations == 60


def test_a_run_killed_before_it_was_marked_is_finished(open_store):
    store, stop = open_store(), iter([False, True])
    run_loop(
        get("random")(Problem.unnamed(1), 0),
        lambda U: U,
        Simulator(),
        store,
        41,
        stop=lambda: next(stop),
    )
    store.append(np.array([[0.5]]), np.array([[0.5]]), Simulator()(np.array([[0.5]])), 1.0)
    assert store.finished is None
    assert go(store, get("random")(Problem.unnamed(1), 0), 41).simulated == 0
    assert store.finished == "budget"


def test_replay_tells_what_was_told(open_store):
    batches = [[0.5, 0.05], [0.5, 0.5, 0.7], [0.05, 0.2]]
    store, stop = open_store(), iter([False, False, True])
    first, second, said = Scripted(*batches), Scripted(*batches), []
    go(store, first, 10, stop=lambda: next(stop))
    simulate = Simulator()
    go(store, second, 10, simulate=simulate, on_batch=said.append)
    assert simulate.seen == [0.2]
    assert repr(second.told[:2]) == repr(first.told)
    assert repr(second.told[2]) == "([0.05, 0.2], [nan, 0.09], [False, True])"
    assert [(p.evaluations, p.replayed) for p in said] == [(2, True), (3, True), (4, False)]
    assert said[0].result.critical.tolist() == [True, False]
    for live, replayed in zip(first.results, second.results, strict=False):
        for one in fields(Results):
            assert getattr(live, one.name).tobytes() == getattr(replayed, one.name).tobytes()


def test_all_that_is_known_of_a_row_is_told(open_store):
    class Caused(Simulator):
        def __call__(self, X):
            result = super().__call__(X)
            return SimpleNamespace(**vars(result) | {"cause": np.where(result.critical, 2, 0)})

    search = Scripted([0.5, 0.05, 0.7], [0.7, 0.5])
    go(open_store(), search, 10, simulate=Caused())
    first, second = search.results
    assert first.critical.tolist() == [True, False, False]
    np.testing.assert_allclose(first.metrics[:, 0], [0.0, np.nan, 0.08], atol=1e-15)
    assert first.cause.tolist() == [2, 0, 0]
    assert second.critical.tolist() == [False, True]
    np.testing.assert_allclose(second.metrics[:, 0], [0.08, 0.0], atol=1e-15)
    assert second.cause.tolist() == [0, 2]


def test_time_goes_on_where_it_stopped(open_store):
    store = open_store()
    run_loop(get("random")(Problem.unnamed(1), 0), lambda U: U, Simulator(), store, 40)
    with store._connection as connection:
        connection.execute("UPDATE evaluations SET seconds = 1000.0")
    result = run_loop(get("random")(Problem.unnamed(1), 0), lambda U: U, Simulator(), store, 80)
    assert 1000.0 <= store.read(79).seconds[0] <= result.seconds < 1060.0


@pytest.mark.parametrize(
    ("algorithm", "decoder", "place"),
    [
        (
            get("random")(Problem.unnamed(1), 1),
            lambda U: U,
            "U[0]",
        ),
        (get("pso")(Problem.unnamed(1), 0), lambda U: U, "U[0]"),
        (get("random")(Problem.unnamed(1), 0), lambda U: U + 1e-15, "X[0]"),
        (Scripted(), lambda U: U, "exhausted"),
    ],
)
def test_what_cannot_be_repeated_is_not_gone_on_with(algorithm, decoder, place, open_store):
    store, simulate = open_store(), Simulator()
    run_loop(get("random")(Problem.unnamed(1), 0), lambda U: U, Simulator(), store, 80)
    with refuses(StorageError, "80", place):
        run_loop(algorithm, decoder, simulate, store, 120)
    assert simulate.seen == []
    assert len(store) == 80


# ---------------------------------------------------------------------- SIGKILL

KILLED = """
import os, sys, time
from types import SimpleNamespace
import numpy as np
from bridgegen.jobs.search.loop import run_loop
from bridgegen.search.algorithms import Problem, get
from bridgegen.results.store import Store

folder, log, name = sys.argv[1:]
log = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)

def evaluate(X):
    for x in X:
        os.write(log, x.tobytes())
    time.sleep(0.004)
    F = ((X - 0.3) ** 2).sum(axis=1, keepdims=True)
    status = np.where(X[:, 0] > 0.8, 1, 0)
    F[status == 1] = np.nan
    critical = F[:, 0] < 0.01
    return SimpleNamespace(
        messages={}, cause=None, findings=None, metrics=F, F=F, critical=critical, status=status
    )

if os.path.exists(folder + "/run.sqlite"):
    store = Store.open(folder, write=True)
else:
    store = Store.create(folder, {}, ["a", "b", "c"], ["m"], n_var=3, n_obj=1)
with store:
    run_loop(get(name)(Problem.unnamed(3), 9), lambda U: np.round(U, 3), evaluate, store, 1500)
"""


def logged(path):
    if not path.exists():
        return []
    numbers = np.fromfile(path)  # a kill may have cut its last row short
    return numbers[: len(numbers) // 3 * 3].reshape(-1, 3).tolist()


@pytest.mark.parametrize("name", ["random", "pso"])
def test_killed_at_any_moment(name, tmp_path):
    """SIGKILL, again and again: the result is the undisturbed one, and no work is repeated."""
    dice = random.Random(name)
    command = [sys.executable, "-W", "error", "-c", KILLED]
    subprocess.run([*command, tmp_path / "whole", tmp_path / "log", name], check=True)
    killed, log = tmp_path / "killed", tmp_path / "killed.log"
    recorded, kills = [], 0  # after each kill: what the store held, how long the log was
    for _ in range(5):
        process = subprocess.Popen([*command, killed, log, name])
        enough = len(logged(log)) + dice.randrange(1, 300)
        while process.poll() is None and len(logged(log)) < enough:
            time.sleep(0.001)
        time.sleep(dice.random() * 0.01)
        process.send_signal(signal.SIGKILL)
        kills += process.wait() == -signal.SIGKILL
        with Store.open(killed) as store:
            recorded.append((store.read().X.tolist(), len(logged(log))))
    assert kills >= 3
    assert len(recorded[-1][0]) > len(recorded[0][0])  # it got on between the kills
    subprocess.run([*command, killed, log, name], check=True)
    with Store.open(tmp_path / "whole") as whole, Store.open(killed) as store:
        same(whole.read(), store.read())
        assert store.finished == whole.finished == "budget"
    for rows, length in recorded:
        again = {tuple(x) for x in logged(log)[length:]}
        assert not again & {tuple(x) for x in rows}, "recorded work was done again"
    # What was lost: at most the batch that each kill broke off.
    assert len(logged(log)) <= 1500 + 40 * kills
    assert len(logged(tmp_path / "log")) == 1500


class Diarist(Scripted):
    """Takes notes of how often it was told what."""

    def notes(self):
        return {"told": [told for _, _, told in self.told]}


def test_notes_are_kept_when_the_search_ends(open_store):
    with open_store() as store:
        run_loop(Diarist([0.2, 0.05], [0.3]), decode, Simulator(), store, 9)
        assert store.notes == {"told": [[True, False], [True]]}
    with open_store() as store:
        assert store.notes == {"told": [[True, False], [True]]}


def test_notes_are_of_the_last_batch_too_as_far_as_the_budget_goes(open_store):
    with open_store() as store:
        diarist = Diarist([0.2, 0.3], [0.4, 0.5, 0.2])
        result = run_loop(diarist, decode, Simulator(), store, 3)
        assert (result.reason, result.evaluations) == (Reason.BUDGET, 3)
        # 0.5 has no place in the budget; 0.2 is known.
        assert store.notes == {"told": [[True, True], [True, False, True]]}
    last = diarist.results[-1]
    assert np.isnan(last.metrics[1]).all()
    assert not np.isnan(last.metrics[[0, 2]]).any()
    assert not last.critical[1]


def test_notes_are_kept_when_it_is_stopped_and_stay_until_it_is_further(open_store):
    batches = [[0.2], [0.3], [0.4]]
    with open_store() as store:
        left = iter([False, False, True])
        run_loop(Diarist(*batches), decode, Simulator(), store, 9, stop=lambda: next(left))
        assert len(store.notes["told"]) == 2
    with open_store() as store:  # stopped while it repeats what is recorded
        left = iter([False, True])
        run_loop(Diarist(*batches), decode, Simulator(), store, 9, stop=lambda: next(left))
        assert len(store.notes["told"]) == 2
    with open_store() as store:
        run_loop(Diarist(*batches), decode, Simulator(), store, 9)
        assert len(store.notes["told"]) == 3
    with open_store() as store:  # finished: nothing is asked, nothing is forgotten
        run_loop(Diarist(*batches), decode, Simulator(), store, 3)
        assert len(store.notes["told"]) == 3


def test_notes_are_kept_on_ctrl_c(open_store):
    def interrupted(X):
        if X[0, 0] == 0.3:
            raise KeyboardInterrupt
        return Simulator()(X)

    with open_store() as store:
        result = run_loop(Diarist([0.2], [0.3]), decode, interrupted, store, 9)
        assert result.reason is Reason.INTERRUPTED
        assert store.notes == {"told": [[True]]}


@pytest.mark.parametrize("notes", [{"x": float("nan")}, {"x": np.zeros(2)}])
def test_notes_must_be_json(open_store, notes):
    class Wrong(Scripted):
        def notes(self):
            return notes

    with open_store() as store, refuses(InputError, "notes"):
        run_loop(Wrong([0.2]), decode, Simulator(), store, 9)
    with open_store() as store:
        assert len(store) == 1
        assert store.notes == {}
