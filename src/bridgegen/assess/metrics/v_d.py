"""v_d: the ego's speed at its smallest distance."""

import numpy as np

from bridgegen.assess.metrics.d_min import closest
from bridgegen.assess.metrics.metric import Metric, recorded, without_failed
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def v_d(rollout: Rollout) -> Float:
    """Return the ego's speed at the moment of d_min, the first within 1e-9 m of it.

    Returns:
        ``(N,)`` float64 [m/s], ≥ 0, ahead or in reverse: on a collision the speed at first contact;
        0 where there is no other entity; NaN where the scenario failed.

    Source: paper, Table I.
    """
    _, instant = closest(rollout)
    speed = recorded(rollout, "v")[np.arange(len(instant)), 0, instant]
    return without_failed(rollout, np.where(instant < 0, 0.0, np.abs(speed)))


METRIC = Metric(
    name="v_d",
    unit="m/s",
    description="ego speed at the moment of d_min",
    sense="larger",
    cap=0.0,
    compute=v_d,
)
