"""An algorithm that searches in one simulator for the rows that another one evaluates."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.search.algorithms.algorithm import (
    JSON,
    Algorithm,
    Arity,
    Problem,
    Results,
    Screen,
    Setting,
    TakesNotes,
    Value,
)
from bridgegen.search.algorithms.rate import Rate
from bridgegen.search.screened.agreement import (
    NOTE,
    Agreement,
    Compared,
    Pool,
    agreement,
    rank_correlation,
)
from bridgegen.search.screened.correction import Correction

LEAD = 0.25
"""Share of the screen's budget that is spent before the first row is asked for."""

# Critical rows of 300: 13 became 26 with the first bias of docs/decisions/search.md in
# crossroads-s1, 262 became 258 in crossroads-s4 (4 seeds).
NEAR = 0.25
"""Share of the screen's later evaluations that lie near the best rows of the run's simulator."""

PARENTS, STEPS, MOVED = 10, (0.02, 0.2), 0.5
"""Number of the best rows that others lie near; least and greatest standard deviation of the steps
to them; share of the parameters that change."""

CHECKS = 8
"""Number of rows of which one is random: it shows what the screen does not, and how far both
agree."""

# A screen that says nothing costs these rows.
LEAST = 24
"""Number of compared rows before a screen is judged."""

FEW = 0.2
"""Share of the screen's critical rows that must be critical, where the objectives disagree."""

PATIENCE = 100
"""Number of batches in a row without a row that is new to the screen, after which a search has
converged."""

TRIES = 8
"""Number of random rows that are drawn for one that is new to the screen."""


