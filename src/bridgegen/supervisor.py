"""Between this process and a child of it: starts the child, and ends all that the child started.

Run as a program by `bridgegen.child`: ``python supervisor.py PROGRAM ARGUMENT…``. The program gets
the standard streams as they are. When it ends, when this process is sent SIGTERM, or when nobody
holds the other end of the standard input any more, every process that descends from the program is
killed; then this process ends as the program did, with its exit status or by its signal.

On Linux a process that has left its parent (a daemon, or one whose parent ended) is found, too:
it becomes a child of this process. Elsewhere the program's process group is killed.

It is single-threaded and imports nothing of ours, so it starts in a few milliseconds and may fork.
"""

import ctypes
import os
import resource
import select
import signal
import sys
import time
from contextlib import suppress

HANG_UP_SECONDS = 2.0
"""So long may the program take to end by itself when its standard input ends: it may tidy up."""

KILL_SECONDS = 5.0
"""So long the end of killed processes is awaited: one may be stuck in the kernel."""

_POLL = 0.01
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36


def main() -> None:
    """Run the program of the command line, and end as it ends."""
    status = supervise(sys.argv[1:])
    if status < 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # the program has left one, if any
        if -status != signal.SIGKILL:
            signal.signal(-status, signal.SIG_DFL)
        os.kill(os.getpid(), -status)
    os._exit(status if status >= 0 else 128 - status)


def supervise(program: list[str]) -> int:
    """Start a program, wait for its end, end its descendants; return its exit status.

    Returns:
        The exit status; negative is the number of the signal that ended it.
    """
    woken, wakes = os.pipe()
    for end in (woken, wakes):
        os.set_blocking(end, False)
    signal.set_wakeup_fd(wakes, warn_on_full_buffer=False)
    asked: list[int] = []
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the job itself ends us
    signal.signal(signal.SIGTERM, lambda number, frame: asked.append(number))
    signal.signal(signal.SIGCHLD, lambda number, frame: None)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    child = _start(program)
    os.dup2(2, 1)  # the program alone holds the way to answer
    poll = select.poll()
    poll.register(0, 0)  # reports a hang-up only: what is sent is the program's
    poll.register(woken, select.POLLIN)
    status: int | None = None
    deadline: float | None = None
    while status is None and not asked:
        left = None if deadline is None else 1000.0 * max(deadline - time.monotonic(), 0.0)
        ready = [number for number, _ in poll.poll(left)]
        if woken in ready:
            with suppress(BlockingIOError):
                os.read(woken, 4096)
        if 0 in ready:
            poll.unregister(0)
            deadline = time.monotonic() + HANG_UP_SECONDS
        status = _reap(child)
        if deadline is not None and time.monotonic() >= deadline:
            break
    return _end_all(child, status)


def _start(program: list[str]) -> int:
    """Start the program in a process group of its own; return its number."""
    parent = os.getpid()
    child = os.fork()
    if child:
        return child
    try:
        os.setpgid(0, 0)
        _prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() == parent:
            os.execv(program[0], program)
    finally:
        os._exit(127)


def _prctl(option: int, value: int) -> None:
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def _reap(child: int) -> int | None:
    """Collect the processes that have ended; return the status of the program if it is among them.

    Raises:
        ChildProcessError: there are none left, running or ended; the program's end is known.
    """
    found = None
    while True:
        number, status = os.waitpid(-1, os.WNOHANG)
        if number == 0:
            return found
        if number == child:
            return os.waitstatus_to_exitcode(status)


def _end_all(child: int, status: int | None) -> int:
    """Kill all descendants, and wait for their end; return the program's status."""
    deadline = time.monotonic() + KILL_SECONDS
    with suppress(OSError):
        os.killpg(child, signal.SIGKILL)
    with suppress(ChildProcessError):
        while time.monotonic() < deadline:
            ended = _reap(child)
            status = ended if status is None else status
            for number in _descendants():
                with suppress(OSError):
                    os.kill(number, signal.SIGKILL)
            time.sleep(_POLL)
    return -signal.SIGKILL if status is None else status


def _descendants() -> list[int]:
    """Return the processes that descend from this one; none where there is no /proc."""
    parents: dict[int, list[int]] = {}
    try:
        numbers = [int(name) for name in os.listdir("/proc") if name.isdecimal()]
    except OSError:
        return []
    for number in numbers:
        try:
            with open(f"/proc/{number}/stat", "rb") as file:
                fields = file.read().rpartition(b")")[2].split()
        except OSError:  # it has ended
            continue
        parents.setdefault(int(fields[1]), []).append(number)
    found = parents.get(os.getpid(), [])
    for number in found:  # grows as it is gone through
        found += parents.get(number, [])
    return found


if __name__ == "__main__":
    main()
