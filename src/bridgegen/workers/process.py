"""A process that calls functions for us, seen from here."""

import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Any

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
        self, said: Said, module: str = "bridgegen.workers.child", errors: IO[bytes] | None = None
    ) -> None:
        self._said = said
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"from {module} import main; main()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            env=os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(["", *sys.path])},
            start_new_session=True,  # Ctrl-C is ours, and a driver's process ends with it
        )
        self._reader = threading.Thread(target=self._listen, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Its number."""
        return self._process.pid

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
        assert self._process.stdin is not None
        data = pickle.dumps(request, protocol=5)
        with suppress(OSError):  # it has died: the reader says so
            pickle.dump(data, self._process.stdin, protocol=5)
            self._process.stdin.flush()

    def end(self) -> int:
        """End the process and those that it has begun, at once; return its exit status."""
        with suppress(OSError):
            os.killpg(self._process.pid, signal.SIGKILL)
        status = self._process.wait()
        self._reader.join()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()
        return status

    def _listen(self) -> None:
        assert self._process.stdout is not None
        try:
            while True:
                self._said.put((self, pickle.load(self._process.stdout)))
        except (EOFError, OSError, pickle.UnpicklingError, ValueError):
            self._said.put((self, ("died",)))
