"""Workers that may crash: other workers repeat their chunks; no row is lost or recorded twice.

A chunk whose worker ends is repeated. A chunk that ends two workers is halved, again and again,
until a single row is left that ends its worker: that row is `Lost`, all others have their results.

A machine that fails takes all its workers with it, including idle ones whose end has not been
noticed yet. So a chunk is blamed only if its worker answered a ping just before it got the chunk.
"""

import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import WorkersError
from bridgegen.engine.workers.pipeline_cache import NotPrepared
from bridgegen.engine.workers.recipe import Recipe
from bridgegen.engine.workers.workers import Args, Evaluator, Lost, Part, Result, Work, cut

MAX_START_FAILURES = 3
"""Number of workers in a row that end before they are ready, after which `WorkersError` is raised;
or as many as the pool has if that is more."""

WorkerHandle = TypeVar("WorkerHandle")
"""Identifies a worker to its pool: a process, or a number."""


@dataclass
class Chunk:
    """Consecutive rows that one worker evaluates in one call.

    Attributes:
        start: the first row.
        stop: the row after the last.
        ends: how many workers ended while they evaluated it for certain.
        doubted: whether a worker ended after it got the chunk.
        suspect: whether it is a half of a chunk that ended two workers.
    """

    start: int
    stop: int
    ends: int = 0
    doubted: bool = False
    suspect: bool = False

    @property
    def rows(self) -> int:
        """The number of rows."""
        return self.stop - self.start

    def after_end(self, *, was_alive: bool) -> list["Chunk"]:
        """Return the chunks to evaluate after its worker ended; none if its row is lost.

        Args:
            was_alive: whether the worker was certainly running when it got the chunk.
        """
        self.doubted = True
        self.ends += was_alive
        # A whole chunk and a single row may end two workers, a half of a chunk one: a row that
        # kills costs 4 + log2(rows) processes.
        if self.ends < (1 if self.suspect and self.rows > 1 else 2):
            return [self]
        if self.rows <= 1:
            return []
        middle = (self.start + self.stop) // 2
        halves = ((self.start, middle), (middle, self.stop))
        return [Chunk(a, b, doubted=True, suspect=True) for a, b in halves]


@dataclass(eq=False)
class WorkerState(Generic[WorkerHandle]):
    """What the pool knows of a worker.

    Attributes:
        handle: identifies it.
        prepared: the keys of the recipes that it has prepared.
        preparing: the key of the recipe that it is preparing.
        chunk: the chunk that it is evaluating.
        started: whether it has started, and no ping is unanswered.
        pinged: whether it has answered a ping and got no chunk since.
    """

    handle: WorkerHandle
    prepared: set[str] = field(default_factory=set)
    preparing: str | None = None
    chunk: Chunk | None = None
    started: bool = False
    pinged: bool = False

    @property
    def is_idle(self) -> bool:
        """Whether it can get a chunk."""
        return self.started and self.preparing is None and self.chunk is None


@dataclass
class Job:
    """A function that workers call for chunks of rows.

    Attributes:
        recipe: builds what the rows are evaluated with.
        work: the function.
        args: its further arguments.
        rows: returns the rows of a chunk.
        waiting: chunks that no worker has.
        done: results, by the first row of their chunk.
    """

    recipe: Recipe
    work: Work
    args: tuple[Any, ...]
    rows: Callable[[Chunk], Float]
    waiting: deque[Chunk] = field(default_factory=deque)
    done: dict[int, Part[Any]] = field(default_factory=dict)


