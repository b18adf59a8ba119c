"""What a search in the screen has found, and the choice of what the run's simulator evaluates."""

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.search.screened.compared import Compared
from bridgegen.search.screened.correction import Correction

ROOM = 8192
"""Maximum number of rows that are kept."""

APART = 0.1
"""Root mean square distance in the unit cube within which a row is nearly the same."""

OF_OBJECTIVE = 0.3
"""What the best objective counts, against certainty that a row is critical."""


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
