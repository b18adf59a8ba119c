"""Finding regions in which scenarios are critical, and trying them on fresh scenarios.

A decision tree over all evaluations of a run names boxes in which most rows are critical. But a
search chose these rows, so their share is no measure of the box. Random rows of the box, drawn as
random search would meet them and simulated anew, are: a box counts as a critical region only if
these say so. One that does not is narrowed: another tree, over its fresh rows and some of the
run's, names boxes inside it, and these are tried on fresh rows of their own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float
from bridgegen.errors import InputError
from bridgegen.odd.space import SearchSpace
from bridgegen.odd.within import draw_within
from bridgegen.regions.box import Box, joined, readable, whole
from bridgegen.regions.evidence import Evidence
from bridgegen.search.tree import Leaf, fit_leaves

SAMPLES, MAX_SAMPLES = 300, 100_000
AT_LEAST = 0.5
MOST_CONDITIONS = 4
MIN_ROWS = 20
"""Rows that a leaf has at least: a rule from fewer of the run's rows seldom held (decisions.md)."""

_STREAM = 5  # keeps these random numbers apart from others of the same seed


class Result(Protocol):
    """What fresh rows came to; `bridgegen.evaluation.Evaluation` is one."""

    @property
    def critical(self) -> Bool:
        """``(n,)`` bool."""

    @property
    def status(self) -> npt.NDArray[np.int8]:
        """``(n,)`` int8, 0 is success."""


@dataclass(frozen=True, eq=False)
class Region:
    """A box that the tree calls critical, and what is known of it.

    Attributes:
        box: of the searched parameters.
        search: the run's rows in it. The search chose them: their share is biased.
        fresh: random rows of it, drawn and simulated for this alone: what counts.
        space_share: of all random rows of the search space, those that lie in it.
        confirmed: whether the fresh rows' share is at least what was asked for, with 95 %
            confidence.
        narrowed: whether it is not, and boxes inside it were tried instead.
    """

    box: Box
    search: Evidence
    fresh: Evidence
    space_share: float
    confirmed: bool
    narrowed: bool = False


@dataclass(frozen=True, eq=False)
class Found:
    """What was found in a run.

    Attributes:
        regions: confirmed ones first; of each kind those first that hold most critical scenarios.
        rows: the run's evaluations, failed ones left out.
        critical: critical ones among them.
        critical_held: critical ones of the run that lie in a confirmed region.
        space_share: of all random rows of the search space, those in a confirmed region.
        simulations: fresh rows that were simulated.
    """

    regions: tuple[Region, ...]
    rows: int
    critical: int
    critical_held: int
    space_share: float
    simulations: int

    @property
    def confirmed(self) -> tuple[Region, ...]:
        """The regions that hold."""
        return tuple(one for one in self.regions if one.confirmed)


