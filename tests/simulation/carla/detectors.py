"""Detectors of a user's, for tests."""

import numpy as np

from bridgegen.drivers.detector import Boxes
from bridgegen.drivers.kinds import CAR


class SeesRed:
    """The red of the stand-in's camera: one box round all of it."""

    def reset(self):
        pass

    def detect(self, frame):
        red = (frame.image[:, :, 0] == 255) & (frame.image[:, :, 1] == 0)
        if not red.any():
            return Boxes([], [], pixels=[])
        v, u = np.nonzero(red)
        return Boxes([CAR], [0.9], pixels=[[u.min(), v.min(), u.max() + 1, v.max() + 1]])


class SeesCorners:
    """The stand-in's LiDAR: one body's corners."""

    def reset(self):
        pass

    def detect(self, frame):
        points = frame.points[:, :3].astype(float)
        if not len(points):
            return Boxes([], [], boxes=[])
        middle = points.mean(axis=0)
        flat = points[:, :2] - middle[:2]
        first = flat[0]
        others = sorted(
            np.unique(flat.round(3), axis=0).tolist(), key=lambda p: np.hypot(*(p - first))
        )
        sides = sorted(np.hypot(*(np.array(p) - first)) for p in others)[1:3]
        width, length = sides
        along = max(others[1:3], key=lambda p: np.hypot(*(np.array(p) - first)))
        direction = np.array(along) - first
        heading = np.arctan2(direction[1], direction[0])
        height = np.ptp(points[:, 2])
        return Boxes([CAR], [1.0], boxes=[[*middle, length, width, height, heading]])


class Raises:
    def reset(self):
        pass

    def detect(self, frame):
        raise OSError("no weights")


class Nonsense:
    def reset(self):
        pass

    def detect(self, frame):
        return Boxes([CAR], [2.0], pixels=[[0, 0, 1, 1]])


class Lacks:
    def detect(self, frame):
        return None
