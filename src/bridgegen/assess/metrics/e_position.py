"""e_position: position error of the ego's detections."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.assess.metrics.perceived import perceived
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def e_position(rollout: Rollout) -> Float:
    """Return the mean distance of detected box centres from the true ones.

    The mean is over the detections of all other entities within their class's range. A detection
    is matched with the entity that caused it.

    Returns:
        ``(N,)`` float64 [m], ≥ 0; 0 where nothing was detected; NaN where the scenario failed.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _detection_kernels

    p = perceived(rollout)
    out = np.empty(len(p.n_steps))
    _detection_kernels.mean_error(p.centre_x, p.centre_y, p.counts, p.detections, p.n_steps, out)
    return without_failed(rollout, out)


METRIC = Metric(
    name="e_position",
    unit="m",
    description="mean distance of detected box centres from the true ones",
    sense="larger",
    cap=0.0,
    compute=e_position,
    needs="detections",
)