class WorkerPool(ABC, Generic[WorkerHandle]):
    """`Workers` that each run in a process of their own, on this machine or another."""

    def __init__(self) -> None:
        self._workers: dict[WorkerHandle, WorkerState[WorkerHandle]] = {}
        self._start_failures = 0

    @property
    @abstractmethod
    def count(self) -> int:
        """See `Workers`."""

    @abstractmethod
    def _start_worker(self) -> WorkerHandle:
        """Start a worker; it will send ("started",)."""

    @abstractmethod
    def _ping(self, worker: WorkerHandle) -> None:
        """Ask a worker for any answer."""

    @abstractmethod
    def _prepare(self, worker: WorkerHandle, recipe: Recipe) -> None:
        """Have a worker build a recipe's pipeline; it sends an answer or an exception."""

    @abstractmethod
    def _run(
        self, worker: WorkerHandle, key: str, work: Work, X: Float, args: tuple[Any, ...]
    ) -> None:
        """Have a worker evaluate rows; it sends their result or an exception."""

    @abstractmethod
    def _receive(self) -> tuple[WorkerHandle | None, tuple[Any, ...]]:
        """Wait for the next message of a worker (see `process.py`), or for `wake`."""

    @abstractmethod
    def wake(self) -> None:
        """Have ``_receive`` return in the thread that waits in it; called by another one."""

    @abstractmethod
    def _release(self, worker: WorkerHandle) -> str:
        """Release a worker, running or not; return how it ended."""

    def map(
        self,
        portable: Evaluator,
        work: Callable[[Evaluator, Float, *Args], Result],
        X: Float,
        *args: *Args,
    ) -> list[Part[Result]]:
        """See `Workers`."""
        job = Job(portable.recipe, work, args, lambda chunk: X[chunk.start : chunk.stop])
        # Bounds do not depend on how long rows take, nor on which worker is free: results come back
        # in the order of rows.
        bounds = cut(len(X), self.count, portable.rows_at_once)
        job.waiting.extend(Chunk(start, stop) for start, stop in bounds)
        try:
            while job.waiting or any(state.chunk for state in self._workers.values()):
                self.step(job)
        except BaseException:
            # Also at Ctrl-C, and at an error of the work: what workers still do is for nobody.
            self.close()  # stops the chunks that are being evaluated
            raise
        return [job.done[start] for start in sorted(job.done)]

    def stream(
        self,
        portable: Evaluator,
        work: Callable[[Evaluator, Float, *Args], Result],
        *args: *Args,
    ) -> "PoolStream[Result]":
        """See `Workers`."""
        return PoolStream(self, portable.recipe, work, args)

    def step(self, job: Job) -> None:
        """Give idle workers something to do, then wait for a worker's message and process it."""
        self._assign(job)
        worker, (kind, *rest) = self._receive()
        state = None if worker is None else self._workers.get(worker)
        if state is None:  # it has been released; or nobody says anything
            return
        # A worker that has been pinged is marked as not started, so its answer is not taken for a
        # result.
        if kind == "started" or (kind == "answer" and not state.started):
            state.started = state.pinged = True
        elif kind == "died":
            self._on_worker_died(state, job)
        elif kind == "raised" and isinstance(rest[0], NotPrepared) and state.chunk:
            # Ray has restarted the actor, or other campaigns have evicted the pipeline.
            state.prepared.clear()
            # In front: a stream takes its results in the order of submission, and waits for this
            # one first.
            job.waiting.appendleft(state.chunk)
            state.chunk, state.pinged = None, False
        elif kind == "raised":
            raise rest[0]
        elif state.preparing is not None:
            self._start_failures = 0
            state.prepared.add(state.preparing)
            state.preparing = None
        elif state.chunk is not None:
            job.done[state.chunk.start] = Part(state.chunk.rows, rest[0])
            state.chunk, state.pinged = None, False

    def close(self) -> None:
        """See `Workers`."""
        workers, self._workers = self._workers, {}
        for worker in workers:
            self._release(worker)

    def _missing(self, chunks: int) -> int:
        """Return how many workers to start for so many waiting chunks; none if it is negative."""
        free = sum(state.chunk is None for state in self._workers.values())
        return min(min(self.count, chunks) - free, self.count - len(self._workers))

    def _assign(self, job: Job) -> None:
        """Start missing workers, and give each idle worker a chunk or what must precede it."""
        for _ in range(self._missing(len(job.waiting))):
            worker = self._start_worker()
            self._workers[worker] = WorkerState(worker)
        for state in [state for state in self._workers.values() if state.is_idle]:
            if not job.waiting:
                return
            if job.recipe.key not in state.prepared:
                state.preparing = job.recipe.key
                self._prepare(state.handle, job.recipe)
            # A chunk is blamed for its worker's end only if the worker certainly ran when it got
            # it: a machine that fails takes idle workers with it, too.
            elif job.waiting[0].doubted and not state.pinged:
                # Until it answers it is not idle, so it gets no chunk.
                state.started = False
                self._ping(state.handle)
            else:
                state.chunk = job.waiting.popleft()
                rows = job.rows(state.chunk)
                self._run(state.handle, job.recipe.key, job.work, rows, job.args)

    def _on_worker_died(self, state: WorkerState[WorkerHandle], job: Job) -> None:
        """Remove a worker that has ended, and queue its chunk again or record its row as lost."""
        del self._workers[state.handle]
        reason, chunk = self._release(state.handle), state.chunk
        if chunk is None:
            # It had no chunk, so its end is no row's fault.
            self._start_failures += not state.prepared
            if self._start_failures >= max(MAX_START_FAILURES, self.count):
                raise WorkersError(
                    f"{self._start_failures} workers in a row ended before they were ready: "
                    f"{reason}"
                )
            return
        remaining = chunk.after_end(was_alive=state.pinged)
        job.waiting.extendleft(reversed(remaining))
        if not remaining:
            job.done[chunk.start] = Part(chunk.rows, Lost(reason))


