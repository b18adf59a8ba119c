"""Projection between the scene and the camera's image."""

import math
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float


@dataclass(frozen=True)
class View:
    """A level camera without distortion that looks ahead.

    Attributes:
        width: of the image [pixels].
        height: of it [pixels].
        fov: horizontal field of view [rad].
        place: ``(3,)`` [m], where it is in the ego's frame, see `bridgegen.drivers.detector`.
    """

    width: int
    height: int
    fov: float
    place: tuple[float, float, float]

    @property
    def focal(self) -> float:
        """Focal length [pixels]."""
        return 0.5 * self.width / math.tan(0.5 * self.fov)

    @property
    def intrinsics(self) -> Float:
        """See `Frame`."""
        f = self.focal
        return np.array([[f, 0.0, 0.5 * self.width], [0.0, f, 0.5 * self.height], [0.0, 0.0, 1.0]])

    def outline(self, box: Float) -> Float | None:
        """Return left, top, right, bottom of a box in the image ``(4,)``; None if it is outside.

        Args:
            box: ``(7,)`` as `Boxes.boxes` has it.
        """
        x, y, z, length, width, height, h = box.tolist()
        cos, sin = math.cos(h), math.sin(h)
        signs = np.array([(i, j, k) for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
        a, b = signs[:, 0] * length, signs[:, 1] * width
        ahead = x + a * cos - b * sin - self.place[0]
        left = y + a * sin + b * cos - self.place[1]
        up = z + signs[:, 2] * height - self.place[2]
        if ahead.min() < 0.1:
            return None
        u = 0.5 * self.width - self.focal * left / ahead
        v = 0.5 * self.height - self.focal * up / ahead
        most = (self.width, self.height)
        edges = np.array([u.min(), v.min(), u.max(), v.max()])
        edges = np.clip(edges, 0.0, [*most, *most])
        return edges if edges[2] - edges[0] > 1.0 and edges[3] - edges[1] > 1.0 else None

    def foot(self, pixels: Float) -> tuple[float, float] | None:
        """Return the ground point of a box's lower edge in the image: x, y [m] in the ego's frame.

        None, where that is above the horizon, or behind the image's lower edge.
        """
        left, _, right, bottom = pixels.tolist()
        below = bottom - 0.5 * self.height
        if below < 1.0 or bottom >= self.height - 0.5:
            return None
        ahead = self.focal * self.place[2] / below
        aside = (0.5 * self.width - 0.5 * (left + right)) * ahead / self.focal
        return self.place[0] + ahead, self.place[1] + aside


def overlap(array: Float, other: Float) -> float:
    """Return the intersection over union of two boxes in the image."""
    low, high = np.maximum(array[:2], other[:2]), np.minimum(array[2:], other[2:])
    common = float(np.prod(np.maximum(high - low, 0.0)))
    areas = (float(np.prod(box[2:] - box[:2])) for box in (array, other))
    union = sum(areas) - common
    return common / union if union > 0.0 else 0.0
