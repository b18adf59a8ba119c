"""A process that calls functions on request; this is the side of its parent."""

import os
import queue
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Any

from bridgegen.base.processes.child import ONE_THREAD, Child

Said = queue.SimpleQueue[tuple["Process | None", tuple[Any, ...]]]
"""Messages of processes: ("started",), ("answer", result), ("raised", exception), ("died",) when
the process has ended, and the messages of functions that are called with ``tells``; those of no
process end the wait for one."""


def cores() -> int:
    """Return the number of cores that this process may use."""
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
