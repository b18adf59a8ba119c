"""The random experiment that an estimator asks, and the estimators by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from bridgegen.assess.conflict.harm import Count
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import UnknownNameError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Lost, Workers
from bridgegen.jobs.risk.estimators import automatic, importance, monte_carlo, stratified, subset
from bridgegen.jobs.risk.estimators.problem import Aim, Problem
from bridgegen.jobs.risk.estimators.weighted import Weighted
from bridgegen.jobs.risk.ledger import Ledger
from bridgegen.jobs.risk.outcomes import Column, Outcomes, outcomes
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.reader import evenly


class Experiment:
    """Points of an exposure's normal space, and what becomes of their rows.

    Attributes:
        modes: the words of the failure modes seen so far, by their number in outcomes.
        evaluations: how many rows have an outcome.
        failed: how many of them have no result.
        implausible: how many of them could not happen.
    """

    def __init__(
        self,
        pipeline: Pipeline,
        exposure: Exposure,
        workers: Workers,
        count: Count,
        ledger: Ledger,
        progress: Callable[[int], None],
    ) -> None:
        self._pipeline, self._exposure, self._workers = pipeline, exposure, workers
        self._count, self._ledger, self._progress = count, ledger, progress
        self.modes: dict[str, int] = {}
        self.evaluations = self.failed = self.implausible = 0

    @property
    def dimensions(self) -> int:
        """The number of distributed parameters."""
        return self._exposure.dimensions

    @property
    def columns(self) -> int:
        """The number of columns of an outcome."""
        return len(Column)

    @property
    def share(self) -> tuple[float, float, float]:
        """The feasible share of the exposure, and its interval: low, estimate, high."""
        found = self._exposure.feasible_share
        return found.low if found.estimate < 1.0 else 1.0, found.estimate, found.high

    def feasible(self, Z: Float) -> Bool:
        """Return which points keep the scenario's constraints."""
        return self._exposure.feasible(self._exposure.from_normal(Z))

    def spread(self, n: int, random: np.random.Generator) -> tuple[Float, Float]:
        """Return points whose rows are uniform over the ranges, and their weights.

        Args:
            n: how many.
            random: all random numbers.

        Returns:
            ``(n, dimensions)``; and ``(n,)``, how much likelier each one is on the road.
        """
        met = self._exposure
        even = evenly(met)
        X = even.sample(n, int(random.integers(2**31))).X
        weights = np.exp(met.log_density(X) - even.log_density(X))
        Z = np.zeros((n, met.dimensions))
        there = weights > 0.0
        Z[there] = met.to_normal(X[there])
        weights[there] *= met.feasible(met.from_normal(Z[there]))
        return Z, weights

    def evaluate(self, Z: Float, least: float = -np.inf) -> Float:
        """Return the outcomes of N feasible points, ``(N, len(Column))``."""
        if not len(Z):
            return np.empty((0, len(Column)))
        found = self._ledger.next(Z, least)
        if found is None:
            found = self._simulated(self._exposure.from_normal(Z), least)
            self._ledger.keep(Z, least, found)
        self.evaluations += len(Z)
        self.failed += int(np.sum(found.values[:, Column.RESULT] == 0.0))
        self.implausible += int(np.sum(found.values[:, Column.RESULT] < 0.0))
        self._progress(self.evaluations)
        return self._numbered(found)

    def _simulated(self, X: Float, least: float) -> Outcomes:
        parts = self._workers.map(self._pipeline, outcomes, X, self._count, least)
        return Outcomes.join(
            [
                Outcomes.lost(part.rows) if isinstance(part.result, Lost) else part.result
                for part in parts
            ]
        )

    def _numbered(self, found: Outcomes) -> Float:
        """Return outcomes whose modes are numbered as `modes` are."""
        numbers = np.array([self.modes.setdefault(mode, len(self.modes)) for mode in found.modes])
        values = found.values.copy()
        has = values[:, Column.MODE] >= 0.0
        if has.any():
            values[has, Column.MODE] = numbers[values[has, Column.MODE].astype(np.int64)]
        return values


# --- The methods by name ---


AUTO = "auto"
METHODS: Mapping[str, str] = {
    AUTO: "Monte Carlo where it suffices, else importance sampling, else subset simulation.",
    "mc": "Rows as they happen, counted. Exact, and for rare harm slow.",
    "subset": "A chain of ever more harmful levels; for rare harm, in many dimensions.",
    "importance": "Rows drawn where subset simulation, or a search, found harm, and weighted.",
    "stratified": "More rows from the rare ends of the distribution; in few dimensions.",
}
"""Descriptions of the estimation methods by name."""


@dataclass(frozen=True)
class Estimated:
    """The method that was used, why, and what it found."""

    method: str
    why: str
    weighted: Weighted


def require(name: str) -> None:
    """Check that there is a method of that name.

    Raises:
        UnknownNameError: there is none.
    """
    if name not in METHODS:
        raise UnknownNameError("method", name, METHODS)


def estimate(name: str, problem: Problem, aim: Aim, seed: int, start: Float | None) -> Estimated:
    """Estimate by a method.

    Args:
        name: one of ``METHODS``.
        problem: the experiment.
        aim: the event.
        seed: of all random numbers.
        start: points of the event that importance sampling may use.
    """
    if name == AUTO:
        return Estimated(*automatic.estimate(problem, aim, seed, start))
    if name == "importance":
        return Estimated(name, "asked for", importance.estimate(problem, aim, seed, start))
    plain: Mapping[str, Callable[[Problem, Aim, int], Weighted]] = {
        "mc": monte_carlo.estimate,
        "subset": subset.estimate,
        "stratified": stratified.estimate,
    }
    return Estimated(name, "asked for", plain[name](problem, aim, seed))
