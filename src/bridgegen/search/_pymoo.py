"""What the algorithms built on pymoo share. Imported only when one of them is built."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from pymoo.config import Config
from pymoo.core.problem import Problem as PymooProblem
from pymoo.core.termination import NoTermination

from bridgegen.arrays import Float
from bridgegen.search.algorithm import Problem, Results
from bridgegen.search.penalty import Penalty

Box = tuple[Float, Float]
"""The lowest and the highest value of each parameter."""


def pymoos(problem: Problem, box: Box) -> PymooProblem:
    """Return pymoo's description of what is searched; it is never evaluated by pymoo."""
    return PymooProblem(n_var=problem.n_var, n_obj=problem.n_obj, xl=box[0], xu=box[1])


@contextmanager
def quiet() -> Iterator[None]:
    """Keep pymoo from printing its hint about compiled modules; the user's choice is restored."""
    before: Any = Config.warnings["not_compiled"]
    Config.warnings["not_compiled"] = False
    try:
        yield
    finally:
        Config.warnings["not_compiled"] = before


class Generations:
    """An algorithm of pymoo's, a generation a batch; begun afresh when it has no more to ask.

    Args:
        build: makes pymoo's algorithm, not yet set up.
        problem: what is searched.
        seed: of all that it draws; several numbers make one.
        restart_within: begin afresh once half of the population is so close to the best row, in
            each parameter. A population that has converged would ask for one row for ever; what it
            found is in the store, and another start may find another kind of critical scenario.
            Many objectives: so close to one row of the front, that is, when that has shrunk to a
            point; one that is spread goes on being filled.
        scaled: it measures distances between objectives, so each is scaled to [0, 1] over all who
            live and their children. Who dominates whom stays the same.
        box: where it searches; the whole cube by default.
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
    ) -> None:
        self._build, self._problem, self._scaled = build, problem, scaled
        self._seed = [seed] if isinstance(seed, int) else list(seed)
        self._box = box or (np.zeros(problem.n_var), np.ones(problem.n_var))
        self._restart_within = restart_within
        self._penalty = Penalty(problem.n_obj)
        self._asked: Any = None
        self.starts = 0
        self.restart()

    def restart(self) -> None:
        """Forget all and begin with a new population."""
        with quiet():
            self.algorithm = self._build()
            # The budget is the campaign's; pymoo's own criteria would end the search early.
            self.algorithm.setup(
                pymoos(self._problem, self._box),
                termination=NoTermination(),
                seed=[*self._seed, self.starts],
            )
        self.starts += 1

    def ask(self) -> Float:
        """Return the next generation's rows."""
        self._asked = self.algorithm.ask()
        if self._asked is None or len(self._asked) == 0:  # every child is a known row
            self.restart()
            self._asked = self.algorithm.ask()
        U: Float = np.clip(self._asked.get("X").astype(np.float64), *self._box)
        self._asked.set("X", U)
        return U

    def tell(self, U: Float, results: Results) -> None:
        """Take the results of the rows that were asked.

        Raises:
            ValueError: U is not what was last asked.
        """
        if self._asked is None or not np.array_equal(U, self._asked.get("X")):
            raise ValueError("U must be the rows that were last asked")
        finite, failed = self._penalty.apply(results.F, results.ok)
        self._asked.set("F", finite, "failed", failed, "told", finite)
        living = self.algorithm.pop if self.algorithm.is_initialized else ()
        # Who failed carries the penalty of that time; worse finite rows may have been told since,
        # and any of them must count as better.
        for one in living:
            if one.get("failed"):
                one.F = self._penalty.value
                one.set("told", one.F)
        if self._scaled:
            _scale([*living, *self._asked])
        self.algorithm.tell(infills=self._asked)
        self._asked = None
        best, own = self.algorithm.opt[0].get("X"), self.algorithm.pop.get("X")
        if np.median(np.abs(own - best).max(axis=1)) < self._restart_within:
            self.restart()


def _scale(individuals: list[Any]) -> None:
    """Set F to what was told, each objective scaled to [0, 1] over all of them."""
    told = 0.5 * np.array([one.get("told") for one in individuals])  # twice the range fits float64
    low, span = told.min(axis=0), np.ptp(told, axis=0)
    for one, values in zip(
        individuals, (told - low) / np.where(span > 0.0, span, 1.0), strict=True
    ):
        one.F = values
