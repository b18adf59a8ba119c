"""Tasks on several cores: processes that each do one at a time, in one thread.

A process that crashes (out of memory, or by its driver) costs the task that it was doing.
"""

import queue
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

from bridgegen.base.compilation.cache import is_compiled
from bridgegen.engine.workers.processes import Process, Said, ending

Task = TypeVar("Task")

READY = "ready"
"""The message of a task whose kernels are compiled: others may begin."""


class TaskPool(Generic[Task]):
    """Assigns waiting tasks to processes, one each.

    Args:
        tasks: to do, in this order.
        work: does a task in a process: called with it, ``args``, and a function that sends messages
            to ``heard``; importable by its name.
        args: further arguments of ``work``; can be pickled.
        heard: called with a task and a message of it: its kind, and what follows.
        ended: called with a task, its result, and why there is none or None.
    """

    def __init__(
        self,
        tasks: Iterable[Task],
        work: Callable[..., Any],
        args: tuple[Any, ...] = (),
        *,
        heard: Callable[..., None] = lambda task, kind, *rest: None,
        ended: Callable[[Task, Any, str | None], None],
    ) -> None:
        self._waiting, self._work, self._args = deque(tasks), work, args
        self._heard, self._ended = heard, ended
        self._doing: dict[Process, Task] = {}
        self._said: Said = queue.SimpleQueue()

    def run(self, at_once: int) -> None:
        """Do all tasks, some at a time.

        Raises:
            Exception: what a task raises; all processes have ended.
        """
        try:
            # Compiles once, not in every process.
            self._begin(at_once if is_compiled() else 1)
            while self._doing:
                process, (kind, *rest) = self._said.get()
                if process in self._doing:
                    self._take(process, kind, *rest)
                if kind in (READY, "answer"):
                    self._begin(at_once)
        finally:
            for process in self._doing:
                process.end()

    def _begin(self, at_once: int) -> None:
        """Start the missing processes, as far as tasks wait."""
        while self._waiting and len(self._doing) < at_once:
            self._give(Process(self._said))

    def _give(self, process: Process) -> None:
        """Assign the next task to a process."""
        self._doing[process] = task = self._waiting.popleft()
        process.call(self._work, task, *self._args, tells=True)

    def _take(self, process: Process, kind: str, *rest: Any) -> None:
        task = self._doing[process]
        if kind == "raised":
            raise rest[0]
        if kind == "answer":
            self._ended(task, rest[0], None)
            if self._waiting:
                self._give(process)
            else:
                self._leave(process)
        elif kind == "died":
            status = self._leave(process)
            self._ended(task, None, f"its process ended {ending(status)}")
            self._begin(len(self._doing) + 1)
        elif kind not in ("started", READY):
            self._heard(task, kind, *rest)

    def _leave(self, process: Process) -> int:
        del self._doing[process]
        return process.end()
