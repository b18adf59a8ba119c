"""Base of the algorithms built on pymoo. Imported only when one of them is constructed."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from pymoo.config import Config
from pymoo.core.population import Population
from pymoo.core.problem import Problem as PymooProblem
from pymoo.core.termination import NoTermination

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Penalty, Problem, Results

Box = tuple[Float, Float]
"""The lowest and the highest value of each parameter."""


def pymoos(problem: Problem, box: Box) -> PymooProblem:
    """Return pymoo's description of the problem; pymoo never evaluates it."""
    return PymooProblem(n_var=problem.n_var, n_obj=problem.n_obj, xl=box[0], xu=box[1])


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress pymoo's hint about compiled modules; the user's setting is restored."""
    before: Any = Config.warnings["not_compiled"]
    Config.warnings["not_compiled"] = False
    try:
        yield
    finally:
        Config.warnings["not_compiled"] = before


@dataclass(frozen=True)
class _Asked:
    """A row that was asked for.

    Attributes:
        individual: pymoo's.
        start: the number of starts by then.
        has_population: whether it was asked for after the first population.
    """

    individual: Any
    start: int
    has_population: bool


class Generations:
    """An algorithm of pymoo; one generation per batch; restarts when it has no more rows.

    It may be asked again before all results are told, if it is asynchronous; then the survivors are
    selected among those that are told at a time, whichever generation they are of. Rows of an
    earlier start, and first rows of a population that was complete without them, are told in vain.

    Args:
        build: constructs pymoo's algorithm, not yet set up.
        problem: the search problem.
        seed: of all its random numbers; several numbers form one seed.
        restart_within: restart once half of the population is this close to the best row, in
            each parameter. A converged population would propose one row forever; its findings are
            in the store, and another start may find another kind of critical scenario.
            Many objectives: this close to one row of the front, that is, when the front has shrunk
            to a point; a front that is spread is not restarted.
        scaled: it measures distances between objectives, so each is scaled to [0, 1] over the
            population and its children. Dominance stays the same.
        box: bounds of the search; the whole cube by default.
        asynchronous: whether it may be told a part of the rows; else all are told at once.
    """

    def __init__(
        self,
        build: Callable[[], Any],
        problem: Problem,
        seed: int | Sequence[int],
        restart_within: float,
        *,
        scaled: bool = False,
        box: Box | None = None,
        asynchronous: bool = False,
    ) -> None:
        self._asynchronous = asynchronous
        self._build, self._problem, self._scaled = build, problem, scaled
        self._seed = [seed] if isinstance(seed, int) else list(seed)
        self._box = box or (np.zeros(problem.n_var), np.ones(problem.n_var))
        self._restart_within = restart_within
        self._penalty = Penalty(problem.n_obj)
        self._untold = deque[_Asked]()
        self.starts = 0
        self.restart()

    def restart(self) -> None:
        """Discard the state and start with a new population."""
        with quiet():
            self.algorithm = self._build()
            # The campaign limits the budget; pymoo's own criteria would end the search early.
            self.algorithm.setup(
                pymoos(self._problem, self._box),
                termination=NoTermination(),
                seed=[*self._seed, self.starts],
            )
        self.starts += 1
        self._first, self._size = list[Any](), 0

    def ask(self) -> Float:
        """Return the next generation's rows."""
        asked: Any = self.algorithm.ask()
        if asked is None or len(asked) == 0:  # every child is a known row
            self.restart()
            asked = self.algorithm.ask()
        # The population holds the clipped rows: `tell` recognises rows by their bits.
        U: Float = np.clip(asked.get("X").astype(np.float64), *self._box)
        asked.set("X", U)
        self._size = self._size or len(asked)
        self._untold.extend(_Asked(item, *self._phase) for item in asked)
        return U

    @property
    def _phase(self) -> tuple[int, bool]:
        """The number of starts, and whether there is a population."""
        return self.starts, self.algorithm.is_initialized

    def tell(self, U: Float, results: Results) -> None:
        """Process the results of the rows that were asked for first and are not told.

        Raises:
            ValueError: U are not those rows.
        """
        n = len(U) if self._asynchronous else len(self._untold)
        asked = list(islice(self._untold, n))
        if not asked or not np.array_equal(U, [item.individual.X for item in asked]):
            raise ValueError("U must be the first rows that were asked for and are not told")
        for _ in asked:
            self._untold.popleft()
        finite, failed = self._penalty.apply(results.F, results.ok)
        told = []
        for item, F, is_failed in zip(asked, finite, failed.tolist(), strict=True):
            item.individual.F = F
            item.individual.set("failed", is_failed)
            item.individual.set("unscaled", F)
            # Rows of an earlier start are told in vain: with `--ahead`, they may come after a
            # restart.
            if (item.start, item.has_population) == self._phase:
                told.append(item.individual)
        if not self.algorithm.is_initialized:
            self._first += told
            if len(self._first) < self._size:
                return
            told = self._first[: self._size]
        if told:
            self._advance(told)

    def _advance(self, told: list[Any]) -> None:
        """Select the survivors, or the next moves."""
        living = self.algorithm.pop if self.algorithm.is_initialized else ()
        # A failed row has the penalty of its batch; worse finite rows may have followed, and any of
        # them must count as better.
        for item in living:
            if item.get("failed"):
                item.F = self._penalty.value
                item.set("unscaled", item.F)
        if self._scaled:
            _scale([*living, *told])
        self.algorithm.tell(infills=Population.create(*told))
        best, own = self.algorithm.opt[0].get("X"), self.algorithm.pop.get("X")
        if np.median(np.abs(own - best).max(axis=1)) < self._restart_within:
            self.restart()


def _scale(individuals: list[Any]) -> None:
    """Set F to the unscaled objectives, each scaled to [0, 1] over all individuals."""
    # Half, so that the range fits float64.
    F = 0.5 * np.array([individual.get("unscaled") for individual in individuals])
    low, span = F.min(axis=0), np.ptp(F, axis=0)
    for individual, values in zip(
        individuals, (F - low) / np.where(span > 0.0, span, 1.0), strict=True
    ):
        individual.F = values
