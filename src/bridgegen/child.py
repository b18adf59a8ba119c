"""A process that we begin, and what we exchange with it: pickled messages, through its pipes.

Not forked, so that it inherits no threads and no compiled code's state. It ends with this process,
however this one ends.
"""

import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import IO, Any

Say = Callable[..., None]
"""Says something to who began this process; may be called by any thread."""


class Child:
    """A process, seen from here.

    Args:
        program: what Python is to run, e.g. ``-m`` and a module of ours that calls `connect`.
        take: is given each message of its, a tuple, in a thread; the last is ``("died",)``.
        apart: whether it has a session of its own: Ctrl-C is not its, and those that it has begun
            end with it.
        environment: of it, besides ours.
        errors: takes what it writes to its standard error; ours does by default.
    """

    def __init__(
        self,
        program: Sequence[str],
        take: Callable[[tuple[Any, ...]], None],
        *,
        apart: bool = False,
        environment: Mapping[str, str] | None = None,
        errors: IO[bytes] | None = None,
    ) -> None:
        path = {"PYTHONPATH": os.pathsep.join(["", *sys.path])}
        self._process = process = subprocess.Popen(
            [sys.executable, *program], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=errors, env=os.environ | (environment or {}) | path, start_new_session=apart,
        )  # fmt: skip
        reader = threading.Thread(target=_forward, args=(process.stdout, take), daemon=True)
        reader.start()
        self._apart = apart
        self._end = weakref.finalize(self, _end, process, reader, apart)

    @property
    def pid(self) -> int:
        """Its number."""
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
        _kill(self._process, self._apart)

    def end(self) -> int:
        """End it, if it is running, at once; so does this object's end. Return its exit status."""
        self._end()
        return self._process.wait()


def _kill(process: subprocess.Popen[bytes], apart: bool) -> None:
    with suppress(OSError):
        if apart:
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()


def _end(process: subprocess.Popen[bytes], reader: threading.Thread, apart: bool) -> None:
    _kill(process, apart)
    process.wait()
    reader.join()  # the pipe has ended
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()


def _forward(pipe: IO[bytes], take: Callable[[tuple[Any, ...]], None]) -> None:
    try:
        while True:
            take(pickle.loads(_read(pipe)))
    except Exception:  # it has ended, or says what is no message
        take(("died",))


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
    answers, lock = os.fdopen(os.dup(1), "wb"), threading.Lock()
    os.dup2(spoken, 1)  # what is printed must not get between our messages

    def say(*message: Any) -> None:
        data = pickle.dumps(message, protocol=5)
        with lock:
            _write(answers, data)

    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, at_end), daemon=True).start()
    return requests, say


def _listen(requests: "queue.SimpleQueue[bytes]", at_end: Callable[[], None]) -> None:
    try:
        while True:
            requests.put(_read(sys.stdin.buffer))
    except (EOFError, OSError):
        at_end()
    finally:
        os._exit(0)
