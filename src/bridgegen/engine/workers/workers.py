"""The protocol of workers, and of what they evaluate rows with."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar, TypeVarTuple

from bridgegen.base.arrays import Float
from bridgegen.engine.workers.recipe import Recipe


class Portable(Protocol):
    """Evaluates rows, here and, rebuilt, in a worker; a row's result depends on that row alone."""

    @property
    def rows_at_once(self) -> int:
        """The number of rows of a chunk that is evaluated fastest, ≥ 1."""

    @property
    def runs_at_once(self) -> int:
        """The number of threads that use one instance best, ≥ 1."""

    @property
    def device(self) -> str:
        """The device that each worker needs, as Ray names it: "CPU" or "GPU"."""

    @property
    def recipe(self) -> Recipe:
        """Builds it in a worker."""


Result = TypeVar("Result")
Evaluator = TypeVar("Evaluator", bound=Portable)
Args = TypeVarTuple("Args")

Work = Callable[..., Any]
"""A function of a `Portable`, of rows and of further arguments, importable by its name: usually a
method of its class, unbound."""


@dataclass(frozen=True)
class Lost:
    """A row without a result: two workers crashed while they evaluated it.

    Attributes:
        reason: how the second one ended.
    """

    reason: str


@dataclass(frozen=True)
class Part(Generic[Result]):
    """The result of consecutive rows.

    Attributes:
        rows: how many rows, ≥ 0.
        result: what the work returned; or `Lost`, of one row at most.
    """

    rows: int
    result: Result | Lost


class Stream(Protocol[Result]):
    """Rows that workers evaluate, each by itself, while their caller does something else.

    A worker that is free gets the next row, so that rows may take unevenly long.
    """

    def submit(self, X: Float) -> None:
        """Add rows, ``(n, …)`` float64, after those that were added before."""

    def take(self, n: int) -> list[Part[Result]]:
        """Wait for the results of the next n rows, in the order in which they were added.

        Args:
            n: as many rows as have been added and not taken, at most.

        Raises:
            Exception: raised by the work.
            WorkersError: no workers are available, or the connection to them is lost.
        """

    def close(self) -> None:
        """End the stream; rows that have not been taken are abandoned."""


class Workers(Protocol):
    """Threads, processes or a cluster that share the rows of a batch."""

    @property
    def count(self) -> int:
        """The number of workers."""

    @property
    def are_here(self) -> bool:
        """Whether they run on this machine."""

    def map(
        self,
        portable: Evaluator,
        work: Callable[[Evaluator, Float, *Args], Result],
        X: Float,
        *args: *Args,
    ) -> list[Part[Result]]:
        """Evaluate rows.

        Args:
            portable: evaluates the rows; each worker builds it from its recipe.
            work: called as ``work(portable, rows, *args)`` with rows ``(n, …)``, once per chunk. A
                function that workers can import by its name, e.g. ``type(portable).evaluate``.
            X: ``(N, …)`` float64, the rows; if N = 0, the work is called once.
            args: further arguments of each call.

        Returns:
            The results of all rows, in order.

        Raises:
            Exception: raised by the work.
            WorkersError: no workers are available, or the connection to them is lost.
            KeyboardInterrupt: Ctrl-C; all workers have stopped.
        """

    def stream(
        self,
        portable: Evaluator,
        work: Callable[[Evaluator, Float, *Args], Result],
        *args: *Args,
    ) -> Stream[Result]:
        """Open a stream of rows; until it is closed, the workers evaluate nothing else.

        Args:
            portable: see ``map``.
            work: see ``map``; called once for each row.
            args: see ``map``.
        """

    def close(self) -> None:
        """Release the workers; the processes that they started end with them."""


# --- Splits a batch of rows into chunks ---


def cut(n: int, workers: int, at_once: int) -> Iterator[tuple[int, int]]:
    """Yield the bounds of chunks that cover rows 0 … n − 1 in order; one empty chunk if n = 0.

    Their sizes differ by one row at most. If there are enough rows, their number is a multiple of
    the number of workers, so that no worker evaluates the last rows alone.

    Args:
        n: number of rows, ≥ 0.
        workers: number of workers that need a chunk each, ≥ 1.
        at_once: maximum number of rows of a chunk, ≥ 1.
    """
    # 40 rows for two workers that take eight at a time would be five chunks, of which one worker
    # does three: 1.67 times as fast at best. Six are 1.9.
    rounds = -(-n // (workers * at_once))
    pieces = max(1, min(n, rounds * workers))
    for i in range(pieces):
        yield i * n // pieces, (i + 1) * n // pieces
