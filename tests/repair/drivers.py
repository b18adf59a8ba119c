"""Drivers with tunable numbers: one that may not brake enough, one that declares nonsense."""

from typing import ClassVar

import numpy as np


class BrakesTooLittle:
    """Brakes as much as it must behind who is ahead, but by no more than a limit."""

    tunable: ClassVar = {"limit": (1.5, 1.0, 8.0, "m/s²"), "from_": (1.0, 0.5, 1.4, "m/s²")}

    def reset(self, n, scene):
        self.scene = scene

    def act(self, o):
        cosine, sine = np.cos(o.h), np.sin(o.h)
        dx, dy = o.route[:, 3, 0] - o.x, o.route[:, 3, 1] - o.y
        curvature = 2.0 * (dy * cosine - dx * sine) / np.maximum(dx * dx + dy * dy, 1.0)
        tx, ty = o.tracks[:, :, 1] - o.x[:, None], o.tracks[:, :, 2] - o.y[:, None]
        cosine, sine, v = cosine[:, None], sine[:, None], o.v[:, None]
        ahead, beside = tx * cosine + ty * sine, ty * cosine - tx * sine
        gap = ahead - self.scene.centre - 0.5 * self.scene.length - 0.5 * o.tracks[:, :, 6]
        closing = np.maximum(0.0, v - o.tracks[:, :, 4] * cosine - o.tracks[:, :, 5] * sine)
        must = closing**2 / (2.0 * np.maximum(gap - 3.0, 0.1))
        seen = (o.tracks[:, :, 0] >= 2.0) & (np.abs(beside) < 2.0) & (ahead > 0.0)
        must = np.where(seen, must, 0.0).max(axis=1)
        brakes = -np.minimum(must, self.settings["limit"])
        hold = np.clip(o.target_speed - o.v, -2.0, 1.0)
        return np.where(must > self.settings["from_"], brakes, hold), curvature


class Fixed(BrakesTooLittle):
    tunable = None
    settings: ClassVar = {"limit": 6.0, "from_": 1.0}


class Misdeclared(BrakesTooLittle):
    tunable: ClassVar = {"limit": (9.0, 1.0, 8.0, "m/s²")}
