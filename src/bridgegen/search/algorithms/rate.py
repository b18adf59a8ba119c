"""A search that also says how often: each row is drawn with a chance that is known.

A batch is drawn of a new pool: points as on the road, points that are uniform over the ranges, and
points near failures. Each row of the batch is drawn of the pool by one of four rules: as on the
road; evenly; where a model says that harm is likely and the road goes; or, for new failures, where
the model says that harm is likeliest far from known failures, or a sample path of the objective is
least. The chance of each row, by all rules together, depends on earlier results and rows alone, so
harm weighted by the road's density over the chance is an unbiased estimate, whatever the models
are worth (`bridgegen.search.triage.rates`).

A cheap simulator, the screen, evaluates the points of each pool, of which there are as many as its
budget allows. Models see its result beside the parameters, and learn what it is worth.

Source: importance sampling from a mixture with a defensive part: Owen and Zhou (2000),
doi:10.1080/01621459.2000.10473909; adaptively: Cornuet et al. (2012), arXiv:0907.1254; rows drawn
one by one with known chances, by a surrogate: Kossen et al. (2021), arXiv:2103.05331; search and
estimate from one budget: Mei et al. (2024), arXiv:2411.17826.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import ClassVar, Self

import numpy as np
from scipy.special import ndtr

from bridgegen.base.arrays import Bool, Float
from bridgegen.search.algorithms.algorithm import (
    Arity,
    Problem,
    Results,
    Road,
    Setting,
    Value,
    resolve,
)
from bridgegen.search.surrogates.gaussian_process import GaussianProcess, Parameters
from bridgegen.search.surrogates.known import Known, compressed, distances
from bridgegen.search.surrogates.subset import telling

POOL, LEAST_POOL = 2048, 16
"""Number of points of which a batch is drawn, new ones for each batch; with a screen, at least."""

POOL_ROAD, POOL_EVEN = 0.25, 0.25
"""Shares of a pool that are as on the road, and uniform over the ranges; the others lie near bases.
Half each in the first pool, which has no bases."""

MORE = 16.0
"""Factor by which a pool has more points near bases, at most, where few of them can happen."""

FOUND, BEST = 30, 10
"""Numbers of bases: the distinct critical rows found last, and the best rows."""

KEPT, WIDTH = (0.5, 0.9), (0.3, 0.5)
"""Probability that a normal score of a point stays near its base, and the standard deviation of its
step if it does; else it is as on the road. Two kinds of points, equally often."""

MODEL_ROWS = 300
"""Maximum number of rows that a process is fitted to."""

PATHS = 1024
"""Number of points of a pool at which sample paths are computed."""

TOP = 8
"""Number of best points of which a seeking row is drawn evenly."""

LIKELY = 7
"""Number of ten seeking rows that are likely critical, once a critical row is known."""


SURE = 4.0
"""Power of the likelihood of harm by which half of the rows for the rate are drawn."""

DOUBT = 1.25
"""By what deviations of a model are divided: models of a few hundred rows are too certain."""

RAMP = 10.0
"""Number of known critical rows with which a row counts half as much as one that is drawn last."""

LEAST_SHARE = 0.6
"""Least part of the rows set aside for the rate that is used for it; the others seek failures. They
become fewer from about a quarter of the failures on that the precision needs."""


class Everywhere:
    """The road of a search without an exposure: the unit cube, uniformly; see `Road`."""

    share = (1.0, 1.0, 1.0)

    def __init__(self, n_var: int) -> None:
        self.dimensions, self.continuous = n_var, np.ones(n_var, np.bool_)

    def rows(self, Z: Float) -> tuple[Float, Bool, Float]:
        """See `Road`."""
        return ndtr(Z), np.ones(len(Z), np.bool_), np.zeros(len(Z))

    def met(self, n: int, random: np.random.Generator) -> Float:
        """See `Road`."""
        return random.standard_normal((n, self.dimensions))

    def even(self, n: int, random: np.random.Generator) -> tuple[Float, Bool]:
        """See `Road`."""
        return random.standard_normal((n, self.dimensions)), np.ones(n, np.bool_)


@dataclass(frozen=True)
class Draws:
    """Rows in the order in which they were drawn.

    Attributes:
        U: ``(n, n_var)``.
        Z: ``(n, dimensions)``, their normal scores.
        weights: ``(n,)``, how much likelier each one is on the road than it was to be drawn.
        blind: ``(n,)``, the part of its chance that no model has a say in.
        road: ``(n,)``, the share of rows that were drawn as on the road when it was.
        batch: ``(n,)``, number of its batch.
        known: ``(n,)``, critical rows that were known then.
    """

    U: Float
    Z: Float
    weights: Float
    blind: Float
    road: Float
    batch: Float
    known: Float

    @classmethod
    def none(cls, n_var: int, dimensions: int) -> Self:
        """Return no rows."""
        return cls(np.empty((0, n_var)), np.empty((0, dimensions)), *[np.empty(0)] * 5)

    def followed_by(self, more: "Draws") -> "Draws":
        """Return these rows and more."""
        names = [item.name for item in fields(self)]
        return Draws(*(np.concatenate([getattr(self, n), getattr(more, n)]) for n in names))

    def take(self, n: int) -> "Draws":
        """Return the first n rows."""
        return Draws(*(getattr(self, item.name)[:n] for item in fields(self)))


@dataclass(frozen=True)
class _Pool:
    """The points of a pool that can happen.

    Attributes:
        Z: ``(m, dimensions)``.
        U: ``(m, n_var)``.
        points: ``(m, n_var)``, what a model sees of U.
        road: ``(m,)``, how much likelier each one is on the road than in the pool.
        even: ``(m,)``, likewise, among rows that are uniform over the ranges.
        size: number of points, with those that cannot happen.
        by_screen: ``(m, 2)``, by the screen: objective (inf where it failed, or its budget was
            spent), and whether critical; ``(m, 0)`` without one.
    """

    Z: Float
    U: Float
    points: Float
    road: Float
    even: Float
    size: int
    by_screen: Float


@dataclass(frozen=True)
class _Model:
    """What the rows so far say of a pool.

    Attributes:
        objective: a process of the objective.
        points: ``(m, k)``, what it sees of the pool: points, and what the screen says.
        by_label: ``(m,)``, by how many deviations each point lies on the harmful side, by a process
            of the label; None before both labels are known.
        likely: ``(m,)``, how likely harm is; likewise.
    """

    objective: GaussianProcess
    points: Float
    by_label: Float | None
    likely: Float | None


def row_weights(draws: Draws) -> Float:
    """Return what each row adds to the estimate if it is harmful, ``(n,)``.

    Batches count by their number of rows, and by the failures that were known before them: rows
    that were drawn before there was a model vary most. Both are known when a batch is drawn, so
    each batch is unbiased whatever the model.
    """
    counts = draws.known / (draws.known + RAMP)
    if not counts.sum() > 0.0:
        counts = np.ones(len(draws.known))
    weights: Float = draws.weights * counts / counts.sum()
    return weights


def effective(parts: Float) -> float:
    """Return as how many equal parts parts count: 0 where all are 0."""
    # They are where failures were known only after the last batch was drawn.
    return float(parts.sum()) ** 2 / max(float(np.sum(parts * parts)), 1e-300)


class Rate:
    """Failures, and how often they happen, from one budget; see the module."""

    name: ClassVar[str] = "rate"
    description: ClassVar[str] = "new failures by a model, each row with a known chance, for rates"
    source: ClassVar[str] = (
        "Mei et al. (2024), arXiv:2411.17826; Owen and Zhou (2000), "
        "doi:10.1080/01621459.2000.10473909"
    )
    settings: ClassVar[Mapping[str, Setting]] = {
        "initial": Setting(40, "number of initial rows", 2, 100_000),
        "batch": Setting(10, "rows per batch, at least", 1, 10_000),
        "growth": Setting(
            0.2, "rows per batch at least, as a share of the critical ones known", 0.0, 1.0
        ),
        "road": Setting(0.25, "share of the rows that are drawn as on the road", 0.01, 0.5),
        "even": Setting(0.05, "share of the rows that are uniform over the ranges", 0.0, 0.25),
        "rate": Setting(
            0.25,
            "share of the rows that make the rate precise; less once many failures are known",
            0.0,
            0.5,
        ),
        "apart": Setting(
            0.1,
            "distance kept from critical rows, as a share of the ranges, in root mean square",
            0.0,
            1.0,
        ),
        "precision": Setting(
            0.2,
            "end when the 95 % interval's half-width is below this fraction of the probability, "
            "and no failure mode is new; 0: at the end of the budget",
            0.0,
            1.0,
        ),
    }
    objectives: ClassVar[Arity] = "one"

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self.values = resolve(type(self), problem, seed, settings)
        self.road: Road = problem.road or Everywhere(problem.n_var)
        self._is_even = problem.road is None
        self._known = Known(problem, self.values["apart"])
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._of_objective: Parameters | None = None
        self._of_label: Parameters | None = None
        self._problem = problem
        self._by_screen = np.empty((0, 2 if problem.screen else 0))  # of draws, see `_Pool`
        self.draws = Draws.none(problem.n_var, self.road.dimensions)

    @property
    def critical(self) -> Bool:
        """Which of the rows that are told are critical, in the order of ``draws``."""
        return self._known.critical

    def ask(self) -> Float:
        """Return rows as on the road and over the ranges at first, then batches."""
        known, values = self._known, self.values
        many = max(int(known.critical.sum()), len(known) // 10)
        n = max(values["batch"], int(values["growth"] * many)) if len(known) else values["initial"]
        pool = self._pool(n)
        as_road, evenly = values["road"], values["even"]
        if not known.critical.any():  # where harm is rare, rows as on the road do not lead to it
            evenly = as_road
        blind = as_road * _shared(pool.road) + evenly * _shared(pool.even)
        model = self._model(pool) if len(known) else None
        seek = self._seeker(pool, model, n) if model else _as_screened(pool)
        stated, base = as_road + evenly, blind
        if model and model.likely is not None:
            hits = effective(row_weights(self.draws)[known.critical])
            part = 1.0 / max(hits * values["precision"] ** 2, 1e-9)
            rate = values["rate"] * min(max(part, LEAST_SHARE), 1.0)
            stated += rate
            # Where harm is rare, what is hardly likely outweighs it on the road: half of these rows
            # go where it is likely in any case.
            for power in (1.0, SURE):
                weights = pool.road * model.likely**power
                base = base + 0.5 * rate * _shared(weights)
        taken: list[int] = []
        chances, parts = np.empty(n), np.empty(n)
        for k in range(n):
            scale = 1.0 if seek else 1.0 / stated
            chance = base + (1.0 - stated) * seek(k, taken) if seek else base * scale
            total = np.cumsum(chance)
            at = int(np.searchsorted(total, self._rng.random() * total[-1], side="right"))
            at = min(at, len(total) - 1)
            taken.append(at)
            chances[k], parts[k] = chance[at], scale * blind[at] / chance[at]
        share = scale * (as_road + evenly * self._is_even)
        of_batch = self.draws.batch[-1] + 1.0 if len(self.draws.batch) else 0.0
        drawn = Draws(
            pool.U[taken],
            pool.Z[taken],
            pool.road[taken] / (pool.size * chances),
            parts,
            np.full(n, share),
            np.full(n, of_batch),
            np.full(n, float(known.critical.sum())),
        )
        self.draws = self.draws.followed_by(drawn)
        self._by_screen = np.concatenate([self._by_screen, pool.by_screen[taken]])
        known.expect(drawn.U)
        return drawn.U

    def tell(self, U: Float, results: Results) -> None:
        """Record the rows; the next batch learns from them."""
        self._known.add(U, results.F[:, 0], results.ok, results.critical)

    def _pool(self, n: int) -> _Pool:
        """Return a new pool for a batch of n rows."""
        screen, many = self._problem.screen, POOL
        if screen is not None:
            # By earlier rows alone. If more points can happen than expected, the last ones are
            # beyond the screen's budget, and it says nothing of them.
            due = min(int(screen.each * (self._known.different + n)), screen.budget)
            many = min(max(due - screen.evaluations, 2 * n, LEAST_POOL), POOL)
        rng, road, known = self._rng, self.road, self._known
        best = np.argsort(known.F, kind="stable")[:BEST]
        bases = self.draws.Z[np.union1d(known.distinct[-FOUND:], best)]
        a, b = (POOL_ROAD, POOL_EVEN) if len(bases) else (0.5, 0.5)
        n_road, n_even, n_near = int(a * many), int(b * many), 0
        evenly, there = road.even(n_even, rng)
        Z = [road.met(n_road, rng), evenly[there]]
        share = road.share[1]
        if len(bases):
            # Where constraints leave little of the normal space, most points near bases break one.
            n_near = int((many - n_road - n_even) * min(1.0 / share, MORE))
            Z.append(near(bases, road.continuous, n_near, rng))
        points, size = np.concatenate(Z), n_road + n_even + n_near
        U, feasible, log_even = road.rows(points)
        points, U, log_even = points[feasible], U[feasible], log_even[feasible]
        # All densities over the road's, which is a standard normal one over its feasible share.
        with np.errstate(over="ignore", invalid="ignore"):
            even = np.exp(log_even)
            pool = n_road + n_even * even
            if len(bases):
                pool = pool + n_near * share * density_near(points, bases, road.continuous)
            of_road, of_even = size / pool, size * even / pool
        good = np.isfinite(of_even) & (of_road > 0.0)
        points, U = points[good], U[good]
        by_screen = np.empty((len(U), 0))
        if screen is not None:
            said, _ = screen.evaluate(U)
            by_screen = np.column_stack([np.where(said.ok, said.F[:, 0], np.inf), said.critical])
        seen = known.columns.points(U)
        return _Pool(points, U, seen, of_road[good], of_even[good], size, by_screen)

    def _seen(self, pool: _Pool) -> tuple[Float, Float]:
        """Return what processes see of the known rows, and of a pool."""
        points = np.concatenate([self._known.points, pool.points])
        if self._problem.screen is not None:
            said = np.concatenate([self._by_screen[: len(self._known)], pool.by_screen])
            scores = compressed(said[:, 0])
            scores = (scores - scores.min()) / max(float(np.ptp(scores)), 1e-12)
            points = np.column_stack([points, scores, said[:, 1]])
        return points[: len(self._known)], points[len(self._known) :]

    def _model(self, pool: _Pool) -> _Model:
        """Return what the rows so far say of the points of a pool."""
        known = self._known
        scores, critical = known.scores(), known.critical
        rows, (points, seen) = telling(scores, MODEL_ROWS), self._seen(pool)
        objective = GaussianProcess(points[rows], scores[rows], self._of_objective)
        self._of_objective = objective.parameters
        if not critical.any() or critical.all():
            return _Model(objective, seen, None, None)
        # As in `Surrogate`: harm leaps where a row becomes critical.
        scale = critical.std()
        label = -critical.astype(np.float64) / scale
        rows = telling(label, MODEL_ROWS)
        process = GaussianProcess(points[rows], label[rows], self._of_label)
        self._of_label = process.parameters
        by_label = _deviations(process, seen, -0.5 / scale)
        least = 0.5 * float(scores[critical].max() + scores[~critical].min())
        by_objective = _deviations(objective, seen, least)
        # Either process misses what the other one knows: of the failures of crossroads-s4, the
        # variance was half of that with the label alone.
        both = ndtr(np.maximum(by_label, by_objective) / DOUBT)
        return _Model(objective, seen, by_label, np.maximum(both, 1e-12))

    def _seeker(self, pool: _Pool, model: _Model, n: int) -> Callable[[int, list[int]], Float]:
        """Return the chances of seeking rows: of the k-th row, after others of its batch."""
        known, rng = self._known, self._rng
        some = rng.permutation(len(pool.U))[:PATHS]
        paths = model.objective.sample(model.points[some], max(n // 3, 1), rng)
        off = distances(pool.points, known.points[known.distinct])
        apart, joined = self.values["apart"], 0

        def seek(k: int, taken: list[int]) -> Float:
            nonlocal apart, joined, off
            if taken[joined:]:
                off = np.minimum(off, distances(pool.points, pool.points[taken[joined:]]))
                joined = len(taken)
            while apart > 1e-3 and not (off >= apart).any():
                apart /= 2.0
            free = off >= apart
            chance = np.zeros(len(off))
            if model.by_label is not None and k % 10 < LIKELY:
                order = np.where(free, -model.by_label, np.inf)
                best = np.argsort(order, kind="stable")[:TOP]
            else:
                path = np.where(free[some], paths[k % len(paths)], np.inf)
                best = some[np.argsort(path, kind="stable")[:TOP]]
            chance[best] = 1.0 / len(best)
            return chance

        return seek


def _as_screened(pool: _Pool) -> Callable[[int, list[int]], Float] | None:
    """Return the chances of seeking rows before there is a model: as the screen says, if it does.

    Half of them evenly among the points that are critical there, half as on the road.
    """
    critical = pool.by_screen[:, 1] if pool.by_screen.size else np.zeros(1)
    if not critical.any():
        return None
    chance = 0.5 * _shared(critical) + 0.5 * _shared(critical * pool.road)
    return lambda k, taken: chance


def _deviations(process: GaussianProcess, points: Float, limit: float) -> Float:
    """Return by how many standard deviations a process is expected below a limit."""
    mean, deviation = process.predict(points)
    found: Float = (limit - mean) / np.sqrt(deviation**2 + process.parameters.noise)
    return found


def _shared(values: Float) -> Float:
    """Return values, none below 0, as shares of their sum."""
    shares: Float = values / values.sum()
    return shares


def near(bases: Float, moves: Bool, n: int, random: np.random.Generator) -> Float:
    """Return n points, each normal score of which is near that of a base, or as on the road.

    Args:
        bases: ``(k, d)``.
        moves: ``(d,)``, which scores may be near; the others are as on the road.
        n: how many.
        random: all random numbers.
    """
    base = bases[random.integers(len(bases), size=n)]
    kind = random.integers(len(KEPT), size=n)
    stays = moves & (random.random(base.shape) < np.array(KEPT)[kind, np.newaxis])
    noise = random.standard_normal(base.shape)
    return np.where(stays, base + np.array(WIDTH)[kind, np.newaxis] * noise, noise)


def density_near(Z: Float, bases: Float, moves: Bool) -> Float:
    """Return the density of `near` over the standard normal one, ``(N,)``."""
    total, Z, bases = np.zeros(len(Z)), Z[:, moves], bases[:, moves]
    for kept, width in zip(KEPT, WIDTH, strict=True):
        for base in bases:
            steps = (Z - base) / width
            ratio = np.exp(0.5 * (Z * Z - steps * steps)) / width
            total += np.prod(kept * ratio + (1.0 - kept), axis=1)
    return total / (len(KEPT) * len(bases))
