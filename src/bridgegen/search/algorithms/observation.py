"""The generator as an agent: observations, actions as rows, rewards.

Shared by the algorithms of deep reinforcement learning and by the public environments.
"""

from typing import Literal

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float
from bridgegen.search.algorithms.algorithm import Problem

Observation = npt.NDArray[np.float32]
Encoding = Literal["step", "row"]
ENCODINGS: tuple[Encoding, ...] = ("step", "row")

LARGEST = 1000.0
"""Magnitude of a metric, in its own unit, that is observed as ±1; larger ones are clipped."""


class Observer:
    """Converts rows and their metrics to observations: finite numbers in [−1, 1].

    First the row, [0, 1] → [−1, 1]. Then each metric m as sign(m)·ln(1 + |m|)/ln(1 + LARGEST): fine
    near 0, where collisions are, and coarse far away. A value less critical than its metric's cap,
    including +inf, becomes the cap; NaN, of a failed scenario, becomes 0.

    The conflict analysis is not observed, only the metrics.

    Args:
        problem: with the names of parameters and metrics; unknown metrics have no cap.
    """

    def __init__(self, problem: Problem) -> None:
        from bridgegen.assess.conflict.quantities import MEASURED
        from bridgegen.assess.metrics import METRICS

        self._seen = [j for j, name in enumerate(problem.metrics) if name not in MEASURED]
        known = [METRICS.get(problem.metrics[j]) for j in self._seen]
        self._sign = np.array([1.0 if metric is None else metric.sign for metric in known])
        # What is infinite (no collision ever) is observed as the metric's cap.
        floor = [-np.inf if metric is None else metric.sign * metric.cap for metric in known]
        self._floor = np.array(floor, dtype=np.float64)
        self.size = problem.n_var + len(known)

    def __call__(self, U: Float, metrics: Float) -> Observation:
        """Return ``(n, size)`` float32.

        Args:
            U: ``(n, n_var)`` in [0, 1].
            metrics: ``(n, len(problem.metrics))`` in the metrics' units.
        """
        seen = metrics[:, self._seen]
        value = self._sign * np.maximum(self._sign * seen, self._floor)
        small = np.sign(value) * np.log1p(np.abs(value)) / np.log1p(LARGEST)
        small = np.clip(np.nan_to_num(small, nan=0.0), -1.0, 1.0)
        return np.hstack([2.0 * U - 1.0, small]).astype(np.float32)


class Reward:
    """−F, scaled by the first results: their median becomes 0, their quartiles are 1 apart.

    Clipped to ±`LIMIT`; a failed scenario has −`LIMIT`. The scale is constant from then on, so that
    rewards are comparable throughout a run.
    """

    LIMIT = 5.0

    def __init__(self) -> None:
        self.scale = np.array([0.0, 0.0, 0.0])
        """Whether it is set, centre, spread; changed in place."""

    def __call__(self, F: Float, ok: Bool) -> npt.NDArray[np.float32]:
        """Return ``(n,)`` float32, finite.

        Args:
            F: ``(n,)``, smaller is more critical; anything where not ok.
            ok: ``(n,)``.
        """
        good = ok & np.isfinite(F)
        if not self.scale[0] and good.any():
            low, centre, high = np.quantile(F[good], (0.25, 0.5, 0.75), method="lower")
            with np.errstate(over="ignore"):
                self.scale[:] = 1.0, centre, abs(high - low)  # −0 − 0 is −0
        _, centre, spread = self.scale
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            # Where all were equal, better is LIMIT, worse is −LIMIT, and equal (0/0) is 0.
            scaled = np.nan_to_num((centre - F) / spread, nan=0.0)
        reward = np.clip(np.where(good, scaled, -self.LIMIT), -self.LIMIT, self.LIMIT)
        return reward.astype(np.float32)


def step_from(U: Float, move: Float) -> Float:
    """Return the rows displaced by ``move``, reflected at the faces of the cube.

    Args:
        U: ``(n, n_var)`` in [0, 1].
        move: ``(n, n_var)``, finite.
    """
    there = np.mod(U + move, 2.0)
    rows: Float = np.clip(np.minimum(there, 2.0 - there), 0.0, 1.0)
    return rows
