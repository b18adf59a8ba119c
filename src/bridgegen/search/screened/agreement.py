"""What the screen and the simulator say of the same rows: agreement, and what to evaluate next."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

import numpy as np
from pydantic import FiniteFloat, NonNegativeInt, TypeAdapter, ValidationError

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.search.algorithms.algorithm import Results, Screen
from bridgegen.search.screened.correction import Correction

NOTE = "agreement with the screen"
"""The title of an agreement among a run's notes."""

SIGNIFICANT = 0.01
"""Probability of an unequal distribution of the differences by chance, for all parameters."""

PARTS = 3
"""Number of equal intervals of a parameter that are compared."""


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
    a, b = (rankdata(array) - (len(array) + 1) / 2 for array in (x, y))
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
        full = [group for group in groups if len(group)]
        if len(full) < 2:
            continue
        p = float(kruskal(*full).pvalue)
        if p < least:
            best, least = j, p
    if best is None:
        return None
    inside = [difference[part[:, best] == k] for k in range(PARTS)]
    means = [float(item.mean()) if len(item) else 0.0 for item in inside]
    top = int(np.argmax(means))
    rest = difference[part[:, best] != top]
    return Place(parameters[best], top / PARTS, (top + 1) / PARTS, means[top], float(rest.mean()))


def counts(screened: Bool, critical: Bool) -> tuple[int, int, int]:
    """Return how many rows are critical in both, in the screen only, in the other one only."""
    parts = screened & critical, screened & ~critical, ~screened & critical
    both, number, other = (int(np.count_nonzero(part)) for part in parts)
    return both, number, other


# --- Rows with the results of the screen, and of the run's simulator ---


@dataclass(frozen=True)
class Compared:
    """Rows with two results each.

    Attributes:
        U: ``(n, n_var)``.
        by_screen: ``(n, n_obj)``, the screen's objectives.
        screened: ``(n,)``, critical in the screen.
        F: ``(n, n_obj)``, of the run's simulator.
        critical: ``(n,)``, critical in the run's simulator.
        ok: ``(n,)``, whether the screen has succeeded so far; then, whether both have.
    """

    U: Float
    by_screen: Float
    screened: Bool
    F: Float
    critical: Bool
    ok: Bool

    @classmethod
    def screened_by(cls, U: Float, by_screen: Float, screened: Bool, ok: Bool) -> Self:
        """Return rows that the screen has evaluated."""
        nothing = np.full(by_screen.shape, np.nan)
        return cls(U, by_screen, screened, nothing, np.zeros(len(U), np.bool_), ok)

    @classmethod
    def none(cls, n_var: int, n_obj: int) -> Self:
        """Return no row."""
        empty = np.zeros(0, np.bool_)
        return cls.screened_by(np.empty((0, n_var)), np.empty((0, n_obj)), empty, empty)

    @classmethod
    def join(cls, *parts: "Compared") -> Self:
        """Return the rows of several parts, at least one, in their order."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def take(self, rows: Bool | Int) -> Self:
        """Return some of the rows, by a mask or by their positions."""
        return type(self)(*(getattr(self, field.name)[rows] for field in fields(self)))

    def told(self, results: Results) -> Self:
        """Return the rows with the results of the run's simulator."""
        ok = self.ok & results.ok
        return type(self)(self.U, self.by_screen, self.screened, results.F, results.critical, ok)

    def best(self, n: int) -> Self:
        """Return the n best rows of the run's simulator: critical ones, then by the objectives."""
        rank = np.lexsort((self.F.sum(axis=1), ~self.critical, ~self.ok))
        return self.take(rank[: min(n, int(self.ok.sum()))])

    def sums(self) -> tuple[Float, Float]:
        """Return the sum of the objectives, by the screen and by the run's simulator, ``(n,)``."""
        return self.by_screen.sum(axis=1), self.F.sum(axis=1)


