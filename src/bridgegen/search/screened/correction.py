"""The difference between two simulators, learnt from the rows that both have evaluated."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from bridgegen.base.arrays import Bool, Float

WIDTHS = (0.03, 0.06, 0.12, 0.25, 0.5)
"""Widths of the kernel that are tried: root mean square distance in the unit cube."""

OF_OBJECTIVE = 0.5
"""Distance of two rows between whose objectives lies the whole range of the compared rows."""

PRIOR = 1.0
"""Number of rows that the assumption counts as, that the screen is right."""

CONFIRMED, MISSED, ROWS_OF_PRIOR = 0.8, 0.02, 2.0
"""Share of the rows critical, that the screen calls critical and that it does not; and the rows
that this assumption counts as."""

MOST = 2000
"""Maximum number of compared rows that are used, the newest."""


@dataclass(frozen=True)
class Prediction:
    """What is expected of the other simulator, for N rows.

    Attributes:
        difference: ``(N, n_obj)``, to be added to the screen's objectives.
        doubt: ``(N,)`` in (0, 1], of the difference: 1 far from every compared row.
        critical: ``(N,)``, the probability that a row is critical.
    """

    difference: Float
    doubt: Float
    critical: Float


class Correction:
    """Kernel regression of the difference, and of what is critical, over parameters and objective.

    The rows near to a row count by a Gaussian kernel; its width is the one with the least error
    of each compared row, as predicted by the others. Where no row is near, the screen is right,
    and as often critical as its word has proven so far. No random numbers, no linear algebra: the
    result depends on the rows alone.

    Attributes:
        spread: ``(n_obj,)``, root mean square of the differences; 0 before any is known.

    Source: Nadaraya (1964), doi:10.1137/1109020; Watson (1964), Sankhyā A 26: 359–372.
    """

    def __init__(
        self, U: Float, by_screen: Float, F: Float, screened: Bool, critical: Bool
    ) -> None:
        """Fit the model to n compared rows.

        Args:
            U: ``(n, n_var)``.
            by_screen: ``(n, n_obj)``, finite.
            F: ``(n, n_obj)``, of the other simulator, finite.
            screened: ``(n,)``, critical by the screen.
            critical: ``(n,)``, critical by the other simulator.
        """
        U, by_screen, F = U[-MOST:], by_screen[-MOST:], F[-MOST:]
        screened, critical = screened[-MOST:], critical[-MOST:]
        self._low = by_screen.min(axis=0) if len(U) else np.zeros(by_screen.shape[1])
        extent = np.ptp(by_screen, axis=0) if len(U) else np.ones(by_screen.shape[1])
        self._extent = np.where(extent > 0.0, extent, 1.0)
        self._points, self._difference = self._placed(U, by_screen), F - by_screen
        self._critical = critical.astype(np.float64)
        self._shares = (
            _share(critical[~screened], MISSED),
            _share(critical[screened], CONFIRMED),
        )
        # Kernel regression; a Gaussian process, and a length for each parameter, were not measured.
        self._width = self._best_width()
        n_obj = by_screen.shape[1]
        self.spread = np.sqrt(np.mean(self._difference**2, axis=0)) if len(U) else np.zeros(n_obj)

    @classmethod
    def none(cls, n_var: int, n_obj: int) -> Self:
        """Return the model before any row has been compared."""
        nothing = np.empty((0, n_obj))
        return cls(np.empty((0, n_var)), nothing, nothing, np.empty(0, bool), np.empty(0, bool))

    def predict(self, U: Float, by_screen: Float, screened: Bool) -> Prediction:
        """Predict the results of rows.

        Args:
            U: ``(N, n_var)``.
            by_screen: ``(N, n_obj)``, finite.
            screened: ``(N,)``, critical by the screen.
        """
        prior = np.where(screened, self._shares[1], self._shares[0])
        if not len(self._points):
            return Prediction(np.zeros(by_screen.shape), np.ones(len(U)), prior)
        weight = _kernel(self._distance(self._placed(U, by_screen)), self._width)
        total = weight.sum(axis=1)
        return Prediction(
            _means(weight, self._difference),
            1.0 / np.sqrt(1.0 + total),
            (PRIOR * prior + (weight * self._critical).sum(axis=1)) / (PRIOR + total),
        )

    def _placed(self, U: Float, by_screen: Float) -> Float:
        """Return rows as points whose Euclidean distance is that of the kernel."""
        shares = np.clip((by_screen - self._low) / self._extent, -1.0, 2.0)
        parts = U / np.sqrt(U.shape[1]), OF_OBJECTIVE * shares / np.sqrt(shares.shape[1])
        return np.concatenate(parts, axis=1)

    def _distance(self, points: Float) -> Float:
        from scipy.spatial.distance import cdist

        found: Float = cdist(points, self._points)
        return found

    def _best_width(self) -> float:
        """Return the width with the least leave-one-out error; the smallest of equal ones."""
        if len(self._points) < 3:
            return WIDTHS[1]
        apart, scale = self._distance(self._points), np.mean(self._difference**2, axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        errors = []
        for width in WIDTHS:
            weight = _kernel(apart, width)
            np.fill_diagonal(weight, 0.0)
            left = self._difference - _means(weight, self._difference)
            errors.append(float(np.mean(left**2 / scale)))
        return WIDTHS[int(np.argmin(errors))]


def _kernel(distance: Float, width: float) -> Float:
    weight: Float = np.exp(-0.5 * (distance / width) ** 2)
    return weight


def _means(weight: Float, values: Float) -> Float:
    """Return the weighted means of columns, drawn to 0 by the prior; ``(N, n_obj)``."""
    total = PRIOR + weight.sum(axis=1)
    columns = [(weight * item).sum(axis=1) / total for item in values.T]
    return np.stack(columns, axis=1)


def _share(critical: Bool, expected: float) -> float:
    hits = float(np.count_nonzero(critical)) + ROWS_OF_PRIOR * expected
    return hits / (len(critical) + ROWS_OF_PRIOR)
