"""A worker in a Ray cluster: an actor that all campaigns on the cluster share.

So ten campaigns have no more workers than the cluster has cores (or graphics cards, each with its
simulator's server): their chunks take turns in each actor's queue.
"""

import threading
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

from bridgegen.base.arrays import Float
from bridgegen.engine.workers.pipeline_cache import PipelineCache, picklable
from bridgegen.engine.workers.workers import Work

IDLE_SECONDS = 60.0
"""An actor that has been idle for so long [s] ends and frees its core."""


class RayActor:
    """The actor itself, without Ray; its methods return messages, see `process.py`.

    Args:
        leave: ends this actor for good; called when it has been idle for ``idle_seconds``.
        idle_seconds: how long [s].
    """

    def __init__(self, leave: Callable[[], None], idle_seconds: float = IDLE_SECONDS) -> None:
        self._cache, self._leave, self._idle_seconds = PipelineCache(), leave, idle_seconds
        self._is_busy, self._since = False, time.monotonic()
        threading.Thread(target=self._leave_when_idle, daemon=True).start()

    def ping(self) -> tuple[Any, ...]:
        """Return that it has started, with the version of its bridgegen."""
        return self._answer(lambda: ("started", version("bridgegen")))

    def prepare(self, recipe: Callable[[], Any], key: str) -> tuple[Any, ...]:
        """Build a recipe's pipeline; the recipe is fetched only if it is needed."""

        def make() -> tuple[Any, ...]:
            if key not in self._cache:
                self._cache.prepare(recipe())
            return ("answer", None)

        return self._answer(make)

    def run(self, key: str, work: Work, X: Float, args: tuple[Any, ...]) -> tuple[Any, ...]:
        """Evaluate rows."""
        return self._answer(lambda: ("answer", self._cache.run(key, work, X, args)))

    def _answer(self, call: Callable[[], tuple[Any, ...]]) -> tuple[Any, ...]:
        self._is_busy = True
        try:
            return call()
        except Exception as error:
            return ("raised", picklable(error))
        finally:
            self._is_busy, self._since = False, time.monotonic()

    def _leave_when_idle(self) -> None:
        while self._is_busy or time.monotonic() - self._since < self._idle_seconds:
            time.sleep(min(1.0, self._idle_seconds / 4.0))
        self._leave()
