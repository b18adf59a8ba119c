"""AVLite's velocity planner (PyPI's avlite 0.6.6) as a driver: its speeds along the route.

It follows the route, and slows for participants that it predicts on it; AVLite itself is unchanged.
"""

import numpy as np

from bridgegen.drivers.interface import Trajectory

STILL = 0.05
"""Speed below which a plan stands [m/s]."""


class Avlite:
    """Asks AVLite anew every 0.1 s: it keeps nothing from one plan to the next."""

    period, max_rows = 0.1, 1

    def reset(self, n, scene):
        self.scene = scene

    def act(self, o):
        from avlite.c10_perception.c11_perception_model import (
            AgentState,
            EgoState,
            PerceptionModel,
        )
        from avlite.c20_planning.c21_planning_model import GlobalPlan
        from avlite.c20_planning.c27_local_behavioral_and_velocity_planners import (
            VelocityLocalPlanner,
        )
        from avlite.c50_common.c54_trajectory_tracker import TrajectoryTracker

        scene = self.scene
        x, y, h, v = (float(each[0]) for each in (o.x, o.y, o.h, o.v))
        centre = x + scene.centre * np.cos(h), y + scene.centre * np.sin(h)
        ego = EgoState(*centre, theta=h, width=scene.width, length=scene.length, velocity=v)
        others = []
        for number, track in enumerate(o.tracks[0].tolist(), start=1):
            state, tx, ty, th, vx, vy, length, width = track[:8]
            if state >= 2:
                other = AgentState(tx, ty, theta=th, length=length, width=width)
                other.velocity, other.agent_id = float(np.hypot(vx, vy)), number
                others.append(other)
        path = [tuple(point) for point in o.route[0, :, :2].tolist()]
        speeds = [float(o.target_speed[0])] * len(path)
        tracker = TrajectoryTracker(path=path, velocity=speeds)
        plan = GlobalPlan(path[0], path[-1], path, speeds, race_mode=False, trajectory=tracker)
        world = PerceptionModel(agent_vehicles=others, ego_vehicle=ego)
        planner = VelocityLocalPlanner(plan, world)
        planner.set_global_plan(plan, ego_xy=(x, y))
        planner.step(ego)
        planner.replan(world)
        found = planner.get_local_plan()
        return timed(np.array(found.path), np.array(found.velocity), o.route[0, 0, 2])


def timed(path, speed, heading):
    """Return a path ``(K, 2)`` [m] with speeds [m/s] as a trajectory; at the end it stands."""
    speed = np.maximum(speed, 0.0)
    step = np.diff(path, axis=0)
    stands = np.flatnonzero(speed < STILL)
    n = stands[0] + 1 if len(stands) else len(path)
    mean = np.maximum(0.5 * (speed[:-1] + speed[1:])[: n - 1], STILL)
    seconds = np.hypot(step[: n - 1, 0], step[: n - 1, 1]) / mean
    h = np.append(heading, np.unwrap(np.arctan2(step[:, 1], step[:, 0])))[:n]
    time = np.cumsum(np.concatenate([[0.0], seconds, [10.0]]))
    x, y, h, v = (
        np.append(column, column[-1])[None] for column in (path[:n, 0], path[:n, 1], h, speed[:n])
    )
    return Trajectory(time, x, y, h, v)
