"""Work in a process of its own, so that what it does cannot end the job.

What is called there may raise, take too long, or take its process down with it: that costs the call
and nothing else. The process is ended then, and another one is begun for the next.
"""

import pickle
import queue
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from bridgegen.child import Child, Say, connect, leave

Answer = Callable[..., Any]
"""Answers a request, in the other process."""


class CallError(Exception):
    """A call was not answered.

    Attributes:
        kind: "raised", "timed out", "died", or a word of whoever answers.
    """

    def __init__(self, kind: str, message: str) -> None:
        super().__init__(message)
        self.kind = kind


class IsolatedProcess:
    """A process that answers calls, one at a time.

    Args:
        module: of ours; run as a program, it calls ``main``.
        arguments: of that program.
        error: what is raised where a call is not answered.
    """

    def __init__(
        self,
        module: str,
        arguments: Sequence[str] = (),
        error: type[CallError] = CallError,
    ) -> None:
        self._program, self._error = ["-m", module, *arguments], error
        self._child: Child | None = None
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

    @property
    def runs(self) -> bool:
        """Whether it has been started, and not ended since."""
        return self._child is not None

    def start(self, seconds: float) -> Any:
        """Begin the process; return its greeting.

        Args:
            seconds: that this may take.

        Raises:
            CallError: it cannot be begun.
        """
        self._answers = queue.SimpleQueue()
        self._child = Child(self._program, self._answers.put)
        try:
            return self._answer(seconds)
        except CallError:
            self.close()
            raise

    def ask(self, *request: Any, seconds: float, progress: Callable[[], int] | None = None) -> Any:
        """Return the answer to a request; the process must run.

        Args:
            request: what can be pickled.
            seconds: that it may take.
            progress: what changes while it gets on; the limit is for each change.

        Raises:
            CallError: it was not answered; unless it "raised", or as `Answer` says, the process
                has ended.
        """
        assert self._child is not None
        with suppress(OSError):  # it has ended: the last that it says tells how
            self._child.send(request)
        return self._answer(seconds, progress)

    def kill(self) -> None:
        """End the process from another thread: who waits for it gets a `CallError`."""
        child = self._child
        if child is not None:
            child.kill()

    def close(self) -> None:
        """End the process, if it is running; so does this object's end."""
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
                before, so_far = so_far, progress() if progress else so_far
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


# --- In the other process -------------------------------------------------------------------------


def serve(
    make: Callable[[], tuple[Any, Answer]],
    told: Callable[[Exception], str] = str,
    spoken: int = 2,
    at_end: Callable[[], None] = lambda: None,
) -> None:
    """Answer requests until nobody is there to make any.

    Args:
        make: returns the greeting, and what answers requests.
        told: says an exception in one line.
        spoken: where what is printed goes, a file's number: the other output by default.
        at_end: is called when nobody is there any more.
    """
    requests, say = connect(spoken, at_end)
    try:
        _serve(make, told, requests, say)
    except BaseException as error:  # sys.exit, say
        leave(error)


def _serve(
    make: Callable[[], tuple[Any, Answer]],
    told: Callable[[Exception], str],
    requests: "queue.SimpleQueue[bytes]",
    say: Say,
) -> None:
    try:
        greeting, answer = make()
    except Exception as error:
        say(*_failure(error, told))
        return
    say("answer", greeting)
    while True:
        request = requests.get()
        try:
            message: tuple[str, Any] = ("answer", answer(*pickle.loads(request)))
        except Exception as error:
            message = _failure(error, told)
        say(*message)


def _failure(error: Exception, told: Callable[[Exception], str]) -> tuple[str, str]:
    if isinstance(error, CallError):
        return error.kind, str(error)
    return "raised", told(error)
