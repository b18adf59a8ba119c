"""A lock of a server: one scenario runs at a time, of all processes on this machine.

Two that ticked one server would each disturb the other's scenarios.
"""

import os
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import IO

POLL = 0.02
"""Interval between two attempts to get the lock [s]."""


class Turn:
    """A lock against other threads, and by a file against other processes; may be nested.

    Args:
        name: of what it is for.
    """

    def __init__(self, name: str) -> None:
        self._lock, self._depth = threading.RLock(), 0
        user = os.getuid() if hasattr(os, "getuid") else 0
        plain = "".join(one if one.isalnum() else "-" for one in name)
        self._path = Path(tempfile.gettempdir()) / f"bridgegen-{user}-carla-{plain}.lock"
        self._file: IO[str] | None = None

    def __enter__(self) -> None:
        self._lock.acquire()
        self._depth += 1
        if self._depth == 1 and sys.platform != "win32":
            import fcntl

            self._file = self._path.open("a")
            while True:
                try:
                    fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    time.sleep(POLL)
                else:
                    return

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
        if self._depth == 0 and self._file is not None:
            self._file.close()  # which unlocks it
            self._file = None
        self._lock.release()


_turns: dict[str, Turn] = {}


def turn_at(address: str) -> Turn:
    """Return the lock of a server, one per process."""
    return _turns.setdefault(address, Turn(address))
