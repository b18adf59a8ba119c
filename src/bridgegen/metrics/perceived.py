"""What the metrics of perception share: which truth counts, and as what; and a rollout, checked.

Source of the classes' ranges and of the thresholds: the detection task of nuScenes (Caesar et al.,
nuScenes: A multimodal dataset for autonomous driving, CVPR 2020) in its configuration of 2019.
"""

from dataclasses import dataclass

import numpy as np

from bridgegen.arrays import Float, Int, as_float
from bridgegen.ego import kinds
from bridgegen.metrics.metric import recorded, shared, steps
from bridgegen.simulation.rollout import Rollout

CLASSES = ("car", "heavy vehicle", "two-wheeler", "pedestrian", "other")
"""What detections and the truth are sorted into: kinds that sensors take for each other are one."""

RANGES = np.array([50.0, 50.0, 40.0, 40.0, 30.0])
"""[m] Per class: a box whose centre is nearer than this to the ego's reference point counts."""

THRESHOLDS = np.array([0.5, 1.0, 2.0, 4.0])
"""[m] A detection whose centre is nearer than this to the truth's is a hit, for each once."""

CLASS_OF_KIND = np.array(
    [
        {"car": 0, "truck": 1, "bus": 1, "motorbike": 2, "bicycle": 2, "pedestrian": 3}.get(kind, 4)
        for kind in kinds.NAMES
    ]
)
"""``(8,)`` int64, the class of each of `bridgegen.ego.kinds`."""


@dataclass(frozen=True)
class Perceived:
    """A rollout's detections and the truth, as compiled code takes them.

    Attributes:
        box: ``(E, 3)`` as the rollout has it.
        x, y, h: ``(N, E, T)`` likewise.
        kinds: ``(E,)`` int64 likewise.
        detections: ``(N, E, T, 8)`` likewise.
        n_steps: ``(N,)`` int64 likewise.
    """

    box: Float
    x: Float
    y: Float
    h: Float
    kinds: Int
    detections: Float
    n_steps: Int


def perceived(rollout: Rollout) -> Perceived:
    """Check a rollout, once for all metrics.

    Raises:
        ValueError: it holds no detections or kinds, or malformed ones.
    """
    return shared(rollout, _checked)


def _checked(rollout: Rollout) -> Perceived:
    n, e, t = rollout.shape
    detections = as_float("rollout.detections", rollout.detections, (n, e, t, 8))
    entities = np.ascontiguousarray(rollout.kinds, dtype=np.int64)
    if entities.shape != (e,) or not np.isin(entities, range(len(kinds.NAMES))).all():
        raise ValueError(f"rollout.kinds must be {e} of bridgegen.ego.kinds, got {entities}")
    box = as_float("rollout.box [m]", rollout.box, (e, 3))
    x, y, h = (recorded(rollout, field) for field in ("x", "y", "h"))
    return Perceived(box, x, y, h, entities, detections, steps(rollout))
