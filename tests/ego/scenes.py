"""Scenes for the tests of perception: bodies that move straight on, and a weather."""

import math

import numpy as np

from bridgegen.drivers import _weather_columns as column
from bridgegen.drivers import _weather_kernels
from bridgegen.drivers._perception_kernels import MEMORY, perceive
from bridgegen.drivers._tracking_kernels import TRACK, TRACKER
from bridgegen.drivers.kinds import CAR, DETECTION, PEDESTRIAN

BOX = {
    CAR: (4.5, 1.8, 1.4, 50.0, 3.0, 9.0, 0.2, 1.5),
    PEDESTRIAN: (0.5, 0.5, 0.0, 3.0, 1.0, 3.0, 1.0, 1.7),
}


def weather(**stated: float) -> np.ndarray:
    """Return the physical numbers of a clear day, but for what is stated by the columns' names."""
    numbers = np.zeros(column.WEATHER)
    _weather_kernels.set_clear(numbers)
    for name, value in stated.items():
        numbers[getattr(column, name.upper())] = value
    _weather_kernels.derive(numbers)
    return numbers


class Scene:
    """Bodies by (x, y, heading, speed, kind), the ego first, over T instants."""

    def __init__(self, *bodies: tuple, n_steps: int = 101, dt: float = 0.05) -> None:
        self.dt, self.n_steps = dt, n_steps
        e = len(bodies)
        start = np.array([body[:4] for body in bodies], dtype=np.float64)
        self.kinds = np.array([body[4] for body in bodies], dtype=np.int64)
        self.bodies = np.array([BOX[kind] for kind in self.kinds.tolist()])
        t = np.arange(n_steps) * dt
        self.h = np.repeat(start[:, 2:3], n_steps, axis=1)
        self.v = np.repeat(start[:, 3:4], n_steps, axis=1)
        self.x = start[:, 0:1] + self.v * np.cos(self.h) * t
        self.y = start[:, 1:2] + self.v * np.sin(self.h) * t
        self.n_entities = e
        self.present = np.ones(e, dtype=np.bool_)
        self.lamps = np.zeros(e, dtype=np.int64)

    def perceive(
        self, numbers: np.ndarray, key: int = 1, *, ideal: bool = False, tracker: tuple = TRACKER
    ):
        """Return the detections ``(E, T, 8)`` and the tracks of all instants ``(T, E, 13)``."""
        memory = np.zeros((self.n_entities, MEMORY))
        tracks = np.zeros((self.n_entities, TRACK))
        detections = np.full((self.n_entities, self.n_steps, DETECTION), np.nan)
        history = np.empty((self.n_steps, self.n_entities, TRACK))
        for k in range(self.n_steps):
            perceive(
                k, self.dt, np.uint64(key), ideal, self.present, self.x, self.y, self.h, self.v,
                self.bodies, self.kinds, self.lamps, numbers, tracker, memory, tracks,
                detections,
            )  # fmt: skip
            history[k] = tracks
        return detections, history

    def centre(self, e: int) -> tuple[np.ndarray, np.ndarray]:
        """Return where the box's centre of body e is, ``(T,)`` each."""
        ahead = self.bodies[e, 2]
        return self.x[e] + ahead * np.cos(self.h[e]), self.y[e] + ahead * np.sin(self.h[e])


def ahead(distance: float, kind: int = CAR, *, n_steps: int = 101, speed: float = 0.0) -> Scene:
    """Return an ego at the origin, heading +x, and one body that far ahead, centre to centre."""
    x = distance + BOX[CAR][2] - BOX[kind][2]
    return Scene((0.0, 0.0, 0.0, 0.0, CAR), (x, 0.0, 0.0, speed, kind), n_steps=n_steps)


NIGHT = {"sun_elevation": math.radians(-40.0)}
