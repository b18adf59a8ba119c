"""The random experiment that an estimator asks: rows of an exposure, driven by the ego's driver."""

from collections.abc import Callable

import numpy as np

from bridgegen.assess.conflict.harm import Count
from bridgegen.base.arrays import Bool, Float
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Lost, Workers
from bridgegen.jobs.risk.ledger import Ledger
from bridgegen.jobs.risk.outcomes import Column, Outcomes, outcomes
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.chosen import evenly


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
            found = self._simulated(self._exposure.from_normal(Z))
            self._ledger.keep(Z, least, found)
        self.evaluations += len(Z)
        self.failed += int(np.sum(found.values[:, Column.RESULT] == 0.0))
        self.implausible += int(np.sum(found.values[:, Column.RESULT] < 0.0))
        self._progress(self.evaluations)
        return self._numbered(found)

    def _simulated(self, X: Float) -> Outcomes:
        parts = self._workers.map(self._pipeline, outcomes, X, self._count)
        return Outcomes.join(
            [
                Outcomes.lost(one.rows) if isinstance(one.result, Lost) else one.result
                for one in parts
            ]
        )

    def _numbered(self, found: Outcomes) -> Float:
        """Return outcomes whose modes are numbered as `modes` are."""
        numbers = np.array([self.modes.setdefault(one, len(self.modes)) for one in found.modes])
        values = found.values.copy()
        has = values[:, Column.MODE] >= 0.0
        if has.any():
            values[has, Column.MODE] = numbers[values[has, Column.MODE].astype(np.int64)]
        return values
