"""Threads of this process, for work that runs without the GIL."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from bridgegen.arrays import Float
from bridgegen.workers.chunks import cut
from bridgegen.workers.workers import Args, Evaluator, Part, Result


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
        return list(self._pool.map(one, cut(len(X), each, portable.rows_at_once)))

    def close(self) -> None:
        """See `Workers`."""
        self._pool.shutdown(wait=False, cancel_futures=True)
