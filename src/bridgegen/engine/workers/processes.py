"""Processes of this machine, each one thread, that call functions; a crash costs time only."""

import os
import queue
import signal
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Any

from bridgegen.base.arrays import Float
from bridgegen.base.processes.child import ONE_THREAD, Child
from bridgegen.engine.workers.pipeline_cache import PipelineCache
from bridgegen.engine.workers.pool import WorkerPool
from bridgegen.engine.workers.recipe import Recipe
from bridgegen.engine.workers.workers import Work

# --- A process that calls functions on request; this is the side of its parent ---


Said = queue.SimpleQueue[tuple["Process | None", tuple[Any, ...]]]
"""Messages of processes: ("started",), ("answer", result), ("raised", exception), ("died",) when
the process has ended, and the messages of functions that are called with ``tells``; those of no
process end the wait for one."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    # A container or a batch system may allow fewer cores than the machine has.
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Process:
    """A process with one thread; it ends when this process ends, for whatever reason.

    Args:
        said: receives its messages.
        module: the module whose ``main`` it runs.
        errors: receives its standard error; this process's standard error by default.
    """

    def __init__(
        self,
        said: Said,
        module: str = "bridgegen.engine.workers.caller",
        errors: IO[bytes] | None = None,
    ) -> None:
        self._child = Child(
            ["-c", f"from {module} import main; main()"],
            lambda message: said.put((self, message)),
            environment=ONE_THREAD,
            errors=errors,
        )

    @property
    def pid(self) -> int:
        """Its process number."""
        return self._child.pid

    def call(self, function: Callable[..., Any], *arguments: Any, tells: bool = False) -> None:
        """Call a function in the process; its result or exception arrives as a message.

        Args:
            function: importable by its name.
            arguments: its arguments.
            tells: whether its last parameter is a function that sends messages to this process.
        """
        self.ask(function, arguments, tells)

    def ask(self, *request: Any) -> None:
        """Send a request to the module's ``main``."""
        with suppress(OSError):  # it has ended: its last message reports that
            self._child.send(request)

    def end(self) -> int:
        """End the process and its descendants at once; return its exit status."""
        return self._child.end()


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
        return tuple(worker.pid for worker in self._workers)

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
