"""Metrics of perception: detections beside the truth that counts."""

from dataclasses import dataclass

import numpy as np

from bridgegen.assess.metrics.metric import Metric, recorded, shared, steps, without_failed
from bridgegen.base.arrays import Bool, Float, Int, as_float
from bridgegen.drivers import kinds
from bridgegen.scenario.participants import OBJECT_CLASSES
from bridgegen.simulation.rollout import Rollout

# --- Shared by the metrics of perception: the truth that counts, its classes, a checked rollout ---
# Source of the classes' ranges and of the thresholds: the detection task of nuScenes (Caesar et
# al., nuScenes: A multimodal dataset for autonomous driving, CVPR 2020), configuration of 2019.


CLASSES = ("car", "heavy vehicle", "two-wheeler", "pedestrian", "other")
"""Classes of detections and truth: kinds that sensors confuse are one class."""

RANGES = np.array([50.0, 50.0, 40.0, 40.0, 30.0])
"""Largest distance from the ego's reference point to the centre of a box that counts, by class
[m]."""

THRESHOLDS = np.array([0.5, 1.0, 2.0, 4.0])
"""Distances between the centres of a detection and of the truth below which the two match [m]."""

CLASS_OF_KIND = np.array(
    [CLASSES.index(object_class.detection_class) for object_class in OBJECT_CLASSES]
)
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
    from bridgegen.assess.metrics import _perception_kernels as _detection_kernels

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
        0.5 * box[:, :2],
        x,
        y,
        h,
        cosine,
        sine,
        centre_x,
        centre_y,
        counts,
        classes,
        detections,
        n_steps,
    )


# --- iou: intersection over union of the ego's detections with the truth ---


def iou(rollout: Rollout) -> Float:
    """Return the mean bird's-eye intersection over union of detections with the truth.

    The mean is over all other entities within their class's range at all instants with a sensor
    frame. A detection is matched with the entity that caused it; the boxes are oriented; an entity
    that was missed counts as 0.

    Returns:
        ``(N,)`` float64 in 0..1; +inf where there was nothing to see; NaN where the scenario
        failed.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _perception_kernels as _detection_kernels

    p = perceived(rollout)
    out = np.empty(len(p.n_steps))
    _detection_kernels.mean_iou(
        p.half,
        p.h,
        p.cosine,
        p.sine,
        p.centre_x,
        p.centre_y,
        p.counts,
        p.detections,
        p.n_steps,
        out,
    )
    return without_failed(rollout, out)


IOU = Metric(
    name="iou",
    unit="1",
    description="mean bird's-eye IoU of the detections with the truth, a miss is 0",
    sense="smaller",
    cap=1.0,
    compute=iou,
    needs="detections",
)


# --- e_position: position error of the ego's detections ---


def e_position(rollout: Rollout) -> Float:
    """Return the mean distance of detected box centres from the true ones.

    The mean is over the detections of all other entities within their class's range. A detection
    is matched with the entity that caused it.

    Returns:
        ``(N,)`` float64 [m], ≥ 0; 0 where nothing was detected; NaN where the scenario failed.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _perception_kernels as _detection_kernels

    p = perceived(rollout)
    out = np.empty(len(p.n_steps))
    _detection_kernels.mean_error(p.centre_x, p.centre_y, p.counts, p.detections, p.n_steps, out)
    return without_failed(rollout, out)


E_POSITION = Metric(
    name="e_position",
    unit="m",
    description="mean distance of detected box centres from the true ones",
    sense="larger",
    cap=0.0,
    compute=e_position,
    needs="detections",
)


# --- map: mean average precision, how precise and complete the ego's detections are ---


def mean_average_precision(rollout: Rollout) -> Float:
    """Return the mean average precision of the detections over classes and distance thresholds.

    As in nuScenes. Per class and threshold all frames' detections are taken by descending
    confidence; each is a hit if the nearest unmatched box of its class and frame is nearer than the
    threshold, centre to centre. Precision is sampled at recalls of 0.11, 0.12 … 1, linearly between
    detections and 0 beyond the last; precision below 0.1 counts as 0, and 0.1 is the zero of the
    scale. Classes are those with an entity within range. Detections of equal confidence are sorted
    by frame, then by distance from their own entity.

    Returns:
        ``(N,)`` float64 in 0..1; +inf where there was nothing to see; NaN where the scenario
        failed.

    Source: paper, Table I; Caesar et al., nuScenes, CVPR 2020, Section 3.1.
    """
    from bridgegen.assess.metrics import _perception_kernels as _precision_kernels

    p = perceived(rollout)
    out = np.empty(len(p.n_steps))
    _precision_kernels.mean_average_precision(
        p.x,
        p.y,
        p.centre_x,
        p.centre_y,
        p.counts,
        p.classes,
        p.detections,
        p.n_steps,
        CLASS_OF_KIND,
        RANGES,
        THRESHOLDS,
        out,
    )
    return without_failed(rollout, out)


MEAN_AVERAGE_PRECISION = Metric(
    name="map",
    unit="1",
    description="mean average precision of the detections, as in nuScenes",
    sense="smaller",
    cap=1.0,
    compute=mean_average_precision,
    needs="detections",
)
