"""Settings that mend failures: trials of them on rows, and CMA-ES over the tunable numbers.

Source: Abdessalem et al. (ARIEL), ISSTA 2020, doi:10.1145/3395363.3397386, for repair by search
with what passes as a constraint; CMA-ES: Hansen (2016), arXiv:1604.00772.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.assess.cause import Cause, Counterfactual
from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.findings import Findings, is_unsafe_start
from bridgegen.assess.conflict.plausibility import Implausible, plausibility
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.drivers.tunable import Settings, Tunable
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Lost, Threads
from bridgegen.search.algorithms.cma_es import reflected

HARM, CHANGE, BROKEN = 0.5, 0.1, 10.0
"""Weights in the cost of settings, beside the share of rows that they do not mend: of the mean harm
there, of the mean change as a share of the ranges, and of what breaks a constraint."""

WITHIN = 0.05
"""Share by which mean jerk and travel time may grow where the driver has passed."""

STEP = 0.25
"""Initial standard deviation, as a share of the ranges."""

DIGITS = 4
"""Significant digits of a value that is tried: what is written is what was simulated."""

STALLED = 3
"""Generations without better settings after which the search ends once all rows are mended."""

FAILS, PASSES, WORST, CHANGES, TIME, WAY = range(6)
"""Columns of what a driver makes of a row: whether it fails or passes (neither without a result, or
with implausible traffic), harm, changes of the acceleration in total [m/s²], time [s], way [m]."""


def drive(pipeline: Pipeline, X: Float, settings: Settings) -> Float:
    """Drive N rows with settings; return ``(N, 6)``, in the columns above."""
    objective, names = pipeline.objective, list(pipeline.metrics)
    driver = replace(pipeline.runner.driver, settings=settings)
    rollout = pipeline.runner.run(X, fix=Counterfactual(Cause.NONE, driver))
    metrics, gate, ok = pipeline.measure(rollout), plausibility(rollout), rollout.status == 0
    fit: Bool = gate.code == Implausible.NONE
    counts = objective.F(metrics, names, fit if objective.gated else True)[1]
    margins = metrics[:, [names.index(name) for name in pipeline.monitor.names]]
    fails = ok & ((objective.critical(metrics, names) & counts) | (margins < 0.0).any(axis=1))
    harm = np.nan_to_num(metrics[:, names.index(objective.harm)])
    findings = Findings.of(analyse(rollout), gate.labels, objective.count)
    passes = ok & ~fails & fit & ~is_unsafe_start(findings, harm)
    lasts = np.arange(rollout.shape[2]) < rollout.n_steps[:, np.newaxis] - 1
    changes = (np.abs(np.diff(rollout.a[:, 0], axis=1)) * lasts[:, 1:]).sum(axis=1)
    way = (np.abs(rollout.v[:, 0]) * lasts).sum(axis=1) * rollout.time_step
    time = (rollout.n_steps - 1) * rollout.time_step
    found = np.stack([fails, passes, harm, changes, time, way], axis=1).astype(np.float64)
    return np.where(ok[:, np.newaxis], found, 0.0)


@dataclass(frozen=True)
class Rows:
    """Rows of several scenarios: each one's values, and ``(N,)`` the number of its scenario."""

    X: tuple[Float, ...]
    scene: Int

    @classmethod
    def of(cls, parts: Sequence[Float]) -> "Rows":
        """Return rows, those of each scenario in their order."""
        sizes = [len(X) for X in parts]
        return cls(tuple(x for X in parts for x in X), np.repeat(np.arange(len(parts)), sizes))

    def __add__(self, other: "Rows") -> "Rows":
        return Rows((*self.X, *other.X), np.concatenate([self.scene, other.scene]))


@dataclass(frozen=True)
class Trial:
    """Settings, and what the driver makes of rows with them.

    Attributes:
        values: of the tunable numbers, in their order.
        failed: ``(F, 6)``, what becomes of the rows that have failed; see `FAILS`.
        is_feasible: whether all that has passed does not fail, and jerk and time are in bounds.
        cost: less is better.
        jerk: mean, / that without settings.
        travel_time: per distance, / that without settings.
    """

    values: tuple[float, ...]
    failed: Float
    is_feasible: bool
    cost: float
    jerk: float
    travel_time: float

    @property
    def mends(self) -> Bool:
        """``(F,)`` bool, which of the rows pass."""
        return np.asarray(self.failed[:, PASSES] > 0.0)

    @property
    def rank(self) -> tuple[bool, float]:
        """Less is better; what is not feasible is never better."""
        return not self.is_feasible, self.cost


