"""Processes of this machine: they die, refuse and are interrupted, and nothing is left of them."""

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError, UnknownNameError, WorkersError
from bridgegen.engine.workers import Lost, Part, Threads, open_workers, read_choice
from bridgegen.engine.workers.processes import Processes, ending


@pytest.fixture
def doubles(doubles_can_be_imported):
    import worker_doubles

    return worker_doubles


@pytest.fixture
def pool() -> Iterator[Processes]:
    with open_workers(2) as workers:
        assert isinstance(workers, Processes)
        yield workers


X = np.arange(20.0)


def joined(parts: list[Part]) -> np.ndarray:
    return np.concatenate([part.result for part in parts])


def test_rows_come_back_in_order_from_several_processes(pool, doubles):
    doubler = doubles.Doubler()
    assert (joined(pool.map(doubler, doubles.Doubler.double, X)) == 2.0 * X).all()
    pids = {part.result for part in pool.map(doubler, doubles.Doubler.process_id, X)}
    assert 1 <= len(pids) <= 2
    assert os.getpid() not in pids
    again = {part.result for part in pool.map(doubler, doubles.Doubler.process_id, X)}
    assert len(pids | again) <= 2  # they stay
    assert [part.rows for part in pool.map(doubler, doubles.Doubler.double, X[:0])] == [0]


def test_a_killed_process_costs_nothing(pool, doubles, tmp_path):
    parts = pool.map(doubles.Doubler(), doubles.Doubler.double_once_killed, X, tmp_path)
    assert (joined(parts) == 2.0 * X).all()
    assert (tmp_path / "was here").exists()


def test_rows_that_kill_are_lost_alone(pool, doubles):
    parts = pool.map(doubles.Doubler(), doubles.Doubler.double_but, X, (6.0, 17.0))
    found = [
        x for part in parts for x in ([None] if isinstance(part.result, Lost) else part.result)
    ]
    assert found == [None if x in (6.0, 17.0) else 2.0 * x for x in X]
    lost = [part for part in parts if isinstance(part.result, Lost)]
    assert [(one.rows, one.result.reason) for one in lost] == [(1, "by SIGSEGV")] * 2


def test_what_is_raised_arrives_as_it_was(pool, doubles):
    with refuses(UnknownNameError, "seven") as error:
        pool.map(doubles.Doubler(), doubles.Doubler.refuse, X)
    assert error.value.problems == ("unknown number 'seven'; known: one, two",)
    with pytest.raises(ZeroDivisionError, match="by design") as mistake:
        pool.map(doubles.Doubler(), doubles.Doubler.fail, X)
    assert "worker_doubles.py" in mistake.value.__notes__[0]  # where it was
    assert (joined(pool.map(doubles.Doubler(), doubles.Doubler.double, X)) == 2.0 * X).all()


def test_what_cannot_be_made_is_no_endless_loop(pool, doubles):
    with refuses(WorkersError):
        pool.map(doubles.Unmakeable(), doubles.Unmakeable.double, X)


@pytest.mark.parametrize(
    ("work", "reason"),
    [("fork_and_die", "with exit status 4"), ("fork_and_exit", "with exit status 5")],
)
def test_one_that_dies_after_a_fork_is_told(pool, doubles, work, reason):
    parts = pool.map(doubles.Doubler(), getattr(doubles.Doubler, work), X[:1])
    assert [part.result for part in parts] == [Lost(reason)]


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells whose a daemon was")
def test_what_they_start_ends_with_them(pool, doubles, tmp_path):
    assert (
        joined(pool.map(doubles.Doubler(), doubles.Doubler.start_daemon, X, tmp_path)) == X
    ).all()
    end = time.monotonic() + 60.0
    while not (pids := [int(path.name) for path in tmp_path.iterdir()]):
        assert time.monotonic() < end
        time.sleep(0.01)
    assert Path(f"/proc/{pids[0]}").exists()
    pool.close()
    pids = [int(path.name) for path in tmp_path.iterdir()]
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)


def test_ctrl_c_ends_them_at_once(doubles, tmp_path):
    def interrupt() -> None:
        end = time.monotonic() + 60.0
        while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < end:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    pool, thread = Processes(2), threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        pool.map(doubles.Doubler(), doubles.Doubler.slowly, X, tmp_path)
    thread.join()
    pids = [int(path.name) for path in tmp_path.iterdir()]
    assert len(pids) == 2
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)


@pytest.mark.parametrize("choice", [0, -1, 2000, "0", "two", "", "1.5", "raye"])
def test_what_is_no_choice_of_workers(choice):
    with refuses(InputError, "workers", "1024"):
        read_choice(choice)


def test_choices():
    assert (read_choice("3"), read_choice(3), read_choice(None)) == (3, 3, None)
    with open_workers(None) as workers:
        assert isinstance(workers, Threads)
    mine = Threads(1)
    with open_workers(mine) as workers:
        assert workers is mine
    assert workers.map  # it is the caller's, and not closed


def test_endings():
    assert [ending(one) for one in (0, 7, -9, -11, -250)] == [
        "with exit status 0", "with exit status 7", "by SIGKILL", "by SIGSEGV", "by signal 250",
    ]  # fmt: skip
