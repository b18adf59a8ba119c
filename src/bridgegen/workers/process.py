"""A process that calls functions for us, seen from here."""

import queue
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Any

from bridgegen.child import Child

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment of a process that leaves the other cores to the other processes."""

Said = queue.SimpleQueue[tuple["Process", tuple[Any, ...]]]
"""What processes say: ("begun",), ("answer", what came), ("raised", the exception), ("died",), and
whatever else a function says that is given a way to."""


class Process:
    """A process, one for one thread; it ends with this one, however this one ends.

    Args:
        said: takes what it says.
        module: whose ``main`` it runs.
        errors: takes what it writes to its standard error; ours does by default.
    """

    def __init__(
        self, said: Said, module: str = "bridgegen.workers.caller", errors: IO[bytes] | None = None
    ) -> None:
        self._child = Child(
            ["-c", f"from {module} import main; main()"],
            lambda message: said.put((self, message)),
            environment=ONE_THREAD,
            errors=errors,
        )

    @property
    def pid(self) -> int:
        """Its number."""
        return self._child.pid

    def call(self, function: Callable[..., Any], *arguments: Any, tells: bool = False) -> None:
        """Have a function called; what it returns or raises will be said.

        Args:
            function: importable by its name.
            arguments: of it.
            tells: whether it takes, as its last argument, a function that says something here.
        """
        self.ask(function, arguments, tells)

    def ask(self, *request: Any) -> None:
        """Send a request, as the module's ``main`` understands it."""
        with suppress(OSError):  # it has died: the last that it says tells
            self._child.send(request)

    def end(self) -> int:
        """End the process and those that it has begun, at once; return its exit status."""
        return self._child.end()
