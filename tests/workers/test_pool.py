"""Workers crash at any time: every row is evaluated once; only rows that crash are lost."""

from collections import deque
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import WorkersError
from bridgegen.engine.workers import Lost, Recipe
from bridgegen.engine.workers.pipeline_cache import NotPrepared, PipelineCache
from bridgegen.engine.workers.pool import MAX_START_FAILURES, Chunk, WorkerPool


class Tripler:
    """Says which rows were asked for; rows of poison kill."""

    runs_at_once = 1
    device = "CPU"

    def __init__(self, rows_at_once: int) -> None:
        self.rows_at_once = rows_at_once

    @property
    def recipe(self) -> Recipe:
        return Recipe.of(Tripler, self.rows_at_once)

    def triple(self, X: np.ndarray, poison: frozenset[float]) -> list[float]:
        if poison & set(X.tolist()):
            raise SystemExit
        return [3.0 * x for x in X.tolist()]


class SimulatedPool(WorkerPool[int]):
    """A pool in this thread; which worker answers next, and which one crashes, is drawn.

    Args:
        count: workers.
        fates: numbers that decide, one per message; after the last, no worker crashes.
    """

    are_here = True

    def __init__(self, count: int, fates: list[int]) -> None:
        super().__init__()
        self.count_, self.fates = count, deque(fates)
        self.started = self.deaths = 0
        self.caches: dict[int, PipelineCache] = {}
        self.pending: dict[int, Any] = {}

    @property
    def count(self) -> int:
        return self.count_

    def _start_worker(self) -> int:
        self.started += 1
        self.caches[self.started] = PipelineCache()
        self.pending[self.started] = lambda: ("started",)
        return self.started

    def _ping(self, worker):
        self.pending[worker] = lambda: ("answer", "" in self.caches[worker])

    def _prepare(self, worker, recipe):
        self.pending[worker] = lambda: ("answer", self.caches[worker].prepare(recipe))

    def _run(self, worker, key, work, X, args):
        self.pending[worker] = lambda: ("answer", self.caches[worker].run(key, work, X, args))

    def wake(self): ...

    def _receive(self):
        fate = self.fates.popleft() if self.fates else 0
        worker = sorted(self.pending)[fate % len(self.pending)]
        say = self.pending.pop(worker)
        if fate >= 100:  # killed from outside
            self.deaths += 1
            return worker, ("died",)
        try:
            return worker, say()
        except SystemExit:
            self.deaths += 1
            return worker, ("died",)
        except NotPrepared as error:
            return worker, ("raised", error)

    def _release(self, worker):
        self.pending.pop(worker, None)
        del self.caches[worker]
        return "by decree"


rows = st.lists(st.integers(0, 50).map(float), max_size=40)


def outcome(pool: SimulatedPool, X: list[float], at_once: int, poison: frozenset[float]):
    parts = pool.map(Tripler(at_once), Tripler.triple, np.array(X), poison)
    assert sum(part.rows for part in parts) == len(X)
    found: list[float | None] = []
    for part in parts:
        found += [None] * part.rows if isinstance(part.result, Lost) else part.result
    return found


@given(rows, st.integers(1, 9), st.integers(1, 5), st.lists(st.integers(0, 99), max_size=60))
def test_what_is_lost_is_what_kills(X, at_once, workers, fates):
    poison = frozenset({7.0, 30.0})
    pool = SimulatedPool(workers, fates)
    expected = [None if x in poison else 3.0 * x for x in X]
    assert outcome(pool, X, at_once, poison) == expected
    killers = sum(x in poison for x in X)
    # One or two for the chunk, one for each half of it, two for the row; one without a ping.
    assert pool.deaths <= killers * (5 + at_once.bit_length())


@given(rows, st.integers(1, 9), st.integers(1, 5), st.lists(st.integers(0, 9), max_size=30))
def test_workers_killed_at_random_cost_no_row(X, at_once, workers, before):
    pool = SimulatedPool(workers, [])
    for k in range(3):
        pool.fates.clear()
        pool.fates += [*before, 100 + k]
        assert outcome(pool, X, at_once, frozenset()) == [3.0 * x for x in X]
    assert len(pool.caches) <= workers


@given(rows, st.integers(1, 9), st.integers(1, 5), st.lists(st.integers(0, 140), max_size=200))
def test_whatever_happens_no_row_is_done_wrong_or_twice(X, at_once, workers, fates):
    pool = SimulatedPool(workers, fates)
    try:
        found = outcome(pool, X, at_once, frozenset())
    except WorkersError:
        return
    assert len(found) == len(X)
    assert all(y in (None, 3.0 * x) for x, y in zip(X, found, strict=True))


def test_a_chunk_is_suspected_after_two_ends():
    chunk = Chunk(0, 5)
    for _ in range(9):  # it is unknown whether it was running
        assert chunk.after_end(was_alive=False) == [chunk]
    assert chunk.after_end(was_alive=True) == [chunk]
    first, second = chunk.after_end(was_alive=True)
    assert (first.start, first.stop, second.start, second.stop) == (0, 2, 2, 5)
    a, b = first.after_end(was_alive=True)  # once is enough now
    c, d = second.after_end(was_alive=True)
    assert [(one.start, one.stop) for one in (a, b, c, d)] == [(0, 1), (1, 2), (2, 3), (3, 5)]
    assert a.after_end(was_alive=True) == [a]  # a row alone has two ends of its own
    assert a.after_end(was_alive=True) == []


@given(rows, st.integers(1, 9), st.integers(2, 5))
def test_a_machine_that_fails_takes_idle_workers_with_it(X, at_once, workers):
    """All end while they are idle or have just got a chunk, before their end is noticed."""
    pool = SimulatedPool(workers, [])
    outcome(pool, X + X, at_once, frozenset())
    dead = set(pool.caches)

    class Gone:
        def run(self, *_):
            raise SystemExit

        __contains__ = prepare = run

    pool.caches = dict.fromkeys(dead, Gone())
    assert outcome(pool, X, at_once, frozenset()) == [3.0 * x for x in X]


def test_workers_that_never_start_are_an_error():
    pool = SimulatedPool(2, [100] * 10)
    with refuses(WorkersError):
        pool.map(Tripler(1), Tripler.triple, np.array([1.0]), frozenset())
    assert pool.deaths == MAX_START_FAILURES
    assert not pool.caches  # all have been let go


def test_a_worker_keeps_its_pipelines_between_batches():
    pool, portable = SimulatedPool(2, []), Tripler(1)
    for _ in range(5):
        pool.map(portable, Tripler.triple, np.arange(4.0), frozenset())
    assert pool.started == 2


def test_an_evicted_pipeline_is_built_again():
    pool, portable = SimulatedPool(1, []), Tripler(1)
    pool.map(portable, Tripler.triple, np.arange(2.0), frozenset())
    pool.caches[1] = PipelineCache()  # another campaign has restarted it, for example
    assert outcome(pool, [5.0], 1, frozenset()) == [15.0]
    assert pool.started == 1
