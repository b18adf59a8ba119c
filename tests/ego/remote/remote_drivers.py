"""Drivers that are served, for the tests."""

import numpy as np


class Plans:
    """Answers a trajectory; wants all."""

    wants = ("lanes", "map", "conflicts", "history")
    period = 0.2

    def reset(self, n, scene):
        self.n = n

    def act(self, observation):
        return Trajectory(len(observation.x))


class Trajectory:
    def __init__(self, n):
        self.time = np.array([0.1, 0.2])
        self.x = self.y = self.h = self.v = np.zeros((n, 2))


class Reports:
    """Reports what it is given as the message of an error."""

    def reset(self, n, scene):
        self.scene = scene

    def act(self, observation):
        o, maps = observation, self.scene.maps
        part = o.take(np.array([2, 0]))
        raise ValueError(
            f"{self.scene.names} {self.scene.kinds.dtype} {maps[0].lanes[0].id} {o.lanes} "
            f"{o.map.near.shape} {part.x.tolist()} {part.map.lights.dtype} {part.running.tolist()}"
        )


class TakesOne:
    """Can drive one scenario at a time."""

    max_rows = 1

    def reset(self, n, scene):
        assert n == 1

    def act(self, observation):
        demanded = np.clip(observation.target_speed - observation.v, -3.0, 2.0)
        return demanded, np.zeros(1)
