"""Runs on several cores: processes that each make one run at a time, in one thread.

A process that dies (out of memory, a driver that takes it down) costs the run that it was making.
"""

import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from bridgegen.comparison.runs import Task, Watcher, attempt
from bridgegen.compiled import is_compiled
from bridgegen.errors import InputError

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment of a process that leaves the other cores to the other processes."""


def run_all(tasks: Iterable[Task], jobs: int, watcher: Watcher) -> dict[str, str]:
    """Make runs; no result depends on how many at a time.

    Args:
        tasks: the runs.
        jobs: at a time, ≥ 1. One is made in this process.
        watcher: told how they are getting on.

    Returns:
        Why runs failed, by name.

    Raises:
        InputError: what the user asked for breaks a rule.
        KeyboardInterrupt: Ctrl-C; every process has been ended, and what is done is kept.
    """
    waiting = deque(tasks)
    jobs = min(jobs, len(waiting))
    return _Pool(waiting, watcher).run(jobs) if jobs > 1 else _here(waiting, watcher)


def _here(tasks: Iterable[Task], watcher: Watcher) -> dict[str, str]:
    failures = {}

    def stage(name: str) -> None:
        if name == "compile":
            watcher.compile()

    for task in tasks:

        def batch(evaluations: int, name: str = task.name) -> None:
            watcher.batch(name, evaluations)

        failure = attempt(task, batch, stage)
        if failure is not None:
            failures[task.name] = failure
        watcher.ended(task.name, failure)
    return failures


class _Worker:
    """A process, the run that it is making, and a thread that passes on what it says."""

    def __init__(self, said: "queue.SimpleQueue[tuple[_Worker, tuple[Any, ...]]]") -> None:
        self.task: Task | None = None
        self._said = said
        self._process = subprocess.Popen(
            [sys.executable, "-m", "bridgegen.comparison.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(["", *sys.path])},
            start_new_session=True,  # Ctrl-C is ours, and a driver's process ends with it
        )
        self._reader = threading.Thread(target=self._listen, daemon=True)
        self._reader.start()

    def give(self, task: Task) -> None:
        """Have a run made."""
        self.task = task
        assert self._process.stdin is not None
        with suppress(OSError):  # it has died: the reader says so
            pickle.dump(task, self._process.stdin)
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


class _Pool:
    """Gives the waiting runs to the processes, one each."""

    def __init__(self, waiting: deque[Task], watcher: Watcher) -> None:
        self._waiting, self._watcher = waiting, watcher
        self._workers: list[_Worker] = []
        self._said: queue.SimpleQueue[tuple[_Worker, tuple[Any, ...]]] = queue.SimpleQueue()
        self._failures: dict[str, str] = {}

    def run(self, jobs: int) -> dict[str, str]:
        try:
            # What is not compiled yet is compiled once, not by every process.
            self._begin(jobs if is_compiled() else 1)
            while self._workers:
                worker, (kind, *rest) = self._said.get()
                if worker in self._workers:
                    self._take(worker, kind, *rest)
                if kind == "stage" and rest == ["search"]:
                    self._begin(jobs)
        finally:
            for worker in self._workers:
                worker.end()
        return self._failures

    def _begin(self, jobs: int) -> None:
        """Start as many processes as are missing and have something to do."""
        while self._waiting and len(self._workers) < jobs:
            worker = _Worker(self._said)
            self._workers.append(worker)
            worker.give(self._waiting.popleft())

    def _take(self, worker: _Worker, kind: str, *rest: Any) -> None:
        assert worker.task is not None
        name = worker.task.name
        if kind == "stage" and rest == ("compile",):
            self._watcher.compile()
        elif kind == "batch":
            self._watcher.batch(name, *rest)
        elif kind == "refused":
            raise InputError(*rest[0])
        elif kind == "ended":
            self._ended(name, rest[0])
            if self._waiting:
                worker.give(self._waiting.popleft())
            else:
                self._leave(worker)
        elif kind == "died":
            status = self._leave(worker)
            self._ended(name, f"its process ended with status {status}")
            self._begin(len(self._workers) + 1)

    def _leave(self, worker: _Worker) -> int:
        self._workers.remove(worker)
        return worker.end()

    def _ended(self, name: str, failure: str | None) -> None:
        if failure is not None:
            self._failures[name] = failure
        self._watcher.ended(name, failure)
