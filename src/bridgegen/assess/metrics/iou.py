"""iou: intersection over union of the ego's detections with the truth."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.assess.metrics.perceived import perceived
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


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
    from bridgegen.assess.metrics import _detection_kernels

    p = perceived(rollout)
    out = np.empty(len(p.n_steps))
    _detection_kernels.mean_iou(
        p.half, p.h, p.cosine, p.sine, p.centre_x, p.centre_y, p.counts, p.detections, p.n_steps,
        out,
    )  # fmt: skip
    return without_failed(rollout, out)


METRIC = Metric(
    name="iou",
    unit="1",
    description="mean bird's-eye IoU of the detections with the truth, a miss is 0",
    sense="smaller",
    cap=1.0,
    compute=iou,
    needs="detections",
)
