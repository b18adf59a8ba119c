"""Rows with the results of the screen, and of the run's simulator."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.search.algorithms.algorithm import Results


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
        names = [one.name for one in fields(cls)]
        return cls(*(np.concatenate([getattr(one, name) for one in parts]) for name in names))

    def take(self, rows: Bool | Int) -> Self:
        """Return some of the rows, by a mask or by their positions."""
        return type(self)(*(getattr(self, one.name)[rows] for one in fields(self)))

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