# Told in the order of submission, however late a row is: else a search would depend on the
# machine's load.
class PoolStream(Generic[Result]):
    """A `Stream` of a pool. A thread gives rows to workers while the caller is busy.

    Args:
        pool: evaluates the rows.
        recipe: see `Job`.
        work: see `Job`.
        args: see `Job`.
    """

    def __init__(
        self, pool: WorkerPool[Any], recipe: Recipe, work: Work, args: tuple[Any, ...]
    ) -> None:
        self._pool, self._X = pool, dict[int, Float]()
        self._job = Job(recipe, work, args, lambda chunk: self._X[chunk.start])
        self._submitted = self._taken = 0
        self._is_closed = False
        self._error: BaseException | None = None
        self._changed = threading.Condition()
        self._thread = self._started()

    def _started(self) -> threading.Thread:
        """Return the thread that gives rows to workers, started."""
        thread = threading.Thread(target=self._run, daemon=True)
        thread.start()
        return thread

    def submit(self, X: Float) -> None:
        """See `Stream`."""
        for row in X:
            # Before its chunk is queued: the thread may take that at once.
            self._X[self._submitted] = row[np.newaxis]
            self._job.waiting.append(Chunk(self._submitted, self._submitted + 1))
            self._submitted += 1
        self._pool.wake()

    def take(self, n: int) -> list[Part[Result]]:
        """See `Stream`."""
        return [self._next() for _ in range(n)]

    def close(self) -> None:
        """See `Stream`; workers whose rows are abandoned are stopped."""
        self._is_closed = True
        self._pool.wake()
        self._thread.join()
        if self._taken < self._submitted:
            self._pool.close()

    def _next(self) -> Part[Result]:
        """Wait for the result of the next row."""
        k = self._taken
        with self._changed:
            while k not in self._job.done:
                if self._error is not None:
                    raise self._error
                self._wait()
        self._taken += 1
        # Not before the result is there: a worker's end queues the row again.
        del self._X[k]
        return self._job.done.pop(k)

    def _wait(self) -> None:
        """Wait until the thread has processed another message of a worker."""
        self._changed.wait()

    def _run(self) -> None:
        """Evaluate rows until the stream is closed or a row's work raises."""
        while not self._is_closed and self._error is None:
            error = None
            try:
                self._pool.step(self._job)
            # An exception in this thread would only be printed; `take` raises it where it is
            # noticed.
            except BaseException as one:
                error = one
            with self._changed:
                self._error = error
                self._changed.notify_all()
