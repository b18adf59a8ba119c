"""What everybody who works on a batch does."""

from dataclasses import dataclass
from typing import Any, Protocol

from bridgegen.arrays import Float
from bridgegen.workers.recipe import Recipe


class Portable(Protocol):
    """What works on rows, here and, made again, elsewhere; a row's result depends on that row."""

    @property
    def rows_at_once(self) -> int:
        """How many rows it had best be given, ≥ 1."""

    @property
    def runs_at_once(self) -> int:
        """In how many threads it had best work, where they share it, ≥ 1."""

    @property
    def device(self) -> str:
        """What a worker needs one of, as Ray calls it: "CPU", or "GPU"."""

    @property
    def recipe(self) -> Recipe:
        """Makes it again."""


@dataclass(frozen=True)
class Lost:
    """A row that nobody could work on: it took two workers with it.

    Attributes:
        reason: how the second one ended.
    """

    reason: str


@dataclass(frozen=True)
class Part:
    """What came of some rows that follow each other.

    Attributes:
        rows: how many they are, ≥ 0.
        came: what the work on them returned; or `Lost`, which is one row at most.
    """

    rows: int
    came: Any


class Workers(Protocol):
    """Threads, processes or a cluster: they share a batch of rows among them."""

    @property
    def count(self) -> int:
        """How many there are."""

    @property
    def are_here(self) -> bool:
        """Whether they are on this machine."""

    def map(self, portable: Portable, work: str, X: Float, *given: Any) -> list[Part]:
        """Have rows worked on.

        Args:
            portable: what works; it is made again where the worker is.
            work: the name of its method: rows ``(n, …)`` and ``given`` → what comes of them.
            X: ``(N, …)`` float64, the rows; none of them is worked on, too, once.
            given: to every call, besides.

        Returns:
            What came of all rows, in their order.

        Raises:
            Exception: whatever the work raised.
            WorkersError: there are no workers, or they are lost.
            KeyboardInterrupt: Ctrl-C; nobody works any more.
        """

    def close(self) -> None:
        """Let them go: what they have begun ends with them."""