class Bench:
    """Tries settings on rows that have failed, and on rows that have passed.

    Args:
        pipelines: of the scenarios.
        tunable: the driver's numbers.
        base: what they are now.
    """

    def __init__(
        self, pipelines: Sequence[Pipeline], tunable: tuple[Tunable, ...], base: tuple[float, ...]
    ) -> None:
        self.pipelines, self.tunable, self.base = pipelines, tunable, base
        self.failing = Rows((), np.zeros(0, np.int64))
        self.never = np.zeros(0, np.bool_)  # those that no settings mend that were tried
        self.tried, self._known = 0, dict[tuple[float, ...], Trial]()
        self._workers = Threads()

    def drive(self, rows: Rows, values: tuple[float, ...]) -> Float:
        """Drive rows; return what becomes of each, ``(N, 6)``."""
        settings = tuple(zip((item.name for item in self.tunable), values, strict=True))
        found = np.zeros((len(rows.X), 6))
        for scene in np.unique(rows.scene).tolist():
            at = np.flatnonzero(rows.scene == scene)
            X, pipeline = np.stack([rows.X[i] for i in at]), self.pipelines[scene]
            parts = self._workers.map(pipeline, drive, X, settings)
            none = [np.zeros((part.rows, 6)) for part in parts]
            found[at] = np.concatenate(
                [
                    a if isinstance(p.result, Lost) else p.result
                    for p, a in zip(parts, none, strict=True)
                ]
            )
        return found

    def guard(self, drawn: Rows, found: Rows) -> Rows:
        """Keep the rows that pass; return random ones that fail, which are to be mended, too.

        Args:
            drawn: random rows, by which jerk and travel time are measured.
            found: rows of a search.
        """
        rows = drawn + found
        driven = self.drive(rows, self.base)
        passes, fails = (np.flatnonzero(driven[:, k]) for k in (PASSES, FAILS))
        self._passed = Rows(tuple(rows.X[i] for i in passes), rows.scene[passes])
        self._drawn = passes < len(drawn.X)
        self._manner = _manner(driven[passes[self._drawn]])
        fails = fails[fails < len(drawn.X)]
        return Rows(tuple(rows.X[i] for i in fails), rows.scene[fails])

    def add(self, failing: Rows) -> None:
        """Add rows that fail; nothing has been tried on them."""
        self.failing += failing
        self.never = np.concatenate([self.never, np.ones(len(failing.X), np.bool_)])
        self._known.clear()

    def trial(self, values: tuple[float, ...]) -> Trial:
        """Try settings; those that were tried before are not simulated again."""
        if values not in self._known:
            # Together: a driver in Python drives a thousand rows in little more time than one.
            both = self.drive(self.failing + self._passed, values)
            failed, passed = np.split(both, [len(self.failing.X)])
            manner = _manner(passed[self._drawn]) / self._manner
            wrong = passed[:, FAILS].sum() / max(1, len(passed))
            wrong += np.maximum(0.0, manner - 1.0 - WITHIN).sum()
            change = np.abs(self.unit(values) - self.unit(self.base)).mean()
            cost = 1.0 - failed[:, PASSES].mean() + HARM * failed[:, WORST].mean()
            cost += CHANGE * change + BROKEN * wrong
            found = Trial(values, failed, not wrong, float(cost), *manner.tolist())
            self._known[values], self.tried = found, self.tried + 1
            self.never &= ~found.mends
        return self._known[values]

    def unit(self, values: Sequence[float]) -> Float:
        """Return values as shares of their ranges."""
        pairs = zip(self.tunable, values, strict=True)
        return np.array([(value - item.low) / (item.high - item.low) for item, value in pairs])

    def _rounded(self, shares: Float) -> tuple[float, ...]:
        pairs = zip(self.tunable, shares.tolist(), strict=True)
        some = [(item, item.low + share * (item.high - item.low)) for item, share in pairs]
        return tuple(
            min(max(float(f"{value:.{DIGITS}g}"), item.low), item.high) for item, value in some
        )

    def tune(self, start: tuple[float, ...], tries: int, seed: Sequence[int]) -> Trial:
        """Return the best settings that keep the constraints; the present ones if none are better.

        First the least and the greatest value of each number alone; then CMA-ES from the best on;
        then numbers are put back that mend nothing.

        Args:
            start: settings of an earlier round.
            tries: how many settings are tried, besides numbers put back.
            seed: of the random numbers.
        """
        from cmaes import CMA  # loads a part of SciPy

        base, n = self.base, len(self.tunable)
        ends = [
            (*base[:k], end, *base[k + 1 :])
            for k, item in enumerate(self.tunable)
            for end in (item.low, item.high)
        ]
        first = [self.trial(values) for values in [base, start, *ends][:tries]]
        best = min(first, key=lambda trial: trial.rank)
        # Of one number CMA has no covariance: a second one, which stands for nothing, gives it one.
        mean = np.append(self.unit(best.values), [0.5] * (n == 1))
        random = np.random.Generator(np.random.PCG64(seed))
        search = CMA(mean, STEP, seed=int(random.integers(2**32)))
        left, stalled = tries - len(first), 0
        while left >= search.population_size and not search.should_stop():
            drawn = [search.ask() for _ in range(search.population_size)]
            trials = [self.trial(self._rounded(reflected(row[:n]))) for row in drawn]
            search.tell([(row, trial.cost) for row, trial in zip(drawn, trials, strict=True)])
            left, before = left - len(drawn), best
            best = min([best, *trials], key=lambda trial: trial.rank)
            stalled = stalled + 1 if best is before else 0
            if stalled >= STALLED and best.mends.all():
                break
        for k in np.argsort(
            np.abs(self.unit(best.values) - self.unit(base)), kind="stable"
        ).tolist():
            trial = self.trial((*best.values[:k], base[k], *best.values[k + 1 :]))
            if trial.is_feasible and trial.mends.sum() >= best.mends.sum():
                best = trial
        return best


def _manner(driven: Float) -> Float:
    """Return mean absolute jerk [m/s³] and travel time [s/m]; of a driver that stands, bounds."""
    changes, time, way = driven[:, [CHANGES, TIME, WAY]].sum(axis=0).tolist()
    time = max(time, 1e-9)
    return np.array([max(changes / time, 0.01), 1.0 / max(way / time, 0.01)])
