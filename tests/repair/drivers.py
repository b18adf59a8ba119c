"""Drivers with tunable numbers: one that begins to brake too late, one that declares nonsense."""

import numpy as np


class BrakesLate:
    """Brakes once the gap is below the way that it takes to the other's speed, and a margin."""

    tunable = {"margin": (0.0, 0.0, 2.0, "s"), "braking": (6.0, 1.0, 8.0, "m/s²")}

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
        margin, braking = self.settings["margin"], self.settings["braking"]
        near = gap < 1.0 + margin * v + closing**2 / (2.0 * braking)
        near &= (o.tracks[:, :, 0] >= 2.0) & (np.abs(beside) < 2.0) & (ahead > 0.0)
        hold = np.clip(o.target_speed - o.v, -2.0, 2.0)
        return np.where(near.any(axis=1), -braking, hold), curvature


class Fixed(BrakesLate):
    tunable = None
    settings = {"margin": 0.0, "braking": 6.0}


class Misdeclared(BrakesLate):
    tunable = {"margin": (3.0, 0.0, 2.0, "s")}
