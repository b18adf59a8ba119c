"""A supervisor process: starts a program, and ends all descendants of it.

`bridgegen.base.processes.child` runs it: ``python supervisor.py PROGRAM ARGUMENT…``. The program
inherits the standard streams. When the program ends, when the supervisor receives SIGTERM, or when
the other end of the standard input is closed, all descendants of the program are killed; then the
supervisor ends as the program did, with its exit status or by its signal.

On Linux, orphans (daemons, or processes whose parent ended) are killed, too: they become children
of the supervisor. On other systems the program's process group is killed.

It is single-threaded and imports only the standard library: it starts in a few ms and may fork.
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
"""Time for the program to end by itself after its standard input ends [s]."""

KILL_SECONDS = 5.0
"""Maximum wait for killed processes to end [s]: one may be stuck in the kernel."""

_POLL = 0.01
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36


def main() -> None:
    """Run the program of the command line, and end as it ends."""
    status = supervise(sys.argv[1:])
    if status < 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # the program has written one, if any
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
    # A signal between the test of the loop and `poll` would go unnoticed; its byte in this pipe
    # ends the poll.
    signal.set_wakeup_fd(wakes, warn_on_full_buffer=False)
    terminations: list[int] = []
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    signal.signal(signal.SIGTERM, lambda number, frame: terminations.append(number))
    # Without a handler SIGCHLD is dropped, and no byte arrives.
    signal.signal(signal.SIGCHLD, lambda number, frame: None)
    _prctl(_PR_SET_CHILD_SUBREAPER, 1)
    child = _start(program)
    os.dup2(2, 1)  # only the program holds the output pipe
    poll = select.poll()
    poll.register(0, 0)  # hang-ups only: the program reads the data
    poll.register(woken, select.POLLIN)
    status: int | None = None
    deadline: float | None = None
    while status is None and not terminations:
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
        # The parent may have ended before the kernel was asked to signal that: then nobody would.
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
        ChildProcessError: no child is left; the program's status is known.
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
            # Listed anew in each round: a process may fork between the list and its end.
            for number in _descendants():
                with suppress(OSError):
                    os.kill(number, signal.SIGKILL)
            time.sleep(_POLL)
    return -signal.SIGKILL if status is None else status


def _descendants() -> list[int]:
    """Return the descendants of this process; none on systems without /proc."""
    parents: dict[int, list[int]] = {}
    try:
        numbers = [int(name) for name in os.listdir("/proc") if name.isdecimal()]
    except OSError:
        return []
    for number in numbers:
        try:
            with open(f"/proc/{number}/stat", "rb") as file:
                # The second field is the program's name in parentheses, which may hold blanks and
                # parentheses.
                fields = file.read().rpartition(b")")[2].split()
        except OSError:  # it has ended
            continue
        parents.setdefault(int(fields[1]), []).append(number)
    found = parents.get(os.getpid(), [])
    for number in found:  # grows during the iteration
        found += parents.get(number, [])
    return found


if __name__ == "__main__":
    main()