def find_regions(
    space: SearchSpace,
    evaluate: Callable[[Float], Result],
    X: Float,
    critical: Bool,
    *,
    samples: int = SAMPLES,
    at_least: float = AT_LEAST,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> Found:
    """Find the regions of a search space in which most scenarios are critical.

    One seed gives one result, however many threads evaluate.

    Args:
        space: what was searched.
        evaluate: simulates rows.
        X: ``(N, len(space.names))`` float64, the rows of a run whose simulation succeeded.
        critical: ``(N,)`` bool.
        samples: fresh rows for each region.
        at_least: the share of critical rows that makes a region critical.
        seed: of the fresh rows, and of the tree.
        progress: told how many fresh rows are simulated, and how many will be as far as is known.

    Raises:
        InputError: samples or at_least out of range; no parameter was searched; no critical row.
    """
    check(space, critical, samples, at_least)
    return _Search(space, evaluate, X, critical, samples, at_least, seed, progress).run()


class _Search:
    """One call of `find_regions`."""

    def __init__(
        self,
        space: SearchSpace,
        evaluate: Callable[[Float], Result],
        X: Float,
        critical: Bool,
        samples: int,
        at_least: float,
        seed: int,
        progress: Callable[[int, int], None] | None,
    ) -> None:
        self._space, self._evaluate = space, evaluate
        self._columns = [space.index(name) for name in space.variables]
        self._X, self._critical = X[:, self._columns], critical
        self._samples, self._at_least, self._seed = samples, at_least, seed
        self._progress = progress or (lambda done, total: None)
        self._outer = whole(space)
        self._tried: list[Region] = []
        self._held = np.zeros(len(X), np.bool_)
        self._space_share = 0.0
        self._simulations = 0

    def run(self) -> Found:
        """Try the boxes of the run's tree, then those inside what does not hold."""
        leaves = fit_leaves(
            self._X, self._critical, low=self._outer.low, high=self._outer.high,
            min_rows=MIN_ROWS, seed=self._seed, max_depth=MOST_CONDITIONS,
        )  # fmt: skip
        inner: list[Box] = []
        for box in (boxes := self._readable(leaves, self._outer)):
            region, fresh, fresh_critical = self._try(box, len(boxes))
            found = [] if region.confirmed else self._inside(box, fresh, fresh_critical)
            inner += found
            self._keep(replace(region, narrowed=bool(found)), fresh)
        for box in inner:
            region, fresh, _ = self._try(box, len(boxes) + len(inner))
            self._keep(region, fresh)
        order = sorted(self._tried, key=_by_weight)
        return Found(
            tuple(order),
            rows=len(self._X),
            critical=int(self._critical.sum()),
            critical_held=int((self._held & self._critical).sum()),
            space_share=self._space_share,
            simulations=self._simulations,
        )

    def _readable(self, leaves: Sequence[Leaf], outer: Box) -> list[Box]:
        """Return the boxes of those leaves that look critical."""
        promising = [leaf for leaf in leaves if leaf.critical and leaf.share >= self._at_least]
        return [readable(leaf, self._space, outer) for leaf in joined(promising)]

    def _try(self, box: Box, planned: int) -> tuple[Region, Float, Bool]:
        """Simulate fresh rows of a box; return what is known of it, the rows, which are critical.

        The rows are ``(n, n_var)``, without those whose simulation failed.
        """
        random = np.random.Generator(np.random.PCG64([self._seed, _STREAM, len(self._tried)]))
        drawn = draw_within(self._space, box.low, box.high, self._samples, random)
        result = self._evaluate(drawn.X)
        self._simulations += len(drawn.X)
        self._progress(self._simulations, max(planned * self._samples, self._simulations))
        ok = result.status == 0
        fresh_critical = result.critical[ok]
        inside = box.holds(self._X)
        fresh = Evidence(int(ok.sum()), int(fresh_critical.sum()), int((~ok).sum()))
        region = Region(
            box,
            search=Evidence(int(inside.sum()), int((inside & self._critical).sum())),
            fresh=fresh,
            space_share=drawn.share,
            confirmed=fresh.rows > 0 and fresh.interval[0] >= self._at_least,
        )
        return region, drawn.X[ok][:, self._columns], fresh_critical

    def _keep(self, region: Region, fresh: Float) -> None:
        """Take a region down; what it adds to the space that is confirmed, its fresh rows say."""
        if region.confirmed:
            new = np.ones(len(fresh), np.bool_)
            for other in self._tried:
                if other.confirmed:
                    new &= ~other.box.holds(fresh)
            self._space_share += region.space_share * float(new.mean())
            self._held |= region.box.holds(self._X)
        self._tried.append(region)

    def _inside(self, box: Box, fresh: Float, fresh_critical: Bool) -> list[Box]:
        """Return boxes inside one that does not hold which look critical.

        The fresh rows are what is told truly of the box. Some of the run's, half as many at most,
        keep the tree from cutting off where the search found most.
        """
        mine = np.flatnonzero(box.holds(self._X))
        few = min(len(mine), len(fresh) // 2)
        mine = mine[np.linspace(0, len(mine) - 1, few).astype(np.int64)]
        X = np.concatenate([fresh, self._X[mine]])
        critical = np.concatenate([fresh_critical, self._critical[mine]])
        named = box.narrows(self._outer)
        free = MOST_CONDITIONS - int(named.sum())
        columns = np.arange(len(named)) if free > 0 else np.flatnonzero(named)
        leaves = fit_leaves(
            X[:, columns], critical, low=box.low[columns], high=box.high[columns],
            min_rows=max(MIN_ROWS, len(fresh) // 12), seed=self._seed,
            max_depth=min(2, free) if free > 0 else 2,
        )  # fmt: skip
        inner = []
        for leaf in leaves:
            low, high = box.low.copy(), box.high.copy()
            low[columns], high[columns] = leaf.low, leaf.high
            inner.append(Leaf(low, high, leaf.rows, leaf.critical))
        boxes = self._readable(inner, box)
        return [one for one in boxes if one.narrows(box).any()]


def _by_weight(region: Region) -> tuple[bool, float]:
    """Put confirmed regions first, and those that hold more of the critical scenarios."""
    return not region.confirmed, -region.space_share * (region.fresh.share or 0.0)


def check(space: SearchSpace, critical: Bool, samples: int, at_least: float) -> None:
    """Refuse what no regions can be found for; see `find_regions`.

    Raises:
        InputError: all that is wrong.
    """
    problems = []
    if not 1 <= samples <= MAX_SAMPLES:
        problems.append(f"1 <= samples <= {MAX_SAMPLES} must hold, got {samples}")
    if not 0.0 < at_least < 1.0:
        problems.append(f"0 < at_least < 1 must hold, got {at_least:g}")
    if not problems and space.n_var == 0:
        problems.append(f"{space.name}: nothing is searched, so it has no regions")
    if not problems and not critical.any():
        problems.append(
            f"{space.name}: none of {len(critical)} evaluations is critical, so there is "
            "no critical region to be found"
        )
    if problems:
        raise InputError(*problems)
