"""Boxes of the search space: with rounded edges, in words, and the evidence of their share."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.statistics import clopper_pearson
from bridgegen.base.units import percent
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.algorithms.tree import Leaf

# Rounding moves an edge by at most 1/20 of its box and 1/60 of its parameter's range.
_STEPS_IN_BOX, _STEPS_IN_RANGE = 10, 30


@dataclass(frozen=True, eq=False)
class Box:
    """A range of each searched parameter, in the parameter's unit; edges are inclusive.

    Attributes:
        low: ``(n_var,)`` float64.
        high: ``(n_var,)`` float64.
    """

    low: Float
    high: Float

    def holds(self, X: Float) -> Bool:
        """Return which rows of ``(N, n_var)`` lie in it, ``(N,)`` bool."""
        inside: Bool = np.all((self.low <= X) & (self.high >= X), axis=1)
        return inside

    def narrows(self, outer: "Box") -> Bool:
        """Return which ranges are narrower than another box's, ``(n_var,)`` bool."""
        less: Bool = (self.low > outer.low) | (self.high < outer.high)
        return less


def whole(space: SearchSpace) -> Box:
    """Return the box of all rows: every searched parameter's declared range."""
    parameters = [space.parameters[name] for name in space.variables]
    return Box(
        np.array([parameter.low for parameter in parameters]),
        np.array([parameter.high for parameter in parameters]),
    )


def readable(leaf: Leaf, space: SearchSpace, outer: Box) -> Box:
    """Return a leaf with rounded edges, so that the printed rule is exactly the verified one.

    Args:
        leaf: of a tree over the searched parameters.
        space: of these parameters.
        outer: edges of this box are not rounded, and no edge exceeds them.
    """
    low, high = leaf.low.copy(), leaf.high.copy()
    for k, name in enumerate(space.variables):
        parameter = space.parameters[name]
        if ends := parameter.ends(float(low[k]), float(high[k])):
            low[k], high[k] = ends
            continue
        step = min(
            (high[k] - low[k]) / _STEPS_IN_BOX, (parameter.high - parameter.low) / _STEPS_IN_RANGE
        )
        if not step > 0.0:
            continue  # the range is a single value
        # Edges are rounded before anything is measured: the printed rule is the verified one.
        digits = -math.floor(math.log10(step))
        if low[k] > outer.low[k]:
            low[k] = max(round(float(low[k]), digits) + 0.0, outer.low[k])  # no −0.0
        if high[k] < outer.high[k]:
            high[k] = min(round(float(high[k]), digits) + 0.0, outer.high[k])
    return Box(low, high)


def joined(leaves: Sequence[Leaf]) -> list[Leaf]:
    """Merge adjacent leaves whose union is a box."""
    kept = list(leaves)
    first = 0
    while first < len(kept):
        for second in range(first + 1, len(kept)):
            both = _together(kept[first], kept[second])
            if both is not None:
                kept[first] = both
                del kept[second]
                first = -1  # the larger box may have earlier neighbours
                break
        first += 1
    return kept


def _together(item: Leaf, other: Leaf) -> Leaf | None:
    """Return the union of two leaves if they differ in one column and are adjacent there."""
    (columns,) = np.nonzero((item.low != other.low) | (item.high != other.high))
    if len(columns) != 1:
        return None
    column = int(columns[0])
    lower, upper = sorted((item, other), key=lambda leaf: float(leaf.low[column]))
    if np.nextafter(lower.high[column], np.inf) != upper.low[column]:
        return None
    rows, critical = item.rows + other.rows, item.critical + other.critical
    return Leaf(lower.low, upper.high, rows, critical)


# --- The share of critical scenarios, with its confidence interval ---


@dataclass(frozen=True)
class Evidence:
    """The results of a set of scenarios.

    Attributes:
        rows: scenarios whose simulation succeeded.
        critical: critical ones among them.
        failed: scenarios whose simulation failed, not part of ``rows``.
    """

    rows: int
    critical: int
    failed: int = 0

    @property
    def share(self) -> float | None:
        """Critical / successful scenarios; None if none succeeded."""
        return self.critical / self.rows if self.rows else None

    @cached_property
    def interval(self) -> tuple[float, float]:
        """The Clopper-Pearson 95 % confidence interval of the share.

        It is valid for independent random scenarios. A search chooses its scenarios, so its
        interval reflects the number of rows only.
        """
        return clopper_pearson(self.critical, self.rows)


# --- Boxes in words ---


ANYWHERE = "anywhere"
_UNITLESS = ("1", "count", "?")


def conditions(box: Box, space: SearchSpace) -> list[str]:
    """Return the conditions of a box, one per parameter.

    The numbers are those of the box, to the last bit.
    """
    outer = whole(space)
    found = []
    for k in box.narrows(outer).nonzero()[0].tolist():
        low, high = float(box.low[k]), float(box.high[k])
        name = space.variables[k]
        text = space.parameters[name].kind.range_text(
            low,
            high,
            number,
            low_counts=low > float(outer.low[k]),
            high_counts=high < float(outer.high[k]),
        )
        found.append(f"{name} {text}{_unit(space, name)}")
    return found


def rule(box: Box, space: SearchSpace) -> str:
    """Return all conditions of a box in one line."""
    return " and ".join(conditions(box, space)) or ANYWHERE


def sentence(box: Box, space: SearchSpace, driver: str, fresh: Evidence) -> str:
    """Return the evidence for a box in one sentence.

    Args:
        box: a region.
        space: the search space.
        driver: the ego's driver.
        fresh: the results of random scenarios in the box.
    """
    text = rule(box, space)
    where = "Anywhere in its space" if text == ANYWHERE else f"Where {text}"
    low, high = fresh.interval
    share = "an unknown share" if fresh.share is None else percent(fresh.share)
    return (
        f"{where}, {share} of the random scenarios of {space.name} are critical for "
        f"{driver} ({fresh.critical} of {fresh.rows} that were simulated; {percent(low)} to "
        f"{percent(high)} with 95 % confidence)."
    )


def number(value: float) -> str:
    """Return the shortest text that is parsed as the same float64."""
    return repr(value).removesuffix(".0")


def _unit(space: SearchSpace, name: str) -> str:
    unit = space.parameters[name].unit
    return "" if unit in _UNITLESS else f" {unit}"
