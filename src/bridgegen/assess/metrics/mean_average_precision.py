"""map: mean average precision, how precise and complete the ego's detections are."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.assess.metrics.perceived import CLASS_OF_KIND, RANGES, THRESHOLDS, perceived
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


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
    from bridgegen.assess.metrics import _precision_kernels

    p = perceived(rollout)
    out = np.empty(len(p.n_steps))
    _precision_kernels.mean_average_precision(
        p.x, p.y, p.centre_x, p.centre_y, p.counts, p.classes, p.detections, p.n_steps,
        CLASS_OF_KIND, RANGES, THRESHOLDS, out,
    )  # fmt: skip
    return without_failed(rollout, out)


METRIC = Metric(
    name="map",
    unit="1",
    description="mean average precision of the detections, as in nuScenes",
    sense="smaller",
    cap=1.0,
    compute=mean_average_precision,
    needs="detections",
)
