"""thw: smallest time headway of the ego."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.assess.metrics.motion import motion
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def thw(rollout: Rollout) -> Float:
    """Return the smallest time headway of the ego to any other.

    It is the time in which the ego, straight ahead at its present speed, first touches the area
    that the other's body covers now: bumper to bumper when following, and the time to the crossing
    of crossing traffic.

    Returns:
        ``(N,)`` float64 [s], 0 at contact, +inf if no body was ever in front of the moving ego,
        NaN where the scenario failed.

    Source: Jansson, Collision Avoidance Theory, Linköping 2005; Westhofen et al., Criticality
    metrics for automated driving, Arch. Comput. Methods Eng. 30 (2023) 1, with bodies for points.
    """
    from bridgegen.assess.metrics import _course_kernels

    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    _course_kernels.headway(m.half, m.x, m.y, m.cosine, m.sine, m.v, m.distance, m.n_steps, out)
    return without_failed(rollout, out)


METRIC = Metric(
    name="thw",
    unit="s",
    description="smallest time headway: until the ego is where another is now",
    sense="smaller",
    cap=10.0,  # too long to count as following; countries fine below 0.4 to 1 s
    compute=thw,
)
