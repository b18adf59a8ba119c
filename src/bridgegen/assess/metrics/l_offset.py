"""l_offset: the ego's largest lateral offset from its lane's centre."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, recorded, steps, without_failed
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def l_offset(rollout: Rollout) -> Float:
    """Return the ego's largest absolute lateral offset from its route's lane centre.

    Returns:
        ``(N,)`` float64 [m], ≥ 0, Frenet |d| of the reference point; NaN where the scenario
        failed.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels

    out = np.empty(rollout.shape[0])
    _kernels.largest_offset(recorded(rollout, "offset"), steps(rollout), out)
    return without_failed(rollout, out)


METRIC = Metric(
    name="l_offset",
    unit="m",
    description="largest absolute lateral offset of the ego from its lane's centre",
    sense="larger",
    cap=0.0,
    compute=l_offset,
    needs="offset",
)
