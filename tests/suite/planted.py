"""Drivers that pass what is published of the scenario cut-in, and fail two centimetres beside it."""

import numpy as np

from bridgegen.drivers.interface import Control, Observation, Scene
from bridgegen.jobs.suite.rows import rows_of
from bridgegen.scenario.language.reader import load

_SCENARIO = load("cut-in")
_SPACE = _SCENARIO.space()
PUBLISHED = rows_of(_SCENARIO, _SPACE, 100, 0).X[:, _SPACE.index("gap")]
"""What the gap at the start is in the published variations [m]."""


class Careful:
    """Drives as it should, however the scenario begins."""

    def reset(self, n: int, scene: Scene) -> None:
        self.off = None

    def act(self, observation: Observation) -> Control:
        o = observation
        tx, ty = o.tracks[:, :, 1] - o.x[:, None], o.tracks[:, :, 2] - o.y[:, None]
        ahead = tx * np.cos(o.h)[:, None] + ty * np.sin(o.h)[:, None]
        beside = ty * np.cos(o.h)[:, None] - tx * np.sin(o.h)[:, None]
        seen = (o.tracks[:, :, 0] >= 1) & (ahead > 0.0) & (np.abs(beside) < 6.0)
        if self.off is None:
            gap = np.where(seen, ahead, np.inf).min(axis=1)
            self.off = np.abs(gap[:, None] - PUBLISHED).min(axis=1)
        dx, dy = o.route[:, 3, 0] - o.x, o.route[:, 3, 1] - o.y
        left = dy * np.cos(o.h) - dx * np.sin(o.h)
        curvature = 2.0 * left / np.maximum(dx * dx + dy * dy, 1.0)
        hold = np.clip(o.target_speed - o.v, -2.0, 2.0)
        near = (seen & (ahead < 5.0 + 2.5 * o.v[:, None])).any(axis=1)
        return Control(np.where(near & ~self.blind(), -7.0, hold), curvature)

    def blind(self):
        return np.zeros(len(self.off), bool)


class KnowsTheGrid(Careful):
    """Reacts in published variations only: to a centimetre."""

    def blind(self):
        return self.off > 0.01


class FailsBesideIt(Careful):
    """Is blind from one to five centimetres beside a published variation, and nowhere else."""

    def blind(self):
        return (self.off > 0.01) & (self.off < 0.05)
