"""A worker in a Ray cluster: an actor that all campaigns on the cluster share.

So ten campaigns have no more workers than the cluster has cores (or graphics cards, each with its
simulator's server): their chunks take turns in each actor's queue.
"""

import threading
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

from bridgegen.arrays import Float
from bridgegen.workers.bench import Bench, portable

IDLE_SECONDS = 60.0
"""An actor that nobody has asked anything for so long makes room for others."""


class Station:
    """An actor's own side; every method returns what `bridgegen.workers.process` says.

    Args:
        leave: ends this actor for good; called once it has been idle for long.
        idle_seconds: how long.
    """

    def __init__(self, leave: Callable[[], None], idle_seconds: float = IDLE_SECONDS) -> None:
        self._bench, self._leave, self._idle_seconds = Bench(), leave, idle_seconds
        self._is_busy, self._since = False, time.monotonic()
        threading.Thread(target=self._watch, daemon=True).start()

    def greet(self) -> tuple[Any, ...]:
        """Say that it is there, and what it is."""
        return self._answer(lambda: ("begun", version("bridgegen")))

    def prepare(self, recipe: Callable[[], Any], key: str) -> tuple[Any, ...]:
        """Make what a recipe says; it is fetched only if it is needed."""

        def make() -> tuple[Any, ...]:
            if not self._bench.holds(key):
                self._bench.prepare(recipe())
            return ("answer", None)

        return self._answer(make)

    def work(self, key: str, work: str, X: Float, given: tuple[Any, ...]) -> tuple[Any, ...]:
        """Work on rows."""
        return self._answer(lambda: ("answer", self._bench.work(key, work, X, given)))

    def _answer(self, call: Callable[[], tuple[Any, ...]]) -> tuple[Any, ...]:
        self._is_busy = True
        try:
            return call()
        except Exception as error:
            return ("raised", portable(error))
        finally:
            self._is_busy, self._since = False, time.monotonic()

    def _watch(self) -> None:
        while self._is_busy or time.monotonic() - self._since < self._idle_seconds:
            time.sleep(min(1.0, self._idle_seconds / 4.0))
        self._leave()
