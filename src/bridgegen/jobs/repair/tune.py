"""Settings that mend failures: CMA-ES over the tunable numbers, then a check on many rows.

Settings are tried on few rows: those that fail, and guards, which must still pass. The best are
checked on many more. What they break there become guards, and the next best are checked
(counterexample-guided, as programs are synthesised).

Source: Abdessalem et al. (ARIEL), ISSTA 2020, doi:10.1145/3395363.3397386, for repair by search
with what passes as a constraint; CMA-ES: Hansen (2016), arXiv:1604.00772.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

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
from bridgegen.search.triage.moves import around
from bridgegen.search.triage.neighbours import NEIGHBOURS, RADIUS, ROBUST

if TYPE_CHECKING:
    from cmaes import CMA

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

FIXED, TESTED, CHECKED = 10, 16, 8
"""Rows that settings must fix for each one that they break; broken rows of which neighbours are
driven at most; settings that are checked in a round at most."""

FIRST, FACTOR = 128, 4
"""Rows that a check drives first, and times as many in each further step."""

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

    def at(self, index: Int) -> "Rows":
        """Return some of them."""
        return Rows(tuple(self.X[i] for i in index.tolist()), self.scene[index])


NONE = Rows((), np.zeros(0, np.int64))


@dataclass(frozen=True)
class Trial:
    """Settings, and what the driver makes of rows with them.

    Attributes:
        values: of the tunable numbers, in their order.
        mends: ``(F,)`` bool, which of the rows that have failed pass.
        is_feasible: whether all that has passed does not fail, and jerk and time are in bounds;
            False where that was not driven, as the cost says enough.
        cost: less is better.
    """

    values: tuple[float, ...]
    mends: Bool
    is_feasible: bool
    cost: float

    @property
    def rank(self) -> tuple[bool, float]:
        """Less is better; what is not feasible is never better."""
        return not self.is_feasible, self.cost


def supported(fixed: int, broken: int, robust: int) -> bool:
    """Return whether rows support settings: none is broken robustly, and far more are fixed."""
    return not robust and FIXED * broken <= fixed


class Bench:
    """Tries settings on rows that have failed, and on rows that have passed.

    Args:
        pipelines: of the scenarios.
        tunable: the driver's numbers.
        base: what they are now.
        seed: of neighbours.

    Attributes:
        failing: rows that settings are to mend; the job adds to them.
        manners: mean jerk and travel time of settings that were checked, / those without.
    """

    def __init__(
        self,
        pipelines: Sequence[Pipeline],
        tunable: tuple[Tunable, ...],
        base: tuple[float, ...],
        seed: int = 0,
    ) -> None:
        self.pipelines, self.tunable, self.base, self.seed = pipelines, tunable, base, seed
        self.failing, self.guards, self.drawn = NONE, NONE, NONE
        self._base = np.zeros((0, 6))  # of drawn rows
        self._mannered = self._sought = 0
        self.manners = dict[tuple[float, ...], Float]()
        self._refuted = set[tuple[float, ...]]()
        # What is known of rows that failed, and of guards: the first ones of each, by settings.
        self._failed = dict[tuple[float, ...], Float]()
        self._passed = dict[tuple[float, ...], Float]()
        self._workers = Threads()

    @property
    def tried(self) -> int:
        """How many settings were tried."""
        return len(self._failed)

    @property
    def never(self) -> Bool:
        """``(F,)``, rows that no settings mend that were tried on them."""
        found = np.ones(len(self.failing.X), np.bool_)
        for driven in self._failed.values():
            found[: len(driven)] &= driven[:, PASSES] == 0.0
        return found

    def drive(self, rows: Rows, values: tuple[float, ...]) -> Float:
        """Drive rows; return what becomes of each, ``(N, 6)``."""
        settings = tuple(zip((item.name for item in self.tunable), values, strict=True))
        found = np.zeros((len(rows.X), 6))
        for scene in np.unique(rows.scene).tolist():
            at = np.flatnonzero(rows.scene == scene)
            X, pipeline = np.stack([rows.X[i] for i in at]), self.pipelines[scene]
            parts = self._workers.map(pipeline, drive, X, settings)
            lost = [isinstance(part.result, Lost) for part in parts]
            each = zip(parts, lost, strict=True)
            found[at] = np.concatenate(
                [np.zeros((p.rows, 6)) if no else p.result for p, no in each]
            )
        return found

    def draw(self, drawn: Rows) -> None:
        """Take random rows: settings, their jerk and travel time are checked on them."""
        self.drawn, self._base = drawn, self.drive(drawn, self.base)

    def drawn_that(self, column: int, most: int) -> Rows:
        """Return the first drawn rows of each scenario that pass or fail."""
        that, scene = self._base[:, column] > 0.0, self.drawn.scene
        at = [np.flatnonzero(that & (scene == k))[:most] for k in range(len(self.pipelines))]
        return self.drawn.at(np.concatenate(at))

    def guard(self, drawn: Rows, found: Rows = NONE) -> None:
        """Add rows that must still pass: drawn ones, and those of others that pass."""
        driven = self.drive(found, self.base)
        if not self.guards.X:
            self._mannered = len(drawn.X)  # of the guards the first, by which manner is measured
        self.guards += drawn + found.at(np.flatnonzero(driven[:, PASSES]))

    def _known(
        self, of: dict[tuple[float, ...], Float], rows: Rows, values: tuple[float, ...]
    ) -> Float:
        known = of.get(values, np.zeros((0, 6)))
        if len(known) < len(rows.X):
            more = self.drive(rows.at(np.arange(len(known), len(rows.X))), values)
            of[values] = known = np.concatenate([known, more])
        return known

    def trial(self, values: tuple[float, ...], limit: float = np.inf) -> Trial:
        """Try settings, on guards only below a cost; what was driven is not driven again."""
        failed = self._known(self._failed, self.failing, values)
        mends, cost = failed[:, PASSES] > 0.0, self._cost(values, failed)
        if cost >= limit:
            return Trial(values, mends, False, cost)
        passed = self._known(self._passed, self.guards, values)
        wrong = passed[:, FAILS].sum() / max(1, len(passed))
        before = self._known(self._passed, self.guards, self.base)
        manner = _manner(passed[: self._mannered]) / _manner(before[: self._mannered])
        wrong += np.maximum(0.0, manner - 1.0 - WITHIN).sum()
        is_feasible = not wrong and values not in self._refuted
        return Trial(values, mends, is_feasible, float(cost + BROKEN * wrong))

    def _cost(self, values: tuple[float, ...], failed: Float) -> float:
        """Return the cost of failures and of the change."""
        change = np.abs(self.unit(values) - self.unit(self.base)).mean()
        left, harm = 1.0 - failed[:, PASSES].mean(), failed[:, WORST].mean()
        return float(left + HARM * harm + CHANGE * change)

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
        then numbers are put back that mend nothing. The best are checked (see `choose`); where
        that refutes some, CMA-ES begins again with half as many tries.

        Args:
            start: settings of an earlier round.
            tries: how many settings are tried, besides numbers put back.
            seed: of the random numbers.
        """
        from cmaes import CMA  # loads a part of SciPy

        base, self._sought = self.base, len(self.failing.X)
        ends = [
            (*base[:k], end, *base[k + 1 :])
            for k, item in enumerate(self.tunable)
            for end in (item.low, item.high)
        ]
        first = [base, start, *ends][:tries]
        best = self.trial(base)
        for values in first[1:]:
            best = min(best, self.trial(values, best.cost), key=lambda trial: trial.rank)
        left, refuted = tries - len(first), -1
        random = np.random.Generator(np.random.PCG64(seed))
        while left > 0 and refuted < len(self._refuted):
            refuted = len(self._refuted)
            # Of one number CMA has no covariance: a second one, of no meaning, gives it one.
            mean = np.append(self.unit(best.values), [0.5] * (len(self.tunable) == 1))
            self._search(CMA(mean, STEP, seed=int(random.integers(2**32))), best, left)
            best, left = self.choose(), left // 2  # what was refuted is infeasible now
        return best

    def _search(self, search: "CMA", best: Trial, left: int) -> None:
        """Try settings by CMA-ES, then the best with numbers as they were."""
        n, stalled = len(self.tunable), 0
        while left >= search.population_size and not search.should_stop():
            drawn = [search.ask() for _ in range(search.population_size)]
            before, limit = best, best.cost
            trials = [self.trial(self._rounded(reflected(row[:n])), limit) for row in drawn]
            search.tell([(row, trial.cost) for row, trial in zip(drawn, trials, strict=True)])
            left -= len(drawn)
            best = min([best, *trials], key=lambda trial: trial.rank)
            stalled = stalled + 1 if best is before else 0
            if stalled >= STALLED and best.mends.all():
                break
        self._put_back(best)

    def _put_back(self, best: Trial) -> Trial:
        """Try each number of settings as it was, the least changed first."""
        shares = np.abs(self.unit(best.values) - self.unit(self.base))
        for k in np.argsort(shares, kind="stable").tolist():
            trial = self.trial((*best.values[:k], self.base[k], *best.values[k + 1 :]), -1.0)
            if trial.mends.sum() >= best.mends.sum():
                trial = self.trial(trial.values)
                best = trial if trial.is_feasible else best
        return best

    def choose(self) -> Trial:
        """Return the best settings that were tried and that a check supports; else the present."""
        base, left, n = self.trial(self.base), CHECKED, self._sought
        # By the cost of failures alone, which is known of all; guards are driven where they decide.
        costs = {
            values: self._cost(values, failed[:n])
            for values, failed in self._failed.items()
            if len(failed) >= n
        }
        for values in sorted(costs, key=lambda values: costs[values]):
            if not left:
                break
            trial = self.trial(values, base.cost)
            if trial.rank >= base.rank:
                continue
            put_back = self._put_back(trial)
            if self._check(put_back.values):
                return self.trial(put_back.values)
            left -= 1
        return base

    def _check(self, values: tuple[float, ...]) -> bool:
        """Return whether drawn rows support settings; else what they break become guards."""
        if values in self.manners or values in self._refuted or values == self.base:
            return values not in self._refuted
        n, size, driven = len(self.drawn.X), FIRST, np.zeros((0, 6))
        fails, is_well = int((self._base[:, FAILS] > 0.0).sum()), True
        while is_well and len(driven) < n:
            part = self.drawn.at(np.arange(len(driven), min(n, size)))
            driven = np.concatenate([driven, self.drive(part, values)])
            before, size = self._base[: len(driven)], size * FACTOR
            fixes, breaks = changes(before, driven)
            broken = self.drawn.at(np.flatnonzero(breaks))
            unfixed = (before[:, FAILS] > 0.0) & ~fixes
            is_well = supported(fails - int(unfixed.sum()), len(broken.X), 0)
        if is_well and n:
            is_well = not self.robust(broken, values).any()
        if not is_well:
            self.guards += broken.at(np.arange(min(len(broken.X), TESTED)))
        else:
            passes = self._base[:, PASSES] > 0.0
            self.manners[values] = _manner(driven[passes]) / _manner(self._base[passes])
            is_well = bool((self.manners[values] <= 1.0 + WITHIN).all())
        if not is_well:
            self._refuted.add(values)
        return is_well

    def robust(self, broken: Rows, values: tuple[float, ...]) -> Bool:
        """Return which of the first broken rows fail robustly: most of their neighbours, too."""
        some = broken.at(np.arange(min(len(broken.X), TESTED)))
        near = [
            around(self.pipelines[k].space, x, self.seed, i, NEIGHBOURS, RADIUS)[0]
            for i, (x, k) in enumerate(zip(some.X, some.scene.tolist(), strict=True))
        ]
        rows = Rows(tuple(x for X in near for x in X), np.repeat(some.scene, NEIGHBOURS))
        fails = self.drive(rows, values)[:, FAILS].reshape(-1, NEIGHBOURS)
        return np.asarray(fails.mean(axis=1) >= ROBUST)


def changes(before: Float, after: Float) -> tuple[Bool, Bool]:
    """Return which rows are fixed, and which are broken."""
    fixes = (before[:, FAILS] > 0.0) & (after[:, PASSES] > 0.0)
    return fixes, (before[:, PASSES] > 0.0) & (after[:, FAILS] > 0.0)


def _manner(driven: Float) -> Float:
    """Return mean absolute jerk [m/s³] and travel time [s/m]; of a driver that stands, bounds."""
    changes, time, way = driven[:, [CHANGES, TIME, WAY]].sum(axis=0).tolist()
    time = max(time, 1e-9)
    return np.array([max(changes / time, 0.01), 1.0 / max(way / time, 0.01)])