class Screened:
    """An `Algorithm` whose rows are proposed by another one, which searches in a screen.

    The other algorithm gets the screen's results, with the difference to the run's simulator added
    as far as it is known (`Correction`). What it asks for is kept; of that, each batch has
    the rows that are most likely critical, or whose objective is best by the most favourable
    difference, and which are far from each other and from those that have been evaluated. One row
    in ``CHECKS`` is random.

    A screen is given up where it fails in every row, and where, in ``LEAST`` rows or more, the
    objectives of both simulators are not positively correlated and few of the screen's critical
    rows are critical: then the algorithm begins afresh in the run's simulator, without a screen.

    Args:
        proposer: the algorithm, made with the problem as the screen sees it.
        alone: makes the same algorithm for the run's simulator; None where there is none, and the
            screen is never given up.
        screen: evaluates what the proposer asks for.
        problem: of the run.
        simulator: the name of the run's simulator.
        seed: of the run.
        budget: evaluations of the run.
        batch: rows that are asked for at a time.
        say: called with a sentence if the screen is given up.
    """

    name: ClassVar[str] = "screened"
    description: ClassVar[str] = "another algorithm proposes in a screen"
    source: ClassVar[str] = "ours"
    settings: ClassVar[Mapping[str, Setting]] = {}
    objectives: ClassVar[Arity] = "any"

    def __init__(
        self,
        proposer: Algorithm,
        alone: Callable[[], Algorithm] | None,
        screen: Screen,
        problem: Problem,
        *,
        simulator: str,
        seed: int,
        budget: int,
        batch: int,
        say: Callable[[str], None] = lambda text: None,
    ) -> None:
        self._proposer, self._make_alone, self._screen = proposer, alone, screen
        self._problem, self._simulator, self._say = problem, simulator, say
        self._budget, self._batch = budget, batch
        self._rng = np.random.Generator(np.random.PCG64([seed, 2]))
        self._limit = screen.budget - budget // CHECKS  # of what is left, checks are made
        self._converged = False
        self._alone: Algorithm | None = None
        self._ended, self._because = 0, ""
        self._pool = Pool(problem.n_var, problem.n_obj)
        self._correction = Correction.none(problem.n_var, problem.n_obj)
        self._asked = Compared.none(problem.n_var, problem.n_obj)  # the last batch
        self._run = self._asked

    def ask(self) -> Float:
        """Return the next rows for the run's simulator."""
        if self._alone is not None:
            return self._alone.ask()
        n = min(self._batch, self._budget - len(self._run.U))
        self._propose(n)
        if self._screen.evaluations and not self._pool.succeeded and self._make_alone:
            self._give_up("it fails in every scenario", self._make_alone)
            return self.ask()
        done = len(self._run.U)
        checks = self._random((done + n) // CHECKS - done // CHECKS)
        chosen = self._pool.take(n - len(checks.U), self._correction, self._run.U)
        self._asked = Compared.join(chosen, checks)
        return self._asked.U

    def tell(self, U: Float, results: Results) -> None:
        """Compare the results with the screen's, and learn from the difference."""
        if self._alone is not None:
            self._alone.tell(U, results)
            return
        self._run = Compared.join(self._run, self._asked.told(results))
        found = self._run.take(self._run.ok)
        self._correction = Correction(
            found.U, found.by_screen, found.F, found.screened, found.critical
        )
        if len(found.U) >= LEAST and self._make_alone and self._disagree(found):
            self._give_up(
                f"it disagrees with {self._simulator}: the rank correlation of the objectives of "
                f"{len(found.U)} scenarios is not positive",
                self._make_alone,
            )

    def notes(self) -> Mapping[str, JSON]:
        """Return what both simulators agree in, and the notes of the algorithm."""
        inner = self._alone or self._proposer
        own = inner.notes() if isinstance(inner, TakesNotes) else {}
        return {**own, NOTE: self.agreement().to_dict()}

    def agreement(self) -> Agreement:
        """Return how far both simulators agree so far."""
        found = agreement(self._run, self._screen, self._simulator, self._problem.parameters)
        ended = self._ended if self._alone is not None else None
        return replace(found, ended_after=ended, ended_because=self._because)

    def _propose(self, n: int) -> None:
        """Let the algorithm search in the screen, up to the share of its budget that is due.

        Beyond it, until there are n rows to choose from.
        """
        lead = LEAD * self._limit
        done = len(self._run.U) / max(1, self._budget - self._batch)  # 1 before the last batch
        due = int(lead + (self._limit - lead) * min(1.0, done))
        self._step(int(NEAR * (due - self._screen.evaluations)))
        idle = 0
        while not self._converged and (self._screen.evaluations < due or len(self._pool) < n):
            U = self._proposer.ask()
            left = self._limit - self._screen.evaluations
            if not len(U) or left < len(U):
                self._keep(U[:left])
                self._converged = True
                return
            results, fresh = self._keep(U)
            # The algorithm is told what the run's simulator is expected to say: a screen that is
            # wrong about every critical row still points near.
            self._proposer.tell(U, self._corrected(U, results))
            idle = 0 if fresh.any() else idle + 1
            self._converged = idle >= PATIENCE

    def _step(self, n: int) -> None:
        """Evaluate n rows in the screen that lie near the best rows of the run.

        So a place is searched that is critical in the run's simulator and not in the screen.
        """
        best = self._run.best(PARENTS)
        if n <= 0 or not len(best.U):
            return
        parents = best.U[self._rng.integers(len(best.U), size=n)]
        low, high = np.log(STEPS)
        size = np.exp(self._rng.uniform(low, high, (n, 1)))
        moved = self._rng.random(parents.shape) < MOVED
        steps = size * self._rng.standard_normal(parents.shape)
        self._keep(np.clip(parents + np.where(moved, steps, 0.0), 0.0, 1.0))

    def _keep(self, U: Float) -> tuple[Results, Bool]:
        """Evaluate rows in the screen, and keep those that are new."""
        results, fresh = self._screen.evaluate(U)
        self._pool.add(U[fresh], results.F[fresh], results.critical[fresh], results.ok[fresh])
        return results, fresh

    def _corrected(self, U: Float, results: Results) -> Results:
        """Return what is expected of the run's simulator, by the screen's results."""
        good, F, critical = results.ok, results.F.copy(), results.critical.copy()
        expected = self._correction.predict(U[good], F[good], critical[good])
        F[good] += expected.difference
        critical[good] = expected.critical >= 0.5
        return Results(F, good, critical, results.metrics, results.cause)

    def _random(self, n: int) -> Compared:
        """Return n random rows and the screen's results of them, those that it had not met."""
        rows = []
        for _ in range(n):
            for _ in range(TRIES):
                U = self._rng.random((1, self._problem.n_var))
                results, fresh = self._screen.evaluate(U)
                if fresh[0]:
                    rows.append(Compared.screened_by(U, results.F, results.critical, results.ok))
                    break
        return Compared.join(Compared.none(self._problem.n_var, self._problem.n_obj), *rows)

    def _disagree(self, found: Compared) -> bool:
        """Return whether the screen says nothing of the run's simulator."""
        # Giving up whatever is not significantly correlated gave up a useful screen, too (1
        # critical row instead of 24).
        if (rank_correlation(*found.sums()) or 0.0) > 0.0:
            return False
        claimed = found.critical[found.screened]
        return not len(claimed) or bool(claimed.mean() < FEW)

    def _give_up(self, because: str, make: Callable[[], Algorithm]) -> None:
        self._alone, self._because = make(), because
        self._ended = len(self._run.U)
        self._say(
            f"the screen {self._screen.name} is given up after {self._ended} evaluations: "
            f"{because}; the search continues without it"
        )


class ScreenedRate(Rate):
    """`Rate` beside a screen, with what both simulators agree in among its notes.

    Args:
        problem: of the run, with its screen.
        seed: of the run.
        simulator: the name of the run's simulator.
        **settings: of `Rate`.
    """

    def __init__(self, problem: Problem, seed: int, simulator: str, **settings: Value) -> None:
        super().__init__(problem, seed, **settings)
        self._simulator = simulator

    def notes(self) -> Mapping[str, JSON]:
        """Return what both simulators agree in."""
        known = self._known
        _, first = np.unique(known.columns.snapped(known.U), axis=0, return_index=True)
        by_screen, F = self._by_screen[: len(known)], known.F[:, np.newaxis]
        ok = np.isfinite(by_screen[:, 0]) & np.isfinite(known.F)
        rows = Compared(known.U, by_screen[:, :1], by_screen[:, 1] > 0.0, F, known.critical, ok)
        assert self._problem.screen is not None
        found = agreement(
            rows.take(np.sort(first)),
            self._problem.screen,
            self._simulator,
            self._problem.parameters,
        )
        return {NOTE: found.to_dict()}
