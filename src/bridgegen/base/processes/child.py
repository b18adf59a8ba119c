"""Child processes: of Python, with pickled messages through standard input and output; or any.

It is not forked, so that it inherits neither threads nor the state of compiled code. It ends when
this process ends, for whatever reason, and its descendants end with it: see
`bridgegen.base.processes.supervisor`.
"""

import gc
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
"""Function that sends a message to the parent process; may be called by any thread."""

SUPERVISOR = Path(__file__).with_name("supervisor.py")

END_SECONDS = 10.0
"""Time after which a process that has been asked to end is killed [s]."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment of a process whose libraries use one thread."""

DRAIN_SECONDS = 2.0
"""Maximum time between the end of a process and the end of its pipe [s]."""


class Child:
    """A child process with its descendants; they do not receive Ctrl-C.

    Args:
        program: arguments of Python, e.g. ``-m`` and a module that calls `connect`.
        take: is called with each message, a tuple, in a thread; the last message is ``("died",)``,
            when the process has ended.
        environment: variables that are added to this process's environment.
        errors: receives its standard error; this process's standard error by default.
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
        # The child imports from where this process does: a source tree or a thin virtual
        # environment may be on ``sys.path`` only.
        self._process = process = _start(
            [sys.executable, *program], errors, os.environ | (environment or {}) | path
        )
        ended, read = threading.Event(), threading.Event()
        for work in ((_forward, process, take, ended, read), (_wait, process, take, ended, read)):
            threading.Thread(target=work[0], args=work[1:], daemon=True).start()
        self._end = weakref.finalize(self, _end, process, ended, read)

    @property
    def pid(self) -> int:
        """The process number of its supervisor."""
        return self._process.pid

    def send(self, message: Any) -> None:
        """Send a message that can be pickled.

        Raises:
            OSError: it has ended.
        """
        assert self._process.stdin is not None
        _write(self._process.stdin, pickle.dumps(message, protocol=5))

    def kill(self) -> None:
        """End it, from any thread; its last message is still delivered."""
        _terminate(self._process)

    def end(self) -> int:
        """End it at once, as does this object's deletion; return its exit status.

        A signal's status is its negative number; −SIGKILL also if the process cannot be ended.
        """
        self._end()
        status = self._process.returncode
        return -signal.SIGKILL if status is None else status


class Program:
    """A program with its descendants, and the pipes of its standard input and output.

    It ends when this process ends, or when this object is deleted; it does not receive Ctrl-C.

    Args:
        words: the path of the program, and its arguments.
    """

    def __init__(self, words: Sequence[str]) -> None:
        self._process = _start(words, None, None)
        self._end = weakref.finalize(self, _end_program, self._process)

    @property
    def pipes(self) -> tuple[int, int]:
        """File descriptors: of its standard output, to read; and of its standard input."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        return self._process.stdout.fileno(), self._process.stdin.fileno()

    def kill(self) -> None:
        """End it, from any thread; its pipes are still open."""
        _terminate(self._process)

    def end(self, seconds: float = 0.0) -> int:
        """End it, unless it ends by itself within so many seconds; return its exit status.

        A signal's status is its negative number; −SIGKILL also if the program cannot be ended.
        """
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)
        self._end()
        status = self._process.returncode
        return -signal.SIGKILL if status is None else status


def _start(
    words: Sequence[str], errors: IO[bytes] | None, environment: Mapping[str, str] | None
) -> subprocess.Popen[bytes]:
    """Start a program below a supervisor."""
    return subprocess.Popen(
        # The supervisor needs the standard library only: without site-packages it starts in a few
        # ms, and no variable of the environment changes what it runs.
        [sys.executable, "-I", "-S", str(SUPERVISOR), *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        env=environment,
        # A terminal sends Ctrl-C to all processes of the foreground group. Here the search alone
        # gets it, and ends its children.
        start_new_session=True,
    )


def _end_program(process: subprocess.Popen[bytes]) -> None:
    _terminate(process)
    try:
        process.wait(END_SECONDS)
    except subprocess.TimeoutExpired:  # the supervisor has been stopped, for example
        with suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        with suppress(subprocess.TimeoutExpired):
            process.wait(END_SECONDS)
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()


def _terminate(process: subprocess.Popen[bytes]) -> None:
    """Ask the supervisor to kill the process and its descendants."""
    with suppress(OSError):
        process.terminate()


def _end(process: subprocess.Popen[bytes], ended: threading.Event, read: threading.Event) -> None:
    _terminate(process)
    if not ended.wait(END_SECONDS):  # the supervisor has been stopped, for example
        with suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        ended.wait(END_SECONDS)
    if not read.wait(DRAIN_SECONDS):
        return  # another process holds its pipes: closing them here might block
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
    """Wait for the end of the process itself: a descendant may hold its pipe open."""
    process.wait()
    ended.set()
    # Its last messages may still be in the pipe: they come before "died".
    read.wait(DRAIN_SECONDS)
    take(("died",))


def _forward(
    process: subprocess.Popen[bytes],
    take: Callable[[tuple[Any, ...]], None],
    ended: threading.Event,
    read: threading.Event,
) -> None:
    """Forward its messages; end it if it sends an invalid message or closes its pipe."""
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
    """Return the next message; the process at the other end is trusted."""
    head = pipe.read(8)
    if len(head) < 8:
        raise EOFError
    return pipe.read(struct.unpack("<q", head)[0])


# --- In the child process -------------------------------------------------------------------------


def connect(
    stdout: int = 2, at_end: Callable[[], None] = lambda: None
) -> tuple["queue.SimpleQueue[bytes]", Say]:
    """Return the queue of pickled requests, and the function that sends messages.

    Args:
        stdout: file descriptor that receives printed output; standard error by default.
        at_end: is called when the parent process has ended; then this process ends at once.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    questions, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    lock = threading.Lock()
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)  # code here must not read requests,
    os.dup2(stdout, 1)  # and must not print between messages
    pipes = questions.fileno(), answers.fileno()

    def release_pipes() -> None:
        for pipe in pipes:
            os.dup2(nothing, pipe, inheritable=False)

    os.register_at_fork(after_in_child=release_pipes)  # they close when this process ends

    def say(*message: Any) -> None:
        data = pickle.dumps(message, protocol=5)
        # A message is two writes; those of two threads must not mix.
        with lock:
            _write(answers, data)

    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(questions, requests, at_end), daemon=True).start()
    return requests, say


def leave(error: BaseException) -> NoReturn:
    """End this process as Python does after an uncaught exception, but at once.

    Python would first wait for the threads and processes that this process has started.
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


# --- How often Python looks for cyclic garbage in the processes that are BridgeGen's own ---


RARELY = (50_000, 20, 50)
"""Thresholds of Python's collector.

With its own, (700, 10, 10), a short search collects 704 times, which takes 0.7 s of its 5.6 s of
processor time; with these, 9 times and 0.2 s. Memory is the same, 289 MB (crossroads-s4 with a
budget of 80).
"""


def collect_rarely() -> None:
    """Look for cyclic garbage less often in this process; it must belong to BridgeGen."""
    gc.set_threshold(*RARELY)
