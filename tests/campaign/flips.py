"""A driver that flips a fifth of its decisions: the same scenario passes and fails."""

import os

import numpy as np

from bridgegen.drivers.interface import Control


class Flips:
    """Draws by the clock, as stacks whose processes race: no seed repeats it."""

    period = 0.5

    def reset(self, n, scene):
        seeds = [int.from_bytes(os.urandom(4), "little") for _ in range(n)]
        self._begin(scene, seeds)

    def _begin(self, scene, seeds):
        self._limit = scene.max_acceleration
        self._calls = 0
        self._chances = [np.random.Generator(np.random.PCG64(seed)) for seed in seeds]

    def act(self, observation):
        o = observation
        dx, dy = o.route[:, 3, 0] - o.x, o.route[:, 3, 1] - o.y
        left = dy * np.cos(o.h) - dx * np.sin(o.h)
        curvature = 2.0 * left / np.maximum(dx * dx + dy * dy, 1.0)
        tx, ty = o.tracks[:, :, 1] - o.x[:, None], o.tracks[:, :, 2] - o.y[:, None]
        ahead = tx * np.cos(o.h)[:, None] + ty * np.sin(o.h)[:, None]
        beside = ty * np.cos(o.h)[:, None] - tx * np.sin(o.h)[:, None]
        near = (o.tracks[:, :, 0] >= 2) & (np.abs(beside) < 2.5)
        near &= (ahead > 0.0) & (ahead < 2.0 * o.v[:, None])
        if self._calls % 4 == 0:  # a decision lasts for two seconds
            self._flipped = np.array([each.random() for each in self._chances]) < 0.2
        self._calls += 1
        brakes = near.any(axis=1) & ~self._flipped
        hold = np.clip(o.target_speed - o.v, -2.0, min(2.0, self._limit))
        return Control(np.where(brakes, -6.0, hold), curvature)


class FlipsBySeed(Flips):
    """Draws by the seeds that it is given."""

    wants = ("seed",)

    def reset(self, n, scene):
        assert scene.seed.shape == (n,)
        self._begin(scene, scene.seed.tolist())
