"""Runs on several cores: processes that each make one run at a time, in one thread.

A process that crashes (out of memory, or by its driver) costs the run that it was making.
"""

import queue
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

from bridgegen.comparison.runs import RunCallbacks, Task, attempt
from bridgegen.compilation.cache import is_compiled
from bridgegen.workers.process import Process, Said
from bridgegen.workers.processes import ending


def run_all(
    tasks: Iterable[Task], at_once: int, callbacks: RunCallbacks, cluster: str | None = None
) -> dict[str, str]:
    """Make runs; no result depends on how many at a time.

    Args:
        tasks: the runs.
        at_once: how many at a time, ≥ 1. With 1, they are made in this process.
        cluster: where their scenarios are simulated, "ray" or "ray://HOST:PORT"; by default, a run
            is one thread.
        callbacks: called as they progress.

    Returns:
        Why runs failed, by name.

    Raises:
        InputError: an argument breaks a rule.
        KeyboardInterrupt: Ctrl-C; every process has ended, and finished evaluations are kept.
    """
    waiting = deque(tasks)
    at_once = min(at_once, len(waiting))
    if at_once > 1:
        return _Pool(waiting, callbacks, cluster).run(at_once)
    return _run_sequentially(waiting, callbacks, cluster)


def _run_sequentially(
    tasks: Iterable[Task], callbacks: RunCallbacks, cluster: str | None
) -> dict[str, str]:
    failures = {}

    def stage(name: str) -> None:
        if name == "compile":
            callbacks.compile()

    for task in tasks:

        def batch(evaluations: int, name: str = task.name) -> None:
            callbacks.batch(name, evaluations)

        failure = attempt(task, cluster, batch, stage)
        if failure is not None:
            failures[task.name] = failure
        callbacks.ended(task.name, failure)
    return failures


class _Pool:
    """Assigns the waiting runs to the processes, one each."""

    def __init__(self, waiting: deque[Task], callbacks: RunCallbacks, cluster: str | None) -> None:
        self._waiting, self._callbacks, self._cluster = waiting, callbacks, cluster
        self._making: dict[Process, Task] = {}
        self._said: Said = queue.SimpleQueue()
        self._failures: dict[str, str] = {}

    def run(self, at_once: int) -> dict[str, str]:
        try:
            # Compiles once, not in every process.
            self._begin(at_once if is_compiled() else 1)
            while self._making:
                process, (kind, *rest) = self._said.get()
                if process in self._making:
                    self._take(process, kind, *rest)
                if kind == "stage" and rest == ["search"]:
                    self._begin(at_once)
        finally:
            for process in self._making:
                process.end()
        return self._failures

    def _begin(self, at_once: int) -> None:
        """Start the missing processes, as far as runs wait."""
        while self._waiting and len(self._making) < at_once:
            self._give(Process(self._said))

    def _give(self, process: Process) -> None:
        """Assign the next run to a process."""
        self._making[process] = task = self._waiting.popleft()
        process.call(make, task, self._cluster, tells=True)

    def _take(self, process: Process, kind: str, *rest: Any) -> None:
        name = self._making[process].name
        if kind == "stage" and rest == ("compile",):
            self._callbacks.compile()
        elif kind == "batch":
            self._callbacks.batch(name, *rest)
        elif kind == "raised":
            raise rest[0]
        elif kind == "answer":
            self._ended(name, rest[0])
            if self._waiting:
                self._give(process)
            else:
                self._leave(process)
        elif kind == "died":
            status = self._leave(process)
            self._ended(name, f"its process ended {ending(status)}")
            self._begin(len(self._making) + 1)

    def _leave(self, process: Process) -> int:
        del self._making[process]
        return process.end()

    def _ended(self, name: str, failure: str | None) -> None:
        if failure is not None:
            self._failures[name] = failure
        self._callbacks.ended(name, failure)


def make(task: Task, cluster: str | None, say: Callable[..., None]) -> str | None:
    """Make a run in a worker process, and report its progress; return why it failed, or None."""
    return attempt(
        task,
        cluster,
        lambda evaluations: say("batch", evaluations),
        lambda stage: say("stage", stage),
    )
