"""Settings that mend failures: trials of them on rows, and CMA-ES over the tunable numbers.

Source: the idea of repairing a driver's parameters by search, with what passes as a constraint:
Abdessalem et al., Automated Repair of Feature Interaction Failures in Automated Driving Systems
(ARIEL), ISSTA 2020, doi:10.1145/3395363.3397386; CMA-ES: Hansen (2016), arXiv:1604.00772.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.assess.cause import Cause, Counterfactual
from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.findings import Findings, is_unsafe_start
from bridgegen.assess.conflict.plausibility import Implausible, plausibility
from bridgegen.base.arrays import Bool, Float
from bridgegen.drivers.tunable import Settings, Tunable
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Lost, Workers
from bridgegen.search.algorithms.cma_es import reflected
from bridgegen.simulation.rollout import Rollout

HARM, CHANGE, BROKEN = 0.5, 0.1, 10.0
"""Weights in the cost of settings, beside the share of failing rows: of the mean harm there, of the
mean change as a share of the ranges, and of what breaks a constraint, so that it is never worth a
mended row."""

STEP = 0.25
"""Initial standard deviation, as a share of the ranges."""

DIGITS = 4
"""Significant digits of a value that is tried: what is written is what was simulated."""

STALLED = 3
"""Generations without a better setting after which nothing more is sought once all is mended."""

JERK, SPEED = 0.01, 0.01
"""Least mean jerk [m/s³] and speed [m/s] that ratios are made of: those of a driver that stands."""


@dataclass(frozen=True)
class Driven:
    """What a driver makes of N rows.

    Attributes:
        fails: ``(N,)`` bool: critical, or a pass criterion is violated.
        passes: ``(N,)`` bool; a row that has no result, or implausible traffic, does neither.
        harm: ``(N,)``, 0 without a result.
        motion: ``(N, 3)``: changes of the acceleration [m/s²], time [s] and way [m], in total.
    """

    fails: Bool
    passes: Bool
    harm: Float
    motion: Float


def drive(pipeline: Pipeline, X: Float, settings: Settings, workers: Workers) -> Driven:
    """Drive rows with settings.

    Args:
        pipeline: of the scenario and the driver.
        X: ``(N, len(pipeline.space.names))``.
        settings: of its tunable numbers.
        workers: threads of this process.
    """
    nothing = np.zeros(0, np.bool_)
    parts = [Driven(nothing, nothing, np.zeros(0), np.zeros((0, 3)))]
    for part in workers.map(pipeline, _drive, X, settings) if len(X) else ():
        none = np.zeros(part.rows, np.bool_)
        lost = Driven(none, none, np.zeros(part.rows), np.zeros((part.rows, 3)))
        parts.append(lost if isinstance(part.result, Lost) else part.result)
    return Driven(*(np.concatenate(column) for column in zip(*map(_fields, parts), strict=True)))


def _fields(driven: Driven) -> tuple[Float, ...]:
    return driven.fails, driven.passes, driven.harm, driven.motion  # type: ignore[return-value]


def _drive(pipeline: Pipeline, X: Float, settings: Settings) -> Driven:
    objective, names = pipeline.objective, list(pipeline.metrics)
    driver = replace(pipeline.runner.driver, settings=settings)
    rollout = pipeline.runner.run(X, fix=Counterfactual(Cause.NONE, driver))
    metrics, gate, ok = pipeline.measure(rollout), plausibility(rollout), rollout.status == 0
    fit: Bool = gate.code == Implausible.NONE
    counts = objective.F(metrics, names, fit if objective.gated else True)[1]
    margins = metrics[:, [names.index(name) for name in pipeline.monitor.names]]
    fails = ok & ((objective.critical(metrics, names) & counts) | (margins < 0.0).any(axis=1))
    harm = np.nan_to_num(metrics[:, names.index(objective.harm)]) * ok
    findings = Findings.of(analyse(rollout), gate.labels, objective.count)
    passes = ok & ~fails & fit & ~is_unsafe_start(findings, harm)
    return Driven(fails, passes, harm, np.where(ok[:, np.newaxis], _motion(rollout), 0.0))


def _motion(rollout: Rollout) -> Float:
    n = rollout.n_steps[:, np.newaxis]
    steps = np.arange(rollout.shape[2])
    v, a = rollout.v[:, 0], rollout.a[:, 0]
    way = (np.abs(v) * (steps < n - 1)).sum(axis=1) * rollout.time_step
    change = (np.abs(np.diff(a, axis=1)) * (steps[1:] < n - 1)).sum(axis=1)
    time = (rollout.n_steps - 1) * rollout.time_step
    return np.stack([change, time, way], axis=1)


@dataclass(frozen=True)
class Trial:
    """Settings, and what a driver makes of the rows with them.

    Attributes:
        values: of the tunable numbers, in their order.
        fails: ``(F,)`` bool, of the rows that have failed.
        mends: ``(F,)`` bool, those of them that pass.
        harm: ``(F,)`` float64, of these rows.
        broken: number of rows that have passed and fail.
        jerk: mean, / that without settings.
        travel_time: per distance, / that without settings.
        cost: less is better.
        is_feasible: whether nothing is broken, and jerk and travel time are within their limits.
    """

    values: tuple[float, ...]
    fails: Bool
    mends: Bool
    harm: Float
    broken: int
    jerk: float
    travel_time: float
    cost: float
    is_feasible: bool

    @property
    def rank(self) -> tuple[bool, float]:
        """Less is better; what is not feasible is never better."""
        return not self.is_feasible, self.cost


class Bench:
    """Tries settings on the rows of several scenarios: those that have failed, and passed.

    Args:
        pipelines: of the scenarios.
        tunable: the driver's numbers.
        base: what they are now.
        within: share by which jerk and travel time may grow.
        workers: threads of this process.
    """

    def __init__(
        self,
        pipelines: Sequence[Pipeline],
        tunable: tuple[Tunable, ...],
        base: tuple[float, ...],
        within: float,
        workers: Workers,
    ) -> None:
        self.pipelines, self.tunable, self.base = pipelines, tunable, base
        self._within, self._workers = within, workers
        self.failing = [np.zeros((0, len(item.space.names))) for item in pipelines]
        self._passed, self._drawn = list(self.failing), [0] * len(pipelines)
        self._motion, self.tried = np.zeros(3), 0
        self.never = np.zeros(0, np.bool_)
        """``(F,)`` bool, the failing rows that no setting mends that was tried."""
        self._known: dict[tuple[float, ...], Trial] = {}

    def drive(self, scene: int, X: Float, values: tuple[float, ...]) -> Driven:
        """Drive rows of one of the scenarios."""
        settings = tuple(zip((item.name for item in self.tunable), values, strict=True))
        return drive(self.pipelines[scene], X, settings, self._workers)

    def guard(self, scene: int, drawn: Float, found: Float) -> Float:
        """Keep rows that pass now, and must still pass; return those that fail.

        Args:
            scene: number of the scenario.
            drawn: random rows, by which jerk and travel time are measured.
            found: rows that a search has chosen.
        """
        X = np.concatenate([drawn, found])
        driven = self.drive(scene, X, self.base)
        passes = driven.passes.copy()
        self._passed[scene] = X[passes]
        passes[len(drawn) :] = False
        self._drawn[scene] = int(passes.sum())
        self._motion += driven.motion[passes].sum(axis=0)
        return X[driven.fails]

    def add(self, failing: Sequence[Float]) -> None:
        """Add rows that fail, of each scenario; what was tried has not been tried on them."""
        sizes = np.cumsum([len(X) for X in self.failing])
        self.never = np.concatenate(
            [
                part
                for old, X in zip(np.split(self.never, sizes[:-1]), failing, strict=True)
                for part in (old, np.ones(len(X), np.bool_))
            ]
        )
        self.failing = [np.concatenate(pair) for pair in zip(self.failing, failing, strict=True)]
        self._known.clear()

    def trial(self, values: tuple[float, ...]) -> Trial:
        """Try settings; those that were tried before are not simulated again."""
        if values in self._known:
            return self._known[values]
        failed = [self.drive(i, X, values) for i, X in enumerate(self.failing)]
        passed = [self.drive(i, X, values) for i, X in enumerate(self._passed)]
        fails, mends, harm = (
            np.concatenate([getattr(driven, name) for driven in failed])
            for name in ("fails", "passes", "harm")
        )
        guards = np.concatenate([driven.fails for driven in passed])
        drawn = zip(passed, self._drawn, strict=True)
        motion = np.sum([driven.motion[:n].sum(axis=0) for driven, n in drawn], axis=0)
        (jerk, speed), (old_jerk, old_speed) = _manner(motion), _manner(self._motion)
        slower = old_speed / speed
        excess = [max(0.0, ratio - 1.0 - self._within) for ratio in (jerk / old_jerk, slower)]
        broken = int(guards.sum())
        wrong = broken / max(1, len(guards)) + sum(excess)
        change = np.abs(self.unit(values) - self.unit(self.base)).mean()
        cost = float((~mends).mean() + HARM * harm.mean() + CHANGE * change + BROKEN * wrong)
        found = Trial(values, fails, mends, harm, broken, jerk / old_jerk, slower, cost, not wrong)
        self.never, self.tried = self.never & ~mends, self.tried + 1
        self._known[values] = found
        return found

    def unit(self, values: Sequence[float]) -> Float:
        """Return values as shares of their ranges."""
        return np.array(
            [(value - item.low) / (item.high - item.low) for item, value in self._each(values)]
        )

    def _each(self, values: Sequence[float]) -> list[tuple[Tunable, float]]:
        return list(zip(self.tunable, values, strict=True))

    def rounded(self, shares: Float) -> tuple[float, ...]:
        """Return the values at shares of the ranges, with a few digits."""
        return tuple(
            min(max(float(f"{value:.{DIGITS}g}"), item.low), item.high)
            for item, share in self._each(shares.tolist())
            for value in [item.low + share * (item.high - item.low)]
        )

    def tune(self, start: tuple[float, ...], tries: int, seed: Sequence[int]) -> Trial:
        """Return the best feasible settings; the present ones if there is none better.

        First the least and the greatest value of each number alone; then CMA-ES from the best on;
        then numbers are put back that mend nothing.

        Args:
            start: settings of an earlier round.
            tries: how many settings are tried at most, besides numbers put back.
            seed: of the random numbers.
        """
        from cmaes import CMA  # loads a part of SciPy

        best = min(self.trial(self.base), self.trial(start), key=lambda trial: trial.rank)
        ends = [
            (*self.base[:k], end, *self.base[k + 1 :])
            for k, item in enumerate(self.tunable)
            for end in (item.low, item.high)
        ][: tries - 2]
        best = min([best, *map(self.trial, ends)], key=lambda trial: trial.rank)
        n = len(self.tunable)
        # Of one number CMA has no covariance: a second one, which stands for nothing, gives it one.
        mean = np.append(self.unit(best.values), [0.5] * (n == 1))
        random = np.random.Generator(np.random.PCG64(seed))
        search = CMA(mean, STEP, seed=int(random.integers(2**32)))
        left, stalled = tries - 2 - len(ends), 0
        while left >= search.population_size and not search.should_stop():
            drawn = [search.ask() for _ in range(search.population_size)]
            trials = [self.trial(self.rounded(reflected(row[:n]))) for row in drawn]
            search.tell([(row, trial.cost) for row, trial in zip(drawn, trials, strict=True)])
            left -= len(drawn)
            before, best = best, min([best, *trials], key=lambda trial: trial.rank)
            stalled = 0 if best is not before else stalled + 1
            if stalled >= STALLED and best.mends.all():
                break
        return self._least(best)

    def _least(self, best: Trial) -> Trial:
        """Return settings that mend as many rows and change as few numbers as can be."""
        change = np.abs(self.unit(best.values) - self.unit(self.base))
        for k in np.argsort(change, kind="stable").tolist():
            values = (*best.values[:k], self.base[k], *best.values[k + 1 :])
            trial = self.trial(values)
            if trial.is_feasible and trial.mends.sum() >= best.mends.sum():
                best = trial
        return best


def _manner(motion: Float) -> tuple[float, float]:
    """Return mean absolute jerk [m/s³] and mean speed [m/s]."""
    change, time, way = motion.tolist()
    time = max(time, 1e-9)
    return max(change / time, JERK), max(way / time, SPEED)
