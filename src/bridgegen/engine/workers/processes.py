"""Processes of this machine, each one thread; one that crashes or is killed costs time only."""

import queue
import signal
from typing import Any

from bridgegen.base.arrays import Float
from bridgegen.engine.workers.pipeline_cache import PipelineCache
from bridgegen.engine.workers.pool import WorkerPool
from bridgegen.engine.workers.process import Process, Said
from bridgegen.engine.workers.recipe import Recipe
from bridgegen.engine.workers.workers import Work


class Processes(WorkerPool[Process]):
    """`Workers` in processes of this machine; started when there are rows to evaluate.

    Args:
        count: how many, ≥ 1.
    """

    are_here = True

    def __init__(self, count: int) -> None:
        super().__init__()
        self._count = count
        self._said: Said = queue.SimpleQueue()

    @property
    def count(self) -> int:
        """See `Workers`."""
        return self._count

    @property
    def pids(self) -> tuple[int, ...]:
        """The process numbers of the workers that have been started."""
        return tuple(one.pid for one in self._workers)

    def _start_worker(self) -> Process:
        return Process(self._said)

    def _ping(self, worker: Process) -> None:
        worker.call(_pong)

    def _prepare(self, worker: Process, recipe: Recipe) -> None:
        worker.call(_prepare, recipe)

    def _run(self, worker: Process, key: str, work: Work, X: Float, args: tuple[Any, ...]) -> None:
        worker.call(_run, key, work, X, args)

    def _receive(self) -> tuple[Process | None, tuple[Any, ...]]:
        return self._said.get()

    def wake(self) -> None:
        """See `WorkerPool`."""
        self._said.put((None, ("wake",)))

    def _release(self, worker: Process) -> str:
        return ending(worker.end())


def ending(status: int) -> str:
    """Return how a process ended, by its exit status; a negative one is a signal's number."""
    if status >= 0:
        return f"with exit status {status}"
    try:
        return f"by {signal.Signals(-status).name}"
    except ValueError:
        return f"by signal {-status}"


# --- In the worker --------------------------------------------------------------------------------

_cache = PipelineCache()


def _pong() -> None:
    """Answer a ping."""


def _prepare(recipe: Recipe) -> None:
    _cache.prepare(recipe)


def _run(key: str, work: Work, X: Float, args: tuple[Any, ...]) -> Any:
    return _cache.run(key, work, X, args)
