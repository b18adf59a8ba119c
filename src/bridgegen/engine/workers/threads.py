"""Threads of this process, for work that runs without the GIL."""

import os
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Generic

from bridgegen.base.arrays import Float
from bridgegen.engine.workers.workers import Args, Evaluator, Part, Result, cut


# Not Numba's `prange`: its threading layers must not be entered by two threads at once, nor after a
# fork. Measured: 2048 rows take 1.03 to 1.12 times as long as with it, 40 rows 2 ms more.
class Threads:
    """`Workers` that share one evaluator; a crash of one ends this process.

    Args:
        count: how many; one for each core by default.
    """

    are_here = True

    def __init__(self, count: int | None = None) -> None:
        self._count = count or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(self._count, "rollout")

    @property
    def count(self) -> int:
        """See `Workers`."""
        return self._count

    def map(
        self,
        portable: Evaluator,
        work: Callable[[Evaluator, Float, *Args], Result],
        X: Float,
        *args: *Args,
    ) -> list[Part[Result]]:
        """See `Workers`."""

        def one(bounds: tuple[int, int]) -> Part[Result]:
            start, stop = bounds
            return Part(stop - start, work(portable, X[start:stop], *args))

        each = min(self._count, portable.runs_at_once)
        # `map` keeps the order of the chunks, however late each ends.
        return list(self._pool.map(one, cut(len(X), each, portable.rows_at_once)))

    def stream(
        self,
        portable: Evaluator,
        work: Callable[[Evaluator, Float, *Args], Result],
        *args: *Args,
    ) -> "ThreadStream[Result]":
        """See `Workers`."""
        return ThreadStream(
            min(self._count, portable.runs_at_once), lambda X: work(portable, X, *args)
        )

    def close(self) -> None:
        """See `Workers`."""
        # A kernel cannot be interrupted, so what runs is not waited for.
        self._pool.shutdown(wait=False, cancel_futures=True)


class ThreadStream(Generic[Result]):
    """A `Stream` in threads.

    Args:
        count: how many threads, ≥ 1.
        work: called with each row, ``(1, …)``.
    """

    def __init__(self, count: int, work: Callable[[Float], Result]) -> None:
        self._pool, self._work = ThreadPoolExecutor(count, "rollout"), work
        self._running: deque[Future[Result]] = deque()

    def submit(self, X: Float) -> None:
        """See `Stream`."""
        self._running.extend(
            self._pool.submit(partial(self._work, X[k : k + 1])) for k in range(len(X))
        )

    def take(self, n: int) -> list[Part[Result]]:
        """See `Stream`."""
        return [Part(1, self._running.popleft().result()) for _ in range(n)]

    def close(self) -> None:
        """See `Stream`; rows that are being evaluated are not waited for."""
        self._pool.shutdown(wait=False, cancel_futures=True)
