"""speed_reduction: how much slower the ego is at its first contact than at the start."""

import numpy as np

from bridgegen.assess.metrics.impact import at_contact, first_contact
from bridgegen.assess.metrics.metric import Metric, recorded, without_failed
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def speed_reduction(rollout: Rollout) -> Float:
    """Return the ego's speed at the start less that at its first contact.

    Returns:
        ``(N,)`` float64 [m/s]; below 0 if it is faster then; +inf without a contact; NaN where the
        scenario failed.

    Source: Vreduction of Euro NCAP's Crash Avoidance protocol, Frontal Collisions, 1.1 (2025);
    its test speed is the ego's first speed.
    """
    _, instant = first_contact(rollout)
    before, after = recorded(rollout, "v")[:, 0, 0], at_contact(rollout, "v")[:, 0]
    reduction = np.abs(before) - np.abs(after)
    return without_failed(rollout, np.where(instant < 0, np.inf, reduction))


METRIC = Metric(
    name="speed_reduction",
    unit="m/s",
    description="ego speed at the start less that at its first contact",
    sense="smaller",
    cap=60.0,  # more than any vehicle is fast
    compute=speed_reduction,
)
