"""An algorithm that can be saved is gone on with from its newest state, not replayed."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import StorageError
from bridgegen.jobs.search.loop import Reason, run_loop
from bridgegen.results.store import Checkpoint, Store
from bridgegen.search.algorithms import Restorable

BUDGET = 60
RESULT = ("id", "batch", "U", "X", "metrics", "F", "status", "critical")


class Climber:
    """Draws five rows around the best one; so it depends on all it drew and was told."""

    name = "climber"

    def __init__(self):
        self.rng = np.random.Generator(np.random.PCG64(3))
        self.best, self.f = np.full(2, 0.5), np.inf
        self.asked = 0

    def ask(self):
        self.asked += 1
        # Tenths: some rows are known already.
        return np.round(np.clip(self.best + self.rng.normal(0.0, 0.2, (5, 2)), 0.0, 1.0), 1)

    def tell(self, U, results):
        k = int(np.argmin(results.F[:, 0]))
        if results.F[k, 0] < self.f:
            self.best, self.f = U[k], float(results.F[k, 0])

    def state(self):
        data = {"rng": self.rng.bit_generator.state, "best": self.best.tolist(), "f": self.f}
        return json.dumps(data).encode()

    def restore(self, state):
        data = json.loads(state)
        if set(data) != {"rng", "best", "f"}:
            raise ValueError("it is another algorithm's")
        self.rng.bit_generator.state = data["rng"]
        self.best, self.f = np.array(data["best"]), data["f"]


def simulate(X):
    F = ((X - 0.77) ** 2).sum(axis=1, keepdims=True)
    status = np.zeros(len(F), np.int64)
    return SimpleNamespace(
        messages={},
        cause=None,
        findings=None,
        metrics=F,
        F=F,
        critical=F[:, 0] < 0.1,
        status=status,
    )


def opened(folder: Path) -> Store:
    if folder.exists():
        return Store.open(folder, write=True)
    return Store.create(folder, {}, ["a", "b"], ["m"], n_var=2, n_obj=1)


def go(folder: Path, climber=None, budget=BUDGET, **given):
    with opened(folder) as store:
        return run_loop(
            climber or Climber(), lambda U: U, given.pop("simulate", simulate), store, budget,
            **given,
        )  # fmt: skip


def rows_of(folder: Path) -> list[bytes]:
    with Store.open(folder) as store:
        rows = store.read()
    return [getattr(rows, name).tobytes() for name in RESULT]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "run"
    result = go(folder)
    assert result.repeated > 5  # the test is about known rows, too
    return folder, result


def test_the_protocol():
    assert isinstance(Climber(), Restorable)


def test_stopped_at_every_batch_nothing_is_asked_again(whole, tmp_path):
    batches = 0
    for _ in range(whole[1].batches):
        climber, answers = Climber(), iter([False, True])
        result = go(tmp_path / "run", climber, stop=lambda answers=answers: next(answers))
        batches += climber.asked
        if result.reason is Reason.BUDGET:
            break
    assert result.reason is Reason.BUDGET
    assert rows_of(tmp_path / "run") == rows_of(whole[0])
    assert batches == whole[1].batches


@pytest.mark.parametrize("where", ["tell", "state", "save"])
@pytest.mark.parametrize("nth", [1, 2, 5])
def test_broken_off_before_the_batch_is_saved(where, nth, whole, tmp_path, monkeypatch):
    """The recorded batch is asked again, compared, told, and nothing is simulated twice."""
    climber, simulated, calls = Climber(), [], []

    def counting(X):
        simulated.append(len(X))
        return simulate(X)

    def breaking(work):
        def broken(*args):
            calls.append(0)
            if len(calls) == nth:
                raise KeyboardInterrupt
            return work(*args)

        return broken

    with monkeypatch.context() as patch:
        if where == "save":
            patch.setattr(Store, "save", breaking(Store.save))
        else:
            patch.setattr(climber, where, breaking(getattr(climber, where)))
        assert go(tmp_path / "run", climber, simulate=counting).reason is Reason.INTERRUPTED
    before = len(simulated)
    assert before >= nth
    second = Climber()
    assert go(tmp_path / "run", second, simulate=counting).reason is Reason.BUDGET
    assert rows_of(tmp_path / "run") == rows_of(whole[0])
    assert sum(simulated) == BUDGET
    assert second.asked == whole[1].batches - (nth - 1)


@pytest.mark.parametrize("first", [1, 5, 7, 33, 59])
def test_a_larger_budget(first, whole, tmp_path):
    """Even where the budget had cut a batch short, which was never told."""
    assert go(tmp_path / "run", budget=first).evaluations == first
    climber = Climber()
    assert go(tmp_path / "run", climber).simulated == BUDGET - first
    with Store.open(tmp_path / "run") as parts, Store.open(whole[0]) as store:
        for name in ("U", "X", "F", "metrics"):
            assert getattr(parts.read(), name).tobytes() == getattr(store.read(), name).tobytes()


def test_everybody_hears_of_the_rows_that_are_not_asked_again(tmp_path):
    go(tmp_path / "run", budget=31)
    said = []
    go(tmp_path / "run", on_batch=said.append)
    assert [p.evaluations for p in said] == np.cumsum([len(p.result.F) for p in said]).tolist()
    assert said[0].replayed
    assert said[0].evaluations > 5
    assert said[-1].evaluations == BUDGET


def test_only_the_newest_is_kept_and_others_read_on(whole):
    with Store.open(whole[0]) as store:
        assert store.checkpoint().evaluations < BUDGET
        assert store._connection.execute("SELECT count(*) FROM checkpoint").fetchone() == (1,)
        with pytest.raises(StorageError, match="reading only"):
            store.save(Checkpoint(1, 0, b""))


def test_one_that_cannot_be_saved_has_none(tmp_path):
    class Plain:
        name = "plain"

        def __init__(self):
            climber = Climber()
            self.ask, self.tell = climber.ask, climber.tell

    go(tmp_path / "run", Plain())
    with Store.open(tmp_path / "run") as store:
        assert store.checkpoint() is None


@pytest.mark.parametrize(
    ("sql", "message"),
    [
        ("UPDATE checkpoint SET state = x'00'", "what"),
        ("UPDATE checkpoint SET state = 'text'", "what"),
        ("UPDATE checkpoint SET state = state || x'00'", "what"),
        ("UPDATE checkpoint SET evaluations = evaluations - 5", "what"),
        ("UPDATE checkpoint SET idle = 7", "what"),
        ("UPDATE checkpoint SET digest = x'00'", "what"),
        ("DELETE FROM evaluations WHERE id > 3", "evaluations"),
        ("UPDATE evaluations SET a = a + 1 WHERE id = 2", "evaluation 2: X[0] is"),
    ],
)
def test_a_damaged_state_is_one_error(sql, message, tmp_path):
    go(tmp_path / "run", budget=30)
    with opened(tmp_path / "run") as store:
        store._connection.execute(sql)
    with refuses(StorageError, message):
        go(tmp_path / "run")


def test_a_state_that_the_algorithm_refuses(tmp_path):
    go(tmp_path / "run", budget=30)
    with opened(tmp_path / "run") as store:
        store.save(Checkpoint(5, 0, b'{"other": 1}'))
    with refuses(StorageError):
        go(tmp_path / "run")


KILLED = f"""
import os, signal, sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
import test_checkpoint as t

def deadly(X, left=[int(sys.argv[2])]):
    left[0] -= len(X)
    if left[0] <= 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return t.simulate(X)

t.go(t.Path(sys.argv[1]), simulate=deadly)
"""


def test_killed(whole, tmp_path):
    for _ in range(2):
        command = [sys.executable, "-c", KILLED, str(tmp_path / "run"), "25"]
        assert subprocess.run(command, env=os.environ).returncode == -signal.SIGKILL
    climber = Climber()
    result = go(tmp_path / "run", climber)
    assert result.simulated < BUDGET - 20
    assert climber.asked < whole[1].batches
    assert rows_of(tmp_path / "run") == rows_of(whole[0])
