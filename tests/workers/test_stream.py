"""Rows in a stream: each is given to a worker that is free; results come in the order of rows."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import WorkersError
from bridgegen.engine.workers import Lost, Threads, Workers
from bridgegen.engine.workers.processes import Processes


@pytest.fixture
def doubles(doubles_can_be_imported):
    import worker_doubles

    return worker_doubles


@pytest.fixture(params=[Threads, Processes])
def pool(request) -> Iterator[Workers]:
    with closing(request.param(2)) as workers:
        yield workers


X = np.arange(20.0)[:, np.newaxis]


def values(parts) -> list[float | None]:
    return [None if isinstance(one.result, Lost) else float(one.result[0, 0]) for one in parts]


def test_results_come_in_the_order_of_rows_however_they_are_added_and_taken(pool, doubles):
    with closing(pool.stream(doubles.Doubler(), doubles.Doubler.double)) as rows:
        rows.submit(X[:3])
        rows.submit(X[3:9])
        found = values(rows.take(2))
        rows.submit(X[9:9])
        rows.submit(X[9:])
        found += values(rows.take(0)) + values(rows.take(18))
    assert found == (2.0 * X[:, 0]).tolist()


def test_a_slow_row_keeps_one_worker_only(pool, doubles, tmp_path):
    """The first row ends when the others have: no worker waits for it."""
    with closing(pool.stream(doubles.Doubler(), doubles.Doubler.double_last, tmp_path)) as rows:
        rows.submit(X)
        assert values(rows.take(20)) == (2.0 * X[:, 0]).tolist()


def test_rows_are_evaluated_while_nobody_waits(pool, doubles, tmp_path):
    with closing(pool.stream(doubles.Doubler(), doubles.Doubler.mark, tmp_path)) as rows:
        rows.submit(X)
        end = time.monotonic() + 60.0
        while len(list(tmp_path.iterdir())) < 20:
            assert time.monotonic() < end
            time.sleep(0.01)
        rows.take(20)


def test_what_is_raised_is_raised_where_results_are_taken(pool, doubles):
    with closing(pool.stream(doubles.Doubler(), doubles.Doubler.fail)) as rows:
        rows.submit(X)
        with pytest.raises(ZeroDivisionError, match="by design"):
            rows.take(1)
        if isinstance(pool, Processes):
            with pytest.raises(ZeroDivisionError, match="by design"):
                rows.take(1)
    # The workers serve on.
    (part,) = pool.map(doubles.Doubler(), doubles.Doubler.double, X[1:2])
    assert part.result.tolist() == [[2.0]]


def test_rows_that_kill_are_lost_alone(doubles):
    with closing(Processes(2)) as pool:
        with closing(pool.stream(doubles.Doubler(), doubles.Doubler.double_but, (6.0,))) as rows:
            rows.submit(X)
            parts = rows.take(20)
        assert values(parts) == [None if x == 6.0 else 2.0 * x for x in X[:, 0]]
        assert parts[6].result == Lost("by SIGSEGV")


def test_workers_that_never_start_are_an_error(doubles):
    with (
        closing(Processes(2)) as pool,
        closing(pool.stream(doubles.Unmakeable(), doubles.Unmakeable.double)) as rows,
    ):
        rows.submit(X)
        with refuses(WorkersError):
            rows.take(1)


def test_workers_stay_between_streams_and_batches(doubles):
    with closing(Processes(2)) as pool:
        doubler, pids = doubles.Doubler(), set()
        for _ in range(3):
            with closing(pool.stream(doubler, doubles.Doubler.process_id)) as rows:
                rows.submit(X)
                pids |= {one.result for one in rows.take(20)}
            pids |= {one.result for one in pool.map(doubler, doubles.Doubler.process_id, X)}
        assert len(pids) <= 2


def test_abandoned_rows_end_with_the_stream(doubles, tmp_path):
    with closing(Processes(2)) as pool:
        with closing(pool.stream(doubles.Doubler(), doubles.Doubler.slowly, tmp_path)) as rows:
            rows.submit(X)
            running = wait_for_two(tmp_path)
        assert not any(Path(f"/proc/{pid}").exists() for pid in running)
        (part,) = pool.map(doubles.Doubler(), doubles.Doubler.double, X[1:2])
        assert part.result.tolist() == [[2.0]]


def test_ctrl_c_interrupts_the_wait_for_results(doubles, tmp_path):
    def interrupt() -> None:
        wait_for_two(tmp_path)
        os.kill(os.getpid(), signal.SIGINT)

    with closing(Processes(2)) as pool:
        thread = threading.Thread(target=interrupt)
        with closing(pool.stream(doubles.Doubler(), doubles.Doubler.slowly, tmp_path)) as rows:
            rows.submit(X)
            thread.start()
            with pytest.raises(KeyboardInterrupt):
                rows.take(1)
        thread.join()
        pids = wait_for_two(tmp_path)
        assert not any(Path(f"/proc/{pid}").exists() for pid in pids)


def wait_for_two(folder: Path) -> list[int]:
    """Wait until two processes have written their numbers; return them."""
    end = time.monotonic() + 60.0
    while len(found := list(folder.iterdir())) < 2 and time.monotonic() < end:
        time.sleep(0.01)
    return [int(path.name) for path in found]
