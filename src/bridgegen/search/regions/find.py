"""Finds regions in which scenarios are critical, and verifies them with fresh scenarios.

A decision tree over all evaluations of a run proposes boxes in which most rows are critical. The
search chose these rows, so their share is biased. Therefore each box is verified with fresh random
rows, drawn from it as random search draws them. A box that fails is narrowed: another tree, over
its fresh rows and some of the run's, proposes boxes inside it, which get fresh rows of their own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.box_sampling import draw_within
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.algorithms.tree import Leaf, fit_leaves
from bridgegen.search.regions.box import Box, Evidence, joined, readable, whole

# 300 rows and the lower end of their interval: of 48 regions so confirmed, 46 have a true share of
# 0.5 or more (60,000 blind draws each), the others 0.48 and 0.50.
SAMPLES, MAX_SAMPLES = 300, 100_000
AT_LEAST = 0.5
# Depth 3 lost a third of what was found in S1; deeper trees gave more rules and no more confirmed
# space.
MOST_CONDITIONS = 4
MIN_ROWS = 20
"""Minimum number of rows of a leaf: rules from fewer rows seldom hold (decisions.md)."""

_STREAM = 5  # a random stream of its own under the seed


class Result(Protocol):
    """The results of fresh rows; `bridgegen.engine.evaluation.Evaluation` is one."""

    @property
    def critical(self) -> Bool:
        """``(n,)`` bool."""

    @property
    def status(self) -> npt.NDArray[np.int8]:
        """``(n,)`` int8, 0 is success."""


@dataclass(frozen=True, eq=False)
class Region:
    """A box that the tree proposes, with its evidence.

    Attributes:
        box: of the searched parameters.
        search: the run's rows in it; their share is biased, since the search chose them.
        fresh: random rows of the box that verify it.
        space_share: the share of all random rows of the search space that lie in it.
        confirmed: whether the fresh rows' share is at least the required one, with 95 %
            confidence.
        narrowed: whether it is not confirmed, and boxes inside it were verified instead.
    """

    box: Box
    search: Evidence
    fresh: Evidence
    space_share: float
    confirmed: bool
    narrowed: bool = False


@dataclass(frozen=True, eq=False)
class Found:
    """The regions of a run.

    Attributes:
        regions: confirmed ones first, then by the share of critical scenarios that they contain.
        rows: the run's evaluations without failed ones.
        critical: critical ones among them.
        critical_held: critical ones of the run in a confirmed region.
        space_share: the share of all random rows of the search space in a confirmed region.
        simulations: number of simulated fresh rows.
    """

    regions: tuple[Region, ...]
    rows: int
    critical: int
    critical_held: int
    space_share: float
    simulations: int

    @property
    def confirmed(self) -> tuple[Region, ...]:
        """The confirmed regions."""
        return tuple(region for region in self.regions if region.confirmed)


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

    The result depends on the seed, not on the number of threads.

    Args:
        space: the search space.
        evaluate: simulates rows.
        X: ``(N, len(space.names))`` float64, the rows of a run whose simulation succeeded.
        critical: ``(N,)`` bool.
        samples: fresh rows for each region.
        at_least: the share of critical rows that makes a region critical.
        seed: of the fresh rows, and of the tree.
        progress: called with the number of simulated fresh rows and the expected total.

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
        self._verified: list[Region] = []
        self._held = np.zeros(len(X), np.bool_)
        self._space_share = 0.0
        self._simulations = 0

    def run(self) -> Found:
        """Verify the boxes of the run's tree, then boxes inside those that are not confirmed."""
        leaves = fit_leaves(
            self._X,
            self._critical,
            low=self._outer.low,
            high=self._outer.high,
            min_rows=MIN_ROWS,
            max_depth=MOST_CONDITIONS,
        )
        inner: list[Box] = []
        for box in (boxes := self._readable(leaves, self._outer)):
            region, fresh, fresh_critical = self._verify(box, len(boxes))
            # One narrowing: a second one adds slivers. Without any, nothing of S4's swarms is
            # confirmed.
            found = [] if region.confirmed else self._inside(box, fresh, fresh_critical)
            inner += found
            self._keep(replace(region, narrowed=bool(found)), fresh)
        for box in inner:
            region, fresh, _ = self._verify(box, len(boxes) + len(inner))
            self._keep(region, fresh)
        order = sorted(self._verified, key=_by_weight)
        return Found(
            tuple(order),
            rows=len(self._X),
            critical=int(self._critical.sum()),
            critical_held=int((self._held & self._critical).sum()),
            space_share=self._space_share,
            simulations=self._simulations,
        )

    def _readable(self, leaves: Sequence[Leaf], outer: Box) -> list[Box]:
        """Return the boxes of leaves with a sufficient share of critical rows."""
        promising = [leaf for leaf in leaves if leaf.critical and leaf.share >= self._at_least]
        # Joining leaves that make up a box leaves two thirds of the rules and simulations at equal
        # coverage.
        return [readable(leaf, self._space, outer) for leaf in joined(promising)]

    def _verify(self, box: Box, planned: int) -> tuple[Region, Float, Bool]:
        """Simulate fresh rows of a box; return its region, the rows, and which are critical.

        The rows are ``(n, n_var)``, without failed ones.
        """
        random = np.random.Generator(np.random.PCG64([self._seed, _STREAM, len(self._verified)]))
        # Drawn inside the box: rejection never meets one of four narrow conditions, and evenly
        # spread rows have another distribution, because constraints couple parameters.
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
        """Record a region; its fresh rows estimate how much it adds to the confirmed space."""
        if region.confirmed:
            # Boxes may overlap: what is in one that was confirmed before counts once.
            new = np.ones(len(fresh), np.bool_)
            for other in self._verified:
                if other.confirmed:
                    new &= ~other.box.holds(fresh)
            self._space_share += region.space_share * float(new.mean())
            self._held |= region.box.holds(self._X)
        self._verified.append(region)

    def _inside(self, box: Box, fresh: Float, fresh_critical: Bool) -> list[Box]:
        """Return promising boxes inside a box that is not confirmed.

        The fresh rows are unbiased. Some rows of the run, at most half as many, keep the tree from
        cutting off the part in which the search found most critical rows.
        """
        mine = np.flatnonzero(box.holds(self._X))
        # Half as many of the run's rows as fresh ones. Fresh rows alone cut off where the swarm was
        # (3 to 14 % of S4's critical rows held, with both 96 to 99 %).
        few = min(len(mine), len(fresh) // 2)
        mine = mine[np.linspace(0, len(mine) - 1, few).astype(np.int64)]
        X = np.concatenate([fresh, self._X[mine]])
        critical = np.concatenate([fresh_critical, self._critical[mine]])
        named = box.narrows(self._outer)
        free = MOST_CONDITIONS - int(named.sum())
        columns = np.arange(len(named)) if free > 0 else np.flatnonzero(named)
        leaves = fit_leaves(
            X[:, columns],
            critical,
            low=box.low[columns],
            high=box.high[columns],
            min_rows=max(MIN_ROWS, len(fresh) // 12),
            max_depth=min(2, free) if free > 0 else 2,
        )
        inner = []
        for leaf in leaves:
            low, high = box.low.copy(), box.high.copy()
            low[columns], high[columns] = leaf.low, leaf.high
            inner.append(Leaf(low, high, leaf.rows, leaf.critical))
        boxes = self._readable(inner, box)
        return [item for item in boxes if item.narrows(box).any()]


def _by_weight(region: Region) -> tuple[bool, float]:
    """Sort key: confirmed regions first, then those that contain more critical scenarios."""
    return not region.confirmed, -region.space_share * (region.fresh.share or 0.0)


def check(space: SearchSpace, critical: Bool, samples: int, at_least: float) -> None:
    """Check the arguments of `find_regions`.

    Raises:
        InputError: all problems.
    """
    problems = []
    if not 1 <= samples <= MAX_SAMPLES:
        problems.append(f"1 <= samples <= {MAX_SAMPLES} must hold, got {samples}")
    if not 0.0 < at_least < 1.0:
        problems.append(f"0 < at_least < 1 must hold, got {at_least:g}")
    if not problems and space.n_var == 0:
        problems.append(f"{space.name}: no parameter is searched, so it has no regions")
    if not problems and not critical.any():
        problems.append(
            f"{space.name}: none of {len(critical)} evaluations is critical, so there is "
            "no critical region to be found"
        )
    if problems:
        raise InputError(*problems)