def agreement(
    run: Compared, screen: Screen, simulator: str, parameters: Sequence[str]
) -> Agreement:
    """Return how far both simulators agree in rows.

    Args:
        run: the rows, in their order.
        screen: the screen.
        simulator: the name of the run's simulator.
        parameters: names of the columns of U.
    """
    found = run.take(run.ok)
    both, screen_only, simulator_only = counts(found.screened, found.critical)
    false, half = found.screened & ~found.critical, len(found.U) // 2
    x, y = found.sums()
    return Agreement(
        screen=screen.name,
        simulator=simulator,
        screen_evaluations=screen.evaluations,
        screen_budget=screen.budget,
        compared=len(found.U),
        both=both,
        screen_only=screen_only,
        simulator_only=simulator_only,
        rank_correlation=rank_correlation(x, y),
        false_early=int(false[:half].sum()),
        false_late=int(false[half:].sum()),
        place=place_of(parameters, found.U, np.abs(y - x)),
    )


# --- What the screen has found, and the choice of what the run's simulator evaluates ---


ROOM = 8192
"""Maximum number of rows that are kept."""

APART = 0.1
"""Root mean square distance in the unit cube within which a row is nearly the same."""

OF_OBJECTIVE = 0.3
"""Weight of the best objective, relative to certainty that a row is critical."""


class Pool:
    """Rows that the screen has evaluated and the run's simulator has not.

    Attributes:
        succeeded: number of rows in which the screen succeeded, since the beginning.
    """

    def __init__(self, n_var: int, n_obj: int) -> None:
        self.succeeded = 0
        self._rows = Compared.none(n_var, n_obj)

    def __len__(self) -> int:
        return len(self._rows.U)

    def add(self, U: Float, F: Float, critical: Bool, ok: Bool) -> None:
        """Add rows with the screen's results; those that failed there are left out."""
        self.succeeded += int(ok.sum())
        new = Compared.screened_by(U, F, critical, ok).take(ok)
        self._rows = Compared.join(self._rows, new)

    def take(self, n: int, correction: Correction, run: Float) -> Compared:
        """Take out the n best rows, one after the other; fewer if there are no more.

        Args:
            n: how many.
            correction: of the screen's results.
            run: ``(m, n_var)``, the rows that have been evaluated.
        """
        rows = self._rows
        if n <= 0 or not len(rows.U):
            return rows.take(np.zeros(0, np.int64))
        worth = _worth(rows, correction)
        if len(rows.U) > ROOM:
            best = np.sort(np.argsort(-worth, kind="stable")[:ROOM])
            rows, worth = rows.take(best), worth[best]
        nearest = _nearest(rows.U, run)
        chosen: list[int] = []
        for _ in range(min(n, len(rows.U))):
            # A row near one that is evaluated, or chosen for this batch, is worth little: it would
            # show the same.
            score = worth * (1.0 - np.exp(-0.5 * (nearest / APART) ** 2))
            score[chosen] = -np.inf
            chosen.append(int(np.argmax(score)))
            nearest = np.minimum(nearest, _nearest(rows.U, rows.U[chosen[-1:]]))
        self._rows = rows.take(np.setdiff1d(np.arange(len(rows.U)), chosen))
        return rows.take(np.array(chosen))


def _nearest(U: Float, others: Float) -> Float:
    """Return the root mean square distance of each row to the nearest other one, ``(N,)``."""
    from scipy.spatial.distance import cdist

    if not len(others):
        return np.full(len(U), np.inf)
    found: Float = cdist(U, others).min(axis=1) / np.sqrt(U.shape[1])
    return found


def _worth(rows: Compared, correction: Correction) -> Float:
    """Return how much each row is worth evaluating, ``(N,)`` > 0."""
    expected = correction.predict(rows.U, rows.by_screen, rows.screened)
    spread = rows.by_screen.std(axis=0)
    F = rows.by_screen + expected.difference - expected.doubt[:, np.newaxis] * correction.spread
    merit = (F / np.where(spread > 0.0, spread, 1.0)).sum(axis=1)
    rank = np.empty(len(merit))
    rank[np.argsort(merit, kind="stable")] = np.arange(len(merit))
    worth: Float = expected.critical + OF_OBJECTIVE * (1.0 - np.log1p(rank) / np.log1p(len(merit)))
    return worth
