"""Work in a process of its own, so that what it does cannot end the job.

What is called there may raise, take too long, or take its process down with it: that costs the call
and nothing else. The process is ended then, and another one is begun for the next.
"""

import contextlib
import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable, Sequence
from typing import IO, Any

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
        apart: whether it has a session of its own: it is not killed with this one, but ends by
            itself as soon as this one has.
    """

    def __init__(
        self,
        module: str,
        arguments: Sequence[str] = (),
        error: type[CallError] = CallError,
        *,
        apart: bool = False,
    ) -> None:
        self._command = [sys.executable, "-m", module, *arguments]
        self._error, self._apart = error, apart
        self._process: subprocess.Popen[bytes] | None = None
        self._answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

    @property
    def runs(self) -> bool:
        """Whether it has been started, and not ended since."""
        return self._process is not None

    def start(self, seconds: float) -> Any:
        """Begin the process; return its greeting.

        Args:
            seconds: that this may take.

        Raises:
            CallError: it cannot be begun.
        """
        process = self._process = subprocess.Popen(
            self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(["", *sys.path])},
            start_new_session=self._apart,
        )  # fmt: skip
        assert process.stdout is not None
        self._answers = queue.SimpleQueue()
        reader = threading.Thread(
            target=_forward, args=(process.stdout, self._answers), daemon=True
        )
        reader.start()
        self._end = weakref.finalize(self, _end, process, reader)
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
        process = self._process
        assert process is not None
        assert process.stdin is not None
        try:
            _write(process.stdin, request)
        except OSError:
            self.close()
            raise self._error("died", "its process has ended") from None
        return self._answer(seconds, progress)

    def kill(self) -> None:
        """End the process from another thread: who waits for it gets a `CallError`."""
        process = self._process
        if process is not None:
            process.kill()

    def close(self) -> None:
        """End the process, if it is running; so does this object's end."""
        if self._process is not None:
            self._end()
        self._process = None

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
            status = self._process.wait() if self._process else None
            self.close()
            raise self._error("died", f"its process ended with status {status}")
        raise self._error(kind, rest[0])


def _end(process: subprocess.Popen[bytes], reader: threading.Thread) -> None:
    process.kill()
    process.wait()
    reader.join()  # the pipe has ended
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with contextlib.suppress(OSError):
                pipe.close()


def _forward(pipe: IO[bytes], answers: "queue.SimpleQueue[Any]") -> None:
    """Put what comes out of a pipe into a queue: only that can be waited for with a limit."""
    try:
        while True:
            answers.put(_read(pipe))
    except (EOFError, OSError, ValueError, pickle.UnpicklingError):
        answers.put(("died",))


def _write(pipe: IO[bytes], message: Any) -> None:
    data = pickle.dumps(message, protocol=5)
    pipe.write(struct.pack("<q", len(data)))
    pipe.write(data)
    pipe.flush()


def _read(pipe: IO[bytes]) -> Any:
    """Return the next message; both ends are ours, and the other process is trusted."""
    head = pipe.read(8)
    if len(head) < 8:
        raise EOFError
    return pickle.loads(pipe.read(struct.unpack("<q", head)[0]))


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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the job itself ends us
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(spoken, 1)  # what is printed must not get between our answers
    try:
        greeting, answer = make()
    except Exception as error:
        _write(answers, _failure(error, told))
        return
    _write(answers, ("answer", greeting))
    requests: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, at_end), daemon=True).start()
    while True:
        request = requests.get()
        try:
            message: tuple[str, Any] = ("answer", answer(*request))
        except Exception as error:
            message = _failure(error, told)
        _write(answers, message)


def _listen(requests: "queue.SimpleQueue[Any]", at_end: Callable[[], None]) -> None:
    """Take requests; once nobody is there to make any, the process ends, whatever it is at."""
    try:
        while True:
            requests.put(_read(sys.stdin.buffer))
    except (EOFError, OSError):
        at_end()
    finally:
        os._exit(0)


def _failure(error: Exception, told: Callable[[Exception], str]) -> tuple[str, str]:
    if isinstance(error, CallError):
        return error.kind, str(error)
    return "raised", told(error)
