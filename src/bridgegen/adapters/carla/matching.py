"""From a detector's boxes to the rows of a rollout's detections: whose is which."""

import math
from dataclasses import dataclass

import numpy as np

from bridgegen.adapters.carla.view import View, overlap
from bridgegen.base.arrays import Bool, Float
from bridgegen.drivers import kinds as column
from bridgegen.drivers.detector import Checked

NEAR = 4.0
"""A box is at most so far from whom it stands for, centre to centre [m]: nuScenes' widest."""

ALIKE = 0.3
"""Intersection over union that a box in the image has at least with the one that it stands for."""


@dataclass(frozen=True)
class Truth:
    """The states of all entities at an instant.

    Attributes:
        states: ``(E, 4)``, see `CoSimulation.states`.
        present: ``(E,)``.
        box: ``(E, 3)``, see `Rollout.box`.
        models: ``(E, 3)`` length, width, height [m] of what is to be seen of them.
    """

    states: Float
    present: Bool
    box: Float
    models: Float

    def middle(self, e: int) -> tuple[float, float]:
        """Return the middle of an entity's box in the world [m]."""
        x, y, h = self.states[e, :3].tolist()
        ahead = float(self.box[e, 2])
        return x + ahead * math.cos(h), y + ahead * math.sin(h)

    def seen(self, e: int) -> Float:
        """Return what is to be seen of an entity, ``(7,)``, in the ego's frame; see `Boxes`."""
        x, y = self.middle(e)
        ego_x, ego_y, ego_h = self.states[0, :3].tolist()
        cos, sin = math.cos(ego_h), math.sin(ego_h)
        dx, dy = x - ego_x, y - ego_y
        length, width, height = self.models[e].tolist()
        turn = math.remainder(float(self.states[e, 2]) - ego_h, 2.0 * math.pi)
        return np.array(
            [dx * cos + dy * sin, dy * cos - dx * sin, 0.5 * height, length, width, height, turn]
        )

    def to_world(self, x: float, y: float) -> tuple[float, float]:
        """Return a point of the ego's frame in the world."""
        ego_x, ego_y, ego_h = self.states[0, :3].tolist()
        cos, sin = math.cos(ego_h), math.sin(ego_h)
        return ego_x + x * cos - y * sin, ego_y + x * sin + y * cos


def matched(answer: Checked, truth: Truth, view: View) -> Float:
    """Return the rows of an instant's detections ``(E, 8)``, see `bridgegen.drivers.kinds`.

    In order of confidence, each detection is assigned to an entity that is still free. Detections
    without an entity have no row: they are not counted.
    """
    n_entities = len(truth.states)
    rows = np.zeros((n_entities, column.DETECTION))
    free = [e for e in range(1, n_entities) if truth.present[e]]
    outlines = {e: view.outline(truth.seen(e)) for e in free}
    for i in np.argsort(-answer.confidence, kind="stable").tolist():
        if answer.boxes is not None:
            x, y = truth.to_world(float(answer.boxes[i, 0]), float(answer.boxes[i, 1]))
            found = _nearest(truth, free, x, y)
            length, width = answer.boxes[i, 3:5].tolist()
            h = float(truth.states[0, 2] + answer.boxes[i, 6])
        else:
            assert answer.pixels is not None
            found = _most_alike(outlines, free, answer.pixels[i])
            place = None if found is None else _placed(truth, found, view, answer.pixels[i])
            if found is None or place is None:
                continue
            x, y = place
            length, width = truth.box[found, :2].tolist()
            h = float(truth.states[found, 2])
        if found is None:
            continue
        free.remove(found)
        rows[found] = (
            column.CAMERA, x, y, h, length, width, answer.confidence[i], answer.kinds[i],
        )  # fmt: skip
    return rows


def _nearest(truth: Truth, free: list[int], x: float, y: float) -> int | None:
    distances = [(math.dist(truth.middle(e), (x, y)), e) for e in free]
    nearest = min(distances, default=(math.inf, 0))
    return nearest[1] if nearest[0] <= NEAR else None


def _most_alike(outlines: dict[int, Float | None], free: list[int], pixels: Float) -> int | None:
    likeness = [
        (overlap(outline, pixels), -e) for e in free if (outline := outlines[e]) is not None
    ]
    most = max(likeness, default=(0.0, 0))
    return -most[1] if most[0] >= ALIKE else None


def _placed(truth: Truth, e: int, view: View, pixels: Float) -> tuple[float, float] | None:
    """Return where a box in the image puts the middle of an entity [m].

    That is as far from the truth as the foot of the box is from the true one's; None, where either
    does not stand on the road in the image.
    """
    outline = view.outline(truth.seen(e))
    assert outline is not None
    mine, theirs = view.foot(pixels), view.foot(outline)
    if mine is None or theirs is None:
        return None
    x, y = truth.seen(e)[:2].tolist()
    return truth.to_world(x + mine[0] - theirs[0], y + mine[1] - theirs[1])
