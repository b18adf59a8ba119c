"""A driver of one's own: pursues its route and brakes for whoever is close ahead.

bridgegen validate docs/examples/my_driver.py:MyDriver
bridgegen search cut-in --ego docs/examples/my_driver.py:MyDriver
"""

import numpy as np

from bridgegen.drivers.interface import Control, Observation, Scene


class MyDriver:
    def reset(self, n: int, scene: Scene) -> None:
        self.comfort = min(2.0, scene.max_acceleration)

    def act(self, observation: Observation) -> Control:
        o = observation
        # Steer through the point of the route six metres ahead (pure pursuit).
        dx, dy = o.route[:, 3, 0] - o.x, o.route[:, 3, 1] - o.y
        left = dy * np.cos(o.h) - dx * np.sin(o.h)
        curvature = 2.0 * left / np.maximum(dx * dx + dy * dy, 1.0)
        # Hold the speed, unless somebody is less than two seconds ahead.
        tx, ty = o.tracks[:, :, 1] - o.x[:, None], o.tracks[:, :, 2] - o.y[:, None]
        ahead = tx * np.cos(o.h)[:, None] + ty * np.sin(o.h)[:, None]
        beside = ty * np.cos(o.h)[:, None] - tx * np.sin(o.h)[:, None]
        near = (o.tracks[:, :, 0] >= 2) & (np.abs(beside) < 2.0)
        near &= (ahead > 0.0) & (ahead < 2.0 * o.v[:, None])
        hold = np.clip(o.target_speed - o.v, -2.0, self.comfort)
        return Control(np.where(near.any(axis=1), -5.0, hold), curvature)
