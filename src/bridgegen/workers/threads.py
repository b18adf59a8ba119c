"""Threads of this process: for what runs without the GIL."""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from bridgegen.arrays import Float
from bridgegen.workers.chunks import cut
from bridgegen.workers.workers import Part, Portable


class Threads:
    """`Workers` that share what they work with; one that dies takes this process with it.

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

    def map(self, portable: Portable, work: str, X: Float, *given: Any) -> list[Part]:
        """See `Workers`."""
        method = getattr(portable, work)

        def one(bounds: tuple[int, int]) -> Part:
            start, stop = bounds
            return Part(stop - start, method(X[start:stop], *given))

        each = min(self._count, portable.runs_at_once)
        return list(self._pool.map(one, cut(len(X), each, portable.rows_at_once)))

    def close(self) -> None:
        """See `Workers`."""
        self._pool.shutdown(wait=False, cancel_futures=True)
