"""A process that we begin, and what we exchange with it: pickled messages, through its pipes.

Not forked, so that it inherits no threads and no compiled code's state. It ends with this process,
however this one ends, and all processes that it has started end with it: see
`bridgegen.supervisor`.
"""

import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
import traceback
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, NoReturn

Say = Callable[..., None]
"""Says something to who began this process; may be called by any thread."""

SUPERVISOR = Path(__file__).with_name("supervisor.py")

END_SECONDS = 10.0
"""So long is the end of a process awaited that has been asked to end; then it is killed."""

DRAIN_SECONDS = 2.0
"""Of a process's pipe and the process itself, one ends so long after the other at most."""


class Child:
    """A process, seen from here, with those that it starts; Ctrl-C is not theirs.

    Args:
        program: what Python is to run, e.g. ``-m`` and a module of ours that calls `connect`.
        take: is given each message of its, a tuple, in a thread; the last is ``("died",)``, when
            the process has ended.
        environment: of it, besides ours.
        errors: takes what it writes to its standard error; ours does by default.
    """

    def __init__(
        self,
        program: Sequence[str],
        take: Callable[[tuple[Any, ...]], None],
        *,
        environment: Mapping[str, str] | None = None,
        errors: IO[bytes] | None = None,
    ) -> None:
        path = {"PYTHONPATH": os.pathsep.join(["", *sys.path])}
        supervisor = [sys.executable, "-I", "-S", str(SUPERVISOR)]
        self._process = process = subprocess.Popen(
            [*supervisor, sys.executable, *program], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=errors, env=os.environ | (environment or {}) | path, start_new_session=True,
        )  # fmt: skip
        ended, read = threading.Event(), threading.Event()
        for work in ((_forward, process, take, ended, read), (_wait, process, take, ended, read)):
            threading.Thread(target=work[0], args=work[1:], daemon=True).start()
        self._end = weakref.finalize(self, _end, process, ended, read)

    @property
    def pid(self) -> int:
        """The number of the process that supervises it."""
        return self._process.pid

    def send(self, message: Any) -> None:
        """Send what can be pickled.

        Raises:
            OSError: it has ended.
        """
        assert self._process.stdin is not None
        _write(self._process.stdin, pickle.dumps(message, protocol=5))

    def kill(self) -> None:
        """End it, from any thread; whoever waits for its messages gets the last."""
        _terminate(self._process)

    def end(self) -> int:
        """End it, if it is running, at once; so does this object's end. Return its exit status.

        It is negative for a signal; that of SIGKILL, too, of a process that cannot be ended.
        """
        self._end()
        status = self._process.returncode
        return -signal.SIGKILL if status is None else status


def _terminate(process: subprocess.Popen[bytes]) -> None:
    """Ask the supervisor to kill the process and what it has started."""
    with suppress(OSError):
        process.terminate()


def _end(process: subprocess.Popen[bytes], ended: threading.Event, read: threading.Event) -> None:
    _terminate(process)
    if not ended.wait(END_SECONDS):  # the supervisor has been stopped, say
        with suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        ended.wait(END_SECONDS)
    if not read.wait(DRAIN_SECONDS):
        return  # somebody else holds its pipes: closing them here might wait for ever
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()


def _wait(
    process: subprocess.Popen[bytes],
    take: Callable[[tuple[Any, ...]], None],
    ended: threading.Event,
    read: threading.Event,
) -> None:
    """Wait for the end of the process itself: a process that it started may hold its pipe."""
    process.wait()
    ended.set()
    read.wait(DRAIN_SECONDS)
    take(("died",))


def _forward(
    process: subprocess.Popen[bytes],
    take: Callable[[tuple[Any, ...]], None],
    ended: threading.Event,
    read: threading.Event,
) -> None:
    """Pass on its messages; end it if it says what is no message, or closes its pipe."""
    assert process.stdout is not None
    with suppress(Exception):
        while True:
            take(pickle.loads(_read(process.stdout)))
    read.set()
    if not ended.wait(DRAIN_SECONDS):
        _terminate(process)


def _write(pipe: IO[bytes], data: bytes) -> None:
    pipe.write(struct.pack("<q", len(data)))
    pipe.write(data)
    pipe.flush()


def _read(pipe: IO[bytes]) -> bytes:
    """Return the next message; both ends are ours, and the other process is trusted."""
    head = pipe.read(8)
    if len(head) < 8:
        raise EOFError
    return pipe.read(struct.unpack("<q", head)[0])


# --- In the other process -------------------------------------------------------------------------


def connect(
    spoken: int = 2, at_end: Callable[[], None] = lambda: None
) -> tuple["queue.SimpleQueue[bytes]", Say]:
    """Return what is asked for, as it comes, pickled, and how to answer.

    Args:
        spoken: where what is printed goes, a file's number: the other output by default.
        at_end: is called when nobody is there any more; then this process ends, whatever it is at.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the job itself ends us
    questions, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    lock = threading.Lock()
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)  # what is read must not be our messages,
    os.dup2(spoken, 1)  # and what is printed must not get between them
    pipes = questions.fileno(), answers.fileno()

    def release_pipes() -> None:
        for pipe in pipes:
            os.dup2(nothing, pipe, inheritable=False)

    os.register_at_fork(after_in_child=release_pipes)  # they close when this process ends

    def say(*message: Any) -> None:
        data = pickle.dumps(message, protocol=5)
        with lock:
            _write(answers, data)

    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(questions, requests, at_end), daemon=True).start()
    return requests, say


def leave(error: BaseException) -> NoReturn:
    """End this process as Python would for an exception that nobody caught, but at once.

    Python would first wait for threads and processes that the driver has started.
    """
    status: Any = 1
    if isinstance(error, SystemExit):
        status = error.code if isinstance(error.code, int | None) else 1
        if status != error.code:
            print(error.code, file=sys.stderr)
    else:
        traceback.print_exception(error)
    for stream in (sys.stdout, sys.stderr):
        with suppress(Exception):
            stream.flush()
    os._exit((status or 0) & 0xFF)


def _listen(
    questions: IO[bytes], requests: "queue.SimpleQueue[bytes]", at_end: Callable[[], None]
) -> None:
    try:
        while True:
            requests.put(_read(questions))
    except (EOFError, OSError):
        at_end()
    finally:
        os._exit(0)
