"""A planner of one's own: five times a second, a trajectory along the route that keeps its gap.

bridgegen validate docs/examples/my_planner.py:MyPlanner
bridgegen search cut-in --ego docs/examples/my_planner.py:MyPlanner
"""

import numpy as np

from bridgegen.drivers.interface import ROUTE_STEP, Observation, Scene, Trajectory

TIME = np.linspace(0.0, 3.0, 31)  # s from now
GAP, HEADWAY = 3.0, 1.5  # m at standstill, s
BACK = 20.0  # m, within which the plan is back in the middle of the route


class MyPlanner:
    period = 0.2  # s from one plan to the next; each is followed meanwhile

    def reset(self, n: int, scene: Scene) -> None:
        self.scene = scene

    def act(self, observation: Observation) -> Trajectory:
        o = observation
        a = np.minimum(self.free(o), self.behind(o))[:, None]
        braking = np.minimum(a, -1e-9)
        t = np.where(a < 0.0, np.minimum(TIME, o.v[:, None] / -braking), TIME)  # until it stands
        return self.along(o, o.v[:, None] * t + 0.5 * a * t * t, o.v[:, None] + a * t)

    def free(self, o: Observation) -> np.ndarray:
        """Reach the speed that is asked for, slowly enough for the bends; stop at a red light."""
        bend = np.abs(o.route[:, :, 3]).max(axis=1)
        speed = np.minimum(o.target_speed, np.sqrt(2.0 / np.maximum(bend, 1e-3)))
        stops = np.isfinite(o.stop_distance) & np.isin(o.light, (1, 2, 3))
        halt = -0.5 * o.v**2 / np.maximum(o.stop_distance - 1.0, 0.5)
        wanted = np.clip(speed - o.v, -3.0, 1.5)
        return np.where(stops & (halt < -1.0) & (halt > -6.0), np.minimum(wanted, halt), wanted)

    def behind(self, o: Observation) -> np.ndarray:
        """Keep the gap to whoever is nearest on the route."""
        off = o.tracks[:, :, None, 1:3] - o.route[:, None, :, :2]
        distance = np.hypot(off[..., 0], off[..., 1])
        point = distance.argmin(axis=2)
        h = np.take_along_axis(o.route[:, :, 2], point, axis=1)
        speed = o.tracks[:, :, 4] * np.cos(h) + o.tracks[:, :, 5] * np.sin(h)
        gap = ROUTE_STEP * point - 0.5 * (o.tracks[:, :, 6] + self.scene.length) - self.scene.centre
        spare = gap - GAP - HEADWAY * o.v[:, None]
        a = np.clip(0.4 * spare + 0.8 * (speed - o.v[:, None]), -8.0, 1.5)
        on = (o.tracks[:, :, 0] >= 2) & (distance.min(axis=2) < 2.0) & (point > 0)
        return np.where(on, a, 1.5).min(axis=1, initial=1.5)

    def along(self, o: Observation, s: np.ndarray, v: np.ndarray) -> Trajectory:
        """Place the trajectory on the route; a cubic leads from the ego back to it."""
        i = np.minimum((s / ROUTE_STEP).astype(int), o.route.shape[1] - 2)
        here, there = (np.take_along_axis(o.route, j[:, :, None], axis=1) for j in (i, i + 1))
        x, y, h, _ = np.moveaxis(here + (s / ROUTE_STEP - i)[:, :, None] * (there - here), 2, 0)
        u, slope = np.minimum(s / BACK, 1.0), np.tan(np.clip(o.h - o.route[:, 0, 2], -1.0, 1.0))
        d0, d1 = o.offset[:, None], BACK * slope[:, None]
        d = (1.0 - u) ** 2 * (d0 * (1.0 + 2.0 * u) + d1 * u)
        turned = np.arctan((1.0 - u) * (d1 * (1.0 - 3.0 * u) - 6.0 * d0 * u) / BACK)
        return Trajectory(TIME, x - d * np.sin(h), y + d * np.cos(h), h + turned, v)
