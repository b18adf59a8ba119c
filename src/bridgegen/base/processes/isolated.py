"""Calls into a process of its own, so that a crash cannot end this process.

A call may raise, take too long or crash its process: only that call fails. After a timeout or a
crash, the next call needs a new process.
"""

import pickle
import queue
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from bridgegen.base.processes.child import Child, Say, connect, leave

Answer = Callable[..., Any]
"""Function that answers a request, in the isolated process."""


class CallError(Exception):
    """A call was not answered.

    Attributes:
        kind: "raised", "timed out", "died", or a word that the answering function chooses.
    """

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind


class IsolatedProcess:
    """A process that answers calls, one at a time.

    Args:
        module: is run as a program.
        arguments: of the program.
        error: is raised if a call is not answered.
        environment: variables that are added to this process's environment.
    """

    def __init__(
        self,
        module: str,
        arguments: Sequence[str] = (),
        error: type[CallError] = CallError,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._program, self._error = ["-m", module, *arguments], error
        self._environment = environment
        self._child: Child | None = None
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

    @property
    def runs(self) -> bool:
        """Whether it has been started and not closed since."""
        return self._child is not None

    def start(self, seconds: float) -> Any:
        """Start the process; return its first answer.

        Args:
            seconds: time limit [s].

        Raises:
            CallError: it cannot be started.
        """
        # A new queue: the last messages of an earlier process must not be taken for this one's.
        self._answers = queue.SimpleQueue()
        self._child = Child(self._program, self._answers.put, environment=self._environment)
        try:
            return self._answer(seconds)
        except CallError:
            self.close()
            raise

    def ask(self, *request: Any, seconds: float, progress: Callable[[], int] | None = None) -> Any:
        """Return the answer to a request; the process must run.

        Args:
            request: objects that can be pickled.
            seconds: time limit [s].
            progress: returns a counter that grows while the process works; each change restarts
                the time limit.

        Raises:
            CallError: it was not answered. The process has ended, unless the kind is "raised" or a
                word of the answering function.
        """
        assert self._child is not None
        with suppress(OSError):  # it has ended: its last message reports that
            self._child.send(request)
        return self._answer(seconds, progress)

    def kill(self) -> None:
        """End the process from another thread: a waiting ``ask`` raises `CallError`."""
        child = self._child
        if child is not None:
            child.kill()

    def close(self) -> None:
        """End the process, as does this object's deletion."""
        if self._child is not None:
            self._child.end()
        self._child = None

    def _answer(self, seconds: float, progress: Callable[[], int] | None = None) -> Any:
        so_far = progress() if progress else 0
        while True:
            try:
                kind, *rest = self._answers.get(timeout=seconds)
                break
            except queue.Empty:
                # A request may be a whole row of a slow simulator. The counter makes the limit one
                # for an instant, so that a long row is not a hanging one.
                before, so_far = so_far, progress() if progress else so_far
                # The process is ended, not asked: compiled code that loops for ever takes no
                # exception.
                if so_far == before:
                    self.close()
                    raise self._error("timed out", f"no answer within {seconds:g} s") from None
        if kind == "answer":
            return rest[0]
        if kind == "died":
            status = self._child.end() if self._child else None
            self.close()
            raise self._error("died", f"its process ended with status {status}")
        raise self._error(kind, rest[0])


# --- In the isolated process ----------------------------------------------------------------------


def serve(
    make: Callable[[], tuple[Any, Answer]],
    describe: Callable[[Exception], str] = str,
    stdout: int = 2,
    at_end: Callable[[], None] = lambda: None,
) -> None:
    """Answer requests until the parent process ends.

    Args:
        make: returns the first answer, and the function that answers requests.
        describe: returns an exception in one line.
        stdout: file descriptor that receives printed output; standard error by default.
        at_end: is called when the parent process has ended.
    """
    requests, say = connect(stdout, at_end)
    try:
        _serve(make, describe, requests, say)
    except BaseException as error:  # sys.exit, for example
        leave(error)


def _serve(
    make: Callable[[], tuple[Any, Answer]],
    describe: Callable[[Exception], str],
    requests: "queue.SimpleQueue[bytes]",
    say: Say,
) -> None:
    try:
        first, answer = make()
    except Exception as error:
        say(*_failure(error, describe))
        return
    say("answer", first)
    while True:
        request = requests.get()
        try:
            message: tuple[str, Any] = ("answer", answer(*pickle.loads(request)))
        except Exception as error:
            message = _failure(error, describe)
        say(*message)


def _failure(error: Exception, describe: Callable[[Exception], str]) -> tuple[str, str]:
    if isinstance(error, CallError):
        return error.kind, str(error)
    return "raised", describe(error)
