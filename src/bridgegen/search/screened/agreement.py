"""How far two simulators agree on the rows that both have evaluated."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from pydantic import FiniteFloat, NonNegativeInt, TypeAdapter, ValidationError

from bridgegen.base.arrays import Bool, Float

NOTE = "agreement with the screen"
"""The title of an agreement among a run's notes."""

SIGNIFICANT = 0.01
"""Probability of an unequal distribution of the differences by chance, for all parameters."""

PARTS = 3
"""Equal intervals of a parameter that are compared."""


@dataclass(frozen=True)
class Place:
    """Where two simulators differ most.

    Attributes:
        parameter: its name.
        low: where the interval begins, in the unit cube.
        high: where it ends.
        inside: mean absolute difference of the objectives there.
        outside: elsewhere.
    """

    parameter: str
    low: FiniteFloat
    high: FiniteFloat
    inside: FiniteFloat
    outside: FiniteFloat


@dataclass(frozen=True)
class Agreement:
    """What a run's screen did, and how far the run's simulator agrees.

    Attributes:
        screen: the simulator that proposes.
        simulator: the run's.
        screen_evaluations: rows that the screen evaluated.
        screen_budget: how many it was allowed.
        compared: rows in which both succeeded.
        both: of these, critical in both.
        screen_only: critical in the screen only.
        simulator_only: critical in the run's simulator only.
        rank_correlation: Spearman's, of the objectives' sum; None where either is constant.
        false_early: proposals of the first half of the compared rows, that the screen calls
            critical and that are not.
        false_late: likewise, of the second half.
        place: where they differ most; None where that is not significant.
        ended_after: evaluations after which the screen was given up; None if it was not.
        ended_because: the reason, or "".
    """

    screen: str
    simulator: str
    screen_evaluations: NonNegativeInt
    screen_budget: NonNegativeInt
    compared: NonNegativeInt
    both: NonNegativeInt
    screen_only: NonNegativeInt
    simulator_only: NonNegativeInt
    rank_correlation: FiniteFloat | None
    false_early: NonNegativeInt
    false_late: NonNegativeInt
    place: Place | None = None
    ended_after: NonNegativeInt | None = None
    ended_because: str = ""

    @property
    def neither(self) -> int:
        """Rows that are critical in neither."""
        return self.compared - self.both - self.screen_only - self.simulator_only

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON's types."""
        return asdict(self)

    @classmethod
    def from_notes(cls, notes: Mapping[str, Any]) -> "Agreement | None":
        """Return the agreement among a run's notes; None where there is none.

        Raises:
            ValueError: it is damaged.
        """
        if NOTE not in notes:
            return None
        try:
            found = _ADAPTER.validate_json(json.dumps(notes[NOTE]))
        except ValidationError as error:
            first = error.errors(include_input=False, include_url=False)[0]
            where = ".".join(map(str, first["loc"]))
            raise ValueError(f"notes on the screen are damaged: {where}: {first['msg']}") from None
        if found.neither < 0:
            raise ValueError("notes on the screen are damaged: more critical rows than compared")
        return found


_ADAPTER = TypeAdapter(Agreement)


def rank_correlation(x: Float, y: Float) -> float | None:
    """Return Spearman's rank correlation; None where a column is constant, or too short.

    Args:
        x: ``(n,)``, finite.
        y: ``(n,)``, finite.
    """
    from scipy.stats import rankdata

    if len(x) < 2 or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    a, b = (rankdata(one) - (len(one) + 1) / 2 for one in (x, y))
    return float((a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum()))


def place_of(parameters: Sequence[str], U: Float, difference: Float) -> Place | None:
    """Return the third of a parameter in which the differences are largest.

    By the test of Kruskal and Wallis (1952), with Bonferroni's correction for the parameters.

    Args:
        parameters: names of U's columns.
        U: ``(n, n_var)`` in [0, 1].
        difference: ``(n,)``, absolute, of the objectives.
    """
    from scipy.stats import kruskal

    if len(U) < 2 * PARTS or np.ptp(difference) == 0.0:
        return None
    part = np.minimum((U * PARTS).astype(np.int64), PARTS - 1)
    best, least = None, SIGNIFICANT / len(parameters)
    for j in range(len(parameters)):
        groups = [difference[part[:, j] == k] for k in range(PARTS)]
        full = [one for one in groups if len(one)]
        if len(full) < 2:
            continue
        p = float(kruskal(*full).pvalue)
        if p < least:
            best, least = j, p
    if best is None:
        return None
    inside = [difference[part[:, best] == k] for k in range(PARTS)]
    means = [float(one.mean()) if len(one) else 0.0 for one in inside]
    top = int(np.argmax(means))
    rest = difference[part[:, best] != top]
    return Place(parameters[best], top / PARTS, (top + 1) / PARTS, means[top], float(rest.mean()))


def counts(screened: Bool, critical: Bool) -> tuple[int, int, int]:
    """Return how many rows are critical in both, in the screen only, in the other one only."""
    parts = screened & critical, screened & ~critical, ~screened & critical
    both, one, other = (int(np.count_nonzero(part)) for part in parts)
    return both, one, other
