"""Processes of this machine, each one thread: what is killed or crashes costs nothing but time."""

import queue
import signal
from typing import Any

from bridgegen.arrays import Float
from bridgegen.workers.bench import Bench
from bridgegen.workers.crew import Crew
from bridgegen.workers.process import Process, Said
from bridgegen.workers.recipe import Recipe


class Processes(Crew[Process]):
    """`Workers` in processes of this machine; begun when there is something to do.

    Args:
        count: how many, ≥ 1.
    """

    are_here = True

    def __init__(self, count: int) -> None:
        super().__init__()
        self._count = count
        self._said: Said = queue.SimpleQueue()

    @property
    def count(self) -> int:
        """See `Workers`."""
        return self._count

    @property
    def pids(self) -> tuple[int, ...]:
        """The numbers of those that have been begun."""
        return tuple(one.pid for one in self._posts)

    def _hire(self) -> Process:
        return Process(self._said)

    def _greet(self, hand: Process) -> None:
        hand.call(_be_there)

    def _prepare(self, hand: Process, recipe: Recipe) -> None:
        hand.call(_prepare, recipe)

    def _work(self, hand: Process, key: str, work: str, X: Float, given: tuple[Any, ...]) -> None:
        hand.call(_work, key, work, X, given)

    def _hear(self) -> tuple[Process, tuple[Any, ...]]:
        return self._said.get()

    def _dismiss(self, hand: Process) -> str:
        return ending(hand.end())


def ending(status: int) -> str:
    """Return how a process ended, by its exit status; negative is a signal's number."""
    if status >= 0:
        return f"with exit status {status}"
    try:
        return f"by {signal.Signals(-status).name}"
    except ValueError:
        return f"by signal {-status}"


# --- In the other process -------------------------------------------------------------------------

_bench = Bench()


def _be_there() -> None:
    """Answer."""


def _prepare(recipe: Recipe) -> None:
    _bench.prepare(recipe)


def _work(key: str, work: str, X: Float, given: tuple[Any, ...]) -> Any:
    return _bench.work(key, work, X, given)
