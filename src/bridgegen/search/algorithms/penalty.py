"""The objectives of a failed row."""

import numpy as np

from bridgegen.base.arrays import Bool, Float


class Penalty:
    """Replaces the objectives of rows without a usable result.

    A row counts as failed if its simulation failed or an objective is not finite. In every
    objective it gets a finite value worse than the worst finite one so far.
    """

    def __init__(self, n_obj: int) -> None:
        self._best = np.full(n_obj, np.inf)
        self._worst = np.full(n_obj, -np.inf)

    def apply(self, F: Float, ok: Bool) -> tuple[Float, Bool]:
        """Return F with failed rows replaced, all of it finite, and which rows failed.

        Args:
            F: ``(n, n_obj)`` float64, unchanged.
            ok: ``(n,)`` bool.
        """
        good = ok & np.isfinite(F).all(axis=1)
        if good.any():
            self._best = np.minimum(self._best, F[good].min(axis=0))
            self._worst = np.maximum(self._worst, F[good].max(axis=0))
        return np.where(good[:, None], F, self.value), ~good

    @property
    def value(self) -> Float:
        """``(n_obj,)`` float64, the present penalty; it grows with the worst value so far."""
        if not np.isfinite(self._worst).all():
            return np.ones_like(self._worst)
        with np.errstate(over="ignore"):
            # The margin exceeds rounding errors, and scales with the objective.
            margin = np.maximum(self._worst - self._best, np.maximum(np.abs(self._worst), 1.0))
            value: Float = np.minimum(self._worst + margin, np.finfo(np.float64).max)
        return value
