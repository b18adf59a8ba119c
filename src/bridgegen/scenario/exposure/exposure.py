"""How often a scenario is met, and with which values: the distribution that estimators sample.

The joint distribution is that of the parameters' marginals, joined by a Gaussian copula of their
normal scores, or by Student's; a marginal may depend on other parameters by formulas. The
scenario's constraints condition it: rows that break one have probability 0, and the density of the
others is raised by the same factor, one over the feasible share. The transform to standard normal
space is that of the unconditioned distribution; there the feasible set is where `Exposure.feasible`
holds.
Source: Rosenblatt, Annals of Mathematical Statistics 23 (1952) 470-472; for copulas see
`bridgegen.scenario.exposure.dependence`.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from graphlib import CycleError, TopologicalSorter

import numpy as np
import numpy.typing as npt
import scipy

from bridgegen.base.arrays import Bool, Float, as_float
from bridgegen.base.errors import InputError
from bridgegen.base.statistics import clopper_pearson
from bridgegen.scenario.exposure.dependence import Copula
from bridgegen.scenario.exposure.marginals import Conditional, Marginal
from bridgegen.scenario.language.constraints import order
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.parameterisation import NOT_KNOWN, Parameterisation
from bridgegen.scenario.language.parameters import at
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace

# --- How often a scenario is met: counted encounters, and rates with exact intervals ---
# Source: Garwood, Fiducial limits for the Poisson distribution, Biometrika 28 (1936) 437-442.


LEVEL = 0.95
"""Level of confidence of intervals."""

MOST = 10**12
"""Largest number of encounters that may have been counted."""


WEIGHED = "Weighed with a prior:"
"""Begin of what the source of an exposure says of its prior."""


@dataclass(frozen=True)
class Rate:
    """A rate with its interval.

    Attributes:
        estimate: per unit of exposure.
        low: lower end of the interval.
        high: upper end.
    """

    estimate: float
    low: float
    high: float

    def in_words(self, unit: str) -> str:
        """Return it with its interval, per a unit."""
        return f"{self.estimate:.3g} per {unit} (95 %: {self.low:.3g} to {self.high:.3g})"

    def of_which(self, p: float, low: float, high: float) -> "Rate":
        """Return how often an event happens that each has with a probability.

        The intervals of both factors are combined as if their logarithms were independent.

        Args:
            p: the probability.
            low: lower end of its interval.
            high: its upper end.
        """
        estimate = self.estimate * p
        # An end of 0 has no logarithm; the upper ends multiply, which holds in any case.
        if not (estimate > 0.0 and self.low > 0.0 and low > 0.0):
            return Rate(estimate, 0.0, self.high * high)
        # Both factors are positive and skewed: their logarithms add, and so do the squares of the
        # distances.
        below = math.hypot(math.log(self.estimate / self.low), math.log(p / low))
        above = math.hypot(math.log(self.high / self.estimate), math.log(high / p))
        return Rate(estimate, estimate * math.exp(-below), estimate * math.exp(above))


def poisson_interval(count: int, level: float = LEVEL) -> tuple[float, float]:
    """Return the exact two-sided interval for the mean of a Poisson distribution.

    Args:
        count: what was observed, at least 0.
        level: of confidence, in (0, 1).

    Raises:
        ValueError: an argument out of range.
    """
    if count < 0 or not 0.0 < level < 1.0:
        raise ValueError(f"count >= 0 and 0 < level < 1 must hold, got {count} and {level}")
    side = 0.5 * (1.0 - level)
    low = float(scipy.special.gammaincinv(count, side)) if count else 0.0
    return low, float(scipy.special.gammainccinv(count + 1, side))


@dataclass(frozen=True)
class Encounters:
    """How often a scenario was met.

    Attributes:
        count: encounters.
        hours: of driving in which they were counted [h]; None where that is not known.
        km: likewise [km].
        source: where the numbers come from.

    Raises:
        InputError: a number out of range, or neither hours nor km; all that is wrong.
    """

    count: int
    hours: float | None
    km: float | None
    source: str

    def __post_init__(self) -> None:
        problems = []
        if not 0 <= self.count <= MOST:
            problems.append(f"count must be 0 to {MOST:g}, got {self.count}")
        if self.hours is None and self.km is None:
            problems.append("hours [h] or km [km] in which they were counted must be given")
        for name, unit, amount in (("hours", "h", self.hours), ("km", "km", self.km)):
            if amount is not None and not 0.0 < amount < math.inf:
                problems.append(f"{name} [{unit}] must be above 0 and finite, got {amount:g}")
        if problems:
            raise InputError(*problems)

    @property
    def per_hour(self) -> Rate | None:
        """Encounters per hour, with their 95 % interval; None without hours."""
        return self._per(self.hours)

    @property
    def per_km(self) -> Rate | None:
        """Encounters per kilometre, with their 95 % interval; None without km."""
        return self._per(self.km)

    def _per(self, amount: float | None) -> Rate | None:
        if amount is None:
            return None
        low, high = poisson_interval(self.count)
        return Rate(self.count / amount, low / amount, high / amount)


LEAST_SHARE = 1e-4
"""Least share of the distribution that is feasible; below, the exposure contradicts the
constraints."""

_BLOCK = 4096  # rows that are proposed at once, each block from random numbers of its own
_TRIED, _MOST_TRIED, _ENOUGH = 2**16, 2**20, 100
_SMALLEST = 1e-300  # a tail probability, so that its normal score is finite
_ESTIMATE = 0x5EED  # the seed of the feasible share: an exposure has one, whatever is asked of it


@dataclass(frozen=True)
class FeasibleShare:
    """The share of the unconditioned distribution that keeps the scenario's constraints.

    Attributes:
        estimate: from ``proposals`` random rows; exactly 1 where no constraint was broken.
        low: lower end of its exact 95 % interval.
        high: upper end.
        proposals: how many rows were drawn for it.
        rejected: the share that each broken rule rejects, most first; a row may break several.
    """

    estimate: float
    low: float
    high: float
    proposals: int
    rejected: dict[str, float]


@dataclass(frozen=True)
class Sample:
    """Rows of an exposure.

    Attributes:
        X: ``(n, len(space.names))`` feasible rows, independent of each other.
        proposals: how many rows of the unconditioned distribution were drawn for them.
        share: of the proposals that were feasible.
    """

    X: Float
    proposals: int
    share: float


@dataclass(frozen=True)
class Exposure:
    """The distribution of a scenario's parameters, and how often the scenario is met.

    Attributes:
        scenario: of which.
        space: its search space; rows of X have its columns. Parameters without a marginal stand at
            their default, moved where a constraint asks for it.
        marginals: by parameter, in the scenario's order.
        copula: of all of them.
        encounters: how often the scenario is met; None where that is not known.
        source: where the numbers come from.
        place: the file, for messages.
        parameterisation: what its parameters leave out of recorded events; None where it does not
            say.

    Raises:
        InputError: formulas that depend on each other in a circle, or a correlation of a parameter
            with single values.
    """

    scenario: SearchedScenario
    space: SearchSpace
    marginals: Mapping[str, Marginal | Conditional]
    copula: Copula
    encounters: Encounters | None
    source: str
    place: str = field(default="", compare=False, repr=False)
    parameterisation: Parameterisation | None = None

    def __post_init__(self) -> None:
        single = [name for name, marginal in self.marginals.items() if marginal.apart]
        for number, name in enumerate(self.copula.names):
            row = self.copula.rows[number]
            others = any(row[k] for k in range(len(row)) if k != number)
            if name in single and (others or name in self.copula.tied):
                raise InputError(
                    f"{name} takes single values and has no correlation: make another parameter "
                    f"depend on it by a formula{at(self.place)}"
                )
        _ = self._order

    @property
    def weighed(self) -> str:
        """What of it is a prior, as its source says since it was fitted; "" if nothing is."""
        _, found, told = self.source.partition(WEIGHED)
        return f"{found}{told}".strip()

    @property
    def left_out(self) -> str:
        """What its parameters leave out of recorded events, in sentences."""
        twins = self.parameterisation
        return str(twins.figures()["says"]) if twins else NOT_KNOWN

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that are distributed: the columns of Z."""
        return tuple(self.marginals)

    @property
    def dimensions(self) -> int:
        """How many they are."""
        return len(self.marginals)

    def sample(self, n: int, seed: int) -> Sample:
        """Draw rows of the distribution, conditioned on the feasible set, by rejection.

        The first rows of a longer sample of the same seed are those of a shorter one.

        Args:
            n: how many.
            seed: where all chance comes from, at least 0.

        Raises:
            InputError: the exposure contradicts the constraints, see `feasible_share`.
        """
        _ = self.feasible_share
        kept: list[Float] = []
        have, proposals, feasible = 0, 0, 0
        while have < n:
            X, good = self._proposed(seed, proposals // _BLOCK)
            proposals += len(X)
            feasible += int(good.sum())
            kept.append(X[good])
            have += len(kept[-1])
        # Blocks have seeds of their own and are cut at the end only, so a longer sample begins with
        # a shorter one's rows.
        rows = np.concatenate(kept)[:n] if kept else np.empty((0, len(self.space.names)))
        return Sample(rows, proposals, feasible / proposals if proposals else 1.0)

    @cached_property
    def feasible_share(self) -> FeasibleShare:
        """The share of the unconditioned distribution that is feasible; the same at any time.

        Raises:
            InputError: it is below `LEAST_SHARE`; names the rule that rejects most.
        """
        tried = kept = 0
        broken: dict[str, int] = {}
        while tried < _TRIED or (kept < _ENOUGH and tried < _MOST_TRIED):
            # A seed of its own, whatever is sampled: the normalisation of a density must not depend
            # on who asks.
            X, good = self._proposed(_ESTIMATE, tried // _BLOCK)
            # Exactly 1 where nothing was broken: an estimate below it would bias what no constraint
            # touches.
            if kept == tried and good.all() and tried + len(X) >= _TRIED:
                return FeasibleShare(1.0, *clopper_pearson(_TRIED, _TRIED), _TRIED, {})
            for rule, bad in self.broken(X):
                broken[rule] = broken.get(rule, 0) + int(bad.sum())
            tried, kept = tried + len(X), kept + int(good.sum())
        most = dict(sorted(broken.items(), key=lambda pair: -pair[1]))
        shares = {rule: count / tried for rule, count in most.items() if count}
        if kept < LEAST_SHARE * tried:
            rule, share = next(iter(shares.items()))
            raise InputError(
                f"at least {LEAST_SHARE:g} of the exposure of {self.scenario.name} must keep the "
                f"scenario's constraints, got {kept} of {tried} random rows; {share:.4%} break "
                f"'{rule}'{at(self.place)}"
            )
        return FeasibleShare(kept / tried, *clopper_pearson(kept, tried), tried, shares)

    def log_density(self, X: npt.ArrayLike) -> Float:
        """Return the natural logarithm of the density of rows, conditioned on the feasible set.

        A density over the columns `names`; of a parameter with single values, a probability. It is
        normalised by the estimate of `feasible_share`, whose relative error it has.

        Args:
            X: ``(N, len(space.names))``.

        Returns:
            ``(N,)``; -inf where a row is infeasible or outside the distribution.

        Raises:
            ValueError: wrong shape, NaN or inf.
        """
        rows = as_float("X", X, (None, len(self.space.names)))
        table = self._table(rows)
        total = np.zeros(len(rows))
        for name in self.names:
            total = total + self._given(name, table).log_density(table[name])
        inside = np.isfinite(total) & self.feasible(rows)
        total[inside] += self.copula.log_density(self._scores(rows[inside]))
        share = self.feasible_share.estimate
        return np.where(inside, total - float(np.log(share)), -np.inf)

    def feasible(self, X: npt.ArrayLike) -> Bool:
        """Return which rows keep the scenario's constraints, ``(N,)``.

        Args:
            X: ``(N, len(space.names))``; a row with NaN is not feasible.

        Raises:
            ValueError: wrong shape.
        """
        rows = as_float("X", X, (None, len(self.space.names)), finite=False)
        good: Bool = np.asarray(np.isfinite(rows).all(axis=1))
        for _, bad in self.broken(rows):
            good &= ~bad
        return good

    def to_normal(self, X: npt.ArrayLike) -> Float:
        """Return the points of standard normal space that rows stand for.

        Args:
            X: ``(N, len(space.names))``, within the ranges of the marginals.

        Returns:
            Z ``(N, dimensions)``. `from_normal` gives X back up to rounding, and this gives Z back
            to 1e-10 where normal scores are within 4; beyond, as well as doubles tell a value from
            the end of its range. Of a parameter with single values, Z is the middle of those that
            give the value.

        Raises:
            ValueError: wrong shape, NaN or inf.
        """
        rows = as_float("X", X, (None, len(self.space.names)))
        return self.copula.whiten(self._scores(rows))

    def from_normal(self, Z: npt.ArrayLike) -> Float:
        """Return the rows that points of standard normal space stand for.

        If Z is standard normal, X has the unconditioned distribution; which rows are feasible says
        `feasible`.

        Args:
            Z: ``(N, dimensions)``. A row's result has the same bits whatever the rows around it.

        Returns:
            X ``(N, len(space.names))``; a derived quantity may be NaN where it has no value.

        Raises:
            ValueError: wrong shape, NaN or inf.
        """
        points = as_float("Z", Z, (None, self.dimensions))
        scores = self.copula.correlate(points)
        columns = {name: np.ascontiguousarray(scores[:, k]) for k, name in enumerate(self.names)}
        return self._rows({}, len(points), columns)

    def rows(self, columns: Mapping[str, Float]) -> Float:
        """Return rows with given values; the others stand at their default.

        Args:
            columns: ``(N,)`` by parameter; they may break a constraint.
        """
        return self._rows(columns, len(next(iter(columns.values()))))

    # -- inside --------------------------------------------------------------------------------

    @cached_property
    def _order(self) -> tuple[str, ...]:
        """All columns, each after those that it is computed from."""
        space = self.space
        free = tuple(b for b in space.constraints.bounds if b.target not in self.marginals)
        graph: TopologicalSorter[str] = TopologicalSorter()
        for name in order(space.names, free, space.constraints.derived):
            graph.add(name)
        for bound in free:
            graph.add(bound.target, *sorted(bound.names))
        for derived in space.constraints.derived:
            graph.add(derived.name, *sorted(derived.names))
        for name, marginal in self.marginals.items():
            if isinstance(marginal, Conditional):
                graph.add(name, *sorted(marginal.names))
        try:
            return tuple(graph.static_order())
        except CycleError as error:
            raise InputError(
                f"distributions must not depend on each other in a circle, got "
                f"{' → '.join(error.args[1])}{at(self.place)}"
            ) from None

    def _rows(
        self, columns: Mapping[str, Float], count: int, scores: Mapping[str, Float] | None = None
    ) -> Float:
        """Return rows of given values and normal scores; the others follow, or stand at default."""
        space = self.space
        table: dict[str, Float | float] = {}
        result = np.empty((len(space.names), count))
        for name in self._order:
            out = result[space.index(name)]
            if name in columns:
                out[:] = columns[name]
            elif scores is not None and name in scores:
                tail = scipy.special.ndtr(-np.abs(scores[name]))
                out[:] = self._given(name, table).value(tail, scores[name] > 0.0)
            elif name in space.derived:
                out[:] = space.derived[name].value.evaluate(table)
            elif name in self.marginals:  # what bounds it may be computed of it later
                out[:] = space.defaults[name]
            else:
                # Parameters without a distribution follow the constraints as the decoder has it, so
                # that one that merely stands at its default makes no row infeasible.
                lo, hi = self._limits(name, table)
                out[:] = np.clip(space.defaults[name], lo, np.maximum(lo, hi))
            table[name] = out
        return np.ascontiguousarray(result.T)

    def _given(self, name: str, table: Mapping[str, Float | float]) -> Marginal:
        marginal = self.marginals[name]
        return marginal.given(table) if isinstance(marginal, Conditional) else marginal

    def _proposed(self, seed: int, block: int) -> tuple[Float, Bool]:
        """Return a block of rows of the unconditioned distribution, and which are feasible."""
        random = np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, block))))
        X = self.from_normal(random.standard_normal((_BLOCK, self.dimensions)))
        return X, self.feasible(X)

    def _table(self, rows: Float) -> dict[str, Float]:
        return dict(zip(self.space.names, np.ascontiguousarray(rows.T), strict=True))

    def _scores(self, rows: Float) -> Float:
        """Return the normal scores of rows, ``(N, dimensions)``, still correlated."""
        table = self._table(rows)
        scores = np.empty((len(rows), self.dimensions))
        for k, name in enumerate(self.names):
            below, above = self._given(name, table).tails(table[name])
            # By the lesser tail, whose digits are all there; the greater one is 1 up to rounding
            # far out.
            tail = np.clip(np.minimum(below, above), _SMALLEST, 0.5)
            scores[:, k] = np.where(below <= above, 1.0, -1.0) * scipy.special.ndtri(tail)
        return scores

    def _limits(self, name: str, table: Mapping[str, Float | float]) -> tuple[Float, Float]:
        """Return the interval that bounds leave to a parameter; NaN limits nothing."""
        parameter = self.space.parameters[name]
        lo, hi = np.asarray(parameter.low), np.asarray(parameter.high)
        for bound in self.space.bounds[name]:
            if bound.lo is not None:
                lo = np.asarray(np.fmax(lo, bound.lo.evaluate(table)))
            if bound.hi is not None:
                hi = np.asarray(np.fmin(hi, bound.hi.evaluate(table)))
        return lo, hi

    def broken(self, rows: Float) -> Iterator[tuple[str, Bool]]:
        """Yield each rule with the rows that break it, to the tolerance of all constraints.

        Args:
            rows: ``(N, len(space.names))``.
        """
        table = self._table(rows)
        with np.errstate(invalid="ignore"):
            for bound in self.space.constraints.bounds:
                value, kept = table[bound.target], np.ones(len(rows), np.bool_)
                if bound.lo is not None:
                    limit = np.asarray(bound.lo.evaluate(table))
                    kept &= value >= limit - slack(limit)
                if bound.hi is not None:
                    limit = np.asarray(bound.hi.evaluate(table))
                    kept &= value <= limit + slack(limit)
                yield f"{bound}{at(bound.place)}", ~kept
            for derived in self.space.constraints.derived:
                rule = f"{derived} has a value{at(derived.place)}"
                yield rule, ~np.isfinite(table[derived.name])
            for name, parameter in self.space.parameters.items():
                value = table[name]
                outside = (value < parameter.low - slack(np.asarray(parameter.low))) | (
                    value > parameter.high + slack(np.asarray(parameter.high))
                )
                yield parameter.kind.rule(name, parameter.low, parameter.high), outside
            for rule, bad in self.scenario.broken(table).items():
                yield rule, bad
