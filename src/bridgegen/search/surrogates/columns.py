"""The columns of U as a model sees them."""

from math import prod

import numpy as np

from bridgegen.base.arrays import Float


class Columns:
    """What the columns of U are: continuous, or levels, which are equal intervals of the cube.

    Rows of one level are one scenario, so a model sees a level as one number: its place among the
    levels, 0 to 1.

    Attributes:
        levels: ``(n_var,)`` of them, per column; 0 where it is continuous.
        discrete: ``(n_var,)`` bool, which columns have levels.
        count: number of different rows; 0 where it is infinite, or beyond 2⁶².

    Args:
        n_var: number of columns.
        levels: per column the number of levels, 0 for a continuous one; empty: all continuous.

    Source: Garrido-Merchán and Hernández-Lobato (2020), doi:10.1016/j.neucom.2019.11.004, for
    kernels that round.
    """

    def __init__(self, n_var: int, levels: tuple[int, ...] = ()) -> None:
        self.levels = levels or (0,) * n_var
        numbers = np.array(self.levels, np.float64)
        self.discrete = numbers > 0.0
        count = prod(self.levels)
        self.count = count if count < 2**62 else 0
        self._of = numbers[self.discrete]

    def snapped(self, U: Float) -> Float:
        """Return rows with each level at the centre of its interval."""
        rows = U.copy()
        number = np.minimum(np.floor(U[:, self.discrete] * self._of), self._of - 1.0)
        rows[:, self.discrete] = (number + 0.5) / self._of
        return rows

    def points(self, U: Float) -> Float:
        """Return what a model sees of rows: ``(n, n_var)`` float64 in the unit cube."""
        points = U.copy()
        number = np.minimum(np.floor(U[:, self.discrete] * self._of), self._of - 1.0)
        points[:, self.discrete] = number / np.maximum(self._of - 1.0, 1.0)
        return points

    def everything(self) -> Float:
        """Return all rows there are, ``(count, n_var)``, snapped; only where there are few."""
        grids = np.meshgrid(*[(np.arange(k) + 0.5) / k for k in self._of.tolist()], indexing="ij")
        return np.stack([grid.ravel() for grid in grids], axis=1)
