"""Shared by the metrics of perception: the truth that counts, its classes, a checked rollout.

Source of the classes' ranges and of the thresholds: the detection task of nuScenes (Caesar et al.,
nuScenes: A multimodal dataset for autonomous driving, CVPR 2020) in its configuration of 2019.
"""

from dataclasses import dataclass

import numpy as np

from bridgegen.assess.metrics.metric import recorded, shared, steps
from bridgegen.base.arrays import Bool, Float, Int, as_float
from bridgegen.drivers import kinds
from bridgegen.scenario.participants import OBJECT_CLASSES
from bridgegen.simulation.rollout import Rollout

CLASSES = ("car", "heavy vehicle", "two-wheeler", "pedestrian", "other")
"""Classes of detections and truth: kinds that sensors confuse are one class."""

RANGES = np.array([50.0, 50.0, 40.0, 40.0, 30.0])
"""[m] Per class: a box whose centre is nearer than this to the ego's reference point counts."""

THRESHOLDS = np.array([0.5, 1.0, 2.0, 4.0])
"""[m] Thresholds: a detection whose centre is nearer than this to the truth's is a hit."""

CLASS_OF_KIND = np.array([CLASSES.index(one.detection_class) for one in OBJECT_CLASSES])
"""The class of each of `bridgegen.drivers.kinds`, int64."""


@dataclass(frozen=True)
class Perceived:
    """A rollout's detections and the truth for compiled code.

    Attributes:
        half: ``(E, 2)`` float64 [m], half lengths and half widths.
        x, y, h: ``(N, E, T)`` as in the rollout.
        cosine, sine: ``(N, E, T)`` float64, of the headings.
        centre_x, centre_y: ``(N, E, T)`` float64 [m], of the boxes; unset without a frame.
        counts: ``(N, E, T)`` bool: there is a frame, and the entity is present within its class's
            range.
        classes: ``(E,)`` int64, an index of `CLASSES`.
        detections: ``(N, E, T, 8)`` as in the rollout.
        n_steps: ``(N,)`` int64 likewise.
    """

    half: Float
    x: Float
    y: Float
    h: Float
    cosine: Float
    sine: Float
    centre_x: Float
    centre_y: Float
    counts: Bool
    classes: Int
    detections: Float
    n_steps: Int


def perceived(rollout: Rollout) -> Perceived:
    """Check a rollout and find the truth that counts, once for all metrics.

    Raises:
        ValueError: it holds no detections or kinds, or malformed ones.
    """
    return shared(rollout, _perceived)


def _perceived(rollout: Rollout) -> Perceived:
    from bridgegen.assess.metrics import _detection_kernels

    n, e, t = rollout.shape
    detections = as_float("rollout.detections", rollout.detections, (n, e, t, 8), finite=False)
    entities = np.ascontiguousarray(rollout.kinds, dtype=np.int64)
    if entities.shape != (e,) or not np.isin(entities, range(len(kinds.NAMES))).all():
        raise ValueError(f"rollout.kinds must be {e} of bridgegen.drivers.kinds, got {entities}")
    box = as_float("rollout.box [m]", rollout.box, (e, 3))
    x, y, h = (recorded(rollout, field) for field in ("x", "y", "h"))
    classes, n_steps = CLASS_OF_KIND[entities], steps(rollout)
    centre_x, centre_y, counts = np.empty(x.shape), np.empty(x.shape), np.empty(x.shape, np.bool_)
    cosine, sine = rollout.direction
    if not _detection_kernels.truth(
        box, x, y, cosine, sine, detections, n_steps, RANGES[classes], centre_x, centre_y, counts
    ):
        raise ValueError("rollout.detections must be finite where there is a frame")
    if rollout.present.size:
        counts &= rollout.present
    return Perceived(
        0.5 * box[:, :2], x, y, h, cosine, sine, centre_x, centre_y, counts, classes, detections,
        n_steps,
    )  # fmt: skip
