"""Evaluators for tests, which workers import by name."""

import os
import signal
import time
from pathlib import Path

import numpy as np

from bridgegen.base.errors import UnknownNameError
from bridgegen.engine.workers import Recipe


class Doubler:
    """Doubles numbers."""

    runs_at_once = 8
    device = "CPU"

    def __init__(self, rows_at_once: int = 4) -> None:
        self.rows_at_once = rows_at_once

    @property
    def recipe(self) -> Recipe:
        return Recipe.of(Doubler, self.rows_at_once)

    def double(self, X: np.ndarray) -> np.ndarray:
        return 2.0 * X

    def double_but(self, X: np.ndarray, poison: tuple[float, ...]) -> np.ndarray:
        if np.isin(X, poison).any():
            os.kill(os.getpid(), signal.SIGSEGV)
        return 2.0 * X

    def double_once_killed(self, X: np.ndarray, folder: Path) -> np.ndarray:
        """End the first process that evaluates a row of 7."""
        if 7.0 in X:
            try:
                (folder / "was here").touch(exist_ok=False)
            except FileExistsError:
                return 2.0 * X
            os._exit(3)
        return 2.0 * X

    def mark(self, X: np.ndarray, folder: Path) -> np.ndarray:
        """Leave a file for each call."""
        (folder / str(X[0, 0])).touch()
        return X

    def double_last(self, X: np.ndarray, folder: Path) -> np.ndarray:
        """Return the double of row 0 when rows 1 to 19 have been evaluated."""
        end = time.monotonic() + 60.0
        while X[0, 0] == 0.0 and len(list(folder.iterdir())) < 19:
            if time.monotonic() > end:
                raise TimeoutError
            time.sleep(0.01)
        self.mark(X, folder)
        return 2.0 * X

    def slowly(self, X: np.ndarray, folder: Path) -> np.ndarray:
        (folder / str(os.getpid())).touch()
        time.sleep(60.0)
        return X

    def refuse(self, X: np.ndarray) -> np.ndarray:
        raise UnknownNameError("number", "seven", ["one", "two"])

    def fail(self, X: np.ndarray) -> np.ndarray:
        raise ZeroDivisionError("by design")

    def start_daemon(self, X: np.ndarray, folder: Path) -> np.ndarray:
        """Start an orphaned process in a session of its own."""
        if os.fork() == 0:
            os.setsid()
            if os.fork() == 0:
                (folder / str(os.getpid())).touch()
                os.execlp("sleep", "sleep", "300")
            os._exit(0)
        os.wait()
        return X

    def fork_and_die(self, X: np.ndarray) -> np.ndarray:
        if os.fork() == 0:
            time.sleep(300.0)
        os._exit(4)

    def fork_and_exit(self, X: np.ndarray) -> np.ndarray:
        if os.fork() == 0:
            time.sleep(300.0)
        raise SystemExit(5)

    def process_id(self, X: np.ndarray) -> int:
        return os.getpid()


class Unmakeable(Doubler):
    """Ends the process that builds it."""

    @property
    def recipe(self) -> Recipe:
        return Recipe.of(os._exit, 9)
